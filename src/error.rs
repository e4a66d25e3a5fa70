//! What can go wrong, in words a user of the FMU understands.
//!
//! A text says what was asked, what is allowed and what holds now, with the variable's name as the user knows
//! it.

use std::fmt;

/// Every error of the crate.
#[derive(Debug, Clone, PartialEq)]
pub enum Error {
    /// A value outside its allowed range, or not finite.
    OutOfRange {
        /// The variable as the user knows it.
        name: String,
        /// The value asked for.
        asked: f64,
        /// The smallest value allowed.
        min: f64,
        /// The largest value allowed.
        max: f64,
        /// SI unit of the three.
        unit: &'static str,
    },
    /// A value whose effect this version does not have.
    NotAvailable {
        /// The variable as the user knows it.
        name: String,
        /// The value asked for.
        asked: String,
        /// What this version offers.
        allowed: String,
    },
    /// Values that do not go together; the text says which and why.
    Inconsistent(String),
    /// The solver could not go on; the text says where, when and what to change.
    Unstable(String),
    /// Serialised data that is damaged or belongs to another version.
    DamagedState(String),
    /// A file could not be read or written.
    File {
        /// The path asked for.
        path: String,
        /// What the system said.
        reason: String,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::OutOfRange { name, asked, min, max, unit } => {
                let unit = if *unit == "1" { String::new() } else { format!(" {unit}") };
                if asked.is_finite() {
                    write!(f, "{name} = {asked}{unit} is outside [{min}, {max}]{unit}; the old value is kept")
                } else {
                    write!(
                        f,
                        "{name} = {asked} is not a finite number; allowed is [{min}, {max}]{unit}; the old value is kept"
                    )
                }
            }
            Error::NotAvailable { name, asked, allowed } => {
                write!(
                    f,
                    "{name} = {asked} is not available in version {}; allowed: {allowed}",
                    crate::version::VERSION
                )
            }
            Error::Inconsistent(text) | Error::Unstable(text) => f.write_str(text),
            Error::DamagedState(text) => {
                write!(f, "serialised state refused: {text}; the instance is unchanged")
            }
            Error::File { path, reason } => write!(f, "cannot use file '{path}': {reason}"),
        }
    }
}

impl std::error::Error for Error {}
