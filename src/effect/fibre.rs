//! Passive fibres: a family of collagen fibres with a mean direction, dispersion and crimp.
//!
//! ```text
//! psi = k1/(2 k2) (exp(k2 E^2) - 1) for E > 0, else 0;   E = H : F^T F - l0^2,   H = kappa I + (1 - 3 kappa) f0 f0^T
//! ```
//!
//! `kappa` is the dispersion: 0 for fibres that all run along `f0`, 1/3 for fibres in every direction. `l0` is the crimp
//! stretch below which fibres are slack (root mean square over the family); 1 for none.
//!
//! Source: Gasser, Ogden & Holzapfel, "Hyperelastic modelling of arterial layers with distributed collagen fibre
//! orientations", J. R. Soc. Interface 3, 2006, eqs. 4.5-4.8. Departures: F itself rather than its volume-free part, since
//! fibres do not feel a change of volume as such (Nolan, Gower, Destrade, Ogden & McGarry, J. Mech. Behav. Biomed. Mater.
//! 39, 2014), and the crimp.

use crate::fem::{At, Material};
use crate::math::{Mat3, Mat9, Vec3, outer};

/// One family of fibres.
pub struct Fibre {
    /// Unit mean direction at rest, one a point of integration.
    pub direction: Vec<Vec3>,
    /// Stress scale, Pa.
    pub k1: f64,
    /// Stiffening exponent.
    pub k2: f64,
    /// Dispersion, 0..1/3.
    pub kappa: f64,
    /// Crimp stretch, 1 or more.
    pub slack: f64,
}

impl Fibre {
    /// E and F H at point `p`.
    fn strain(&self, p: usize, F: &Mat3) -> (f64, Mat3) {
        let f0 = &self.direction[p];
        let FH = self.kappa * F + (1.0 - 3.0 * self.kappa) * (F * f0) * f0.transpose();
        (F.dot(&FH) - self.slack * self.slack, FH)
    }

    /// psi and its first two derivatives by E > 0.
    fn along(&self, E: f64) -> [f64; 3] {
        let Fibre { k1, k2, .. } = *self;
        let power = k2 * E * E;
        let growth = power.exp();
        [0.5 * k1 / k2 * power.exp_m1(), k1 * E * growth, k1 * (1.0 + 2.0 * power) * growth]
    }
}

impl Material for Fibre {
    fn name(&self) -> &'static str {
        "fibre"
    }
    fn psi(&self, _at: &At, p: usize, F: &Mat3) -> f64 {
        let (E, _) = self.strain(p, F);
        if E > 0.0 { self.along(E)[0] } else { 0.0 }
    }
    fn psi_and_P(&self, _at: &At, p: usize, F: &Mat3) -> (f64, Mat3) {
        let (E, FH) = self.strain(p, F);
        if E <= 0.0 {
            return (0.0, Mat3::zeros());
        }
        let [psi, first, _] = self.along(E);
        (psi, 2.0 * first * FH)
    }
    fn dPdF(&self, _at: &At, p: usize, F: &Mat3) -> Mat9 {
        let (E, FH) = self.strain(p, F);
        let mut C = Mat9::zeros();
        if E <= 0.0 {
            return C;
        }
        let [_, first, second] = self.along(E);
        let f0 = &self.direction[p];
        for j in 0..3 {
            for l in 0..3 {
                let H = if j == l { self.kappa } else { 0.0 } + (1.0 - 3.0 * self.kappa) * f0[j] * f0[l];
                for i in 0..3 {
                    C[(i + 3 * j, i + 3 * l)] = 2.0 * first * H;
                }
            }
        }
        C + 4.0 * second * outer(&FH, &FH)
    }
}
