//! Yeoh: `W = c10 k + c20 k^2 + c30 k^3`, `k = I1b - 3`; small-strain mu = 2 c10.
//!
//! Source: Yeoh, "Some forms of the strain energy function for rubber", Rubber Chem. Technol. 66(5), 1993.

use super::{Isochoric, Slopes};

/// Constants, Pa.
pub struct Yeoh {
    /// Of k.
    pub c10: f64,
    /// Of k^2.
    pub c20: f64,
    /// Of k^3.
    pub c30: f64,
}

impl Isochoric for Yeoh {
    const NAME: &'static str = "yeoh";
    const OF_I1_ALONE: bool = true;

    fn W(&self, I1b: f64, _I2b: f64) -> f64 {
        let k = I1b - 3.0;
        k * (self.c10 + k * (self.c20 + k * self.c30))
    }
    fn slopes(&self, I1b: f64, _I2b: f64) -> Slopes {
        let k = I1b - 3.0;
        let first = self.c10 + k * (2.0 * self.c20 + k * 3.0 * self.c30);
        Slopes { first: [first, 0.0], second: [2.0 * self.c20 + 6.0 * self.c30 * k, 0.0, 0.0] }
    }
}
