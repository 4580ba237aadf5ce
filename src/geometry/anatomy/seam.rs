//! Where upper and lower teeth meet: the arch of the lower crest unrolled, a plane through the gap, a path near it.
//!
//! The unrolled picture is what an orthopantomogram shows. A path, not the plane alone: where a tooth has lost its
//! opponent it goes round it, flat planes cost 1 to 3 % of the mandible there.

use super::cubes::{Cubes, convolved, gaussian};
use super::template::{Placed, arch};
use crate::math::Vec3;

/// Heights above the crest that are looked at, mm: the first, how many, 1 mm apart.
const FIRST: f64 = -14.0;
const HEIGHTS: usize = 50;
/// Across the arch samples are taken here, mm.
const ACROSS: [f64; 6] = [-5.0, -3.0, -1.0, 1.0, 3.0, 5.0];
/// Below this all is alike, HU: air before the incisors must not draw the seam.
const CLIP: [f64; 2] = [50.0, 1800.0];
/// Density above 200 HU beyond which more counts a tenth: where crowns touch, the seam must not leave them for the bone beyond.
const DENSE: f64 = 600.0;
/// Reach in which crowns are sought above and below, mm.
const CROWN: usize = 8;
/// Height that is usual in front, mm above the crest.
const USUAL: f64 = 17.0;

/// The occlusal surface over the arch.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Seam {
    /// Points of the crest from right to left, in the template's frame.
    pub crest: Vec<Vec3>,
    /// Height of the seam above the crest at each, mm.
    pub height: Vec<f64>,
    /// Mean cost along it, HU: -130 to -20 where a gap is seen, 200 where none is.
    pub cost: f64,
}

impl Seam {
    /// Height of the seam over the crest near a place of the template, mm: the three nearest stations count.
    pub fn above_crest(&self, x: &Vec3) -> f64 {
        let mut near = [(f64::INFINITY, 0.0); 3];
        for (c, &t) in self.crest.iter().zip(&self.height) {
            let d = (c.x - x.x).hypot(c.y - x.y);
            if d < near[2].0 {
                near[2] = (d, t);
                near.sort_by(|a, b| a.0.total_cmp(&b.0));
            }
        }
        let weight = |d: f64| 1.0 / (d + 0.5);
        let sum: f64 = near.iter().map(|n| weight(n.0)).sum();
        near.iter().map(|(d, t)| weight(*d) * t).sum::<f64>() / sum
    }

    /// A seam that is given: the plane through a point with a normal, in the frame of the cubes.
    pub fn along(placed: &Placed, point: &Vec3, normal: &Vec3) -> Self {
        let crest: Vec<Vec3> = arch().into_iter().map(|s| s.0).collect();
        let height = |c: &Vec3| {
            // Along the template's own height the distance from the plane is linear but for the bend.
            let off = |t: f64| (placed.place(&(c + Vec3::new(0.0, 0.0, t))) - point).dot(normal);
            let (low, high) = (off(0.0), off(10.0));
            if (high - low).abs() > 1e-6 { (-10.0 * low / (high - low)).clamp(-30.0, 60.0) } else { USUAL }
        };
        Self { height: crest.iter().map(height).collect(), crest, cost: 0.0 }
    }
}

/// The seam between the rows of teeth.
pub(super) fn seam(hu: &Cubes, placed: &Placed) -> Seam {
    let stations = arch();
    let n = stations.len();
    let density = unrolled(hu, placed, &stations);
    // Air or soft tissue is cheap, and cheaper between two crowns.
    let cost = |i: usize, k: usize| {
        let d = |k: usize| density[i * HEIGHTS + k];
        let up = (k..=(k + CROWN).min(HEIGHTS - 1)).map(d).fold(0.0, f64::max);
        let down = (k.saturating_sub(CROWN)..=k).map(d).fold(0.0, f64::max);
        let own = (d(k) - 200.0).max(0.0);
        own.min(DENSE) + 0.1 * (own - DENSE).max(0.0) - 0.12 * up.min(down).min(1200.0) - 0.04 * (up + down).min(2400.0)
    };
    let costs: Vec<f64> = (0..n).flat_map(|i| (0..HEIGHTS).map(move |k| (i, k))).map(|(i, k)| cost(i, k)).collect();
    let plane = plane(&costs, &stations);
    let path = path(&costs, &plane);
    let height: Vec<f32> = path.iter().map(|&k| FIRST as f32 + k as f32).collect();
    let height = convolved(&height, [n, 1, 1], 0, &gaussian(0.8)).into_iter().map(f64::from).collect();
    let cost = path.iter().enumerate().map(|(i, &k)| costs[i * HEIGHTS + k]).sum::<f64>() / n as f64;
    Seam { crest: stations.into_iter().map(|s| s.0).collect(), height, cost }
}

