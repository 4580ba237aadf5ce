//! One piece of a step: prediction, minimisation, and whether its end may be taken.

use std::sync::Arc;

use super::SolveError;
use super::approach::check_depth;
use super::audit::{Balance, min_det_f, snapped};
use super::linearisation::{Linearisation, with_problem};
use super::model::Model;
use super::motion::in_time;
use super::pace::Pace;
use super::past::Piece;
use super::recover::untangle;
use super::report::{StepReport, tell};
use super::swing::{Swing, none_before};
use super::targets::{place_bones, target_increments};
use super::workspace::Workspace;
use crate::fem::{At, Configuration};
use crate::math::{Mat3, Vec3, best_fit, extent};
use crate::solve::{Minimiser, Problem, Rung, Way};

/// A piece that turns elements inside out is cut; where the scene allows them, down to this part of the step only.
const SMALLEST_TO_AVOID_INVERSION: f64 = 1.0 / 8.0;

/// A piece of load alone that is smaller starts from where the tissue is, if the law does not allow what is predicted.
const SMALLEST_TO_PREDICT: f64 = 1.0 / 32.0;

/// Sizes of the tissue that loads may be predicted to move it by; torture scenes with an answer go to 33.
const MOST_REACH: f64 = 50.0;

/// Change of ln dt beyond which the stiffness with inertia is factored anew.
const DT_DRIFT: f64 = 0.1;

/// Change of ln E beyond which the stiffness is factored anew.
const MODULUS_DRIFT: f64 = 0.1;

/// The bones' common rigid motion is taken out first where it explains all but this part of their motion.
const RIGID_REMAINDER: f64 = 0.5;

/// Turns smaller than this (rad, squared) leave the factor as it is.
const FRAME_THRESHOLD: f64 = 0.05 * 0.05;

/// A piece of a step as it is tried.
pub(super) struct Cut {
    /// Its end, s.
    pub t: f64,
    /// Its length, s.
    pub dt: f64,
    /// Its part of the step.
    pub part: f64,
    /// The smallest part that a step is cut into.
    pub smallest: f64,
    /// Smallest det F where it starts; a bound where no element can turn inside out.
    pub least: f64,
    /// Whether nothing but bones moves in it.
    pub only_bones: bool,
    /// Whether no input changes.
    pub is_free: bool,
}

/// Why a piece of a step is not taken.
pub(super) enum Setback {
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

/// One piece of a step, from and into `work`; `bound` by an accuracy if it may still be cut. The smallest det F where it ends
/// goes into `least`.
pub(super) fn step_piece(
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
    let most = MOST_REACH * extent(before);
    // What is no number is told by the minimiser.
    if motion > most { Err(SolveError::BeyondReach { motion, most }) } else { Ok(()) }
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
