//! A scan on cubes along its own axes, in millimetres from its first sample: what anatomy is looked for in.

use std::borrow::Cow;

use super::super::clean::{components, largest};
use super::super::{Grid, Volume};
use crate::math::{Mat3, Vec3};

/// Hounsfield units beyond these are artefacts of metal.
const CT: [f32; 2] = [-1024.0, 3071.0];
/// Standard deviation of the smoothing before samples are thinned out, in cubes.
const SMOOTH: f64 = 0.4;
/// Blurs end at this many standard deviations.
const TAIL: f64 = 3.0;

/// Samples on cubes; lengths are millimetres.
#[derive(Debug, Clone)]
pub(super) struct Cubes {
    /// Edge of a cube.
    pub h: f64,
    /// Where the samples lie; spacing `h`, origin 0, axes those of the scan.
    pub grid: Grid,
    /// First axis fastest.
    pub values: Vec<f32>,
}

impl Cubes {
    /// An upright volume on cubes of edge `h`, smoothed where its voxels are smaller.
    pub fn of(volume: &Volume, h: f64) -> Self {
        let mut dims = volume.grid.dims;
        let mut values = Cow::Borrowed(&volume.samples);
        // The slowest axis first: whole slices are added up.
        for axis in [2, 1, 0] {
            let taps = taps(dims[axis], volume.grid.spacing[axis] * 1e3, h);
            let stride: usize = dims[..axis].iter().product();
            let mut thinned = Vec::with_capacity(values.len() / dims[axis] * taps.len());
            for block in values.chunks_exact(stride * dims[axis]) {
                for (first, weights) in &taps {
                    let start = thinned.len();
                    thinned.resize(start + stride, 0.0f32);
                    for (k, w) in weights.iter().enumerate() {
                        let row = &block[(first + k) * stride..(first + k + 1) * stride];
                        thinned[start..].iter_mut().zip(row).for_each(|(t, s)| *t += w * s.clamp(CT[0], CT[1]));
                    }
                }
            }
            dims[axis] = taps.len();
            values = Cow::Owned(thinned);
        }
        let values = values.into_owned();
        let grid = Grid { dims, spacing: Vec3::repeat(h), origin: Vec3::zeros(), direction: Mat3::identity() };
        Self { h, grid, values }
    }

    /// The same cubes with other values.
    pub fn with(&self, values: Vec<f32>) -> Self {
        Self { h: self.h, grid: self.grid.clone(), values }
    }

    /// Position of a sample.
    pub fn place(&self, at: usize) -> Vec3 {
        self.grid.place(at)
    }

    /// Far end of the samples.
    pub fn extent(&self) -> Vec3 {
        Vec3::from_fn(|a, _| (self.grid.dims[a] as f64 - 1.0) * self.h)
    }

    /// Distance of a place from the nearest end of the field, negative outside.
    pub fn inside_by(&self, p: &Vec3) -> f64 {
        p.min().min((self.extent() - p).min())
    }

    /// Trilinear value; none outside of the field.
    pub fn sample(&self, p: &Vec3) -> Option<f64> {
        let c = p / self.h;
        let [nx, ny, nz] = self.grid.dims;
        // Written so that a coordinate that is no number is outside.
        let inside = |c: f64, n: usize| c >= 0.0 && c < n as f64 - 1.0;
        if !(inside(c.x, nx) && inside(c.y, ny) && inside(c.z, nz)) {
            return None;
        }
        let [i, j, k] = [c.x as usize, c.y as usize, c.z as usize];
        let [u, v, w] = [c.x - i as f64, c.y - j as f64, c.z - k as f64];
        let at = (k * ny + j) * nx + i;
        let row = |at: usize| f64::from(self.values[at]) * (1.0 - u) + f64::from(self.values[at + 1]) * u;
        let slice = |at: usize| row(at) * (1.0 - v) + row(at + nx) * v;
        Some(slice(at) * (1.0 - w) + slice(at + nx * ny) * w)
    }

    /// Blurred by a Gaussian of standard deviation `sigma`; at the ends the last samples go on.
    pub fn blurred(&self, sigma: f64) -> Self {
        let mut values = self.values.clone();
        let kernel = gaussian(sigma / self.h);
        for axis in 0..3 {
            values = convolved(&values, self.grid.dims, axis, &kernel);
        }
        self.with(values)
    }

