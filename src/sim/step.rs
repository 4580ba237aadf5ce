//! One host step: targets, prediction, minimisation, acceptance. All or nothing.
//!
//! Quasi-static equilibrium and the steps of every time integrator are one minimisation (see `effect::inertia` and
//! `scheme`); a step that fails is cut into smaller pieces of load and time.

use std::sync::Arc;

use super::ahead::Ahead;
use super::approach::{Approach, check_depth};
use super::audit::{Balance, Look, hangs, is_same_place, min_det_f, snapped, warn_of_squeezing, worst_place};
use super::linear_map::LinearMap;
use super::linearisation::{Linearisation, with_problem};
use super::modal;
use super::model::{Drive, Model, usual_solves};
use super::modes::{Modal, Spectrum};
use super::motion::Motion;
use super::pace::{Pace, even_part};
use super::past::{Kept, Origin};
use super::recover::untangle;
use super::scheme::Scheme;
use super::start::accelerations;
use super::state::{State, are_at_rest};
use super::swing::{GAINED, Swing, none_before};
use super::{SimError, SolveError};
use crate::fem::{At, Configuration, Strain};
use crate::math::{Mat3, Pose, Vec3, best_fit};
use crate::port::Slot;
use crate::solve::{Allowance, Minimiser, Outcome, Problem, Rung, Way};

/// A step is cut into pieces no smaller than this part of it.
const SMALLEST_PIECE: f64 = 1.0 / 64.0;
/// A piece that turns elements inside out is cut; where the scene allows them, down to this part of the step only.
const SMALLEST_TO_AVOID_INVERSION: f64 = 1.0 / 8.0;
/// A piece of load alone that is smaller starts from where the tissue is, if the law does not allow what is predicted.
const SMALLEST_TO_PREDICT: f64 = 1.0 / 32.0;
/// What is left of a step that is no further piece.
const ROUND_OFF: f64 = 1e-9;
/// Most linear solves of a whole step, in units of `solver.max_iterations`.
const BUDGET: u32 = 4;
/// Good steps, whose work is spent on pieces without an answer before the step is refused; no step of the torture scenes that has
/// an answer wastes more than 6.
const MOST_WASTED: f64 = 10.0;
/// Most of one piece, in the same: a snap takes up to 22.
const MOST_OF_A_PIECE: f64 = 24.0;
/// Most of a step, in the same, however well its pieces go; no step of the torture scenes that has an answer takes more than 32.
const MOST_OF_A_STEP: f64 = 40.0;
/// Sizes of the tissue that loads may be predicted to move it by; torture scenes with an answer go to 33.
const MOST_REACH: f64 = 50.0;
/// After a piece that succeeded the next one may be this much larger.
const GROWTH: f64 = 2.0;
/// Change of ln dt beyond which the stiffness with inertia is factored anew.
const DT_DRIFT: f64 = 0.1;
/// Change of ln E beyond which the stiffness is factored anew.
const MODULUS_DRIFT: f64 = 0.1;
/// A jump across a bone-to-bone edge larger than this part of its length is reported.
const LARGEST_JUMP: f64 = 0.3;
/// The bones' common rigid motion is taken out first where it explains all but this part of their motion.
const RIGID_REMAINDER: f64 = 0.5;
/// Turns smaller than this (rad, squared) leave the factor as it is.
const FRAME_THRESHOLD: f64 = 0.05 * 0.05;

/// Largest turn of a bone that a piece of a step makes, rad; a right angle and some go in one.
const MOST_TURN: f64 = 2.2;

/// What a step did.
#[derive(Debug, Clone, PartialEq)]
pub struct StepReport {
    /// Linear solves.
    pub iterations: u32,
    /// Factorisations.
    pub factorisations: u32,
    /// Pieces the step was cut into; 1 if it went in one.
    pub substeps: u32,
    /// Largest estimated error in time of a piece, m; 0 without `[inertia] accuracy`.
    pub time_error: f64,
    /// Norm of the force residual, N.
    pub residual: f64,
    /// Largest nodal motion of the last correction, m.
    pub correction: f64,
    /// Whether the tolerance was met.
    pub converged: bool,
    /// What the user should know about this step; empty as a rule.
    pub warnings: Vec<String>,
}

/// Scratch of the solver; never saved. Allocates when made, then no more.
pub(super) struct Workspace {
    minimiser: Box<Minimiser>,
    /// What its steps may spend.
    pub allowance: Arc<Allowance>,
    /// The answer to every input, in scenes that are linear in them.
    table: Table,
    /// The same with modes of vibration, in scenes that ask for them.
    modal: Option<Box<Modal>>,
    /// Which linearisation the minimiser's factor was made from.
    factored: Option<Arc<Linearisation>>,
    /// The factor that the minimiser gets next.
    ahead: Ahead,
    config: Configuration,
    /// Where the piece at hand started from.
    before: Configuration,
    motion: Motion,
    /// Estimated error in time of the last piece, m.
    time_error: f64,
    /// The last accepted piece of time; its end is in `config`, what it remembered from before in `remembered`.
    last: Option<Piece>,
    /// How the accepted state came about.
    pub kept: Kept,
    /// What terms remember, and where the next memory is written.
    history: Vec<f64>,
    remembered: Vec<f64>,
    inputs: Vec<f64>,
    x_tilde: Vec<Vec3>,
    pivots: Vec<Vec3>,
    u: Vec<Vec3>,
    wrenches: Vec<(Vec3, Vec3)>,
    /// When elements of the table were looked at.
    look: Look,
    /// Whether it was told that a free motion gained energy.
    told_of_gain: bool,
    /// The last step without an answer: asked again, it is not tried again.
    refused: Option<Box<Refused>>,
}

/// A step that had no answer.
struct Refused {
    from: State,
    dt: f64,
    error: SimError,
    /// Where the solver gave up, m.
    x: Vec<Vec3>,
}

/// A piece of time that was accepted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    /// Its number among those that were kept; 0 before.
    pub number: u64,
    /// Its end, s.
    pub t: f64,
    /// Its length, s; 0 if no time passed.
    pub dt: f64,
    /// Length of the one before, s; 0 if there was none.
    pub dt_before: f64,
}

