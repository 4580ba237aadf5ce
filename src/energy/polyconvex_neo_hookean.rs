//! Neo-Hookean energy that never softens with volume: infinite work to invert, polyconvex.
//!
//! ```text
//! psi = mu/2 (|F|^2 - 3) - mu (J - 1) + (lambda + mu)/8 (J - 1/J)^2,   +inf for J <= 0
//! ```
//!
//! A sum of convex functions of F and of J, so equilibria exist, and none of them is reached through an element turned inside
//! out. To second order about rest it is [`super::StableNeoHookean`], whose (J - 1)^2 stands for (J - 1/J)^2/4.
//!
//! Source: Hartmann & Neff, "Polyconvexity of generalized polynomial-type hyperelastic strain energy functions for
//! near-incompressibility", Int. J. Solids Struct. 40, 2003, the volumetric energy J^k + J^-k - 2 with k = 2; the linear
//! term in J after Smith, de Goes & Kim, "Stable Neo-Hookean Flesh Simulation", ACM TOG 37(2), 2018, section 3.3.
//! Departure: `lambda + mu` is the factor of the volumetric part, so that small strains agree with `Linear`.

use super::{Energy, InvariantTangent, Lame};
use crate::math::lane::{Lane, Real, Tensor, cofactors, det, norm_squared, tensor};
use crate::math::{Mat3, Mat9, cofactor, d2JdF2, entries, mat3, outer};

/// Compressible neo-Hookean tissue with the Lame constants of its small strains, Pa.
pub struct PolyconvexNeoHookean(pub Lame);

impl PolyconvexNeoHookean {
    /// d psi/dJ and d2 psi/dJ2, given J and 1/J.
    #[inline(always)]
    fn by_J<T: Real>(&self, J: T, per_J: T) -> (T, T) {
        let Lame { mu, lambda } = self.0;
        let (quarter, per_J2) = (0.25 * (lambda + mu), per_J * per_J);
        ((J - per_J2 * per_J) * quarter - mu, (per_J2 * per_J2 * 3.0 + 1.0) * quarter)
    }

    /// NaN for J <= 0.
    #[inline(always)]
    fn formula<T: Real>(&self, F: &Tensor<T>) -> (T, Tensor<T>) {
        let Lame { mu, lambda } = self.0;
        let g = cofactors(F);
        let J = det(F, &g);
        let per_J = J.map(inverse_of_positive);
        let swollen = J - per_J;
        let (slope, _) = self.by_J(J, per_J);
        let psi = (norm_squared(F) - 3.0) * (0.5 * mu) - (J - 1.0) * mu + swollen * swollen * (0.125 * (lambda + mu));
        (psi, tensor!(|i, k| slope.mul_add(g[i][k], F[i][k] * mu)))
    }
}

/// 1/J, NaN for J <= 0.
#[inline(always)]
fn inverse_of_positive(J: f64) -> f64 {
    if J > 0.0 { 1.0 / J } else { f64::NAN }
}

impl Energy for PolyconvexNeoHookean {
    const NAME: &'static str = "polyconvex-neo-hookean";

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
        let J = F.determinant();
        let g = cofactor(F);
        let (slope, bend) = self.by_J(J, 1.0 / J);
        self.0.mu * Mat9::identity() + bend * outer(&g, &g) + slope * d2JdF2(F)
    }
    const IN_INVARIANTS: bool = true;
    #[inline(always)]
    fn tangent_in<S: pulp::Simd>(
        &self,
        simd: S,
        F: &Tensor<Lane<S>>,
        g: &Tensor<Lane<S>>,
    ) -> InvariantTangent<Lane<S>> {
        let J = det(F, g);
        let (spin, gg) = self.by_J(J, J.map(f64::recip));
        InvariantTangent {
            one: Lane::splat(simd, self.0.mu),
            gg,
            spin,
            ..InvariantTangent::zero(Lane::splat(simd, 0.0))
        }
    }
}
