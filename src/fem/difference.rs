//! The rate of what is remembered, from its last two values: backward differences for steps of any length.
//!
//! ```text
//! dy/dt(n+1) = rate (y(n+1) - last y(n) + before y(n-1)),   w = dt/dt_before
//! rate = (1 + 2w)/((1 + w) dt),   last = (1 + w)^2/(1 + 2w),   before = w^2/(1 + 2w)
//! ```
//!
//! With w = 0, where nothing came before, this is the difference of backward Euler.
//!
//! Source: Hairer, Norsett & Wanner, "Solving Ordinary Differential Equations I", 2nd ed., 1993, section III.5.

/// Steps that grow by more than this start anew: two-step differences lose zero-stability at 1 + sqrt 2.
const LARGEST_GROWTH: f64 = 2.2;

/// Weights of a backward difference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Of the whole, 1/s; 0 where no time passes.
    pub rate: f64,
    /// Of the last value.
    pub last: f64,
    /// Of the value before, counted negative.
    pub before: f64,
}

impl Difference {
    /// Where no time passes there is no rate.
    pub const STILL: Difference = Difference { rate: 0.0, last: 1.0, before: 0.0 };

    /// Over a step of `dt` after one of `dt_before` (s; 0 if there was none).
    pub fn new(dt: f64, dt_before: f64) -> Difference {
        if dt == 0.0 {
            return Difference::STILL;
        }
        let growth = if dt <= LARGEST_GROWTH * dt_before { dt / dt_before } else { 0.0 };
        let span = 1.0 + 2.0 * growth;
        Difference {
            rate: span / ((1.0 + growth) * dt),
            last: (1.0 + growth).powi(2) / span,
            before: growth * growth / span,
        }
    }
}
