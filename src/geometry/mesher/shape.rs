//! How good a tetrahedron is, and the energy that makes it better.
//!
//! ```text
//! mean ratio  q = 12 (3V)^(2/3) / sum of squared edges                       1 for the regular tetrahedron
//! score       min(q, 6 (1 - cos smallest dihedral), 3.5 (1 + cos largest))
//! energy      E = q^-p over a star, p = 3 or 6; with v = 6V and l the sum of squared edges, E ~ l^p v^(-2p/3)
//! dE/dx       E (p dl/l - 2p/3 dv/v)
//! d2E/dx2     E (g g^T + p (6 I / l - dl dl^T / l^2) + 2p/3 dv dv^T / v^2),   g = dE/dx / E
//! ```
//! Source: P. Knupp, "Algebraic mesh quality metrics for unstructured initial meshes", Finite Elem. Anal. Des. 39, 2003,
//! for the mean ratio.

use crate::math::{Mat3, Vec3};

/// Below this a tetrahedron counts as flat.
const FLAT: f64 = 1e-9;

/// Cube root of a positive number: a guess from the exponent, then two of Halley's steps, which leave about 1e-13. The
/// library's is correctly rounded and several times slower.
fn cube_root(x: f64) -> f64 {
    let mut y = f64::from_bits(x.to_bits() / 3 + 0x2a9f_7893_0000_0000);
    for _ in 0..2 {
        let cube = y * y * y;
        y *= (cube + 2.0 * x) / (2.0 * cube + x);
    }
    y
}

/// A number to the power -3 or -6, of which the energy is made.
fn inverse_power(q: f64, p: i32) -> f64 {
    let r = 1.0 / (q * q * q);
    if p > 3 { r * r } else { r }
}

/// Sum of the squares of the edges' lengths.
fn squares(edges: [Vec3; 6]) -> f64 {
    edges.iter().map(Vec3::norm_squared).sum()
}

/// Mean ratio of a tetrahedron; not positive where it is flat or inside out.
pub(super) fn mean_ratio(x: &[Vec3; 4]) -> f64 {
    let (a, b, c) = (x[1] - x[0], x[2] - x[0], x[3] - x[0]);
    let v = a.cross(&b).dot(&c);
    let l = squares([a, b, c, a - b, b - c, c - a]);
    if v <= 0.0 { v / (l * l.sqrt()) } else { 12.0 * cube_root(0.25 * v * v) / l }
}

/// Cosines of the smallest and of the largest dihedral angle.
fn cosines(x: &[Vec3; 4]) -> [f64; 2] {
    let (a, b, c) = (x[1] - x[0], x[2] - x[0], x[3] - x[0]);
    let n = [(c - a).cross(&(b - a)), b.cross(&c), c.cross(&a), a.cross(&b)];
    let inverse = n.map(|n| 1.0 / n.norm().max(f64::MIN_POSITIVE));
    let mut out = [-1.0f64, 1.0f64];
    for i in 0..4 {
        for j in 0..i {
            let cos = -n[i].dot(&n[j]) * inverse[i] * inverse[j];
            out = [out[0].max(cos), out[1].min(cos)];
        }
    }
    out
}

/// Score of a tetrahedron; not positive where it is flat or inside out.
pub(super) fn score(x: &[Vec3; 4]) -> f64 {
    let q = mean_ratio(x);
    if q <= FLAT {
        return q;
    }
    graded(q, x)
}

/// Score of a tetrahedron that is not flat, by its mean ratio and its angles.
fn graded(mean_ratio: f64, x: &[Vec3; 4]) -> f64 {
    let [small, large] = cosines(x);
    mean_ratio.min(6.0 * (1.0 - small)).min(3.5 * (1.0 + large))
}

/// The tetrahedra round a node: of each the other three corners, wound so that the node's place makes it positive.
#[derive(Default)]
pub(super) struct Star {
    faces: Vec<[Vec3; 3]>,
    /// Half the shortest edge to the node is as far as it may go at once.
    pub shortest: f64,
    pub mean: f64,
}

impl Star {
    /// Reads the star of a node.
    pub fn read(&mut self, nodes: &[Vec3], tets: &[[u32; 4]], star: &[u32], node: u32) {
        self.faces.clear();
        let x = nodes[node as usize];
        let (mut least, mut sum) = (f64::INFINITY, 0.0);
        for &e in star {
            let t = tets[e as usize];
            let face = match t.iter().position(|&a| a == node) {
                Some(0) => [t[1], t[2], t[3]],
                Some(1) => [t[0], t[3], t[2]],
                Some(2) => [t[0], t[1], t[3]],
                _ => [t[0], t[2], t[1]],
            };
            let face = face.map(|a| nodes[a as usize]);
            for y in &face {
                let d = (y - x).norm();
                least = least.min(d);
                sum += d;
            }
            self.faces.push(face);
        }
        self.shortest = least;
        self.mean = sum / (3 * self.faces.len().max(1)) as f64;
    }

    /// The star of a node that is not there yet, by the faces round it, seen from which they are positive.
    pub fn around(&mut self, faces: impl Iterator<Item = [Vec3; 3]>, x: &Vec3) {
        self.faces.clear();
        self.faces.extend(faces);
        let lengths = || self.faces.iter().flatten().map(|y| (y - x).norm());
        self.shortest = lengths().fold(f64::INFINITY, f64::min);
        self.mean = lengths().sum::<f64>() / (3 * self.faces.len().max(1)) as f64;
    }

    /// Energy and worst score with the node at `x`; infinite where a tetrahedron is flat.
    pub fn energy(&self, x: &Vec3, p: i32) -> (f64, f64) {
        let (mut energy, mut worst) = (0.0, f64::INFINITY);
        for [a, b, c] in &self.faces {
            let t = [*x, *a, *b, *c];
            let q = mean_ratio(&t);
            if q <= FLAT {
                return (f64::INFINITY, q);
            }
            energy += inverse_power(q, p);
            worst = worst.min(graded(q, &t));
        }
        (energy, worst)
    }

    /// Worst score alone.
    pub fn worst(&self, x: &Vec3) -> f64 {
        self.faces.iter().map(|&[a, b, c]| score(&[*x, a, b, c])).fold(f64::INFINITY, f64::min)
    }

    /// Gradient and second derivative of the energy at `x`, where it is finite.
    pub fn derivatives(&self, x: &Vec3, p: i32) -> (Vec3, Mat3) {
        let (mut gradient, mut hessian) = (Vec3::zeros(), Mat3::zeros());
        let power = f64::from(p);
        for [a, b, c] in &self.faces {
            let (u, v, w) = (a - x, b - x, c - x);
            let dv = -((b - a).cross(&(c - a)));
            let volume = u.cross(&v).dot(&w);
            let l = squares([u, v, w, a - b, b - c, c - a]);
            let dl = -2.0 * (u + v + w);
            let cube = 432.0 * volume * volume / (l * l * l);
            let e = if p > 3 { 1.0 / (cube * cube) } else { 1.0 / cube };
            let g = dl * (power / l) - dv * (2.0 * power / (3.0 * volume));
            gradient += g * e;
            let shape = g * g.transpose() + Mat3::identity() * (6.0 * power / l)
                - dl * dl.transpose() * (power / (l * l))
                + dv * dv.transpose() * (2.0 * power / (3.0 * volume * volume));
            hessian += shape * e;
        }
        (gradient, hessian)
    }
}
