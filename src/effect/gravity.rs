//! Weight of the tissue: `W = -sum_a m_a g . x_a`.

use super::input3;
use crate::fem::{At, Curvature, HessianSink, Term};
use crate::math::Vec3;

/// Gravity on lumped nodal masses.
pub struct Gravity {
    /// Mass of each node, kg.
    pub m: Vec<f64>,
    /// Where the acceleration (m/s2) stands among the inputs.
    pub input: usize,
}

impl Term for Gravity {
    fn name(&self) -> &'static str {
        "gravity"
    }
    fn energy(&self, at: &At, x: &[Vec3]) -> f64 {
        let acceleration = input3(at.inputs, self.input);
        -self.m.iter().zip(x).map(|(m, x)| m * acceleration.dot(x)).sum::<f64>()
    }
    fn add_gradient(&self, at: &At, x: &[Vec3], g: &mut [Vec3]) -> f64 {
        let acceleration = input3(at.inputs, self.input);
        for (m, g) in self.m.iter().zip(g) {
            *g -= *m * acceleration;
        }
        self.energy(at, x)
    }
    fn couplings(&self, _clique: &mut dyn FnMut(&[u32])) {}
    fn add_hessian(&self, _at: &At, _x: &[Vec3], _curvature: Curvature, _sink: &mut dyn HessianSink) {}
    fn is_quadratic(&self) -> bool {
        true
    }
}
