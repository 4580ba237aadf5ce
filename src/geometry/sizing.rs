//! Target edge length of tetrahedra in space.

use crate::math::Vec3;

/// How long a mesh edge may be at a place.
pub trait Sizing: Sync {
    /// Target edge length, m.
    fn edge(&self, p: &Vec3) -> f64;
}

/// The same edge length everywhere, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uniform(pub f64);

impl Sizing for Uniform {
    fn edge(&self, _: &Vec3) -> f64 {
        self.0
    }
}
