//! FMI 2.0.5, co-simulation: every function of `fmi2Functions.h`; the model-exchange ones are there to be refused.
//!
//! FMI 2.0 knows scalars only. Value reference = (FMI 3.0 value reference << 20) + row-major element, see
//! [`crate::fmu::scalar_reference`]; runs of neighbours are copied as one block.
#![allow(non_snake_case, non_camel_case_types)]
#![allow(clippy::missing_safety_doc)] // One contract for all: pointers as the standard prescribes, or null.

use std::ffi::{CString, c_char, c_int, c_uint, c_void};

use super::fmi3::OnUnwinding;
use super::guard::{self, Handle};
use super::instance::{Answer, Instance, Instance2, Refusal, answered, discard, error};
use super::logger::{Callback, Category, LogMessage2, Logger, Status, Told, truth};
use super::modes::{self, Call, fmi2 as table};
use super::pointer::{place, slice, slice_mut, text};
use super::resources;
use super::snapshot::Snapshot;
use crate::fmu::{self, FmiVersion};
use crate::port::Type;

/// `fmi2Component`.
pub type fmi2Component = *mut c_void;
/// `fmi2Boolean`.
pub type fmi2Boolean = c_int;
/// `fmi2FMUstate`.
pub type fmi2FMUstate = *mut c_void;

/// `fmi2CallbackFunctions`. The memory functions are never called: the description says
/// `canNotUseMemoryManagementFunctions`.
#[repr(C)]
pub struct fmi2CallbackFunctions {
    /// Where messages go; may be null.
    pub logger: Option<LogMessage2>,
    /// Unused.
    pub allocateMemory: *const c_void,
    /// Unused.
    pub freeMemory: *const c_void,
    /// Unused: no step runs asynchronously.
    pub stepFinished: *const c_void,
    /// Handed back to the logger.
    pub componentEnvironment: *mut c_void,
}

/// Runs one call on an instance: see [`Instance::answer`].
///
/// # Safety
/// `c` is null or came from `fmi2Instantiate` and was not freed.
unsafe fn on(c: fmi2Component, call: Call, body: impl FnOnce(&mut Instance) -> Answer) -> Status {
    // SAFETY: the caller's promise.
    unsafe { answered(c.cast::<Handle<Instance2>>(), |i| i.common.answer(call, modes::ERROR, body)) }
}

/// Functions that the component does not offer: Error and a line in the log.
macro_rules! not_offered {
    ($($name:ident($($argument:ident: $type:ty),*): $why:literal;)*) => {$(
        #[doc = concat!("`", stringify!($name), "`: ", $why, ".")]
        #[unsafe(no_mangle)]
        pub unsafe extern "C-unwind" fn $name(c: fmi2Component $(, $argument: $type)*) -> Status {
            $(let _ = $argument;)*
            // SAFETY: the host's promise about its instance.
            unsafe { on(c, modes::not_offered(stringify!($name)), |_| Err(error($why))) }
        }
    )*};
}

// ---------------------------------------------------------------- inquiry, creation, destruction, logging

/// `fmi2GetTypesPlatform`: "default".
#[unsafe(no_mangle)]
pub extern "C-unwind" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

/// `fmi2GetVersion`: "2.0".
#[unsafe(no_mangle)]
pub extern "C-unwind" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

/// `fmi2SetDebugLogging`: no categories means all.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2SetDebugLogging(
    c: fmi2Component,
    loggingOn: fmi2Boolean,
    nCategories: usize,
    categories: *const *const c_char,
) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes `nCategories` strings, or null.
        let names = unsafe { slice(categories, nCategories, "categories")? };
        // SAFETY: each of them is a string, or null.
        let names = names.iter().map(|&name| unsafe { text(name) }.unwrap_or(""));
        i.logger
            .configure(truth(loggingOn), names)
            .map_err(|name| error(format!("log category `{name}` is not declared")))
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::SET_DEBUG_LOGGING, body) }
}