/// Whether steps are read off a table.
enum Table {
    /// Not asked yet.
    Unknown,
    /// The scene is not linear in its inputs, or the table would be too large.
    None,
    Made(Box<LinearMap>),
}

impl Workspace {
    pub fn new(model: &Model) -> Result<Workspace, SolveError> {
        let parts = model.parts();
        let X = &parts.mesh.nodes;
        let pivots = vec![Vec3::zeros(); parts.bones.len()];
        let wrenches = vec![(Vec3::zeros(), Vec3::zeros()); model.dofs().bodies.len()];
        let problem = Problem {
            terms: &parts.terms,
            dofs: model.dofs(),
            X,
            pivots: &pivots,
            wrenches: &wrenches,
            at: At { inputs: &parts.start, x_tilde: X, x_lag: X, ..At::NOWHERE },
        };
        Ok(Workspace {
            minimiser: Box::new(Minimiser::new(&problem, parts.strategy)?),
            allowance: Arc::default(),
            table: Table::Unknown,
            modal: None,
            factored: None,
            ahead: Ahead::default(),
            config: Configuration { x: X.clone(), poses: vec![Pose::REST; parts.bones.len()] },
            before: Configuration { x: X.clone(), poses: vec![Pose::REST; parts.bones.len()] },
            motion: Motion::still(X.len(), parts.inertia.as_ref()),
            time_error: 0.0,
            last: None,
            kept: Kept::new(parts.n_history, if parts.inertia.is_some() { X.len() } else { 0 }),
            history: vec![0.0; parts.n_history],
            remembered: vec![0.0; parts.n_history],
            inputs: parts.start.clone(),
            x_tilde: if parts.inertia.is_some() { X.clone() } else { Vec::new() },
            u: vec![Vec3::zeros(); model.dofs().prescribed.len()],
            pivots,
            wrenches,
            look: Look::none(),
            told_of_gain: false,
            refused: None,
        })
    }

    /// Where the last step without an answer was given up, m.
    pub fn refused(&self) -> Option<&[Vec3]> {
        self.refused.as_ref().map(|refused| &refused.x[..])
    }

    pub fn minimiser(&self) -> &Minimiser {
        &self.minimiser
    }

    /// The minimiser and the tables of a scene in modes.
    pub fn modal(&mut self) -> (&mut Minimiser, &mut Option<Box<Modal>>) {
        (&mut self.minimiser, &mut self.modal)
    }

    /// Completes a snapshot of `state` by what came before it.
    pub fn keep(&self, model: &Model, state: &mut State) {
        state.before = self.kept.save(model, state, self.modal.as_ref().map(|modal| &modal.last));
    }

    /// Takes over what a snapshot knows of what came before it.
    pub fn recall(&mut self, state: &mut State) {
        self.kept.restore(state);
        state.before = None;
    }
}

/// Seeks the equilibrium at the start inputs, or checks that rest is where the scene starts.
pub(super) fn initialise(model: &Arc<Model>, state: &mut State, work: &mut Workspace) -> Result<StepReport, SimError> {
    if model.parts().inertia.as_ref().is_some_and(|i| i.start_at_rest) {
        check_inputs(model, &state.inputs)?;
        read_pivots(model, &state.inputs, &mut work.pivots);
        work.inputs.copy_from_slice(&state.inputs);
        place_bones(model, &work.inputs, &mut work.config);
        if let Some(bone) = (0..model.parts().bones.len()).find(|&b| work.config.poses[b] != Pose::REST) {
            return Err(SimError::NotAtRest(model.parts().bones[bone].name.clone()));
        }
        state.applied.copy_from_slice(&state.inputs);
        state.outputs.converged = true;
        set_off(model, state, work)?;
        work.kept.origin = Origin::Rest;
        return Ok(StepReport::new(0));
    }
    let report = advance(model, state, work, 0.0, None).map_err(|error| loose_start(model, error))?;
    // Nothing has moved yet: the way to the start equilibrium is no velocity.
    state.motion.halt();
    Ok(report)
}

/// Says what a dynamic scene can do about tissue that moves freely.
fn loose_start(model: &Model, error: SimError) -> SimError {
    match (&error, model.unconstrained()) {
        (SimError::Solve { source: SolveError::Singular { .. }, .. }, Some(loose)) => {
            SimError::LooseStart(loose.count, loose.x, loose.y, loose.z)
        }
        _ => error,
    }
}

/// Gives the tissue the acceleration that its forces make at rest, where the scheme remembers one.
fn set_off(model: &Model, state: &mut State, work: &mut Workspace) -> Result<(), SimError> {
    if model.is_reduced() {
        return modal::set_off(model, state, &mut work.minimiser, &mut work.modal);
    }
    let parts = model.parts();
    let Some(inertia) = parts.inertia.as_ref() else {
        return Ok(());
    };
    read_wrenches(model, &state.inputs, &mut work.wrenches);
    let Workspace { pivots, wrenches, inputs, history, .. } = work;
    history.copy_from_slice(&state.history);
    let at = At { t: state.t, inputs, history, x_tilde: &parts.mesh.nodes, ..At::NOWHERE };
    let problem = Problem { terms: &parts.terms, dofs: model.dofs(), X: &parts.mesh.nodes, pivots, wrenches, at };
    state.motion.a = accelerations(&problem, &state.config, &inertia.m);
    if matches!(inertia.scheme, Scheme::GeneralisedAlpha { .. }) {
        state.motion.memory.iter_mut().zip(&state.motion.a).for_each(|(memory, a)| memory[0] = *a);
    }
    Ok(())
}

/// Moves `state` on by `dt` seconds, or leaves it as it is; `watch` sees the state after each accepted piece but the last.
pub(super) fn advance(
    model: &Arc<Model>,
    state: &mut State,
    work: &mut Workspace,
    dt: f64,
    watch: Option<&mut dyn FnMut(&State)>,
) -> Result<StepReport, SimError> {
    let more = f64::from(state.most_solves)
        / f64::from(usual_solves(model.parts().inertia.as_ref(), model.parts().strategy.max_iterations));
    let most = MOST_OF_A_STEP * more.max(1.0) * work.minimiser.good_step();
    advance_within(model, state, work, dt, watch, most)
}

