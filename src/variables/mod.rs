//! The one table of all variables: what an importer, a scene file, the range checks and the README know of
//! them.
//!
//! * `process`, `material`, `numerics`: parameters of each, as tables;
//! * `outputs`: inputs and outputs, and the struct `Outputs` made from the latter;
//! * `enumerations`, `units`: types that the tables use;
//! * `text`: values as a user types and reads them; `settings`: many of them in one text.
//!
//! What may be touched: a parameter is one entry of a table and a field of `scene`; an output is one entry of
//! `outputs`. The solver knows nothing of this room, and this room nothing of the solver: sessions, files and
//! the FMU stand on it.
//!
//! Value references are unique over all types and fixed for good: 1–99 inputs, 100–999 outputs, 1000–1999
//! parameters. A new variable takes a new number; none is used again.

mod chip_state;
pub(crate) mod enumerations;
mod material;
mod numerics;
mod outputs;
pub mod settings;
mod text;
pub(crate) mod units;
mod process;

use crate::Error;
use crate::scene::{Inputs, Scene};
use enumerations::Enumeration;
use units::Unit;

pub use chip_state::ChipState;
pub(crate) use outputs::outputs;
pub use outputs::{COLUMNS, Column, Outputs, outputs_at_start, start_dependencies};
pub use text::{
    format_real, length_text, nearest_name, real_from_text, set_by_name, time_text, values_in_use,
};

/// One variable.
#[derive(Debug)]
pub struct Variable {
    /// Value reference of FMI, fixed for good.
    pub reference: u32,
    /// Structured name.
    pub name: &'static str,
    /// What it means, for a mechanical engineer.
    pub description: &'static str,
    /// Type, range and place.
    pub kind: Kind,
}

/// Type of a variable, with what belongs to the type.
#[derive(Debug)]
pub enum Kind {
    /// A quantity with a unit.
    Real(Real),
    /// A whole number.
    Integer(Integer),
    /// Yes or no.
    Boolean(Access<bool>),
    /// A text.
    Text(Access<String>),
    /// One item of an enumeration, by its number.
    Choice(Choice),
}

/// A quantity with a unit.
#[derive(Debug)]
pub struct Real {
    /// Unit of the value.
    pub unit: &'static Unit,
    /// Name of the display unit, empty for the unit itself.
    pub display: &'static str,
    /// Smallest value allowed (or possible, for an output); negative infinity for none.
    pub min: f64,
    /// Largest value allowed (or possible, for an output); infinity for none.
    pub max: f64,
    /// Usual size, where it helps scaling.
    pub nominal: Option<f64>,
    /// Where it is stored.
    pub access: Access<f64>,
}

/// A whole number.
#[derive(Debug)]
pub struct Integer {
    /// Smallest value allowed.
    pub min: i32,
    /// Largest value allowed; `i32::MAX` for none.
    pub max: i32,
    /// Where it is stored.
    pub access: Access<i32>,
}

/// One item of an enumeration.
#[derive(Debug)]
pub struct Choice {
    /// The type.
    pub of: &'static Enumeration,
    /// Where its number is stored.
    pub access: Access<i32>,
}

/// Where a value is stored, which also tells the variable's causality.
#[derive(Debug)]
pub enum Access<T> {
    /// Fixed once the model is built.
    Parameter {
        /// Reads it.
        get: fn(&Scene) -> T,
        /// Writes a value that has been checked.
        set: fn(&mut Scene, T),
    },
    /// May change at every communication point.
    Input {
        /// Reads it.
        get: fn(&Inputs) -> T,
        /// Writes a value that has been checked.
        set: fn(&mut Inputs, T),
    },
    /// Computed.
    Output {
        /// Reads it.
        get: fn(&Outputs) -> T,
    },
}

/// Role of a variable towards the importer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Causality {
    /// Fixed once the model is built.
    Parameter,
    /// May change at every communication point.
    Input,
    /// Computed.
    Output,
}

