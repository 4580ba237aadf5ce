//! Strain limits of tissue, the same everywhere or narrower towards the bone.

use crate::energy::{Energy, StrainLimit, Stretches};
use crate::fem::{At, Material};
use crate::math::{Mat3, Mat9};

/// Limits that differ from point to point.
pub struct Limits(pub Vec<StrainLimit>);

impl Material for Limits {
    fn name(&self) -> &'static str {
        "strain limit"
    }
    fn psi(&self, _at: &At, p: usize, F: &Mat3) -> f64 {
        Stretches(self.0[p]).psi(F)
    }
    fn psi_and_P(&self, _at: &At, p: usize, F: &Mat3) -> (f64, Mat3) {
        Stretches(self.0[p]).psi_and_P(F)
    }
    fn dPdF(&self, _at: &At, p: usize, F: &Mat3) -> Mat9 {
        Stretches(self.0[p]).dPdF(F)
    }
}