/// `fmi2Instantiate`: null and a line in the log if name, type, GUID or scene are not as they should be.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2Instantiate(
    instanceName: *const c_char,
    fmuType: c_int,
    fmuGUID: *const c_char,
    fmuResourceLocation: *const c_char,
    functions: *const fmi2CallbackFunctions,
    visible: fmi2Boolean,
    loggingOn: fmi2Boolean,
) -> fmi2Component {
    const CO_SIMULATION: c_int = 1;
    let _ = visible;
    let logger = || {
        // SAFETY: the host passes its functions, or null.
        let functions = unsafe { slice(functions, 1, "functions") }.ok()?.first()?;
        // SAFETY: the host passes a string, or null.
        let name = unsafe { text(instanceName) }.unwrap_or("");
        let instance_name = CString::new(name).expect("a C string holds no zero byte").into();
        let callback = functions.logger.map_or(Callback::None, |logger| Callback::V2 { logger, instance_name });
        Some(Logger::new(callback, functions.componentEnvironment, truth(loggingOn)))
    };
    let opened = guard::caught(|| {
        let Some(logger) = logger() else { return (std::ptr::null_mut(), Told::nothing()) };
        let fail = |logger: Logger, why: &str| {
            logger.log(Status::Error, Category::Error, &format!("fmi2Instantiate: {why}"));
            (std::ptr::null_mut(), logger.take())
        };
        // SAFETY: the host passes strings, or null.
        let (name, guid, location) = unsafe { (text(instanceName), text(fmuGUID), text(fmuResourceLocation)) };
        if name.is_none_or(str::is_empty) {
            return fail(logger, "the instance name is missing");
        }
        if fmuType != CO_SIMULATION {
            return fail(logger, "this component offers co-simulation only");
        }
        let Some(guid) = guid else { return fail(logger, "the GUID is missing") };
        if !fmuResourceLocation.is_null() && location.is_none() {
            return fail(logger, "the resource location is not UTF-8");
        }
        let folder = match location.filter(|l| !l.is_empty()).map(resources::path_of_uri).transpose() {
            Ok(folder) => folder,
            Err(why) => return fail(logger, &why),
        };
        match Instance::open(guid, &[FmiVersion::V2, FmiVersion::V2Full], folder.as_deref(), logger) {
            Ok(common) => {
                let told = common.logger.take();
                (Handle::leak(Instance2 { common, last_step: Status::Ok }).cast(), told)
            }
            Err((logger, why)) => fail(logger, &why),
        }
    });
    let (instance, told): (fmi2Component, Told) = opened.unwrap_or_else(|why| {
        let told = guard::caught(|| {
            let logger = logger()?;
            logger.log(Status::Error, Category::Error, &format!("fmi2Instantiate: internal failure: {why}"));
            Some(logger.take())
        });
        (std::ptr::null_mut(), told.ok().flatten().unwrap_or_else(Told::nothing))
    });
    // SAFETY: nobody else knows of the instance yet; it goes if the host's logger throws.
    let unwanted = OnUnwinding(|| unsafe { fmi2FreeInstance(instance) });
    told.tell();
    std::mem::forget(unwanted);
    instance
}

/// `fmi2FreeInstance`: saved states go with it.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2FreeInstance(c: fmi2Component) {
    // SAFETY: the host's promise about its instance.
    unsafe { Handle::free(c.cast::<Handle<Instance2>>()) }
}

// ---------------------------------------------------------------- life

/// `fmi2SetupExperiment`.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2SetupExperiment(
    c: fmi2Component,
    toleranceDefined: fmi2Boolean,
    tolerance: f64,
    startTime: f64,
    stopTimeDefined: fmi2Boolean,
    stopTime: f64,
) -> Status {
    let body = |i: &mut Instance| {
        i.set_experiment(
            truth(toleranceDefined).then_some(tolerance),
            startTime,
            truth(stopTimeDefined).then_some(stopTime),
        )
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::SETUP_EXPERIMENT, body) }
}

