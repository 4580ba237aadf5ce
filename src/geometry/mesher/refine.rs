//! Where the lattice must be fine: cells over which a wall is not flat, and thin tissue.
//!
//! A linear function is fitted to the wall's distance on a grid of samples of a cell; the mean of its residual near the wall
//! and inside the other walls is about .03 kappa h^2 for a smooth surface, close to the error of the mesh after its fit, and
//! it sees edges, lips and plates that a cell does not resolve, which curvature alone does not.

use super::super::stuffing::Wall;
use crate::math::Vec3;

/// Samples along each edge of a cell.
const SAMPLES: usize = 5;
/// Samples outside of another wall by more than this share of the cell do not count.
const BEYOND: f64 = 0.15;
/// A wall counts in a cell if its samples weigh this much together.
const WEIGHT: f64 = 0.5;
/// Thickness is measured from points this near to a wall, in cells, by this many probes.
const NEAR: f64 = 0.35;
const PROBES: usize = 4;
/// Thickness below which a film between two walls is none of tissue: partial volume on a tooth, m.
const FILM: f64 = 0.45e-3;

/// What the lattice must resolve.
pub(in super::super) struct Detail<'a> {
    /// Mean residual allowed for the first two walls, m; others are not refined for.
    pub tolerance: [f64; 2],
    /// Longest cell at a wall, m.
    pub cap: f64,
    /// Factor on tolerance and cap at a place.
    pub scale: &'a dyn Fn(&Vec3) -> f64,
    /// Shortest cell for the sake of the error, m.
    pub floor: f64,
    /// Cells are no longer than the tissue behind the first wall is thick, but no shorter than this at a place, m.
    pub thin: &'a dyn Fn(&Vec3) -> f64,
}

impl Detail<'_> {
    /// Whether a cell must be halved.
    pub fn wants(&self, walls: &[Wall], centre: &Vec3, edge: &Vec3) -> bool {
        let h = edge.sum() / 3.0;
        let thin = (self.thin)(centre);
        if h < 1.9 * self.floor.min(thin) {
            return false;
        }
        let depth: Vec<f64> = walls.iter().map(|w| w.depth(centre)).collect();
        let reach = 0.5 * edge.norm();
        // Nothing of the tissue in it.
        if depth.iter().any(|&d| d > reach) {
            return false;
        }
        if depth[..2].iter().all(|d| d.abs() > reach + 0.5 * h) {
            return false;
        }
        let scale = (self.scale)(centre);
        let at = |k: usize| k as f64 / (SAMPLES - 1) as f64 - 0.5;
        let mut samples = [[0.0; SAMPLES * SAMPLES * SAMPLES]; 2];
        let mut offsets = [Vec3::zeros(); SAMPLES * SAMPLES * SAMPLES];
        for (s, o) in offsets.iter_mut().enumerate() {
            *o = Vec3::new(at(s % SAMPLES), at(s / SAMPLES % SAMPLES), at(s / (SAMPLES * SAMPLES)));
        }
        for (wall, samples) in walls.iter().zip(&mut samples) {
            for (o, d) in offsets.iter().zip(samples) {
                *d = wall.depth(&(centre + o.component_mul(edge)));
            }
        }
        let squares: f64 = offsets.iter().map(|o| o.x * o.x).sum();
        for w in 0..2 {
            let (own, other) = (&samples[w], &samples[1 - w]);
            let mean = own.iter().sum::<f64>() / own.len() as f64;
            let slope = offsets.iter().zip(own).map(|(o, d)| o * *d).sum::<Vec3>() / squares;
            let (mut sum, mut weight) = (0.0, 0.0);
            for ((o, d), e) in offsets.iter().zip(own).zip(other) {
                if *e > BEYOND * h {
                    continue;
                }
                let near = (1.0 - d.abs() / (0.5 * h)).max(0.0);
                weight += near;
                sum += near * (d - mean - slope.dot(o)).abs();
            }
            let coarse = h > 1.9 * self.floor;
            if coarse && weight > WEIGHT && (sum > self.tolerance[w] * scale * weight || h > 1.03 * self.cap * scale) {
                return true;
            }
        }
        h > 1.9 * thin && self.is_thin(walls, &offsets, &samples[0], centre, edge)
    }

    /// Whether the tissue behind the first wall ends within a cell's edge, but not as a film.
    fn is_thin(&self, walls: &[Wall], offsets: &[Vec3], samples: &[f64], centre: &Vec3, edge: &Vec3) -> bool {
        let h = edge.sum() / 3.0;
        let level = |p: &Vec3| walls[..2].iter().map(|w| w.depth(p)).fold(f64::NEG_INFINITY, f64::max);
        offsets.iter().zip(samples).step_by(2).filter(|(_, d)| d.abs() < NEAR * h).any(|(o, _)| {
            let p = centre + o.component_mul(edge);
            let (d, slope) = walls[0].slope(&p);
            let inward = -slope / slope.norm().max(f64::MIN_POSITIVE);
            let start = p + inward * d;
            let ends = |s: f64| level(&(start + inward * s)) > 0.0;
            !ends(FILM) && (1..=PROBES).any(|k| ends(FILM + (h - FILM) * k as f64 / PROBES as f64))
        })
    }
}
