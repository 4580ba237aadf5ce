//! FMI 3.0.2, co-simulation: every function of `fmi3Functions.h`, in its order.
//!
//! What the model description claims is done by `instance`; what it does not claim answers Error and says so
//! in the log. Names, arguments and types are the standard's; `fmi3Boolean` is taken as a byte, so that a host's odd
//! truth value cannot become an invalid `bool`.
#![allow(non_snake_case, non_camel_case_types)]
#![allow(clippy::missing_safety_doc)] // One contract for all: pointers as the standard prescribes, or null.

use std::ffi::{c_char, c_void};
use std::path::Path;

use super::guard::{self, Handle};
use super::instance::{
    Answer, Inside, Instance, Instance3, Readable, Update, answered, answered_with_callbacks, error,
};
use super::logger::{Callback, Category, LogMessage3, Logger, Status, Told};
use super::modes::{self, Call, fmi3 as table};
use super::pointer::{place, slice, slice_mut, text};
use super::snapshot::Snapshot;
use crate::fmu::FmiVersion;
use crate::port::Type;

/// `fmi3Instance`.
pub type fmi3Instance = *mut c_void;
/// `fmi3Boolean` as a byte: 0 is false, all else true.
pub type fmi3Boolean = u8;
/// `fmi3FMUState`.
pub type fmi3FMUState = *mut c_void;

/// Runs one call on an instance: see [`Instance::answer`].
///
/// # Safety
/// `instance` is null or came from an instantiate function here and was not freed.
unsafe fn on(instance: fmi3Instance, call: Call, body: impl FnOnce(&mut Instance) -> Answer) -> Status {
    // SAFETY: the caller's promise.
    unsafe { answered(instance.cast::<Handle<Instance3>>(), |i| i.common.answer(call, modes::ERROR, body)) }
}

/// `fmi3IntermediateUpdateCallback`.
pub type IntermediateUpdate = unsafe extern "C-unwind" fn(
    *mut c_void,
    f64,
    fmi3Boolean,
    fmi3Boolean,
    fmi3Boolean,
    fmi3Boolean,
    *mut fmi3Boolean,
    *mut f64,
);

/// Runs one call that reads variables: on an instance, or, inside the host's intermediate update, on the middle of its step.
///
/// # Safety
/// As for [`on`].
unsafe fn read(instance: fmi3Instance, call: Call, body: impl FnOnce(&mut dyn Readable) -> Answer) -> Status {
    // SAFETY: the caller's promise.
    let view = unsafe { guard::offered(instance.cast::<Handle<Instance3>>()) };
    if view.is_null() {
        // SAFETY: the caller's promise.
        return unsafe { on(instance, call, |i| body(i)) };
    }
    // SAFETY: `fmi3DoStep` offers an `Inside` that lives until the host's callback on this thread is over: not before us.
    let mut inside = unsafe { *view.cast::<Inside>() };
    let answered = guard::caught(|| {
        let Err(refusal) = body(&mut inside) else { return Status::Ok };
        inside.logger.log(refusal.status, Category::Error, &format!("{}: {}", call.name, refusal.message));
        refusal.status
    });
    answered.unwrap_or(Status::Error)
}

/// Functions that the component does not offer: Error and a line in the log.
macro_rules! not_offered {
    ($($name:ident($($argument:ident: $type:ty),*): $why:literal;)*) => {$(
        #[doc = concat!("`", stringify!($name), "`: ", $why, ".")]
        #[unsafe(no_mangle)]
        pub unsafe extern "C-unwind" fn $name(instance: fmi3Instance $(, $argument: $type)*) -> Status {
            $(let _ = $argument;)*
            // SAFETY: the host's promise about its instance.
            unsafe { on(instance, modes::not_offered(stringify!($name)), |_| Err(error($why))) }
        }
    )*};
}

/// Getters and setters of types that no variable has: OK for no variables at all, else Error.
macro_rules! no_variable_of_type {
    ($($get:ident $set:ident $type:ty;)*) => {$(
        #[doc = concat!("`", stringify!($get), "`: no variable has this type.")]
        #[unsafe(no_mangle)]
        pub unsafe extern "C-unwind" fn $get(instance: fmi3Instance, valueReferences: *const u32, nValueReferences: usize, values: *mut $type, nValues: usize) -> Status {
            let _ = (valueReferences, values);
            // SAFETY: the host's promise about its instance.
            unsafe { on(instance, table::get(stringify!($get)), |_| nothing_asked(nValueReferences, nValues)) }
        }
        #[doc = concat!("`", stringify!($set), "`: no variable has this type.")]
        #[unsafe(no_mangle)]
        pub unsafe extern "C-unwind" fn $set(instance: fmi3Instance, valueReferences: *const u32, nValueReferences: usize, values: *const $type, nValues: usize) -> Status {
            let _ = (valueReferences, values);
            // SAFETY: the host's promise about its instance.
            unsafe { on(instance, table::set(stringify!($set)), |_| nothing_asked(nValueReferences, nValues)) }
        }
    )*};
}

