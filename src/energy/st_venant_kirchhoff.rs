//! St. Venant-Kirchhoff energy: linear law between Green-Lagrange strain and second Piola-Kirchhoff stress.
//!
//! ```text
//! psi = mu |E|^2 + lambda/2 tr(E)^2,   E = (F^T F - I)/2,   P = F S,   S = 2 mu E + lambda tr(E) I
//! ```
//!
//! Source: Bonet & Wood, "Nonlinear Continuum Mechanics for Finite Element Analysis", 2nd ed., 2008, section 6.4.2.
//! It softens under compression (no convexity below a stretch of about 0.58): for moderate strain only.

use super::{Energy, Lame};
use crate::math::lane::{Lane, Real, Tensor, dot3, norm_squared, tensor, trace};
use crate::math::{Mat3, Mat9, entries, mat3, outer};

/// St. Venant-Kirchhoff tissue with Lame's constants, Pa.
pub struct StVenantKirchhoff(pub Lame);

impl StVenantKirchhoff {
    /// The energy density and S, Pa.
    #[inline(always)]
    fn psi_and_S<T: Real>(&self, F: &Tensor<T>) -> (T, Tensor<T>) {
        let Lame { mu, lambda } = self.0;
        let column = |j: usize| [F[0][j], F[1][j], F[2][j]];
        let E = tensor!(|i, j| {
            let C = dot3(&column(i), &column(j));
            (if i == j { C - 1.0 } else { C }) * 0.5
        });
        let pressure = trace(&E) * lambda;
        let psi = norm_squared(&E) * mu + pressure * trace(&E) * 0.5;
        (psi, tensor!(|i, j| if i == j { E[i][i] * (2.0 * mu) + pressure } else { E[i][j] * (2.0 * mu) }))
    }

    #[inline(always)]
    fn formula<T: Real>(&self, F: &Tensor<T>) -> (T, Tensor<T>) {
        let (psi, S) = self.psi_and_S(F);
        (psi, tensor!(|i, j| dot3(&F[i], &S[j])))
    }
}

impl Energy for StVenantKirchhoff {
    const NAME: &'static str = "st-venant-kirchhoff";

    fn psi(&self, F: &Mat3) -> f64 {
        self.formula(&entries(F)).0
    }
    fn P(&self, F: &Mat3) -> Mat3 {
        mat3(&self.formula(&entries(F)).1)
    }
    fn psi_and_P(&self, F: &Mat3) -> (f64, Mat3) {
        let (psi, P) = self.formula(&entries(F));
        (psi, mat3(&P))
    }
    #[inline(always)]
    fn psi_and_P_in<S: pulp::Simd>(&self, _: S, F: &Tensor<Lane<S>>) -> (Lane<S>, Tensor<Lane<S>>) {
        self.formula(F)
    }
    fn dPdF(&self, F: &Mat3) -> Mat9 {
        // dP_ij/dF_kl = d_ik S_jl + mu (F_il F_kj + (F F^T)_ik d_jl) + lambda F_ij F_kl
        let S = mat3(&self.psi_and_S(&entries(F)).1);
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
