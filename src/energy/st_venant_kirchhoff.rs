//! St. Venant-Kirchhoff energy: linear law between Green-Lagrange strain and second Piola-Kirchhoff stress.
//!
//! ```text
//! psi = mu |E|^2 + lambda/2 tr(E)^2,   E = (F^T F - I)/2,   P = F S,   S = 2 mu E + lambda tr(E) I
//! ```
//!
//! Source: Bonet & Wood, "Nonlinear Continuum Mechanics for Finite Element Analysis", 2nd ed., 2008, section 6.4.2.
//! It softens under compression (no convexity below a stretch of about 0.58): for moderate strain only.

use super::{Energy, Lame};
use crate::math::{Mat3, Mat9, outer};

/// St. Venant-Kirchhoff tissue with Lame's constants, Pa.
pub struct StVenantKirchhoff(pub Lame);

impl StVenantKirchhoff {
    fn S(&self, F: &Mat3) -> Mat3 {
        let E = 0.5 * (F.transpose() * F - Mat3::identity());
        2.0 * self.0.mu * E + self.0.lambda * E.trace() * Mat3::identity()
    }
}

impl Energy for StVenantKirchhoff {
    const NAME: &'static str = "st-venant-kirchhoff";

    fn psi(&self, F: &Mat3) -> f64 {
        let E = 0.5 * (F.transpose() * F - Mat3::identity());
        self.0.mu * E.norm_squared() + 0.5 * self.0.lambda * E.trace().powi(2)
    }
    fn P(&self, F: &Mat3) -> Mat3 {
        F * self.S(F)
    }
    fn dPdF(&self, F: &Mat3) -> Mat9 {
        // dP_ij/dF_kl = d_ik S_jl + mu (F_il F_kj + (F F^T)_ik d_jl) + lambda F_ij F_kl
        let S = self.S(F);
        let B = F * F.transpose();
        let mut H = self.0.lambda * outer(F, F);
        for j in 0..3 {
            for i in 0..3 {
                for l in 0..3 {
                    for k in 0..3 {
                        let mut h = self.0.mu * F[(i, l)] * F[(k, j)];
                        if i == k {
                            h += S[(j, l)];
                        }
                        if j == l {
                            h += self.0.mu * B[(i, k)];
                        }
                        H[(i + 3 * j, k + 3 * l)] += h;
                    }
                }
            }
        }
        H
    }
}
