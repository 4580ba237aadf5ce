//! Rigid shapes by their signed distance: what tissue cannot enter.
//!
//! ```text
//! d(X) = |X - nearest point of the path| - r        a ball (one point), a capsule (two), a bent tube (more)
//! d(X) = (X - P) . n                                a half-space
//! ```
//!
//! Source: Quilez, "3D signed distance functions", 2008 on, for the capsule; derivatives are elementary.

use crate::math::{Mat3, Vec3};

/// A rigid shape in its rest position.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// All within a radius of a line through points.
    Tube {
        /// Points of the line, at least one, m.
        path: Vec<Vec3>,
        /// Radius, m.
        radius: f64,
    },
    /// Everything behind a plane.
    HalfSpace {
        /// A point of the plane, m.
        point: Vec3,
        /// Unit normal out of the shape.
        normal: Vec3,
    },
}

/// Signed distance from a shape, and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Negative inside, m.
    pub d: f64,
    /// Its gradient: the normal out of the shape; zero on a tube's own line, where there is none.
    pub n: Vec3,
    /// Its second derivative, 1/m.
    pub H: Mat3,
}

impl Shape {
    /// At the place `X`, m.
    pub fn distance(&self, X: &Vec3) -> Distance {
        match self {
            Shape::HalfSpace { point, normal } => Distance { d: (X - point).dot(normal), n: *normal, H: Mat3::zeros() },
            Shape::Tube { path, radius } => {
                let (foot, along) = nearest(path, X);
                let arm = X - foot;
                let length = arm.norm();
                if length == 0.0 {
                    return Distance { d: -radius, n: Vec3::zeros(), H: Mat3::zeros() };
                }
                let n = arm / length;
                let free = Mat3::identity() - n * n.transpose() - along * along.transpose();
                Distance { d: length - radius, n, H: free / length }
            }
        }
    }

    /// A point in its middle, m.
    pub fn middle(&self) -> Vec3 {
        match self {
            Shape::HalfSpace { point, .. } => *point,
            Shape::Tube { path, .. } => path.iter().sum::<Vec3>() / path.len() as f64,
        }
    }

    /// Radius of a ball about its middle that holds it, m; 0 for a half-space, which none does.
    pub fn extent(&self) -> f64 {
        match self {
            Shape::HalfSpace { .. } => 0.0,
            Shape::Tube { path, radius } => {
                let middle = self.middle();
                radius + path.iter().map(|p| (p - middle).norm()).fold(0.0, f64::max)
            }
        }
    }

    /// Depth beyond which it no longer knows which side a point came from, m.
    pub fn reach(&self) -> f64 {
        match self {
            Shape::HalfSpace { .. } => f64::INFINITY,
            Shape::Tube { radius, .. } => *radius,
        }
    }
}

/// The nearest point of the line, and the unit vector along which it slides; zero at a corner or end.
fn nearest(path: &[Vec3], X: &Vec3) -> (Vec3, Vec3) {
    let mut best = (path[0], Vec3::zeros(), (X - path[0]).norm_squared());
    for ends in path.windows(2) {
        let edge = ends[1] - ends[0];
        let length = edge.norm();
        let s = (X - ends[0]).dot(&edge) / (length * length);
        let inside = s > 0.0 && s < 1.0;
        let foot = ends[0] + s.clamp(0.0, 1.0) * edge;
        let squared = (X - foot).norm_squared();
        if squared < best.2 {
            best = (foot, if inside { edge / length } else { Vec3::zeros() }, squared);
        }
    }
    (best.0, best.1)
}
