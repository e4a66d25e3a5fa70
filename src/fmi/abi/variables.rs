//! Getting and setting variables. FMI 2.0, sections 2.1.7, 2.1.9 and 4.2.1.
//!
//! The functions differ in the type of their values alone; `get` and `set` hold what they share.

use super::super::calls::{self, Call};
use super::super::instance::{Instance, Reply};
use super::super::logging::Status;
use super::super::refusal::Refusal;
use super::{call, pointers};
use std::ffi::{c_char, c_int, c_void};

/// Reads values of one type and hands them over.
///
/// # Safety
/// `component` as for `fmi2DoStep`; `references` is null or has `count` entries, `values` is null or has room
/// for `count`.
unsafe fn get<T: Copy>(
    component: *mut c_void,
    which: &'static Call,
    (references, count): (*const u32, usize),
    values: *mut T,
    read: impl FnOnce(&mut Instance, &[u32]) -> Result<Vec<T>, Refusal>,
) -> Status {
    let body = |instance: &mut Instance| {
        // SAFETY: our caller says that there are `count` of them.
        let references = unsafe { pointers::array(references, count, "vr") }?;
        let found = read(instance, references)?;
        // SAFETY: our caller says that there is room for `count` of them, and one was read for each
        // reference.
        unsafe { pointers::write_all(values, &found, "value") }.map(|()| Status::Ok)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, which, body) }
}

/// Takes over values of one type.
///
/// # Safety
/// `component` as for `fmi2DoStep`; both arrays are null or have `count` entries.
unsafe fn set<T>(
    component: *mut c_void,
    which: &'static Call,
    (references, count): (*const u32, usize),
    values: *const T,
    write: impl FnOnce(&mut Instance, &[u32], &[T]) -> Reply,
) -> Status {
    let body = |instance: &mut Instance| {
        // SAFETY: our caller says that there are `count` of them.
        let references = unsafe { pointers::array(references, count, "vr") }?;
        // SAFETY: our caller says that there are `count` of them.
        let values = unsafe { pointers::array(values, count, "value") }?;
        write(instance, references, values)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, which, body) }
}

/// One exported function per line: what it does, its name, its `Call`, its array of values, and what it runs.
macro_rules! functions {
    ($($(#[doc = $text:literal])+ $name:ident = $way:ident($call:ident, $values:ty, $body:expr);)+) => {$(
        $(#[doc = $text])+
        ///
        /// # Safety
        /// `component` as for `fmi2DoStep`; the arrays are null or have `count` entries, texts among them are
        /// null or end with a zero.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(
            component: *mut c_void,
            references: *const u32,
            count: usize,
            values: $values,
        ) -> Status {
            // SAFETY: our caller gives the guarantee above, which is the one that `get`, `set` and the body
            // ask for.
            unsafe { $way(component, &calls::$call, (references, count), values, $body) }
        }
    )+};
}

functions! {
    /// Values of Real variables.
    fmi2GetReal = get(GET_REAL, *mut f64, Instance::get_real);
    /// Values of Integer and Enumeration variables.
    fmi2GetInteger = get(GET_INTEGER, *mut c_int, Instance::get_integer);
    /// Values of Boolean variables.
    fmi2GetBoolean = get(GET_BOOLEAN, *mut c_int, get_boolean);
    /// Values of String variables; they live until the next call of this function on the instance.
    fmi2GetString = get(GET_STRING, *mut *const c_char, get_string);
    /// Sets Real parameters and inputs.
    fmi2SetReal = set(SET_REAL, *const f64, Instance::set_real);
    /// Sets Integer and Enumeration parameters.
    fmi2SetInteger = set(SET_INTEGER, *const c_int, Instance::set_integer);
    /// Sets Boolean parameters.
    fmi2SetBoolean = set(SET_BOOLEAN, *const c_int, set_boolean);
    /// Sets String parameters.
    fmi2SetString = set(SET_STRING, *const *const c_char, |i, references, texts| set_string(i, references, texts));
}

fn get_boolean(instance: &mut Instance, references: &[u32]) -> Result<Vec<c_int>, Refusal> {
    Ok(instance.get_boolean(references)?.into_iter().map(c_int::from).collect())
}

fn get_string(instance: &mut Instance, references: &[u32]) -> Result<Vec<*const c_char>, Refusal> {
    Ok(instance.get_string(references)?.iter().map(|text| text.as_ptr()).collect())
}

fn set_boolean(instance: &mut Instance, references: &[u32], values: &[c_int]) -> Reply {
    let truth = |value: &c_int| match value {
        0 => Ok(false),
        1 => Ok(true),
        other => Err(Refusal::BadArgument(format!("Boolean {other} is neither 0 nor 1; nothing was set"))),
    };
    instance.set_boolean(references, &values.iter().map(truth).collect::<Result<Vec<_>, _>>()?)
}

/// # Safety
/// Each text is null or ends with a zero.
unsafe fn set_string(instance: &mut Instance, references: &[u32], values: &[*const c_char]) -> Reply {
    // SAFETY: our caller gives the guarantee that `text` asks for.
    let text = |value: &*const c_char| unsafe { pointers::text(*value, "value") }.map(str::to_owned);
    instance.set_string(references, &values.iter().map(text).collect::<Result<Vec<_>, _>>()?)
}

/// Sets slopes of inputs for the next step.
///
/// # Safety
/// As for `fmi2GetReal`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetRealInputDerivatives(
    component: *mut c_void,
    references: *const u32,
    count: usize,
    orders: *const c_int,
    values: *const f64,
) -> Status {
    let body = |instance: &mut Instance| {
        // SAFETY: our caller says that there are `count` of them.
        let references = unsafe { pointers::array(references, count, "vr") }?;
        // SAFETY: our caller says that there are `count` of them.
        let orders = unsafe { pointers::array(orders, count, "order") }?;
        // SAFETY: our caller says that there are `count` of them.
        let values = unsafe { pointers::array(values, count, "value") }?;
        instance.set_real_input_derivatives(references, orders, values)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::SET_REAL_INPUT_DERIVATIVES, body) }
}

/// Would give derivatives of outputs; the capability flags say that there are none.
///
/// # Safety
/// `component` as for `fmi2DoStep`; the arrays are not touched.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetRealOutputDerivatives(
    component: *mut c_void,
    _references: *const u32,
    _count: usize,
    _orders: *const c_int,
    _values: *mut f64,
) -> Status {
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::GET_REAL_OUTPUT_DERIVATIVES, Instance::get_real_output_derivatives) }
}

/// Would give directional derivatives; the capability flags say that there are none.
///
/// # Safety
/// `component` as for `fmi2DoStep`; the arrays are not touched.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetDirectionalDerivative(
    component: *mut c_void,
    _unknowns: *const u32,
    _unknown_count: usize,
    _knowns: *const u32,
    _known_count: usize,
    _known_steps: *const f64,
    _unknown_steps: *mut f64,
) -> Status {
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::GET_DIRECTIONAL_DERIVATIVE, Instance::get_directional_derivative) }
}
