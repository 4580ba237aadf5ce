//! A CT volume: Hounsfield units on a regular grid that knows where it lies in the patient.
//!
//! World axes are LPS in metres: x to the patient's left, y to the back, z up.

use std::borrow::Cow;

use crate::math::{Mat3, Vec3};

/// What positions of voxels are rounded to, m.
const PICOMETRE: f64 = 1e-12;
/// Orders of three axes.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// A position without the round-off of how it was stored.
pub(crate) fn rounded(x: &Vec3) -> Vec3 {
    x.map(|c| (c / PICOMETRE).round() * PICOMETRE)
}

/// Where the samples of a regular grid lie: `x = origin + direction * (spacing .* [i, j, k])`.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Samples along each grid axis; the first runs fastest in memory.
    pub dims: [usize; 3],
    /// Distance between samples along each grid axis, m.
    pub spacing: Vec3,
    /// World position of sample (0, 0, 0), m.
    pub origin: Vec3,
    /// Unit vectors of the grid axes as columns.
    pub direction: Mat3,
}

impl Grid {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.dims.iter().product()
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Place of sample (i, j, k) in memory.
    pub fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.dims[1] + j) * self.dims[0] + i
    }

    /// World position of the sample at a place in memory, m.
    pub fn place(&self, at: usize) -> Vec3 {
        let [nx, ny, _] = self.dims;
        self.world(&Vec3::new((at % nx) as f64, (at / nx % ny) as f64, (at / (nx * ny)) as f64))
    }

    /// World position of fractional grid coordinates, m.
    pub fn world(&self, c: &Vec3) -> Vec3 {
        self.origin + self.direction * c.component_mul(&self.spacing)
    }

    /// Fractional grid coordinates of a world position.
    pub fn coordinates(&self, p: &Vec3) -> Vec3 {
        (self.direction.transpose() * (p - self.origin)).component_div(&self.spacing)
    }

    /// Corner with the smallest and corner with the largest world coordinates of the samples' box, m.
    pub fn bounds(&self) -> [Vec3; 2] {
        let far = Vec3::repeat(f64::INFINITY);
        (0..8).fold([far, -far], |[low, high], corner| {
            let c = Vec3::from_fn(|a, _| if corner >> a & 1 == 1 { self.dims[a] as f64 - 1.0 } else { 0.0 });
            let p = self.world(&c);
            [low.inf(&p), high.sup(&p)]
        })
    }

    /// Sample nearest to a world position, clamped to the grid.
    pub fn nearest(&self, p: &Vec3) -> [usize; 3] {
        let c = self.coordinates(p);
        [0, 1, 2].map(|a| c[a].round().clamp(0.0, self.dims[a] as f64 - 1.0) as usize)
    }

    /// Cell and weights of a world position for trilinear sampling, clamped to the grid.
    pub fn cell(&self, p: &Vec3) -> ([usize; 3], [f64; 3]) {
        let c = self.coordinates(p);
        let mut low = [0; 3];
        let mut weight = [0.0; 3];
        for a in 0..3 {
            let at = c[a].clamp(0.0, self.dims[a] as f64 - 1.0);
            low[a] = (at as usize).min(self.dims[a].saturating_sub(2));
            weight[a] = at - low[a] as f64;
        }
        (low, weight)
    }

    /// Trilinear value at a world position, clamped to the grid.
    pub fn sample(&self, values: &[f32], p: &Vec3) -> f64 {
        let ([i, j, k], [u, v, w]) = self.cell(p);
        let at = |di: usize, dj: usize, dk: usize| {
            let clamp = |c: usize, a: usize| c.min(self.dims[a] - 1);
            f64::from(values[self.index([clamp(i + di, 0), clamp(j + dj, 1), clamp(k + dk, 2)])])
        };
        let along = |dj: usize, dk: usize| at(0, dj, dk) * (1.0 - u) + at(1, dj, dk) * u;
        let across = |dk: usize| along(0, dk) * (1.0 - v) + along(1, dk) * v;
        across(0) * (1.0 - w) + across(1) * w
    }
}

/// CT samples in Hounsfield units.
#[derive(Debug, Clone, PartialEq)]
pub struct Volume {
    /// Where the samples lie.
    pub grid: Grid,
    /// Hounsfield units, first axis fastest.
    pub samples: Vec<f32>,
}

impl Volume {
    /// Trilinear Hounsfield units at a world position, clamped to the grid.
    pub fn sample(&self, p: &Vec3) -> f64 {
        self.grid.sample(&self.samples, p)
    }

    /// The same samples with grid axes that run along x, y and z as nearly as they can, so that nothing depends on the
    /// order in which voxels are stored.
    pub fn upright(&self) -> Cow<'_, Volume> {
        let grid = &self.grid;
        let along = |order: &[usize; 3]| (0..3).map(|a| grid.direction[(a, order[a])].abs()).sum::<f64>();
        let order = ORDERS.into_iter().fold(ORDERS[0], |best, o| if along(&o) > along(&best) { o } else { best });
        let turned = [0, 1, 2].map(|a| grid.direction[(a, order[a])] < 0.0);
        if order == ORDERS[0] && turned == [false; 3] {
            return Cow::Borrowed(self);
        }
        let sign = |a: usize| if turned[a] { -1.0 } else { 1.0 };
        let last = Vec3::from_fn(|g, _| {
            let a = (0..3).find(|&a| order[a] == g).unwrap_or(g);
            if turned[a] { grid.dims[g] as f64 - 1.0 } else { 0.0 }
        });
        let upright = Grid {
            dims: order.map(|g| grid.dims[g]),
            spacing: Vec3::from_fn(|a, _| grid.spacing[order[a]]),
            origin: rounded(&grid.world(&last)),
            // Adding zero makes -0 one.
            direction: Mat3::from_fn(|r, a| grid.direction[(r, order[a])] * sign(a) + 0.0),
        };
        let [nx, ny, nz] = upright.dims;
        let mut samples = Vec::with_capacity(upright.len());
        for k in 0..nz {
            for j in 0..ny {
                for i in 0..nx {
                    let mut stored = [0; 3];
                    for (a, at) in [i, j, k].into_iter().enumerate() {
                        stored[order[a]] = if turned[a] { upright.dims[a] - 1 - at } else { at };
                    }
                    samples.push(self.samples[grid.index(stored)]);
                }
            }
        }
        Cow::Owned(Volume { grid: upright, samples })
    }

    /// Smallest and largest sample.
    pub fn range(&self) -> (f32, f32) {
        self.samples.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &s| (low.min(s), high.max(s)))
    }
}

/// Tissue numbers on a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Labels {
    /// Where the labels lie.
    pub grid: Grid,
    /// One number a voxel, first axis fastest.
    pub ids: Vec<u8>,
}

impl Labels {
    /// Label of the voxel that a world position lies in; 0 outside of all.
    pub fn at(&self, p: &Vec3) -> u8 {
        let c = self.grid.coordinates(p);
        let inside = (0..3).all(|a| (-0.5..=self.grid.dims[a] as f64 - 0.5).contains(&c[a]));
        if inside { self.ids[self.grid.index(self.grid.nearest(p))] } else { 0 }
    }
}
