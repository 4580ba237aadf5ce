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

use super::audit::strain_at;
use super::linearisation::with_problem;
use super::outputs::Slope;
use super::past::{Origin, Past};
use super::ports::Source;
use super::targets::{place_bones, read_pivots, read_wrenches, target_increments};
use super::{Model, Sim, SimError, SolveError, State};
use crate::fem::Configuration;
use crate::math::{Vec3, extent, left_jacobian, log_rotation};
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
    inputs: Vec<f64>,
}

/// Both sides of a state, and what outputs are read with.
pub(super) struct Ends<'a> {
    model: &'a Model,
    past: &'a Past,
    /// The state between them.
    here: &'a State,
    sides: &'a [Held; 2],
    h: f64,
}

/// How an unknown of a derivative changes.
pub(super) enum Unknown {
    /// It is an input itself, the first of so many among all inputs.
    Input(usize),
    /// As the row of an output says.
    Output(Slope),
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
    /// Knowns are inputs; unknowns are outputs (skin, markers, poses, reactions, contacts, energies) or inputs themselves. Linear
    /// in the seed to about eight digits.
    ///
    /// In scenes with inertia or memory it is the derivative of the last piece of the step (all of it, unless it was cut) by
    /// the inputs at its end, what came before held; a saved state carries what that wants.
    ///
    /// # Errors
    /// [`SimError::NoDerivative`] before the first equilibrium, of ports that tell of the solver and the elements, in scenes with
    /// inertia or memory after [`Sim::start_from`], and in scenes in modes by moduli and pivots; [`SimError::Port`],
    /// [`SimError::Range`], [`SimError::SeedNotFinite`], and as for [`Sim::step`] if the stiffness cannot be factored. The state
    /// does not change.
    pub fn directional_derivative(
        &mut self,
        knowns: &[usize],
        seed: &[f64],
        unknowns: &[usize],
        sensitivity: &mut [f64],
    ) -> Result<(), SimError> {
        let model = self.model.clone();
        super::step::complete(&model, &mut self.state, &self.work);
        check_settled(&self.state)?;
        let wanted = self.unknowns(unknowns)?;
        let n = wanted.iter().map(|(_, n)| n).sum();
        if n != sensitivity.len() {
            return Err(mismatch("sensitivity", n, sensitivity));
        }
        let mut direction = vec![0.0; model.parts().layout.len()];
        let mut left = seed;
        for &known in knowns {
            let (_, range) = self.known(known)?;
            let (now, later) = left.split_at_checked(range.len()).ok_or_else(|| mismatch("seed", range.len(), left))?;
            // A known that is named twice moves by both.
            direction[range].iter_mut().zip(now).for_each(|(d, seed)| *d += seed);
            left = later;
        }
        if !left.is_empty() {
            return Err(mismatch("seed", 0, left));
        }
        check_seed(&direction)?;
        let scale = direction.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let at_rest = model.remembers() && self.work.kept.origin == Origin::Rest;
        if scale == 0.0 || at_rest {
            // Where a scene starts at rest nothing has moved yet, whatever the inputs.
            each(&wanted, sensitivity, |unknown, out| match unknown {
                Unknown::Input(first) => out.copy_from_slice(&direction[*first..first + out.len()]),
                Unknown::Output(_) => out.fill(0.0),
            });
            return Ok(());
        }
        if model.is_reduced() {
            return self.replayed(&direction, unknowns, sensitivity);
        }
        let first = FIRST_CHANGE / scale;
        let motion = self.sides(&model, &direction, first, 1)?.motion();
        let h = if motion > 0.0 { first * CHANGE * extent(&model.mesh().nodes) / motion } else { first };
        let Sides(sides) = self.sides(&model, &direction, h, MOST_PASSES)?;
        let past = &self.sensitivity.as_ref().expect("made for the sides").past;
        let ends = Ends { model: &model, past, here: &self.state, sides: &sides, h };
        each(&wanted, sensitivity, |unknown, out| match unknown {
            Unknown::Input(first) => out.copy_from_slice(&direction[*first..first + out.len()]),
            Unknown::Output(Slope::Of(along, _)) => along(&ends, out),
            Unknown::Output(Slope::Zero | Slope::None) => out.fill(0.0),
        });
        Ok(())
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
        let wanted = "an input that derivatives can be taken by";
        let port = self.port(k, Type::Float64, wanted, |p| p.is_settable())?;
        match self.model.source(k) {
            Source::Input(first) => Ok((port.slot, first..first + port.len())),
            Source::MostSolves | Source::Computed(_) => {
                Err(SimError::Port { port: k, n_ports: self.model.ports().len(), wanted })
            }
        }
    }

