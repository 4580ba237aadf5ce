//! Rigid shapes by their signed distance: what tissue cannot enter.
//!
//! ```text
//! d(X) = |X - nearest point of the path| - r        a ball (one point), a capsule (two), a bent tube (more)
//! d(X) = (X - P) . n                                a half-space
//! ```

use std::f64::consts::{PI, TAU};

use crate::math::{Mat3, Vec3};
use crate::mesh::FineSkin;

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

    /// What it looks like, wound outward: balls about the points of its line and barrels between them; a half-space is not
    /// drawn.
    pub fn surface(&self) -> FineSkin {
        let mut surface = FineSkin::default();
        if let Shape::Tube { path, radius } = self {
            path.iter().for_each(|p| add_round(&mut surface, [*p, *p], *radius));
            path.windows(2).for_each(|ends| add_round(&mut surface, [ends[0], ends[1]], *radius));
        }
        surface
    }

    /// Points of its line, no further apart than its radius, m; none for a half-space.
    pub fn axis(&self) -> Vec<Vec3> {
        let Shape::Tube { path, radius } = self else { return Vec::new() };
        let mut points = vec![path[0]];
        for ends in path.windows(2) {
            let n = ((ends[1] - ends[0]).norm() / radius).ceil().max(1.0);
            points.extend((1..=n as usize).map(|k| ends[0] + k as f64 / n * (ends[1] - ends[0])));
        }
        points
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

/// Sides of a round surface, and rings from one end of a ball to the other.
const SIDES: u32 = 24;
const RINGS: u32 = 12;

/// A ball where both ends are one point, else a barrel from one to the other.
fn add_round(surface: &mut FineSkin, ends: [Vec3; 2], radius: f64) {
    let first = surface.vertices.len() as u32;
    let axis = (ends[1] - ends[0]).try_normalize(0.0).unwrap_or_else(Vec3::z);
    let across = axis.cross(&Vec3::ith(axis.iamin(), 1.0)).normalize();
    let rings = if ends[0] == ends[1] { RINGS } else { 1 };
    for ring in 0..=rings {
        let along = f64::from(ring) / f64::from(rings);
        let (sin, cos) = if rings == 1 { (1.0, 0.0) } else { (PI * along).sin_cos() };
        let middle = ends[0] + along * (ends[1] - ends[0]) - radius * cos * axis;
        for side in 0..SIDES {
            let (s, c) = (TAU * f64::from(side) / f64::from(SIDES)).sin_cos();
            surface.vertices.push(middle + radius * sin * (c * across + s * axis.cross(&across)));
        }
    }
    for ring in 0..rings {
        for side in 0..SIDES {
            let at = |ring: u32, side: u32| first + ring * SIDES + side % SIDES;
            let [a, b] = [at(ring, side), at(ring, side + 1)];
            let [c, d] = [at(ring + 1, side), at(ring + 1, side + 1)];
            surface.triangles.extend([[a, b, d], [a, d, c]]);
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
