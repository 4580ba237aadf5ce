//! Neo-Hookean energy that stays finite through inversion.
//!
//! ```text
//! psi = mu/2 (|F|^2 - 3) - mu (J - 1) + (lambda + mu)/2 (J - 1)^2
//! ```
//!
//! Source: Smith, de Goes & Kim, "Stable Neo-Hookean Flesh Simulation", ACM TOG 37(2), 2018, sections 3.3-3.4.
//! Departure: the paper's logarithm is left out, and `lambda + mu` takes the place of its lambda so that small strains
//! agree with `Linear`; the constant is chosen so that psi(I) = 0.

use super::{Energy, Lame};
use crate::math::{Mat3, Mat9, cofactor, d2JdF2, outer};

/// Stable neo-Hookean tissue with the Lame constants of its small strains, Pa.
pub struct StableNeoHookean(pub Lame);

impl StableNeoHookean {
    fn dpsi_dJ(&self, J: f64) -> f64 {
        (self.0.lambda + self.0.mu) * (J - 1.0) - self.0.mu
    }
}

impl Energy for StableNeoHookean {
    const NAME: &'static str = "stable-neo-hookean";

    fn psi(&self, F: &Mat3) -> f64 {
        let Lame { mu, lambda } = self.0;
        let j = F.determinant() - 1.0;
        0.5 * mu * (F.norm_squared() - 3.0) - mu * j + 0.5 * (lambda + mu) * j * j
    }
    fn P(&self, F: &Mat3) -> Mat3 {
        self.0.mu * F + self.dpsi_dJ(F.determinant()) * cofactor(F)
    }
    fn dPdF(&self, F: &Mat3) -> Mat9 {
        let g = cofactor(F);
        self.0.mu * Mat9::identity()
            + (self.0.lambda + self.0.mu) * outer(&g, &g)
            + self.dpsi_dJ(F.determinant()) * d2JdF2(F)
    }
}
