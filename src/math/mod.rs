//! Small dense mathematics. `vec(F)` of a 3x3 matrix is column-major everywhere.
#![forbid(unsafe_code)]
#![allow(non_snake_case)]

mod bounds;
pub mod lane;
mod pose;
mod psd;
mod random;
mod svd;
mod tensor;
mod triangle;

pub use bounds::{bounds, extent};
pub use pose::{Pose, best_fit, exp_rotation, left_jacobian, log_rotation};
pub use psd::clamp_eigenvalues;
pub use random::Random;
pub use svd::{Svd, polar, svd};
pub use tensor::{cofactor, d2JdF2, outer, skew, vec9};
pub use triangle::nearest_weights;

/// [`Mat3`] as a [`lane::Tensor`].
#[inline(always)]
pub fn entries(F: &Mat3) -> lane::Tensor<f64> {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| F[(i, j)]))
}

/// A [`lane::Tensor`] as [`Mat3`].
#[inline(always)]
pub fn mat3(F: &lane::Tensor<f64>) -> Mat3 {
    Mat3::from_fn(|i, j| F[i][j])
}

/// A point or vector in space, m.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3x3 matrix, for example the deformation gradient F.
pub type Mat3 = nalgebra::Matrix3<f64>;
/// A fourth-order tensor as a 9x9 matrix over `vec(F)`, for example dP/dF.
pub type Mat9 = nalgebra::SMatrix<f64, 9, 9>;
/// `vec(F)`: the columns of F one below the other.
pub type Vec9 = nalgebra::SVector<f64, 9>;