fn nothing_asked(n_references: usize, n_values: usize) -> Answer {
    if n_references == 0 && n_values == 0 { Ok(()) } else { Err(error("no variable has this type")) }
}

// ---------------------------------------------------------------- inquiry, creation, destruction, logging

/// `fmi3GetVersion`: "3.0".
#[unsafe(no_mangle)]
pub extern "C-unwind" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

/// `fmi3SetDebugLogging`: no categories means all.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3SetDebugLogging(
    instance: fmi3Instance,
    loggingOn: fmi3Boolean,
    nCategories: usize,
    categories: *const *const c_char,
) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes `nCategories` strings, or null.
        let names = unsafe { slice(categories, nCategories, "categories")? };
        // SAFETY: each of them is a string, or null.
        let names = names.iter().map(|&name| unsafe { text(name) }.unwrap_or(""));
        i.logger
            .configure(loggingOn != 0, names)
            .map_err(|name| error(format!("log category `{name}` is not declared")))
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(instance, table::SET_DEBUG_LOGGING, body) }
}

/// `fmi3InstantiateModelExchange`: not offered, returns null.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3InstantiateModelExchange(
    instanceName: *const c_char,
    instantiationToken: *const c_char,
    resourcePath: *const c_char,
    visible: fmi3Boolean,
    loggingOn: fmi3Boolean,
    instanceEnvironment: *mut c_void,
    logMessage: Option<LogMessage3>,
) -> fmi3Instance {
    let _ = (instanceName, instantiationToken, resourcePath, visible);
    refuse_instance(
        logMessage,
        instanceEnvironment,
        loggingOn,
        "fmi3InstantiateModelExchange: this component offers co-simulation only",
    )
}

/// `fmi3InstantiateCoSimulation`: null and a line in the log if name, token or scene are not as they should be.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3InstantiateCoSimulation(
    instanceName: *const c_char,
    instantiationToken: *const c_char,
    resourcePath: *const c_char,
    visible: fmi3Boolean,
    loggingOn: fmi3Boolean,
    eventModeUsed: fmi3Boolean,
    earlyReturnAllowed: fmi3Boolean,
    requiredIntermediateVariables: *const u32,
    nRequiredIntermediateVariables: usize,
    instanceEnvironment: *mut c_void,
    logMessage: Option<LogMessage3>,
    intermediateUpdate: Option<IntermediateUpdate>,
) -> fmi3Instance {
    // All variables can be read in an intermediate update, whether they are said to be required or not.
    let _ = (visible, earlyReturnAllowed, requiredIntermediateVariables, nRequiredIntermediateVariables);
    let opened = guard::caught(|| {
        let logger = Logger::new(logMessage.map_or(Callback::None, Callback::V3), instanceEnvironment, loggingOn != 0);
        let fail = |logger: Logger, why: &str| {
            logger.log(Status::Error, Category::Error, &format!("fmi3InstantiateCoSimulation: {why}"));
            (std::ptr::null_mut(), logger.take())
        };
        // SAFETY: the host passes strings, or null.
        let (name, token, folder) = unsafe { (text(instanceName), text(instantiationToken), text(resourcePath)) };
        if name.is_none_or(str::is_empty) {
            return fail(logger, "the instance name is missing");
        }
        let Some(token) = token else { return fail(logger, "the instantiation token is missing") };
        if !resourcePath.is_null() && folder.is_none() {
            return fail(logger, "the resource path is not UTF-8");
        }
        if eventModeUsed != 0 {
            return fail(logger, "eventModeUsed, but this component has no event mode");
        }
        match Instance::open(token, &[FmiVersion::V3], folder.map(Path::new), logger) {
            Ok(common) => {
                let update = intermediateUpdate.map(|callback| Update { callback, environment: instanceEnvironment });
                let told = common.logger.take();
                (Handle::leak(Instance3 { common, update }).cast(), told)
            }
            Err((logger, why)) => fail(logger, &why),
        }
    });
    let opened = opened.map(|(instance, told): (fmi3Instance, Told)| {
        // SAFETY: nobody else knows of the instance yet; it goes if the host's logger throws.
        let unwanted = OnUnwinding(|| unsafe { fmi3FreeInstance(instance) });
        told.tell();
        std::mem::forget(unwanted);
        instance
    });
    opened.unwrap_or_else(|why| {
        refuse_instance(
            logMessage,
            instanceEnvironment,
            loggingOn,
            &format!("fmi3InstantiateCoSimulation: internal failure: {why}"),
        )
    })
}

