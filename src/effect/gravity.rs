//! Weight of the tissue: `W = -sum_a m_a (g - g_scan) . x_a`.
//!
//! The shape at rest may already hang as it did in the scan; only what differs from that moves it.

use super::input3;
use crate::fem::{At, Curvature, HessianSink, Term};
use crate::math::Vec3;

/// Gravity on lumped nodal masses.
pub struct Gravity {
    /// Mass of each node, kg.
    pub m: Vec<f64>,
    /// Where the acceleration (m/s2) stands among the inputs.
    pub input: usize,
    /// Acceleration that the shape at rest already carries, m/s2.
    pub scan: Vec3,
}

impl Term for Gravity {
    fn name(&self) -> &'static str {
        "gravity"
    }
    fn energy(&self, at: &At, x: &[Vec3]) -> f64 {
        let acceleration = input3(at.inputs, self.input) - self.scan;
        -self.m.iter().zip(x).map(|(m, x)| m * acceleration.dot(x)).sum::<f64>()
    }
    fn add_gradient(&self, at: &At, x: &[Vec3], g: &mut [Vec3]) -> f64 {
        let acceleration = input3(at.inputs, self.input) - self.scan;
        for (m, g) in self.m.iter().zip(g) {
            *g -= *m * acceleration;
        }
        self.energy(at, x)
    }
    fn couplings(&self, _clique: &mut dyn FnMut(&[u32])) {}
    fn add_hessian(&self, _at: &At, _x: &[Vec3], _curvature: Curvature, _sink: &mut dyn HessianSink) {}
    fn inputs(&self) -> std::ops::Range<usize> {
        self.input..self.input + 3
    }
    fn is_quadratic(&self) -> bool {
        true
    }
}
