//! What only an insider can try: a panic inside a call, and a call from within a call.

use super::*;
use crate::fmi::description::guid;
use std::ffi::{CStr, CString};
use std::sync::Mutex;

/// The environment of the test logger: what it has been told.
type Messages = Mutex<Vec<String>>;

/// A logger as an importer has it, but for the variable arguments, which stable Rust cannot receive: the one that is
/// always passed lands where C puts a fixed one on all calling conventions that this test runs on.
unsafe extern "C" fn keep_message(
    environment: *mut c_void,
    _name: *const c_char,
    _status: c_int,
    category: *const c_char,
    _format: *const c_char,
    message: *const c_char,
) {
    // SAFETY: the tests below pass a list that outlives the instance.
    let messages = unsafe { &*environment.cast::<Messages>() };
    // SAFETY: `CLog` passes texts that end with a zero.
    let (category, message) = unsafe { (CStr::from_ptr(category), CStr::from_ptr(message)) };
    if let Ok(mut messages) = messages.lock() {
        messages.push(format!("{}: {}", category.to_string_lossy(), message.to_string_lossy()));
    }
}

fn instantiate(messages: &Messages) -> *mut c_void {
    let fixed: unsafe extern "C" fn(_, _, _, _, _, _) = keep_message;
    // SAFETY: see `keep_message`.
    let logger = unsafe { std::mem::transmute::<*const (), LoggerFunction>(fixed as *const ()) };
    let callbacks = Callbacks {
        logger: Some(logger),
        allocate_memory: None,
        free_memory: None,
        step_finished: None,
        environment: (&raw const *messages).cast_mut().cast(),
    };
    let guid = CString::new(guid()).unwrap();
    // SAFETY: all pointers are alive, and `messages` outlives the instance.
    unsafe {
        fmi2Instantiate(c"panic".as_ptr(), 1, guid.as_ptr(), std::ptr::null(), &raw const callbacks, 0, 0)
    }
}

/// A panic must not cross into C, must name itself in the log, and must leave a way out.
#[test]
fn a_panic_spoils_the_instance_until_it_is_reset_or_restored() {
    let messages = Messages::default();
    let component = instantiate(&messages);
    assert!(!component.is_null());
    let mut state = std::ptr::null_mut();
    let mut value = 0.0;
    // SAFETY: the instance is alive and used by this thread alone.
    unsafe {
        assert_eq!(fmi2EnterInitializationMode(component), Status::Ok);
        assert_eq!(fmi2GetFMUstate(component, &raw mut state), Status::Ok);
        assert_eq!(fmi2GetReal(component, &1, 1, &raw mut value), Status::Ok);

        let panicked = call(component, &calls::DO_STEP, |_| panic!("a broken invariant"));
        assert_eq!(panicked, Status::Error);
        let log = messages.lock().unwrap().join("\n");
        assert!(log.contains("fmi2DoStep: internal error: a broken invariant"), "{log}");

        assert_eq!(fmi2GetReal(component, &1, 1, &raw mut value), Status::Error);
        assert_eq!(fmi2GetFMUstate(component, &raw mut state), Status::Error);
        assert_eq!(fmi2SetFMUstate(component, state), Status::Ok);
        assert_eq!(fmi2GetReal(component, &1, 1, &raw mut value), Status::Ok);

        assert_eq!(call(component, &calls::DO_STEP, |_| panic!("again")), Status::Error);
        assert_eq!(fmi2EnterInitializationMode(component), Status::Error);
        assert_eq!(fmi2Reset(component), Status::Ok);
        assert_eq!(fmi2EnterInitializationMode(component), Status::Ok);

        assert_eq!(call(component, &calls::DO_STEP, |_| panic!("and again")), Status::Error);
        fmi2FreeInstance(component);
    }
}

/// A logger that calls back into its own instance would see it half changed, so it is refused, and freeing waits.
#[test]
fn a_call_from_within_a_call_is_refused() {
    let messages = Messages::default();
    let component = instantiate(&messages);
    // SAFETY: the instance is alive and used by this thread alone.
    unsafe {
        let outer = call(component, &calls::RESET, |instance| {
            assert_eq!(fmi2Reset(component), Status::Error);
            fmi2FreeInstance(component);
            instance.reset()
        });
        assert_eq!(outer, Status::Ok);
        fmi2FreeInstance(component);
    }
}
