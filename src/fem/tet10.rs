//! The quadratic tetrahedron: four corners, six mid-edge nodes, four points.
//!
//! ```text
//! N_i = L_i (2 L_i - 1) at corners,   N_ij = 4 L_i L_j at mid-edges
//! ```
//!
//! Source: Zienkiewicz, Taylor & Zhu, "The Finite Element Method", 7th ed., 2013, sections 6.2 and 6.6; the points are
//! exact for polynomials of degree 2. It bends and, up to a Poisson's ratio of about 0.499, does not lock.

use super::quadratic::EDGES;
use super::solid::Point;
use crate::math::{Mat3, Vec3};

/// Barycentric coordinate of a point's near corner, (5 + 3 sqrt 5)/20; the other three are [`FAR`].
const NEAR: f64 = 0.585_410_196_624_968_5;
/// (5 - sqrt 5)/20.
const FAR: f64 = 0.138_196_601_125_010_5;

/// Barycentric coordinates of the points of integration.
pub const TET10_PLACES: [[f64; 4]; 4] =
    [[NEAR, FAR, FAR, FAR], [FAR, NEAR, FAR, FAR], [FAR, FAR, NEAR, FAR], [FAR, FAR, FAR, NEAR]];
/// Barycentric coordinates of the nodes.
pub(super) const NODES: [[f64; 4]; 10] = [
    [1.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0],
    [0.0, 0.0, 0.0, 1.0],
    [0.5, 0.5, 0.0, 0.0],
    [0.0, 0.5, 0.5, 0.0],
    [0.5, 0.0, 0.5, 0.0],
    [0.5, 0.0, 0.0, 0.5],
    [0.0, 0.5, 0.0, 0.5],
    [0.0, 0.0, 0.5, 0.5],
];

/// The points of a tetrahedron with corners and mid-edge nodes `X`, the latter in the order of `EDGES`.
pub fn tet10_points(X: &[Vec3; 10]) -> [Point<10>; 4] {
    TET10_PLACES.map(|L| {
        let dN = reference_gradients(L);
        let jacobian = jacobian(X, L);
        let inverse = jacobian.try_inverse().expect("rest volumes are positive");
        Point { dN: dN.map(|d| inverse.tr_mul(&d)), w: jacobian.determinant() / 24.0 }
    })
}

/// dX/dL at barycentric coordinates `L`; its determinant is six times the volume where the edges are straight.
pub(super) fn jacobian(X: &[Vec3; 10], L: [f64; 4]) -> Mat3 {
    X.iter().zip(&reference_gradients(L)).map(|(X, d)| X * d.transpose()).sum()
}

/// dL/dX: the inverse of [`jacobian`].
pub(super) fn inverse_jacobian(X: &[Vec3; 10], L: [f64; 4]) -> Mat3 {
    jacobian(X, L).try_inverse().expect("rest volumes are positive")
}

/// Values of the shape functions at barycentric coordinates `L`.
pub(super) fn values(L: [f64; 4]) -> [f64; 10] {
    std::array::from_fn(|k| match k {
        0..4 => L[k] * (2.0 * L[k] - 1.0),
        _ => 4.0 * L[EDGES[k - 4][0]] * L[EDGES[k - 4][1]],
    })
}

/// Derivatives of the shape functions by the barycentric coordinates L1, L2, L3 (L0 = 1 - L1 - L2 - L3).
pub(super) fn reference_gradients(L: [f64; 4]) -> [Vec3; 10] {
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
