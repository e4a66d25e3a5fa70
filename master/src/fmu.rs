//! The FMU by the names of its variables, on the `fmi` crate.

use std::ffi::CString;
use std::path::Path;

use fmi::fmi2::import::Fmi2Import;
use fmi::fmi2::instance::{CoSimulation, Common, InstanceCS};
use fmi::fmi2::{Fmi2Error, Fmi2Res};
use fmi::traits::FmiImport;

use crate::description::{Description, Type, Variable};
use crate::units::time_text;

/// A loaded FMU, from which instances are made. It lives in a temporary folder until dropped.
pub struct Fmu {
    import: Fmi2Import,
    /// What its model description says.
    pub description: Description,
}

/// One instance.
pub struct Instance<'a> {
    /// The `fmi` crate's own handle, for calls this wrapper has no name for.
    pub raw: InstanceCS,
    /// What modelDescription.xml says.
    pub description: &'a Description,
}

/// How a step ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// At the time asked for.
    Done,
    /// At this time (s): the FMU discarded the rest, and can go on from there.
    StoppedAt(f64),
}

impl Fmu {
    /// Unpacks and reads an FMU.
    ///
    /// # Errors
    /// Says what is wrong with the file.
    pub fn load(path: &Path) -> Result<Fmu, String> {
        let import: Fmi2Import =
            fmi::import::from_path(path).map_err(|e| format!("cannot load '{}': {e}", path.display()))?;
        let xml = import.archive_path().join("modelDescription.xml");
        let text =
            std::fs::read_to_string(&xml).map_err(|e| format!("cannot read '{}': {e}", xml.display()))?;
        Ok(Fmu { import, description: Description::read(&text)? })
    }

    /// Makes an instance; its messages go to the `log` crate under its name.
    ///
    /// # Errors
    /// When the FMU refuses; its messages say why.
    pub fn instantiate(&self, name: &str) -> Result<Instance<'_>, String> {
        let raw = self.import.instantiate_cs(name, false, true).map_err(|e| {
            format!(
                "the FMU cannot be instantiated ({e}); if a variable changed, run `cargo xtask describe` \
                first"
            )
        })?;
        Ok(Instance { raw, description: &self.description })
    }
}

