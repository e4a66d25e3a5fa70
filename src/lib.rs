//! swarf: metal cutting with the generalized interpolation material point method, as an FMI 2.0 co-simulation unit.
//!
//! The modules from ground floor to top; each uses only those above it in this list.

pub mod error;
pub mod simd;
pub mod dimension;
pub mod shape;
pub mod scene;
pub mod tool_shape;
pub mod points;
pub mod material;
pub mod grid;
pub mod contact;
pub mod body_force;
pub mod transfer;
pub mod chunk;
pub mod ledger;
pub mod partition;
pub mod inertia;
pub mod window;
pub mod touching;
pub mod locking;
pub mod levels;
pub mod simulation;
pub mod composition;
pub mod chip;
pub mod fields;
pub mod vtk;
pub mod results;
#[cfg(feature = "plot")]
pub mod plot;
pub mod parallel;
#[cfg(feature = "study")]
pub mod study;
pub mod session;
pub mod variables;
pub mod fmi;

/// Version of the program, as written into every file.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

pub use error::Error;
pub use scene::Scene;
pub use session::Session;
