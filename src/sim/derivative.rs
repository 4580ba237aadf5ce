//! How the accepted equilibrium moves with its inputs.
//!
//! ```text
//! g(x, s) = 0   =>   K dx = -(K_p du_p + dg/ds ds),   du_p: motion of the bones' nodes with their poses
//! ```
//!
//! In scenes with inertia or memory g is the gradient of the last piece of time, whose past is held ([`Past`]): the
//! derivative is that of the map which the piece was, and velocities go with positions as the scheme says.
//!
//! One solve with the stiffness of the accepted state, factored when the first derivative there is asked for; the
//! simulation itself keeps its own factor and its bits. Products on the right are central differences along the seed;
//! where forces follow the surface, what `K` leaves out of their change is taken in by iteration.
//!
//! Source: Oden & Prudhomme, "Estimation of modeling error in computational mechanics", J. Comput. Phys. 182, 2002, for the
//! linearised equilibrium; the differences are ours.

use std::ops::Range;

use super::linearisation::with_problem;
use super::past::Past;
use super::step::{place_bones, read_pivots, read_wrenches, target_increments};
use super::{Model, Sim, SimError, SolveError, State};
use crate::fem::Configuration;
use crate::math::Vec3;
use crate::port::{Port, Slot, Type};
use crate::solve::{Minimiser, Problem, Strategy};

/// Largest motion in a difference, in sizes of the model: far above round-off, far below what curves the answer.
const CHANGE: f64 = 1e-6;
/// Largest change of an input (SI units) by which the motion is first estimated.
const FIRST_CHANGE: f64 = 1e-4;
/// Passes that follower forces get, and the relative correction at which they end.
pub(super) const MOST_PASSES: usize = 30;
pub(super) const SETTLED: f64 = 1e-8;

/// The factored stiffness of one accepted state, and the past that led there.
pub(super) struct Sensitivity {
    pub(super) minimiser: Minimiser,
    pub(super) past: Past,
    config: Configuration,
    inputs: Vec<f64>,
}

/// Inputs along the seed, with what follows from them at once.
struct Moved {
    inputs: Vec<f64>,
    pivots: Vec<Vec3>,
    wrenches: Vec<(Vec3, Vec3)>,
    config: Configuration,
    x_tilde: Vec<Vec3>,
}

/// What a configuration holds the bones with.
struct Held {
    nodal: Vec<Vec3>,
    g: Vec<Vec3>,
    config: Configuration,
    pivots: Vec<Vec3>,
}

/// Along the seed, and against it.
struct Sides([Held; 2]);

impl Sides {
    /// How far a node is from one to the other at most, halved, m.
    fn motion(&self) -> f64 {
        let [p, m] = &self.0;
        0.5 * p.config.x.iter().zip(&m.config.x).map(|(p, m)| (p - m).norm()).fold(0.0, f64::max)
    }
}

impl Sim {
    /// Change of the ports `unknowns` with the ports `knowns` along `seed`, at the last accepted state: `sensitivity` is
    /// overwritten with the directional derivative of each element of the unknowns, one after another.
    ///
    /// Knowns are inputs; unknowns are `skin.position`, `skin.velocity`, `marker.position`, `bone.reactionForce` and
    /// `bone.reactionTorque`, or inputs themselves. Linear in the seed to about eight digits.
    ///
    /// In scenes with inertia or memory it is the derivative of the last piece of the step (all of it, unless it was cut) by
    /// the inputs at its end, what came before held.
    ///
    /// # Errors
    /// [`SimError::NoDerivative`] before the first equilibrium, in scenes with inertia or memory where no step of this run led
    /// to the state, and in scenes in modes by moduli and pivots; [`SimError::Port`], [`SimError::Range`], and as for
    /// [`Sim::step`] if the stiffness cannot be factored. The state does not change.
    pub fn directional_derivative(
        &mut self,
        knowns: &[usize],
        seed: &[f64],
        unknowns: &[usize],
        sensitivity: &mut [f64],
    ) -> Result<(), SimError> {
        let model = self.model.clone();
        super::step::complete(&model, &mut self.state, &self.work);
        if !model.is_reduced() {
            self.sensitivity(&model)?;
        }
        let mut direction = vec![0.0; model.parts().layout.len()];
        let mut left = seed;
        for &known in knowns {
            let (_, range) = self.known(known)?;
            let (now, later) = left.split_at_checked(range.len()).ok_or_else(|| mismatch("seed", range.len(), left))?;
            direction[range].copy_from_slice(now);
            left = later;
        }
        if !left.is_empty() {
            return Err(mismatch("seed", 0, left));
        }
        check_seed(&direction)?;
        if model.is_reduced() {
            return self.replayed(&direction, unknowns, sensitivity);
        }
        let scale = direction.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        if scale == 0.0 {
            sensitivity.fill(0.0);
            return Ok(());
        }
        let first = FIRST_CHANGE / scale;
        let motion = self.sides(&model, &direction, first, 1)?.motion();
        let X = &model.mesh().nodes;
        let (low, high) = X.iter().fold((X[0], X[0]), |(l, h), x| (l.inf(x), h.sup(x)));
        let h = if motion > 0.0 { first * CHANGE * (high - low).norm() / motion } else { first };
        let Sides(sides) = self.sides(&model, &direction, h, MOST_PASSES)?;
        let mut left = sensitivity;
        for &unknown in unknowns {
            let port = self.unknown(unknown)?;
            let n = port.len();
            if n > left.len() {
                return Err(mismatch("sensitivity", n, left));
            }
            let (now, later) = left.split_at_mut(n);
            let past = &self.sensitivity.as_ref().expect("made above").past;
            read(&model, past, &sides, port.slot, &direction, h, now);
            left = later;
        }
        if left.is_empty() { Ok(()) } else { Err(mismatch("sensitivity", 0, left)) }
    }

