//! Graded stiffness: a material whose energy is scaled from point to point, for tissue that stiffens towards the bone.
//!
//! ```text
//! psi(F; p) = s_p psi0(F)
//! ```

use crate::fem::{At, Material};
use crate::math::{Mat3, Mat9};

/// A material times a factor of each point.
pub struct Graded<M> {
    /// The material at factor 1.
    pub material: M,
    /// Factor at each point of integration, positive.
    pub factor: Vec<f64>,
}

impl<M: Material> Material for Graded<M> {
    fn name(&self) -> &'static str {
        self.material.name()
    }
    fn psi(&self, at: &At, p: usize, F: &Mat3) -> f64 {
        self.factor[p] * self.material.psi(at, p, F)
    }
    fn psi_and_P(&self, at: &At, p: usize, F: &Mat3) -> (f64, Mat3) {
        let (psi, P) = self.material.psi_and_P(at, p, F);
        (self.factor[p] * psi, self.factor[p] * P)
    }
    fn dPdF(&self, at: &At, p: usize, F: &Mat3) -> Mat9 {
        self.factor[p] * self.material.dPdF(at, p, F)
    }
    fn is_quadratic(&self) -> bool {
        self.material.is_quadratic()
    }
    fn is_elastic(&self) -> bool {
        self.material.is_elastic()
    }
    fn inputs(&self) -> std::ops::Range<usize> {
        self.material.inputs()
    }
    fn remembers(&self) -> bool {
        self.material.remembers()
    }
    fn commit(&self, at: &At, p: usize, F: &Mat3, history: &mut [f64]) {
        self.material.commit(at, p, F, history);
    }
}