/// `fmi3InstantiateScheduledExecution`: not offered, returns null.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3InstantiateScheduledExecution(
    instanceName: *const c_char,
    instantiationToken: *const c_char,
    resourcePath: *const c_char,
    visible: fmi3Boolean,
    loggingOn: fmi3Boolean,
    instanceEnvironment: *mut c_void,
    logMessage: Option<LogMessage3>,
    clockUpdate: *const c_void,
    lockPreemption: *const c_void,
    unlockPreemption: *const c_void,
) -> fmi3Instance {
    let _ = (instanceName, instantiationToken, resourcePath, visible, clockUpdate, lockPreemption, unlockPreemption);
    refuse_instance(
        logMessage,
        instanceEnvironment,
        loggingOn,
        "fmi3InstantiateScheduledExecution: this component offers co-simulation only",
    )
}

fn refuse_instance(log: Option<LogMessage3>, environment: *mut c_void, on: fmi3Boolean, why: &str) -> fmi3Instance {
    let told = guard::caught(|| {
        let logger = Logger::new(log.map_or(Callback::None, Callback::V3), environment, on != 0);
        logger.log(Status::Error, Category::Error, why);
        logger.take()
    });
    told.unwrap_or_else(|_| Told::nothing()).tell();
    std::ptr::null_mut()
}

/// Runs when it is dropped, which is while the host's exception passes through; forgotten otherwise.
pub(super) struct OnUnwinding<F: FnMut()>(pub(super) F);

impl<F: FnMut()> Drop for OnUnwinding<F> {
    fn drop(&mut self) {
        (self.0)();
    }
}

/// `fmi3FreeInstance`: saved states go with it.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3FreeInstance(instance: fmi3Instance) {
    // SAFETY: the host's promise about its instance.
    unsafe { Handle::free(instance.cast::<Handle<Instance3>>()) }
}

// ---------------------------------------------------------------- life

/// `fmi3EnterInitializationMode`.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3EnterInitializationMode(
    instance: fmi3Instance,
    toleranceDefined: fmi3Boolean,
    tolerance: f64,
    startTime: f64,
    stopTimeDefined: fmi3Boolean,
    stopTime: f64,
) -> Status {
    let body = |i: &mut Instance| {
        i.set_experiment(
            (toleranceDefined != 0).then_some(tolerance),
            startTime,
            (stopTimeDefined != 0).then_some(stopTime),
        )?;
        i.enter_initialization()
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(instance, table::ENTER_INITIALIZATION_MODE, body) }
}

/// `fmi3ExitInitializationMode`: equilibrium at the start values.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3ExitInitializationMode(instance: fmi3Instance) -> Status {
    // SAFETY: the host's promise about its instance.
    unsafe { on(instance, table::EXIT_INITIALIZATION_MODE, Instance::exit_initialization) }
}

not_offered! {
    fmi3EnterEventMode(): "this component has no event mode";
}

/// `fmi3Terminate`.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3Terminate(instance: fmi3Instance) -> Status {
    // SAFETY: the host's promise about its instance.
    unsafe { on(instance, table::TERMINATE, Instance::terminate) }
}

/// `fmi3Reset`: as after instantiation, also after an error.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3Reset(instance: fmi3Instance) -> Status {
    let body = |i: &mut Instance3| {
        if i.common.is_poisoned() {
            reset_poisoned(&mut i.common)
        } else {
            i.common.answer(table::RESET, modes::ERROR, Instance::reset)
        }
    };
    // SAFETY: the host's promise about its instance.
    unsafe { answered(instance.cast::<Handle<Instance3>>(), body) }
}

/// Reset is the one call that a poisoned instance still obeys.
pub(super) fn reset_poisoned(instance: &mut Instance) -> Status {
    match instance.reset() {
        Ok(()) => Status::Ok,
        Err(refusal) => refusal.status,
    }
}

// ---------------------------------------------------------------- values

