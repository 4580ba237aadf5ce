//! The port table of a model, and where each input lies.

use super::model::{Drive, Model, ModelParts};
use crate::port::{Causality, Port, Slot, Type};

/// Where each settable port's values lie in the list of inputs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    spans: Vec<(Slot, usize, usize)>,
    len: usize,
}

impl Layout {
    /// Lays out the inputs of a scene with these tunable tissues, bones `(drive, nodes)`, muscles, forces and pressures.
    /// Tunable tissues come first, in their order.
    pub fn new(
        n_tunable: usize,
        bones: &[(Drive, usize)],
        n_muscles: usize,
        n_loads: usize,
        n_pressures: usize,
        gravity: bool,
    ) -> Layout {
        let n = 3 * bones.len();
        let any = |drive: Drive| bones.iter().any(|(d, _)| *d == drive);
        let mut layout = Layout { spans: Vec::new(), len: 0 };
        let mut add = |slot: Slot, len: usize, exists: bool| {
            if exists && len > 0 {
                layout.spans.push((slot, layout.len, len));
                layout.len += len;
            }
        };
        for k in 0..n_tunable {
            add(Slot::MaterialE(k as u32), 1, true);
        }
        add(Slot::BoneTranslation, n, any(Drive::Pose));
        add(Slot::BoneRotation, n, any(Drive::Pose));
        add(Slot::BoneForce, n, any(Drive::Force));
        add(Slot::BoneTorque, n, any(Drive::Force));
        add(Slot::MuscleActivation, n_muscles, true);
        add(Slot::LoadForce, 3 * n_loads, true);
        add(Slot::LoadPressure, n_pressures, true);
        add(Slot::Gravity, 3, gravity);
        add(Slot::BonePivot, n, true);
        for (b, (drive, nodes)) in bones.iter().enumerate() {
            add(Slot::BoneNodal(b as u32), 3 * nodes, *drive == Drive::Displacement);
        }
        layout
    }

    /// First input of a slot, if the scene has it.
    pub fn first(&self, slot: Slot) -> Option<usize> {
        self.spans.iter().find(|(s, ..)| *s == slot).map(|(_, first, _)| *first)
    }

    /// Number of inputs.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is no input.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Slot and place within it of input `k`.
    pub fn slot_of(&self, k: usize) -> Option<(Slot, usize)> {
        self.spans
            .iter()
            .find(|(_, first, len)| (*first..first + len).contains(&k))
            .map(|(s, first, _)| (*s, k - first))
    }
}

/// Value reference of the first tunable tissue, and how many there may be.
const FIRST_MATERIAL: u32 = 21;
pub(crate) const MOST_TUNABLE: usize = 19;
/// A modulus may fall to this part of the scene's; softer than that nothing is left of the tissue.
const SOFTEST: f64 = 1e-3;

/// Value references; blocks are part of the ABI and never renumbered.
fn reference(slot: Slot) -> u32 {
    match slot {
        Slot::Time => 0,
        Slot::BoneTranslation => 10,
        Slot::BoneRotation => 11,
        Slot::BoneForce => 12,
        Slot::BoneTorque => 13,
        Slot::MuscleActivation => 14,
        Slot::LoadForce => 15,
        Slot::LoadPressure => 16,
        Slot::MaterialE(k) => FIRST_MATERIAL + k,
        Slot::Gravity => 50,
        Slot::BonePivot => 51,
        Slot::SkinPosition => 100,
        Slot::SkinVelocity => 101,
        Slot::MarkerPosition => 110,
        Slot::BoneReactionForce => 120,
        Slot::BoneReactionTorque => 121,
        Slot::BonePoseTranslation => 122,
        Slot::BonePoseRotation => 123,
        Slot::ContactForce => 130,
        Slot::ContactDepth => 131,
        Slot::SolverIterations => 200,
        Slot::SolverResidual => 201,
        Slot::SolverConverged => 202,
        Slot::EnergyElastic => 210,
        Slot::EnergyKinetic => 211,
        Slot::MinDetF => 220,
        Slot::MaxStretch => 221,
        Slot::SkinRestPosition => 300,
        Slot::SkinTriangles => 301,
        Slot::BoneNodal(bone) => 1000 + bone,
    }
}