    /// How each of these changes, and how many values it has.
    pub(super) fn unknowns(&self, ports: &[usize]) -> Result<Vec<(Unknown, usize)>, SimError> {
        let unknown = |&k: &usize| {
            let port: &Port = self.port(k, Type::Float64, "an output or an input of type Float64", |_| true)?;
            let unknown = match self.model.source(k) {
                Source::Input(first) => Unknown::Input(first),
                Source::Computed(row) => Unknown::Output(row.slope),
                Source::MostSolves => Unknown::Output(Slope::None),
            };
            if let Unknown::Output(Slope::None) = unknown {
                let why = format!("`{}` tells of the solver or of single elements, not of the tissue", port.name);
                return Err(SimError::NoDerivative(why));
            }
            Ok((unknown, port.len()))
        };
        ports.iter().map(unknown).collect()
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
        Held { nodal, g, config, pivots: self.pivots.clone(), inputs: self.inputs.clone() }
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
    match seed.iter().position(|v| !v.is_finite()) {
        Some(k) => Err(SimError::SeedNotFinite(k)),
        None => Ok(()),
    }
}

/// Hands each unknown its part of `all`.
fn each(unknowns: &[(Unknown, usize)], all: &mut [f64], mut write: impl FnMut(&Unknown, &mut [f64])) {
    let mut left = all;
    for (unknown, n) in unknowns {
        let (now, later) = left.split_at_mut(*n);
        write(unknown, now);
        left = later;
    }
}

impl Ends<'_> {
    /// The difference of what `row` tells of each side.
    fn rows(&self, out: &mut [f64], row: impl Fn(usize, &Held) -> Vec3) {
        let [plus, minus] = self.sides;
        for (k, out) in out.chunks_exact_mut(3).enumerate() {
            out.copy_from_slice(((row(k, plus) - row(k, minus)) / (2.0 * self.h)).as_slice());
        }
    }

    /// The same of numbers.
    fn numbers(&self, out: &mut [f64], number: impl Fn(usize, &Held) -> f64) {
        let [plus, minus] = self.sides;
        for (k, out) in out.iter_mut().enumerate() {
            *out = (number(k, plus) - number(k, minus)) / (2.0 * self.h);
        }
    }

    /// How the nodes' velocities change.
    fn velocities(&self) -> Vec<Vec3> {
        let [plus, minus] = self.sides;
        let moved = plus.config.x.iter().zip(&minus.config.x);
        let rates = self.past.rates(self.model.dofs());
        moved.zip(rates).map(|((p, m), rate)| rate / (2.0 * self.h) * (p - m)).collect()
    }
}

pub(super) fn skin_position(ends: &Ends, out: &mut [f64]) {
    ends.rows(out, |k, side| ends.model.skin().of(k, &side.config.x));
}
pub(super) fn skin_velocity(ends: &Ends, out: &mut [f64]) {
    ends.model.skin().gather(&ends.velocities(), 0, out);
}
pub(super) fn marker_position(ends: &Ends, out: &mut [f64]) {
    ends.rows(out, |k, side| {
        let marker = &ends.model.parts().markers[k];
        ends.model.skin().within(marker.nodes, marker.weights, &side.config.x)
    });
}
pub(super) fn reaction_force(ends: &Ends, out: &mut [f64]) {
    ends.rows(out, |k, side| ends.model.parts().bones[k].nodes.iter().map(|&a| -side.nodal[a as usize]).sum());
}
pub(super) fn reaction_torque(ends: &Ends, out: &mut [f64]) {
    ends.rows(out, |k, side| {
        let pivot = side.pivots[k] + side.config.poses[k].t;
        let torque = |&a: &u32| (pivot - side.config.x[a as usize]).cross(&side.nodal[a as usize]);
        ends.model.parts().bones[k].nodes.iter().map(torque).sum()
    });
}
pub(super) fn pose_translation(ends: &Ends, out: &mut [f64]) {
    ends.rows(out, |k, side| side.config.poses[k].t);
}
/// The turn between the sides as a change of the rotation vector, which itself may jump between them.
pub(super) fn pose_rotation(ends: &Ends, out: &mut [f64]) {
    let [plus, minus] = ends.sides;
    for (k, out) in out.chunks_exact_mut(3).enumerate() {
        let turn = log_rotation(&(plus.config.poses[k].R * minus.config.poses[k].R.transpose())) / (2.0 * ends.h);
        let J = left_jacobian(&log_rotation(&ends.here.config.poses[k].R));
        out.copy_from_slice(J.try_inverse().map_or(turn, |inverse| inverse * turn).as_slice());
    }
}
/// What its frame feels: nothing else acts on those nodes.
pub(super) fn contact_force(ends: &Ends, out: &mut [f64]) {
    ends.rows(out, |k, side| ends.model.parts().contacts[k].frame.iter().map(|&a| -side.nodal[a as usize]).sum());
}
pub(super) fn contact_depth(ends: &Ends, out: &mut [f64]) {
    ends.numbers(out, |k, side| ends.model.touch(k, &ends.past.still(&side.inputs), &side.config.x).depth());
}
pub(super) fn elastic(ends: &Ends, out: &mut [f64]) {
    ends.numbers(out, |_, side| strain_at(ends.model, &ends.past.still(&side.inputs), &side.config.x).energy);
}
pub(super) fn kinetic(ends: &Ends, out: &mut [f64]) {
    let Some(inertia) = &ends.model.parts().inertia else { return out.fill(0.0) };
    let v = ends.velocities();
    out.fill(inertia.m.iter().zip(&ends.here.motion.v).zip(&v).map(|((m, v), dv)| m * v.dot(dv)).sum());
}
