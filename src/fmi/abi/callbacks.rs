//! The importer's callbacks, of which only the logger is used.

use crate::fmi::logging::{Category, Log, Status};
use std::ffi::{CStr, CString, c_char, c_int, c_void};

/// fmi2CallbackLogger: environment, instance name, status, category, format, and what the format names.
pub type LoggerFunction =
    unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char, ...);

/// fmi2CallbackFunctions. Memory comes from Rust's allocator and no step ends in the background, so three
/// stay unused.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Callbacks {
    /// Takes messages; may be null.
    pub logger: Option<LoggerFunction>,
    /// Unused.
    pub allocate_memory: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    /// Unused.
    pub free_memory: Option<unsafe extern "C" fn(*mut c_void)>,
    /// Unused.
    pub step_finished: Option<unsafe extern "C" fn(*mut c_void, c_int)>,
    /// Handed back to the logger.
    pub environment: *mut c_void,
}

/// The importer's logger with what it wants to hear on every call.
pub(super) struct CLog {
    logger: Option<LoggerFunction>,
    environment: *mut c_void,
    name: CString,
}

impl CLog {
    /// Keeps logger, environment and a copy of the instance's name (which may be null).
    ///
    /// # Safety
    /// `name` is null or ends with a zero. Logger and environment stay valid as long as this lives.
    pub(super) unsafe fn new(callbacks: &Callbacks, name: *const c_char) -> Self {
        let name = if name.is_null() {
            CString::default()
        } else {
            // SAFETY: not null as checked; our caller says that it ends with a zero.
            unsafe { CStr::from_ptr(name) }.to_owned()
        };
        CLog { logger: callbacks.logger, environment: callbacks.environment, name }
    }
}

impl Log for CLog {
    fn log(&self, status: Status, category: Category, message: &str) {
        let Some(logger) = self.logger else { return };
        // A zero inside would cut the message; none is expected.
        let message = CString::new(message.replace('\0', " ")).unwrap_or_default();
        let category = CString::new(category.name()).unwrap_or_default();
        let (name, format) = (self.name.as_ptr(), c"%s");
        // SAFETY: whoever made this guarantees logger and environment; all texts end with a zero and live
        // long enough. The format takes exactly one text, so no character of the message is read as one.
        unsafe {
            logger(
                self.environment,
                name,
                status as c_int,
                category.as_ptr(),
                format.as_ptr(),
                message.as_ptr(),
            )
        }
    }
}