/// The same for the work of `most` linear solves, forces and factors counted by what they take of one.
fn advance_within(
    model: &Arc<Model>,
    state: &mut State,
    work: &mut Workspace,
    dt: f64,
    mut watch: Option<&mut dyn FnMut(&State)>,
    most: f64,
) -> Result<StepReport, SimError> {
    check_inputs(model, &state.inputs)?;
    if let Some(again) = work.refused.as_ref().filter(|refused| refused.dt == dt && refused.from == *state) {
        return Err(again.error.clone());
    }
    if let Some(report) = hold(model, state, dt) {
        return Ok(report);
    }
    if let Some(report) = look_up(model, state, work, dt)? {
        return Ok(report);
    }
    if let Some(report) = modal::advance(model, state, &mut work.minimiser, &mut work.modal, dt)? {
        work.kept.origin = Origin::Unknown; // tables of modes know it themselves
        return Ok(report);
    }
    read_pivots(model, &state.inputs, &mut work.pivots);
    work.config.copy_from(&state.config);
    work.motion.copy_from(&state.motion);
    work.history.copy_from_slice(&state.history);
    let mut report = StepReport::new(0);
    let taken_up = work.ahead.take_up(model, state, &mut work.minimiser, &mut work.factored);
    work.minimiser.share(&work.allowance);
    report.factorisations += u32::from(taken_up.is_some());
    let mut linearisation = taken_up.or_else(|| state.linearisation.clone());
    let pace = Pace::of(model.parts().inertia.as_ref()).filter(|_| dt > 0.0);
    let smallest = if pace.is_some() { Pace::SMALLEST } else { SMALLEST_PIECE };
    let (mut done, mut piece) = (0.0, 1.0);
    if pace.is_some() && state.motion.next_dt > 0.0 {
        piece = even_part(1.0, (state.motion.next_dt / dt).max(smallest));
    }
    // Beyond half a turn a pose does not say which way it came.
    let turn = largest_turn(model, state);
    let turn_part = if turn > MOST_TURN { even_part(1.0, (MOST_TURN / turn).max(smallest)) } else { 1.0 };
    let mut spent_before = 0;
    let mut surely = true;
    let least_before = match state.outputs.least {
        least if least.is_finite() => least,
        _ => min_det_f(model, &work.config.x),
    };
    let mut least = least_before;
    let only_bones = moves_only_bones(model, state);
    let is_free = state.inputs == state.applied;
    let good_step = work.minimiser.good_step();
    let work_at_start = work.minimiser.work();
    let (mut wasted, mut accepted_at) = (0.0, work_at_start);
    while done < 1.0 {
        let Workspace { pivots, config, inputs, before, .. } = &mut *work;
        let approach = Approach { model, from: &state.applied, to: &state.inputs, pivots, config, done, smallest };
        let (part, is_sure) = approach.part(inputs, before);
        surely &= is_sure;
        piece = piece.min(part).min(turn_part);
        let to: f64 = if done + piece >= 1.0 - ROUND_OFF { 1.0 } else { done + piece };
        for ((now, from), last) in work.inputs.iter_mut().zip(&state.applied).zip(&state.inputs) {
            *now = if to == 1.0 { *last } else { from + to * (last - from) };
        }
        read_wrenches(model, &work.inputs, &mut work.wrenches);
        // The piece starts from what the pieces before it left in `work`; a failed one is undone below.
        work.before.copy_from(&work.config);
        let linearised_before = linearisation.clone();
        let t = state.t + to * dt;
        let bound = pace.filter(|_| to - done > smallest);
        let work_before = work.minimiser.work();
        let ends_at = accepted_at + most;
        work.minimiser.set_limit(ends_at.min(work_before + MOST_OF_A_PIECE * good_step));
        let cut = Cut { t, dt: dt * (to - done), part: to - done, smallest, least, only_bones, is_free };
        match step_piece(model, work, &mut linearisation, &cut, bound, &mut report, &mut least) {
            Ok(()) => {
                report.substeps += 1;
                piece = GROWTH * (to - done);
                if let Some(pace) = &pace {
                    let error = work.time_error;
                    report.time_error = report.time_error.max(error);
                    piece = ((to - done) * pace.next(error)).max(smallest);
                    work.motion.next_dt = dt * piece;
                    piece = even_part(1.0 - to, piece);
                    (spent_before, accepted_at, wasted) = (report.iterations, work.minimiser.work(), 0.0);
                }
                if let Some(watch) = watch.as_mut().filter(|_| to < 1.0) {
                    watch(&halfway(model, state, work, &report, t, dt * (to - done)));
                }
                done = to;
            }
            Err(Setback::Gains) => {
                work.config.copy_from(&work.before);
                linearisation = linearised_before;
                work.motion.dt = none_before(dt * (to - done));
                if !std::mem::replace(&mut work.told_of_gain, true) {
                    report.warnings.push(GAINED.into());
                }
            }
            Err(Setback::Coarse(factor)) => {
                work.config.copy_from(&work.before);
                linearisation = linearised_before;
                piece = even_part(1.0 - done, (factor * (to - done)).max(smallest));
            }
            Err(Setback::Failed(source)) => {
                linearisation = linearised_before;
                piece = 0.5 * (to - done);
                report.iterations += source.iterations();
                let source = match source {
                    SolveError::NotConverged { .. } if done > 0.0 && work.minimiser.work() >= ends_at => {
                        SolveError::GivenUp { most, steps: most / good_step }
                    }
                    source => source,
                };
                wasted += work.minimiser.work() - work_before;
                let spent = report.iterations - spent_before;
                if source.is_final()
                    || piece < smallest
                    || !model.parts().strategy.has(Rung::Pieces)
                    || wasted >= MOST_WASTED * good_step
                    || work.minimiser.work() >= ends_at
                    || spent > BUDGET * model.parts().strategy.max_iterations
                {
                    let left = ends_at - work.minimiser.work();
                    let may_redo =
                        !source.is_final() && dt > 0.0 && left > 0.0 && is_way_from_rest_another(model, state);
                    let again = if may_redo { redo_from_rest(model, state, work, &report, dt, left)? } else { None };
                    if let Some(again) = again {
                        return Ok(again);
                    }
                    let cuts = (1.0 / (to - done)).round() as u32;
                    let place = worst_place(model, &work.config.x).map(Box::new);
                    let (spent, took) = (report.iterations, work.minimiser.work() - work_at_start);
                    let ended_by_host = source.is_ended_by_host();
                    let error =
                        SimError::Solve { t: state.t, dt, cuts, spent, work: took, reached: done, place, source };
                    // What the host has ended may have an answer.
                    if ended_by_host {
                        work.config.copy_from(&work.before);
                        return Err(error);
                    }
                    let x = work.config.x.clone();
                    work.refused = Some(Box::new(Refused { from: state.clone(), dt, error: error.clone(), x }));
                    return Err(error);
                }
                work.config.copy_from(&work.before);
            }
        }
    }
    if !model.folds() {
        least = min_det_f(model, &work.config.x);
    }
    warn_of_squeezing(model, least_before, least, &work.config.x, &mut report.warnings);
    if !surely {
        report.warnings.push("a contact's shape goes so far in this step that it may have passed tissue".into());
    }
    if let Some(pace) = pace.filter(|pace| !pace.holds(report.time_error)) {
        report.warnings.push(pace.broken(report.time_error));
    }
    warn_of_jumps(model, worst_jump(model, &state.config.x), worst_jump(model, &work.config.x), &mut report);
    state.t += dt;
    accept(model, state, work, &report, dt);
    state.outputs.least = least;
    state.linearisation = linearisation;
    let piece = work.last.expect("the step had a last piece");
    let Workspace { ahead, minimiser, config, inputs, remembered, x_tilde, kept, .. } = work;
    if model.remembers() {
        kept.take(&piece, remembered, x_tilde);
    }
    let at = At { t: piece.t, dt: piece.dt, inputs, history: remembered, x_tilde, ..At::NOWHERE };
    let end = || Linearisation::new(config, &at, piece.dt_before);
    state.upcoming = ahead.look(model, state.upcoming.take(), &report, minimiser, end);
    if let Some(moved) = hangs(model, state).filter(|_| dt > 0.0) {
        settle(model, state, work, &mut report, moved);
    }
    Ok(report)
}

