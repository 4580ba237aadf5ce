//! The port table of a model, and where each input lies.

use super::model::{Drive, Model, ModelParts};
use super::outputs::{COMPUTED, Computed};
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
/// Value reference of the displacements of the first bone.
const FIRST_NODAL: u32 = 1000;
/// A modulus may fall to this part of the scene's and rise to its inverse; softer than that nothing is left of the tissue.
const SOFTEST: f64 = 1e-3;
/// Beyond these (m, rad, N, N.m, Pa, m/s2) an input is a slip of units or a diverged controller, whatever the scene.
const FARTHEST: f64 = 1e3;
const MOST_TURNED: f64 = 1e2;
const STRONGEST: f64 = 1e6;
const MOST_PRESSED: f64 = 1e12;
const HEAVIEST: f64 = 1e4;

/// Where the values of a port are.
#[derive(Clone, Copy)]
pub(super) enum Source {
    /// Among the inputs, from here on.
    Input(usize),
    /// The state's bound on a step.
    MostSolves,
    /// Computed.
    Computed(&'static Computed),
}

/// What is the same for all settable ports of one kind.
struct Settable<'a> {
    slot: Slot,
    reference: u32,
    name: &'a str,
    shape: &'a [usize],
    unit: &'static str,
    causality: Causality,
    nominal: f64,
    range: [f64; 2],
    rows: &'a [String],
    description: &'a str,
}

impl Settable<'_> {
    fn port(&self, start: Vec<f64>) -> Port {
        let finite = |bound: f64| bound.is_finite().then_some(bound);
        Port {
            name: self.name.into(),
            reference: self.reference,
            slot: self.slot,
            ty: Type::Float64,
            single: self.slot == Slot::MuscleActivation,
            shape: self.shape.to_vec(),
            unit: self.unit,
            causality: self.causality,
            start,
            nominal: self.nominal,
            min: finite(self.range[0]),
            max: finite(self.range[1]),
            rows: self.rows.to_vec(),
            description: self.description.into(),
        }
    }
}

/// The ports of a model, ascending by value reference, and where the values of each are.
pub(super) fn table(parts: &ModelParts, n_skin: usize, n_triangles: usize) -> (Vec<Port>, Vec<Source>) {
    let mut all = inputs(parts);
    all.push((most_solves(parts), Source::MostSolves));
    all.extend(COMPUTED.iter().filter_map(|c| Some((c.port(parts, n_skin, n_triangles)?, Source::Computed(c)))));
    all.sort_by_key(|(port, _)| port.reference);
    all.into_iter().unzip()
}

