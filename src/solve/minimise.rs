//! Descent on the energy: L-BFGS over a kept factor, or Newton with a new factor in every iteration.
//!
//! Both are one loop: Newton is the strategy with no memory that refactors every time. Every accepted step lowers the
//! energy (Armijo), so it cannot blow up.
//!
//! Source: Liu, Bouaziz & Kavan, "Quasi-Newton methods for real-time simulation of hyperelastic materials", ACM TOG
//! 36(3), 2017; line search after Nocedal & Wright, "Numerical Optimization", 2nd ed., 2006, sections 3.1 and 3.5, with
//! the approximate condition of Hager & Zhang, SIAM J. Optim. 16(1), 2005, where energy differences drown in round-off.

use std::sync::Arc;

use super::choice::choose;
use super::lbfgs::{Lbfgs, dot};
use super::{Allowance, LinearSolver, LinearSystems, Precision, Problem, Rung, SolveError};
use crate::fem::{Assembly, Configuration, Curvature};
use crate::math::{Mat3, Vec3};

/// How the minimum is sought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strategy {
    /// Pairs that L-BFGS remembers; 0 for Newton.
    pub memory: usize,
    /// Iterations after which the stiffness is factored anew; 1 for Newton.
    pub refresh_after: u32,
    /// Largest nodal motion of the last correction, m.
    pub tolerance: f64,
    /// Most linear solves in one minimisation.
    pub max_iterations: u32,
    /// How linear systems are solved.
    pub linear: LinearSystems,
    /// Precision of the linear solves.
    pub precision: Precision,
    /// Threads that solve, 1 or 2; the answer is the same.
    pub threads: usize,
    /// A rung that is left out, to be measured.
    pub without: Option<Rung>,
}

impl Strategy {
    /// Whether this rung is there.
    pub fn has(&self, rung: Rung) -> bool {
        self.without != Some(rung)
    }
}

/// How a minimisation ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Linear solves.
    pub iterations: u32,
    /// Factorisations.
    pub factorisations: u32,
    /// Largest nodal motion of the last correction, m.
    pub correction: f64,
    /// Norm of the gradient of the unknowns, N (torques by their number).
    pub residual: f64,
    /// Energy at the end, J.
    pub energy: f64,
    /// Whether an iterate was seen to have an element turned inside out.
    pub crossed: bool,
}

/// By which way a minimum may be sought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Way {
    /// By any; nobody looks.
    Any,
    /// By any; the outcome says whether elements were inside out on it.
    Watched(Clearance),
    /// By none on which elements are inside out.
    Upright(Clearance),
}

/// How far nodes may go, m for each unit of the smallest det F, before elements are looked at again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clearance(pub f64);

/// Looks for elements turned inside out on the way, where they can have come about since the last look.
struct Watch {
    clearance: Option<Clearance>,
    /// Smallest det F found last, and how far nodes have gone since, m.
    least: f64,
    moved: f64,
}

impl Watch {
    fn new(way: Way) -> Watch {
        let clearance = match way {
            Way::Any => None,
            Way::Watched(clearance) | Way::Upright(clearance) => Some(clearance),
        };
        Watch { clearance, least: 0.0, moved: 0.0 }
    }

    /// Whether `config`, to which nodes have gone by no more than `motion` (m), has elements inside out.
    fn crosses(&mut self, problem: &Problem, config: &Configuration, motion: f64) -> bool {
        let Some(Clearance(clearance)) = self.clearance else { return false };
        self.moved += motion;
        if self.moved >= clearance * self.least {
            (self.least, self.moved) = (problem.min_det_f(&config.x), 0.0);
        }
        self.least <= 0.0
    }
}

/// Tells iterations that only stir round-off: neither the energy falls nor the correction.
struct Standstill {
    best: f64,
    idle: u32,
}

impl Standstill {
    fn new() -> Standstill {
        Standstill { best: f64::INFINITY, idle: 0 }
    }

    /// Whether an iteration with this correction (m), in which the energy fell beyond its noise or not, is one too many.
    fn holds(&mut self, correction: f64, fell: bool) -> bool {
        if fell || correction < SMALLER * self.best {
            self.idle = 0;
            self.best = self.best.min(correction);
        } else {
            self.idle += 1;
        }
        self.idle >= MOST_IDLE
    }
}