/// Whether a step that has no answer from here may have one from rest: quasi-static tissue without a past, and shapes, which
/// may have come round the body, only where they are at rest again.
fn is_way_from_rest_another(model: &Model, state: &State) -> bool {
    let shapes = !model.parts().contacts.is_empty() && !are_at_rest(model, &state.inputs);
    !model.remembers() && !model.is_quadratic() && !shapes && !are_at_rest(model, &state.applied)
}

/// The step again from rest along the inputs for the work of `most` linear solves, told; `None` if that has no answer either.
///
/// # Errors
/// Where the host ends it.
fn redo_from_rest(
    model: &Arc<Model>,
    state: &mut State,
    work: &mut Workspace,
    so_far: &StepReport,
    dt: f64,
    most: f64,
) -> Result<Option<StepReport>, SimError> {
    let mut fresh = state.at_rest(model);
    let mut report = match advance_within(model, &mut fresh, work, 0.0, None, most) {
        Ok(report) => report,
        Err(SimError::Solve { source, .. }) if !source.is_final() => return Ok(None),
        Err(error) => return Err(error),
    };
    report.iterations += so_far.iterations;
    report.factorisations += so_far.factorisations;
    fresh.t += dt;
    (fresh.outputs.dt, fresh.outputs.iterations) = (dt, report.iterations);
    report.warnings.push(
        "no way was found from the last state: the answer is the one that the tissue reaches from rest under these inputs".into(),
    );
    *state = fresh;
    Ok(Some(report))
}

/// Takes tissue that hangs off rest, `moved` by so much (m) although every input is at rest, back where that is lower.
fn settle(model: &Arc<Model>, state: &mut State, work: &mut Workspace, report: &mut StepReport, moved: f64) {
    let mut fresh = state.at_rest(model);
    let elastic = |state: &State| strain(model, state, &state.config.x).energy;
    let is_lower = match advance(model, &mut fresh, work, 0.0, None) {
        Ok(way) => {
            report.iterations += way.iterations;
            report.factorisations += way.factorisations;
            if is_same_place(model, &fresh, state) {
                // Rest is no equilibrium: a shape of a contact pushes there, say.
                return;
            }
            elastic(&fresh) < elastic(state)
        }
        Err(_) => false,
    };
    let what = format!("every input is at rest, but the tissue came to hang up to {:.3} mm off", 1e3 * moved);
    if !is_lower {
        report.warnings.push(format!("{what}: it keeps {:.2e} J in an equilibrium of its own", elastic(state)));
        return;
    }
    report.warnings.push(format!(
        "{what}, in an equilibrium of {:.2e} J: it was taken back to rest, which is lower; the way there and back was not \
         one that tissue could have gone (smaller steps, or a law that resists collapse, find it)",
        elastic(state)
    ));
    fresh.outputs.dt = state.outputs.dt;
    *state = fresh;
}

/// The largest change of a bone's rotation vector in the step that `state` is about to make, rad.
fn largest_turn(model: &Model, state: &State) -> f64 {
    let Some(first) = model.parts().layout.first(Slot::BoneRotation) else { return 0.0 };
    let of = |b: usize| input3(&state.inputs, Some(first), b) - input3(&state.applied, Some(first), b);
    (0..model.parts().bones.len()).map(|b| of(b).norm()).fold(0.0, f64::max)
}