/// `fmi3GetFloat64`: a copy; between steps nothing is computed.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3GetFloat64(
    instance: fmi3Instance,
    valueReferences: *const u32,
    nValueReferences: usize,
    values: *mut f64,
    nValues: usize,
) -> Status {
    let body = |i: &mut dyn Readable| {
        // SAFETY: the host passes arrays of these lengths, or null.
        let (references, out) = unsafe {
            (slice(valueReferences, nValueReferences, "valueReferences")?, slice_mut(values, nValues, "values")?)
        };
        check_floats(i, references, false)?;
        check_lengths(i, references, Type::Float64, out.len())?;
        let mut rest = out;
        for &reference in references {
            let (port, n) = i.port(reference, Type::Float64).map(|(k, p)| (k, p.len()))?;
            i.before_get(port)?;
            let (now, later) = rest.split_at_mut(n);
            i.get_f64(port, 0, now)?;
            rest = later;
        }
        Ok(())
    };
    // SAFETY: the host's promise about its instance.
    unsafe { read(instance, table::get("fmi3GetFloat64"), body) }
}

/// `fmi3GetFloat32`: a copy, rounded to single precision.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3GetFloat32(
    instance: fmi3Instance,
    valueReferences: *const u32,
    nValueReferences: usize,
    values: *mut f32,
    nValues: usize,
) -> Status {
    let body = |i: &mut dyn Readable| {
        // SAFETY: the host passes arrays of these lengths, or null.
        let (references, out) = unsafe {
            (slice(valueReferences, nValueReferences, "valueReferences")?, slice_mut(values, nValues, "values")?)
        };
        check_floats(i, references, true)?;
        check_lengths(i, references, Type::Float64, out.len())?;
        let mut rest = out;
        for &reference in references {
            let (port, n) = i.port(reference, Type::Float64).map(|(k, p)| (k, p.len()))?;
            i.before_get(port)?;
            let (now, later) = rest.split_at_mut(n);
            for (k, value) in now.iter_mut().enumerate() {
                let mut wide = [0.0];
                i.get_f64(port, k, &mut wide)?;
                *value = wide[0] as f32;
            }
            rest = later;
        }
        Ok(())
    };
    // SAFETY: the host's promise about its instance.
    unsafe { read(instance, table::get("fmi3GetFloat32"), body) }
}

/// `fmi3GetInt32`: a copy; between steps nothing is computed.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3GetInt32(
    instance: fmi3Instance,
    valueReferences: *const u32,
    nValueReferences: usize,
    values: *mut i32,
    nValues: usize,
) -> Status {
    let body = |i: &mut dyn Readable| {
        // SAFETY: the host passes arrays of these lengths, or null.
        let (references, out) = unsafe {
            (slice(valueReferences, nValueReferences, "valueReferences")?, slice_mut(values, nValues, "values")?)
        };
        check_lengths(i, references, Type::Int32, out.len())?;
        let mut rest = out;
        for &reference in references {
            let (port, n) = i.port(reference, Type::Int32).map(|(k, p)| (k, p.len()))?;
            i.before_get(port)?;
            let (now, later) = rest.split_at_mut(n);
            i.get_i32(port, 0, now)?;
            rest = later;
        }
        Ok(())
    };
    // SAFETY: the host's promise about its instance.
    unsafe { read(instance, table::get("fmi3GetInt32"), body) }
}

/// `fmi3GetBoolean`: a copy; between steps nothing is computed.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3GetBoolean(
    instance: fmi3Instance,
    valueReferences: *const u32,
    nValueReferences: usize,
    values: *mut fmi3Boolean,
    nValues: usize,
) -> Status {
    let body = |i: &mut dyn Readable| {
        // SAFETY: the host passes arrays of these lengths, or null.
        let (references, out) = unsafe {
            (slice(valueReferences, nValueReferences, "valueReferences")?, slice_mut(values, nValues, "values")?)
        };
        check_lengths(i, references, Type::Boolean, out.len())?;
        let mut k = 0;
        for &reference in references {
            let (port, n) = i.port(reference, Type::Boolean).map(|(k, p)| (k, p.len()))?;
            i.before_get(port)?;
            for offset in 0..n {
                out[k] = fmi3Boolean::from(i.get_bool(port, offset)?);
                k += 1;
            }
        }
        Ok(())
    };
    // SAFETY: the host's promise about its instance.
    unsafe { read(instance, table::get("fmi3GetBoolean"), body) }
}

/// `fmi3SetFloat64`: checked as a whole, then written as a whole; nothing is computed.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3SetFloat64(
    instance: fmi3Instance,
    valueReferences: *const u32,
    nValueReferences: usize,
    values: *const f64,
    nValues: usize,
) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes arrays of these lengths, or null.
        let (references, values) = unsafe {
            (slice(valueReferences, nValueReferences, "valueReferences")?, slice(values, nValues, "values")?)
        };
        check_floats(i, references, false)?;
        check_lengths(i, references, Type::Float64, values.len())?;
        let mut rest = values;
        for &reference in references {
            let (k, n) = i.port(reference, Type::Float64).map(|(k, p)| (k, p.len()))?;
            let (now, later) = rest.split_at(n);
            i.check_set(k, 0, now)?;
            rest = later;
        }
        let mut rest = values;
        for &reference in references {
            let (port, n) = i.port(reference, Type::Float64).map(|(k, p)| (k, p.len()))?;
            let (now, later) = rest.split_at(n);
            i.set(port, 0, now)?;
            rest = later;
        }
        Ok(())
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(instance, table::set("fmi3SetFloat64"), body) }
}

