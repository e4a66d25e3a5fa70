//! What only an insider can try: a panic inside a call, and a call from within a call.

use super::*;
use crate::fmi::description::guid;
use std::ffi::{CStr, CString};
use std::sync::Mutex;

/// The environment of the test logger: what it has been told.
type Messages = Mutex<Vec<String>>;

/// A logger as an importer has it, but for the variable arguments, which stable Rust cannot receive: the one
/// that is always passed lands where C puts a fixed one on all calling conventions that this test runs on.
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

/// A logger that calls back into its own instance would see it half changed, so it is refused, and freeing
/// waits.
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

/// A call on an instance, with a pointer to spare for its other arguments.
type Call = fn(*mut c_void, *mut c_void) -> Status;

/// Calls with arguments that are right as far as they can be, in the order of `calls::ALL` less
/// `fmi2FreeInstance`, and whether a spoiled instance takes them: only what makes it sound again, and what
/// does not look at its model.
const SPOILED: [(&str, bool, Call); 30] = {
    use std::ptr::null;
    // SAFETY, once for all: the component is alive, arrays have one entry or none, and states are not
    // followed.
    #[allow(clippy::undocumented_unsafe_blocks)]
    [
        ("fmi2SetDebugLogging", true, |c, _| unsafe { fmi2SetDebugLogging(c, 0, 0, null()) }),
        ("fmi2SetupExperiment", false, |c, _| unsafe { fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0) }),
        ("fmi2EnterInitializationMode", false, |c, _| unsafe { fmi2EnterInitializationMode(c) }),
        ("fmi2ExitInitializationMode", false, |c, _| unsafe { fmi2ExitInitializationMode(c) }),
        ("fmi2Terminate", false, |c, _| unsafe { fmi2Terminate(c) }),
        ("fmi2Reset", true, |c, _| unsafe { fmi2Reset(c) }),
        ("fmi2GetReal", false, |c, _| unsafe { fmi2GetReal(c, &1, 1, &mut 0.0) }),
        ("fmi2GetInteger", false, |c, _| unsafe { fmi2GetInteger(c, &131, 1, &mut 0) }),
        ("fmi2GetBoolean", false, |c, _| unsafe { fmi2GetBoolean(c, &1201, 1, &mut 0) }),
        ("fmi2GetString", false, |c, _| unsafe { fmi2GetString(c, &1100, 1, &mut null()) }),
        ("fmi2SetReal", false, |c, _| unsafe { fmi2SetReal(c, &1, 1, &50.0) }),
        ("fmi2SetInteger", false, |c, _| unsafe { fmi2SetInteger(c, null(), 0, null()) }),
        ("fmi2SetBoolean", false, |c, _| unsafe { fmi2SetBoolean(c, null(), 0, null()) }),
        ("fmi2SetString", false, |c, _| unsafe { fmi2SetString(c, null(), 0, null()) }),
        ("fmi2GetFMUstate", false, |c, _| unsafe { fmi2GetFMUstate(c, &mut std::ptr::null_mut()) }),
        ("fmi2SetFMUstate", true, |c, state| unsafe { fmi2SetFMUstate(c, state) }),
        ("fmi2FreeFMUstate", true, |c, mut state| unsafe { fmi2FreeFMUstate(c, &raw mut state) }),
        ("fmi2SerializedFMUstateSize", true, |c, state| unsafe {
            fmi2SerializedFMUstateSize(c, state, &mut 0)
        }),
        ("fmi2SerializeFMUstate", true, |c, state| unsafe {
            let (mut size, mut bytes) = (0, vec![0; 1 << 16]);
            fmi2SerializedFMUstateSize(c, state, &raw mut size);
            fmi2SerializeFMUstate(c, state, bytes.as_mut_ptr(), size)
        }),
        ("fmi2DeSerializeFMUstate", true, |c, state| unsafe {
            let (mut size, mut bytes) = (0, vec![0; 1 << 16]);
            fmi2SerializedFMUstateSize(c, state, &raw mut size);
            fmi2SerializeFMUstate(c, state, bytes.as_mut_ptr(), size);
            fmi2DeSerializeFMUstate(c, bytes.as_ptr(), size, &mut std::ptr::null_mut())
        }),
        ("fmi2GetDirectionalDerivative", false, |c, _| unsafe {
            fmi2GetDirectionalDerivative(c, &100, 1, &1, 1, &1.0, &mut 0.0)
        }),
        ("fmi2SetRealInputDerivatives", false, |c, _| unsafe {
            fmi2SetRealInputDerivatives(c, &2, 1, &1, &0.0)
        }),
        ("fmi2GetRealOutputDerivatives", false, |c, _| unsafe {
            fmi2GetRealOutputDerivatives(c, &100, 1, &1, &mut 0.0)
        }),
        ("fmi2DoStep", false, |c, _| unsafe { fmi2DoStep(c, 0.0, 1e-6, 1) }),
        ("fmi2CancelStep", false, |c, _| unsafe { fmi2CancelStep(c) }),
        ("fmi2GetStatus", false, |c, _| unsafe { fmi2GetStatus(c, 0, &mut 0) }),
        ("fmi2GetRealStatus", false, |c, _| unsafe { fmi2GetRealStatus(c, 2, &mut 0.0) }),
        ("fmi2GetIntegerStatus", false, |c, _| unsafe { fmi2GetIntegerStatus(c, 0, &mut 0) }),
        ("fmi2GetBooleanStatus", false, |c, _| unsafe { fmi2GetBooleanStatus(c, 3, &mut 0) }),
        ("fmi2GetStringStatus", false, |c, _| unsafe { fmi2GetStringStatus(c, 1, &mut null()) }),
    ]
};

/// After an internal error every function of the standard answers, and only a way out is taken.
#[test]
fn a_spoiled_instance_takes_only_what_leads_out() {
    let names: Vec<&str> = calls::ALL.iter().map(|call| call.name).collect();
    for (name, taken, attempt) in SPOILED {
        assert!(names.contains(&name), "{name}");
        let messages = Messages::default();
        let component = instantiate(&messages);
        let mut state = std::ptr::null_mut();
        // SAFETY: the instance is alive and used by this thread alone.
        unsafe {
            assert_eq!(fmi2GetFMUstate(component, &raw mut state), Status::Ok);
            assert_eq!(call(component, &calls::RESET, |_| panic!("spoil it")), Status::Error);
        }
        messages.lock().unwrap().clear();
        let status = attempt(component, state);
        let log = messages.lock().unwrap().join("\n");
        if taken {
            assert_eq!((status, log.contains("allowed")), (Status::Ok, false), "{name}: {log}");
        } else {
            assert_eq!(status, Status::Error, "{name}");
            assert!(log.contains(&format!("{name}: ")) && log.contains("allowed"), "{name}: {log}");
        }
        // SAFETY: as above; freeing is allowed in every state.
        unsafe { fmi2FreeInstance(component) };
    }
}
