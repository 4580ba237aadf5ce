//! Neo-Hookean energy with the logarithm of J: infinite work to invert.
//!
//! ```text
//! psi = mu/2 (|F|^2 - 3) - mu ln J + lambda/2 (ln J)^2,   +inf for J <= 0
//! ```
//!
//! Source: Bonet & Wood, "Nonlinear Continuum Mechanics for Finite Element Analysis", 2nd ed., 2008, eq. 6.27.

use super::{Energy, InvariantTangent, Lame};
use crate::math::lane::{Lane, Real, Tensor, cofactors, det, norm_squared, tensor};
use crate::math::{Mat3, Mat9, cofactor, d2JdF2, entries, mat3, outer};

/// Compressible neo-Hookean tissue with Lame's constants, Pa.
pub struct NeoHookean(pub Lame);

impl NeoHookean {
    /// NaN for J < 0.
    #[inline(always)]
    fn formula<T: Real>(&self, F: &Tensor<T>) -> (T, Tensor<T>) {
        let Lame { mu, lambda } = self.0;
        let g = cofactors(F);
        let J = det(F, &g);
        let lnJ = J.map(f64::ln);
        let slope = (lnJ * lambda - mu) * J.map(f64::recip);
        let psi = (norm_squared(F) - 3.0) * (0.5 * mu) - lnJ * mu + lnJ * lnJ * (0.5 * lambda);
        (psi, tensor!(|i, k| slope.mul_add(g[i][k], F[i][k] * mu)))
    }
}

impl Energy for NeoHookean {
    const NAME: &'static str = "neo-hookean";

    fn psi(&self, F: &Mat3) -> f64 {
        self.psi_and_P(F).0
    }
    fn P(&self, F: &Mat3) -> Mat3 {
        self.psi_and_P(F).1
    }
    fn psi_and_P(&self, F: &Mat3) -> (f64, Mat3) {
        let (psi, P) = self.formula(&entries(F));
        (if psi.is_nan() { f64::INFINITY } else { psi }, mat3(&P))
    }
    #[inline(always)]
    fn psi_and_P_in<S: pulp::Simd>(&self, _: S, F: &Tensor<Lane<S>>) -> (Lane<S>, Tensor<Lane<S>>) {
        self.formula(F)
    }
    fn dPdF(&self, F: &Mat3) -> Mat9 {
        let Lame { mu, lambda } = self.0;
        let J = F.determinant();
        let g = cofactor(F);
        let slope = (lambda * J.ln() - mu) / J;
        let bend = (lambda - lambda * J.ln() + mu) / (J * J);
        mu * Mat9::identity() + bend * outer(&g, &g) + slope * d2JdF2(F)
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
        let J = det(F, g);
        let (lnJ, per_J) = (J.map(f64::ln), J.map(f64::recip));
        InvariantTangent {
            one: Lane::splat(simd, mu),
            gg: (lnJ * -lambda + (lambda + mu)) * per_J * per_J,
            spin: (lnJ * lambda - mu) * per_J,
            ..InvariantTangent::zero(Lane::splat(simd, 0.0))
        }
    }
}
