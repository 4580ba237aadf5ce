//! Signed distance to an isosurface of a volume, sampled on the volume's own grid.
//!
//! Near the surface the distance to the marching-cubes triangles is exact; further out |grad d| = 1 is solved by
//! sweeps through the grid in all eight directions. The sign is the sample's against the threshold.
//!
//! Source: H. Zhao, "A fast sweeping method for Eikonal equations", Math. Comp. 74, 2005, section 2.
//! Departure: spacing may differ along the axes; the start values are exact distances, not interpolated crossings.

use super::{Field, Grid, Surface, Volume, marching_cubes, nearest_on_triangle};
use crate::math::Vec3;

/// Exact distances reach this many voxels from each triangle's box.
const BAND: f64 = 1.5;
/// Rounds of sweeps in eight directions for ways that wind round bones; straight ways need one.
const WINDING_ROUNDS: usize = 4;

/// A signed distance sampled on a grid, m; negative where the body is.
#[derive(Debug, Clone, PartialEq)]
pub struct Distance {
    /// Where the samples lie.
    pub grid: Grid,
    /// Distances, m.
    pub values: Vec<f32>,
    /// The isosurface itself; without triangles every distance is infinite.
    pub surface: Surface,
}

impl Distance {
    /// Distance to the surface where the volume passes `iso`; the body is where samples reach it.
    pub fn to_isosurface(volume: &Volume, iso: f64) -> Self {
        let surface = marching_cubes(&volume.grid, &volume.samples, iso);
        let mut values = unsigned(&volume.grid, &surface);
        for (d, &hu) in values.iter_mut().zip(&volume.samples) {
            if f64::from(hu) >= iso {
                *d = -*d;
            }
        }
        Self { grid: volume.grid.clone(), values, surface }
    }
}

impl Field for Distance {
    fn at(&self, p: &Vec3) -> f64 {
        self.grid.sample(&self.values, p)
    }
}

/// An isosurface as a field: its sign is exactly that of the interpolated volume.
#[derive(Debug, Clone, Copy)]
pub struct Isosurface<'a> {
    /// The volume.
    pub volume: &'a Volume,
    /// Threshold; the body is at or above it.
    pub iso: f64,
    /// Distance to the surface.
    pub distance: &'a Distance,
}

/// Smallest magnitude an isosurface field returns off the surface, m: far below any mesh edge.
const TINY: f64 = 1e-9;

impl Field for Isosurface<'_> {
    fn at(&self, p: &Vec3) -> f64 {
        let d = self.distance.at(p).abs().max(TINY);
        if self.level(p) > 0.0 { d } else { -d }
    }

    fn level(&self, p: &Vec3) -> f64 {
        self.iso - self.volume.sample(p)
    }
}

/// Unsigned distance to a surface on every sample of a grid.
pub fn unsigned(grid: &Grid, surface: &Surface) -> Vec<f32> {
    let mut values = band(grid, surface);
    let fixed: Vec<bool> = values.iter().map(|v| v.is_finite()).collect();
    (0..8).for_each(|direction| {
        sweep(grid, &mut values, &fixed, direction);
    });
    values
}

/// Exact unsigned distance to a surface on the samples next to it, infinite elsewhere.
pub(super) fn band(grid: &Grid, surface: &Surface) -> Vec<f32> {
    let mut values = vec![f32::INFINITY; grid.len()];
    let reach = grid.spacing.map(|s| BAND * s);
    // Grid coordinates in metres: the axes are orthonormal, so distances are kept.
    let local: Vec<Vec3> = surface.vertices.iter().map(|v| grid.coordinates(v).component_mul(&grid.spacing)).collect();
    for t in &surface.triangles {
        let corners = t.map(|a| local[a as usize]);
        let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
        let radius = corners.iter().fold(0.0, |r: f64, c| r.max((c - centre).norm()));
        let low = corners[0].inf(&corners[1]).inf(&corners[2]) - reach;
        let high = corners[0].sup(&corners[1]).sup(&corners[2]) + reach;
        let bound = |x: f64, a: usize| (x / grid.spacing[a]).clamp(0.0, grid.dims[a] as f64 - 1.0);
        let first = [0, 1, 2].map(|a| bound(low[a], a).ceil() as usize);
        let last = [0, 1, 2].map(|a| bound(high[a], a).floor() as usize);
        for k in first[2]..=last[2] {
            for j in first[1]..=last[1] {
                for i in first[0]..=last[0] {
                    let p = Vec3::new(i as f64, j as f64, k as f64).component_mul(&grid.spacing);
                    let value = &mut values[grid.index([i, j, k])];
                    // No point of the triangle is nearer than its bounding ball.
                    if (p - centre).norm() - radius < f64::from(*value) {
                        *value = value.min((nearest_on_triangle(&p, corners) - p).norm() as f32);
                    }
                }
            }
        }
    }
    values
}