impl<T> Access<T> {
    /// Role towards the importer.
    pub fn causality(&self) -> Causality {
        match self {
            Access::Parameter { .. } => Causality::Parameter,
            Access::Input { .. } => Causality::Input,
            Access::Output { .. } => Causality::Output,
        }
    }

    /// The value, from wherever it is stored.
    pub fn read(&self, scene: &Scene, inputs: &Inputs, outputs: &Outputs) -> T {
        match self {
            Access::Parameter { get, .. } => get(scene),
            Access::Input { get, .. } => get(inputs),
            Access::Output { get } => get(outputs),
        }
    }

    /// The start value; none for an output.
    pub fn start(&self, scene: &Scene) -> Option<T> {
        match self {
            Access::Parameter { get, .. } => Some(get(scene)),
            Access::Input { get, .. } => Some(get(&scene.inputs)),
            Access::Output { .. } => None,
        }
    }

    /// Writes a start value that has been checked; false for an output, which has none.
    pub fn set_start(&self, scene: &mut Scene, value: T) -> bool {
        match self {
            Access::Parameter { set, .. } => set(scene, value),
            Access::Input { set, .. } => set(&mut scene.inputs, value),
            Access::Output { .. } => return false,
        }
        true
    }
}

impl Variable {
    /// Role towards the importer.
    pub fn causality(&self) -> Causality {
        match &self.kind {
            Kind::Real(real) => real.access.causality(),
            Kind::Integer(integer) => integer.access.causality(),
            Kind::Boolean(access) => access.causality(),
            Kind::Text(access) => access.causality(),
            Kind::Choice(choice) => choice.access.causality(),
        }
    }

    /// Name of its FMI type.
    pub fn type_name(&self) -> &'static str {
        match &self.kind {
            Kind::Real(_) => "Real",
            Kind::Integer(_) => "Integer",
            Kind::Boolean(_) => "Boolean",
            Kind::Text(_) => "String",
            Kind::Choice(_) => "Enumeration",
        }
    }

    /// FMI variability: parameters are fixed, Real inputs and outputs continuous, all others discrete.
    pub fn variability(&self) -> &'static str {
        match (self.causality(), &self.kind) {
            (Causality::Parameter, _) => "fixed",
            (_, Kind::Real(_)) => "continuous",
            _ => "discrete",
        }
    }
}

impl Real {
    /// Checks a value against the range.
    ///
    /// # Errors
    /// `Error::OutOfRange` when it lies outside or is not finite.
    pub fn check(&self, name: &str, value: f64) -> Result<(), Error> {
        if value.is_finite() && (self.min..=self.max).contains(&value) {
            return Ok(());
        }
        let (min, max, unit) = (self.min, self.max, self.unit.name);
        Err(Error::OutOfRange { name: name.into(), asked: value, min, max, unit })
    }
}

impl Integer {
    /// Checks a value against the range.
    ///
    /// # Errors
    /// `Error::OutOfRange` when it lies outside.
    pub fn check(&self, name: &str, value: i32) -> Result<(), Error> {
        if (self.min..=self.max).contains(&value) {
            return Ok(());
        }
        let (min, max) = (f64::from(self.min), f64::from(self.max));
        Err(Error::OutOfRange { name: name.into(), asked: f64::from(value), min, max, unit: "1" })
    }
}

impl Choice {
    /// Checks that the enumeration has an item of that number.
    ///
    /// # Errors
    /// `Error::NotAvailable` with the list of items.
    pub fn check(&self, name: &str, number: i32) -> Result<(), Error> {
        if self.of.name_of(number).is_some() {
            return Ok(());
        }
        Err(Error::NotAvailable { name: name.into(), asked: number.to_string(), allowed: self.of.list() })
    }
}

/// All variables, in the order of the description: inputs, outputs, parameters.
pub fn all() -> impl Iterator<Item = &'static Variable> {
    let groups =
        [outputs::INPUTS, outputs::OUTPUTS, process::PARAMETERS, material::PARAMETERS, numerics::PARAMETERS];
    groups.into_iter().flatten()
}

