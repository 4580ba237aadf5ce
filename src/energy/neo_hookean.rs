//! Neo-Hookean energy with the logarithm of J: infinite work to invert.
//!
//! ```text
//! psi = mu/2 (|F|^2 - 3) - mu ln J + lambda/2 (ln J)^2,   +inf for J <= 0
//! ```
//!
//! Source: Bonet & Wood, "Nonlinear Continuum Mechanics for Finite Element Analysis", 2nd ed., 2008, eq. 6.27.

use super::{Energy, Lame};
use crate::math::{Mat3, Mat9, cofactor, d2JdF2, outer};

/// Compressible neo-Hookean tissue with Lame's constants, Pa.
pub struct NeoHookean(pub Lame);

impl Energy for NeoHookean {
    const NAME: &'static str = "neo-hookean";

    fn psi(&self, F: &Mat3) -> f64 {
        let Lame { mu, lambda } = self.0;
        let J = F.determinant();
        if J <= 0.0 {
            return f64::INFINITY;
        }
        let lnJ = J.ln();
        0.5 * mu * (F.norm_squared() - 3.0) - mu * lnJ + 0.5 * lambda * lnJ * lnJ
    }
    fn P(&self, F: &Mat3) -> Mat3 {
        let J = F.determinant();
        self.0.mu * F + ((self.0.lambda * J.ln() - self.0.mu) / J) * cofactor(F)
    }
    fn dPdF(&self, F: &Mat3) -> Mat9 {
        let Lame { mu, lambda } = self.0;
        let J = F.determinant();
        let g = cofactor(F);
        let slope = (lambda * J.ln() - mu) / J;
        let bend = (lambda - lambda * J.ln() + mu) / (J * J);
        mu * Mat9::identity() + bend * outer(&g, &g) + slope * d2JdF2(F)
    }
}
