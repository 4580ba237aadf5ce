//! What a step did.

use crate::solve::Outcome;

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

    pub(super) fn count(&mut self, outcome: &Outcome) {
        self.iterations += outcome.iterations;
        self.factorisations += outcome.factorisations;
        self.residual = outcome.residual;
        self.correction = outcome.correction;
    }
}

/// Adds a warning that is not there yet.
pub(super) fn tell(report: &mut StepReport, message: &str) {
    if !report.warnings.iter().any(|warning| warning == message) {
        report.warnings.push(message.into());
    }
}
