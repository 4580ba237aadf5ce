//! What an accepted or refused step must not hide: where tissue is worst, whether it snapped, whether it came back.

use super::model::Model;
use super::report::StepReport;
use super::state::{State, are_at_rest};
use crate::fem::{At, Strain, Term};
use crate::math::{Vec3, extent};
use crate::mesh::signed_volume;

/// A det F at and below which a step tells, and again each time that it has halved.
const SQUEEZED: f64 = 0.1;
/// A bound of |F - 1| up to which no det F can be below 0.1, with some room for elements that are not linear.
const SMALL_STRAIN: f64 = 0.4;
/// Growth of that bound after which the elements of a table are looked at again.
const LOOK_AGAIN: f64 = 2.0;
/// A jump across a bone-to-bone edge larger than this part of its length is reported.
const LARGEST_JUMP: f64 = 0.3;
/// Share of the elastic energy whose loss nothing explains that is a snap.
const SNAP: f64 = 0.5;
/// Motion of a snap in sizes of the tissue; less may be round-off that settles.
const VISIBLE: f64 = 0.01;
/// Share of the work of the bones that the trapezoidal rule may be wrong by before energies are looked at.
const ROUGH: f64 = 0.2;
/// Share of the energy that is its round-off.
const NOISE: f64 = 1e-9;
/// Distance from rest, in tolerances of the solver, that is not at rest.
const AT_REST: f64 = 10.0;

/// Where the worst element lies.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// The tetrahedron, 0-based.
    pub tet: usize,
    /// Its centre at rest, m.
    pub X: Vec3,
    /// det F of its corners; 1 at rest.
    pub det_f: f64,
    /// Name of its region.
    pub region: String,
    /// The nearest bone and its distance at rest, m; `None` where no bone has nodes.
    pub bone: Option<(String, f64)>,
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let [x, y, z] = [0, 1, 2].map(|c| 1e3 * self.X[c]);
        write!(f, "det F {:.3} at ({x:.1}, {y:.1}, {z:.1}) mm at rest, region `{}`", self.det_f, self.region)?;
        match &self.bone {
            Some((name, distance)) => write!(f, ", {:.1} mm from bone `{name}`", 1e3 * distance),
            None => Ok(()),
        }
    }
}

/// The tetrahedra of least det F, worst first, `n` at most; det F is that of the corners.
pub fn worst_tets(model: &Model, x: &[Vec3], n: usize) -> Vec<(usize, f64)> {
    let mesh = model.mesh();
    let det_f =
        |tet: &[u32; 4]| signed_volume(tet.map(|a| x[a as usize])) / signed_volume(tet.map(|a| mesh.nodes[a as usize]));
    let mut all: Vec<(usize, f64)> = mesh.tets.iter().map(det_f).enumerate().collect();
    // What is no number is worse than all that is.
    let key = |(e, det_f): &(usize, f64)| (if det_f.is_nan() { f64::NEG_INFINITY } else { *det_f }, *e);
    all.sort_unstable_by(|p, q| key(p).partial_cmp(&key(q)).expect("no NaN is left"));
    all.truncate(n);
    all
}

/// Where the worst element at `x` lies.
pub(super) fn worst_place(model: &Model, x: &[Vec3]) -> Option<Place> {
    let mesh = model.mesh();
    let (tet, det_f) = worst_tets(model, x, 1).pop()?;
    let X = mesh.tets[tet].iter().map(|&a| mesh.nodes[a as usize]).sum::<Vec3>() / 4.0;
    let nearest = |bone: &super::Bone| {
        let own = bone.nodes.iter().filter(|&&a| !model.is_frame(a));
        let distance = own.map(|&a| (mesh.nodes[a as usize] - X).norm()).fold(f64::INFINITY, f64::min);
        (bone.name.clone(), distance)
    };
    let bones = model.parts().bones.iter().map(nearest).filter(|(_, distance)| distance.is_finite());
    Some(Place {
        tet,
        X,
        det_f,
        region: mesh.region_names[mesh.region[tet] as usize].clone(),
        bone: bones.min_by(|p, q| p.1.total_cmp(&q.1)),
    })
}

/// Tells where elements are squeezed to `after` that were at `before`, or turned inside out.
pub(super) fn warn_of_squeezing(model: &Model, before: f64, after: f64, x: &[Vec3], warnings: &mut Vec<String>) {
    let halvings = |det_f: f64| (SQUEEZED / det_f).log2().floor();
    let inverts = after <= 0.0 && before > 0.0;
    let squeezes = after > 0.0 && after <= SQUEEZED && (before > SQUEEZED || halvings(after) > halvings(before));
    if !(inverts || squeezes) {
        return;
    }
    let place = worst_place(model, x).map_or(String::new(), |place| format!(": {place}"));
    warnings.push(match inverts {
        true => format!("elements are turned inside out (smallest det F {after:.3}){place}"),
        false => format!("an element is squeezed to {after:.3} of its volume{place}"),
    });
}

/// When the elements of a table were looked at last: to look at all of them costs many of its steps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look {
    /// The bound of |F - 1| then, and the smallest det F found.
    bound: f64,
    least: f64,
}

impl Look {
    /// Not yet.
    pub fn none() -> Look {
        Look { bound: 0.0, least: 1.0 }
    }

    /// Whether elements may be squeezed more than they were where |F - 1| is `bound` at most.
    pub fn is_due(&self, bound: f64) -> bool {
        bound > SMALL_STRAIN.max(LOOK_AGAIN * self.bound)
    }

