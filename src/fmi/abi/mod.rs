//! The C functions of FMI 2.0: pointers and nothing else.
//!
//! Each function translates its arguments inside `call`, which checks the handle, runs the safe code of
//! `fmi::instance`, logs an error and turns it, or a panic, into a status. Life cycle and steps are here,
//! variables in `variables`, FMU states in `states`.
#![allow(non_snake_case)] // The names are the standard's.

mod callbacks;
mod pointers;
mod states;
mod variables;

pub use callbacks::{Callbacks, LoggerFunction};
pub use states::*;
pub use variables::*;

use super::calls::{self, Call};
use super::instance::{Instance, Reply, StatusKind};
use super::logging::{Category, Log, Status};
use super::refusal::Refusal;
use super::resources::path_of_uri;
use callbacks::CLog;
use std::cell::UnsafeCell;
use std::ffi::{c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Marks memory as one of our instances; cleared before it is freed.
const ALIVE: u64 = u64::from_le_bytes(*b"swarfFMU");

/// What a `fmi2Component` points to.
struct Handle {
    mark: AtomicU64,
    /// Set while a call runs, so that a call from inside the logger or from a second thread is refused.
    is_busy: AtomicBool,
    instance: UnsafeCell<Instance>,
}

/// Runs one call on an instance.
///
/// A null, misaligned, freed or busy handle is an error; there is no instance whose log could tell more.
///
/// # Safety
/// `component` is null or came from `fmi2Instantiate`. It is not freed while this runs. (A handle freed
/// earlier is refused as long as the allocator has left its memory alone, which nobody promises.)
unsafe fn call(
    component: *mut c_void,
    which: &'static Call,
    body: impl FnOnce(&mut Instance) -> Reply,
) -> Status {
    let pointer = component.cast::<Handle>();
    if pointer.is_null() || !pointer.is_aligned() {
        return Status::Error;
    }
    // SAFETY: not null and aligned as checked; our caller says it came from `fmi2Instantiate`.
    let handle = unsafe { &*pointer };
    if handle.mark.load(Ordering::Acquire) != ALIVE || handle.is_busy.swap(true, Ordering::Acquire) {
        return Status::Error;
    }
    // SAFETY: `is_busy` was clear, so this is the only reference to the instance until it is cleared again.
    let instance = unsafe { &mut *handle.instance.get() };
    let status = instance.run(which, body);
    handle.is_busy.store(false, Ordering::Release);
    status
}

/// Name of the types header that the functions were compiled for. FMI 2.0, section 2.1.4.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

/// Version of the standard. FMI 2.0, section 2.1.4.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

/// Makes an instance; null when it is refused. FMI 2.0, section 2.1.5.
///
/// * `kind`: 1 for co-simulation, the only one there is
/// * `resources`: URI of the unpacked resources; may be null, as the material library is built in
/// * `callbacks`: only the logger is used, and it may be null
///
/// # Safety
/// Texts are null or end with a zero; `callbacks` is null or points to the standard's struct, whose logger
/// and environment stay valid until the instance is freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Instantiate(
    name: *const c_char,
    kind: c_int,
    identity: *const c_char,
    resources: *const c_char,
    callbacks: *const Callbacks,
    _visible: c_int,
    logging_on: c_int,
) -> *mut c_void {
    if pointers::check(callbacks, "functions").is_err() {
        return std::ptr::null_mut();
    }
    // SAFETY: not null and aligned as checked; our caller says it points to the struct.
    let callbacks = unsafe { callbacks.read() };
    // SAFETY: our caller gives the guarantee that `CLog::new` asks for.
    let log = unsafe { CLog::new(&callbacks, name) };
    let made = catch_unwind(AssertUnwindSafe(|| {
        // SAFETY: our caller says that texts end with a zero.
        let checked = unsafe { check_identity(name, kind, identity) };
        let identity = match checked {
            Ok(identity) => identity,
            Err(refusal) => {
                log.log(Status::Error, Category::Error, &format!("fmi2Instantiate: {refusal}"));
                return None;
            }
        };
        let place = if resources.is_null() {
            None
        } else {
            // SAFETY: not null as checked; our caller says that it ends with a zero.
            let uri = unsafe { pointers::text(resources, "fmuResourceLocation") };
            let place = uri.ok().and_then(path_of_uri);
            if place.is_none() {
                let text =
                    "fmi2Instantiate: fmuResourceLocation is no readable file URI; going on without it";
                log.log(Status::Warning, Category::Warning, text);
            }
            place
        };
        Instance::new(identity, place, logging_on != 0, Box::new(log)).ok()
    }));
    let Ok(Some(instance)) = made else { return std::ptr::null_mut() };
    let (mark, is_busy) = (AtomicU64::new(ALIVE), AtomicBool::new(false));
    Box::into_raw(Box::new(Handle { mark, is_busy, instance: UnsafeCell::new(instance) })).cast()
}