/// `fmi2EnterInitializationMode`.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2EnterInitializationMode(c: fmi2Component) -> Status {
    let body = |i: &mut Instance| {
        if i.start.is_none() {
            return Err(error("fmi2SetupExperiment was not called"));
        }
        i.enter_initialization()
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::ENTER_INITIALIZATION_MODE, body) }
}

/// `fmi2ExitInitializationMode`: equilibrium at the start values.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2ExitInitializationMode(c: fmi2Component) -> Status {
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::EXIT_INITIALIZATION_MODE, Instance::exit_initialization) }
}

/// `fmi2Terminate`.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2Terminate(c: fmi2Component) -> Status {
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::TERMINATE, Instance::terminate) }
}

/// `fmi2Reset`: as after instantiation, also after an error.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2Reset(c: fmi2Component) -> Status {
    let body = |i: &mut Instance2| {
        i.last_step = Status::Ok;
        if i.common.is_poisoned() {
            super::fmi3::reset_poisoned(&mut i.common)
        } else {
            i.common.answer(table::RESET, modes::ERROR, Instance::reset)
        }
    };
    // SAFETY: the host's promise about its instance.
    unsafe { answered(c.cast::<Handle<Instance2>>(), body) }
}

// ---------------------------------------------------------------- values

/// Elements of one port that `references` names one after the other from `k` on: (port, first element, how many).
fn run(instance: &Instance, references: &[c_uint], k: usize, ty: Type) -> Result<(usize, usize, usize), Refusal> {
    let unknown = || error(format!("no variable has value reference {}", references[k]));
    let (reference, offset) = fmu::split_scalar_reference(references[k]);
    let (index, port) = instance
        .port(reference, ty)
        .map_err(|why| if why.message.starts_with("no variable") { unknown() } else { why })?;
    if offset >= port.len() || !instance.version.has(port) {
        return Err(unknown());
    }
    let longest = (port.len() - offset).min(references.len() - k);
    let n = (1..longest).find(|&j| references[k + j] != references[k] + j as c_uint).unwrap_or(longest);
    Ok((index, offset, n))
}

/// Walks over all runs of `references`.
fn each_run(
    instance: &mut Instance,
    references: &[c_uint],
    ty: Type,
    mut visit: impl FnMut(&mut Instance, usize, usize, std::ops::Range<usize>) -> Answer,
) -> Answer {
    let mut k = 0;
    while k < references.len() {
        let (port, offset, n) = run(instance, references, k, ty)?;
        visit(instance, port, offset, k..k + n)?;
        k += n;
    }
    Ok(())
}

/// `fmi2GetReal`: a copy; between steps nothing is computed.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2GetReal(
    c: fmi2Component,
    vr: *const c_uint,
    nvr: usize,
    value: *mut f64,
) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes arrays of this length, or null.
        let (references, out) = unsafe { (slice(vr, nvr, "vr")?, slice_mut(value, nvr, "value")?) };
        each_run(i, references, Type::Float64, |_, _, _, _| Ok(()))?;
        each_run(i, references, Type::Float64, |i, port, offset, range| {
            i.before_get(port)?;
            i.get_f64(port, offset, &mut out[range])
        })
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::get("fmi2GetReal"), body) }
}

/// `fmi2GetInteger`: a copy; between steps nothing is computed.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2GetInteger(
    c: fmi2Component,
    vr: *const c_uint,
    nvr: usize,
    value: *mut c_int,
) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes arrays of this length, or null.
        let (references, out) = unsafe { (slice(vr, nvr, "vr")?, slice_mut(value, nvr, "value")?) };
        each_run(i, references, Type::Int32, |_, _, _, _| Ok(()))?;
        each_run(i, references, Type::Int32, |i, port, offset, range| {
            i.before_get(port)?;
            i.get_i32(port, offset, &mut out[range])
        })
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::get("fmi2GetInteger"), body) }
}

