//! How a host step is cut in time so that each piece keeps an accuracy.
//!
//! ```text
//! next = dt min(growth, 0.9 (accuracy/error)^(1/k)),   error ~ dt^k
//! ```
//!
//! A piece whose estimated error (`scheme::Formula::error`) is above the accuracy is done again, shorter; one in between is
//! followed by one as long, so that the factored stiffness serves on. What is left of the host step is cut evenly.
//!
//! Source: Hairer, Norsett & Wanner, "Solving Ordinary Differential Equations I", 2nd ed., 1993, section II.4.

use super::model::Inertia;

/// Share of the step that is expected to do which is tried.
const SAFETY: f64 = 0.9;
/// A piece grows by this much at least, or not at all; at most by what its scheme bears (`Scheme::growth`).
const WORTHWHILE: f64 = 1.2;
/// A piece that is done again is cut to between these parts of it.
const CUT: (f64, f64) = (0.2, 0.9);

/// What `[inertia] accuracy` asks for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    accuracy: f64,
    /// Exponent of dt in the error.
    k: f64,
    /// Largest growth of a piece.
    growth: f64,
}

impl Pace {
    /// The smallest piece, as part of a host step; it is taken and told.
    pub const SMALLEST: f64 = 1.0 / 256.0;

    /// Of a scene, if it asks for an accuracy.
    pub fn of(inertia: Option<&Inertia>) -> Option<Pace> {
        let inertia = inertia?;
        inertia.accuracy.map(|accuracy| Pace {
            accuracy,
            k: inertia.scheme.local_order(),
            growth: inertia.scheme.growth(),
        })
    }

    /// Whether an error (m) is as small as asked.
    pub fn holds(&self, error: f64) -> bool {
        error <= self.accuracy
    }

    /// What to say of an error (m) above the accuracy.
    pub fn broken(&self, error: f64) -> String {
        format!(
            "the error in time is estimated at {error:.1e} m, `accuracy` of [inertia] asks for {:.1e} m: the step was cut \
             into pieces of 1/256, take shorter ones",
            self.accuracy
        )
    }

    /// Length of the next piece in units of that of the last one, which had this error (m).
    pub fn next(&self, error: f64) -> f64 {
        let factor = SAFETY * (self.accuracy / error).powf(1.0 / self.k);
        if !self.holds(error) {
            return factor.clamp(CUT.0, CUT.1);
        }
        if factor < WORTHWHILE { 1.0 } else { self.growth.min(factor) }
    }
}

/// The largest even part of `left` that is no longer than `wanted`.
pub(super) fn even_part(left: f64, wanted: f64) -> f64 {
    /// Round-off that makes no further part.
    const SLACK: f64 = 1e-9;
    left / (left / wanted - SLACK).ceil().max(1.0)
}