/// Checks name and kind and gives the GUID.
///
/// # Safety
/// Texts are null or end with a zero and live during `'a`.
unsafe fn check_identity<'a>(
    name: *const c_char,
    kind: c_int,
    identity: *const c_char,
) -> Result<&'a str, Refusal> {
    // SAFETY: our caller gives the guarantee that `text` asks for.
    let name = unsafe { pointers::text(name, "instanceName") }?;
    if name.is_empty() {
        return Err(Refusal::BadArgument("instanceName is empty".into()));
    }
    if kind != 1 {
        let text = format!("fmuType {kind} is not co-simulation (1), the only type of this FMU");
        return Err(Refusal::BadArgument(text));
    }
    // SAFETY: our caller gives the guarantee that `text` asks for.
    unsafe { pointers::text(identity, "fmuGUID") }
}

/// Frees an instance and all its states; null is ignored. FMI 2.0, section 2.1.5.
///
/// # Safety
/// `component` is null or came from `fmi2Instantiate`, is not freed yet, and no other call is running on it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeInstance(component: *mut c_void) {
    // Through `call`, so that a busy instance is not torn from under its own step.
    // SAFETY: our caller gives the guarantee above, which is the one `call` asks for.
    let status = unsafe { call(component, &calls::FREE_INSTANCE, |_| Ok(Status::Ok)) };
    if status != Status::Ok {
        return;
    }
    // SAFETY: `call` has checked that this is a live instance, which our caller frees only now.
    let handle = unsafe { Box::from_raw(component.cast::<Handle>()) };
    handle.mark.store(0, Ordering::Release);
    // A panic must not cross into C; what it leaves behind is lost memory.
    let _ = catch_unwind(AssertUnwindSafe(|| drop(handle)));
    give_back_memory();
}

/// Gives memory that is no longer in use back to the system.
///
/// The C library keeps what threads have freed for threads to come; without this nearly all of an instance's
/// memory stays with the process until it ends.
pub fn give_back_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: the function takes no pointer and may be called at any time from any thread.
    unsafe {
        libc::malloc_trim(0);
    }
}

/// Switches log categories. FMI 2.0, section 2.1.5.
///
/// # Safety
/// `component` as for `fmi2DoStep`; `categories` points to `count` texts that end with a zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetDebugLogging(
    component: *mut c_void,
    logging_on: c_int,
    count: usize,
    categories: *const *const c_char,
) -> Status {
    let body = |instance: &mut Instance| {
        // SAFETY: our caller says that there are `count` of them.
        let categories = unsafe { pointers::array(categories, count, "categories") }?;
        // SAFETY: our caller says that each ends with a zero.
        let text = |category: &*const c_char| unsafe { pointers::text(*category, "categories") };
        let names = categories.iter().map(text).collect::<Result<Vec<_>, _>>()?;
        instance.set_debug_logging(logging_on != 0, &names)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::SET_DEBUG_LOGGING, body) }
}

/// Takes start and stop time (s). FMI 2.0, section 2.1.6.
///
/// # Safety
/// As for `fmi2DoStep`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetupExperiment(
    component: *mut c_void,
    tolerance_defined: c_int,
    tolerance: f64,
    start: f64,
    stop_defined: c_int,
    stop: f64,
) -> Status {
    let tolerance = (tolerance_defined != 0).then_some(tolerance);
    let stop = (stop_defined != 0).then_some(stop);
    let body = |instance: &mut Instance| instance.setup_experiment(tolerance, start, stop);
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::SETUP_EXPERIMENT, body) }
}

/// Enters initialization mode. FMI 2.0, section 2.1.6.
///
/// # Safety
/// As for `fmi2DoStep`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2EnterInitializationMode(component: *mut c_void) -> Status {
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::ENTER_INITIALIZATION_MODE, Instance::enter_initialization_mode) }
}

/// Builds the model. FMI 2.0, section 2.1.6.
///
/// # Safety
/// As for `fmi2DoStep`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2ExitInitializationMode(component: *mut c_void) -> Status {
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::EXIT_INITIALIZATION_MODE, Instance::exit_initialization_mode) }
}

