//! The box that points lie in.

use super::Vec3;

/// Smallest and largest coordinates of some points; infinite, the wrong way round, of none.
pub fn bounds<'a>(points: impl IntoIterator<Item = &'a Vec3>) -> (Vec3, Vec3) {
    let far = Vec3::repeat(f64::INFINITY);
    points.into_iter().fold((far, -far), |(low, high), x| (low.inf(x), high.sup(x)))
}

/// Diagonal of the box that points lie in: their size.
pub fn extent(points: &[Vec3]) -> f64 {
    let (low, high) = bounds(points);
    (high - low).norm()
}
