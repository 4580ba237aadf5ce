//! Small dense mathematics. `vec(F)` of a 3x3 matrix is column-major everywhere.
#![forbid(unsafe_code)]
#![allow(non_snake_case)]

/// A point or vector in space, m.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3x3 matrix, for example the deformation gradient F.
pub type Mat3 = nalgebra::Matrix3<f64>;
/// A fourth-order tensor as a 9x9 matrix over `vec(F)`, for example dP/dF.
pub type Mat9 = nalgebra::SMatrix<f64, 9, 9>;
