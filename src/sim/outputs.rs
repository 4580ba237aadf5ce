//! What a host reads: one row a port, which says its name and shape, how it is read, and how it changes with the inputs and in
//! time. Descriptions, access, derivatives and velocities all follow from the row.

use super::access::{self, View};
use super::derivative::{self, Ends};
use super::model::{Drive, ModelParts};
use super::{SimError, adjoint};
use crate::port::{Causality, Port, Slot, Type};

/// How values are read from element `offset` of a port on.
#[derive(Clone, Copy)]
pub(super) enum Read {
    F64(fn(&View, usize, &mut [f64])),
    I32(fn(&View, usize, &mut [i32])),
    Bool(fn(&View, usize, &mut [bool])),
}

/// How values change with the inputs.
#[derive(Clone, Copy)]
pub(super) enum Slope {
    /// Not in a way that would serve anybody.
    None,
    /// Not at all.
    Zero,
    /// Along a direction of the inputs, and transposed.
    Of(fn(&Ends, &mut [f64]), fn(&mut adjoint::Weights, &adjoint::Place, &[f64])),
}

/// How values change in time, from element `offset` on; none where nothing is known of it.
pub(super) type Rate = Option<fn(&View, usize, &mut [f64]) -> Result<(), SimError>>;

/// What the first dimension of a port counts.
#[derive(Clone, Copy)]
enum Each {
    /// The port is a scalar.
    Model,
    Vertex,
    Triangle,
    Marker,
    Bone,
    Contact,
}

/// A port that is computed.
pub(super) struct Computed {
    slot: Slot,
    reference: u32,
    name: &'static str,
    unit: &'static str,
    nominal: f64,
    causality: Causality,
    each: Each,
    /// Extent of the second dimension, if there is one.
    width: Option<usize>,
    exists: fn(&ModelParts) -> bool,
    pub read: Read,
    pub slope: Slope,
    pub rate: Rate,
    description: &'static str,
}

impl Computed {
    /// The port in this model, if it has it.
    pub fn port(&self, parts: &ModelParts, n_skin: usize, n_triangles: usize) -> Option<Port> {
        let (n, rows): (Option<usize>, Vec<String>) = match self.each {
            Each::Model => (None, Vec::new()),
            Each::Vertex => (Some(n_skin), Vec::new()),
            Each::Triangle => (Some(n_triangles), Vec::new()),
            Each::Marker => named(parts.markers.iter().map(|m| &m.name)),
            Each::Bone => named(parts.bones.iter().map(|b| &b.name)),
            Each::Contact => named(parts.contacts.iter().map(|c| &c.name)),
        };
        (n != Some(0) && (self.exists)(parts)).then(|| Port {
            name: self.name.into(),
            reference: self.reference,
            slot: self.slot,
            ty: match self.read {
                Read::F64(_) => Type::Float64,
                Read::I32(_) => Type::Int32,
                Read::Bool(_) => Type::Boolean,
            },
            single: false,
            shape: n.into_iter().chain(self.width).collect(),
            unit: self.unit,
            causality: self.causality,
            start: Vec::new(),
            nominal: self.nominal,
            min: None,
            max: None,
            rows,
            description: self.description.into(),
        })
    }
}

fn named<'a>(names: impl ExactSizeIterator<Item = &'a String>) -> (Option<usize>, Vec<String>) {
    (Some(names.len()), names.cloned().collect())
}

fn always(_: &ModelParts) -> bool {
    true
}
fn in_time(parts: &ModelParts) -> bool {
    parts.inertia.is_some()
}
fn has_forced_bones(parts: &ModelParts) -> bool {
    parts.bones.iter().any(|b| b.drive == Drive::Force)
}

use Causality::{CalculatedParameter, Independent, Local, Output};
use Each::{Bone, Contact, Marker, Model, Triangle, Vertex};
use Read::{Bool, F64, I32};
use Slope::{None as NoSlope, Of, Zero};

