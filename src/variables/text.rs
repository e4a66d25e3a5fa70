//! Variables as text: set by name, list, suggest.

use super::{Causality, Kind, Real, Variable, all, by_name};
use crate::Error;
use crate::scene::Scene;

/// Sets a parameter or the start of an input by its name, from text as a user types it.
///
/// * `name`: as in the variable table, `tool.rake_angle`
/// * `text`: a number in SI units (`0.17`) or with one of the variable's units (`10 deg`); `true` or `false`;
///   an item of an enumeration by name or number; any text for a String
///
/// # Errors
/// An unknown name (with the nearest one), an output, a text that is no value of the type, a value out of
/// range. The scene is unchanged then.
pub fn set_by_name(scene: &mut Scene, name: &str, text: &str) -> Result<(), Error> {
    let Some(variable) = by_name(name) else {
        let hint = nearest_name(name).map(|near| format!("; did you mean '{near}'?")).unwrap_or_default();
        return Err(Error::Inconsistent(format!("there is no variable '{name}'{hint}")));
    };
    if variable.causality() == Causality::Output {
        return Err(Error::Inconsistent(format!("{name} is an output and cannot be set")));
    }
    match &variable.kind {
        Kind::Real(real) => {
            let value = quantity(name, real, text)?;
            real.check(name, value)?;
            real.access.set_start(scene, value);
        }
        Kind::Integer(integer) => {
            let value = text.trim().parse().map_err(|_| malformed(name, text, "a whole number"))?;
            integer.check(name, value)?;
            integer.access.set_start(scene, value);
        }
        Kind::Boolean(access) => {
            let value = match text.trim() {
                "true" | "1" => true,
                "false" | "0" => false,
                _ => return Err(malformed(name, text, "true or false")),
            };
            access.set_start(scene, value);
        }
        Kind::Text(access) => {
            access.set_start(scene, text.to_owned());
        }
        Kind::Choice(choice) => {
            let item = text.trim();
            let number = choice.of.number_of(item).or_else(|| item.parse().ok());
            let number = number.filter(|number| choice.of.name_of(*number).is_some());
            let (asked, allowed) = (item.to_owned(), choice.of.list());
            let number =
                number.ok_or_else(|| Error::NotAvailable { name: name.to_owned(), asked, allowed })?;
            choice.access.set_start(scene, number);
        }
    }
    Ok(())
}

/// The value of a Real in its SI unit, from text as a user types it: `0.17`, `10 deg`; `None` for a variable
/// that is unknown or no Real.
///
/// # Errors
/// A text that is no number, or a unit that does not fit.
pub fn real_from_text(name: &str, text: &str) -> Result<Option<f64>, Error> {
    match by_name(name).map(|variable| &variable.kind) {
        Some(Kind::Real(real)) => quantity(name, real, text).map(Some),
        _ => Ok(None),
    }
}

/// A number with or without one of the variable's units, in SI.
fn quantity(name: &str, real: &Real, text: &str) -> Result<f64, Error> {
    parse_quantity(real, text).ok_or_else(|| malformed(name, text, &number_hint(real)))
}

/// All parameters and inputs in use: name, value and unit (empty where there is none).
pub fn values_in_use(scene: &Scene) -> Vec<(&'static str, String, &'static str)> {
    let mut values = Vec::new();
    for variable in all() {
        let unit = if let Kind::Real(real) = &variable.kind { real.unit.name } else { "" };
        if let Some(value) = start_text(variable, scene) {
            values.push((variable.name, value, if unit == "1" { "" } else { unit }));
        }
    }
    values
}

/// The variable whose name looks most like a mistyped one, if any is near.
pub fn nearest_name(name: &str) -> Option<&'static str> {
    let settable = all().filter(|variable| variable.causality() != Causality::Output);
    let (distance, near) = settable
        .map(|variable| {
            // A user who forgets the group ("rake_angle") means the variable all the same.
            let last = variable.name.rsplit('.').next().unwrap_or(variable.name);
            let distance = edit_distance(name, variable.name).min(edit_distance(name, last) + 1);
            (distance, variable.name)
        })
        .min()?;
    (distance <= 2 + name.chars().count() / 4).then_some(near)
}

/// A real number in the shortest form that reads back as the same number.
pub fn format_real(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || (1e-3..1e6).contains(&size) { format!("{value}") } else { format!("{value:e}") }
}