/// Whether nothing but bones that are driven by pose or node by node moves in the step that `state` is about to make.
fn moves_only_bones(model: &Model, state: &State) -> bool {
    let layout = &model.parts().layout;
    let bones = &model.parts().bones;
    let within = |slot: Slot, nodes: usize, k: usize| {
        layout.first(slot).is_some_and(|first| (first..first + 3 * nodes).contains(&k))
    };
    let moves_a_bone = |k: usize| {
        [Slot::BoneTranslation, Slot::BoneRotation].into_iter().any(|slot| within(slot, bones.len(), k))
            || bones.iter().enumerate().any(|(b, bone)| within(Slot::BoneNodal(b as u32), bone.nodes.len(), k))
    };
    (0..state.inputs.len()).filter(|&k| state.inputs[k] != state.applied[k]).all(moves_a_bone)
}

/// Takes over where `work` has come to.
fn accept(model: &Model, state: &mut State, work: &Workspace, report: &StepReport, dt: f64) {
    state.config.copy_from(&work.config);
    state.motion.copy_from(&work.motion);
    state.history.copy_from_slice(&work.history);
    state.applied.copy_from_slice(&work.inputs);
    read_outputs(model, state, work, report, dt);
}

/// The state in the middle of a step, after a piece of `dt` seconds that ended at `t`.
fn halfway(model: &Model, state: &State, work: &Workspace, report: &StepReport, t: f64, dt: f64) -> State {
    let mut there = state.clone();
    there.t = t;
    accept(model, &mut there, work, report, dt);
    there
}

/// A step on which nothing acts: an equilibrium stays where it is while its inputs do.
fn hold(model: &Model, state: &mut State, dt: f64) -> Option<StepReport> {
    let settled = state.outputs.converged && (state.linearisation.is_some() || state.partial);
    if !(dt > 0.0 && settled && !model.remembers() && state.inputs == state.applied) {
        return None;
    }
    let mut report = StepReport::new(1);
    report.residual = state.outputs.residual;
    state.t += dt;
    (state.outputs.iterations, state.outputs.dt) = (0, dt);
    Some(report)
}

/// A step of a scene that is linear in its inputs: read off its table; `None` where that cannot be done.
fn look_up(model: &Model, state: &mut State, work: &mut Workspace, dt: f64) -> Result<Option<StepReport>, SimError> {
    let mut report = StepReport::new(1);
    let serves = match &work.table {
        Table::None => return Ok(None),
        Table::Unknown => false,
        Table::Made(map) => map.serves(&state.inputs),
    };
    if !serves {
        complete(model, state, work);
        work.factored = None;
        let made = LinearMap::new(model, &mut work.minimiser, &state.inputs);
        let refused = |source| SimError::Solve {
            t: state.t,
            dt,
            cuts: 1,
            spent: report.iterations,
            work: 0.0,
            reached: 0.0,
            place: None,
            source,
        };
        let Some((map, solves)) = made.map_err(refused)? else {
            work.table = Table::None;
            return Ok(None);
        };
        report.iterations = solves;
        report.factorisations = 1;
        work.table = Table::Made(Box::new(map));
    }
    place_bones(model, &state.inputs, &mut work.config);
    let Table::Made(map) = &mut work.table else {
        return Ok(None);
    };
    map.set(model, &state.inputs, &work.config.poses);
    let [residual, correction, strain_bound] = map.bounds();
    if !(residual.is_finite() && correction <= model.parts().strategy.tolerance) {
        // Inputs so large that the table's round-off shows.
        map.set(model, &state.applied, &state.config.poses);
        complete(model, state, work);
        return Ok(None);
    }
    let before = worst_jump(model, &state.config.x);
    read_pivots(model, &state.inputs, &mut work.pivots);
    if work.look.is_due(strain_bound) {
        map.place_whole(model, &state.inputs, &work.pivots, &mut work.config);
        work.look.take(model, strain_bound, &work.config.x, &mut report.warnings);
    }
    state.config.poses.copy_from_slice(&work.config.poses);
    map.place_seen(model, &state.inputs, &work.pivots, &mut state.config);
    state.partial = true;
    state.outputs.least = State::UNSEEN;
    warn_of_jumps(model, before, worst_jump(model, &state.config.x), &mut report);
    state.t += dt;
    state.applied.copy_from_slice(&state.inputs);
    let o = &mut state.outputs;
    for (b, (force, torque)) in o.reaction_force.iter_mut().zip(&mut o.reaction_torque).enumerate() {
        (*force, *torque) = map.reaction(model, &state.applied, b, &state.config.poses[b]);
    }
    (report.residual, report.correction) = (residual, correction);
    (o.iterations, o.residual, o.converged, o.dt) = (report.iterations, residual, true, dt);
    Ok(Some(report))
}

/// Puts all nodes of a state that was read off the table where they belong, not only those that ports read.
pub(super) fn complete(model: &Model, state: &mut State, work: &Workspace) {
    modal::complete(model, state, &work.modal);
    if let (true, Table::Made(map)) = (state.partial, &work.table) {
        let mut pivots = vec![Vec3::zeros(); model.parts().bones.len()];
        read_pivots(model, &state.applied, &mut pivots);
        map.place_whole(model, &state.applied, &pivots, &mut state.config);
        state.partial = false;
    }
}

/// As [`modal::start_from`].
pub(super) fn start_from(model: &Model, state: &mut State, work: &mut Workspace, x: &[Vec3]) -> Result<bool, SimError> {
    modal::start_from(model, state, &mut work.minimiser, &mut work.modal, x)
}

/// As [`modal::spectrum`].
pub(super) fn spectrum(model: &Model, state: &State, work: &mut Workspace) -> Result<Option<Spectrum>, SimError> {
    modal::spectrum(model, state, &mut work.minimiser, &mut work.modal)
}

impl StepReport {
    pub(super) fn new(substeps: u32) -> StepReport {
        StepReport {
            iterations: 0,
            factorisations: 0,
            substeps,
            time_error: 0.0,
            residual: 0.0,
            correction: 0.0,
            converged: true,
            warnings: Vec::new(),
        }
    }

    fn count(&mut self, outcome: &Outcome) {
        self.iterations += outcome.iterations;
        self.factorisations += outcome.factorisations;
        self.residual = outcome.residual;
        self.correction = outcome.correction;
    }
}

