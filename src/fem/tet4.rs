//! The linear tetrahedron: constant F, one point.
//!
//! It locks near incompressibility (Poisson's ratio above 0.45) and in bending.

use super::solid::Point;
use crate::math::Vec3;

/// Barycentric coordinates of the point.
pub const TET4_PLACES: [[f64; 4]; 1] = [[0.25; 4]];

/// The one point of a tetrahedron with corners `X` and positive volume.
pub fn tet4_points(X: &[Vec3; 4]) -> [Point<4>; 1] {
    let (a, b, c) = (X[1] - X[0], X[2] - X[0], X[3] - X[0]);
    let det = a.cross(&b).dot(&c);
    let (n1, n2, n3) = (b.cross(&c) / det, c.cross(&a) / det, a.cross(&b) / det);
    [Point { dN: [-(n1 + n2 + n3), n1, n2, n3], w: det / 6.0 }]
}