/// One row a kind: what a host sets and terms read.
#[rustfmt::skip] // one row a port
fn inputs(parts: &ModelParts) -> Vec<(Port, Source)> {
    use Causality::{Input, Parameter, TunableParameter};
    use Slot::{BoneForce, BoneNodal, BonePivot, BoneRotation, BoneTorque, BoneTranslation, Gravity, LoadForce, LoadPressure, MaterialE, MuscleActivation};
    let bones: Vec<String> = parts.bones.iter().map(|b| b.name.clone()).collect();
    let (n, n_muscles, n_loads, n_pressures) = (bones.len(), parts.muscles.len(), parts.loads.len(), parts.pressures.len());
    let mut all = Vec::new();
    let mut add = |row: Settable| {
        let Some(first) = parts.layout.first(row.slot) else { return };
        all.push((row.port(parts.start[first..first + row.shape.iter().product::<usize>()].to_vec()), Source::Input(first)));
    };
    let within = |most: f64| [-most, most];
    let none = &[][..];
    add(Settable { slot: BoneTranslation, reference: 10, name: "bone.translation", shape: &[n, 3], unit: "m", causality: Input, nominal: 0.01, range: within(FARTHEST), rows: &bones, description: "Translation of each pose-driven bone's pivot from rest; zero for other bones" });
    add(Settable { slot: BoneRotation, reference: 11, name: "bone.rotation", shape: &[n, 3], unit: "rad", causality: Input, nominal: 0.1, range: within(MOST_TURNED), rows: &bones, description: "Rotation vector (axis times angle) of each pose-driven bone from rest, about its pivot; zero for other bones" });
    add(Settable { slot: BoneForce, reference: 12, name: "bone.force", shape: &[n, 3], unit: "N", causality: Input, nominal: 1.0, range: within(STRONGEST), rows: &bones, description: "Force on each force-driven bone, at its pivot; zero for other bones" });
    add(Settable { slot: BoneTorque, reference: 13, name: "bone.torque", shape: &[n, 3], unit: "N.m", causality: Input, nominal: 0.01, range: within(STRONGEST), rows: &bones, description: "Torque on each force-driven bone, about its pivot; zero for other bones" });
    add(Settable { slot: MuscleActivation, reference: 14, name: "muscle.activation", shape: &[n_muscles], unit: "1", causality: Input, nominal: 1.0, range: [0.0, 1.0], rows: &parts.muscles, description: "Activation of each muscle, from 0 (slack) to 1 (full stress)" });
    add(Settable { slot: LoadForce, reference: 15, name: "load.force", shape: &[n_loads, 3], unit: "N", causality: Input, nominal: 1.0, range: within(STRONGEST), rows: &parts.loads, description: "Total force of each load" });
    add(Settable { slot: LoadPressure, reference: 16, name: "load.pressure", shape: &[n_pressures], unit: "Pa", causality: Input, nominal: 1e3, range: within(MOST_PRESSED), rows: &parts.pressures, description: "Pressure of each pressure load; positive pushes into the tissue and follows the surface" });
    for (k, tissue) in parts.tunable.iter().enumerate() {
        let name = format!("material.{tissue}.E");
        let text = format!("Young's modulus of tissue {tissue} at small strain; all its moduli follow in proportion");
        let start = parts.start[k];
        add(Settable { slot: MaterialE(k as u32), reference: FIRST_MATERIAL + k as u32, name: &name, shape: none, unit: "Pa", causality: TunableParameter, nominal: 1e4, range: [SOFTEST * start, start / SOFTEST], rows: no_rows(), description: &text });
    }
    add(Settable { slot: Gravity, reference: 50, name: "gravity", shape: &[3], unit: "m/s2", causality: TunableParameter, nominal: 10.0, range: within(HEAVIEST), rows: no_rows(), description: "Acceleration of gravity" });
    add(Settable { slot: BonePivot, reference: 51, name: "bone.pivot", shape: &[n, 3], unit: "m", causality: Parameter, nominal: 0.1, range: within(FARTHEST), rows: &bones, description: "Rest position of each bone's pivot" });
    for (b, bone) in parts.bones.iter().enumerate() {
        let name = format!("bone.{}.displacement", bone.name);
        let text = format!("Displacement of each node of bone {}, in the order of its node set", bone.name);
        add(Settable { slot: BoneNodal(b as u32), reference: FIRST_NODAL + b as u32, name: &name, shape: &[bone.nodes.len(), 3], unit: "m", causality: Input, nominal: 0.01, range: within(FARTHEST), rows: no_rows(), description: &text });
    }
    all
}

/// The bound on a step, which is no input of the tissue.
fn most_solves(parts: &ModelParts) -> Port {
    let row = Settable {
        slot: Slot::MostSolves,
        reference: 40,
        name: "solver.mostSolves",
        shape: &[],
        unit: "1",
        causality: Causality::TunableParameter,
        nominal: 1e3,
        range: [1.0, f64::from(i32::MAX)],
        rows: no_rows(),
        description: "Linear solves that a step may take at most; one that would take more is discarded",
    };
    let start = f64::from(i32::try_from(parts.most_solves).unwrap_or(i32::MAX));
    Port { ty: Type::Int32, ..row.port(vec![start]) }
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
