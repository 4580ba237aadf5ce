//! Rotation-variant singular value decomposition and polar decomposition of a 3x3 matrix.

use super::{Mat3, Vec3};

/// F = U diag(s) V^T with det U = det V = 1; `s[0] >= s[1] >= |s[2]|`, and `s[2] < 0` where det F < 0.
#[derive(Debug, Clone, Copy)]
pub struct Svd {
    /// Left rotation.
    pub U: Mat3,
    /// Signed singular values, the principal stretches.
    pub s: Vec3,
    /// Right rotation.
    pub V: Mat3,
}

/// Squared cosine at which two columns count as orthogonal.
const ORTHOGONAL: f64 = 1e-30;
/// Sweeps after which the columns are orthogonal to round-off for every 3x3 matrix tried.
const SWEEPS: usize = 12;

/// The rotation-variant decomposition; exact zeros and inverted matrices are fine.
///
/// One-sided Jacobi: the columns of F V are turned orthogonal pair by pair, which keeps small singular values accurate.
/// Source: Golub & Van Loan, "Matrix Computations", 4th ed., section 8.6.3; signs after Irving, Teran & Fedkiw,
/// "Invertible finite elements for robust simulation of large deformation", SCA 2004.
pub fn svd(F: &Mat3) -> Svd {
    let mut B = [0, 1, 2].map(|j| Vec3::from(F.column(j)));
    let mut V = [Vec3::x(), Vec3::y(), Vec3::z()];
    for _ in 0..SWEEPS {
        let mut turned = false;
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let (alpha, beta, gamma) = (B[p].norm_squared(), B[q].norm_squared(), B[p].dot(&B[q]));
            if gamma * gamma <= ORTHOGONAL * alpha * beta {
                continue;
            }
            turned = true;
            // tan of the angle that makes the columns orthogonal, written with one division.
            let difference = beta - alpha;
            let root = (difference * difference + 4.0 * gamma * gamma).sqrt();
            let t = 2.0 * gamma / if difference < 0.0 { difference - root } else { difference + root };
            let c = 1.0 / (1.0 + t * t).sqrt();
            let s = c * t;
            (B[p], B[q]) = (c * B[p] - s * B[q], s * B[p] + c * B[q]);
            (V[p], V[q]) = (c * V[p] - s * V[q], s * V[p] + c * V[q]);
        }
        if !turned {
            break;
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| B[b].norm_squared().total_cmp(&B[a].norm_squared()));
    let v = [V[order[0]], V[order[1]]];
    let u0 = unit_or(B[order[0]], Vec3::x());
    let u1 = unit_or(B[order[1]] - u0 * u0.dot(&B[order[1]]), any_normal(&u0));
    let u2 = u0.cross(&u1);
    let v2 = v[0].cross(&v[1]);
    Svd {
        U: Mat3::from_columns(&[u0, u1, u2]),
        s: Vec3::new(u0.dot(&B[order[0]]), u1.dot(&B[order[1]]), u2.dot(&(F * v2))),
        V: Mat3::from_columns(&[v[0], v[1], v2]),
    }
}

/// F = R S with R a rotation (det R = 1) and S symmetric; S is indefinite where det F < 0.
pub fn polar(F: &Mat3) -> (Mat3, Mat3) {
    let Svd { U, s, V } = svd(F);
    (U * V.transpose(), V * Mat3::from_diagonal(&s) * V.transpose())
}

fn unit_or(a: Vec3, otherwise: Vec3) -> Vec3 {
    let n = a.norm();
    if n > f64::MIN_POSITIVE { a / n } else { otherwise }
}

fn any_normal(a: &Vec3) -> Vec3 {
    let least = if a.x.abs() <= a.y.abs() && a.x.abs() <= a.z.abs() {
        Vec3::x()
    } else if a.y.abs() <= a.z.abs() {
        Vec3::y()
    } else {
        Vec3::z()
    };
    a.cross(&least).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decomposes_regular_inverted_and_collapsed_matrices() {
        let regular = Mat3::new(1.0, 0.2, -0.3, 0.1, 0.9, 0.4, 0.0, -0.2, 1.3);
        let collapsed = Mat3::new(1.0, 2.0, 3.0, 2.0, 4.0, 6.0, 0.0, 0.0, 0.0);
        for F in [
            regular,
            -regular,
            collapsed,
            Mat3::zeros(),
            1e-9 * regular,
            Mat3::from_diagonal(&Vec3::new(1.0, 0.0, -1e-8)),
        ] {
            let Svd { U, s, V } = svd(&F);
            assert!((U * Mat3::from_diagonal(&s) * V.transpose() - F).norm() <= 1e-14 * (F.norm() + 1e-9));
            for Q in [U, V] {
                assert!((Q.transpose() * Q - Mat3::identity()).norm() < 1e-14 && Q.determinant() > 0.0);
            }
            assert!(s[0] >= s[1] && s[1] >= s[2].abs() - 1e-15);
        }
    }
}
