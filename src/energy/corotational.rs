//! Corotational elasticity: linear in the stretch, exact in the rotation.
//!
//! ```text
//! psi = mu |F - R|^2 + lambda/2 (tr S - 3)^2,   F = R S
//! P   = 2 mu (F - R) + lambda (tr S - 3) R
//! dR  = R W,   (tr(S) I - S) axl W = axl(R^T dF - dF^T R)
//! ```
//!
//! Source: Sifakis & Barbic, "FEM simulation of 3D deformable solids", SIGGRAPH 2012 course, section 3.4; dR after
//! Barbic, "Exact corotational linear FEM stiffness matrix", 2012. The tangent holds dR/dF.
//! Departure: R comes from the rotation-variant SVD, so the energy stays finite and smooth through inversion.

use pulp::Simd;

use super::{Energy, Lame, lane_by_lane};
use crate::math::lane::{Lane, Real, Tensor, cofactors, det, dot3, norm_squared, tensor};
use crate::math::{Mat3, Mat9, Vec3, Vec9, outer, skew, svd, vec9};

/// Sum of two principal stretches below which the rotation's rate is bounded (inverted elements only).
const LEAST_STRETCH_SUM: f64 = 1e-3;

/// Iterations after which stretches from 1/50 to 50 are rotations to round-off.
const ITERATIONS: usize = 9;
/// Squared distance from its cofactors at which a matrix counts as a rotation.
const ORTHOGONAL: f64 = 1e-26;

/// Corotational elasticity with Lame's constants, Pa.
pub struct Corotational(pub Lame);

/// R of F = R S by Newton's iteration for the polar decomposition, and how far R is from a rotation; it is far where F is
/// inverted, flat or stretched a hundredfold.
///
/// Source: Higham, "Computing the polar decomposition - with applications", SIAM J. Sci. Stat. Comput. 7(4), 1986.
#[inline(always)]
fn rotations<S: Simd>(F: &Tensor<Lane<S>>) -> (Tensor<Lane<S>>, Lane<S>) {
    let mut R = *F;
    for _ in 0..ITERATIONS {
        let g = cofactors(&R);
        let half = det(&R, &g).map(f64::recip) * 0.5;
        R = tensor!(|i, j| half.mul_add(g[i][j], R[i][j] * 0.5));
    }
    let g = cofactors(&R);
    (R, norm_squared(&tensor!(|i, j| R[i][j] - g[i][j])))
}

impl Energy for Corotational {
    const NAME: &'static str = "corotational";

    fn psi(&self, F: &Mat3) -> f64 {
        self.psi_and_P(F).0
    }
    fn P(&self, F: &Mat3) -> Mat3 {
        self.psi_and_P(F).1
    }
    fn psi_and_P(&self, F: &Mat3) -> (f64, Mat3) {
        let Lame { mu, lambda } = self.0;
        let f = svd(F);
        let R = f.U * f.V.transpose();
        let stretch = f.s - Vec3::repeat(1.0);
        let psi = mu * stretch.norm_squared() + 0.5 * lambda * stretch.sum().powi(2);
        (psi, 2.0 * mu * (F - R) + lambda * stretch.sum() * R)
    }
    #[inline(always)]
    fn psi_and_P_in<S: Simd>(&self, simd: S, F: &Tensor<Lane<S>>) -> (Lane<S>, Tensor<Lane<S>>) {
        let Lame { mu, lambda } = self.0;
        let (R, off) = rotations(F);
        if off.largest() < ORTHOGONAL {
            let stretched = tensor!(|i, j| F[i][j] - R[i][j]);
            // tr S - 3 = R : (F - R), with no digits lost to the three.
            let sum = dot3(&R[0], &stretched[0]) + dot3(&R[1], &stretched[1]) + dot3(&R[2], &stretched[2]);
            let psi = (norm_squared(&stretched) * mu) + (sum * sum) * (0.5 * lambda);
            return (psi, tensor!(|i, j| (sum * lambda).mul_add(R[i][j], stretched[i][j] * (2.0 * mu))));
        }
        lane_by_lane(simd, F, |_, F| self.psi_and_P(F))
    }
    fn dPdF(&self, F: &Mat3) -> Mat9 {
        let f = svd(F);
        let R = f.U * f.V.transpose();
        let mut H = 2.0 * self.0.mu * Mat9::identity() + self.0.lambda * outer(&R, &R);
        // Three twists t_i = vec(U skew(e_i) V^T) / sqrt 2 span dR; each is an eigenvector with rate 2 / (s_j + s_k).
        let weight = self.0.lambda * (f.s.sum() - 3.0) - 2.0 * self.0.mu;
        for i in 0..3 {
            let sum = f.s.sum() - f.s[i];
            let sum = if sum.abs() < LEAST_STRETCH_SUM { LEAST_STRETCH_SUM } else { sum };
            let twist: Vec9 = vec9(&(f.U * skew(&Vec3::ith(i, 1.0)) * f.V.transpose())) / std::f64::consts::SQRT_2;
            H += (weight * 2.0 / sum) * twist * twist.transpose();
        }
        H
    }
}
