//! Getting and setting variables. FMI 2.0, sections 2.1.7, 2.1.9 and 4.2.1.

use super::super::calls;
use super::super::instance::Instance;
use super::super::logging::Status;
use super::super::refusal::Refusal;
use super::{call, pointers};
use std::ffi::{c_char, c_int, c_void};

/// A Boolean of C.
fn boolean(value: &c_int) -> Result<bool, Refusal> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        other => Err(Refusal::BadArgument(format!("Boolean {other} is neither 0 nor 1; nothing was set"))),
    }
}

/// Values of Real variables.
///
/// # Safety
/// `component` as for `fmi2DoStep`; the arrays are null or have `count` entries.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetReal(
    component: *mut c_void,
    references: *const u32,
    count: usize,
    values: *mut f64,
) -> Status {
    let body = |instance: &mut Instance| {
        // SAFETY: our caller says that there are `count` of them.
        let references = unsafe { pointers::array(references, count, "vr") }?;
        let found = instance.get_real(references)?;
        // SAFETY: our caller says that there is room for `count` of them.
        unsafe { pointers::write_all(values, &found, "value") }.map(|()| Status::Ok)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::GET_REAL, body) }
}

/// Values of Integer and Enumeration variables.
///
/// # Safety
/// As for `fmi2GetReal`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetInteger(
    component: *mut c_void,
    references: *const u32,
    count: usize,
    values: *mut c_int,
) -> Status {
    let body = |instance: &mut Instance| {
        // SAFETY: our caller says that there are `count` of them.
        let references = unsafe { pointers::array(references, count, "vr") }?;
        let found = instance.get_integer(references)?;
        // SAFETY: our caller says that there is room for `count` of them.
        unsafe { pointers::write_all(values, &found, "value") }.map(|()| Status::Ok)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::GET_INTEGER, body) }
}

/// Values of Boolean variables.
///
/// # Safety
/// As for `fmi2GetReal`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetBoolean(
    component: *mut c_void,
    references: *const u32,
    count: usize,
    values: *mut c_int,
) -> Status {
    let body = |instance: &mut Instance| {
        // SAFETY: our caller says that there are `count` of them.
        let references = unsafe { pointers::array(references, count, "vr") }?;
        let found: Vec<c_int> = instance.get_boolean(references)?.into_iter().map(c_int::from).collect();
        // SAFETY: our caller says that there is room for `count` of them.
        unsafe { pointers::write_all(values, &found, "value") }.map(|()| Status::Ok)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::GET_BOOLEAN, body) }
}

/// Values of String variables; they live until the next call of this function on the instance.
///
/// # Safety
/// As for `fmi2GetReal`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetString(
    component: *mut c_void,
    references: *const u32,
    count: usize,
    values: *mut *const c_char,
) -> Status {
    let body = |instance: &mut Instance| {
        // SAFETY: our caller says that there are `count` of them.
        let references = unsafe { pointers::array(references, count, "vr") }?;
        let found: Vec<_> = instance.get_string(references)?.iter().map(|text| text.as_ptr()).collect();
        // SAFETY: our caller says that there is room for `count` of them.
        unsafe { pointers::write_all(values, &found, "value") }.map(|()| Status::Ok)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::GET_STRING, body) }
}

/// Sets Real parameters and inputs.
///
/// # Safety
/// As for `fmi2GetReal`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetReal(
    component: *mut c_void,
    references: *const u32,
    count: usize,
    values: *const f64,
) -> Status {
    let body = |instance: &mut Instance| {
        // SAFETY: our caller says that there are `count` of them.
        let references = unsafe { pointers::array(references, count, "vr") }?;
        // SAFETY: our caller says that there are `count` of them.
        let values = unsafe { pointers::array(values, count, "value") }?;
        instance.set_real(references, values)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::SET_REAL, body) }
}

/// Sets Integer and Enumeration parameters.
///
/// # Safety
/// As for `fmi2GetReal`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetInteger(
    component: *mut c_void,
    references: *const u32,
    count: usize,
    values: *const c_int,
) -> Status {
    let body = |instance: &mut Instance| {
        // SAFETY: our caller says that there are `count` of them.
        let references = unsafe { pointers::array(references, count, "vr") }?;
        // SAFETY: our caller says that there are `count` of them.
        let values = unsafe { pointers::array(values, count, "value") }?;
        instance.set_integer(references, values)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::SET_INTEGER, body) }
}

/// Sets Boolean parameters.
///
/// # Safety
/// As for `fmi2GetReal`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetBoolean(
    component: *mut c_void,
    references: *const u32,
    count: usize,
    values: *const c_int,
) -> Status {
    let body = |instance: &mut Instance| {
        // SAFETY: our caller says that there are `count` of them.
        let references = unsafe { pointers::array(references, count, "vr") }?;
        // SAFETY: our caller says that there are `count` of them.
        let values = unsafe { pointers::array(values, count, "value") }?;
        let values = values.iter().map(boolean).collect::<Result<Vec<_>, _>>()?;
        instance.set_boolean(references, &values)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::SET_BOOLEAN, body) }
}

/// Sets String parameters.
///
/// # Safety
/// As for `fmi2GetReal`; each text is null or ends with a zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetString(
    component: *mut c_void,
    references: *const u32,
    count: usize,
    values: *const *const c_char,
) -> Status {
    let body = |instance: &mut Instance| {
        // SAFETY: our caller says that there are `count` of them.
        let references = unsafe { pointers::array(references, count, "vr") }?;
        // SAFETY: our caller says that there are `count` of them.
        let values = unsafe { pointers::array(values, count, "value") }?;
        // SAFETY: our caller says that each ends with a zero.
        let text = |value: &*const c_char| unsafe { pointers::text(*value, "value") }.map(str::to_owned);
        let values = values.iter().map(text).collect::<Result<Vec<_>, _>>()?;
        instance.set_string(references, &values)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::SET_STRING, body) }
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