/// The variable with a value reference.
pub fn by_reference(reference: u32) -> Option<&'static Variable> {
    all().find(|variable| variable.reference == reference)
}

/// The variable with a name.
pub fn by_name(name: &str) -> Option<&'static Variable> {
    all().find(|variable| variable.name == name)
}

/// Checks values of the inputs against their ranges.
///
/// # Errors
/// The first value that is out of range or not finite.
pub fn check_inputs(inputs: &Inputs) -> Result<(), Error> {
    for_each_input(inputs, |name, real, value| real.check(name, value))
}

/// Checks slopes of the inputs (per second), which must be finite.
///
/// # Errors
/// The first that is not.
pub fn check_slopes(slopes: &Inputs) -> Result<(), Error> {
    for_each_input(slopes, |name, _, slope| {
        if slope.is_finite() {
            return Ok(());
        }
        Err(Error::Inconsistent(format!(
            "slope {slope} of {name} is not a finite number; the old one is kept"
        )))
    })
}

fn for_each_input(
    inputs: &Inputs,
    check: impl Fn(&str, &Real, f64) -> Result<(), Error>,
) -> Result<(), Error> {
    for variable in outputs::INPUTS {
        if let Kind::Real(real @ Real { access: Access::Input { get, .. }, .. }) = &variable.kind {
            check(variable.name, real, get(inputs))?;
        }
    }
    Ok(())
}

/// Checks every parameter and start input of a scene against its range; what belongs together is the scene's
/// own check.
///
/// # Errors
/// The first value that is out of range.
pub fn check_ranges(scene: &Scene) -> Result<(), Error> {
    for variable in all() {
        match &variable.kind {
            Kind::Real(real) => {
                if let Some(value) = real.access.start(scene) {
                    real.check(variable.name, value)?;
                }
            }
            Kind::Integer(integer) => {
                if let Some(value) = integer.access.start(scene) {
                    integer.check(variable.name, value)?;
                }
            }
            // Rust's types leave these no room for a wrong value.
            Kind::Boolean(_) | Kind::Text(_) | Kind::Choice(_) => {}
        }
    }
    Ok(())
}

/// A parameter's place in the scene.
macro_rules! parameter {
    ($($place:ident).+ $([$index:literal])?) => {
        $crate::variables::Access::Parameter {
            get: |scene| scene.$($place).+ $([$index])?,
            set: |scene, value| scene.$($place).+ $([$index])? = value,
        }
    };
}
pub(crate) use parameter;

/// An enumeration's place in the scene; the table of its items, its type and the place.
macro_rules! choice_parameter {
    ($of:path, $choice:ident, $($place:ident).+) => {
        $crate::variables::Kind::Choice($crate::variables::Choice {
            of: &$of,
            access: $crate::variables::Access::Parameter {
                get: |scene| scene.$($place).+.number(),
                set: |scene, number| {
                    if let Some(item) = $choice::from_number(number) {
                        scene.$($place).+ = item;
                    }
                },
            },
        })
    };
}
pub(crate) use choice_parameter;

/// No bound.
const NONE: f64 = f64::INFINITY;

const fn real(
    unit: &'static Unit,
    display: &'static str,
    range: [f64; 2],
    nominal: Option<f64>,
    access: Access<f64>,
) -> Kind {
    Kind::Real(Real { unit, display, min: range[0], max: range[1], nominal, access })
}

