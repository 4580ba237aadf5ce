//! A step in pieces: how it is cut where it has no answer in one, what it may cost, and what it must not hide. All or nothing.

use std::sync::Arc;

use super::approach::Approach;
use super::audit::{
    hangs, is_same_place, min_det_f, strain, warn_of_jumps, warn_of_squeezing, worst_jump, worst_place,
};
use super::linearisation::Linearisation;
use super::model::{Model, usual_solves};
use super::pace::{Pace, even_part};
use super::piece::{Cut, Setback, step_piece};
use super::report::StepReport;
use super::state::{State, are_at_rest};
use super::swing::{GAINED, none_before};
use super::targets::{largest_turn, moves_only_bones, read_pivots, read_wrenches};
use super::workspace::{Refused, Workspace};
use super::{SimError, SolveError};
use crate::fem::At;
use crate::math::Vec3;
use crate::solve::Rung;

/// A step is cut into pieces no smaller than this part of it.
const SMALLEST_PIECE: f64 = 1.0 / 64.0;

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

/// After a piece that succeeded the next one may be this much larger.
const GROWTH: f64 = 2.0;

/// Largest turn of a bone that a piece of a step makes, rad; a right angle and some go in one.
const MOST_TURN: f64 = 2.2;

/// A step under way: what was found so far. Where it stands lies in the workspace; the state is as before until it ends.
pub(super) struct Run {
    /// Length of the step, s.
    dt: f64,
    /// The work that it may take, in linear solves, and what it has taken when it began and when a piece that counts alone ended.
    most: f64,
    work_at_start: f64,
    accepted_at: f64,
    /// That of a good step, and what was spent on pieces without an answer.
    good_step: f64,
    wasted: f64,
    /// Linear solves when a piece that counts alone ended.
    spent_before: u32,
    report: StepReport,
    linearisation: Option<Arc<Linearisation>>,
    pace: Option<Pace>,
    /// Parts of the step: done, the next one, the smallest, and the largest by which no bone turns too far.
    done: f64,
    piece: f64,
    smallest: f64,
    turn_part: f64,
    /// Whether no shape of a contact went further at once than is safe.
    surely: bool,
    /// Smallest det F where the step began and where it stands.
    least_before: f64,
    least: f64,
    only_bones: bool,
    is_free: bool,
}

/// How far a step has come.
pub(super) enum Progress {
    /// To the end of a piece that is not the last: the state there.
    Piece(Box<State>),
    /// To its end, which is in the state.
    Done(StepReport),
}

/// Moves `state` on by `dt` seconds for the work of at most `most` linear solves, or leaves it as it is.
pub(super) fn run(
    model: &Arc<Model>,
    state: &mut State,
    work: &mut Workspace,
    dt: f64,
    most: f64,
) -> Result<StepReport, SimError> {
    let mut run = Run::begin(model, state, work, dt, most);
    loop {
        if let Progress::Done(report) = run.go_on(model, state, work, false)? {
            return Ok(report);
        }
    }
}

/// Work that a step may take, in linear solves; a host that allows more of these than usual allows more.
pub(super) fn most_work(model: &Model, state: &State, work: &Workspace) -> f64 {
    let parts = model.parts();
    let usual = usual_solves(parts.inertia.as_ref(), parts.strategy.max_iterations);
    let more = f64::from(state.most_solves) / f64::from(usual);
    MOST_OF_A_STEP * more.max(1.0) * work.minimiser.good_step()
}