    /// The equilibria a step `h` along the direction and against it, to first order; one pass leaves out how follower
    /// forces change.
    fn sides(&mut self, model: &Model, direction: &[f64], h: f64, passes: usize) -> Result<Sides, SimError> {
        let parts = model.parts();
        let Sensitivity { minimiser, past, config: here, inputs: applied } = self.sensitivity(model)?;
        let moved = [1.0, -1.0].map(|sign| {
            let inputs: Vec<f64> = applied.iter().zip(direction).map(|(value, d)| value + sign * h * d).collect();
            let mut pivots = vec![Vec3::zeros(); parts.bones.len()];
            read_pivots(model, &inputs, &mut pivots);
            let mut wrenches = vec![(Vec3::zeros(), Vec3::zeros()); model.dofs().bodies.len()];
            read_wrenches(model, &inputs, &mut wrenches);
            let mut config = here.clone();
            place_bones(model, &inputs, &mut config);
            let mut u = vec![Vec3::zeros(); model.dofs().prescribed.len()];
            target_increments(model, &inputs, &pivots, &config, &mut u);
            for (&a, u) in model.dofs().prescribed.iter().zip(&u) {
                config.x[a as usize] += u;
            }
            let x_tilde = past.carried(model.dofs(), |a| config.x[a] - here.x[a]);
            Moved { inputs, pivots, wrenches, config, x_tilde }
        });
        let n = model.dofs().n_blocks();
        let mut d = vec![Vec3::zeros(); n];
        let follows = is_approximate(model, minimiser);
        for _ in 0..passes {
            let sides = [0, 1].map(|k| moved[k].held(model, past, &d, if k == 0 { h } else { -h }));
            let mut change: Vec<Vec3> = sides[0].g.iter().zip(&sides[1].g).map(|(p, m)| (p - m) / (2.0 * h)).collect();
            minimiser.apply_inverse(&mut change);
            let (mut size, mut correction) = (0.0_f64, 0.0_f64);
            for (d, c) in d.iter_mut().zip(&change) {
                *d -= c;
                size = size.max(d.norm());
                correction = correction.max(c.norm());
            }
            if !follows || passes == 1 || correction <= SETTLED * size {
                let held = |k: usize| moved[k].held(model, past, &d, if k == 0 { h } else { -h });
                return Ok(Sides([held(0), held(1)]));
            }
        }
        Err(too_strong())
    }

    /// An input that derivatives can be taken by, and where it lies among all inputs.
    pub(super) fn known(&self, k: usize) -> Result<(Slot, Range<usize>), SimError> {
        let port = self.port(k, Type::Float64, "an input that derivatives can be taken by", |p| p.is_settable())?;
        let first = self.model.parts().layout.first(port.slot).expect("every settable port lies in the layout");
        Ok((port.slot, first..first + port.len()))
    }

    /// An output that has derivatives, or an input.
    pub(super) fn unknown(&self, k: usize) -> Result<&Port, SimError> {
        self.port(k, Type::Float64, "an output that has derivatives", has_derivative)
    }

    /// The factor at the accepted state, and its past; made where the last one was another's.
    pub(super) fn sensitivity(&mut self, model: &Model) -> Result<&mut Sensitivity, SimError> {
        let here = &self.state;
        check_settled(here)?;
        let piece = Past::piece(model, here, &self.work)?;
        let serves = |s: &Sensitivity| s.config == here.config && s.inputs == here.applied && s.past.is_of(&piece);
        let made = match self.sensitivity.take() {
            Some(kept) if serves(&kept) => kept,
            other => {
                let past = Past::new(model, piece, &self.work);
                Box::new(Sensitivity::new(model, here, past, other.map(|other| other.minimiser))?)
            }
        };
        Ok(self.sensitivity.insert(made))
    }
}

/// Whether the factor leaves something of the true stiffness out, so that solves must be repeated.
pub(super) fn is_approximate(model: &Model, minimiser: &Minimiser) -> bool {
    let follows = model.parts().terms.iter().any(|t| t.is_lagged()) || !model.dofs().bodies.is_empty();
    follows || !minimiser.is_exact()
}

