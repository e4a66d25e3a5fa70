//! FMU states. FMI 2.0, section 2.1.8.
//!
//! An `fmi2FMUstate` is a number of ours in the dress of a pointer: nothing here follows it.

use super::super::calls;
use super::super::instance::Instance;
use super::super::logging::Status;
use super::{call, pointers};
use std::ffi::{c_char, c_void};

/// Copies the instance into a state; one given in `state` is overwritten, null makes a new one.
///
/// # Safety
/// `component` as for `fmi2DoStep`; `state` is null or points to a state or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetFMUstate(component: *mut c_void, state: *mut *mut c_void) -> Status {
    let body = |instance: &mut Instance| {
        pointers::check(state, "FMUstate")?;
        // SAFETY: not null and aligned as checked; our caller says that it points to a state or null.
        let previous = unsafe { state.read() }.addr();
        let handle = instance.get_fmu_state((previous != 0).then_some(previous))?;
        // SAFETY: as above.
        unsafe { pointers::write(state, std::ptr::without_provenance_mut(handle), "FMUstate") }
            .map(|()| Status::Ok)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::GET_FMU_STATE, body) }
}

/// Goes back to a state.
///
/// # Safety
/// `component` as for `fmi2DoStep`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetFMUstate(component: *mut c_void, state: *mut c_void) -> Status {
    let body = |instance: &mut Instance| instance.set_fmu_state(state.addr());
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::SET_FMU_STATE, body) }
}

/// Frees a state and sets it to null; null is ignored.
///
/// # Safety
/// `component` as for `fmi2DoStep`; `state` is null or points to a state or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeFMUstate(component: *mut c_void, state: *mut *mut c_void) -> Status {
    let body = |instance: &mut Instance| {
        if state.is_null() {
            return Ok(Status::Ok);
        }
        pointers::check(state, "FMUstate")?;
        // SAFETY: not null and aligned as checked; our caller says that it points to a state or null.
        let handle = unsafe { state.read() }.addr();
        if handle == 0 {
            return Ok(Status::Ok);
        }
        instance.free_fmu_state(handle)?;
        // SAFETY: as above.
        unsafe { pointers::write(state, std::ptr::null_mut(), "FMUstate") }.map(|()| Status::Ok)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::FREE_FMU_STATE, body) }
}

/// Number of bytes of a state.
///
/// # Safety
/// `component` as for `fmi2DoStep`; `size` is null or points to room for the answer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializedFMUstateSize(
    component: *mut c_void,
    state: *mut c_void,
    size: *mut usize,
) -> Status {
    let body = |instance: &mut Instance| {
        pointers::check(size, "size")?;
        let bytes = instance.serialized_fmu_state_size(state.addr())?;
        // SAFETY: our caller says that there is room.
        unsafe { pointers::write(size, bytes, "size") }.map(|()| Status::Ok)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::SERIALIZED_FMU_STATE_SIZE, body) }
}

/// Writes a state as bytes.
///
/// # Safety
/// `component` as for `fmi2DoStep`; `bytes` is null or points to room for `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializeFMUstate(
    component: *mut c_void,
    state: *mut c_void,
    bytes: *mut c_char,
    size: usize,
) -> Status {
    let body = |instance: &mut Instance| {
        pointers::check(bytes, "serializedState")?;
        let written = instance.serialize_fmu_state(state.addr(), size)?;
        // SAFETY: our caller says that there is room for `size` bytes, which is the length of what is
        // written.
        unsafe { pointers::write_all(bytes.cast::<u8>(), &written, "serializedState") }.map(|()| Status::Ok)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::SERIALIZE_FMU_STATE, body) }
}

/// Makes a state from bytes; what `state` held before is not looked at.
///
/// # Safety
/// `component` as for `fmi2DoStep`; `bytes` is null or points to `size` bytes; `state` is null or points to
/// room.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DeSerializeFMUstate(
    component: *mut c_void,
    bytes: *const c_char,
    size: usize,
    state: *mut *mut c_void,
) -> Status {
    let body = |instance: &mut Instance| {
        pointers::check(state, "FMUstate")?;
        // SAFETY: our caller says that there are `size` of them.
        let bytes = unsafe { pointers::array(bytes.cast::<u8>(), size, "serializedState") }?;
        let handle = instance.deserialize_fmu_state(bytes)?;
        // SAFETY: our caller says that there is room.
        unsafe { pointers::write(state, std::ptr::without_provenance_mut(handle), "FMUstate") }
            .map(|()| Status::Ok)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::DESERIALIZE_FMU_STATE, body) }
}
