//! Linear dynamics in modes of vibration: what the modes leave out follows its loads and bones at once.
//!
//! ```text
//! K phi = lambda M phi,  Phi^T M Phi = I      s(q): the equilibrium under the causes q (`linear_map`)
//! p = Phi^T M u:    p'' + alpha p' + beta lambda (p - sigma_b)' + lambda (p - sigma) = 0,   sigma = Phi^T M s
//! u = s(q) + Phi (p - sigma)
//! ```
//!
//! `alpha` and `beta` are the scene's damping in proportion to mass and stiffness, `sigma_b` the part of `sigma` that bones make
//! (dead loads strain nothing). In s the loads stand as far as damped tissue without mass would have followed them, `q + beta q'`
//! being what is asked. Each coordinate is a node of its own to the scene's time integrator, so with as many modes as
//! unknowns the steps are those of the full dynamics to round-off; with few of them the equilibrium is still exact.
//!
//! Source: Hurty, "Dynamic analysis of structural systems using component modes", AIAA J. 3(4), 1965, and Craig & Bampton,
//! "Coupling of substructures for dynamic analyses", AIAA J. 6(7), 1968, for modes with fixed bones beside what the bones do at
//! once; Cornwell, Craig & Johnson, "On the application of the mode-acceleration method to structural engineering problems",
//! Earthquake Eng. Struct. Dyn. 11(5), 1983, for the same with loads. Departure: no matrices are condensed; the scene's own
//! discrete equation is projected.

use nalgebra::DMatrix;

use super::audit::{warn_of_jumps, worst_jump};
use super::linear_map::{Cause, causes};
use super::model::Model;
use super::modes::{Modal, Spectrum, bone_of};
use super::report::StepReport;
use super::scheme::{Past, Scheme};
use super::state::State;
use super::targets::{place_bones, read_pivots, target};
use super::{SimError, SolveError};
use crate::math::Vec3;
use crate::solve::Minimiser;

/// A motion whose phase turns by less than this (rad) in a step is resolved by the steps.
const RESOLVED: f64 = 1.0;

/// Where a simulation in modes is; every list is empty in other scenes. Modes go three by three, as coordinates of a node.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Coordinates {
    /// `Phi^T M u`, kg^(1/2) m, and its rate.
    pub p: Vec<Vec3>,
    pub v: Vec<Vec3>,
    /// What the scheme remembers of each.
    pub memory: Vec<[Vec3; 2]>,
    /// p of the step before.
    pub p_before: Vec<Vec3>,
    /// Causes of the last step and of the one before, loads as far as damped tissue has followed them.
    pub q: Vec<f64>,
    pub q_before: Vec<f64>,
    /// Rate of the causes at the end of the last step as the scheme differs, and over the step as bones move.
    pub rate: Vec<f64>,
    pub pace: Vec<f64>,
}

impl Coordinates {
    /// Nothing has moved.
    pub fn still(model: &Model) -> Coordinates {
        let modes = model.parts().inertia.as_ref().and_then(|i| i.reduction).map(|r| r.modes);
        let n = modes.map_or(0, |modes| modes.div_ceil(3));
        let n_causes = modes.and_then(|_| causes(model)).map_or(0, |causes| causes.len());
        Coordinates {
            p: vec![Vec3::zeros(); n],
            v: vec![Vec3::zeros(); n],
            memory: vec![[Vec3::zeros(); 2]; n],
            p_before: vec![Vec3::zeros(); n],
            q: vec![0.0; n_causes],
            q_before: vec![0.0; n_causes],
            rate: vec![0.0; n_causes],
            pace: vec![0.0; n_causes],
        }
    }

    fn numbers(&self) -> impl Iterator<Item = &f64> {
        let vectors = self.p.iter().chain(&self.v).chain(self.memory.as_flattened()).chain(&self.p_before);
        let numbers = self.q.iter().chain(&self.q_before).chain(&self.rate).chain(&self.pace);
        vectors.flatten().chain(numbers)
    }

    fn is_still(&self) -> bool {
        self.numbers().all(|c| *c == 0.0)
    }

    pub fn is_finite(&self) -> bool {
        self.numbers().all(|c| c.is_finite())
    }

