//! The linear tetrahedron: constant F, one energy evaluation an element.
//!
//! ```text
//! F = sum_a x_a (x) dN_a/dX,   W = V psi(F),   g_a = V P dN_a/dX,   K_ab = V dN_a . dP/dF . dN_b
//! ```
//!
//! Source: Bonet & Wood, "Nonlinear Continuum Mechanics for Finite Element Analysis", 2nd ed., 2008, chapter 9.
//! It locks near incompressibility (Poisson's ratio above 0.45) and in bending.

use super::{Curvature, Kernel, Strain};
use crate::energy::Energy;
use crate::math::{Mat3, Mat9, Vec3, clamp_eigenvalues};

/// Gradients of the four shape functions (1/m) and the volume (m3) of a tetrahedron.
pub fn shape_gradients(X: &[Vec3; 4]) -> ([Vec3; 4], f64) {
    let (a, b, c) = (X[1] - X[0], X[2] - X[0], X[3] - X[0]);
    let det = a.cross(&b).dot(&c);
    let (n1, n2, n3) = (b.cross(&c) / det, c.cross(&a) / det, a.cross(&b) / det);
    ([-(n1 + n2 + n3), n1, n2, n3], det / 6.0)
}

struct Element {
    nodes: [u32; 4],
    dN: [Vec3; 4],
    V: f64,
}

/// Linear tetrahedra of one material.
pub struct Tet4<M> {
    material: M,
    elements: Vec<Element>,
    quadratic: bool,
}

impl<M: Energy> Tet4<M> {
    /// The given tetrahedra of rest positions `X` (positive volumes) made of `material`.
    pub fn new(material: M, X: &[Vec3], tets: impl Iterator<Item = [u32; 4]>) -> Self {
        let elements = tets
            .map(|nodes| {
                let (dN, V) = shape_gradients(&nodes.map(|a| X[a as usize]));
                Element { nodes, dN, V }
            })
            .collect();
        Tet4 { material, elements, quadratic: M::NAME == crate::energy::Linear::NAME }
    }
}

/// F, summed from edge vectors so that a translation changes nothing.
fn deformation(dN: &[Vec3; 4], x: &[Vec3; 4]) -> Mat3 {
    (x[1] - x[0]) * dN[1].transpose() + (x[2] - x[0]) * dN[2].transpose() + (x[3] - x[0]) * dN[3].transpose()
}

impl<M: Energy> Kernel<4> for Tet4<M> {
    fn name(&self) -> &'static str {
        M::NAME
    }
    fn len(&self) -> usize {
        self.elements.len()
    }
    fn nodes(&self, e: usize) -> [u32; 4] {
        self.elements[e].nodes
    }
    fn energy(&self, e: usize, x: &[Vec3; 4]) -> f64 {
        let Element { dN, V, .. } = &self.elements[e];
        V * self.material.psi(&deformation(dN, x))
    }
    fn gradient(&self, e: usize, x: &[Vec3; 4], g: &mut [Vec3; 4]) -> f64 {
        let Element { dN, V, .. } = &self.elements[e];
        let F = deformation(dN, x);
        let (psi, P) = self.material.psi_and_P(&F);
        let VP = *V * P;
        for a in 1..4 {
            g[a] = VP * dN[a];
        }
        g[0] = -(g[1] + g[2] + g[3]);
        V * psi
    }
    fn hessian(&self, e: usize, x: &[Vec3; 4], curvature: Curvature, upper: &mut [Mat3]) {
        let Element { dN, V, .. } = &self.elements[e];
        let mut H = self.material.dPdF(&deformation(dN, x));
        if curvature == Curvature::Projected {
            H = clamp_eigenvalues(&H);
        }
        let half = [1, 2, 3].map(|b| contract(&H, &(*V * dN[b])));
        let block = |a: usize, b: usize| {
            let [h0, h1, h2] = &half[b - 1];
            h0 * dN[a][0] + h1 * dN[a][1] + h2 * dN[a][2]
        };
        let (k11, k12, k13, k22, k23, k33) =
            (block(1, 1), block(1, 2), block(1, 3), block(2, 2), block(2, 3), block(3, 3));
        // Rows sum to zero, since a translation changes nothing.
        let k01 = -(k11 + k12.transpose() + k13.transpose());
        let k02 = -(k12 + k22 + k23.transpose());
        let k03 = -(k13 + k23 + k33);
        let k00 = -(k01 + k02 + k03);
        upper.copy_from_slice(&[0.5 * (k00 + k00.transpose()), k01, k02, k03, k11, k12, k13, k22, k23, k33]);
    }
    fn strain(&self, e: usize, x: &[Vec3; 4]) -> Strain {
        let Element { dN, V, .. } = &self.elements[e];
        let F = deformation(dN, x);
        Strain {
            min_det_f: F.determinant(),
            max_stretch: largest_eigenvalue(&(F.transpose() * F)).max(0.0).sqrt(),
            energy: V * self.material.psi(&F),
        }
    }
    fn is_quadratic(&self) -> bool {
        self.quadratic
    }
}

/// dP/dF . w as three 3x3 slabs, one for each column j of P.
pub(super) fn contract(H: &Mat9, w: &Vec3) -> [Mat3; 3] {
    let slab = |j: usize, l: usize| H.fixed_view::<3, 3>(3 * j, 3 * l);
    [0, 1, 2].map(|j| slab(j, 0) * w[0] + slab(j, 1) * w[1] + slab(j, 2) * w[2])
}

/// Largest eigenvalue of a symmetric matrix, in closed form.
///
/// Source: Smith, "Eigenvalues of a symmetric 3 x 3 matrix", Comm. ACM 4(4), 1961.
pub(super) fn largest_eigenvalue(A: &Mat3) -> f64 {
    let q = A.trace() / 3.0;
    let B = A - q * Mat3::identity();
    let p = (B.norm_squared() / 6.0).sqrt();
    if p <= f64::MIN_POSITIVE {
        return q;
    }
    let r = (0.5 * (B / p).determinant()).clamp(-1.0, 1.0);
    q + 2.0 * p * (r.acos() / 3.0).cos()
}
