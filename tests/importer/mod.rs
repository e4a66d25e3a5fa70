//! A small importer for the tests: an instance behind its C functions, with a log that can be read.

// Each test file uses a part of it.
#![allow(dead_code)]

pub mod sequence;

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::ptr::{null, null_mut};
use std::sync::Mutex;
use swarf::fmi::abi::*;
use swarf::fmi::description::guid;
pub use swarf::fmi::logging::Status;
use swarf::variables::by_name;

/// What the logger was told, one line per message.
pub type Messages = Mutex<Vec<String>>;

/// An instance, freed when dropped.
pub struct Slave {
    pub component: *mut c_void,
    messages: Box<Messages>,
}

/// The logger as C would define it, but for the dots: stable Rust cannot receive variable arguments. The one
/// that is always passed lands where a fixed one does, on every platform but Apple's on ARM.
unsafe extern "C" fn keep_message(
    environment: *mut c_void,
    name: *const c_char,
    status: c_int,
    category: *const c_char,
    format: *const c_char,
    message: *const c_char,
) {
    // SAFETY: `Slave` passes its messages as the environment and outlives its component; all texts end with a
    // zero.
    let (messages, name, category, format, message) = unsafe {
        (
            &*environment.cast::<Messages>(),
            CStr::from_ptr(name),
            CStr::from_ptr(category),
            CStr::from_ptr(format),
            CStr::from_ptr(message),
        )
    };
    let [name, category, format, message] =
        [name, category, format, message].map(CStr::to_string_lossy).map(String::from);
    if let Ok(mut messages) = messages.lock() {
        let fault = if format == "%s" { "" } else { "FORMAT " };
        messages.push(format!("{fault}{name} {status} {category} {message}"));
    }
}

/// The logger in the standard's dress.
pub fn logger() -> LoggerFunction {
    let fixed: unsafe extern "C" fn(_, _, _, _, _, _) = keep_message;
    // SAFETY: see `keep_message`.
    unsafe { std::mem::transmute::<*const (), LoggerFunction>(fixed as *const ()) }
}

/// Callbacks with the messages as environment.
pub fn callbacks(messages: &Messages) -> Callbacks {
    Callbacks {
        logger: Some(logger()),
        allocate_memory: None,
        free_memory: None,
        step_finished: None,
        environment: (&raw const *messages).cast_mut().cast(),
    }
}

/// A coarse cut of 600 points, so that tests take no time.
pub const COARSE: &[(&str, f64)] = &[("numerics.point_spacing", 5e-5), ("friction", 0.2)];

impl Slave {
    /// A new instance; `logging_on` as the standard has it.
    pub fn new(logging_on: bool) -> Self {
        let messages = Box::<Messages>::default();
        let callbacks = callbacks(&messages);
        let guid = CString::new(guid()).unwrap();
        // SAFETY: all pointers are alive; the messages are boxed and live as long as the component.
        let component = unsafe {
            fmi2Instantiate(
                c"slave".as_ptr(),
                1,
                guid.as_ptr(),
                null(),
                &raw const callbacks,
                0,
                logging_on.into(),
            )
        };
        assert!(!component.is_null());
        Slave { component, messages }
    }

    /// An instance of the coarse cut that is ready for its first step.
    pub fn ready(values: &[(&str, f64)]) -> Self {
        let slave = Slave::new(false);
        for (name, value) in COARSE.iter().chain(values) {
            assert_eq!(slave.set(name, *value), Status::Ok, "{name} = {value}: {}", slave.log());
        }
        slave.initialize();
        slave
    }

    /// From instantiated to ready for a step, from time 0 on.
    pub fn initialize(&self) {
        // SAFETY: the component is alive and this is the only call on it.
        unsafe {
            assert_eq!(fmi2SetupExperiment(self.component, 0, 0.0, 0.0, 1, 4e-5), Status::Ok);
            assert_eq!(fmi2EnterInitializationMode(self.component), Status::Ok);
            assert_eq!(fmi2ExitInitializationMode(self.component), Status::Ok, "{}", self.log());
        }
    }

    /// Sets a Real by name.
    pub fn set(&self, name: &str, value: f64) -> Status {
        // SAFETY: the component is alive, the arrays have one entry each.
        unsafe { fmi2SetReal(self.component, &reference(name), 1, &value) }
    }