/// Why a piece of a step is not taken.
enum Setback {
    /// It has no answer.
    Failed(SolveError),
    /// It should be cut to this part of it for the sake of accuracy.
    Coarse(f64),
    /// It gains energy that nobody gave it.
    Gains,
}

impl From<SolveError> for Setback {
    fn from(source: SolveError) -> Setback {
        Setback::Failed(source)
    }
}

/// A piece of a step as it is tried.
struct Cut {
    /// Its end, s.
    t: f64,
    /// Its length, s.
    dt: f64,
    /// Its part of the step.
    part: f64,
    /// The smallest part that a step is cut into.
    smallest: f64,
    /// Smallest det F where it starts; a bound where no element can turn inside out.
    least: f64,
    /// Whether nothing but bones moves in it.
    only_bones: bool,
    /// Whether no input changes.
    is_free: bool,
}

/// One piece of a step, from and into `work`; `bound` by an accuracy if it may still be cut. The smallest det F where it ends
/// goes into `least`.
fn step_piece(
    model: &Model,
    work: &mut Workspace,
    linearisation: &mut Option<Arc<Linearisation>>,
    cut: &Cut,
    bound: Option<Pace>,
    report: &mut StepReport,
    least: &mut f64,
) -> Result<(), Setback> {
    let Cut { t, dt, part: piece, .. } = *cut;
    let parts = model.parts();
    let strategy = &parts.strategy;
    let dofs = model.dofs();
    let Workspace {
        minimiser,
        factored,
        config,
        before,
        motion,
        time_error,
        last,
        history,
        remembered,
        inputs,
        x_tilde,
        pivots,
        u,
        wrenches,
        ..
    } = work;
    *last = None;
    let at = At { t, dt, inputs, history, ..At::NOWHERE };
    let is_inverted = |x: &[Vec3]| min_det_f(model, x) <= 0.0;
    let mut inverted_before = cut.least <= 0.0;
    // A start that no step has led to may be tangled.
    let untangled =
        linearisation.is_none() && !model.is_quadratic() && strategy.has(Rung::StandIn) && is_inverted(&config.x);
    if untangled {
        let outcome = untangle(model, pivots, minimiser.allowance(), config)?;
        report.iterations += outcome.iterations;
        report.factorisations += outcome.factorisations;
        inverted_before = is_inverted(&config.x);
    }

    place_bones(model, inputs, config);
    target_increments(model, inputs, pivots, config, u);
    let formula =
        parts.inertia.as_ref().filter(|_| dt > 0.0).map(|i| (i.damping_mass, i.scheme.formula(dt, motion.dt)));
    if let Some((damping, formula)) = &formula {
        motion.predict(formula, *damping, dofs, &before.x, u, x_tilde);
    }
    let at = At { x_tilde, ..in_time(model, at, motion.dt) };
    let problem = Problem { terms: &parts.terms, dofs, X: &parts.mesh.nodes, pivots, wrenches, at };
    restore_factor(model, &problem, motion.dt, minimiser, factored, linearisation, config, report)?;
    if !problem.is_quadratic() {
        if (dt == 0.0 || parts.inertia.is_none()) && strategy.has(Rung::RigidMotion) {
            move_along(dofs.prescribed.as_slice(), config, u);
        }
        minimiser.set_frame(frame(factored.as_deref(), config));
    }
    let factorings = minimiser.factorings();
    let potential = minimiser.predict(&problem, config, u);
    let is_pushed = !problem.is_quadratic() && !untangled && u.iter().all(|u| *u == Vec3::zeros());
    if is_pushed && piece == 1.0 && !model.remembers() {
        check_reach(&before.x, &config.x)?;
    }
    let bones_work = |minimiser: &Minimiser| -> f64 {
        let g = minimiser.nodal_gradient();
        dofs.prescribed.iter().zip(&*u).map(|(&a, u)| g[a as usize].dot(u)).sum()
    };
    let work_before = bones_work(minimiser);
    report.iterations += 1;
    let may_cut = piece > if parts.may_invert { SMALLEST_TO_AVOID_INVERSION } else { cut.smallest };
    let avoid_inversion = !problem.is_quadratic() && model.folds() && strategy.has(Rung::Inversion) && !inverted_before;
    let way = match (avoid_inversion, may_cut) {
        (false, _) => Way::Any,
        (true, false) => Way::Watched(model.clearance()),
        (true, true) => Way::Upright(model.clearance()),
    };
    let outcome = match minimiser.minimise_by(way, &problem, config) {
        // A small piece of load alone, predicted beyond what the law allows: go there from where the tissue is.
        Err(SolveError::NotFinite) if is_pushed && piece <= SMALLEST_TO_PREDICT => {
            config.copy_from(before);
            minimiser.minimise_by(way, &problem, config)
        }
        outcome => outcome,
    };
    // A piece that is not taken may leave another factor behind than the state remembers.
    let outcome = outcome.inspect_err(|_| {
        if minimiser.factorings() != factorings {
            *factored = None;
        }
    })?;
    report.count(&outcome);
    if model.folds() {
        *least = min_det_f(model, &config.x);
    }
    if avoid_inversion && *least <= 0.0 && (may_cut || !parts.may_invert) {
        *factored = None;
        return Err(SolveError::Inverts { iterations: 0 }.into());
    }
    if outcome.crossed && *least > 0.0 {
        tell(
            report,
            "the way to this state leads through elements turned inside out, even in the smallest piece: it may not \
                      be the one that the tissue would have taken; smaller steps or a law that resists collapse (the \
                      default) decide it",
        );
    }
    // What a shape lets go of is no snap.
    if cut.only_bones
        && parts.contacts.is_empty()
        && !problem.is_quadratic()
        && !model.remembers()
        && !untangled
        && dt > 0.0
    {
        let work = [work_before, bones_work(minimiser)];
        let balance = Balance { before: potential, work, after: outcome.energy };
        let elastic = |x: &[Vec3]| parts.terms.iter().map(|t| t.strain(&at, x).energy).sum();
        if let Some(message) = snapped(&balance, &before.x, &config.x, elastic) {
            tell(report, &message);
        }
    }
    let mut free = None;
    if let Some((_, formula)) = formula.as_ref().filter(|_| cut.is_free) {
        let swing = Swing { model, problem: &problem, motion, formula };
        if swing.is_watched() {
            free = swing.judge(before, config, [potential, outcome.energy]);
            if free.is_none() && motion.dt != none_before(dt) {
                *factored = None;
                return Err(Setback::Gains);
            }
        }
    }
    check_depth(model, &before.x, &config.x).inspect_err(|_| *factored = None)?;
    if parts.inertia.as_ref().is_some_and(|i| i.accuracy.is_some()) {
        let error = formula.as_ref().map_or(0.0, |(_, formula)| motion.error(formula, dofs, before, config));
        if let Some(pace) = bound.filter(|pace| !pace.holds(error)) {
            *factored = None;
            return Err(Setback::Coarse(pace.next(error)));
        }
        *time_error = error;
    }
    if outcome.factorisations > 0 {
        let made = Arc::new(Linearisation::new(minimiser.factored_at(), &at, motion.dt));
        *factored = Some(made.clone());
        *linearisation = Some(made);
    }
    if !history.is_empty() {
        remembered.copy_from_slice(history);
        parts.terms.iter().filter(|t| t.remembers()).for_each(|t| t.commit(&at, &config.x, remembered));
        std::mem::swap(history, remembered);
    }
    *last = Some(Piece { number: 0, t, dt, dt_before: motion.dt });
    if let Some((_, formula)) = &formula {
        motion.arrive(formula, dt, dofs, before, config);
        motion.free = free;
    }
    Ok(())
}