/// The ports of a model, ascending by value reference.
pub(super) fn table(parts: &ModelParts, n_skin: usize, n_triangles: usize) -> Vec<Port> {
    let bones: Vec<String> = parts.bones.iter().map(|b| b.name.clone()).collect();
    let n = bones.len();
    let layout = &parts.layout;
    let dynamic = parts.inertia.is_some();
    let any_force = parts.bones.iter().any(|b| b.drive == Drive::Force);
    let mut ports = Vec::new();
    let mut add = |slot, name: &str, ty, shape: &[usize], unit, causality, rows: &[String], description: &str| {
        if shape.contains(&0) {
            return;
        }
        let start = match (layout.first(slot), causality) {
            (Some(first), Causality::Input | Causality::Parameter | Causality::TunableParameter) => {
                parts.start[first..first + shape.iter().product::<usize>()].to_vec()
            }
            (None, Causality::Input | Causality::Parameter | Causality::TunableParameter) => return,
            _ => Vec::new(),
        };
        let min = match slot {
            Slot::MuscleActivation => Some(0.0),
            Slot::MaterialE(_) => Some(SOFTEST * start[0]),
            _ => None,
        };
        ports.push(Port {
            name: name.into(),
            reference: reference(slot),
            slot,
            ty,
            shape: shape.to_vec(),
            unit,
            causality,
            start,
            single: slot == Slot::MuscleActivation,
            min,
            max: (slot == Slot::MuscleActivation).then_some(1.0),
            rows: rows.to_vec(),
            description: description.into(),
        });
    };
    use Causality::{CalculatedParameter, Independent, Input, Output, Parameter, TunableParameter};
    use Type::{Boolean, Float64, Int32};
    let no = &[][..];
    add(Slot::Time, "time", Float64, no, "s", Independent, no_rows(), "Simulation time");
    add(
        Slot::BoneTranslation,
        "bone.translation",
        Float64,
        &[n, 3],
        "m",
        Input,
        &bones,
        "Translation of each pose-driven bone's pivot from rest",
    );
    add(
        Slot::BoneRotation,
        "bone.rotation",
        Float64,
        &[n, 3],
        "rad",
        Input,
        &bones,
        "Rotation vector (axis times angle) of each pose-driven bone from rest, about its pivot",
    );
    add(
        Slot::BoneForce,
        "bone.force",
        Float64,
        &[n, 3],
        "N",
        Input,
        &bones,
        "Force on each force-driven bone, at its pivot",
    );
    add(
        Slot::BoneTorque,
        "bone.torque",
        Float64,
        &[n, 3],
        "N.m",
        Input,
        &bones,
        "Torque on each force-driven bone, about its pivot",
    );
    add(
        Slot::MuscleActivation,
        "muscle.activation",
        Float64,
        &[parts.muscles.len()],
        "1",
        Input,
        &parts.muscles,
        "Activation of each muscle, from 0 (slack) to 1 (full stress)",
    );
    add(
        Slot::LoadForce,
        "load.force",
        Float64,
        &[parts.loads.len(), 3],
        "N",
        Input,
        &parts.loads,
        "Total force of each load",
    );
    add(
        Slot::LoadPressure,
        "load.pressure",
        Float64,
        &[parts.pressures.len()],
        "Pa",
        Input,
        &parts.pressures,
        "Pressure of each pressure load; positive pushes into the tissue and follows the surface",
    );
    for (k, tissue) in parts.tunable.iter().enumerate() {
        let name = format!("material.{tissue}.E");
        let text = format!("Young's modulus of tissue {tissue} at small strain; all its moduli follow in proportion");
        add(Slot::MaterialE(k as u32), &name, Float64, no, "Pa", TunableParameter, no_rows(), &text);
    }
    add(Slot::Gravity, "gravity", Float64, &[3], "m/s2", Parameter, no_rows(), "Acceleration of gravity");
    add(Slot::BonePivot, "bone.pivot", Float64, &[n, 3], "m", Parameter, &bones, "Rest position of each bone's pivot");
    add(
        Slot::SkinPosition,
        "skin.position",
        Float64,
        &[n_skin, 3],
        "m",
        Output,
        no_rows(),
        "Position of each skin vertex",
    );
    if dynamic {
        add(
            Slot::SkinVelocity,
            "skin.velocity",
            Float64,
            &[n_skin, 3],
            "m/s",
            Output,
            no_rows(),
            "Velocity of each skin vertex",
        );
    }
    let markers: Vec<String> = parts.markers.iter().map(|m| m.name.clone()).collect();
    add(
        Slot::MarkerPosition,
        "marker.position",
        Float64,
        &[markers.len(), 3],
        "m",
        Output,
        &markers,
        "Position of each marker on the skin",
    );
    add(
        Slot::BoneReactionForce,
        "bone.reactionForce",
        Float64,
        &[n, 3],
        "N",
        Output,
        &bones,
        "Force that the tissue exerts on each bone",
    );
    add(
        Slot::BoneReactionTorque,
        "bone.reactionTorque",
        Float64,
        &[n, 3],
        "N.m",
        Output,
        &bones,
        "Torque that the tissue exerts on each bone, about its current pivot",
    );
    if any_force {
        add(
            Slot::BonePoseTranslation,
            "bone.poseTranslation",
            Float64,
            &[n, 3],
            "m",
            Output,
            &bones,
            "Translation each bone's pivot has reached",
        );
        add(
            Slot::BonePoseRotation,
            "bone.poseRotation",
            Float64,
            &[n, 3],
            "rad",
            Output,
            &bones,
            "Rotation vector each bone has reached",
        );
    }
    let contacts: Vec<String> = parts.contacts.iter().map(|c| c.name.clone()).collect();
    add(
        Slot::ContactForce,
        "contact.force",
        Float64,
        &[contacts.len(), 3],
        "N",
        Output,
        &contacts,
        "Force that the tissue exerts on each contact's shape; part of the reaction of its bone",
    );
    add(
        Slot::ContactDepth,
        "contact.depth",
        Float64,
        &[contacts.len()],
        "m",
        Output,
        &contacts,
        "How deep the tissue lies in each contact's shape at most",
    );
    add(
        Slot::SolverIterations,
        "solver.iterations",
        Int32,
        no,
        "1",
        Output,
        no_rows(),
        "Linear solves of the last step",
    );
    add(
        Slot::SolverResidual,
        "solver.residual",
        Float64,
        no,
        "N",
        Output,
        no_rows(),
        "Norm of the force residual after the last step",
    );
    add(
        Slot::SolverConverged,
        "solver.converged",
        Boolean,
        no,
        "1",
        Output,
        no_rows(),
        "Whether the last step met its tolerance",
    );
    add(Slot::EnergyElastic, "energy.elastic", Float64, no, "J", Output, no_rows(), "Strain energy of the tissue");
    if dynamic {
        add(Slot::EnergyKinetic, "energy.kinetic", Float64, no, "J", Output, no_rows(), "Kinetic energy of the tissue");
    }
    add(
        Slot::MinDetF,
        "quality.minDetF",
        Float64,
        no,
        "1",
        Output,
        no_rows(),
        "Smallest ratio of current to rest volume of any element",
    );
    add(
        Slot::MaxStretch,
        "quality.maxStretch",
        Float64,
        no,
        "1",
        Output,
        no_rows(),
        "Largest principal stretch of any element",
    );
    add(
        Slot::SkinRestPosition,
        "skin.restPosition",
        Float64,
        &[n_skin, 3],
        "m",
        CalculatedParameter,
        no_rows(),
        "Rest position of each skin vertex",
    );
    add(
        Slot::SkinTriangles,
        "skin.triangles",
        Int32,
        &[n_triangles, 3],
        "1",
        CalculatedParameter,
        no_rows(),
        "Skin triangles as 0-based rows of skin.position, wound outward",
    );
    for (b, bone) in parts.bones.iter().enumerate() {
        let name = format!("bone.{}.displacement", bone.name);
        let text = format!("Displacement of each node of bone {}, in the order of its node set", bone.name);
        add(Slot::BoneNodal(b as u32), &name, Float64, &[bone.nodes.len(), 3], "m", Input, no_rows(), &text);
    }
    ports
}

fn no_rows() -> &'static [String] {
    &[]
}

impl Model {
    /// `bone.translation[2,1]` for an input of the layout.
    pub(super) fn input_name(&self, k: usize) -> String {
        let Some((slot, within)) = self.parts().layout.slot_of(k) else {
            return format!("input {k}");
        };
        let Some(port) = self.ports().iter().find(|p| p.slot == slot) else {
            return format!("input {k}");
        };
        match port.shape.as_slice() {
            [] => port.name.clone(),
            [_, columns] => format!("{}[{},{}]", port.name, within / columns + 1, within % columns + 1),
            _ => format!("{}[{}]", port.name, within + 1),
        }
    }
}