    fn copy_from(&mut self, other: &Coordinates) {
        let Coordinates { p, v, memory, p_before, q, q_before, rate, pace } = other;
        self.p.copy_from_slice(p);
        self.v.copy_from_slice(v);
        self.memory.copy_from_slice(memory);
        self.p_before.copy_from_slice(p_before);
        self.q.copy_from_slice(q);
        self.q_before.copy_from_slice(q_before);
        self.rate.copy_from_slice(rate);
        self.pace.copy_from_slice(pace);
    }
}

/// A step that was made: where from and where to, its end and length (s), and the length of the one before.
#[derive(Debug, Clone)]
pub(super) struct Last {
    pub from: Coordinates,
    pub to: Coordinates,
    pub t: f64,
    pub dt: f64,
    pub dt_before: f64,
}

impl Last {
    /// No step yet.
    pub fn none(model: &Model) -> Last {
        let still = Coordinates::still(model);
        Last { from: still.clone(), to: still, t: f64::NAN, dt: 0.0, dt_before: 0.0 }
    }

    /// The step from `from` that ended in `state`.
    pub fn to(state: &State, from: Coordinates, dt: f64, dt_before: f64) -> Last {
        Last { from, to: state.modal.clone(), t: state.t, dt, dt_before }
    }

    /// Whether it is how `state` came about.
    pub fn led_to(&self, state: &State) -> bool {
        self.t == state.t && self.to == state.modal
    }
}

impl Modal {
    /// The step to the causes of `map.q`, from `from` into `next`; returns the kinetic energy, J.
    fn move_on(&mut self, model: &Model, from: &Coordinates, dt: f64, dt_before: f64) -> f64 {
        let inertia = model.parts().inertia.as_ref().expect("a scene in modes has inertia");
        let beta = inertia.reduction.map_or(0.0, |r| r.damping_stiffness);
        let n = self.causes.len();
        let (formula, d) = (inertia.scheme.formula(dt, dt_before), inertia.scheme.difference(dt, dt_before));
        let k = formula.coefficient(inertia.damping_mass);
        let Modal { map, causes, next, asked, change, w, scratch, accelerations, .. } = self;
        asked.copy_from_slice(&map.q[..n]);
        next.q_before.copy_from_slice(&from.q);
        next.p_before.copy_from_slice(&from.p);
        for j in 0..n {
            next.q[j] = match bone_of(causes[j]) {
                Some(_) => asked[j],
                // Where a mode is so fast that only damping holds it back: q + beta q' = what is asked.
                None => {
                    let remembered = d.last * from.q[j] - d.before * from.q_before[j];
                    (asked[j] + beta * d.rate * remembered) / (1.0 + beta * d.rate)
                }
            };
            change[j] = next.q[j] - d.last * from.q[j] + d.before * from.q_before[j];
            next.rate[j] = d.rate * change[j];
            next.pace[j] = (next.q[j] - from.q[j]) / dt;
            accelerations[j] = (next.pace[j] - from.pace[j]) / dt + inertia.damping_mass * next.pace[j];
        }
        // lambda (sigma + beta rate sigma_b), the latter of the change.
        scratch.copy_from_slice(&self.sigma_0);
        self.Sigma.add(1.0, asked, scratch);
        if beta > 0.0 {
            self.Sigma_b.add(beta * d.rate, &change[..n], scratch);
        }
        for (i, lambda) in self.lambda.iter().enumerate() {
            let past = Past { x: from.p[i], v: from.v[i], memory: from.memory[i] };
            let damped = beta * d.rate * (d.last * from.p[i] - d.before * from.p_before[i]);
            let f = k * formula.x_tilde(&past, inertia.damping_mass) + lambda.component_mul(&(scratch[i] + damped));
            next.p[i] = f.component_div(&(Vec3::repeat(k) + (1.0 + beta * d.rate) * lambda));
            (next.v[i], next.memory[i]) = formula.arrive(&past, &next.p[i]);
        }
        // Changes and rates of the modes beside those of the causes.
        scratch.copy_from_slice(&next.p);
        for (i, s) in scratch.iter_mut().enumerate() {
            *s += d.before * from.p_before[i] - d.last * from.p[i];
        }
        self.Sigma.add(-1.0, &change[..n], scratch);
        (0..self.n_modes).for_each(|k| change[n + k] = scratch[k / 3][k % 3]);
        scratch.copy_from_slice(&next.v);
        self.Sigma.add(-1.0, &next.rate, scratch);
        w[..n].copy_from_slice(&next.rate);
        (0..self.n_modes).for_each(|k| w[n + k] = scratch[k / 3][k % 3]);
        // Elastic forces come from where the tissue is, those of the table from where it would be at rest.
        change.iter_mut().for_each(|c| *c *= beta * d.rate);
        change.iter_mut().zip(&next.q).zip(asked).for_each(|((c, q), asked)| *c += q - *asked);
        let moving: f64 = next.v.iter().map(Vec3::norm_squared).sum();
        0.5 * (moving + quadratic(&self.residual_mass, &next.rate) + quadratic(&self.bone_mass, &next.pace))
    }