pub(super) fn too_strong() -> SimError {
    let why = "forces that follow the surface, or elements on the verge of buckling, are too strong for the stiffness";
    SimError::NoDerivative(why.into())
}

impl Sensitivity {
    /// Factors the stiffness at `state`, on the pattern of `before` if there is one.
    fn new(model: &Model, state: &State, past: Past, before: Option<Minimiser>) -> Result<Sensitivity, SimError> {
        let strategy = Strategy { memory: 0, threads: 1, ..model.parts().strategy };
        let at = past.at(model, &state.applied, &past.x_tilde);
        let minimiser = with_problem(model, at, |problem| {
            let mut minimiser = match before {
                Some(minimiser) => minimiser,
                None => Minimiser::new(problem, strategy)?,
            };
            minimiser.linearise(problem, &state.config)?;
            Ok::<_, SolveError>(minimiser)
        })?;
        Ok(Sensitivity { minimiser, config: state.config.clone(), inputs: state.applied.clone(), past })
    }
}

impl Moved {
    /// Gradients with the unknowns moved by `h d`; forces that follow the surface do so.
    fn held(&self, model: &Model, past: &Past, d: &[Vec3], h: f64) -> Held {
        let parts = model.parts();
        let mut config = self.config.clone();
        model.dofs().retract(&parts.mesh.nodes, &self.pivots, &self.config, h, d, &mut config);
        let problem = Problem {
            terms: &parts.terms,
            dofs: model.dofs(),
            X: &parts.mesh.nodes,
            pivots: &self.pivots,
            wrenches: &self.wrenches,
            at: past.at(model, &self.inputs, &self.x_tilde),
        };
        let mut nodal = vec![Vec3::zeros(); parts.mesh.nodes.len()];
        let mut g = vec![Vec3::zeros(); model.dofs().n_blocks()];
        problem.gradient(&config, &config, &mut nodal, &mut g);
        Held { nodal, g, config, pivots: self.pivots.clone() }
    }
}

pub(super) fn mismatch(name: &str, wanted: usize, found: &[f64]) -> SimError {
    SimError::Range { name: name.into(), len: found.len(), offset: 0, end: wanted }
}

/// Before the first equilibrium nothing can be differentiated.
pub(super) fn check_settled(state: &State) -> Result<(), SimError> {
    let why = "there is no equilibrium yet: initialise, or make a step";
    if state.outputs.converged { Ok(()) } else { Err(SimError::NoDerivative(why.into())) }
}

/// Seeds are numbers.
pub(super) fn check_seed(seed: &[f64]) -> Result<(), SimError> {
    let finite = seed.iter().all(|v| v.is_finite());
    if finite { Ok(()) } else { Err(SimError::NoDerivative("the seed is not finite".into())) }
}

fn has_derivative(port: &Port) -> bool {
    use Slot::{BoneReactionForce, BoneReactionTorque, MarkerPosition, SkinPosition, SkinVelocity};
    let is_one =
        matches!(port.slot, SkinPosition | SkinVelocity | MarkerPosition | BoneReactionForce | BoneReactionTorque);
    is_one || port.is_settable()
}

/// The derivative of one port.
fn read(model: &Model, past: &Past, sides: &[Held; 2], slot: Slot, direction: &[f64], h: f64, out: &mut [f64]) {
    let of = |value: &dyn Fn(&Held) -> Vec3| (value(&sides[0]) - value(&sides[1])) / (2.0 * h);
    let rows = |row: &dyn Fn(usize, &Held) -> Vec3, out: &mut [f64]| {
        for (k, out) in out.chunks_exact_mut(3).enumerate() {
            out.copy_from_slice(of(&|side| row(k, side)).as_slice());
        }
    };
    let parts = model.parts();
    match slot {
        Slot::SkinPosition => rows(&|k, side| model.skin().of(k, &side.config.x), out),
        Slot::SkinVelocity => {
            let moved = sides[0].config.x.iter().zip(&sides[1].config.x);
            let v: Vec<Vec3> =
                moved.zip(past.rates(model.dofs())).map(|((p, m), rate)| rate / (2.0 * h) * (p - m)).collect();
            model.skin().gather(&v, 0, out);
        }
        Slot::MarkerPosition => rows(
            &|k, side| {
                let marker = &parts.markers[k];
                model.skin().within(marker.nodes, marker.weights, &side.config.x)
            },
            out,
        ),
        Slot::BoneReactionForce => {
            rows(&|k, side| parts.bones[k].nodes.iter().map(|&a| -side.nodal[a as usize]).sum(), out);
        }
        Slot::BoneReactionTorque => rows(
            &|k, side| {
                let pivot = side.pivots[k] + side.config.poses[k].t;
                let torque = |&a: &u32| (pivot - side.config.x[a as usize]).cross(&side.nodal[a as usize]);
                parts.bones[k].nodes.iter().map(torque).sum()
            },
            out,
        ),
        input => {
            let first = parts.layout.first(input).expect("every other port is an input");
            out.copy_from_slice(&direction[first..first + out.len()]);
        }
    }
}