    /// The largest body of tissue without what hangs on it by less than `2 radius`: table, cup, face mask.
    pub fn body(&self, skin: f64, radius: f64) -> Vec<bool> {
        let steps = ((radius / self.h).round() as usize).max(1);
        let mut tissue: Vec<bool> = self.values.iter().map(|&v| f64::from(v) > skin).collect();
        for step in 0..steps {
            tissue = self.stepped(&tissue, false, step);
        }
        let (number, sizes) = components(&self.grid, |at| tissue[at]);
        let Some(largest) = largest(&sizes) else {
            return vec![false; self.values.len()];
        };
        // What was taken off is put back, and as much again: the rim is no place to lose bone.
        let mut body: Vec<bool> = number.iter().map(|&n| n as usize == largest + 1).collect();
        for step in 0..2 * steps {
            body = self.stepped(&body, true, step);
        }
        body
    }

    /// A region grown (or shrunk) by one cube, by faces and by edges in turn; outside of the field is what is inside.
    fn stepped(&self, region: &[bool], grow: bool, step: usize) -> Vec<bool> {
        let [nx, ny, nz] = self.grid.dims;
        let mut out = region.to_vec();
        let spread = |from: &[bool], out: &mut Vec<bool>, at: usize, other: usize| {
            if from[other] == grow {
                out[at] = grow;
            }
        };
        let strides = [1, nx, nx * ny];
        let diagonal = step % 2 == 1;
        for k in 0..nz {
            for j in 0..ny {
                for i in 0..nx {
                    let at = (k * ny + j) * nx + i;
                    if region[at] == grow {
                        continue;
                    }
                    let (c, n) = ([i, j, k], [nx, ny, nz]);
                    for a in 0..3 {
                        if c[a] > 0 {
                            spread(region, &mut out, at, at - strides[a]);
                        }
                        if c[a] + 1 < n[a] {
                            spread(region, &mut out, at, at + strides[a]);
                        }
                        let b = (a + 1) % 3;
                        if diagonal && c[a] > 0 && c[b] > 0 && c[a] + 1 < n[a] && c[b] + 1 < n[b] {
                            let (s, t) = (strides[a], strides[b]);
                            for other in [at + s + t, at + s - t, at - s + t, at - s - t] {
                                spread(region, &mut out, at, other);
                            }
                        }
                    }
                }
            }
        }
        out
    }
}

/// For each sample wanted the first sample read and the weights from there on.
fn taps(n: usize, spacing: f64, h: f64) -> Vec<(usize, Vec<f32>)> {
    let count = ((n as f64 - 1.0) * spacing / h) as usize + 1;
    let reach = if h > spacing { TAIL * SMOOTH * h } else { 0.0 };
    let tap = |i: usize| {
        let x = i as f64 * h / spacing;
        let weight = |k: usize| {
            let d = k as f64 - x;
            if reach > 0.0 { (-0.5 * (d * spacing / (SMOOTH * h)).powi(2)).exp() } else { (1.0 - d.abs()).max(0.0) }
        };
        let first = (x - reach / spacing).max(0.0).floor() as usize;
        let last = (((x + reach / spacing).floor() as usize) + 1).min(n - 1);
        let weights: Vec<f64> = (first..=last).map(weight).collect();
        let sum: f64 = weights.iter().sum();
        (first, weights.iter().map(|w| (w / sum) as f32).collect())
    };
    (0..count).map(tap).collect()
}

/// One half of a normalised Gaussian kernel, the middle first; `sigma` in samples.
pub(super) fn gaussian(sigma: f64) -> Vec<f32> {
    let reach = (TAIL * sigma).ceil() as usize;
    let half: Vec<f64> = (0..=reach).map(|k| (-0.5 * (k as f64 / sigma).powi(2)).exp()).collect();
    let sum = 2.0 * half.iter().sum::<f64>() - half[0];
    half.iter().map(|w| (w / sum) as f32).collect()
}

/// A symmetric kernel along one axis; beyond the ends the last samples go on.
pub(super) fn convolved(values: &[f32], dims: [usize; 3], axis: usize, half: &[f32]) -> Vec<f32> {
    let stride: usize = dims[..axis].iter().product();
    let n = dims[axis];
    let mut out = vec![0.0f32; values.len()];
    for (from, to) in values.chunks_exact(stride * n).zip(out.chunks_exact_mut(stride * n)) {
        for i in 0..n {
            let row = &mut to[i * stride..(i + 1) * stride];
            for (k, &w) in half.iter().enumerate() {
                for at in [i.saturating_sub(k), (i + k).min(n - 1)].into_iter().take(if k == 0 { 1 } else { 2 }) {
                    row.iter_mut().zip(&from[at * stride..(at + 1) * stride]).for_each(|(r, v)| *r += w * v);
                }
            }
        }
    }
    out
}
