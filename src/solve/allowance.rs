//! What a step may spend, and whether it is to end: asked before every linear solve and every factorisation.
//!
//! Counts, not clocks, so a step that is given up is given up at the same solve on every machine.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use super::SolveError;

/// Shared by all minimisers of one simulation, and by whoever may cancel its steps.
#[derive(Debug)]
pub struct Allowance {
    most: AtomicU32,
    left: AtomicU32,
    cancelled: AtomicBool,
}

impl Default for Allowance {
    /// Without a bound.
    fn default() -> Allowance {
        Allowance { most: AtomicU32::new(u32::MAX), left: AtomicU32::new(u32::MAX), cancelled: AtomicBool::new(false) }
    }
}

impl Allowance {
    /// Allows `most` linear solves from now on.
    pub fn grant(&self, most: u32) {
        self.most.store(most, Ordering::Relaxed);
        self.left.store(most, Ordering::Relaxed);
    }

    /// Ends the step under way before its next linear solve, or the next step before its first one; from any thread.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Release);
    }

    /// As if nobody had cancelled.
    pub fn uncancel(&self) {
        self.cancelled.store(false, Ordering::Release);
    }

    /// Before work that is no linear solve.
    ///
    /// # Errors
    /// [`SolveError::Cancelled`], once for each time.
    pub fn check(&self) -> Result<(), SolveError> {
        if self.cancelled.load(Ordering::Acquire) {
            self.cancelled.store(false, Ordering::Release);
            return Err(SolveError::Cancelled);
        }
        Ok(())
    }

    /// Before a linear solve.
    ///
    /// # Errors
    /// [`SolveError::Spent`] where none is left, and as for [`Allowance::check`].
    pub fn spend(&self) -> Result<(), SolveError> {
        self.check()?;
        match self.left.load(Ordering::Relaxed) {
            0 => Err(SolveError::Spent { most: self.most.load(Ordering::Relaxed) }),
            left => {
                self.left.store(left - 1, Ordering::Relaxed);
                Ok(())
            }
        }
    }
}
