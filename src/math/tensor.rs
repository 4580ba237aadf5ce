//! Derivatives of J = det F and the tensor products that the energies are written in.

use super::{Mat3, Mat9, Vec3, Vec9};

/// `vec(F)`, column-major.
pub fn vec9(F: &Mat3) -> Vec9 {
    Vec9::from_column_slice(F.as_slice())
}

/// Matrix of the cross product: `skew(a) b = a x b`.
pub fn skew(a: &Vec3) -> Mat3 {
    Mat3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// dJ/dF, the cofactor matrix of F; its columns are f1 x f2, f2 x f0, f0 x f1.
pub fn cofactor(F: &Mat3) -> Mat3 {
    let [f0, f1, f2] = [0, 1, 2].map(|j| Vec3::from(F.column(j)));
    Mat3::from_columns(&[f1.cross(&f2), f2.cross(&f0), f0.cross(&f1)])
}

/// d2J/dF2: the 3x3 blocks are skew matrices of the columns of F.
///
/// Source: Smith, de Goes & Kim, "Stable Neo-Hookean Flesh Simulation", ACM TOG 37(2), 2018, section 4.3.
pub fn d2JdF2(F: &Mat3) -> Mat9 {
    let s = [0, 1, 2].map(|j| skew(&Vec3::from(F.column(j))));
    let mut H = Mat9::zeros();
    let mut put = |a: usize, b: usize, M: &Mat3| H.fixed_view_mut::<3, 3>(3 * a, 3 * b).copy_from(M);
    put(0, 1, &-s[2]);
    put(0, 2, &s[1]);
    put(1, 0, &s[2]);
    put(1, 2, &-s[0]);
    put(2, 0, &-s[1]);
    put(2, 1, &s[0]);
    H
}

/// The 9x9 matrix `vec(A) vec(B)^T`.
pub fn outer(A: &Mat3, B: &Mat3) -> Mat9 {
    vec9(A) * vec9(B).transpose()
}