/// Density over the arch, HU: station by station, from below upwards.
fn unrolled(hu: &Cubes, placed: &Placed, stations: &[(Vec3, Vec3)]) -> Vec<f64> {
    let mut density = Vec::with_capacity(stations.len() * HEIGHTS);
    for (crest, normal) in stations {
        for k in 0..HEIGHTS {
            let up = Vec3::new(0.0, 0.0, FIRST + k as f64);
            let mut across = ACROSS.map(|q| {
                hu.sample(&placed.place(&(crest + q * normal + up))).unwrap_or(CLIP[0]).clamp(CLIP[0], CLIP[1])
            });
            across.sort_by(f64::total_cmp);
            let mean = across.iter().sum::<f64>() / across.len() as f64;
            let top = 0.5 * (across[4] + across[5]);
            density.push((0.5 * (mean + top)) as f32);
        }
    }
    let smooth = convolved(&density, [HEIGHTS, stations.len(), 1], 0, &gaussian(1.0));
    smooth.into_iter().map(f64::from).collect()
}

/// Heights of the plane that lies best in the gap, at each station.
fn plane(costs: &[f64], stations: &[(Vec3, Vec3)]) -> Vec<f64> {
    let steps = |from: f64, step: f64, n: usize| (0..n).map(move |i| from + step * i as f64);
    let mut best = (f64::INFINITY, Vec::new());
    for front in steps(4.0, 0.5, 46) {
        for rise in steps(-12.0, 1.5, 17) {
            for roll in steps(-3.0, 1.5, 5) {
                let height = |(c, _): &(Vec3, Vec3)| front + rise * (c.y + 71.0) / 50.0 + roll * c.x / 40.0;
                let heights: Vec<f64> = stations.iter().map(height).collect();
                let of = |(i, t): (usize, &f64)| {
                    let at = (t - FIRST).clamp(0.0, HEIGHTS as f64 - 1.001);
                    let (k, u) = (at as usize, at.fract());
                    costs[i * HEIGHTS + k] * (1.0 - u) + costs[i * HEIGHTS + k + 1] * u
                };
                let mean = heights.iter().enumerate().map(of).sum::<f64>() / stations.len() as f64;
                let total = mean + 2.5 * (front - USUAL).powi(2) + 0.5 * rise * rise + 2.0 * roll * roll;
                if total < best.0 {
                    best = (total, heights);
                }
            }
        }
    }
    best.1
}

/// The cheapest way along the stations near the plane: dynamic programming over heights.
fn path(costs: &[f64], plane: &[f64]) -> Vec<usize> {
    let n = plane.len();
    let along: Vec<f32> = costs.iter().map(|&c| c as f32).collect();
    let smooth = convolved(&along, [HEIGHTS, n, 1], 1, &gaussian(0.8));
    let own = |i: usize, k: usize| f64::from(smooth[i * HEIGHTS + k]) + 4.0 * (FIRST + k as f64 - plane[i]).powi(2);
    let mut sum: Vec<f64> = (0..HEIGHTS).map(|k| own(0, k)).collect();
    let mut from = vec![0usize; n * HEIGHTS];
    for i in 1..n {
        let best = |k: usize| {
            (k.saturating_sub(2)..=(k + 2).min(HEIGHTS - 1))
                .map(|q| (sum[q] + 25.0 * (q.abs_diff(k) as f64).powi(2), q))
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .unwrap_or((f64::INFINITY, k))
        };
        let next: Vec<(f64, usize)> = (0..HEIGHTS).map(best).collect();
        next.iter().enumerate().for_each(|(k, b)| from[i * HEIGHTS + k] = b.1);
        sum = next.iter().enumerate().map(|(k, b)| b.0 + own(i, k)).collect();
    }
    let mut k = (0..HEIGHTS).min_by(|&a, &b| sum[a].total_cmp(&sum[b])).unwrap_or(0);
    let mut path = vec![k; n];
    for i in (1..n).rev() {
        k = from[i * HEIGHTS + k];
        path[i - 1] = k;
    }
    path
}
