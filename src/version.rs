//! The program's version, as written into every file and state.

/// Version of the program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Who holds the rights, as in the licences.
pub const COPYRIGHT: &str = "Copyright (c) 2026 swarf contributors";

/// When this version was made (UTC): a constant that changes with the version and not with the build, so that
/// equal sources give equal files.
pub const DATE: &str = "2026-12-01T00:00:00Z";