/// Length of the shortest way from the sources to every sample round what is blocked; infinite in it.
pub(super) fn travel(grid: &Grid, sources: &[bool], blocked: &[bool]) -> Vec<f32> {
    let mut values: Vec<f32> = sources.iter().map(|&s| if s { 0.0 } else { f32::INFINITY }).collect();
    let fixed: Vec<bool> = sources.iter().zip(blocked).map(|(&s, &b)| s || b).collect();
    // Ways wind round bones: each bend may need another round.
    for _ in 0..WINDING_ROUNDS {
        if (0..8).map(|direction| sweep(grid, &mut values, &fixed, direction)).sum::<usize>() == 0 {
            break;
        }
    }
    values
}

/// Carries a length on, with a slope of one, from the samples that are known to all others.
pub(super) fn carry_on(grid: &Grid, values: &mut [f32], known: &[bool]) {
    values.iter_mut().zip(known).filter(|(_, k)| !**k).for_each(|(v, _)| *v = f32::INFINITY);
    (0..8).for_each(|direction| {
        sweep(grid, values, known, direction);
    });
}

/// One pass of |grad d| = 1 through the grid; bits of `direction` turn the axes round. Returns how many samples changed.
fn sweep(grid: &Grid, values: &mut [f32], fixed: &[bool], direction: usize) -> usize {
    let [nx, ny, nz] = grid.dims;
    let turned = |c: usize, n: usize, a: usize| if direction >> a & 1 == 1 { n - 1 - c } else { c };
    let h = [grid.spacing.x, grid.spacing.y, grid.spacing.z];
    let strides = [1, nx, nx * ny];
    let mut changed = 0;
    for k in 0..nz {
        let k = turned(k, nz, 2);
        for j in 0..ny {
            let j = turned(j, ny, 1);
            for i in 0..nx {
                let i = turned(i, nx, 0);
                let at = grid.index([i, j, k]);
                if fixed[at] {
                    continue;
                }
                let mut near = [f32::INFINITY; 3];
                for (a, (c, n)) in [(i, nx), (j, ny), (k, nz)].into_iter().enumerate() {
                    let below = if c > 0 { values[at - strides[a]] } else { f32::INFINITY };
                    let above = if c + 1 < n { values[at + strides[a]] } else { f32::INFINITY };
                    near[a] = below.min(above);
                }
                // No way shortens what is not longer than all it could come from.
                if near[0].min(near[1]).min(near[2]) >= values[at] {
                    continue;
                }
                let d = eikonal([0, 1, 2].map(|a| (f64::from(near[a]), h[a]))) as f32;
                if d < values[at] {
                    values[at] = d;
                    changed += 1;
                }
            }
        }
    }
    changed
}

/// Solves sum over axes of ((d - u)+ / h)^2 = 1 for d.
fn eikonal(mut upwind: [(f64, f64); 3]) -> f64 {
    upwind.sort_by(|p, q| p.0.total_cmp(&q.0));
    let mut d = upwind[0].0 + upwind[0].1;
    let (mut a, mut b, mut c) = (0.0, 0.0, -1.0);
    for (n, (u, h)) in upwind.into_iter().enumerate() {
        if u >= d {
            break;
        }
        let w = 1.0 / (h * h);
        a += w;
        b += w * u;
        c += w * u * u;
        let disc = b * b - a * c;
        if n > 0 && disc >= 0.0 {
            d = (b + disc.sqrt()) / a;
        }
    }
    d
}
