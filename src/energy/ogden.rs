//! Ogden: volume-free powers of the principal stretches.
//!
//! ```text
//! psi = sum_k 2 mu_k/alpha_k^2 (l1^alpha_k + l2^alpha_k + l3^alpha_k - 3) + kappa/2 (J - 1)^2,   l_i = J^(-1/3) s_i
//! ```
//!
//! Source: Ogden, "Large deformation isotropic elasticity", Proc. R. Soc. A 326, 1972, with the normalisation in which
//! the small-strain shear modulus is the sum of the mu_k.

use super::Principal;
use crate::math::{Mat3, Vec3};

/// Terms and bulk modulus.
pub struct Ogden {
    /// Pairs (mu_k in Pa, alpha_k).
    pub terms: Vec<(f64, f64)>,
    /// Bulk modulus, Pa.
    pub kappa: f64,
}

impl Principal for Ogden {
    const NAME: &'static str = "ogden";

    fn psi(&self, s: &Vec3) -> f64 {
        let J = s.product();
        if J <= 0.0 {
            return f64::INFINITY;
        }
        let l = s / J.cbrt();
        let powers = |(mu, alpha): &(f64, f64)| {
            2.0 * mu / (alpha * alpha) * (l.iter().map(|l| l.powf(*alpha)).sum::<f64>() - 3.0)
        };
        self.terms.iter().map(powers).sum::<f64>() + 0.5 * self.kappa * (J - 1.0).powi(2)
    }

    // In e_i = ln s_i the volume-free part is sum 2 mu/alpha^2 exp(alpha (e_i - mean e)); then back by ds = s de.
    fn first(&self, s: &Vec3) -> Vec3 {
        let J = s.product();
        (self.by_logarithm(s) + Vec3::repeat(self.kappa * (J - 1.0) * J)).component_div(s)
    }

    fn second(&self, s: &Vec3) -> Mat3 {
        let J = s.product();
        let first = self.by_logarithm(s) + Vec3::repeat(self.kappa * (J - 1.0) * J);
        let mut H = Mat3::repeat(self.kappa * (2.0 * J - 1.0) * J);
        let l = s / J.cbrt();
        let P = Mat3::identity() - Mat3::repeat(1.0 / 3.0);
        for (mu, alpha) in &self.terms {
            H += P * Mat3::from_diagonal(&l.map(|l| 2.0 * mu * l.powf(*alpha))) * P;
        }
        Mat3::from_fn(|i, j| (H[(i, j)] - if i == j { first[i] } else { 0.0 }) / (s[i] * s[j]))
    }
}

impl Ogden {
    /// Derivative of the volume-free part by ln s.
    fn by_logarithm(&self, s: &Vec3) -> Vec3 {
        let l = s / s.product().cbrt();
        let sum: Vec3 = self.terms.iter().map(|(mu, alpha)| l.map(|l| 2.0 * mu / alpha * l.powf(*alpha))).sum();
        sum - Vec3::repeat(sum.mean())
    }
}
