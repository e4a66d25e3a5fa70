//! swarf: metal cutting with the generalized interpolation material point method, as an FMI 2.0 co-simulation unit.
//!
//! The modules from ground floor to top; each uses only those above it in this list.

pub mod error;
pub mod scene;
pub mod session;

/// Version of the program, as written into every file.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

pub use error::Error;
pub use scene::Scene;
pub use session::Session;
