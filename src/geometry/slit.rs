//! The oral slit as a sheet: half way between the jaws, from commissure to commissure and between the rows of teeth.
//!
//! ```text
//! level = (d_mandible - d_skull) / 2, made a distance by its slope           0 on the sheet, positive above it
//! rim   = min(lips, bite), smooth                                            negative where the tissue is parted
//! lips  = max(|x - x_mouth| - half width, y - back)
//! bite  = max(depth wanted under the skin - depth, d_skull - crown, d_mandible - crown, the box of the bite)
//! ```

use super::face::Mouth;
use super::mesher::Sheet;
use super::sampled::{Sampled, cubic};
use super::{Field, Grid, Surface, unsigned};
use crate::math::Vec3;

/// Spacing of the samples, m.
const SPACING: f64 = 1e-3;
/// How far beyond the mouth the fields reach, m.
const MARGIN: f64 = 0.012;
/// Rounds of smoothing of both fields: each blurs by .7 samples.
const BLURS: usize = 3;
/// Slopes less than this are not made one: there the jaws lie behind each other.
const FLAT: f64 = 0.15;
/// Radius of the blend between lips and bite, and between the sides of each, m.
const BLEND: f64 = 4e-3;

/// Where the lips and the rows of teeth part.
pub(super) struct Slit {
    level: Sampled,
    rim: Sampled,
}

impl Slit {
    /// The sheet between two jaws; `under` is the depth under the outer skin, m.
    pub fn new(mouth: &Mouth, skull: &Surface, mandible: &Surface, under: &dyn Field) -> Self {
        let (low, high) = mouth.bounds();
        let margin = Vec3::repeat(MARGIN);
        let grid = cubic(low - margin, high + margin, SPACING);
        let [to_skull, to_mandible] = [skull, mandible].map(|s| unsigned(&grid, s));
        let far = (high - low).norm() as f32;
        let mut level: Vec<f32> =
            to_skull.iter().zip(&to_mandible).map(|(s, m)| 0.5 * (m.min(far) - s.min(far))).collect();
        let rim_at = |at: usize| {
            let p = grid.place(at);
            mouth.rim(&p, [to_skull[at], to_mandible[at]].map(f64::from), under.at(&p), BLEND) as f32
        };
        let mut rim: Vec<f32> = (0..grid.len()).map(rim_at).collect();
        for _ in 0..BLURS {
            blur(&grid, &mut level);
            blur(&grid, &mut rim);
        }
        Self { level: Sampled::new(&grid, sloped(&grid, &level)), rim: Sampled::new(&grid, rim) }
    }

    pub fn sheet(&self) -> Sheet<'_> {
        Sheet { level: &self.level, rim: &self.rim }
    }
}

/// A weighted mean with the neighbours along each axis: 1 2 1.
fn blur(grid: &Grid, values: &mut [f32]) {
    let [nx, ny, _] = grid.dims;
    for (a, stride) in [1, nx, nx * ny].into_iter().enumerate() {
        let old = values.to_vec();
        for (at, v) in values.iter_mut().enumerate() {
            let c = at / stride % grid.dims[a];
            let below = if c > 0 { old[at - stride] } else { old[at] };
            let above = if c + 1 < grid.dims[a] { old[at + stride] } else { old[at] };
            *v = 0.25 * (below + 2.0 * old[at] + above);
        }
    }
}

/// A level divided by its slope: near its zero, a distance.
fn sloped(grid: &Grid, values: &[f32]) -> Vec<f32> {
    let [nx, ny, _] = grid.dims;
    let strides = [1, nx, nx * ny];
    let slope = |at: usize| {
        let along = |a: usize| {
            let c = at / strides[a] % grid.dims[a];
            let (low, high) =
                (at - strides[a] * usize::from(c > 0), at + strides[a] * usize::from(c + 1 < grid.dims[a]));
            let steps = ((high - low) / strides[a]).max(1) as f64;
            f64::from(values[high] - values[low]) / (steps * SPACING)
        };
        (0..3).map(|a| along(a).powi(2)).sum::<f64>().sqrt()
    };
    (0..values.len()).map(|at| (f64::from(values[at]) / slope(at).max(FLAT)) as f32).collect()
}