/// Refuses loads under which the stiffness at hand would let the tissue go by many of its sizes: no law stiffens that much.
fn check_reach(before: &[Vec3], predicted: &[Vec3]) -> Result<(), SolveError> {
    let motion = before.iter().zip(predicted).map(|(x, y)| (y - x).norm()).fold(0.0, f64::max);
    let (low, high) = before.iter().fold((before[0], before[0]), |(l, h), x| (l.inf(x), h.sup(x)));
    let most = MOST_REACH * (high - low).norm();
    // What is no number is told by the minimiser.
    if motion > most { Err(SolveError::BeyondReach { motion, most }) } else { Ok(()) }
}

/// Adds a warning that is not there yet.
fn tell(report: &mut StepReport, message: &str) {
    if !report.warnings.iter().any(|warning| warning == message) {
        report.warnings.push(message.into());
    }
}

/// `at` with the coefficients of the scene's scheme, after a piece of `dt_before`.
pub(super) fn in_time<'a>(model: &Model, at: At<'a>, dt_before: f64) -> At<'a> {
    match &model.parts().inertia {
        Some(i) if at.dt > 0.0 => At {
            inertia: i.scheme.formula(at.dt, dt_before).coefficient(i.damping_mass),
            difference: i.scheme.difference(at.dt, dt_before),
            ..at
        },
        _ => at,
    }
}

/// Makes the minimiser's factor the one the state remembers, or a new one at `config` if there is none that serves.
#[allow(clippy::too_many_arguments)] // the halves of a workspace
fn restore_factor(
    model: &Model,
    problem: &Problem,
    dt_before: f64,
    minimiser: &mut Minimiser,
    factored: &mut Option<Arc<Linearisation>>,
    linearisation: &mut Option<Arc<Linearisation>>,
    config: &Configuration,
    report: &mut StepReport,
) -> Result<(), SolveError> {
    let dt = problem.at.dt;
    let near = |a: f64, b: f64| a == b || a != 0.0 && b != 0.0 && (a / b).ln().abs() <= DT_DRIFT;
    // Tunable moduli come first among the inputs; a stiffness that is never made anew must be of these very ones.
    let tunable = 0..model.parts().tunable.len();
    let as_stiff = |l: &Linearisation| {
        let mut moduli = l.inputs[tunable.clone()].iter().zip(&problem.at.inputs[tunable.clone()]);
        moduli.all(|(made, now)| made == now || !problem.is_quadratic() && (made / now).ln().abs() <= MODULUS_DRIFT)
    };
    let serves = |l: &Linearisation| {
        as_stiff(l)
            && (!model.remembers() || near(l.dt, dt) && near(l.at(model).inertia.sqrt(), problem.at.inertia.sqrt()))
    };
    if let Some(wanted) = linearisation.as_ref().filter(|l| serves(l)) {
        let same = factored.as_ref().is_some_and(|f| Arc::ptr_eq(f, wanted) || f == wanted);
        if !(same && minimiser.is_factored()) {
            *factored = None;
            with_problem(model, wanted.at(model), |made| minimiser.linearise(made, &wanted.config))?;
            *factored = Some(wanted.clone());
        }
        return Ok(());
    }
    *factored = None;
    minimiser.linearise(problem, config)?;
    report.factorisations += 1;
    let made = Arc::new(Linearisation::new(config, &problem.at, dt_before));
    *factored = Some(made.clone());
    *linearisation = Some(made);
    Ok(())
}

/// Rotation of the tissue since the factor was made.
fn frame(factored: Option<&Linearisation>, config: &Configuration) -> Mat3 {
    let Some(l) = factored else {
        return Mat3::identity();
    };
    let (R, ..) = best_fit(l.config.x.iter().copied(), config.x.iter().copied());
    // |R - I|^2 = 2 angle^2 for small angles.
    if (R - Mat3::identity()).norm_squared() < 2.0 * FRAME_THRESHOLD { Mat3::identity() } else { R }
}

