//! Reading and setting variables of an instance.
//!
//! A call with several values takes all of them or none.

use super::calls::{self, Call};
use super::instance::{Instance, Reply};
use super::logging::Status;
use super::refusal::Refusal;
use super::state::State;
use crate::Error;
use crate::variables::{self, Access, Causality, Kind, Variable, by_reference};
use std::ffi::CString;

/// Type of the value behind an access of the variable table, as the functions of FMI name it.
type Place<T> = &'static Access<T>;

fn real(variable: &'static Variable) -> Option<Place<f64>> {
    if let Kind::Real(real) = &variable.kind { Some(&real.access) } else { None }
}

/// Enumerations are read and set as integers.
fn integer(variable: &'static Variable) -> Option<Place<i32>> {
    match &variable.kind {
        Kind::Integer(integer) => Some(&integer.access),
        Kind::Choice(choice) => Some(&choice.access),
        _ => None,
    }
}

fn boolean(variable: &'static Variable) -> Option<Place<bool>> {
    if let Kind::Boolean(access) = &variable.kind { Some(access) } else { None }
}

fn text(variable: &'static Variable) -> Option<Place<String>> {
    if let Kind::Text(access) = &variable.kind { Some(access) } else { None }
}

fn check_real(variable: &Variable, value: &f64) -> Result<(), Error> {
    if let Kind::Real(real) = &variable.kind { real.check(variable.name, *value) } else { Ok(()) }
}

fn check_integer(variable: &Variable, value: &i32) -> Result<(), Error> {
    match &variable.kind {
        Kind::Integer(integer) => integer.check(variable.name, *value),
        Kind::Choice(choice) => choice.check(variable.name, *value),
        _ => Ok(()),
    }
}

impl Instance {
    /// Values of Real variables (SI units).
    ///
    /// # Errors
    /// A wrong call order, an unknown reference, another type.
    pub fn get_real(&mut self, references: &[u32]) -> Result<Vec<f64>, Refusal> {
        self.get(&calls::GET_REAL, references, "Real", real)
    }

    /// Values of Integer variables and numbers of enumeration items.
    ///
    /// # Errors
    /// A wrong call order, an unknown reference, another type.
    pub fn get_integer(&mut self, references: &[u32]) -> Result<Vec<i32>, Refusal> {
        self.get(&calls::GET_INTEGER, references, "Integer or Enumeration", integer)
    }

    /// Values of Boolean variables.
    ///
    /// # Errors
    /// A wrong call order, an unknown reference, another type.
    pub fn get_boolean(&mut self, references: &[u32]) -> Result<Vec<bool>, Refusal> {
        self.get(&calls::GET_BOOLEAN, references, "Boolean", boolean)
    }

    /// Values of String variables; the texts live until the next call of this function.
    ///
    /// # Errors
    /// A wrong call order, an unknown reference, another type.
    pub fn get_string(&mut self, references: &[u32]) -> Result<&[CString], Refusal> {
        let texts = self.get(&calls::GET_STRING, references, "String", text)?;
        // Texts came in as C strings and cannot hold a zero; an empty one is a safe answer should that ever
        // change.
        self.texts = texts.into_iter().map(|text| CString::new(text).unwrap_or_default()).collect();
        Ok(&self.texts)
    }

    /// Sets Real parameters or inputs (SI units).
    ///
    /// # Errors
    /// A wrong call order, an unknown reference, another type, a value that is out of range or fixed by now.
    pub fn set_real(&mut self, references: &[u32], values: &[f64]) -> Reply {
        self.set(&calls::SET_REAL, references, values, "Real", real, check_real)
    }

    /// Sets Integer and Enumeration parameters.
    ///
    /// # Errors
    /// As `set_real`.
    pub fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Reply {
        self.set(&calls::SET_INTEGER, references, values, "Integer or Enumeration", integer, check_integer)
    }

    /// Sets Boolean parameters.
    ///
    /// # Errors
    /// As `set_real`.
    pub fn set_boolean(&mut self, references: &[u32], values: &[bool]) -> Reply {
        self.set(&calls::SET_BOOLEAN, references, values, "Boolean", boolean, |_, _| Ok(()))
    }

    /// Sets String parameters.
    ///
    /// # Errors
    /// As `set_real`.
    pub fn set_string(&mut self, references: &[u32], values: &[String]) -> Reply {
        self.set(&calls::SET_STRING, references, values, "String", text, |_, _| Ok(()))
    }