/// The rows, ascending by value reference; references are part of the interface and never renumbered.
#[rustfmt::skip] // one row a port
pub(super) const COMPUTED: &[Computed] = &[
    Computed { slot: Slot::Time, reference: 0, name: "time", unit: "s", nominal: 1.0, causality: Independent, each: Model, width: None, exists: always,
        read: F64(access::time), slope: Zero, rate: None, description: "Simulation time" },
    Computed { slot: Slot::SkinPosition, reference: 100, name: "skin.position", unit: "m", nominal: 0.1, causality: Output, each: Vertex, width: Some(3), exists: always,
        read: F64(access::skin_position), slope: Of(derivative::skin_position, adjoint::skin_position), rate: Some(access::skin_position_rate), description: "Position of each skin vertex" },
    Computed { slot: Slot::SkinVelocity, reference: 101, name: "skin.velocity", unit: "m/s", nominal: 0.1, causality: Output, each: Vertex, width: Some(3), exists: in_time,
        read: F64(access::skin_velocity), slope: Of(derivative::skin_velocity, adjoint::skin_velocity), rate: Some(access::skin_velocity_rate), description: "Velocity of each skin vertex" },
    Computed { slot: Slot::MarkerPosition, reference: 110, name: "marker.position", unit: "m", nominal: 0.1, causality: Output, each: Marker, width: Some(3), exists: always,
        read: F64(access::marker_position), slope: Of(derivative::marker_position, adjoint::marker_position), rate: Some(access::marker_position_rate), description: "Position of each marker on the skin" },
    Computed { slot: Slot::BoneReactionForce, reference: 120, name: "bone.reactionForce", unit: "N", nominal: 1.0, causality: Output, each: Bone, width: Some(3), exists: always,
        read: F64(access::reaction_force), slope: Of(derivative::reaction_force, adjoint::reaction_force), rate: None, description: "Force that the tissue exerts on each bone" },
    Computed { slot: Slot::BoneReactionTorque, reference: 121, name: "bone.reactionTorque", unit: "N.m", nominal: 0.01, causality: Output, each: Bone, width: Some(3), exists: always,
        read: F64(access::reaction_torque), slope: Of(derivative::reaction_torque, adjoint::reaction_torque), rate: None, description: "Torque that the tissue exerts on each bone, about its current pivot" },
    Computed { slot: Slot::BonePoseTranslation, reference: 122, name: "bone.poseTranslation", unit: "m", nominal: 0.01, causality: Output, each: Bone, width: Some(3), exists: has_forced_bones,
        read: F64(access::pose_translation), slope: Of(derivative::pose_translation, adjoint::pose_translation), rate: Some(access::pose_translation_rate), description: "Translation each bone's pivot has reached" },
    Computed { slot: Slot::BonePoseRotation, reference: 123, name: "bone.poseRotation", unit: "rad", nominal: 0.1, causality: Output, each: Bone, width: Some(3), exists: has_forced_bones,
        read: F64(access::pose_rotation), slope: Of(derivative::pose_rotation, adjoint::pose_rotation), rate: Some(access::pose_rotation_rate), description: "Rotation vector each bone has reached" },
    Computed { slot: Slot::ContactForce, reference: 130, name: "contact.force", unit: "N", nominal: 1.0, causality: Output, each: Contact, width: Some(3), exists: always,
        read: F64(access::contact_force), slope: Of(derivative::contact_force, adjoint::contact_force), rate: None, description: "Force that the tissue exerts on each contact's shape; part of the reaction of its bone" },
    Computed { slot: Slot::ContactDepth, reference: 131, name: "contact.depth", unit: "m", nominal: 1e-4, causality: Output, each: Contact, width: None, exists: always,
        read: F64(access::contact_depth), slope: Of(derivative::contact_depth, adjoint::contact_depth), rate: None, description: "How deep the tissue lies in each contact's shape at most" },
    Computed { slot: Slot::SolverIterations, reference: 200, name: "solver.iterations", unit: "1", nominal: 1.0, causality: Local, each: Model, width: None, exists: always,
        read: I32(access::iterations), slope: NoSlope, rate: None, description: "Linear solves of the last step" },
    Computed { slot: Slot::SolverResidual, reference: 201, name: "solver.residual", unit: "N", nominal: 1e-6, causality: Local, each: Model, width: None, exists: always,
        read: F64(access::residual), slope: NoSlope, rate: None, description: "Norm of the force residual after the last step" },
    Computed { slot: Slot::SolverConverged, reference: 202, name: "solver.converged", unit: "1", nominal: 1.0, causality: Local, each: Model, width: None, exists: always,
        read: Bool(access::converged), slope: NoSlope, rate: None, description: "Whether the last step met its tolerance" },
    Computed { slot: Slot::EnergyElastic, reference: 210, name: "energy.elastic", unit: "J", nominal: 1e-3, causality: Output, each: Model, width: None, exists: always,
        read: F64(access::elastic), slope: Of(derivative::elastic, adjoint::elastic), rate: None, description: "Strain energy of the tissue" },
    Computed { slot: Slot::EnergyKinetic, reference: 211, name: "energy.kinetic", unit: "J", nominal: 1e-3, causality: Output, each: Model, width: None, exists: in_time,
        read: F64(access::kinetic), slope: Of(derivative::kinetic, adjoint::kinetic), rate: None, description: "Kinetic energy of the tissue" },
    Computed { slot: Slot::MinDetF, reference: 220, name: "quality.minDetF", unit: "1", nominal: 1.0, causality: Local, each: Model, width: None, exists: always,
        read: F64(access::min_det_f), slope: NoSlope, rate: None, description: "Smallest ratio of current to rest volume of any element" },
    Computed { slot: Slot::MaxStretch, reference: 221, name: "quality.maxStretch", unit: "1", nominal: 1.0, causality: Local, each: Model, width: None, exists: always,
        read: F64(access::max_stretch), slope: NoSlope, rate: None, description: "Largest principal stretch of any element" },
    Computed { slot: Slot::SkinRestPosition, reference: 300, name: "skin.restPosition", unit: "m", nominal: 0.1, causality: CalculatedParameter, each: Vertex, width: Some(3), exists: always,
        read: F64(access::skin_rest_position), slope: Zero, rate: None, description: "Rest position of each skin vertex" },
    Computed { slot: Slot::SkinTriangles, reference: 301, name: "skin.triangles", unit: "1", nominal: 1.0, causality: CalculatedParameter, each: Triangle, width: Some(3), exists: always,
        read: I32(access::triangles), slope: NoSlope, rate: None, description: "Skin triangles as 0-based rows of skin.position, wound outward" },
];