/// A correction smaller than this part of the best so far is progress; iterations without any that are one too many.
const SMALLER: f64 = 0.9;
const MOST_IDLE: u32 = 20;
/// Fraction of the promised descent that a step must keep.
const ARMIJO: f64 = 1e-4;
/// Relative round-off of an energy sum.
const ENERGY_NOISE: f64 = 1e-12;
/// Shortenings before a direction is given up; the last one tries 2^-30 of it.
const MAX_SHORTENINGS: u32 = 30;
/// What the forces take of a linear solve.
const WORK_OF_FORCES: f64 = 0.3;
/// Linear solves of a good step, with their forces.
const GOOD_SOLVES: f64 = 10.0;
const GOOD_NEWTON: f64 = 25.0;
/// The stiffnesses that are factored, the true one first.
const BOTH: [Curvature; 2] = [Curvature::Exact, Curvature::Projected];
/// Iterations that a shortened step counts for when the factor's age is judged.
const SHORTENED_AGES: u32 = 4;

/// The linear algebra of one model: pattern, factor and buffers. Allocates only when made.
pub struct Minimiser {
    assembly: Assembly,
    solver: Box<dyn LinearSolver>,
    memory: Lbfgs,
    strategy: Strategy,
    allowance: Arc<Allowance>,
    /// Rotation from the configuration that was factored to the one at hand.
    frame: Mat3,
    factored: bool,
    /// Factors that were sought so far.
    factorings: u64,
    /// Whether that was the true stiffness.
    exact: bool,
    /// Where the factor was made.
    factored_at: Configuration,
    trial: Configuration,
    lag: Configuration,
    /// Work so far, and where it has to end, in linear solves.
    work: f64,
    limit: f64,
    /// Gradient at the nodes, reactions included, N.
    nodal: Vec<Vec3>,
    g: Vec<Vec3>,
    g_trial: Vec<Vec3>,
    d: Vec<Vec3>,
}

impl Minimiser {
    /// Analyses the pattern of the problem's terms and allocates.
    ///
    /// # Errors
    /// [`SolveError::TooLarge`].
    pub fn new(problem: &Problem, mut strategy: Strategy) -> Result<Minimiser, SolveError> {
        let assembly = Assembly::new(problem.terms, problem.dofs);
        let solver = choose(&assembly.K.pattern, problem.dofs.elimination.as_ref(), &strategy)?;
        if solver.factor_len() == 0 {
            // A solve by iteration costs about as much with a new matrix as with an old one: Newton's method.
            (strategy.memory, strategy.refresh_after) = (0, 1);
        }
        let n = problem.dofs.n_blocks();
        let config =
            Configuration { x: problem.X.to_vec(), poses: vec![crate::math::Pose::REST; problem.pivots.len()] };
        Ok(Minimiser {
            solver,
            assembly,
            memory: Lbfgs::new(strategy.memory, n),
            strategy,
            allowance: Arc::default(),
            frame: Mat3::identity(),
            factored: false,
            factorings: 0,
            exact: false,
            factored_at: config.clone(),
            trial: config.clone(),
            lag: config,
            work: 0.0,
            limit: f64::INFINITY,
            nodal: vec![Vec3::zeros(); problem.X.len()],
            g: vec![Vec3::zeros(); n],
            g_trial: vec![Vec3::zeros(); n],
            d: vec![Vec3::zeros(); n],
        })
    }

    /// Lives on this allowance from now on.
    pub fn share(&mut self, allowance: &Arc<Allowance>) {
        self.allowance.clone_from(allowance);
    }

    /// What it may still spend.
    pub fn allowance(&self) -> &Arc<Allowance> {
        &self.allowance
    }

    /// Gradient at the nodes after the last minimisation, N: on prescribed nodes minus the reaction of the tissue.
    pub fn nodal_gradient(&self) -> &[Vec3] {
        &self.nodal
    }

    /// Stored entries of the factor.
    pub fn factor_len(&self) -> usize {
        self.solver.factor_len()
    }

    /// Scalar unknowns.
    pub fn n_unknowns(&self) -> usize {
        3 * self.g.len()
    }

    /// Bytes of the matrices, the factor and the vectors.
    pub fn memory(&self) -> usize {
        let vectors = 2 * self.nodal.len() * 2 + self.g.len() * (3 + 2 * self.strategy.memory);
        self.assembly.memory() + self.solver.memory() + vectors * size_of::<Vec3>()
    }