    /// The equilibrium at the causes of `map.q`, into `next`.
    fn settle(&mut self) {
        let Modal { map, next, asked, w, change, accelerations, .. } = self;
        asked.copy_from_slice(&map.q[..self.causes.len()]);
        let q = &asked[..];
        next.p.copy_from_slice(&self.sigma_0);
        self.Sigma.add(1.0, q, &mut next.p);
        next.p_before.copy_from_slice(&next.p);
        next.v.fill(Vec3::zeros());
        next.memory.fill([Vec3::zeros(); 2]);
        next.q.copy_from_slice(q);
        next.q_before.copy_from_slice(q);
        for list in [&mut next.rate, &mut next.pace, w, change, accelerations] {
            list.fill(0.0);
        }
    }
}

fn quadratic(A: &DMatrix<f64>, q: &[f64]) -> f64 {
    A.column_iter().zip(q).map(|(a, s)| s * a.iter().zip(q).map(|(a, q)| a * q).sum::<f64>()).sum()
}

/// Makes the tables that serve the inputs as set; returns the linear solves, and the coordinates in the new tables where they
/// have changed.
fn prepare(
    model: &Model,
    state: &mut State,
    minimiser: &mut Minimiser,
    modal: &mut Option<Box<Modal>>,
) -> Result<(u32, Option<Coordinates>), SimError> {
    let serves = |modal: &Option<Box<Modal>>, inputs: &[f64]| modal.as_ref().is_some_and(|m| m.map.serves(inputs));
    let still = state.modal.is_still();
    if serves(modal, &state.inputs) && (still || serves(modal, &state.applied)) {
        return Ok((0, None));
    }
    let mut solves = 0;
    let mut other = None;
    if !still {
        if !serves(modal, &state.applied) {
            let (made, n) = Modal::new(model, minimiser, &state.applied)?;
            solves += n;
            *modal = Some(Box::new(made));
            if serves(modal, &state.inputs) {
                return Ok((solves, None));
            }
        }
        complete(model, state, modal);
        other = modal.take();
    }
    let made = Modal::new(model, minimiser, &state.inputs);
    let (made, n) = match made {
        Ok(made) => made,
        Err(e) => {
            *modal = other;
            return Err(e);
        }
    };
    let carried = other.map(|other| made.carry(model, &other, &state.modal));
    *modal = Some(Box::new(made));
    Ok((solves + n, carried))
}