const fn integer(range: [i32; 2], access: Access<i32>) -> Kind {
    Kind::Integer(Integer { min: range[0], max: range[1], access })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    /// FMI tells variables apart by name, and we by one reference over all types.
    #[test]
    fn names_and_references_are_unique_and_in_their_blocks() {
        let (mut names, mut references) = (HashSet::new(), HashSet::new());
        for variable in all() {
            assert!(names.insert(variable.name), "{} stands twice", variable.name);
            assert!(references.insert(variable.reference), "{} stands twice", variable.reference);
            let block = match variable.causality() {
                Causality::Input => 1..100,
                Causality::Output => 100..1000,
                Causality::Parameter => 1000..2000,
            };
            assert!(block.contains(&variable.reference), "{} has {}", variable.name, variable.reference);
        }
    }

    /// The interface is fixed by its document; these names and references are what importers have stored.
    #[test]
    fn names_of_the_interface_are_all_there() {
        let fixed = [
            (1, "tool_velocity"),
            (2, "feed"),
            (3, "friction"),
            (100, "cutting_force"),
            (101, "thrust_force"),
            (131, "chip.state"),
            (1000, "scene"),
            (1010, "workpiece.length"),
            (1030, "tool.rake_angle"),
            (1050, "results.directory"),
            (1100, "material.name"),
            (1102, "material.density"),
            (1200, "effects.heat"),
            (1300, "numerics.dimension"),
        ];
        for (reference, name) in fixed {
            assert_eq!(by_name(name).map(|v| v.reference), Some(reference), "{name}");
        }
    }

    /// The reference cut is the start of every parameter, so it must lie inside all ranges.
    #[test]
    fn the_default_scene_lies_inside_all_ranges() {
        check_ranges(&Scene::default()).unwrap();
    }

    /// Reading back a written value proves that get and set mean the same place, and no other variable's.
    #[test]
    fn get_and_set_of_each_variable_mean_one_place() {
        for variable in all() {
            let mut scene = Scene::default();
            let before = values_in_use(&scene);
            let is_settable = match &variable.kind {
                Kind::Real(real) => real.access.set_start(&mut scene, 0.123),
                Kind::Integer(integer) => integer.access.set_start(&mut scene, 7),
                Kind::Boolean(access) => {
                    let old = access.start(&scene).unwrap_or_default();
                    access.set_start(&mut scene, !old)
                }
                Kind::Text(access) => access.set_start(&mut scene, "other".into()),
                Kind::Choice(choice) => {
                    let old = choice.access.start(&scene).unwrap_or_default();
                    let other = if old == 1 { 2 } else { 1 };
                    choice.of.name_of(other).is_none() || choice.access.set_start(&mut scene, other)
                }
            };
            assert_eq!(is_settable, variable.causality() != Causality::Output, "{}", variable.name);
            let changed: Vec<_> = before
                .iter()
                .zip(values_in_use(&scene))
                .filter(|(old, new)| old.1 != new.1)
                .map(|(old, _)| old.0)
                .collect();
            let expected = usize::from(is_settable);
            assert_eq!(changed.len(), expected, "{} changed {changed:?}", variable.name);
            assert!(changed.iter().all(|name| *name == variable.name), "{}: {changed:?}", variable.name);
        }
    }

    /// A refused value names variable, range and unit, and infinities and NaN are never taken.
    #[test]
    fn values_out_of_range_or_not_finite_are_refused() {
        let Kind::Real(rake) = &by_name("tool.rake_angle").unwrap().kind else { panic!("not Real") };
        for value in [2.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let text = rake.check("tool.rake_angle", value).unwrap_err().to_string();
            assert!(text.contains("tool.rake_angle") && text.contains("rad"), "{text}");
        }
        let Kind::Real(energy) = &by_name("results.interval").unwrap().kind else { panic!("not Real") };
        assert!(energy.check("results.interval", f64::INFINITY).is_err());
    }

    /// A display unit must be one that the unit defines.
    #[test]
    fn display_units_are_defined() {
        for variable in all() {
            if let Kind::Real(real) = &variable.kind {
                let known = real.unit.displays.iter().any(|display| display.name == real.display);
                assert!(real.display.is_empty() || known, "{}: {}", variable.name, real.display);
                assert!(units::ALL.contains(&real.unit), "{} is not listed", real.unit.name);
                assert!(real.nominal.is_none_or(|nominal| nominal > 0.0), "{}", variable.name);
            }
        }
    }
}