/// `fmi2GetBoolean`: a copy; between steps nothing is computed.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2GetBoolean(
    c: fmi2Component,
    vr: *const c_uint,
    nvr: usize,
    value: *mut fmi2Boolean,
) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes arrays of this length, or null.
        let (references, out) = unsafe { (slice(vr, nvr, "vr")?, slice_mut(value, nvr, "value")?) };
        each_run(i, references, Type::Boolean, |_, _, _, _| Ok(()))?;
        each_run(i, references, Type::Boolean, |i, port, offset, range| {
            i.before_get(port)?;
            for (j, place) in out[range].iter_mut().enumerate() {
                *place = fmi2Boolean::from(i.get_bool(port, offset + j)?);
            }
            Ok(())
        })
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::get("fmi2GetBoolean"), body) }
}

/// `fmi2GetString`: no variable is a string.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2GetString(
    c: fmi2Component,
    vr: *const c_uint,
    nvr: usize,
    value: *mut *const c_char,
) -> Status {
    let _ = (vr, value);
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::get("fmi2GetString"), |_| none_of(nvr, "no variable is a string")) }
}

/// `fmi2SetReal`: checked as a whole, then written as a whole; nothing is computed.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2SetReal(
    c: fmi2Component,
    vr: *const c_uint,
    nvr: usize,
    value: *const f64,
) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes arrays of this length, or null.
        let (references, values) = unsafe { (slice(vr, nvr, "vr")?, slice(value, nvr, "value")?) };
        each_run(i, references, Type::Float64, |i, port, offset, range| i.check_set(port, offset, &values[range]))?;
        each_run(i, references, Type::Float64, |i, port, offset, range| i.set(port, offset, &values[range]))
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::set("fmi2SetReal"), body) }
}

/// `fmi2SetInteger`: checked as a whole, then written as a whole; nothing is computed.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2SetInteger(
    c: fmi2Component,
    vr: *const c_uint,
    nvr: usize,
    value: *const c_int,
) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes arrays of this length, or null.
        let (references, values) = unsafe { (slice(vr, nvr, "vr")?, slice(value, nvr, "value")?) };
        each_run(i, references, Type::Int32, |i, port, offset, range| i.check_i32(port, offset, &values[range]))?;
        each_run(i, references, Type::Int32, |i, port, offset, range| i.set_i32(port, offset, &values[range]))
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::set("fmi2SetInteger"), body) }
}

/// `fmi2SetBoolean`: no truth value can be set.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2SetBoolean(
    c: fmi2Component,
    vr: *const c_uint,
    nvr: usize,
    value: *const fmi2Boolean,
) -> Status {
    let _ = (vr, value);
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::set("fmi2SetBoolean"), |_| none_of(nvr, "no truth value can be set")) }
}

/// `fmi2SetString`: no variable is a string.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2SetString(
    c: fmi2Component,
    vr: *const c_uint,
    nvr: usize,
    value: *const *const c_char,
) -> Status {
    let _ = (vr, value);
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::set("fmi2SetString"), |_| none_of(nvr, "no variable is a string")) }
}

fn none_of(n: usize, why: &str) -> Answer {
    if n == 0 { Ok(()) } else { Err(error(why)) }
}

// ---------------------------------------------------------------- state

/// `fmi2GetFMUstate`: a new state where `*FMUstate` is null, else that one overwritten.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2GetFMUstate(c: fmi2Component, FMUstate: *mut fmi2FMUstate) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes the place of a state, or null.
        let state = unsafe { place(FMUstate, "FMUstate")? };
        *state = i.save(state.cast::<Snapshot>())?.cast_mut().cast();
        Ok(())
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::GET_FMU_STATE, body) }
}

