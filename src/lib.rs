//! swarf: metal cutting with the generalized interpolation material point method, as an FMI 2.0 co-simulation
//! unit.
//!
//! The modules from ground floor to top; each uses only those above it in this list.

mod version;
mod error;
mod parallel;
pub mod simd;
pub mod checkpoint;
pub mod dimension;
pub mod scene;
pub mod variables;
pub mod tool;
pub mod points;
pub mod material;
pub mod grid;
pub mod transfer;
pub mod partition;
mod chip_separation;
mod energy;
pub mod stabilization;
mod speedups;
pub mod contact;
pub mod heat;
pub mod simulation;
pub mod output;
pub mod setup;
pub mod session;
pub mod fmi;
#[cfg(feature = "study")]
pub mod study;

pub use error::Error;
pub use scene::Scene;
pub use session::Session;
pub use version::VERSION;