/// A time (s) in the unit that gives it a number between 1 and 1000: `1.000001 µs`; with at most ten digits,
/// which tell apart what counts as different times and leave out what sums of steps add.
pub fn time_text(seconds: f64) -> String {
    scaled(seconds, &[(1.0, "s"), (1e3, "ms"), (1e6, "µs"), (1e9, "ns")])
}

/// A length (m) in the unit that gives it a number between 1 and 1000: `0.3 mm` is `300 µm`.
pub fn length_text(metres: f64) -> String {
    scaled(metres, &[(1.0, "m"), (1e3, "mm"), (1e6, "µm"), (1e9, "nm")])
}

/// A value in the first unit of which it has one or more; the last where it is smaller.
///
/// * `units`: units per unit of the value, and their names
fn scaled(value: f64, units: &[(f64, &str); 4]) -> String {
    /// Digits that are shown at most.
    const DIGITS: i32 = 10;
    if value == 0.0 || !value.is_finite() {
        return format!("{value} {}", units[0].1);
    }
    // Rounding of the factor must not show 1 µs as 1000 ns.
    let fits = |factor: f64| (factor * value).abs() >= 1.0 - 1e-12;
    let (factor, unit) = units.iter().find(|(factor, _)| fits(*factor)).unwrap_or(&units[3]);
    let shown = factor * value;
    let before = (shown.abs().log10().floor() as i32 + 1).clamp(-DIGITS, DIGITS);
    let text = format!("{shown:.*}", (DIGITS - before) as usize);
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{text} {unit}")
}

/// The start value as `set_by_name` reads it; none for an output.
pub(super) fn start_text(variable: &Variable, scene: &Scene) -> Option<String> {
    match &variable.kind {
        Kind::Real(real) => real.access.start(scene).map(format_real),
        Kind::Integer(integer) => integer.access.start(scene).map(|value| value.to_string()),
        Kind::Boolean(access) => access.start(scene).map(|value| value.to_string()),
        Kind::Text(access) => access.start(scene),
        Kind::Choice(choice) => {
            let number = choice.access.start(scene)?;
            choice.of.name_of(number).map(str::to_owned)
        }
    }
}

/// A number, alone or followed by the variable's unit or one of its display units, in the variable's unit.
fn parse_quantity(real: &Real, text: &str) -> Option<f64> {
    let text = text.trim();
    if let Ok(value) = text.parse() {
        return Some(value);
    }
    // The longest prefix that is a number; the rest must be a unit ("1e-3 m", "0.3mm", "10 deg").
    let (number, unit) = text.char_indices().rev().find_map(|(cut, _)| {
        let (number, unit) = text.split_at(cut);
        Some((number.trim().parse::<f64>().ok()?, unit.trim()))
    })?;
    if unit == real.unit.name {
        return Some(number);
    }
    // Keyboards lack the micro sign: um and us mean µm and µs.
    let is_named = |name: &str| unit == name || (name.starts_with('µ') && unit == name.replacen('µ', "u", 1));
    real.unit.displays.iter().find(|display| is_named(display.name)).map(|display| display.to_unit(number))
}

fn number_hint(real: &Real) -> String {
    let mut units: Vec<&str> = real.unit.displays.iter().map(|display| display.name).collect();
    units.insert(0, real.unit.name);
    format!("a number, without unit in {}, or with one of: {}", real.unit.name, units.join(", "))
}

fn malformed(name: &str, text: &str, expected: &str) -> Error {
    Error::Inconsistent(format!("{name} = '{text}' cannot be read; expected is {expected}"))
}

