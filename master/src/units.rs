//! Times as people write them.

use swarf::variables::real_from_text;

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

/// A time in the unit that gives it a number between 1 and 1000, with at most seven digits.
///
/// * `seconds`: (s)
pub fn time_text(seconds: f64) -> String {
    let size = seconds.abs();
    let (factor, unit) = match size {
        0.0 => return "0 s".into(),
        _ if size >= 1.0 => (1.0, "s"),
        _ if size >= 1e-3 => (1e3, "ms"),
        _ if size >= 1e-6 => (1e6, "µs"),
        _ => (1e9, "ns"),
    };
    let shown = factor * seconds;
    // An exponent's digits say how many stand before the point.
    let before = (shown.abs().log10().floor() as i32 + 1).clamp(1, 7) as usize;
    let text = format!("{shown:.*}", 7 - before);
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{text} {unit}")
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

    /// Messages carry neither exponents nor the noise of a sum of steps, and no digit that counts is lost.
    #[test]
    fn times_are_written_as_people_write_them() {
        let cases = [
            (1.0, "1 s"),
            (4e-5, "40 µs"),
            (1.000001e-6, "1.000001 µs"),
            (3.0 * 1e-6, "3 µs"),
            (5e-7, "500 ns"),
            (2.5e-3, "2.5 ms"),
            (120.0, "120 s"),
            (1e-11, "0.01 ns"),
            (0.0, "0 s"),
        ];
        for (seconds, expected) in cases {
            assert_eq!(time_text(seconds), expected);
        }
    }
}
