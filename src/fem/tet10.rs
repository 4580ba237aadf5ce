//! The quadratic tetrahedron: ten nodes, four points of integration.
//!
//! ```text
//! N_i = L_i (2 L_i - 1) at corners,   N_ij = 4 L_i L_j at mid-edges
//! W = sum_q w_q psi(F_q),   g_a = sum_q w_q P_q dN_a,   K_ab = sum_q w_q dN_a . dP/dF . dN_b
//! ```
//!
//! Source: Zienkiewicz, Taylor & Zhu, "The Finite Element Method", 7th ed., 2013, sections 6.2 and 6.6; the points are
//! exact for polynomials of degree 2. It bends and, up to a Poisson's ratio of about 0.499, does not lock.

use super::quadratic::EDGES;
use super::tet4::{contract, largest_eigenvalue};
use super::{Curvature, Kernel, Strain};
use crate::energy::Energy;
use crate::math::{Mat3, Vec3, clamp_eigenvalues};

/// Barycentric coordinate of a point's near corner, (5 + 3 sqrt 5)/20; the other three are [`FAR`].
const NEAR: f64 = 0.585_410_196_624_968_5;
/// (5 - sqrt 5)/20.
const FAR: f64 = 0.138_196_601_125_010_5;

/// Gradients of the ten shape functions (1/m) and the weight (m3) at the four points.
struct Point {
    dN: [Vec3; 10],
    w: f64,
}

/// Quadratic tetrahedra of one material.
pub struct Tet10<M> {
    material: M,
    nodes: Vec<[u32; 10]>,
    points: Vec<[Point; 4]>,
    quadratic: bool,
}

impl<M: Energy> Tet10<M> {
    /// The given tetrahedra of rest positions `X`: four corners, then six mid-edge nodes in the order of `EDGES`.
    pub fn new(material: M, X: &[Vec3], tets: impl Iterator<Item = [u32; 10]>) -> Self {
        let nodes: Vec<[u32; 10]> = tets.collect();
        let points = nodes.iter().map(|n| points(&n.map(|a| X[a as usize]))).collect();
        Tet10 { material, nodes, points, quadratic: M::NAME == crate::energy::Linear::NAME }
    }
}

/// Derivatives of the shape functions by the barycentric coordinates L1, L2, L3 (L0 = 1 - L1 - L2 - L3).
fn reference_gradients(L: [f64; 4]) -> [Vec3; 10] {
    let dL = [Vec3::repeat(-1.0), Vec3::x(), Vec3::y(), Vec3::z()];
    let mut dN = [Vec3::zeros(); 10];
    for i in 0..4 {
        dN[i] = (4.0 * L[i] - 1.0) * dL[i];
    }
    for (k, [i, j]) in EDGES.into_iter().enumerate() {
        dN[4 + k] = 4.0 * (L[i] * dL[j] + L[j] * dL[i]);
    }
    dN
}

fn points(X: &[Vec3; 10]) -> [Point; 4] {
    [0, 1, 2, 3].map(|q| {
        let mut L = [FAR; 4];
        L[q] = NEAR;
        let dN = reference_gradients(L);
        let jacobian: Mat3 = X.iter().zip(&dN).map(|(X, d)| X * d.transpose()).sum();
        let inverse = jacobian.try_inverse().expect("rest volumes are positive");
        Point { dN: dN.map(|d| inverse.tr_mul(&d)), w: jacobian.determinant() / 24.0 }
    })
}

/// F; the shape gradients sum to zero, so positions are taken relative to the first corner to keep digits.
fn deformation(dN: &[Vec3; 10], x: &[Vec3; 10]) -> Mat3 {
    (1..10).map(|a| (x[a] - x[0]) * dN[a].transpose()).sum()
}

impl<M: Energy> Kernel<10> for Tet10<M> {
    fn name(&self) -> &'static str {
        M::NAME
    }
    fn len(&self) -> usize {
        self.nodes.len()
    }
    fn nodes(&self, e: usize) -> [u32; 10] {
        self.nodes[e]
    }
    fn energy(&self, e: usize, x: &[Vec3; 10]) -> f64 {
        self.points[e].iter().map(|q| q.w * self.material.psi(&deformation(&q.dN, x))).sum()
    }
    fn gradient(&self, e: usize, x: &[Vec3; 10], g: &mut [Vec3; 10]) -> f64 {
        *g = [Vec3::zeros(); 10];
        let mut energy = 0.0;
        for q in &self.points[e] {
            let (psi, P) = self.material.psi_and_P(&deformation(&q.dN, x));
            energy += q.w * psi;
            for (g, dN) in g.iter_mut().zip(&q.dN) {
                *g += q.w * (P * dN);
            }
        }
        energy
    }
    fn hessian(&self, e: usize, x: &[Vec3; 10], curvature: Curvature, upper: &mut [Mat3]) {
        upper.fill(Mat3::zeros());
        for q in &self.points[e] {
            let mut H = self.material.dPdF(&deformation(&q.dN, x));
            if curvature == Curvature::Projected {
                H = clamp_eigenvalues(&H);
            }
            let half = q.dN.map(|dN| contract(&H, &(q.w * dN)));
            let mut blocks = upper.iter_mut();
            for a in 0..10 {
                for half_b in &half[a..] {
                    let block = blocks.next().expect("55 blocks");
                    for j in 0..3 {
                        *block += q.dN[a][j] * half_b[j];
                    }
                }
            }
        }
    }
    fn strain(&self, e: usize, x: &[Vec3; 10]) -> Strain {
        self.points[e].iter().fold(Strain::NONE, |s, q| {
            let F = deformation(&q.dN, x);
            s.and(Strain {
                min_det_f: F.determinant(),
                max_stretch: largest_eigenvalue(&F.tr_mul(&F)).max(0.0).sqrt(),
                energy: q.w * self.material.psi(&F),
            })
        })
    }
    fn is_quadratic(&self) -> bool {
        self.quadratic
    }
}