impl Run {
    /// From where `state` stands towards its inputs.
    pub fn begin(model: &Arc<Model>, state: &mut State, work: &mut Workspace, dt: f64, most: f64) -> Run {
        read_pivots(model, &state.inputs, &mut work.pivots);
        work.config.copy_from(&state.config);
        work.motion.copy_from(&state.motion);
        work.history.copy_from_slice(&state.history);
        let mut report = StepReport::new(0);
        let taken_up = work.ahead.take_up(model, state, &mut work.minimiser, &mut work.factored);
        work.minimiser.share(&work.allowance);
        report.factorisations += u32::from(taken_up.is_some());
        let linearisation = taken_up.or_else(|| state.linearisation.clone());
        let pace = Pace::of(model.parts().inertia.as_ref()).filter(|_| dt > 0.0);
        let smallest = if pace.is_some() { Pace::SMALLEST } else { SMALLEST_PIECE };
        let mut piece = 1.0;
        if pace.is_some() && state.motion.next_dt > 0.0 {
            piece = even_part(1.0, (state.motion.next_dt / dt).max(smallest));
        }
        // Beyond half a turn a pose does not say which way it came.
        let turn = largest_turn(model, state);
        let turn_part = if turn > MOST_TURN { even_part(1.0, (MOST_TURN / turn).max(smallest)) } else { 1.0 };
        let least = match state.outputs.least {
            least if least.is_finite() => least,
            _ => min_det_f(model, &work.config.x),
        };
        let work_at_start = work.minimiser.work();
        Run {
            dt,
            most,
            work_at_start,
            accepted_at: work_at_start,
            good_step: work.minimiser.good_step(),
            wasted: 0.0,
            spent_before: 0,
            report,
            linearisation,
            pace,
            done: 0.0,
            piece,
            smallest,
            turn_part,
            surely: true,
            least_before: least,
            least,
            only_bones: moves_only_bones(model, state),
            is_free: state.inputs == state.applied,
        }
    }

    /// Goes on to the end of the step, or, if somebody watches, of the next piece. After an error there is no way on.
    pub fn go_on(
        &mut self,
        model: &Arc<Model>,
        state: &mut State,
        work: &mut Workspace,
        is_watched: bool,
    ) -> Result<Progress, SimError> {
        while self.done < 1.0 {
            let to = self.aim(model, state, work);
            // The piece starts from what the pieces before it left in `work`; a failed one is undone below.
            work.before.copy_from(&work.config);
            let linearised_before = self.linearisation.clone();
            let Run { dt, done, smallest, least, only_bones, is_free, .. } = *self;
            let cut = Cut {
                t: state.t + to * dt,
                dt: dt * (to - done),
                part: to - done,
                smallest,
                least,
                only_bones,
                is_free,
            };
            let bound = self.pace.filter(|_| to - done > smallest);
            let work_before = work.minimiser.work();
            work.minimiser.set_limit(self.ends_at().min(work_before + MOST_OF_A_PIECE * self.good_step));
            let Run { linearisation, report, least, .. } = self;
            match step_piece(model, work, linearisation, &cut, bound, report, least) {
                Ok(()) => {
                    self.accept_piece(work, to);
                    if is_watched && to < 1.0 {
                        return Ok(Progress::Piece(Box::new(halfway(model, state, work, &self.report, cut.t, cut.dt))));
                    }
                }
                Err(Setback::Gains) => {
                    work.config.copy_from(&work.before);
                    self.linearisation = linearised_before;
                    work.motion.dt = none_before(cut.dt);
                    if !std::mem::replace(&mut work.told_of_gain, true) {
                        self.report.warnings.push(GAINED.into());
                    }
                }
                Err(Setback::Coarse(factor)) => {
                    work.config.copy_from(&work.before);
                    self.linearisation = linearised_before;
                    self.piece = even_part(1.0 - done, (factor * cut.part).max(smallest));
                }
                Err(Setback::Failed(source)) => {
                    self.linearisation = linearised_before;
                    self.piece = 0.5 * cut.part;
                    self.report.iterations += source.iterations();
                    self.wasted += work.minimiser.work() - work_before;
                    if self.gives_up(model, work, &source) {
                        return self.end_without(model, state, work, &cut, source);
                    }
                    work.config.copy_from(&work.before);
                }
            }
        }
        self.finish(model, state, work)
    }

    /// The work at which the step ends, whatever it has found.
    fn ends_at(&self) -> f64 {
        self.accepted_at + self.most
    }

    /// Where the next piece ends, as part of the step; its inputs go into `work`.
    fn aim(&mut self, model: &Model, state: &State, work: &mut Workspace) -> f64 {
        let Run { done, smallest, .. } = *self;
        let Workspace { pivots, config, inputs, before, .. } = &mut *work;
        let approach = Approach { model, from: &state.applied, to: &state.inputs, pivots, config, done, smallest };
        let (part, is_sure) = approach.part(inputs, before);
        self.surely &= is_sure;
        self.piece = self.piece.min(part).min(self.turn_part);
        let to: f64 = if done + self.piece >= 1.0 - ROUND_OFF { 1.0 } else { done + self.piece };
        for ((now, from), last) in work.inputs.iter_mut().zip(&state.applied).zip(&state.inputs) {
            *now = if to == 1.0 { *last } else { from + to * (last - from) };
        }
        read_wrenches(model, &work.inputs, &mut work.wrenches);
        to
    }