    /// Tells what is to be seen at `x`.
    pub fn take(&mut self, model: &Model, bound: f64, x: &[Vec3], warnings: &mut Vec<String>) {
        let least = min_det_f(model, x);
        warn_of_squeezing(model, self.least, least, x, warnings);
        *self = Look { bound, least: least.min(self.least) };
    }
}

/// Smallest det F of all elements at `x`.
pub(super) fn min_det_f(model: &Model, x: &[Vec3]) -> f64 {
    model.parts().terms.iter().map(|t| t.min_det_f(x)).fold(f64::INFINITY, f64::min)
}

/// The balance of a piece of load under bones that move: what they spend must be found in the tissue.
#[derive(Debug, Clone, Copy)]
pub(super) struct Balance {
    /// Potential energy before, with the loads of the end, J.
    pub before: f64,
    /// Work of the bones by the forces at the start and at the end, each taken for the whole way, J.
    pub work: [f64; 2],
    /// Potential energy after, J.
    pub after: f64,
}

impl Balance {
    /// Energy that went nowhere, J; the trapezoidal rule of the bones' work makes it rough.
    fn lost(&self) -> f64 {
        self.before + 0.5 * (self.work[0] + self.work[1]) - self.after
    }

    /// Whether a snap is likely enough for the elastic energies to be looked at.
    fn is_suspicious(&self) -> bool {
        let rough = ROUGH * (self.work[0].abs() + self.work[1].abs());
        self.lost() > rough.max(NOISE * (self.before.abs() + self.after.abs()))
    }
}

/// Tells where the tissue let go of most of its energy although nothing unloaded it; `elastic` finds the energy at a place.
pub(super) fn snapped(
    balance: &Balance,
    before: &[Vec3],
    after: &[Vec3],
    elastic: impl Fn(&[Vec3]) -> f64,
) -> Option<String> {
    if !balance.is_suspicious() || distance(before, after) < VISIBLE * extent(before) {
        return None;
    }
    let (had, has) = (elastic(before), elastic(after));
    (has < (1.0 - SNAP) * had && balance.lost() > SNAP * had).then(|| {
        format!(
            "the tissue snapped: its elastic energy fell from {had:.2e} to {has:.2e} J though nothing unloaded it; \
             positions depend on the way now (take smaller steps to see it, and inertia to follow it)"
        )
    })
}

/// How far from rest the tissue is although every input is at rest, m; `None` where that proves nothing.
pub(super) fn hangs(model: &Model, state: &State) -> Option<f64> {
    let is_elastic = !model.remembers() && !model.is_quadratic();
    if !is_elastic || !are_at_rest(model, &state.inputs) {
        return None;
    }
    let moved = distance(&state.config.x, &model.mesh().nodes);
    (moved > AT_REST * model.parts().strategy.tolerance).then_some(moved)
}

/// Whether two states are the same but for what the solver leaves undecided.
pub(super) fn is_same_place(model: &Model, one: &State, other: &State) -> bool {
    distance(&one.config.x, &other.config.x) <= AT_REST * model.parts().strategy.tolerance
}

/// Largest distance of a node, m.
fn distance(one: &[Vec3], other: &[Vec3]) -> f64 {
    one.iter().zip(other).map(|(x, y)| (x - y).norm()).fold(0.0, f64::max)
}

/// Whether elements of some term may turn inside out at a finite energy: found on the mirrored mesh.
pub(super) fn folds(terms: &[Box<dyn Term>], X: &[Vec3], inputs: &[f64], n_history: usize) -> bool {
    let mirrored: Vec<Vec3> = X.iter().map(|X| -X).collect();
    let history = vec![0.0; n_history];
    let at = At { inputs, history: &history, x_tilde: X, x_lag: &mirrored, ..At::NOWHERE };
    terms.iter().any(|t| t.min_det_f(&mirrored) < 0.0 && t.energy(&at, &mirrored).is_finite())
}

/// The largest jump of displacement across a bone-to-bone edge, in lengths of the edge.
pub(super) fn worst_jump(model: &Model, x: &[Vec3]) -> Option<(f64, u32, u32)> {
    let X = &model.mesh().nodes;
    let jump = |&(a, b): &(u32, u32)| {
        let (i, j) = (a as usize, b as usize);
        (((x[i] - X[i]) - (x[j] - X[j])).norm() / (X[i] - X[j]).norm(), a, b)
    };
    model.osteotomy().iter().map(jump).max_by(|p, q| p.0.total_cmp(&q.0))
}

/// Tells of bones that moved apart across a single element.
pub(super) fn warn_of_jumps(
    model: &Model,
    before: Option<(f64, u32, u32)>,
    after: Option<(f64, u32, u32)>,
    report: &mut StepReport,
) {
    let (Some((before, ..)), Some((ratio, a, b))) = (before, after) else { return };
    if ratio > LARGEST_JUMP && before <= LARGEST_JUMP {
        let x = model.mesh().nodes[a as usize];
        report.warnings.push(format!(
            "bones move apart by {ratio:.2} of the edge between nodes {a} and {b} at ({:.4}, {:.4}, {:.4}) m: forces and \
             the skin there depend on the mesh; release the line with [attachment] free_rings = 1",
            x.x, x.y, x.z
        ));
    }
}

/// Strain and energy of an accepted state, all of whose nodes are at `x`.
pub(super) fn strain(model: &Model, state: &State, x: &[Vec3]) -> Strain {
    let at = At { t: state.t, dt: state.outputs.dt, inputs: &state.applied, history: &state.history, ..At::NOWHERE };
    strain_at(model, &at, x)
}

/// The same where terms see `at`.
pub(super) fn strain_at(model: &Model, at: &At, x: &[Vec3]) -> Strain {
    model.parts().terms.iter().fold(Strain::NONE, |s, t| s.and(t.strain(at, x)))
}
