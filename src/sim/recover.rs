//! The last rung: untangling a start that the tissue's own law cannot leave.
//!
//! Laws with a logarithm are not defined for inverted elements, and the stable neo-Hookean law can rest in tangled minima.
//! The corotational law at a Poisson's ratio of 0.3 pulls every element back to its own shape from any start, so its
//! equilibrium under the bones alone is where the true law takes over.
//!
//! Source: Irving, Teran & Fedkiw, "Invertible finite elements for robust simulation of large deformation", SCA 2004, for
//! the rotation that inverted elements are given.

use std::sync::Arc;

use super::model::Model;
use crate::fem::{At, Configuration};
use crate::math::{Vec3, extent};
use crate::solve::{Allowance, LinearSystems, Minimiser, Outcome, Precision, Problem, SolveError, Strategy};

/// The stand-in only has to untangle, so it is solved coarsely: share of the model's size that the last correction may be.
const COARSE: f64 = 1e-4;
/// Pairs that its quasi-Newton method remembers, iterations to a new factor, and at most.
const STRATEGY: Strategy = Strategy {
    memory: 8,
    refresh_after: 10,
    tolerance: 0.0,
    max_iterations: 500,
    linear: LinearSystems::Fitting,
    precision: Precision::Double,
    threads: 1,
    without: None,
};

/// Moves the free nodes of `config` to the equilibrium of the stand-in. Allocates: this is no common step.
pub(super) fn untangle(
    model: &Model,
    pivots: &[Vec3],
    allowance: &Arc<Allowance>,
    config: &mut Configuration,
) -> Result<Outcome, SolveError> {
    let parts = model.parts();
    let X = &parts.mesh.nodes;
    let terms = (parts.stand_in)(&parts.mesh, &parts.midsides);
    let wrenches = vec![(Vec3::zeros(), Vec3::zeros()); model.dofs().bodies.len()];
    let problem = Problem { terms: &terms, dofs: model.dofs(), X, pivots, wrenches: &wrenches, at: At::NOWHERE };
    let strategy = Strategy { tolerance: COARSE * extent(X), ..STRATEGY };
    let mut minimiser = Minimiser::new(&problem, strategy)?;
    minimiser.share(allowance);
    let rest = Configuration { x: X.clone(), poses: config.poses.clone() };
    minimiser.linearise(&problem, &rest)?;
    minimiser.minimise(&problem, config)
}