    /// Sets slopes of inputs (per second) for the next step.
    ///
    /// # Errors
    /// A wrong call order, a variable that is no Real input, an order other than 1, a slope that is not
    /// finite.
    pub fn set_real_input_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> Reply {
        self.require(&calls::SET_REAL_INPUT_DERIVATIVES)?;
        let mut slopes = self.model.header.slopes;
        for ((reference, order), value) in references.iter().zip(orders).zip(values) {
            let variable = find(*reference)?;
            let Some(Access::Input { set, .. }) = real(variable) else {
                let reason = "only a Real input has a slope";
                return Err(Refusal::NotSettable { name: variable.name, reason });
            };
            if *order != 1 {
                let text =
                    format!("derivative of order {order} of {} is not taken, only order 1", variable.name);
                return Err(Refusal::BadArgument(text));
            }
            if !value.is_finite() {
                let text =
                    format!("slope {value} of {} is not a finite number; the old one is kept", variable.name);
                return Err(Refusal::BadArgument(text));
            }
            set(&mut slopes, *value);
        }
        self.model.header.slopes = slopes;
        Ok(Status::Ok)
    }

    /// Derivatives of outputs, of which there are none: slopes of means and peaks mean nothing.
    ///
    /// # Errors
    /// Always.
    pub fn get_real_output_derivatives(&mut self) -> Reply {
        self.require(&calls::GET_REAL_OUTPUT_DERIVATIVES)?;
        Err(Refusal::NotCapable("this FMU has no output derivatives (maxOutputDerivativeOrder = 0)"))
    }

    /// Directional derivatives, of which there are none.
    ///
    /// # Errors
    /// Always.
    pub fn get_directional_derivative(&mut self) -> Reply {
        self.require(&calls::GET_DIRECTIONAL_DERIVATIVE)?;
        let text = "this FMU has no directional derivatives (providesDirectionalDerivative = false)";
        Err(Refusal::NotCapable(text))
    }

    fn get<T>(
        &self,
        call: &Call,
        references: &[u32],
        asked: &'static str,
        place: fn(&'static Variable) -> Option<Place<T>>,
    ) -> Result<Vec<T>, Refusal> {
        self.require(call)?;
        let scene = &self.model.header.scene;
        let at_start;
        // Once built, parameters are those in use: a library material's constants are filled in.
        let (in_use, outputs) = match &self.model.session {
            Some(session) => (session.scene(), session.outputs()),
            None => {
                at_start = variables::outputs_at_start(scene);
                (scene, &at_start)
            }
        };
        let value = |reference: &u32| {
            let variable = find(*reference)?;
            let access = place(variable).ok_or_else(|| wrong_type(variable, asked))?;
            Ok(access.read(in_use, &scene.inputs, outputs))
        };
        references.iter().map(value).collect()
    }

    fn set<T: Clone>(
        &mut self,
        call: &Call,
        references: &[u32],
        values: &[T],
        asked: &'static str,
        place: fn(&'static Variable) -> Option<Place<T>>,
        check: fn(&Variable, &T) -> Result<(), Error>,
    ) -> Reply {
        self.require(call)?;
        let is_built = self.model.header.state == State::StepComplete;
        let mut scene = self.model.header.scene.clone();
        for (reference, value) in references.iter().zip(values) {
            let variable = find(*reference)?;
            let access = place(variable).ok_or_else(|| wrong_type(variable, asked))?;
            let reason = match access.causality() {
                Causality::Output => Some("it is an output"),
                Causality::Parameter if is_built => {
                    Some("it is a fixed parameter, and the model is built already")
                }
                _ => None,
            };
            if let Some(reason) = reason {
                return Err(Refusal::NotSettable { name: variable.name, reason });
            }
            check(variable, value)?;
            access.set_start(&mut scene, value.clone());
        }
        if let Some(session) = &self.model.session {
            session.check_inputs(&scene.inputs)?;
        }
        self.model.header.scene = scene;
        Ok(Status::Ok)
    }
}

fn find(reference: u32) -> Result<&'static Variable, Refusal> {
    by_reference(reference).ok_or(Refusal::UnknownReference(reference))
}

fn wrong_type(variable: &Variable, asked: &'static str) -> Refusal {
    Refusal::WrongType { name: variable.name, is: variable.type_name(), asked }
}
