//! The port table: the one description of what a host can set and get.
//!
//! The FMI model descriptions, the FMI and C dispatch and the tables of the command line are all read off it.
#![forbid(unsafe_code)]

/// What a port reads or writes inside a simulation. One slot per value-reference block of the FMI interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Slot {
    /// Simulation time.
    Time,
    /// Translation of each bone from its rest pose.
    BoneTranslation,
    /// Rotation vector of each bone from its rest pose, about the bone's pivot.
    BoneRotation,
    /// Force on each force-driven bone, at its pivot.
    BoneForce,
    /// Torque on each force-driven bone, about its pivot.
    BoneTorque,
    /// Activation of each muscle.
    MuscleActivation,
    /// Total force of each point or patch load.
    LoadForce,
    /// Pressure of each pressure load.
    LoadPressure,
    /// Displacement of every node of one nodally driven bone (index into the bones).
    BoneNodal(u32),
    /// Young's modulus of one tunable tissue (index into those).
    MaterialE(u32),
    /// Most linear solves of a step.
    MostSolves,
    /// Gravity.
    Gravity,
    /// Pivot of each bone.
    BonePivot,
    /// Skin vertex positions.
    SkinPosition,
    /// Skin vertex velocities (scenes with inertia).
    SkinVelocity,
    /// Marker positions.
    MarkerPosition,
    /// Force that the tissue exerts on each bone.
    BoneReactionForce,
    /// Torque that the tissue exerts on each bone, about its current pivot.
    BoneReactionTorque,
    /// Translation each bone has reached (differs from the input for force-driven bones).
    BonePoseTranslation,
    /// Rotation vector each bone has reached.
    BonePoseRotation,
    /// Linear solves spent in the last step.
    SolverIterations,
    /// Norm of the force residual after the last step.
    SolverResidual,
    /// Whether the last step met its tolerance.
    SolverConverged,
    /// Strain energy.
    EnergyElastic,
    /// Kinetic energy (scenes with inertia).
    EnergyKinetic,
    /// Force on each contact's shape.
    ContactForce,
    /// How deep the surface lies in each contact's shape.
    ContactDepth,
    /// Smallest det F.
    MinDetF,
    /// Largest principal stretch.
    MaxStretch,
    /// Skin vertices at rest.
    SkinRestPosition,
    /// Skin triangles, 0-based rows of `skin.position`.
    SkinTriangles,
}

/// Number type of a port.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Type {
    /// 64-bit float.
    Float64,
    /// 32-bit signed integer.
    Int32,
    /// Truth value.
    Boolean,
}

/// Who writes a port, in FMI's words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Causality {
    /// Simulation time.
    Independent,
    /// Set by the host at any communication point.
    Input,
    /// Computed by each step.
    Output,
    /// Computed by each step, and of no use to other components: how the solver fared, how the elements are.
    Local,
    /// Set by the host before initialization ends.
    Parameter,
    /// A parameter that the host may set at any communication point, too.
    TunableParameter,
    /// Computed once from the model.
    CalculatedParameter,
}

/// One variable of the interface.
#[derive(Debug, Clone, PartialEq)]
pub struct Port {
    /// Structured name, for example `bone.translation`.
    pub name: String,
    /// FMI 3.0 value reference; part of the ABI, never renumbered.
    pub reference: u32,
    /// Where the values live.
    pub slot: Slot,
    /// Number type.
    pub ty: Type,
    /// Whether FMI 3.0 shows it as Float32: hosts that stack all Float64 inputs of a run need one shape for them.
    pub single: bool,
    /// Extent of each dimension, row-major; empty for a scalar.
    pub shape: Vec<usize>,
    /// SI unit, "1" for none.
    pub unit: &'static str,
    /// Who writes it.
    pub causality: Causality,
    /// Start values (row-major), or one value for all; empty for calculated ports.
    pub start: Vec<f64>,
    /// Size that its values have in life, in its unit.
    pub nominal: f64,
    /// Smallest legal value.
    pub min: Option<f64>,
    /// Largest legal value.
    pub max: Option<f64>,
    /// Names of the rows of the first dimension (bones, loads, markers); empty where they have none.
    pub rows: Vec<String>,
    /// One sentence for the model description.
    pub description: String,
}

impl Port {
    /// Number of values: the product of the shape, 1 for a scalar.
    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// Whether the port holds no value at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether a host may write it, at some time.
    pub fn is_settable(&self) -> bool {
        matches!(self.causality, Causality::Input | Causality::Parameter | Causality::TunableParameter)
    }

    /// Whether each step computes it.
    pub fn is_computed(&self) -> bool {
        matches!(self.causality, Causality::Output | Causality::Local)
    }

    /// Whether its value can change from one step to the next; the bound on a step is no value of the tissue.
    pub fn is_continuous(&self) -> bool {
        !matches!(self.causality, Causality::Parameter | Causality::CalculatedParameter)
            && self.slot != Slot::MostSolves
    }
}