    /// Work so far in linear solves: each of them, forces and factorisations by what they take of one.
    pub fn work(&self) -> f64 {
        self.work
    }

    /// Lets minimisations go on until [`Minimiser::work`] is this much.
    pub fn set_limit(&mut self, limit: f64) {
        self.limit = limit;
    }

    /// What a factorisation takes, in linear solves, as measured from 1k to 200k tetrahedra. Newton's method pays with each
    /// solve for one, and solves by iteration are not told apart: both count by solves alone.
    pub fn work_of_a_factor(&self) -> f64 {
        if self.strategy.memory == 0 { 0.0 } else { 0.15 * self.factor_len() as f64 / self.n_unknowns().max(1) as f64 }
    }

    /// What a good step takes where it needs a factor, in linear solves: that, and some solves with their forces. Newton's method,
    /// whose factors do not count, may look for its last digits.
    pub fn good_step(&self) -> f64 {
        if self.strategy.memory == 0 { GOOD_NEWTON } else { GOOD_SOLVES + self.work_of_a_factor() }
    }

    /// Factors that were sought so far: while this stays, the one at hand is the same.
    pub fn factorings(&self) -> u64 {
        self.factorings
    }

    /// Whether a factor is at hand.
    pub fn is_factored(&self) -> bool {
        self.factored
    }

    /// Whether the factor at hand is that of the true stiffness, not of the projected one.
    pub fn is_exact(&self) -> bool {
        self.exact
    }

    /// Where the factor at hand was made.
    pub fn factored_at(&self) -> &Configuration {
        &self.factored_at
    }

    /// Turns the kept factor along with the bones; the identity where it was made.
    pub fn set_frame(&mut self, frame: Mat3) {
        self.frame = frame;
    }

    /// Factors the stiffness at `config`; the true one where it is positive definite, else the projected one.
    ///
    /// # Errors
    /// [`SolveError::Singular`] if even the projected stiffness is not positive definite, [`SolveError::NotFinite`] where
    /// the energy is not defined.
    pub fn linearise(&mut self, problem: &Problem, config: &Configuration) -> Result<(), SolveError> {
        self.linearise_as(&BOTH, problem, config)
    }

    /// The same with these stiffnesses in turn.
    fn linearise_as(
        &mut self,
        curvatures: &[Curvature],
        problem: &Problem,
        config: &Configuration,
    ) -> Result<(), SolveError> {
        self.allowance.check()?;
        self.lag.copy_from(config);
        self.factored_at.copy_from(config);
        let energy = problem.gradient(config, &self.lag, &mut self.nodal, &mut self.g);
        self.factored = false;
        self.factorings += 1;
        if !energy.is_finite() {
            return Err(SolveError::NotFinite);
        }
        self.frame = Mat3::identity();
        self.memory.forget();
        for &curvature in curvatures {
            self.work += self.work_of_a_factor();
            problem.assemble(&mut self.assembly, config, &self.nodal, curvature);
            match self.solver.factor(&self.assembly.K) {
                Ok(()) => {
                    self.factored = true;
                    self.exact = curvature == Curvature::Exact;
                    return Ok(());
                }
                Err(block) if !self.strategy.has(Rung::Projection) => {
                    return Err(SolveError::Singular { block, n_blocks: problem.dofs.n_blocks() });
                }
                Err(_) if curvature == Curvature::Projected && problem.is_beyond_numbers(config) => {
                    return Err(SolveError::NotFinite);
                }
                Err(block) if curvature == Curvature::Projected => {
                    return Err(SolveError::Singular { block, n_blocks: problem.dofs.n_blocks() });
                }
                Err(_) => {}
            }
        }
        Ok(())
    }

    /// `d <- K^-1 d` with the factor at hand, in double precision.
    pub fn apply_inverse(&mut self, d: &mut [Vec3]) {
        self.solver.solve_in_double(d);
    }

