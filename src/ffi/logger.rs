//! The host's logger: declared categories only, and the host's environment pointer handed back untouched.

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::sync::Arc;

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

/// `fmi3LogMessageCallback`. It may throw: messages are told once the library's own work is done.
pub type LogMessage3 = unsafe extern "C-unwind" fn(*mut c_void, Status, *const c_char, *const c_char);
/// `fmi2CallbackLogger`; as above.
pub type LogMessage2 =
    unsafe extern "C-unwind" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char, ...);

#[derive(Clone)]
pub(super) enum Callback {
    None,
    V3(LogMessage3),
    V2 { logger: LogMessage2, instance_name: Arc<CStr> },
}

/// Whether the host wants messages of a category.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Wanted {
    Yes,
    No,
    /// The host has switched debug output off as a whole: FMI 2.0 tells warnings and errors all the same.
    NoDebug,
}

pub(super) struct Logger {
    callback: Callback,
    environment: *mut c_void,
    wanted: [Wanted; LOG_CATEGORIES.len()],
    /// Messages of the call under way.
    pending: RefCell<Vec<Message>>,
}

struct Message {
    status: Status,
    category: Category,
    text: CString,
}

/// Messages of a call that is over, to be told once nothing of ours is under way: the host's callback may then do what it likes,
/// call the component and throw included.
pub(super) struct Told {
    callback: Callback,
    environment: *mut c_void,
    messages: Vec<Message>,
}

impl Logger {
    pub(super) fn new(callback: Callback, environment: *mut c_void, on: bool) -> Self {
        let all = if on { Wanted::Yes } else { Wanted::NoDebug };
        Self { callback, environment, wanted: [all; LOG_CATEGORIES.len()], pending: RefCell::default() }
    }

    /// `SetDebugLogging`: no categories means all of them; those that are not named stay as they are.
    ///
    /// # Errors
    /// The first name that the model description does not declare; nothing has changed then.
    pub(super) fn configure<'a>(&mut self, on: bool, names: impl Iterator<Item = &'a str>) -> Result<(), String> {
        let mut wanted = self.wanted;
        let mut any = false;
        for name in names {
            let i = LOG_CATEGORIES.iter().position(|c| c.0 == name).ok_or_else(|| name.to_owned())?;
            wanted[i] = if on { Wanted::Yes } else { Wanted::No };
            any = true;
        }
        if !any {
            wanted = [if on { Wanted::Yes } else { Wanted::NoDebug }; LOG_CATEGORIES.len()];
        }
        self.wanted = wanted;
        Ok(())
    }

    /// Whether a message would reach the host, so that it need not be written otherwise. FMI 3.0 is silent while
    /// logging is off; in FMI 2.0 that switch is about debug output, and what is no success is told unless its category was
    /// switched off by name.
    pub(super) fn hears(&self, status: Status, category: Category) -> bool {
        let wanted = self.wanted[category as usize];
        match self.callback {
            Callback::None => false,
            Callback::V3(_) => wanted == Wanted::Yes,
            Callback::V2 { .. } => wanted == Wanted::Yes || wanted == Wanted::NoDebug && status != Status::Ok,
        }
    }

    /// Keeps one message for the host, without a trailing newline and with `#` doubled as the standard wants.
    pub(super) fn log(&self, status: Status, category: Category, message: &str) {
        if !self.hears(status, category) {
            return;
        }
        let text =
            CString::new(message.trim_end().replace('\0', " ").replace('#', "##")).expect("zero bytes were replaced");
        self.pending.borrow_mut().push(Message { status, category, text });
    }

    /// Takes what was kept.
    pub(super) fn take(&self) -> Told {
        let messages = std::mem::take(&mut *self.pending.borrow_mut());
        let callback = if messages.is_empty() { Callback::None } else { self.callback.clone() };
        Told { callback, environment: self.environment, messages }
    }
}

impl Told {
    /// Nothing to tell.
    pub(super) fn nothing() -> Told {
        Told { callback: Callback::None, environment: std::ptr::null_mut(), messages: Vec::new() }
    }

    /// Passes the messages to the host, in their order.
    pub(super) fn tell(self) {
        for Message { status, category, text } in &self.messages {
            let name = CString::new(LOG_CATEGORIES[*category as usize].0).expect("names hold no zero byte");
            match &self.callback {
                Callback::None => {}
                Callback::V3(log) => {
                    // SAFETY: the host gave this function and environment at instantiation; the strings outlive the call.
                    unsafe { log(self.environment, *status, name.as_ptr(), text.as_ptr()) }
                }
                Callback::V2 { logger, instance_name } => {
                    // SAFETY: as above; the format is ours and takes exactly one string.
                    unsafe {
                        let name_of = instance_name.as_ptr();
                        logger(self.environment, name_of, *status, name.as_ptr(), c"%s".as_ptr(), text.as_ptr());
                    }
                }
            }
        }
    }
}

/// An `int` of the host as truth value (`fmi2Boolean`).
pub(super) fn truth(value: c_int) -> bool {
    value != 0
}
