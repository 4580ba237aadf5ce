//! Rigid poses: a rotation about a pivot and a translation.

use super::{Mat3, Vec3, skew, svd};

/// Below this angle (rad) the series of sin and cos are used; their first dropped term is below round-off.
const SMALL_ANGLE: f64 = 1e-4;

/// Rotation matrix of a rotation vector (axis times angle, rad). Source: Rodrigues' formula.
pub fn exp_rotation(w: &Vec3) -> Mat3 {
    let angle = w.norm();
    let (a, b) = if angle < SMALL_ANGLE {
        let q = angle * angle;
        (1.0 - q / 6.0, 0.5 - q / 24.0)
    } else {
        (angle.sin() / angle, (1.0 - angle.cos()) / (angle * angle))
    };
    let W = skew(w);
    Mat3::identity() + a * W + b * W * W
}

/// Rotation vector of a rotation matrix, of length at most pi.
pub fn log_rotation(R: &Mat3) -> Vec3 {
    let axial = 0.5 * Vec3::new(R[(2, 1)] - R[(1, 2)], R[(0, 2)] - R[(2, 0)], R[(1, 0)] - R[(0, 1)]);
    let (sin, cos) = (axial.norm(), 0.5 * (R.trace() - 1.0));
    let angle = sin.atan2(cos);
    if sin > 1e-6 {
        return axial * (angle / sin);
    }
    if cos > 0.0 {
        return axial;
    }
    // Half a turn: R + I = 2 a a^T, so the longest column is the axis.
    let S = R + Mat3::identity();
    let longest = (0..3).max_by(|&i, &j| S[(i, i)].total_cmp(&S[(j, j)])).expect("three columns");
    let axis = Vec3::from(S.column(longest)).normalize();
    let axis = if axis.dot(&axial) < 0.0 { -axis } else { axis };
    axis * angle
}

/// `dR(w) = skew(J dw) R(w)`. Source: Barfoot, "State Estimation for Robotics", 2017, section 7.1.
pub fn left_jacobian(w: &Vec3) -> Mat3 {
    let angle = w.norm();
    let (a, b) = if angle < 1e-3 {
        let q = angle * angle;
        (0.5 - q / 24.0, 1.0 / 6.0 - q / 120.0)
    } else {
        ((1.0 - angle.cos()) / (angle * angle), (angle - angle.sin()) / angle.powi(3))
    };
    let W = skew(w);
    Mat3::identity() + a * W + b * W * W
}

/// Where a rigid body is, relative to its rest pose: `x = pivot + t + R (X - pivot)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Translation of the pivot, m.
    pub t: Vec3,
    /// Rotation about the pivot.
    pub R: Mat3,
}

impl Pose {
    /// The rest pose.
    pub const REST: Pose =
        Pose { t: Vec3::new(0.0, 0.0, 0.0), R: Mat3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0) };

    /// The pose of a translation (m) and a rotation vector (rad).
    pub fn new(t: Vec3, w: &Vec3) -> Pose {
        Pose { t, R: exp_rotation(w) }
    }

    /// Current place of the rest point `X`; bit-exact `X` in the rest pose.
    pub fn place(&self, pivot: &Vec3, X: &Vec3) -> Vec3 {
        let r = X - pivot;
        X + (self.t + (self.R - Mat3::identity()) * r)
    }
}

/// The rigid motion `x -> c + R (x - a)` that brings the points `from` nearest to `to`: `(R, a, c)` with `a`, `c` the
/// centroids. Identity rotation where the points do not determine one.
///
/// Source: Kabsch, "A solution for the best rotation to relate two sets of vectors", Acta Cryst. A32, 1976.
pub fn best_fit(
    from: impl Iterator<Item = Vec3> + Clone,
    to: impl Iterator<Item = Vec3> + Clone,
) -> (Mat3, Vec3, Vec3) {
    let n = from.clone().count().max(1) as f64;
    let a = from.clone().sum::<Vec3>() / n;
    let c = to.clone().sum::<Vec3>() / n;
    let H: Mat3 = from.zip(to).map(|(x, y)| (y - c) * (x - a).transpose()).sum();
    let f = svd(&H);
    let determined = f.s[1] > 1e-12 * f.s[0].max(f64::MIN_POSITIVE);
    (if determined { f.U * f.V.transpose() } else { Mat3::identity() }, a, c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponential_and_logarithm_are_inverse_up_to_half_a_turn() {
        for w in [
            Vec3::zeros(),
            Vec3::new(1e-9, 0.0, 0.0),
            Vec3::new(0.3, -1.2, 0.7),
            Vec3::new(0.0, std::f64::consts::PI, 0.0),
        ] {
            assert!((log_rotation(&exp_rotation(&w)) - w).norm() < 1e-9, "{w}");
        }
    }

    #[test]
    fn best_fit_recovers_a_rigid_motion() {
        let R = exp_rotation(&Vec3::new(0.4, -0.2, 1.1));
        let from = [Vec3::x(), Vec3::y(), Vec3::z(), Vec3::new(1.0, 2.0, 3.0)];
        let to = from.map(|x| R * x + Vec3::new(5.0, 6.0, 7.0));
        let (Q, a, c) = best_fit(from.into_iter(), to.into_iter());
        assert!((Q - R).norm() < 1e-14 && (c - R * a - Vec3::new(5.0, 6.0, 7.0)).norm() < 1e-13);
    }
}