    /// Moves `config` to where the factor at hand expects the equilibrium once the prescribed nodes have gone by `u`:
    /// `K d = -(g + K_p u)`. The prescribed nodes of `config` are moved, too. Returns the energy before, J.
    pub fn predict(&mut self, problem: &Problem, config: &mut Configuration, u: &[Vec3]) -> f64 {
        let Minimiser { assembly, solver, strategy, frame, lag, nodal, g, d, trial, .. } = self;
        lag.copy_from(config);
        let energy = problem.gradient(config, lag, nodal, g);
        d.fill(Vec3::zeros());
        assembly.K_p.add_product(|p| frame.tr_mul(&u[p]), d);
        for (d, g) in d.iter_mut().zip(&*g) {
            *d = -(*d + frame.tr_mul(g));
        }
        solver.solve(d);
        turn(frame, d);
        if !strategy.has(Rung::Predictor) {
            d.fill(Vec3::zeros());
        }
        trial.copy_from(config);
        for (&a, u) in problem.dofs.prescribed.iter().zip(u) {
            trial.x[a as usize] += u;
        }
        problem.dofs.retract(problem.X, problem.pivots, config, 1.0, d, trial);
        config.copy_from(trial);
        energy
    }

    /// Minimises from `config` on, which ends at the best point found.
    ///
    /// # Errors
    /// [`SolveError`]; `config` is then not an equilibrium.
    pub fn minimise(&mut self, problem: &Problem, config: &mut Configuration) -> Result<Outcome, SolveError> {
        self.minimise_by(Way::Any, problem, config)
    }

    /// The same with an eye on elements turned inside out on the way: another equilibrium may lie behind them.
    ///
    /// # Errors
    /// As for [`Minimiser::minimise`], and [`SolveError::Inverts`] as soon as an iterate has such an element that `way` bars.
    pub fn minimise_by(
        &mut self,
        way: Way,
        problem: &Problem,
        config: &mut Configuration,
    ) -> Result<Outcome, SolveError> {
        let lagged = problem.is_lagged();
        let newton = self.strategy.memory == 0;
        let mut outcome = Outcome {
            iterations: 0,
            factorisations: 0,
            correction: f64::INFINITY,
            residual: f64::INFINITY,
            energy: f64::NAN,
            crossed: false,
        };
        let mut age = 0;
        let mut rest = Standstill::new();
        // While steps have to be shortened, a true stiffness that was indefinite is not tried again.
        let mut indefinite = false;
        self.memory.forget();
        self.lag.copy_from(config);
        self.trial.copy_from(config);
        let mut energy = problem.gradient(config, &self.lag, &mut self.nodal, &mut self.g);
        if !energy.is_finite() {
            return Err(SolveError::NotFinite);
        }
        let mut watch = Watch::new(way);
        let upright = matches!(way, Way::Upright(_));
        outcome.crossed = watch.crosses(problem, config, 0.0);
        if outcome.crossed && upright {
            return Err(SolveError::Inverts { iterations: 0 });
        }
        loop {
            let stale = newton && outcome.iterations > 0 && !problem.is_quadratic();
            if !self.factored || stale || age >= self.strategy.refresh_after.max(2) && !problem.is_quadratic() {
                let skipped = usize::from(indefinite && self.strategy.has(Rung::Projection));
                self.linearise_as(&BOTH[skipped..], problem, config)?;
                outcome.factorisations += 1;
                age = 0;
            }
            self.allowance.spend()?;
            let mut slope = self.direction();
            outcome.iterations += 1;
            if slope >= 0.0 || slope.is_nan() {
                self.memory.forget();
                self.allowance.spend()?;
                slope = self.direction();
                outcome.iterations += 1;
            }
            if !slope.is_finite() {
                return Err(SolveError::NotFinite);
            }
            outcome.correction = problem.dofs.largest_motion(&self.d, config, problem.pivots);
            let mut last = outcome.correction <= self.strategy.tolerance;
            if last && self.solver.factor_len() == 0 {
                // A solve by iteration that stops early makes corrections look small: the one that ends it is solved to the end.
                slope = self.precise_direction();
                outcome.iterations += 1;
                outcome.correction = problem.dofs.largest_motion(&self.d, config, problem.pivots);
                last = outcome.correction <= self.strategy.tolerance;
            }
            match self.search(problem, config, energy, slope) {
                Some((alpha, new_energy)) => {
                    let fell = energy - new_energy > ENERGY_NOISE * (energy.abs() + new_energy.abs());
                    let stands = rest.holds(outcome.correction, fell);
                    if self.strategy.has(Rung::Memory) {
                        self.memory.remember(alpha, &self.d, &self.g, &self.g_trial);
                    }
                    std::mem::swap(&mut self.g, &mut self.g_trial);
                    config.copy_from(&self.trial);
                    energy = new_energy;
                    outcome.crossed |= watch.crosses(problem, config, alpha * outcome.correction);
                    if outcome.crossed && upright {
                        return Err(SolveError::Inverts { iterations: outcome.iterations });
                    }
                    indefinite = alpha < 1.0 && !self.exact;
                    age += if alpha < 1.0 { SHORTENED_AGES } else { 1 };
                    if stands && !last {
                        return Err(self.not_converged(outcome));
                    }
                }
                // A step below the tolerance that round-off cannot tell from none is no failure.
                None if last => {
                    energy = problem.gradient(config, &self.lag, &mut self.nodal, &mut self.g);
                }
                None if self.memory.is_empty() && (age == 0 || problem.is_quadratic()) => {
                    return Err(self.not_converged(outcome));
                }
                None if outcome.iterations >= self.strategy.max_iterations || self.work >= self.limit => {
                    return Err(self.not_converged(outcome));
                }
                None => {
                    energy = problem.gradient(config, &self.lag, &mut self.nodal, &mut self.g);
                    if self.memory.is_empty() {
                        age = u32::MAX;
                    }
                    self.memory.forget();
                    continue;
                }
            }
            if lagged {
                self.lag.copy_from(config);
                energy = problem.gradient(config, &self.lag, &mut self.nodal, &mut self.g);
            }
            outcome.residual = dot(&self.g, &self.g).sqrt();
            outcome.energy = energy;
            if last {
                return Ok(outcome);
            }
            if outcome.iterations >= self.strategy.max_iterations || self.work >= self.limit {
                return Err(self.not_converged(outcome));
            }
        }
    }

