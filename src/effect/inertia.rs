//! Inertia as a term of the step's energy, with lumped masses.
//!
//! ```text
//! W = k/2 sum_a m_a |x_a - x_tilde_a|^2
//! ```
//!
//! The scheme of the scene says what k (1/s2) and x_tilde are, mass damping included; for backward Euler without damping
//! `k = 1/dt^2`, `x_tilde = x_n + dt v_n`. It is silent while the start equilibrium is sought (k = 0).
//!
//! Source: Martin, Thomaszewski, Grinspun & Gross, "Example-based elastic materials", ACM TOG 30(4), 2011, section 4.

use crate::fem::{At, Curvature, EDGES, HessianSink, Term, tet10_points};
use crate::math::{Mat3, Vec3};
use crate::mesh::TetMesh;

/// Share of a quadratic tetrahedron's mass at a corner and at a mid-edge node.
///
/// Source: Hinton, Rock & Zienkiewicz, "A note on mass lumping", Earthquake Eng. Struct. Dyn. 4(3), 1976.
const CORNER: f64 = 1.0 / 36.0;
const MIDSIDE: f64 = 4.0 / 27.0;

/// Mass of each node, kg: a quarter of a linear tetrahedron's to each corner, in proportion to the diagonal of the
/// consistent mass matrix for a quadratic one; `density` by region, kg/m3.
pub fn lumped_masses(mesh: &TetMesh, midsides: &[[u32; 6]], density: &[f64]) -> Vec<f64> {
    let mut m = vec![0.0; mesh.nodes.len()];
    for (e, tet) in mesh.tets.iter().enumerate() {
        let mass = density[mesh.region[e] as usize] * midsides.get(e).map_or(mesh.volume(e), |m| volume(mesh, e, m));
        let corner = if midsides.is_empty() { 0.25 } else { CORNER };
        tet.iter().for_each(|&a| m[a as usize] += corner * mass);
        midsides.get(e).into_iter().flatten().for_each(|&a| m[a as usize] += MIDSIDE * mass);
    }
    m
}

/// Volume of a quadratic tetrahedron, whose edges may be curved.
fn volume(mesh: &TetMesh, e: usize, midsides: &[u32; 6]) -> f64 {
    let X = |a: u32| mesh.nodes[a as usize];
    let tet = &mesh.tets[e];
    let straight = |(&m, [i, j]): (&u32, [usize; 2])| X(m) == 0.5 * (X(tet[i]) + X(tet[j]));
    if midsides.iter().zip(EDGES).all(straight) {
        return mesh.volume(e);
    }
    let nodes = std::array::from_fn(|k| X(if k < 4 { tet[k] } else { midsides[k - 4] }));
    tet10_points(&nodes).iter().map(|p| p.w).sum()
}

/// Inertia of lumped nodal masses, kg.
pub struct Inertia {
    /// Mass of each node.
    pub m: Vec<f64>,
}

impl Term for Inertia {
    fn name(&self) -> &'static str {
        "inertia"
    }
    fn energy(&self, at: &At, x: &[Vec3]) -> f64 {
        if at.inertia == 0.0 {
            return 0.0;
        }
        let sum: f64 = self.m.iter().zip(x).zip(at.x_tilde).map(|((m, x), y)| m * (x - y).norm_squared()).sum();
        0.5 * at.inertia * sum
    }
    fn add_gradient(&self, at: &At, x: &[Vec3], g: &mut [Vec3]) -> f64 {
        if at.inertia == 0.0 {
            return 0.0;
        }
        for (((m, x), y), g) in self.m.iter().zip(x).zip(at.x_tilde).zip(g) {
            *g += at.inertia * m * (x - y);
        }
        self.energy(at, x)
    }
    fn couplings(&self, clique: &mut dyn FnMut(&[u32])) {
        for a in 0..self.m.len() as u32 {
            clique(&[a]);
        }
    }
    fn add_hessian(&self, at: &At, _x: &[Vec3], _curvature: Curvature, sink: &mut dyn HessianSink) {
        for (a, m) in self.m.iter().enumerate() {
            sink.add(&[a as u32], &[at.inertia * m * Mat3::identity()]);
        }
    }
    fn is_quadratic(&self) -> bool {
        true
    }
}
