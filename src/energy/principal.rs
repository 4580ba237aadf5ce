//! Isotropic laws in the principal stretches, and how they become functions of F.
//!
//! ```text
//! P = U diag(psi_i) V^T
//! dP/dF has 3 scaling modes psi_ij, 3 flips (psi_i - psi_j)/(s_i - s_j), 3 twists (psi_i + psi_j)/(s_i + s_j)
//! ```
//!
//! Source: Zhu, "Analytic eigensystems for isotropic membrane energies", 2021, section 3; Stomakhin, Howes, Schroeder &
//! Teran, "Energetically consistent invertible elasticity", SCA 2012, supplement.

use super::Energy;
use crate::math::{Mat3, Mat9, Vec3, Vec9, svd, vec9};

/// A law psi(s1, s2, s3), symmetric in its arguments.
pub trait Principal: Send + Sync {
    /// Name by which a scene chooses it.
    const NAME: &'static str;
    /// psi, J/m3; +inf outside its domain.
    fn psi(&self, s: &Vec3) -> f64;
    /// d psi / ds_i, Pa.
    fn first(&self, s: &Vec3) -> Vec3;
    /// d2 psi / ds_i ds_j, Pa.
    fn second(&self, s: &Vec3) -> Mat3;
}

/// A law in principal stretches as an [`Energy`].
pub struct Stretches<L>(pub L);

/// Stretches closer than this (relative) count as equal; the quotient then loses half the digits, its limit none.
const EQUAL: f64 = 1e-6;

impl<L: Principal> Energy for Stretches<L> {
    const NAME: &'static str = L::NAME;

    fn psi(&self, F: &Mat3) -> f64 {
        self.0.psi(&svd(F).s)
    }
    fn P(&self, F: &Mat3) -> Mat3 {
        let f = svd(F);
        f.U * Mat3::from_diagonal(&self.0.first(&f.s)) * f.V.transpose()
    }
    fn dPdF(&self, F: &Mat3) -> Mat9 {
        let f = svd(F);
        let (s, first, second) = (f.s, self.0.first(&f.s), self.0.second(&f.s));
        let mode = |i: usize, j: usize| -> Vec9 { vec9(&(f.U.column(i) * f.V.column(j).transpose())) };
        let mut H = Mat9::zeros();
        for i in 0..3 {
            for j in 0..3 {
                H += second[(i, j)] * mode(i, i) * mode(j, j).transpose();
            }
        }
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            let (sum, gap) = (s[i] + s[j], s[i] - s[j]);
            let flip = if gap.abs() > EQUAL * sum.abs() {
                (first[i] - first[j]) / gap
            } else {
                0.5 * (second[(i, i)] + second[(j, j)]) - second[(i, j)]
            };
            // Opposite stretches of an inverted F: the decomposition turns over there, and no twist is its own.
            let twist = if sum.abs() > f64::MIN_POSITIVE { (first[i] + first[j]) / sum } else { 0.0 };
            let (a, b) = (mode(i, j), mode(j, i));
            let (symmetric, skew) = ((a + b), (a - b));
            H += 0.5 * flip * symmetric * symmetric.transpose() + 0.5 * twist * skew * skew.transpose();
        }
        H
    }
}
