//! One host step, and which way it goes: held, read off a table, in modes, or solved piece by piece (`pieces`).
//!
//! Quasi-static equilibrium and the steps of every time integrator are one minimisation (see `effect::inertia` and
//! `scheme`); a step that fails is cut into smaller pieces of load and time.

use std::sync::Arc;

use super::audit::{warn_of_jumps, worst_jump};
use super::linear_map::LinearMap;
use super::modal;
use super::model::Model;
use super::modes::Spectrum;
use super::past::Origin;
use super::pieces::{Progress, Run, most_work};
use super::report::StepReport;
use super::scheme::Scheme;
use super::start::accelerations;
use super::state::State;
use super::targets::{check_inputs, place_bones, read_pivots, read_wrenches};
use super::workspace::{Table, Workspace};
use super::{SimError, SolveError};
use crate::fem::At;
use crate::math::{Pose, Vec3};
use crate::solve::Problem;

/// A step that is begun; on the stack, since a step allocates nothing.
#[allow(clippy::large_enum_variant)]
pub(super) enum Begun {
    /// It needed no solver of its own, and is done.
    Done(StepReport),
    /// It goes on piece by piece.
    Running(Run),
}

/// Begins to move `state` on by `dt` seconds: by a way that is exact where the scene has one, else piece by piece.
pub(super) fn begin(model: &Arc<Model>, state: &mut State, work: &mut Workspace, dt: f64) -> Result<Begun, SimError> {
    check_inputs(model, &state.inputs)?;
    if let Some(again) = work.refused.as_ref().filter(|refused| refused.dt == dt && refused.from == *state) {
        return Err(again.error.clone());
    }
    if let Some(report) = hold(model, state, dt) {
        return Ok(Begun::Done(report));
    }
    if let Some(report) = look_up(model, state, work, dt)? {
        return Ok(Begun::Done(report));
    }
    if let Some(report) = modal::advance(model, state, &mut work.minimiser, &mut work.modal, dt)? {
        work.kept.origin = Origin::Unknown; // tables of modes know it themselves
        return Ok(Begun::Done(report));
    }
    let most = most_work(model, state, work);
    Ok(Begun::Running(Run::begin(model, state, work, dt, most)))
}

/// Moves `state` on by `dt` seconds, or leaves it as it is.
pub(super) fn advance(
    model: &Arc<Model>,
    state: &mut State,
    work: &mut Workspace,
    dt: f64,
) -> Result<StepReport, SimError> {
    let mut run = match begin(model, state, work, dt)? {
        Begun::Done(report) => return Ok(report),
        Begun::Running(run) => run,
    };
    loop {
        if let Progress::Done(report) = run.go_on(model, state, work, false)? {
            return Ok(report);
        }
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
    let report = advance(model, state, work, 0.0).map_err(|error| loose_start(model, error))?;
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
