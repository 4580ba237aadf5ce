//! Scalar fields in space: signed distances, negative inside.

use crate::math::Vec3;

/// A signed distance (or something close to one near its zero), m: negative inside the body.
pub trait Field: Sync {
    /// Value at a world position.
    fn at(&self, p: &Vec3) -> f64;

    /// Any function with the same sign as [`Field::at`] everywhere; what roots are sought on.
    fn level(&self, p: &Vec3) -> f64 {
        self.at(p)
    }

    /// Value and gradient at a world position; by differences unless a field knows better.
    fn slope(&self, p: &Vec3) -> (f64, Vec3) {
        (self.at(p), gradient(self, p, NEAR))
    }
}

/// Half the width of a difference, m: far below any mesh edge.
const NEAR: f64 = 1e-5;

impl<F: Fn(&Vec3) -> f64 + Sync> Field for F {
    fn at(&self, p: &Vec3) -> f64 {
        self(p)
    }
}

/// A ball; its distance is exact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Centre, m.
    pub centre: Vec3,
    /// Radius, m.
    pub radius: f64,
}

impl Field for Ball {
    fn at(&self, p: &Vec3) -> f64 {
        (p - self.centre).norm() - self.radius
    }
}

/// An axis-parallel box; its distance is exact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cuboid {
    /// Corner with the smallest coordinates, m.
    pub low: Vec3,
    /// Corner with the largest coordinates, m.
    pub high: Vec3,
}

impl Field for Cuboid {
    fn at(&self, p: &Vec3) -> f64 {
        let q = (self.low - p).sup(&(p - self.high));
        q.sup(&Vec3::zeros()).norm() + q.max().min(0.0)
    }
}

/// Central difference of a field over `2 h`: its gradient, about a unit vector for a distance.
pub fn gradient<F: Field + ?Sized>(field: &F, p: &Vec3, h: f64) -> Vec3 {
    Vec3::from_fn(|a, _| {
        let mut step = Vec3::zeros();
        step[a] = h;
        (field.at(&(p + step)) - field.at(&(p - step))) / (2.0 * h)
    })
}