/// Ends the run. FMI 2.0, section 2.1.6.
///
/// # Safety
/// As for `fmi2DoStep`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Terminate(component: *mut c_void) -> Status {
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::TERMINATE, Instance::terminate) }
}

/// Makes the instance as new. FMI 2.0, section 2.1.6.
///
/// # Safety
/// As for `fmi2DoStep`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Reset(component: *mut c_void) -> Status {
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::RESET, Instance::reset) }
}

/// Advances the simulation from `time` by `step` (both s). FMI 2.0, section 4.2.2.
///
/// # Safety
/// `component` came from `fmi2Instantiate`, is not freed, and no other call is running on it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DoStep(component: *mut c_void, time: f64, step: f64, _no_set: c_int) -> Status {
    // SAFETY: our caller gives the guarantee above, which is the one `call` asks for.
    unsafe { call(component, &calls::DO_STEP, |instance| instance.do_step(time, step)) }
}

/// Would end a step in the background. FMI 2.0, section 4.2.2.
///
/// # Safety
/// As for `fmi2DoStep`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2CancelStep(component: *mut c_void) -> Status {
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::CANCEL_STEP, Instance::cancel_step) }
}

/// Answers a question whose answer could only come from a step in the background.
///
/// # Safety
/// As for `fmi2DoStep`.
unsafe fn pending<T>(component: *mut c_void, which: &'static Call, kind: c_int, value: *mut T) -> Status {
    let body = |instance: &mut Instance| {
        pointers::check(value, "value")?;
        instance.pending_status(which, StatusKind::from_number(kind)?)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, which, body) }
}

/// Status of a step in the background: never known. FMI 2.0, section 4.2.3.
///
/// # Safety
/// As for `fmi2DoStep`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetStatus(component: *mut c_void, kind: c_int, value: *mut c_int) -> Status {
    // SAFETY: our caller gives the guarantee that `pending` asks for.
    unsafe { pending(component, &calls::GET_STATUS, kind, value) }
}

/// The last successful time (s). FMI 2.0, section 4.2.3.
///
/// # Safety
/// As for `fmi2DoStep`; `value` is null or points to room for the answer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetRealStatus(component: *mut c_void, kind: c_int, value: *mut f64) -> Status {
    let body = |instance: &mut Instance| {
        pointers::check(value, "value")?;
        let Some(time) = instance.real_status(StatusKind::from_number(kind)?)? else {
            return Ok(Status::Discard);
        };
        // SAFETY: our caller says that there is room.
        unsafe { pointers::write(value, time, "value") }.map(|()| Status::Ok)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::GET_REAL_STATUS, body) }
}

/// Whole numbers about a step: there are none. FMI 2.0, section 4.2.3.
///
/// # Safety
/// As for `fmi2DoStep`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetIntegerStatus(
    component: *mut c_void,
    kind: c_int,
    value: *mut c_int,
) -> Status {
    // SAFETY: our caller gives the guarantee that `pending` asks for.
    unsafe { pending(component, &calls::GET_INTEGER_STATUS, kind, value) }
}

/// Whether the FMU wants to end the simulation. FMI 2.0, section 4.2.3.
///
/// # Safety
/// As for `fmi2DoStep`; `value` is null or points to room for the answer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetBooleanStatus(
    component: *mut c_void,
    kind: c_int,
    value: *mut c_int,
) -> Status {
    let body = |instance: &mut Instance| {
        pointers::check(value, "value")?;
        let Some(answer) = instance.boolean_status(StatusKind::from_number(kind)?)? else {
            return Ok(Status::Discard);
        };
        // SAFETY: our caller says that there is room.
        unsafe { pointers::write(value, c_int::from(answer), "value") }.map(|()| Status::Ok)
    };
    // SAFETY: our caller gives the guarantee that `call` asks for.
    unsafe { call(component, &calls::GET_BOOLEAN_STATUS, body) }
}

/// Why a step is pending: none is. FMI 2.0, section 4.2.3.
///
/// # Safety
/// As for `fmi2DoStep`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetStringStatus(
    component: *mut c_void,
    kind: c_int,
    value: *mut *const c_char,
) -> Status {
    // SAFETY: our caller gives the guarantee that `pending` asks for.
    unsafe { pending(component, &calls::GET_STRING_STATUS, kind, value) }
}

// Apple on ARM passes variable arguments on the stack, where the tests' logger does not look for them.
#[cfg(all(test, not(all(target_vendor = "apple", target_arch = "aarch64"))))]
mod tests;
