//! Small-strain linear elasticity.
//!
//! ```text
//! psi = mu |eps|^2 + lambda/2 tr(eps)^2,   eps = (F + F^T)/2 - I
//! ```
//!
//! Source: Bonet & Wood, "Nonlinear Continuum Mechanics for Finite Element Analysis", 2nd ed., 2008, section 6.6.6.
//! It is not objective: a rotation costs energy. Use it for small motion.

use super::{Energy, Lame};
use crate::math::{Mat3, Mat9, outer};

/// Linear elasticity with Lame's constants, Pa.
pub struct Linear(pub Lame);

impl Energy for Linear {
    const NAME: &'static str = "linear";

    fn psi(&self, F: &Mat3) -> f64 {
        let eps = 0.5 * (F + F.transpose()) - Mat3::identity();
        self.0.mu * eps.norm_squared() + 0.5 * self.0.lambda * eps.trace().powi(2)
    }
    fn P(&self, F: &Mat3) -> Mat3 {
        let eps = 0.5 * (F + F.transpose()) - Mat3::identity();
        2.0 * self.0.mu * eps + self.0.lambda * eps.trace() * Mat3::identity()
    }
    fn dPdF(&self, _F: &Mat3) -> Mat9 {
        let I = Mat3::identity();
        let mut H = self.0.lambda * outer(&I, &I);
        for i in 0..3 {
            for j in 0..3 {
                H[(i + 3 * j, i + 3 * j)] += self.0.mu;
                H[(i + 3 * j, j + 3 * i)] += self.0.mu;
            }
        }
        H
    }
}