/// Moves a scene in modes on by `dt` seconds, or to its equilibrium if that is 0; `None` for other scenes.
pub(super) fn advance(
    model: &Model,
    state: &mut State,
    minimiser: &mut Minimiser,
    modal: &mut Option<Box<Modal>>,
    dt: f64,
) -> Result<Option<StepReport>, SimError> {
    if !model.is_reduced() {
        return Ok(None);
    }
    let mut report = StepReport::new(1);
    let (solves, carried) = prepare(model, state, minimiser, modal)?;
    (report.iterations, report.factorisations) = (solves, u32::from(solves > 0));
    let modal = modal.as_mut().expect("tables were made");
    let from = carried.as_ref().unwrap_or(&state.modal);
    place_bones(model, &state.inputs, &mut modal.config);
    read_pivots(model, &state.inputs, &mut modal.pivots);
    modal.map.set(model, &state.inputs, &modal.config.poses);
    let kinetic = if dt > 0.0 {
        modal.move_on(model, from, dt, state.motion.dt)
    } else {
        modal.settle();
        0.0
    };
    let mut coefficients = std::mem::take(&mut modal.map.q);
    let mut scratch = std::mem::take(&mut modal.scratch);
    modal.coefficients(1.0, &modal.next.q, &modal.next.p, &mut scratch, &mut coefficients);
    (modal.map.q, modal.scratch) = (coefficients, scratch);
    let [residual, correction, strain_bound] = modal.map.bounds();
    let tolerance = model.parts().strategy.tolerance;
    if !(residual.is_finite() && correction <= tolerance) {
        let source = match residual.is_finite() && correction.is_finite() {
            true => SolveError::NotConverged { iterations: 0, correction, tolerance, residual },
            false => SolveError::NotFinite,
        };
        return Err(SimError::Solve {
            t: state.t,
            dt,
            cuts: 1,
            spent: 0,
            work: 0.0,
            reached: 0.0,
            place: None,
            source,
        });
    }
    if modal.look.is_due(strain_bound) {
        modal.map.place_whole(model, &state.inputs, &modal.pivots, &mut modal.config);
        modal.look.take(model, strain_bound, &modal.config.x, &mut report.warnings);
    }
    let before = worst_jump(model, &state.config.x);
    modal.last.from.copy_from(from);
    modal.last.to.copy_from(&modal.next);
    (modal.last.t, modal.last.dt, modal.last.dt_before) = (state.t + dt, dt, state.motion.dt);
    state.modal.copy_from(&modal.next);
    state.config.poses.copy_from_slice(&modal.config.poses);
    modal.map.place_seen(model, &state.inputs, &modal.pivots, &mut state.config);
    let seen = || modal.map.seen.nodes.iter().chain(modal.map.seen_on_bones.iter().map(|(_, _, a)| a));
    seen().for_each(|&a| state.motion.a[a as usize] = state.motion.v[a as usize]);
    modal.map.seen.place(0.0, &modal.w, &mut state.motion.v);
    for &(bone, k, a) in &modal.map.seen_on_bones {
        let v = modal.velocity_on_bone(model, &state.modal.pace, &modal.pivots, bone as usize, k as usize);
        state.motion.v[a as usize] = v;
    }
    for &a in seen() {
        let (a, v) = (&mut state.motion.a[a as usize], state.motion.v[a as usize]);
        *a = if dt > 0.0 { (v - *a) / dt } else { Vec3::zeros() };
    }
    state.partial = true;
    state.outputs.least = State::UNSEEN;
    warn_of_jumps(model, before, worst_jump(model, &state.config.x), &mut report);
    modal.warn_of_gap(dt, &mut report);
    state.t += dt;
    state.motion.dt = dt;
    state.applied.copy_from_slice(&state.inputs);
    modal.map.q[..modal.asked.len()].copy_from_slice(&modal.asked);
    let o = &mut state.outputs;
    for (b, (force, torque)) in o.reaction_force.iter_mut().zip(&mut o.reaction_torque).enumerate() {
        let pose = &state.config.poses[b];
        (*force, *torque) = modal.map.reaction(model, &state.applied, b, pose);
        let damping = modal.elastic.get(b).map(|elastic| (elastic, &modal.change));
        for (of, q) in damping.into_iter().chain([(&modal.inertial[b], &modal.accelerations)]) {
            let (f, m) = of.of(model, &state.applied, b, pose, 0.0, q);
            *force += f;
            *torque += m;
        }
    }
    (report.residual, report.correction) = (residual, correction);
    (o.iterations, o.residual, o.converged, o.dt, o.kinetic) = (report.iterations, residual, true, dt, kinetic);
    Ok(Some(report))
}

impl Modal {
    /// Tells once where steps resolve motions that the modes leave out.
    fn warn_of_gap(&mut self, dt: f64, report: &mut StepReport) {
        let Some(left_out) = self.spectrum.left_out.filter(|_| dt > 0.0 && !self.told) else { return };
        let resolved = RESOLVED / (std::f64::consts::TAU * dt);
        if left_out < resolved {
            self.told = true;
            report.warnings.push(format!(
                "the {} modes of [inertia] end before {left_out:.3e} Hz, steps of {dt:.1e} s resolve {resolved:.3e} Hz: what \
                 vibrates between follows loads and bones at once; take more modes where that matters",
                self.n_modes
            ));
        }
    }
}

