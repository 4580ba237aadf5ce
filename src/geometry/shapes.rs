//! Rounded shapes and their smooth unions, for bodies built by formula.
//!
//! Source: I. Quilez, "Distance functions" and "Smooth minimum", iquilezles.org, 2008-2013: bounds of the distance
//! that are exact to first order at the surface.

use crate::math::Vec3;

/// Distance to an ellipsoid of radii `r` about `c`, exact to first order at its surface.
pub(super) fn ellipsoid(p: &Vec3, c: [f64; 3], r: [f64; 3]) -> f64 {
    let r = Vec3::from(r);
    let q = p - Vec3::from(c);
    let scaled = q.component_div(&r).norm();
    let slope = q.component_div(&r.component_mul(&r)).norm();
    if slope == 0.0 { -r.min() } else { scaled * (scaled - 1.0) / slope }
}

/// Distance to a rod from `a` to `b` with radius `r`.
pub(super) fn rod(p: &Vec3, a: [f64; 3], b: [f64; 3], r: f64) -> f64 {
    let (a, b) = (Vec3::from(a), Vec3::from(b));
    let along = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
    (p - a - (b - a) * along).norm() - r
}

/// Distance to an upright elliptic cylinder of half widths `r` about `c`, between heights `z`.
pub(super) fn arch(p: &Vec3, c: [f64; 2], r: [f64; 2], z: [f64; 2]) -> f64 {
    let (u, v) = (p.x - c[0], p.y - c[1]);
    let scaled = (u / r[0]).hypot(v / r[1]);
    let slope = (u / (r[0] * r[0])).hypot(v / (r[1] * r[1]));
    let side = if slope == 0.0 { -r[0].min(r[1]) } else { scaled * (scaled - 1.0) / slope };
    side.max(z[0] - p.z).max(p.z - z[1])
}

/// Smooth union: the smaller of two distances, blended over `k`.
pub(super) fn join(a: f64, b: f64, k: f64) -> f64 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * k / 4.0
}

/// Smooth intersection: the larger of two distances, blended over `k`.
pub(super) fn both(a: f64, b: f64, k: f64) -> f64 {
    -join(-a, -b, k)
}

/// Smooth difference: `a` without `b`, blended over `k`.
pub(super) fn carve(a: f64, b: f64, k: f64) -> f64 {
    both(a, -b, k)
}
