//! The program's version, as written into every file and state.

/// Version of the program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