/// The start at rest: loads are yet to be followed, unless they stand against one that is always there; the acceleration
/// where the scheme remembers one.
pub(super) fn set_off(
    model: &Model,
    state: &mut State,
    minimiser: &mut Minimiser,
    modal: &mut Option<Box<Modal>>,
) -> Result<(), SimError> {
    prepare(model, state, minimiser, modal)?;
    let modal = modal.as_mut().expect("tables were made");
    modal.last.t = f64::NAN;
    // p'' = lambda sigma of the loads where nothing moves.
    place_bones(model, &state.inputs, &mut modal.config);
    modal.map.set(model, &state.inputs, &modal.config.poses);
    let load = |(cause, q): (&Cause, &f64)| if bone_of(*cause).is_none() { *q } else { 0.0 };
    let loads: Vec<f64> = modal.causes.iter().zip(&modal.map.q).map(load).collect();
    if modal.sigma_0.iter().any(|sigma| *sigma != Vec3::zeros()) {
        state.modal.q.copy_from_slice(&loads);
        state.modal.q_before.copy_from_slice(&loads);
    }
    let scheme = model.parts().inertia.as_ref().map(|i| i.scheme);
    if !matches!(scheme, Some(Scheme::GeneralisedAlpha { .. })) {
        return Ok(());
    }
    let mut sigma = modal.sigma_0.clone();
    modal.Sigma.add(1.0, &loads, &mut sigma);
    for ((memory, sigma), lambda) in state.modal.memory.iter_mut().zip(&sigma).zip(&modal.lambda) {
        memory[0] = lambda.component_mul(sigma);
    }
    Ok(())
}

/// Puts all nodes of a state in modes where they belong, with their velocities, not only those that ports read.
pub(super) fn complete(model: &Model, state: &mut State, modal: &Option<Box<Modal>>) {
    if let (true, Some(modal)) = (state.partial, modal) {
        modal.place_whole(model, state);
    }
}

impl Modal {
    fn place_whole(&self, model: &Model, state: &mut State) {
        let mut pivots = vec![Vec3::zeros(); model.parts().bones.len()];
        read_pivots(model, &state.applied, &mut pivots);
        let Coordinates { p, v, q, rate, pace, .. } = &state.modal;
        self.spread(1.0, q, p, &mut state.config.x);
        self.spread(0.0, rate, v, &mut state.motion.v);
        for (b, bone) in model.parts().bones.iter().enumerate() {
            for (k, &a) in bone.nodes.iter().enumerate() {
                state.config.x[a as usize] = target(model, &state.applied, &pivots, &state.config.poses, b, k);
                state.motion.v[a as usize] = self.velocity_on_bone(model, pace, &pivots, b, k);
            }
        }
        state.partial = false;
    }
}

/// Takes over the positions of the free nodes as far as the modes hold them, with their velocities as they were; the scheme
/// starts anew. `false` for scenes that are not in modes.
pub(super) fn start_from(
    model: &Model,
    state: &mut State,
    minimiser: &mut Minimiser,
    modal: &mut Option<Box<Modal>>,
    x: &[Vec3],
) -> Result<bool, SimError> {
    if !model.is_reduced() {
        return Ok(false);
    }
    if !modal.as_ref().is_some_and(|m| m.map.serves(&state.applied)) {
        *modal = Some(Box::new(Modal::new(model, minimiser, &state.applied)?.0));
    }
    let modal = modal.as_ref().expect("tables were made");
    let X = &model.mesh().nodes;
    state.modal.p = modal.gather(model, |a| x[a] - X[a]);
    state.modal.memory.fill([Vec3::zeros(); 2]);
    state.motion.dt = 0.0;
    modal.place_whole(model, state);
    Ok(true)
}

/// What the modes of a scene hold under the inputs as set; `None` for other scenes.
pub(super) fn spectrum(
    model: &Model,
    state: &State,
    minimiser: &mut Minimiser,
    modal: &mut Option<Box<Modal>>,
) -> Result<Option<Spectrum>, SimError> {
    if !model.is_reduced() {
        return Ok(None);
    }
    if let Some(modal) = modal.as_ref().filter(|m| m.map.serves(&state.inputs)) {
        return Ok(Some(modal.spectrum.clone()));
    }
    let made = Modal::new(model, minimiser, &state.inputs)?.0;
    let spectrum = made.spectrum.clone();
    if modal.is_none() {
        *modal = Some(Box::new(made));
    }
    Ok(Some(spectrum))
}
