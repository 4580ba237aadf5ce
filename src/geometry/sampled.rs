//! A field sampled on an axis-parallel grid with one spacing: value and slope from the eight samples of a cell.

use super::{Field, Grid};
use crate::math::{Mat3, Vec3};

/// Trilinear samples of a field, m.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sampled {
    low: Vec3,
    per_metre: f64,
    dims: [usize; 3],
    values: Vec<f32>,
}

/// An axis-parallel grid of one spacing that holds a box.
pub(super) fn cubic(low: Vec3, high: Vec3, spacing: f64) -> Grid {
    let dims = [0, 1, 2].map(|a| ((high[a] - low[a]) / spacing).ceil() as usize + 1);
    Grid { dims, spacing: Vec3::repeat(spacing), origin: low, direction: Mat3::identity() }
}

impl Sampled {
    /// Samples that lie on a grid made by [`cubic`].
    pub fn new(grid: &Grid, values: Vec<f32>) -> Self {
        Self { low: grid.origin, per_metre: 1.0 / grid.spacing.x, dims: grid.dims, values }
    }

    /// A field sampled on a grid made by [`cubic`].
    pub fn of(grid: &Grid, field: &dyn Field) -> Self {
        Self::new(grid, (0..grid.len()).map(|at| field.at(&grid.place(at)) as f32).collect())
    }

    /// The cell of a place, where in it the place lies, and the samples at its corners (x fastest).
    fn cell(&self, p: &Vec3) -> ([f64; 3], [f64; 8]) {
        let [nx, ny, _] = self.dims;
        let mut i = [0; 3];
        let mut u = [0.0; 3];
        for a in 0..3 {
            let c = ((p[a] - self.low[a]) * self.per_metre).clamp(0.0, self.dims[a] as f64 - 1.0);
            i[a] = (c as usize).min(self.dims[a].saturating_sub(2));
            u[a] = c - i[a] as f64;
        }
        let at = (i[2] * ny + i[1]) * nx + i[0];
        let step = |a: usize, n: usize| if self.dims[a] > 1 { n } else { 0 };
        let (dx, dy, dz) = (step(0, 1), step(1, nx), step(2, nx * ny));
        let v = |k: usize| f64::from(self.values[at + (k & 1) * dx + (k >> 1 & 1) * dy + (k >> 2) * dz]);
        (u, std::array::from_fn(v))
    }
}

impl Field for Sampled {
    fn at(&self, p: &Vec3) -> f64 {
        let ([u, v, w], c) = self.cell(p);
        let x = |k: usize| c[k] + (c[k + 1] - c[k]) * u;
        let y = |k: usize| x(k) + (x(k + 2) - x(k)) * v;
        y(0) + (y(4) - y(0)) * w
    }

    fn slope(&self, p: &Vec3) -> (f64, Vec3) {
        let ([u, v, w], c) = self.cell(p);
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let x: [f64; 4] = std::array::from_fn(|k| mix(c[2 * k], c[2 * k + 1], u));
        let dx: [f64; 4] = std::array::from_fn(|k| c[2 * k + 1] - c[2 * k]);
        let y = [mix(x[0], x[1], v), mix(x[2], x[3], v)];
        let slope = Vec3::new(
            mix(mix(dx[0], dx[1], v), mix(dx[2], dx[3], v), w),
            mix(x[1] - x[0], x[3] - x[2], w),
            y[1] - y[0],
        );
        (mix(y[0], y[1], w), slope * self.per_metre)
    }
}
