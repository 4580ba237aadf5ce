//! Surface fit: nodes move along the normal so that the triangles round them lie on the wall in the mean.
//!
//! ```text
//! delta = -.4 sum A b d / sum A b^2   over ten samples of each triangle: A its area, b the node's weight, d the distance
//! ```
//! Nodes on a curved wall put every chord inside it; after the fit surface and volume err to both sides. Samples further off
//! than .15 of a triangle's size are left out: they see another sheet of the wall.

use super::super::Field;
use super::super::stencils::Stuffed;
use super::collapse::Face;
use super::shape::Star;
use super::sheet::{ON_SHEET, SHEET};
use super::smooth::Stars;
use super::walls::{Held, in_planes};
use crate::math::Vec3;

const STEP: f64 = 0.4;
const OTHER: f64 = 0.15;
/// A wall must be this steep along a node's freedom to be moved against.
const STEEP: f64 = 0.3;
/// A star may get worse down to this score.
const GOOD: f64 = 0.35;

/// Ten points of a triangle, as weights of its corners: the middles of its sixteen quarters' upright ones.
const SAMPLES: [[f64; 3]; 10] = {
    let mut out = [[0.0; 3]; 10];
    let (mut i, mut k) = (0, 0);
    while i < 4 {
        let mut j = 0;
        while j < 4 - i {
            let (u, v) = ((i as f64 + 1.0 / 3.0) / 4.0, (j as f64 + 1.0 / 3.0) / 4.0);
            out[k] = [u, v, 1.0 - u - v];
            (j, k) = (j + 1, k + 1);
        }
        i += 1;
    }
    out
};

/// Mean and largest distance of a triangle's samples from the zero of a field, m.
pub(super) fn distance(field: &dyn Field, x: &[Vec3; 3]) -> [f64; 2] {
    let (mut sum, mut most) = (0.0, 0.0f64);
    for b in &SAMPLES {
        let d = field.at(&(x[0] * b[0] + x[1] * b[1] + x[2] * b[2])).abs();
        sum += d;
        most = most.max(d);
    }
    [sum / SAMPLES.len() as f64, most]
}

/// Rounds of the fit over triangles that know their wall; the offsets that result are kept from then on.
pub(super) fn fit(mesh: &mut Stuffed, triangles: &[Face], stars: &Stars, held: &mut Held, rounds: usize) {
    let mut star = Star::default();
    for _ in 0..rounds {
        let mut sums = vec![[0.0; 2]; mesh.nodes.len()];
        for (t, wall) in triangles.iter().filter(|t| t.1 < SHEET) {
            let wall = &held.walls[usize::from(*wall)];
            let x = t.map(|a| mesh.nodes[a as usize]);
            let area = (x[1] - x[0]).cross(&(x[2] - x[0])).norm();
            let far = OTHER * area.sqrt();
            for b in &SAMPLES {
                let d = wall.depth(&(x[0] * b[0] + x[1] * b[1] + x[2] * b[2]));
                if d.abs() > far {
                    continue;
                }
                for i in 0..3 {
                    let sum = &mut sums[t[i] as usize];
                    sum[0] += area * b[i] * d;
                    sum[1] += area * b[i] * b[i];
                }
            }
        }
        for (a, [error, weight]) in sums.into_iter().enumerate() {
            if weight == 0.0 {
                continue;
            }
            let Some(wall) = held.wall(mesh, a) else { continue };
            // A crease with the sheet stays where both meet.
            if mesh.plane[a] & ON_SHEET != 0 {
                continue;
            }
            let normal = in_planes(mesh.plane[a], wall.slope(&mesh.nodes[a]).1);
            let length = normal.norm();
            if length < STEEP {
                continue;
            }
            let x = mesh.nodes[a];
            let y = x - normal * (STEP * error / weight / length);
            star.read(&mesh.nodes, &mesh.tets, stars.star(a), a as u32);
            let (before, after) = (star.worst(&x), star.worst(&y));
            if after >= before || after > GOOD {
                mesh.nodes[a] = y;
            }
        }
    }
    for a in 0..mesh.nodes.len() {
        if let Some(wall) = held.wall(mesh, a) {
            held.offset[a] = wall.depth(&mesh.nodes[a]);
        }
    }
}