/// `fmi3SetFloat32`: checked as a whole, then written as a whole; nothing is computed.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3SetFloat32(
    instance: fmi3Instance,
    valueReferences: *const u32,
    nValueReferences: usize,
    values: *const f32,
    nValues: usize,
) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes arrays of these lengths, or null.
        let (references, values) = unsafe {
            (slice(valueReferences, nValueReferences, "valueReferences")?, slice(values, nValues, "values")?)
        };
        check_floats(i, references, true)?;
        check_lengths(i, references, Type::Float64, values.len())?;
        let mut rest = values;
        for &reference in references {
            let (port, n) = i.port(reference, Type::Float64).map(|(k, p)| (k, p.len()))?;
            let (now, later) = rest.split_at(n);
            now.iter().enumerate().try_for_each(|(k, v)| i.check_set(port, k, &[f64::from(*v)]))?;
            rest = later;
        }
        let mut rest = values;
        for &reference in references {
            let (port, n) = i.port(reference, Type::Float64).map(|(k, p)| (k, p.len()))?;
            let (now, later) = rest.split_at(n);
            now.iter().enumerate().try_for_each(|(k, v)| i.set(port, k, &[f64::from(*v)]))?;
            rest = later;
        }
        Ok(())
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(instance, table::set("fmi3SetFloat32"), body) }
}

/// `fmi3SetInt32`: checked as a whole, then written as a whole; nothing is computed.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3SetInt32(
    instance: fmi3Instance,
    valueReferences: *const u32,
    nValueReferences: usize,
    values: *const i32,
    nValues: usize,
) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes arrays of these lengths, or null.
        let (references, values) = unsafe {
            (slice(valueReferences, nValueReferences, "valueReferences")?, slice(values, nValues, "values")?)
        };
        check_lengths(i, references, Type::Int32, values.len())?;
        for pass in [Instance::check_i32, Instance::set_i32] {
            let mut rest = values;
            for &reference in references {
                let (port, n) = i.port(reference, Type::Int32).map(|(k, p)| (k, p.len()))?;
                let (now, later) = rest.split_at(n);
                pass(i, port, 0, now)?;
                rest = later;
            }
        }
        Ok(())
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(instance, table::set("fmi3SetInt32"), body) }
}

/// `fmi3SetBoolean`: no variable of this type can be set.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3SetBoolean(
    instance: fmi3Instance,
    valueReferences: *const u32,
    nValueReferences: usize,
    values: *const fmi3Boolean,
    nValues: usize,
) -> Status {
    let _ = (valueReferences, values);
    // SAFETY: the host's promise about its instance.
    unsafe { on(instance, table::set("fmi3SetBoolean"), |_| nothing_settable(nValueReferences, nValues)) }
}

fn nothing_settable(n_references: usize, n_values: usize) -> Answer {
    if n_references == 0 && n_values == 0 { Ok(()) } else { Err(error("no variable of this type can be set")) }
}

/// Float64 variables go through the Float64 functions, those that FMI shows as Float32 through the others.
fn check_floats(i: &dyn Readable, references: &[u32], single: bool) -> Answer {
    for &reference in references {
        let (_, port) = i.port(reference, Type::Float64)?;
        if port.single != single {
            let wanted = if port.single { "Float32" } else { "Float64" };
            return Err(error(format!("`{}` (value reference {reference}) is {wanted}", port.name)));
        }
    }
    Ok(())
}

/// `nValues` must be the sum of the sizes of all variables named (FMI 3.0.2, section 2.2.7.2).
fn check_lengths(instance: &dyn Readable, references: &[u32], ty: Type, n_values: usize) -> Answer {
    let mut wanted = 0;
    for &reference in references {
        wanted += instance.port(reference, ty)?.1.len();
    }
    if wanted == n_values {
        Ok(())
    } else {
        Err(error(format!("nValues is {n_values}, but the variables hold {wanted}")))
    }
}

no_variable_of_type! {
    fmi3GetInt8 fmi3SetInt8 i8;
    fmi3GetUInt8 fmi3SetUInt8 u8;
    fmi3GetInt16 fmi3SetInt16 i16;
    fmi3GetUInt16 fmi3SetUInt16 u16;
    fmi3GetUInt32 fmi3SetUInt32 u32;
    fmi3GetInt64 fmi3SetInt64 i64;
    fmi3GetUInt64 fmi3SetUInt64 u64;
    fmi3GetString fmi3SetString *const c_char;
}

