//! A dead force shared by nodes: a point, a patch of skin, or the body of a region. `W = -f . sum_a w_a x_a`.

use super::input3;
use crate::fem::{At, Curvature, HessianSink, Term};
use crate::math::Vec3;

/// One force, spread over nodes by weights that sum to one.
pub struct DeadLoad {
    /// Loaded nodes and their shares.
    pub shares: Vec<(u32, f64)>,
    /// Where the force (N) stands among the inputs.
    pub input: usize,
}

impl Term for DeadLoad {
    fn name(&self) -> &'static str {
        "load"
    }
    fn energy(&self, at: &At, x: &[Vec3]) -> f64 {
        let f = input3(at.inputs, self.input);
        -self.shares.iter().map(|&(a, w)| w * f.dot(&x[a as usize])).sum::<f64>()
    }
    fn add_gradient(&self, at: &At, x: &[Vec3], g: &mut [Vec3]) -> f64 {
        let f = input3(at.inputs, self.input);
        for &(a, w) in &self.shares {
            g[a as usize] -= w * f;
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