    /// Sets the slope of an input by name.
    pub fn set_slope(&self, name: &str, order: i32, value: f64) -> Status {
        // SAFETY: the component is alive, the arrays have one entry each.
        unsafe { fmi2SetRealInputDerivatives(self.component, &reference(name), 1, &order, &value) }
    }

    /// Reads a Real by name.
    pub fn get(&self, name: &str) -> f64 {
        let mut value = f64::NAN;
        // SAFETY: the component is alive, the arrays have one entry each.
        let status = unsafe { fmi2GetReal(self.component, &reference(name), 1, &raw mut value) };
        assert_eq!(status, Status::Ok, "{name}: {}", self.log());
        value
    }

    /// Reads an Integer or Enumeration by name.
    pub fn get_integer(&self, name: &str) -> i32 {
        let mut value = i32::MIN;
        // SAFETY: the component is alive, the arrays have one entry each.
        let status = unsafe { fmi2GetInteger(self.component, &reference(name), 1, &raw mut value) };
        assert_eq!(status, Status::Ok, "{name}: {}", self.log());
        value
    }

    /// Makes a step.
    pub fn step(&self, time: f64, step: f64) -> Status {
        // SAFETY: the component is alive and this is the only call on it.
        unsafe { fmi2DoStep(self.component, time, step, 1) }
    }

    /// Copies the present state.
    pub fn state(&self) -> *mut c_void {
        let mut state = null_mut();
        // SAFETY: the component is alive, the place is ours.
        let status = unsafe { fmi2GetFMUstate(self.component, &raw mut state) };
        assert_eq!(status, Status::Ok, "{}", self.log());
        state
    }

    /// Goes back to a state.
    pub fn restore(&self, state: *mut c_void) -> Status {
        // SAFETY: the component is alive; states are not followed as pointers.
        unsafe { fmi2SetFMUstate(self.component, state) }
    }

    /// Frees a state.
    pub fn free(&self, mut state: *mut c_void) {
        // SAFETY: the component is alive, the place is ours; states are not followed as pointers.
        let status = unsafe { fmi2FreeFMUstate(self.component, &raw mut state) };
        assert_eq!(status, Status::Ok, "{}", self.log());
    }

    /// A state as bytes.
    pub fn serialize(&self, state: *mut c_void) -> Vec<u8> {
        let mut size = 0;
        // SAFETY: the component is alive, the places are ours and large enough.
        unsafe {
            let status = fmi2SerializedFMUstateSize(self.component, state, &raw mut size);
            assert_eq!(status, Status::Ok, "{}", self.log());
            let mut bytes = vec![0_u8; size];
            let status = fmi2SerializeFMUstate(self.component, state, bytes.as_mut_ptr().cast(), size);
            assert_eq!(status, Status::Ok, "{}", self.log());
            bytes
        }
    }

    /// A state from bytes.
    pub fn deserialize(&self, bytes: &[u8]) -> (Status, *mut c_void) {
        let mut state = null_mut();
        let pointer = bytes.as_ptr().cast();
        // SAFETY: the component is alive, the bytes and the place are ours.
        let status = unsafe { fmi2DeSerializeFMUstate(self.component, pointer, bytes.len(), &raw mut state) };
        (status, state)
    }

    /// All Real and Integer outputs, bit by bit.
    pub fn outputs(&self) -> Vec<u64> {
        let real = (100..=123).chain([125, 128, 129, 130]).map(|reference: u32| {
            let mut value = f64::NAN;
            // SAFETY: the component is alive, the arrays have one entry each.
            let status = unsafe { fmi2GetReal(self.component, &reference, 1, &raw mut value) };
            assert_eq!(status, Status::Ok, "{reference}");
            value.to_bits()
        });
        let mut all: Vec<u64> = real.collect();
        all.extend(
            ["numerics.active_points", "numerics.retired_points", "chip.state"]
                .map(|name| self.get_integer(name) as u64),
        );
        all
    }

    /// All messages since the last look.
    pub fn log(&self) -> String {
        std::mem::take(&mut *self.messages.lock().unwrap()).join("\n")
    }
}

impl Drop for Slave {
    fn drop(&mut self) {
        // SAFETY: the component is alive and freed only here.
        unsafe { fmi2FreeInstance(self.component) };
    }
}

/// Value reference of a variable.
pub fn reference(name: &str) -> u32 {
    by_name(name).unwrap_or_else(|| panic!("no variable {name}")).reference
}
