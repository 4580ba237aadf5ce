//! Small-strain linear elasticity.
//!
//! ```text
//! psi = mu |eps|^2 + lambda/2 tr(eps)^2,   eps = (F + F^T)/2 - I
//! ```
//!
//! Source: Bonet & Wood, "Nonlinear Continuum Mechanics for Finite Element Analysis", 2nd ed., 2008, section 6.6.6.
//! It is not objective: a rotation costs energy. Use it for small motion.

use super::{Energy, Lame};
use crate::math::lane::{Lane, Real, Tensor, norm_squared, tensor, trace};
use crate::math::{Mat3, Mat9, entries, mat3, outer};

/// Linear elasticity with Lame's constants, Pa.
pub struct Linear(pub Lame);

impl Linear {
    #[inline(always)]
    fn formula<T: Real>(&self, F: &Tensor<T>) -> (T, Tensor<T>) {
        let Lame { mu, lambda } = self.0;
        let eps = tensor!(|i, j| if i == j { F[i][i] - 1.0 } else { (F[i][j] + F[j][i]) * 0.5 });
        let pressure = trace(&eps) * lambda;
        let psi = norm_squared(&eps) * mu + pressure * trace(&eps) * 0.5;
        (psi, tensor!(|i, j| if i == j { eps[i][i] * (2.0 * mu) + pressure } else { eps[i][j] * (2.0 * mu) }))
    }
}

impl Energy for Linear {
    const NAME: &'static str = "linear";

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