/// `fmi2SetFMUstate`: values, outputs, time and mode; the state itself stays as it is.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2SetFMUstate(c: fmi2Component, FMUstate: fmi2FMUstate) -> Status {
    // SAFETY: the host's promise about its instance. The state's address is compared, never followed.
    unsafe { on(c, table::SET_FMU_STATE, |i| i.restore(FMUstate.cast::<Snapshot>())) }
}

/// `fmi2FreeFMUstate`: `*FMUstate` becomes null; null is no error.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2FreeFMUstate(c: fmi2Component, FMUstate: *mut fmi2FMUstate) -> Status {
    let body = |i: &mut Instance| {
        if FMUstate.is_null() {
            return Ok(());
        }
        // SAFETY: the host passes the place of a state.
        let state = unsafe { place(FMUstate, "FMUstate")? };
        i.forget(state.cast::<Snapshot>())?;
        *state = std::ptr::null_mut();
        Ok(())
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::FREE_FMU_STATE, body) }
}

/// `fmi2SerializedFMUstateSize`, bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2SerializedFMUstateSize(
    c: fmi2Component,
    FMUstate: fmi2FMUstate,
    size: *mut usize,
) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes the place of a size, or null.
        let size = unsafe { place(size, "size")? };
        *size = i.serialize(FMUstate.cast::<Snapshot>())?.len();
        Ok(())
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::SERIALIZED_FMU_STATE_SIZE, body) }
}

/// `fmi2SerializeFMUstate`: `size` bytes must hold the state.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2SerializeFMUstate(
    c: fmi2Component,
    FMUstate: fmi2FMUstate,
    serializedState: *mut u8,
    size: usize,
) -> Status {
    let body = |i: &mut Instance| {
        let bytes = i.serialize(FMUstate.cast::<Snapshot>())?;
        // SAFETY: the host passes `size` bytes, or null.
        let out = unsafe { slice_mut(serializedState, size, "serializedState")? };
        let have = out.len();
        let out = out
            .get_mut(..bytes.len())
            .ok_or_else(|| error(format!("{have} bytes cannot hold a state of {}", bytes.len())))?;
        out.copy_from_slice(&bytes);
        Ok(())
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::SERIALIZE_FMU_STATE, body) }
}

/// `fmi2DeSerializeFMUstate`: of this scene and library, from any process; legal right after instantiation.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2DeSerializeFMUstate(
    c: fmi2Component,
    serializedState: *const u8,
    size: usize,
    FMUstate: *mut fmi2FMUstate,
) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes `size` bytes and the place of a state, or null.
        let (bytes, state) =
            unsafe { (slice(serializedState, size, "serializedState")?, place(FMUstate, "FMUstate")?) };
        *state = i.deserialize(bytes, state.cast::<Snapshot>())?.cast_mut().cast();
        Ok(())
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::DESERIALIZE_FMU_STATE, body) }
}

// ---------------------------------------------------------------- step

/// `fmi2DoStep`: exactly to the end of the step, or Discard and no change at all.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2DoStep(
    c: fmi2Component,
    currentCommunicationPoint: f64,
    communicationStepSize: f64,
    noSetFMUStatePriorToCurrentPoint: fmi2Boolean,
) -> Status {
    let _ = noSetFMUStatePriorToCurrentPoint;
    let body = |i: &mut Instance2| {
        let status =
            i.common.answer(table::DO_STEP, modes::ERROR, |i| i.step(currentCommunicationPoint, communicationStepSize));
        if status == Status::Discard {
            i.common.mode = modes::STEP_FAILED;
        }
        i.last_step = status;
        status
    };
    // SAFETY: the host's promise about its instance.
    unsafe { answered(c.cast::<Handle<Instance2>>(), body) }
}

