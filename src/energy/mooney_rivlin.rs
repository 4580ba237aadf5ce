//! Mooney-Rivlin: `W = c10 (I1b - 3) + c01 (I2b - 3)`; small-strain mu = 2 (c10 + c01).
//!
//! Source: Rivlin & Saunders, "Large elastic deformations of isotropic materials VII", Phil. Trans. A 243, 1951.

use super::{Isochoric, Slopes};

/// Constants, Pa.
pub struct MooneyRivlin {
    /// Of I1b.
    pub c10: f64,
    /// Of I2b.
    pub c01: f64,
}

impl Isochoric for MooneyRivlin {
    const NAME: &'static str = "mooney-rivlin";

    fn W(&self, I1b: f64, I2b: f64) -> f64 {
        self.c10 * (I1b - 3.0) + self.c01 * (I2b - 3.0)
    }
    fn slopes(&self, _I1b: f64, _I2b: f64) -> Slopes {
        Slopes { first: [self.c10, self.c01], ..Slopes::default() }
    }
}