not_offered! {
    fmi3GetBinary(valueReferences: *const u32, nValueReferences: usize, valueSizes: *mut usize, values: *mut *const u8, nValues: usize): "no variable is binary";
    fmi3SetBinary(valueReferences: *const u32, nValueReferences: usize, valueSizes: *const usize, values: *const *const u8, nValues: usize): "no variable is binary";
    fmi3GetClock(valueReferences: *const u32, nValueReferences: usize, values: *mut fmi3Boolean): "no variable is a clock";
    fmi3SetClock(valueReferences: *const u32, nValueReferences: usize, values: *const fmi3Boolean): "no variable is a clock";
    fmi3GetNumberOfVariableDependencies(valueReference: u32, nDependencies: *mut usize): "dependencies of single elements are not provided";
    fmi3GetVariableDependencies(dependent: u32, elementIndicesOfDependent: *mut usize, independents: *mut u32, elementIndicesOfIndependents: *mut usize, dependencyKinds: *mut i32, nDependencies: usize): "dependencies of single elements are not provided";
}

// ---------------------------------------------------------------- state

/// `fmi3GetFMUState`: a new state where `*FMUState` is null, else that one overwritten.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3GetFMUState(instance: fmi3Instance, FMUState: *mut fmi3FMUState) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes the place of a state, or null.
        let state = unsafe { place(FMUState, "FMUState")? };
        *state = i.save(state.cast::<Snapshot>())?.cast_mut().cast();
        Ok(())
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(instance, table::GET_FMU_STATE, body) }
}

/// `fmi3SetFMUState`: values, outputs, time and mode; the state itself stays as it is.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3SetFMUState(instance: fmi3Instance, FMUState: fmi3FMUState) -> Status {
    // SAFETY: the host's promise about its instance. The state's address is compared, never followed.
    unsafe { on(instance, table::SET_FMU_STATE, |i| i.restore(FMUState.cast::<Snapshot>())) }
}

/// `fmi3FreeFMUState`: `*FMUState` becomes null; null is no error.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3FreeFMUState(instance: fmi3Instance, FMUState: *mut fmi3FMUState) -> Status {
    let body = |i: &mut Instance| {
        if FMUState.is_null() {
            return Ok(());
        }
        // SAFETY: the host passes the place of a state.
        let state = unsafe { place(FMUState, "FMUState")? };
        i.forget(state.cast::<Snapshot>())?;
        *state = std::ptr::null_mut();
        Ok(())
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(instance, table::FREE_FMU_STATE, body) }
}

/// `fmi3SerializedFMUStateSize`, bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3SerializedFMUStateSize(
    instance: fmi3Instance,
    FMUState: fmi3FMUState,
    size: *mut usize,
) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes the place of a size, or null.
        let size = unsafe { place(size, "size")? };
        *size = i.serialize(FMUState.cast::<Snapshot>())?.len();
        Ok(())
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(instance, table::SERIALIZED_FMU_STATE_SIZE, body) }
}

/// `fmi3SerializeFMUState`: `size` bytes must hold the state.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3SerializeFMUState(
    instance: fmi3Instance,
    FMUState: fmi3FMUState,
    serializedState: *mut u8,
    size: usize,
) -> Status {
    let body = |i: &mut Instance| {
        let bytes = i.serialize(FMUState.cast::<Snapshot>())?;
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
    unsafe { on(instance, table::SERIALIZE_FMU_STATE, body) }
}

/// `fmi3DeserializeFMUState`: of this scene and library, from any process; legal right after instantiation.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3DeserializeFMUState(
    instance: fmi3Instance,
    serializedState: *const u8,
    size: usize,
    FMUState: *mut fmi3FMUState,
) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes `size` bytes and the place of a state, or null.
        let (bytes, state) =
            unsafe { (slice(serializedState, size, "serializedState")?, place(FMUState, "FMUState")?) };
        *state = i.deserialize(bytes, state.cast::<Snapshot>())?.cast_mut().cast();
        Ok(())
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(instance, table::DESERIALIZE_FMU_STATE, body) }
}

// ---------------------------------------------------------------- derivatives, configuration, clocks, model exchange

