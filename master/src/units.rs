//! Times as people write them.

use swarf::variables::real_from_text;
pub use swarf::variables::time_text;

use crate::arguments::A_TIME;

/// A variable of the FMU that is a time: `--stop` and `--step` take the units that it takes.
const VARIABLE: &str = "results.interval";

/// A time above zero (s), from text as `--set` reads it: `40us`, `0.5 µs`, `4e-5`.
///
/// # Errors
/// Says what is needed.
pub fn seconds(option: &str, text: &str) -> Result<f64, String> {
    let number = real_from_text(VARIABLE, text).ok().flatten();
    let number = number.filter(|value| value.is_finite() && *value > 0.0);
    number.ok_or_else(|| format!("{option} {text}: {A_TIME}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A user writes a time as in `--set`; what is no time above zero is refused with examples.
    #[test]
    fn times_are_read_with_units() {
        for (text, expected) in [
            ("40us", 4e-5),
            ("0.5us", 5e-7),
            ("0.04 ms", 4e-5),
            ("40 µs", 4e-5),
            ("4e-5", 4e-5),
            ("4e-5 s", 4e-5),
        ] {
            let read = seconds("--stop", text).unwrap();
            // One division by a power of ten.
            assert!((read - expected).abs() <= f64::EPSILON * expected, "'{text}' gave {read} s");
        }
        for text in ["0", "-1", "-40us", "40um", "soon", "", "inf", "NaN"] {
            let error = seconds("--stop", text).unwrap_err();
            assert!(error.starts_with("--stop") && error.contains("40us"), "'{text}' gave: {error}");
        }
    }
}
