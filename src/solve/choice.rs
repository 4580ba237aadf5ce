//! Which linear solver a scene gets.

use super::{Cholesky, Gradients, LinearSolver, LinearSystems, MOST_ENTRIES, SolveError, Strategy};
use crate::fem::{Elimination, Pattern};

/// Blocks beyond which a factor is not even analysed: no mesh of that size has one that is small.
const MOST_ORDERED: usize = 300_000;
/// Entries of a factor (12 bytes each in both precisions) beyond which the iterative solver is taken.
const LARGE_FACTOR: usize = 400_000_000;

/// The solver of a pattern, whose order of elimination may be known: the direct one where its factor fits, else the iterative one.
///
/// # Errors
/// [`SolveError::TooLarge`] where the direct one is wanted and its factor would not fit.
pub(super) fn choose(
    pattern: &Pattern,
    known: Option<&Elimination>,
    strategy: &Strategy,
) -> Result<Box<dyn LinearSolver>, SolveError> {
    let Strategy { precision, threads, .. } = *strategy;
    match strategy.linear {
        LinearSystems::Iterative => Ok(Box::new(Gradients::new(pattern))),
        LinearSystems::Direct => Ok(Box::new(Cholesky::analyse(pattern, known, precision, threads, MOST_ENTRIES)?)),
        LinearSystems::Fitting if pattern.n() > MOST_ORDERED => Ok(Box::new(Gradients::new(pattern))),
        LinearSystems::Fitting => match Cholesky::analyse(pattern, known, precision, threads, LARGE_FACTOR) {
            Ok(cholesky) => Ok(Box::new(cholesky)),
            Err(SolveError::TooLarge { .. }) => Ok(Box::new(Gradients::new(pattern))),
            Err(e) => Err(e),
        },
    }
}