/// `fmi2CancelStep`: ends a step that is under way on another thread before its next linear solve; it is then discarded. Discard
/// where none is.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2CancelStep(c: fmi2Component) -> Status {
    // SAFETY: the host's promise about its instance.
    match unsafe { guard::cancel(c.cast::<Handle<Instance2>>()) } {
        Ok(true) => Status::Ok,
        Ok(false) => {
            // SAFETY: the host's promise about its instance.
            unsafe { on(c, modes::not_offered("fmi2CancelStep"), |_| Err(discard("no step is under way"))) }
        }
        Err(_) => Status::Error,
    }
}

/// One of the status questions: Discard where there is nothing to tell, as the standard wants.
///
/// # Safety
/// As for [`on`]; `value` is null or the host's place for the answer.
unsafe fn tell<T>(
    c: fmi2Component,
    name: &'static str,
    value: *mut T,
    answer: impl FnOnce(&Instance2) -> Option<T>,
) -> Status {
    let body = |i: &mut Instance2| {
        let told = answer(i);
        i.common.answer(table::status(name), modes::ERROR, |_| {
            // SAFETY: the caller's promise.
            let place = unsafe { place(value, "value")? };
            *place = told.ok_or_else(|| discard("this is not known here"))?;
            Ok(())
        })
    };
    // SAFETY: the caller's promise.
    unsafe { answered(c.cast::<Handle<Instance2>>(), body) }
}

/// `fmi2StatusKind`.
const DO_STEP_STATUS: c_int = 0;
const LAST_SUCCESSFUL_TIME: c_int = 2;
const TERMINATED: c_int = 3;

/// `fmi2GetStatus`: of the last step.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2GetStatus(c: fmi2Component, s: c_int, value: *mut Status) -> Status {
    // SAFETY: the host's promise about its instance and place.
    unsafe { tell(c, "fmi2GetStatus", value, |i| (s == DO_STEP_STATUS).then_some(i.last_step)) }
}

/// `fmi2GetRealStatus`: the last successful time.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2GetRealStatus(c: fmi2Component, s: c_int, value: *mut f64) -> Status {
    // SAFETY: the host's promise about its instance and place.
    unsafe { tell(c, "fmi2GetRealStatus", value, |i| (s == LAST_SUCCESSFUL_TIME).then(|| i.common.sim.time())) }
}

/// `fmi2GetIntegerStatus`: nothing to tell.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2GetIntegerStatus(c: fmi2Component, s: c_int, value: *mut c_int) -> Status {
    let _ = s;
    // SAFETY: the host's promise about its instance and place.
    unsafe { tell(c, "fmi2GetIntegerStatus", value, |_| None) }
}

/// `fmi2GetBooleanStatus`: the component never asks to end.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2GetBooleanStatus(c: fmi2Component, s: c_int, value: *mut fmi2Boolean) -> Status {
    // SAFETY: the host's promise about its instance and place.
    unsafe { tell(c, "fmi2GetBooleanStatus", value, |_| (s == TERMINATED).then_some(0)) }
}

/// `fmi2GetStringStatus`: nothing is ever pending.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2GetStringStatus(c: fmi2Component, s: c_int, value: *mut *const c_char) -> Status {
    let _ = s;
    // SAFETY: the host's promise about its instance and place.
    unsafe { tell(c, "fmi2GetStringStatus", value, |_| None) }
}

// ---------------------------------------------------------------- derivatives