/// `fmi3GetOutputDerivatives`: velocities of skin, markers and bones, acceleration of the skin (order 1) in scenes with inertia;
/// one order a variable.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3GetOutputDerivatives(
    instance: fmi3Instance,
    valueReferences: *const u32,
    nValueReferences: usize,
    orders: *const i32,
    values: *mut f64,
    nValues: usize,
) -> Status {
    let body = |i: &mut dyn Readable| {
        // SAFETY: the host passes arrays of these lengths, or null.
        let (references, orders, out) = unsafe {
            (
                slice(valueReferences, nValueReferences, "valueReferences")?,
                slice(orders, nValueReferences, "orders")?,
                slice_mut(values, nValues, "values")?,
            )
        };
        check_floats(i, references, false)?;
        check_lengths(i, references, Type::Float64, out.len())?;
        let mut rest = out;
        for (&reference, order) in references.iter().zip(orders) {
            let (port, n) = i.port(reference, Type::Float64).map(|(k, p)| (k, p.len()))?;
            let (now, later) = rest.split_at_mut(n);
            i.time_derivative(port, 0, &[*order], now)?;
            rest = later;
        }
        Ok(())
    };
    // SAFETY: the host's promise about its instance.
    unsafe { read(instance, table::GET_OUTPUT_DERIVATIVES, body) }
}

/// `fmi3GetDirectionalDerivative`: one solve with the stiffness of the accepted state.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3GetDirectionalDerivative(
    instance: fmi3Instance,
    unknowns: *const u32,
    nUnknowns: usize,
    knowns: *const u32,
    nKnowns: usize,
    seed: *const f64,
    nSeed: usize,
    sensitivity: *mut f64,
    nSensitivity: usize,
) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes arrays of these lengths, or null.
        let (unknowns, knowns, seed, sensitivity) = unsafe {
            (
                slice(unknowns, nUnknowns, "unknowns")?,
                slice(knowns, nKnowns, "knowns")?,
                slice(seed, nSeed, "seed")?,
                slice_mut(sensitivity, nSensitivity, "sensitivity")?,
            )
        };
        check_lengths(i, knowns, Type::Float64, seed.len())?;
        check_lengths(i, unknowns, Type::Float64, sensitivity.len())?;
        i.directional_derivative(unknowns, knowns, seed, sensitivity)
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(instance, table::GET_DIRECTIONAL_DERIVATIVE, body) }
}

/// `fmi3GetAdjointDerivative`: one solve with the transposed stiffness of the accepted state.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3GetAdjointDerivative(
    instance: fmi3Instance,
    unknowns: *const u32,
    nUnknowns: usize,
    knowns: *const u32,
    nKnowns: usize,
    seed: *const f64,
    nSeed: usize,
    sensitivity: *mut f64,
    nSensitivity: usize,
) -> Status {
    let body = |i: &mut Instance| {
        // SAFETY: the host passes arrays of these lengths, or null.
        let (unknowns, knowns, seed, sensitivity) = unsafe {
            (
                slice(unknowns, nUnknowns, "unknowns")?,
                slice(knowns, nKnowns, "knowns")?,
                slice(seed, nSeed, "seed")?,
                slice_mut(sensitivity, nSensitivity, "sensitivity")?,
            )
        };
        check_lengths(i, unknowns, Type::Float64, seed.len())?;
        check_lengths(i, knowns, Type::Float64, sensitivity.len())?;
        i.adjoint_derivative(unknowns, knowns, seed, sensitivity)
    };
    // SAFETY: the host's promise about its instance.
    unsafe { on(instance, table::GET_ADJOINT_DERIVATIVE, body) }
}

