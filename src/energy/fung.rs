//! Fung's exponential in its isotropic form: `W = mu/(2 b) (exp(b (I1b - 3)) - 1)`; small-strain shear modulus mu.
//!
//! Source: Demiray, "A note on the elasticity of soft biological tissues", J. Biomech. 5(3), 1972, after Fung 1967.

use super::{Isochoric, Slopes};

/// Shear modulus (Pa) and stiffening.
pub struct Fung {
    /// Small-strain shear modulus, Pa.
    pub mu: f64,
    /// Stiffening exponent.
    pub b: f64,
}

impl Isochoric for Fung {
    const NAME: &'static str = "fung";
    const OF_I1_ALONE: bool = true;

    fn W(&self, I1b: f64, _I2b: f64) -> f64 {
        0.5 * self.mu / self.b * (self.b * (I1b - 3.0)).exp_m1()
    }
    fn slopes(&self, I1b: f64, _I2b: f64) -> Slopes {
        let first = 0.5 * self.mu * (self.b * (I1b - 3.0)).exp();
        Slopes { first: [first, 0.0], second: [self.b * first, 0.0, 0.0] }
    }
}
