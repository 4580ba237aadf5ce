//! Pressure that follows the surface: force `-p A n` on each triangle, in equal thirds.
//!
//! ```text
//! W = p sum_T (A n)(x_lag) . (x_0 + x_1 + x_2)/3
//! ```
//!
//! Direction and area are taken at `x_lag`, which the solver brings to `x`; at the solution the load is exact. An open
//! patch has no energy of its own, so the true load cannot stand in a minimisation, the lagged one can.

use crate::fem::{At, Curvature, HessianSink, Term};
use crate::math::Vec3;

/// One pressure on a set of triangles.
pub struct Pressure {
    /// Loaded triangles, wound outward.
    pub triangles: Vec<[u32; 3]>,
    /// Where the pressure (Pa, positive pushes into the tissue) stands among the inputs.
    pub input: usize,
}

impl Pressure {
    fn each(&self, at: &At, mut face: impl FnMut(&[u32; 3], Vec3)) {
        let p = at.inputs[self.input];
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|a| at.x_lag[a as usize]);
            face(triangle, (p / 6.0) * (b - a).cross(&(c - a)));
        }
    }
}

impl Term for Pressure {
    fn name(&self) -> &'static str {
        "pressure"
    }
    fn energy(&self, at: &At, x: &[Vec3]) -> f64 {
        let mut sum = 0.0;
        self.each(at, |triangle, third| sum += triangle.iter().map(|&a| third.dot(&x[a as usize])).sum::<f64>());
        sum
    }
    fn add_gradient(&self, at: &At, x: &[Vec3], g: &mut [Vec3]) -> f64 {
        self.each(at, |triangle, third| triangle.iter().for_each(|&a| g[a as usize] += third));
        self.energy(at, x)
    }
    fn couplings(&self, _clique: &mut dyn FnMut(&[u32])) {}
    fn add_hessian(&self, _at: &At, _x: &[Vec3], _curvature: Curvature, _sink: &mut dyn HessianSink) {}
    fn is_lagged(&self) -> bool {
        true
    }
    fn add_lag_transposed(&self, at: &At, xi: &[Vec3], out: &mut [Vec3]) {
        let p = at.inputs[self.input];
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|a| at.x_lag[a as usize]);
            let s = (p / 6.0) * triangle.iter().map(|&a| xi[a as usize]).sum::<Vec3>();
            // s . ((b - a) x (c - a)) by each of the corners.
            let (by_b, by_c) = ((c - a).cross(&s), s.cross(&(b - a)));
            for (&node, by) in triangle.iter().zip([-(by_b + by_c), by_b, by_c]) {
                out[node as usize] += by;
            }
        }
    }
    fn inputs(&self) -> std::ops::Range<usize> {
        self.input..self.input + 1
    }
    fn is_quadratic(&self) -> bool {
        true
    }
}