    fn not_converged(&self, outcome: Outcome) -> SolveError {
        SolveError::NotConverged {
            iterations: outcome.iterations,
            correction: outcome.correction,
            tolerance: self.strategy.tolerance,
            residual: dot(&self.g, &self.g).sqrt(),
        }
    }

    /// `d = -K^-1 g` to the last digits, without what L-BFGS remembers; returns the slope `g.d`.
    fn precise_direction(&mut self) -> f64 {
        self.work += 1.0;
        self.d.copy_from_slice(&self.g);
        self.solver.solve_in_double(&mut self.d);
        self.d.iter_mut().for_each(|d| *d = -*d);
        dot(&self.g, &self.d)
    }

    /// `d = -H g`; returns the slope `g.d`.
    fn direction(&mut self) -> f64 {
        let Minimiser { solver, memory, frame, g, d, work, .. } = self;
        *work += 1.0;
        d.copy_from_slice(g);
        memory.apply(d, |q| {
            turn(&frame.transpose(), q);
            solver.solve(q);
            turn(frame, q);
        });
        for d in d.iter_mut() {
            *d = -*d;
        }
        dot(&self.g, &self.d)
    }

    /// Shortens the step along `d` until the energy falls enough; leaves the new point in `trial`, its gradient in
    /// `g_trial`. Returns the length and the energy, or `None` if no length serves.
    fn search(&mut self, problem: &Problem, config: &Configuration, energy: f64, slope: f64) -> Option<(f64, f64)> {
        if slope >= 0.0 || slope.is_nan() {
            return None;
        }
        let mut alpha = 1.0;
        for _ in 0..=MAX_SHORTENINGS {
            self.work += WORK_OF_FORCES;
            problem.dofs.retract(problem.X, problem.pivots, config, alpha, &self.d, &mut self.trial);
            let tried = problem.gradient(&self.trial, &self.lag, &mut self.nodal, &mut self.g_trial);
            let noise = ENERGY_NOISE * (energy.abs() + tried.abs());
            if tried <= energy + ARMIJO * alpha * slope || tried.is_finite() && !self.strategy.has(Rung::LineSearch) {
                return Some((alpha, tried));
            }
            let new_slope = dot(&self.g_trial, &self.d);
            if tried.is_finite() && (tried - energy).abs() <= noise && new_slope.abs() <= -slope {
                return Some((alpha, tried));
            }
            // Minimum of the parabola through energy, slope and tried; halved where that says nothing.
            let parabola = -0.5 * slope * alpha * alpha / (tried - energy - slope * alpha);
            alpha = if parabola.is_finite() { parabola.clamp(0.1 * alpha, 0.5 * alpha) } else { 0.5 * alpha };
        }
        None
    }
}

fn turn(R: &Mat3, vectors: &mut [Vec3]) {
    if *R != Mat3::identity() {
        for v in vectors {
            *v = R * *v;
        }
    }
}