/// Moves everything along with the bones where they move as one; `u` keeps what is left of their motion.
fn move_along(prescribed: &[u32], config: &mut Configuration, u: &mut [Vec3]) {
    let from = prescribed.iter().map(|&a| config.x[a as usize]);
    let to = prescribed.iter().zip(&*u).map(|(&a, u)| config.x[a as usize] + u);
    let (R, a, c) = best_fit(from.clone(), to.clone());
    let moved = |x: Vec3| c + R * (x - a);
    let left: f64 = from.zip(to).map(|(x, y)| (y - moved(x)).norm_squared()).sum();
    let all: f64 = u.iter().map(|u| u.norm_squared()).sum();
    if all == 0.0 || left > RIGID_REMAINDER * RIGID_REMAINDER * all {
        return;
    }
    for (u, &p) in u.iter_mut().zip(prescribed) {
        let x = config.x[p as usize];
        *u = x + *u - moved(x);
    }
    for x in &mut config.x {
        *x = moved(*x);
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

fn input3(inputs: &[f64], first: Option<usize>, row: usize) -> Vec3 {
    first.map_or(Vec3::zeros(), |f| Vec3::from_column_slice(&inputs[f + 3 * row..f + 3 * row + 3]))
}

pub(super) fn read_pivots(model: &Model, inputs: &[f64], pivots: &mut [Vec3]) {
    let first = model.parts().layout.first(Slot::BonePivot);
    for (b, pivot) in pivots.iter_mut().enumerate() {
        *pivot = input3(inputs, first, b);
    }
}

pub(super) fn read_wrenches(model: &Model, inputs: &[f64], wrenches: &mut [(Vec3, Vec3)]) {
    let layout = &model.parts().layout;
    let (force, torque) = (layout.first(Slot::BoneForce), layout.first(Slot::BoneTorque));
    for (body, wrench) in model.dofs().bodies.iter().zip(wrenches) {
        *wrench = (input3(inputs, force, body.bone), input3(inputs, torque, body.bone));
    }
}

/// Writes the poses that the inputs ask for; nodes stay where they are.
pub(super) fn place_bones(model: &Model, inputs: &[f64], config: &mut Configuration) {
    let layout = &model.parts().layout;
    let (translation, rotation) = (layout.first(Slot::BoneTranslation), layout.first(Slot::BoneRotation));
    for (b, bone) in model.parts().bones.iter().enumerate() {
        if bone.drive == Drive::Pose {
            config.poses[b] = Pose::new(input3(inputs, translation, b), &input3(inputs, rotation, b));
        }
    }
}

/// Where the inputs want the k-th node of a bone that has the given pose.
pub(super) fn target(model: &Model, inputs: &[f64], pivots: &[Vec3], poses: &[Pose], b: usize, k: usize) -> Vec3 {
    let parts = model.parts();
    let bone = &parts.bones[b];
    let X = &parts.mesh.nodes[bone.nodes[k] as usize];
    match bone.drive {
        Drive::Displacement => X + input3(inputs, parts.layout.first(Slot::BoneNodal(b as u32)), k),
        _ => poses[b].place(&pivots[b], X),
    }
}

/// `u`: how far each prescribed node has to go.
pub(super) fn target_increments(
    model: &Model,
    inputs: &[f64],
    pivots: &[Vec3],
    config: &Configuration,
    u: &mut [Vec3],
) {
    for (b, bone) in model.parts().bones.iter().enumerate() {
        for (k, &a) in bone.nodes.iter().enumerate() {
            let crate::fem::Role::Prescribed(p) = model.dofs().role[a as usize] else {
                continue;
            };
            u[p as usize] = target(model, inputs, pivots, &config.poses, b, k) - config.x[a as usize];
        }
    }
}

/// Every input must be finite, and none may ask a bone for what its drive does not do.
fn check_inputs(model: &Model, inputs: &[f64]) -> Result<(), SimError> {
    if let Some((k, value)) = inputs.iter().enumerate().find(|(_, v)| !v.is_finite()) {
        return Err(SimError::NotFinite { name: model.input_name(k), value: *value });
    }
    let parts = model.parts();
    if let Some(k) = (0..parts.tunable.len()).find(|&k| inputs[k] <= 0.0) {
        return Err(SimError::NotPositive { name: model.input_name(k), value: inputs[k] });
    }
    let drives = [Slot::BoneTranslation, Slot::BoneRotation, Slot::BoneForce, Slot::BoneTorque];
    for first in drives.iter().filter_map(|slot| parts.layout.first(*slot)) {
        for k in (first..first + 3 * parts.bones.len()).filter(|&k| inputs[k] != 0.0) {
            bone_of_input(model, k, inputs[k])?;
        }
    }
    Ok(())
}

/// Whether the bone that input `k` belongs to, if to any, is driven by it.
///
/// # Errors
/// [`SimError::NotDriven`] if it is not.
pub(super) fn bone_of_input(model: &Model, k: usize, value: f64) -> Result<(), SimError> {
    let parts = model.parts();
    let drives = [
        (Slot::BoneTranslation, Drive::Pose),
        (Slot::BoneRotation, Drive::Pose),
        (Slot::BoneForce, Drive::Force),
        (Slot::BoneTorque, Drive::Force),
    ];
    for (slot, drive) in drives {
        let within = parts.layout.first(slot).and_then(|first| k.checked_sub(first));
        let Some(bone) = within.and_then(|within| parts.bones.get(within / 3)) else { continue };
        if bone.drive != drive {
            let (name, bone, drive) = (model.input_name(k), bone.name.clone(), bone.drive);
            return Err(SimError::NotDriven { name, value, bone, drive });
        }
        return Ok(());
    }
    Ok(())
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

/// Reactions, energies and diagnostics of the accepted step.
fn read_outputs(model: &Model, state: &mut State, work: &Workspace, report: &StepReport, dt: f64) {
    let parts = model.parts();
    let g = work.minimiser.nodal_gradient();
    let o = &mut state.outputs;
    for (b, bone) in parts.bones.iter().enumerate() {
        let pivot = work.pivots[b] + state.config.poses[b].t;
        let (mut force, mut torque) = (Vec3::zeros(), Vec3::zeros());
        for &a in &bone.nodes {
            let f = -g[a as usize];
            force += f;
            torque += (state.config.x[a as usize] - pivot).cross(&f);
        }
        o.reaction_force[b] = force;
        o.reaction_torque[b] = torque;
    }
    o.iterations = report.iterations;
    o.residual = report.residual;
    o.converged = report.converged;
    o.dt = dt;
    o.kinetic = parts.inertia.as_ref().map_or(0.0, |inertia| {
        0.5 * inertia.m.iter().zip(&state.motion.v).map(|(m, v)| m * v.norm_squared()).sum::<f64>()
    });
}
