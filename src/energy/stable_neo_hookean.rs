//! Neo-Hookean energy that stays finite through inversion.
//!
//! ```text
//! psi = mu/2 (|F|^2 - 3) - mu (J - 1) + (lambda + mu)/2 (J - 1)^2
//! ```
//!
//! Source: Smith, de Goes & Kim, "Stable Neo-Hookean Flesh Simulation", ACM TOG 37(2), 2018, sections 3.3-3.4.
//! Departure: the paper's logarithm is left out, and `lambda + mu` takes the place of its lambda so that small strains
//! agree with `Linear`; the constant is chosen so that psi(I) = 0.

use super::{Energy, InvariantTangent, Lame};
use crate::math::lane::{Lane, Real, Tensor, cofactors, det, norm_squared, tensor};
use crate::math::{Mat3, Mat9, cofactor, d2JdF2, entries, mat3, outer};

/// Stable neo-Hookean tissue with the Lame constants of its small strains, Pa.
pub struct StableNeoHookean(pub Lame);

impl StableNeoHookean {
    #[inline(always)]
    fn dpsi_dJ<T: Real>(&self, J: T) -> T {
        (J - 1.0) * (self.0.lambda + self.0.mu) - self.0.mu
    }

    #[inline(always)]
    fn formula<T: Real>(&self, F: &Tensor<T>) -> (T, Tensor<T>) {
        let Lame { mu, lambda } = self.0;
        let g = cofactors(F);
        let j = det(F, &g) - 1.0;
        let slope = self.dpsi_dJ(j + 1.0);
        let psi = (norm_squared(F) - 3.0) * (0.5 * mu) - j * mu + j * j * (0.5 * (lambda + mu));
        (psi, tensor!(|i, k| slope.mul_add(g[i][k], F[i][k] * mu)))
    }
}

impl Energy for StableNeoHookean {
    const NAME: &'static str = "stable-neo-hookean";

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
        let g = cofactor(F);
        self.0.mu * Mat9::identity()
            + (self.0.lambda + self.0.mu) * outer(&g, &g)
            + self.dpsi_dJ(F.determinant()) * d2JdF2(F)
    }
    const IN_INVARIANTS: bool = true;
    #[inline(always)]
    fn tangent_in<S: pulp::Simd>(
        &self,
        simd: S,
        F: &Tensor<Lane<S>>,
        g: &Tensor<Lane<S>>,
    ) -> InvariantTangent<Lane<S>> {
        let Lame { mu, lambda } = self.0;
        InvariantTangent {
            one: Lane::splat(simd, mu),
            gg: Lane::splat(simd, lambda + mu),
            spin: self.dpsi_dJ(det(F, g)),
            ..InvariantTangent::zero(Lane::splat(simd, 0.0))
        }
    }
}