not_offered! {
    fmi3EnterConfigurationMode(): "there are no structural parameters";
    fmi3ExitConfigurationMode(): "there are no structural parameters";
    fmi3GetIntervalDecimal(valueReferences: *const u32, nValueReferences: usize, intervals: *mut f64, qualifiers: *mut i32): "no variable is a clock";
    fmi3GetIntervalFraction(valueReferences: *const u32, nValueReferences: usize, counters: *mut u64, resolutions: *mut u64, qualifiers: *mut i32): "no variable is a clock";
    fmi3GetShiftDecimal(valueReferences: *const u32, nValueReferences: usize, shifts: *mut f64): "no variable is a clock";
    fmi3GetShiftFraction(valueReferences: *const u32, nValueReferences: usize, counters: *mut u64, resolutions: *mut u64): "no variable is a clock";
    fmi3SetIntervalDecimal(valueReferences: *const u32, nValueReferences: usize, intervals: *const f64): "no variable is a clock";
    fmi3SetIntervalFraction(valueReferences: *const u32, nValueReferences: usize, counters: *const u64, resolutions: *const u64): "no variable is a clock";
    fmi3SetShiftDecimal(valueReferences: *const u32, nValueReferences: usize, shifts: *const f64): "no variable is a clock";
    fmi3SetShiftFraction(valueReferences: *const u32, nValueReferences: usize, counters: *const u64, resolutions: *const u64): "no variable is a clock";
    fmi3EvaluateDiscreteStates(): "this component has no event mode";
    fmi3UpdateDiscreteStates(discreteStatesNeedUpdate: *mut fmi3Boolean, terminateSimulation: *mut fmi3Boolean, nominalsOfContinuousStatesChanged: *mut fmi3Boolean, valuesOfContinuousStatesChanged: *mut fmi3Boolean, nextEventTimeDefined: *mut fmi3Boolean, nextEventTime: *mut f64): "this component has no event mode";
    fmi3EnterContinuousTimeMode(): "this component offers co-simulation only";
    fmi3CompletedIntegratorStep(noSetFMUStatePriorToCurrentPoint: fmi3Boolean, enterEventMode: *mut fmi3Boolean, terminateSimulation: *mut fmi3Boolean): "this component offers co-simulation only";
    fmi3SetTime(time: f64): "this component offers co-simulation only";
    fmi3SetContinuousStates(continuousStates: *const f64, nContinuousStates: usize): "this component offers co-simulation only";
    fmi3GetContinuousStateDerivatives(derivatives: *mut f64, nContinuousStates: usize): "this component offers co-simulation only";
    fmi3GetEventIndicators(eventIndicators: *mut f64, nEventIndicators: usize): "this component offers co-simulation only";
    fmi3GetContinuousStates(continuousStates: *mut f64, nContinuousStates: usize): "this component offers co-simulation only";
    fmi3GetNominalsOfContinuousStates(nominals: *mut f64, nContinuousStates: usize): "this component offers co-simulation only";
    fmi3GetNumberOfEventIndicators(nEventIndicators: *mut usize): "this component offers co-simulation only";
    fmi3GetNumberOfContinuousStates(nContinuousStates: *mut usize): "this component offers co-simulation only";
    fmi3EnterStepMode(): "this component has no event mode";
    fmi3ActivateModelPartition(clockReference: u32, activationTime: f64): "this component offers co-simulation only";
}

// ---------------------------------------------------------------- step

/// `fmi3DoStep`: exactly to the end of the step, or Discard and no change at all.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn fmi3DoStep(
    instance: fmi3Instance,
    currentCommunicationPoint: f64,
    communicationStepSize: f64,
    noSetFMUStatePriorToCurrentPoint: fmi3Boolean,
    eventHandlingNeeded: *mut fmi3Boolean,
    terminateSimulation: *mut fmi3Boolean,
    earlyReturn: *mut fmi3Boolean,
    lastSuccessfulTime: *mut f64,
) -> Status {
    let _ = noSetFMUStatePriorToCurrentPoint;
    for flag in [eventHandlingNeeded, terminateSimulation, earlyReturn] {
        // SAFETY: each is null or the host's place for one truth value.
        if let Ok(flag) = unsafe { place(flag, "") } {
            *flag = 0;
        }
    }
    let handle = instance.cast::<Handle<Instance3>>();
    let outputs = [eventHandlingNeeded, terminateSimulation, earlyReturn];
    let complete = !outputs.iter().any(|p| p.is_null()) && !lastSuccessfulTime.is_null();
    let (at, dt) = (currentCommunicationPoint, communicationStepSize);
    let body = |i: &mut Instance3| {
        let status = if !complete || i.update.is_none() {
            guard::caught(|| {
                i.common.answer(table::DO_STEP, modes::ERROR, |i| match complete {
                    true => i.step(at, dt),
                    false => Err(error("an output argument is NULL")),
                })
            })
        } else {
            i.step_watched(table::DO_STEP, at, dt, |update, inside| {
                // SAFETY: we are inside a call on this very handle, on this thread, between what `step_watched` catches.
                unsafe { guard::offering(handle, (&raw const *inside).cast(), || update.tell(inside)) }
            })
        };
        // SAFETY: null, or the host's place for a time.
        if let Ok(time) = unsafe { place(lastSuccessfulTime, "") } {
            *time = i.common.sim.time();
        }
        status
    };
    // SAFETY: the host's promise about its instance.
    unsafe { answered_with_callbacks(handle, body) }
}

impl Update {
    /// Tells the host of an accepted piece of a step: variables can be read, none can be set, nothing ends early.
    fn tell(&self, inside: &Inside) {
        let (mut early, mut time) = (0, 0.0);
        // SAFETY: the host gave this function and environment at instantiation; both places outlive the call.
        unsafe {
            (self.callback)(self.environment, inside.view.time(), 0, 1, 1, 0, &raw mut early, &raw mut time);
        }
    }
}
