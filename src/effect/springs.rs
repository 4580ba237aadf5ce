//! Springs along the edges of tetrahedra: the mass-spring model, for comparison.
//!
//! ```text
//! W = sum over edges k/2 (|x_b - x_a| - L)^2,   k = E/L^2 sum of V_e over the tetrahedra at the edge
//! ```
//!
//! Source: Van Gelder, "Approximate simulation of elastic membranes by triangulated spring meshes", J. Graphics Tools
//! 3(2), 1998, its tetrahedral analogue. It has no Poisson's ratio and no volume of its own, does not pass the patch test,
//! and an element that is turned inside out costs nothing: its springs have their lengths back.

use std::collections::BTreeMap;

use crate::fem::{At, Curvature, EDGES, Kernel, Strain};
use crate::math::{Mat3, Vec3};
use crate::mesh::signed_volume;

/// A spring: its ends, its rest length (m) and its stiffness (N/m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// Nodes.
    pub ends: [u32; 2],
    /// Rest length.
    pub L: f64,
    /// Stiffness.
    pub k: f64,
}

/// The springs of the edges of `tets` at Young's modulus `E` (Pa), ascending by their ends.
pub fn springs(E: f64, X: &[Vec3], tets: &[[u32; 4]]) -> Vec<Spring> {
    let mut volume: BTreeMap<[u32; 2], f64> = BTreeMap::new();
    for tet in tets {
        let V = signed_volume(tet.map(|a| X[a as usize]));
        for [i, j] in EDGES {
            *volume.entry([tet[i].min(tet[j]), tet[i].max(tet[j])]).or_default() += V;
        }
    }
    let spring = |(ends, V): ([u32; 2], f64)| {
        let L = (X[ends[1] as usize] - X[ends[0] as usize]).norm();
        Spring { ends, L, k: E * V / (L * L) }
    };
    volume.into_iter().map(spring).collect()
}

/// Springs as elements of two nodes. Their ratio of lengths stands where other elements report a ratio of volumes.
pub struct Springs(pub Vec<Spring>);

impl Springs {
    /// Length, direction (zero for a spring of no length) and what it is stretched by.
    fn state(&self, e: usize, x: &[Vec3; 2]) -> (f64, Vec3, f64) {
        let d = x[1] - x[0];
        let l = d.norm();
        let n = if l > f64::MIN_POSITIVE { d / l } else { Vec3::zeros() };
        (l, n, l - self.0[e].L)
    }
}

impl Kernel<2> for Springs {
    fn name(&self) -> &'static str {
        "mass-spring"
    }
    fn len(&self) -> usize {
        self.0.len()
    }
    fn nodes(&self, e: usize) -> [u32; 2] {
        self.0[e].ends
    }
    fn energy(&self, _at: &At, e: usize, x: &[Vec3; 2]) -> f64 {
        let (.., stretch) = self.state(e, x);
        0.5 * self.0[e].k * stretch * stretch
    }
    fn add_gradient(&self, at: &At, x: &[Vec3], g: &mut [Vec3]) -> f64 {
        let mut energy = 0.0;
        for (e, spring) in self.0.iter().enumerate() {
            let ends = spring.ends.map(|a| a as usize);
            let x = ends.map(|a| x[a]);
            let (_, n, stretch) = self.state(e, &x);
            let f = spring.k * stretch * n;
            g[ends[0]] -= f;
            g[ends[1]] += f;
            energy += self.energy(at, e, &x);
        }
        energy
    }
    fn min_det_f(&self, x: &[Vec3]) -> f64 {
        let stretch = |(e, spring): (usize, &Spring)| self.state(e, &spring.ends.map(|a| x[a as usize])).0 / spring.L;
        self.0.iter().enumerate().map(stretch).fold(f64::INFINITY, f64::min)
    }
    fn hessian(&self, _at: &At, e: usize, x: &[Vec3; 2], curvature: Curvature, upper: &mut [Mat3]) {
        let (l, n, stretch) = self.state(e, x);
        let across = if l > f64::MIN_POSITIVE { stretch / l } else { 0.0 };
        let across = if curvature == Curvature::Projected { across.max(0.0) } else { across };
        let nn = n * n.transpose();
        let H = self.0[e].k * (nn + across * (Mat3::identity() - nn));
        upper.copy_from_slice(&[H, -H, H]);
    }
    fn is_elastic(&self) -> bool {
        true
    }
    fn strain(&self, at: &At, e: usize, x: &[Vec3; 2]) -> Strain {
        let stretch = self.state(e, x).0 / self.0[e].L;
        Strain { min_det_f: stretch, max_stretch: stretch, energy: self.energy(at, e, x) }
    }
    fn is_quadratic(&self) -> bool {
        false
    }
}