    /// The piece that ends at `to` is taken.
    fn accept_piece(&mut self, work: &mut Workspace, to: f64) {
        let part = to - self.done;
        self.report.substeps += 1;
        self.piece = GROWTH * part;
        if let Some(pace) = &self.pace {
            let error = work.time_error;
            self.report.time_error = self.report.time_error.max(error);
            let next = (part * pace.next(error)).max(self.smallest);
            work.motion.next_dt = self.dt * next;
            self.piece = even_part(1.0 - to, next);
            (self.spent_before, self.accepted_at, self.wasted) = (self.report.iterations, work.minimiser.work(), 0.0);
        }
        self.done = to;
    }

    /// Whether no smaller piece is tried after one that had no answer.
    fn gives_up(&self, model: &Model, work: &Workspace, source: &SolveError) -> bool {
        let strategy = &model.parts().strategy;
        source.is_final()
            || self.piece < self.smallest
            || !strategy.has(Rung::Pieces)
            || self.wasted >= MOST_WASTED * self.good_step
            || work.minimiser.work() >= self.ends_at()
            || self.report.iterations - self.spent_before > BUDGET * strategy.max_iterations
    }

    /// The step again from rest where that may help; else what is said of it, and kept, so that it is not tried again.
    fn end_without(
        &mut self,
        model: &Arc<Model>,
        state: &mut State,
        work: &mut Workspace,
        cut: &Cut,
        source: SolveError,
    ) -> Result<Progress, SimError> {
        let Run { dt, done, most, good_step, .. } = *self;
        let left = self.ends_at() - work.minimiser.work();
        let source = match source {
            SolveError::NotConverged { .. } if done > 0.0 && left <= 0.0 => {
                SolveError::GivenUp { most, steps: most / good_step }
            }
            source => source,
        };
        let may_redo = !source.is_final() && dt > 0.0 && left > 0.0 && is_way_from_rest_another(model, state);
        if may_redo && let Some(again) = redo_from_rest(model, state, work, &self.report, dt, left)? {
            return Ok(Progress::Done(again));
        }
        let cuts = (1.0 / cut.part).round() as u32;
        let place = worst_place(model, &work.config.x).map(Box::new);
        let (spent, took) = (self.report.iterations, work.minimiser.work() - self.work_at_start);
        let ended_by_host = source.is_ended_by_host();
        let error = SimError::Solve { t: state.t, dt, cuts, spent, work: took, reached: done, place, source };
        // What the host has ended may have an answer.
        if ended_by_host {
            work.config.copy_from(&work.before);
            return Err(error);
        }
        let x = work.config.x.clone();
        work.refused = Some(Box::new(Refused { from: state.clone(), dt, error: error.clone(), x }));
        Err(error)
    }

    /// Takes over where the last piece has come to.
    fn finish(&mut self, model: &Arc<Model>, state: &mut State, work: &mut Workspace) -> Result<Progress, SimError> {
        let dt = self.dt;
        let mut report = std::mem::replace(&mut self.report, StepReport::new(0));
        if !model.folds() {
            self.least = min_det_f(model, &work.config.x);
        }
        warn_of_squeezing(model, self.least_before, self.least, &work.config.x, &mut report.warnings);
        if !self.surely {
            report.warnings.push("a contact's shape goes so far in this step that it may have passed tissue".into());
        }
        if let Some(pace) = self.pace.filter(|pace| !pace.holds(report.time_error)) {
            report.warnings.push(pace.broken(report.time_error));
        }
        warn_of_jumps(model, worst_jump(model, &state.config.x), worst_jump(model, &work.config.x), &mut report);
        state.t += dt;
        accept(model, state, work, &report, dt);
        state.outputs.least = self.least;
        state.linearisation = self.linearisation.take();
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
        Ok(Progress::Done(report))
    }
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
    let mut report = match run(model, &mut fresh, work, 0.0, most) {
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
    let is_lower = match run(model, &mut fresh, work, 0.0, most_work(model, state, work)) {
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
