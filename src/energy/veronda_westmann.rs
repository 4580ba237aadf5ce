//! Veronda-Westmann skin: `W = c1 (exp(c2 (I1b - 3)) - 1) - c1 c2/2 (I2b - 3)`; small-strain mu = c1 c2.
//!
//! Source: Veronda & Westmann, "Mechanical characterization of skin - finite deformations", J. Biomech. 3(1), 1970.

use super::{Isochoric, Slopes};

/// Constants.
pub struct VerondaWestmann {
    /// Scale, Pa.
    pub c1: f64,
    /// Stiffening exponent.
    pub c2: f64,
}

impl Isochoric for VerondaWestmann {
    const NAME: &'static str = "veronda-westmann";

    fn W(&self, I1b: f64, I2b: f64) -> f64 {
        self.c1 * (self.c2 * (I1b - 3.0)).exp_m1() - 0.5 * self.c1 * self.c2 * (I2b - 3.0)
    }
    fn slopes(&self, I1b: f64, _I2b: f64) -> Slopes {
        let first = self.c1 * self.c2 * (self.c2 * (I1b - 3.0)).exp();
        Slopes { first: [first, -0.5 * self.c1 * self.c2], second: [self.c2 * first, 0.0, 0.0] }
    }
}
