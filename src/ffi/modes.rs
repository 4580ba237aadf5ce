//! Which call is legal when: one table for each version of the standard.
//!
//! A call is refused outside its modes before any of its arguments is looked at. Sources: FMI 3.0.2, sections 2.3.1
//! and 4.2.1; FMI 2.0.5, section 4.2.4. Departure from 2.0: inputs may also be set before initialization, because
//! common importers do so and nothing is lost.

/// Where an instance stands in the life that the standard prescribes; each is one bit.
pub(super) type Mode = u8;

/// Fresh, or after reset.
pub(super) const INSTANTIATED: Mode = 1;
/// Between `EnterInitializationMode` and `ExitInitializationMode`.
pub(super) const INITIALIZATION: Mode = 2;
/// Between steps.
pub(super) const STEP: Mode = 4;
/// FMI 2.0: the last step was discarded.
pub(super) const STEP_FAILED: Mode = 8;
/// After `Terminate`.
pub(super) const TERMINATED: Mode = 16;
/// After a call that returned Error.
pub(super) const ERROR: Mode = 32;

const ANY: Mode = INSTANTIATED | INITIALIZATION | STEP | STEP_FAILED | TERMINATED | ERROR;

/// How a mode is called in a message.
pub(super) fn name(mode: Mode) -> &'static str {
    match mode {
        INSTANTIATED => "Instantiated",
        INITIALIZATION => "Initialization Mode",
        STEP => "Step Mode",
        STEP_FAILED => "Step Failed",
        TERMINATED => "Terminated",
        _ => "Error",
    }
}

/// One row of a table: the exported function and the modes it is legal in.
#[derive(Clone, Copy)]
pub(super) struct Call {
    /// Exported name, for messages.
    pub(super) name: &'static str,
    /// Legal modes.
    pub(super) legal: Mode,
}

const fn call(name: &'static str, legal: Mode) -> Call {
    Call { name, legal }
}

/// A function of the standard that this component does not offer: its body refuses it in every mode.
pub(super) const fn not_offered(name: &'static str) -> Call {
    call(name, ANY)
}

/// FMI 3.0.
#[rustfmt::skip]
pub(super) mod fmi3 {
    use super::*;
    pub const SET_DEBUG_LOGGING: Call         = call("fmi3SetDebugLogging", ANY);
    pub const ENTER_INITIALIZATION_MODE: Call = call("fmi3EnterInitializationMode", INSTANTIATED);
    pub const EXIT_INITIALIZATION_MODE: Call  = call("fmi3ExitInitializationMode", INITIALIZATION);
    pub const DO_STEP: Call                   = call("fmi3DoStep", STEP);
    pub const TERMINATE: Call                 = call("fmi3Terminate", STEP);
    pub const RESET: Call                     = call("fmi3Reset", ANY);
    pub const GET: Mode                       = ANY;
    pub const SET: Mode                       = INSTANTIATED | INITIALIZATION | STEP;
    pub const GET_FMU_STATE: Call             = call("fmi3GetFMUState", ANY);
    pub const SET_FMU_STATE: Call             = call("fmi3SetFMUState", ANY);
    pub const FREE_FMU_STATE: Call            = call("fmi3FreeFMUState", ANY);
    pub const SERIALIZED_FMU_STATE_SIZE: Call = call("fmi3SerializedFMUStateSize", ANY);
    pub const SERIALIZE_FMU_STATE: Call       = call("fmi3SerializeFMUState", ANY);
    pub const DESERIALIZE_FMU_STATE: Call     = call("fmi3DeserializeFMUState", ANY);
    pub const GET_DIRECTIONAL_DERIVATIVE: Call = call("fmi3GetDirectionalDerivative", INITIALIZATION | STEP | TERMINATED);
    pub const GET_ADJOINT_DERIVATIVE: Call    = call("fmi3GetAdjointDerivative", INITIALIZATION | STEP | TERMINATED);
    pub const GET_OUTPUT_DERIVATIVES: Call    = call("fmi3GetOutputDerivatives", STEP | TERMINATED);
    pub const fn get(name: &'static str) -> Call { call(name, GET) }
    pub const fn set(name: &'static str) -> Call { call(name, SET) }
}

/// FMI 2.0.
#[rustfmt::skip]
pub(super) mod fmi2 {
    use super::*;
    pub const SET_DEBUG_LOGGING: Call         = call("fmi2SetDebugLogging", ANY);
    pub const SETUP_EXPERIMENT: Call          = call("fmi2SetupExperiment", INSTANTIATED);
    pub const ENTER_INITIALIZATION_MODE: Call = call("fmi2EnterInitializationMode", INSTANTIATED);
    pub const EXIT_INITIALIZATION_MODE: Call  = call("fmi2ExitInitializationMode", INITIALIZATION);
    pub const DO_STEP: Call                   = call("fmi2DoStep", STEP);
    pub const TERMINATE: Call                 = call("fmi2Terminate", STEP | STEP_FAILED);
    pub const RESET: Call                     = call("fmi2Reset", ANY);
    pub const GET: Mode                       = INITIALIZATION | STEP | STEP_FAILED | TERMINATED | ERROR;
    pub const SET: Mode                       = INSTANTIATED | INITIALIZATION | STEP;
    pub const GET_FMU_STATE: Call             = call("fmi2GetFMUstate", ANY);
    pub const SET_FMU_STATE: Call             = call("fmi2SetFMUstate", ANY);
    pub const FREE_FMU_STATE: Call            = call("fmi2FreeFMUstate", ANY);
    pub const SERIALIZED_FMU_STATE_SIZE: Call = call("fmi2SerializedFMUstateSize", ANY);
    pub const SERIALIZE_FMU_STATE: Call       = call("fmi2SerializeFMUstate", ANY);
    pub const DESERIALIZE_FMU_STATE: Call     = call("fmi2DeSerializeFMUstate", ANY);
    pub const GET_DIRECTIONAL_DERIVATIVE: Call = call("fmi2GetDirectionalDerivative", INITIALIZATION | STEP | TERMINATED);
    pub const GET_REAL_OUTPUT_DERIVATIVES: Call = call("fmi2GetRealOutputDerivatives", STEP | STEP_FAILED | TERMINATED | ERROR);
    pub const STATUS: Mode                    = STEP | STEP_FAILED | TERMINATED | ERROR;
    pub const fn get(name: &'static str) -> Call { call(name, GET) }
    pub const fn set(name: &'static str) -> Call { call(name, SET) }
    pub const fn status(name: &'static str) -> Call { call(name, STATUS) }
}
