//! The host's logger: declared categories only, and the host's environment pointer handed back untouched.

use std::ffi::{CString, c_char, c_int, c_void};

use crate::fmu::LOG_CATEGORIES;

/// FMI status; both versions use these numbers.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Done.
    Ok = 0,
    /// Done, but look at the log.
    Warning = 1,
    /// Not done; the instance is as before the call.
    Discard = 2,
    /// Not done; the instance needs reset, a saved state, or the end.
    Error = 3,
    /// Every instance is lost. Never returned.
    Fatal = 4,
}

/// Index into [`LOG_CATEGORIES`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Category {
    /// Equilibrium iterations.
    NonlinearSystems = 1,
    /// Warnings.
    Warning = 3,
    /// Discarded steps.
    Discard = 4,
    /// Errors.
    Error = 5,
}

/// `fmi3LogMessageCallback`.
pub type LogMessage3 = unsafe extern "C" fn(*mut c_void, Status, *const c_char, *const c_char);
/// `fmi2CallbackLogger`.
pub type LogMessage2 = unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char, ...);

pub(super) enum Callback {
    None,
    V3(LogMessage3),
    V2 { logger: LogMessage2, instance_name: CString },
}

pub(super) struct Logger {
    callback: Callback,
    environment: *mut c_void,
    on: bool,
    enabled: [bool; LOG_CATEGORIES.len()],
}

impl Logger {
    pub(super) fn new(callback: Callback, environment: *mut c_void, on: bool) -> Self {
        Self { callback, environment, on, enabled: [true; LOG_CATEGORIES.len()] }
    }

    /// `SetDebugLogging`: no categories means all of them.
    ///
    /// # Errors
    /// The first name that the model description does not declare; nothing has changed then.
    pub(super) fn configure<'a>(&mut self, on: bool, names: impl Iterator<Item = &'a str>) -> Result<(), String> {
        let mut enabled = [false; LOG_CATEGORIES.len()];
        let mut any = false;
        for name in names {
            let i = LOG_CATEGORIES.iter().position(|c| c.0 == name).ok_or_else(|| name.to_owned())?;
            enabled[i] = true;
            any = true;
        }
        self.enabled = if any { enabled } else { [true; LOG_CATEGORIES.len()] };
        self.on = on;
        Ok(())
    }

    /// Whether a message would reach the host, so that it need not be written otherwise. FMI 3.0 is silent while
    /// logging is off; in FMI 2.0 that switch is about debug output and errors are told in any case.
    pub(super) fn hears(&self, status: Status, category: Category) -> bool {
        match self.callback {
            Callback::None => false,
            Callback::V3(_) => self.on && self.enabled[category as usize],
            Callback::V2 { .. } => status != Status::Ok || (self.on && self.enabled[category as usize]),
        }
    }

    /// Passes one message to the host, without a trailing newline and with `#` doubled as the standard wants.
    pub(super) fn log(&self, status: Status, category: Category, message: &str) {
        if !self.hears(status, category) {
            return;
        }
        let name = CString::new(LOG_CATEGORIES[category as usize].0).expect("category names hold no zero byte");
        let text =
            CString::new(message.trim_end().replace('\0', " ").replace('#', "##")).expect("zero bytes were replaced");
        match &self.callback {
            Callback::None => {}
            Callback::V3(log) => {
                // SAFETY: the host gave this function and environment at instantiation; the strings outlive the call.
                unsafe { log(self.environment, status, name.as_ptr(), text.as_ptr()) }
            }
            Callback::V2 { logger, instance_name } => {
                // SAFETY: as above; the format is ours and takes exactly one string.
                unsafe {
                    logger(
                        self.environment,
                        instance_name.as_ptr(),
                        status,
                        name.as_ptr(),
                        c"%s".as_ptr(),
                        text.as_ptr(),
                    );
                }
            }
        }
    }
}

/// An `int` of the host as truth value (`fmi2Boolean`).
pub(super) fn truth(value: c_int) -> bool {
    value != 0
}