impl Instance<'_> {
    /// Sets a variable from text: a number, true or false, a text, or an enumeration's item by name or
    /// number.
    ///
    /// # Errors
    /// An unknown name, a text that is no value of the type, or the FMU's refusal.
    pub fn set_text(&mut self, name: &str, value: &str) -> Result<(), String> {
        let variable = self.description.variable(name)?;
        let wrong = |allowed: &str| format!("{name} = '{value}': {allowed} is needed");
        let references = [variable.reference];
        let outcome = match &variable.kind {
            Type::Real(unit) => {
                // Units as people write them ("10 deg") are known to the library; FMI knows SI alone.
                let known = swarf::variables::real_from_text(name, value).map_err(|e| e.to_string())?;
                let number = known.or_else(|| value.parse().ok());
                let number = number.ok_or_else(|| wrong(&format!("a number in {unit}")))?;
                self.raw.set_real(&references, &[number])
            }
            Type::Integer => {
                let number = value.parse().map_err(|_| wrong("a whole number"))?;
                self.raw.set_integer(&references, &[number])
            }
            Type::Boolean => {
                let truth = match value {
                    "true" | "1" => 1,
                    "false" | "0" => 0,
                    _ => return Err(wrong("true or false")),
                };
                self.raw.set_boolean(&references, &[truth])
            }
            Type::Text => {
                let text = CString::new(value).map_err(|_| wrong("a text without a zero byte"))?;
                self.raw.set_string(&references, &[text]).map(|()| Fmi2Res::OK)
            }
            Type::Enumeration(items) => {
                let by_name = items.iter().find(|item| item.0 == value).map(|item| item.1);
                let names: Vec<&str> = items.iter().map(|item| item.0.as_str()).collect();
                let number = by_name.or_else(|| value.parse().ok());
                let number = number.ok_or_else(|| wrong(&format!("one of {}", names.join(", "))))?;
                self.raw.set_integer(&references, &[number])
            }
        };
        outcome
            .map(|_| ())
            .map_err(|e| format!("the FMU refused {name} = {value} ({e}); see its message above"))
    }

    /// The value of a variable as text, an enumeration's by its item's name.
    ///
    /// # Errors
    /// An unknown name or the FMU's refusal.
    pub fn get_text(&mut self, name: &str) -> Result<String, String> {
        let variable = self.description.variable(name)?.clone();
        match &variable.kind {
            Type::Real(_) | Type::Integer => Ok(format!("{}", Shortest(self.number_of(&variable)?))),
            Type::Boolean => Ok((self.number_of(&variable)? != 0.0).to_string()),
            Type::Enumeration(items) => {
                let number = self.number_of(&variable)? as i32;
                Ok(items
                    .iter()
                    .find(|item| item.1 == number)
                    .map_or(number.to_string(), |item| item.0.clone()))
            }
            Type::Text => {
                let mut text = [CString::default()];
                self.raw.get_string(&[variable.reference], &mut text).map_err(|e| refused(name, &e))?;
                let [text] = text;
                Ok(text.to_string_lossy().into_owned())
            }
        }
    }

    /// The value of a number, a truth (0 or 1) or an enumeration's item (its number).
    ///
    /// # Errors
    /// An unknown name or the FMU's refusal.
    pub fn get(&mut self, name: &str) -> Result<f64, String> {
        let variable = self.description.variable(name)?.clone();
        self.number_of(&variable)
    }

    fn number_of(&mut self, variable: &Variable) -> Result<f64, String> {
        let (mut real, mut integer) = ([0.0], [0]);
        let references = [variable.reference];
        let outcome = match variable.kind {
            Type::Real(_) => self.raw.get_real(&references, &mut real),
            Type::Boolean => self.raw.get_boolean(&references, &mut integer),
            Type::Text => return Err(format!("{} is a text", variable.name)),
            Type::Integer | Type::Enumeration(_) => self.raw.get_integer(&references, &mut integer),
        };
        outcome.map_err(|e| refused(&variable.name, &e))?;
        Ok(if matches!(variable.kind, Type::Real(_)) { real[0] } else { f64::from(integer[0]) })
    }

    /// All outputs of numbers, in the description's order.
    ///
    /// # Errors
    /// The FMU's refusal.
    pub fn outputs(&mut self) -> Result<Vec<f64>, String> {
        output_variables(self.description).into_iter().map(|variable| self.number_of(variable)).collect()
    }

    /// Names and values of all parameters and inputs, as the FMU has them now.
    ///
    /// # Errors
    /// The FMU's refusal.
    pub fn parameters(&mut self) -> Result<Vec<(String, String)>, String> {
        let settable = self
            .description
            .variables
            .iter()
            .filter(|v| v.causality == "parameter" || v.causality == "input");
        settable.map(|variable| Ok((variable.name.clone(), self.get_text(&variable.name)?))).collect()
    }

    /// Passes through initialization, from `start` with an expected end at `stop` (both s).
    ///
    /// # Errors
    /// The FMU's refusal, which the values together may cause.
    pub fn initialize(&mut self, start: f64, stop: f64) -> Result<(), String> {
        let refused = |e: Fmi2Error| format!("the FMU cannot be initialized ({e}); see its message above");
        self.raw.setup_experiment(None, start, Some(stop)).map_err(refused)?;
        self.raw.enter_initialization_mode().map_err(refused)?;
        self.raw.exit_initialization_mode().map_err(refused)?;
        Ok(())
    }

    /// Steps from `time` by `step` (both s).
    ///
    /// # Errors
    /// When the FMU cannot go on.
    pub fn step(&mut self, time: f64, step: f64) -> Result<Step, String> {
        match self.raw.do_step(time, step, true) {
            Ok(_) => Ok(Step::Done),
            Err(Fmi2Error::Discard) => {
                let reached =
                    self.raw.last_successful_time().map_err(|e| refused("the last successful time", &e))?;
                Ok(Step::StoppedAt(reached))
            }
            Err(e) => {
                let (time, step) = (time_text(time), time_text(step));
                Err(format!("the step from {time} by {step} failed ({e}); see the FMU's message above"))
            }
        }
    }
}

/// The outputs that are numbers, in the description's order.
pub fn output_variables(description: &Description) -> Vec<&Variable> {
    description.variables.iter().filter(|v| v.causality == "output" && v.kind != Type::Text).collect()
}

fn refused(name: &str, error: &Fmi2Error) -> String {
    format!("the FMU does not give {name} ({error})")
}

/// A number in plain digits where they are few, else with an exponent.
struct Shortest(f64);

impl std::fmt::Display for Shortest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let size = self.0.abs();
        if size == 0.0 || (1e-3..1e6).contains(&size) {
            write!(f, "{}", self.0)
        } else {
            write!(f, "{:e}", self.0)
        }
    }
}