/// `fmi2GetDirectionalDerivative`: one solve with the stiffness of the accepted state.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2GetDirectionalDerivative(
    c: fmi2Component,
    vUnknown_ref: *const c_uint,
    nUnknown: usize,
    vKnown_ref: *const c_uint,
    nKnown: usize,
    dvKnown: *const f64,
    dvUnknown: *mut f64,
) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes arrays of these lengths, or null.
        let (unknowns, knowns, seed, sensitivity) = unsafe {
            (
                slice(vUnknown_ref, nUnknown, "vUnknown_ref")?,
                slice(vKnown_ref, nKnown, "vKnown_ref")?,
                slice(dvKnown, nKnown, "dvKnown")?,
                slice_mut(dvUnknown, nUnknown, "dvUnknown")?,
            )
        };
        // Whole ports are asked for; the host's scalars are parts of them.
        let (known, unknown) = (Whole::of(i, knowns)?, Whole::of(i, unknowns)?);
        let mut whole_seed = vec![0.0; known.len];
        for (at, range) in &known.runs {
            whole_seed[*at..at + range.len()].copy_from_slice(&seed[range.clone()]);
        }
        let mut whole = vec![0.0; unknown.len];
        i.directional_derivative(&unknown.references, &known.references, &whole_seed, &mut whole)?;
        for (at, range) in unknown.runs {
            sensitivity[range.clone()].copy_from_slice(&whole[at..at + range.len()]);
        }
        Ok(())
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::GET_DIRECTIONAL_DERIVATIVE, body) }
}

/// `fmi2GetRealOutputDerivatives`: velocities of markers, bones and skin, its acceleration (order 1) in scenes with inertia.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi2GetRealOutputDerivatives(
    c: fmi2Component,
    vr: *const c_uint,
    nvr: usize,
    order: *const c_int,
    value: *mut f64,
) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes arrays of this length, or null.
        let (references, orders, out) =
            unsafe { (slice(vr, nvr, "vr")?, slice(order, nvr, "order")?, slice_mut(value, nvr, "value")?) };
        each_run(i, references, Type::Float64, |i, port, offset, range| {
            i.time_derivative(port, offset, &orders[range.clone()], &mut out[range])
        })
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(c, table::GET_REAL_OUTPUT_DERIVATIVES, body) }
}

/// The ports that scalars belong to, one after another, and where each run of scalars lies among their elements.
#[derive(Default)]
struct Whole {
    references: Vec<u32>,
    len: usize,
    runs: Vec<(usize, std::ops::Range<usize>)>,
}

impl Whole {
    fn of(i: &mut Instance, scalars: &[c_uint]) -> Result<Whole, Refusal> {
        let mut whole = Whole::default();
        let mut first = std::collections::BTreeMap::new();
        each_run(i, scalars, Type::Float64, |i, port, offset, range| {
            let p = &i.sim.model().ports()[port];
            let at = *first.entry(port).or_insert_with(|| {
                whole.references.push(p.reference);
                whole.len += p.len();
                whole.len - p.len()
            });
            whole.runs.push((at + offset, range));
            Ok(())
        })?;
        Ok(whole)
    }
}

// ---------------------------------------------------------------- not offered

not_offered! {
    fmi2SetRealInputDerivatives(vr: *const c_uint, nvr: usize, order: *const c_int, value: *const f64): "inputs are not interpolated";
    fmi2EnterEventMode(): "this component offers co-simulation only";
    fmi2NewDiscreteStates(eventInfo: *mut c_void): "this component offers co-simulation only";
    fmi2EnterContinuousTimeMode(): "this component offers co-simulation only";
    fmi2CompletedIntegratorStep(noSetFMUStatePriorToCurrentPoint: fmi2Boolean, enterEventMode: *mut fmi2Boolean, terminateSimulation: *mut fmi2Boolean): "this component offers co-simulation only";
    fmi2SetTime(time: f64): "this component offers co-simulation only";
    fmi2SetContinuousStates(x: *const f64, nx: usize): "this component offers co-simulation only";
    fmi2GetDerivatives(derivatives: *mut f64, nx: usize): "this component offers co-simulation only";
    fmi2GetEventIndicators(eventIndicators: *mut f64, ni: usize): "this component offers co-simulation only";
    fmi2GetContinuousStates(x: *mut f64, nx: usize): "this component offers co-simulation only";
    fmi2GetNominalsOfContinuousStates(x_nominal: *mut f64, nx: usize): "this component offers co-simulation only";
}
