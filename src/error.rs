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
                    let hint = hint(*asked, [*min, *max], unit.trim_start());
                    write!(
                        f,
                        "{name} = {asked}{unit} is outside [{min}, {max}]{unit}; the old value is kept{hint}"
                    )
                } else {
                    write!(
                        f,
                        "{name} = {asked} is not a finite number; allowed is [{min}, {max}]{unit}; the old \
                         value is kept"
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

/// What was probably meant by a value out of range: units are SI, people think in millimetres, degrees and
/// Celsius.
fn hint(asked: f64, [min, max]: [f64; 2], unit: &str) -> String {
    let fits = |value: f64| (min..=max).contains(&value);
    // Divided: decimal fractions stay short.
    let (millimetres, micrometres) = (asked / 1e3, asked / 1e6);
    match unit {
        "m" if fits(millimetres) => format!("; SI: metres; {asked} mm is {millimetres:e}"),
        "m" if fits(micrometres) => format!("; SI: metres; {asked} µm is {micrometres:e}"),
        "rad" if fits(asked.to_radians()) => {
            format!("; SI: radians; {asked} deg is {:.4}", asked.to_radians())
        }
        "K" if fits(asked + ZERO_CELSIUS) => {
            format!("; SI: kelvin; {asked} degC is {:.2}", asked + ZERO_CELSIUS)
        }
        _ => String::new(),
    }
}

/// Temperature of 0 degC (K).
pub(crate) const ZERO_CELSIUS: f64 = 273.15;

#[cfg(test)]
mod tests {
    use super::*;

    fn text(name: &str, asked: f64, [min, max]: [f64; 2], unit: &'static str) -> String {
        Error::OutOfRange { name: name.into(), asked, min, max, unit }.to_string()
    }

    /// Who writes millimetres, micrometres, degrees or Celsius learns the value in SI units; who is out of
    /// range in any of them, or writes another quantity, is told no unit.
    #[test]
    fn a_slip_of_units_is_answered_with_the_value_meant() {
        let cases = [
            (text("feed", 0.3, [-1e-3, 9.6e-4], "m"), "feed = 0.3 m is", "; SI: metres; 0.3 mm is 3e-4"),
            (text("feed", -0.5, [-1e-3, 9.6e-4], "m"), "feed = -0.5 m is", "; SI: metres; -0.5 mm is -5e-4"),
            (text("numerics.point_spacing", 0.01, [1e-7, 1e-3], "m"), "", "; SI: metres; 0.01 mm is 1e-5"),
            (text("numerics.point_spacing", 10.0, [1e-7, 1e-3], "m"), "", "; SI: metres; 10 µm is 1e-5"),
            (text("tool.edge_radius", 0.02, [0.0, 1e-3], "m"), "", "; SI: metres; 0.02 mm is 2e-5"),
            (text("workpiece.length", 3.0, [1e-4, 1.0], "m"), "", "; SI: metres; 3 mm is 3e-3"),
            (text("tool.rake_angle", 10.0, [-1.0, 1.0], "rad"), "", "; SI: radians; 10 deg is 0.1745"),
            (text("workpiece.initial_temperature", -20.0, [1.0, 5000.0], "K"), "", "; -20 degC is 253.15"),
            (text("workpiece.length", 1e9, [1e-4, 1.0], "m"), "", "; the old value is kept"),
            (text("tool.rake_angle", 100.0, [-1.0, 1.0], "rad"), "", "; the old value is kept"),
            (text("tool_velocity", 900.0, [-500.0, 500.0], "m/s"), "", "; the old value is kept"),
            (text("friction", 20.0, [0.0, 10.0], "1"), "", "; the old value is kept"),
        ];
        for (text, begin, end) in cases {
            assert!(text.starts_with(begin) && text.ends_with(end), "{text}");
        }
    }
}