/// Fewest insertions, deletions and replacements between two words (Levenshtein).
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Heat, ShapeChoice};

    fn set(name: &str, text: &str) -> Result<Scene, Error> {
        let mut scene = Scene::default();
        let result = set_by_name(&mut scene, name, text);
        if result.is_err() {
            assert_eq!(scene, Scene::default(), "a refused {name} = {text} changed the scene");
        }
        result.map(|()| scene)
    }

    /// Every way a user writes a value means the same value.
    #[test]
    fn values_are_read_in_any_unit_of_the_variable() {
        for text in ["3e-4", " 0.0003 ", "0.3 mm", "0.3mm", "300 µm", "300um", "3e-4 m"] {
            let feed = set("feed", text).unwrap().inputs.feed;
            // 300 µm and 0.3 mm are one division away from 3e-4.
            assert!((feed - 3e-4).abs() <= 2.0 * f64::EPSILON * 3e-4, "{text} was read as {feed}");
        }
        assert_eq!(set("tool.rake_angle", "10 deg").unwrap().tool.rake_angle, 10f64.to_radians());
        let scene = set("workpiece.initial_temperature", "25 degC").unwrap();
        assert_eq!(scene.workpiece.initial_temperature, 298.15);
        assert_eq!(set("tool_velocity", "300 m/min").unwrap().inputs.tool_velocity, 5.0);
        assert!(!set("effects.rate", "false").unwrap().effects.rate);
        assert_eq!(set("effects.heat", "none").unwrap().effects.heat, Heat::None);
        assert_eq!(set("numerics.shape_function", "1").unwrap().numerics.shape_function, ShapeChoice::Linear);
        assert_eq!(set("material.name", "custom").unwrap().material.name, "custom");
        assert_eq!(set("numerics.threads", "2").unwrap().numerics.threads, 2);
    }

    /// A wrong value is refused with words that help, and changes nothing.
    #[test]
    fn wrong_values_are_refused_with_a_helpful_text() {
        let cases = [
            ("tool.rake_angel", "0.1", "did you mean 'tool.rake_angle'"),
            ("rake_angle", "0.1", "did you mean 'tool.rake_angle'"),
            ("xyzzyxyzzy", "0.1", "there is no variable 'xyzzyxyzzy'"),
            ("tool.rake_angle", "10 mm", "rad, deg"),
            ("tool.rake_angle", "", "expected is a number"),
            ("tool.rake_angle", "70 deg", "outside"),
            ("tool.rake_angle", "nan", "not a finite number"),
            ("numerics.courant", "1.3", "outside [0.01, 1.25]"),
            ("numerics.threads", "1.5", "whole number"),
            ("numerics.threads", "-1", "outside [0, 1024]"),
            ("effects.rate", "yes", "true or false"),
            ("effects.heat", "hot", "none (1), adiabatic (2), conduction (3)"),
            ("effects.heat", "4", "none (1), adiabatic (2), conduction (3)"),
            ("cutting_force", "1", "is an output"),
        ];
        for (name, text, expected) in cases {
            let message = set(name, text).unwrap_err().to_string();
            assert!(message.contains(expected), "{name} = {text}: {message}");
        }
    }

    /// The list written into results files sets up the same scene again.
    #[test]
    fn values_in_use_read_back_as_the_same_scene() {
        let mut scene = Scene::default();
        scene.tool.rake_angle = 0.1 + 0.2;
        scene.material.name = "custom".into();
        scene.material.constants.thermal_expansion = 1.234_567_890_123_456_7e-5;
        let mut copy = Scene::default();
        for (name, value, _) in values_in_use(&scene) {
            set_by_name(&mut copy, name, &value).unwrap();
        }
        assert_eq!(copy, scene);
    }

    /// The book's tables are Markdown, whose cells end with a bar.
    #[test]
    fn descriptions_fit_into_a_cell_of_a_table() {
        for variable in all() {
            assert!(!variable.description.contains('|'), "{}", variable.name);
        }
    }

    /// Messages carry neither exponents nor the noise of a sum of steps, and no digit that counts is lost.
    #[test]
    fn times_and_lengths_are_written_as_people_write_them() {
        let cases = [
            (1.0, "1 s"),
            (4e-5, "40 µs"),
            (1.000001e-6, "1.000001 µs"),
            (3.0 * 1e-6, "3 µs"),
            (1e-6, "1 µs"),
            (5e-7, "500 ns"),
            (2.5e-3, "2.5 ms"),
            (120.0, "120 s"),
            (1e-11, "0.01 ns"),
            (-2e-6, "-2 µs"),
            (0.0, "0 s"),
            (4.0000000401e-5, "40.0000004 µs"),
            (f64::INFINITY, "inf s"),
        ];
        for (seconds, expected) in cases {
            assert_eq!(time_text(seconds), expected);
        }
        assert_eq!(length_text(3e-4), "300 µm");
        assert_eq!(length_text(1.5e-3), "1.5 mm");
    }

    /// Distances known by hand.
    #[test]
    fn edit_distance_counts_edits() {
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(edit_distance("", "abc"), 3);
        assert_eq!(edit_distance("feed", "feed"), 0);
    }
}
