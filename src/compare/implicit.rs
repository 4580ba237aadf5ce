//! Tissue as an implicit surface: a sampled field whose positive side is the body, moved by points of bone without any
//! mechanics.
//!
//! ```text
//! body = { x : f(x) >= 0 },   moved by u:  f'(x) = f(x - u(x)),   u(x) = sum_k w_k u_k / sum_k w_k,   w_k = |x - X_k|^-4
//! cut away by a half space h(x) >= 0:      f'(x) = min(f(x), -h(x))
//! ```
//!
//! Source: the row of implicit surface models in the source paper's table 2; the field after Blinn, "A generalization of
//! algebraic surface drawing", ACM TOG 1(3), 1982; `u` after Shepard, "A two-dimensional interpolation function for
//! irregularly-spaced data", ACM National Conference 1968.

use crate::geometry::{Grid, Surface, marching_cubes};
use crate::math::Vec3;

/// A field on a grid.
pub struct Implicit {
    grid: Grid,
    values: Vec<f32>,
}

/// A point of bone at rest (m), and its displacement (m).
pub type Control = (Vec3, Vec3);

impl Implicit {
    /// Samples `f`, in m where it is a distance.
    pub fn new(grid: Grid, f: impl Fn(&Vec3) -> f64) -> Implicit {
        let mut out = Implicit { values: vec![0.0; grid.len()], grid };
        out.fill(|x, _| f(x) as f32);
        out
    }

    /// The body after its controls have moved: each sample takes the value from where it came.
    pub fn moved(&self, controls: &[Control]) -> Implicit {
        let mut out = Implicit { grid: self.grid.clone(), values: vec![0.0; self.values.len()] };
        out.fill(|x, _| self.at(&(x - displacement(controls, x))));
        out
    }

    /// What is left without the points where `h` is positive.
    pub fn cut(&self, h: impl Fn(&Vec3) -> f64) -> Implicit {
        let mut out = Implicit { grid: self.grid.clone(), values: self.values.clone() };
        out.fill(|x, value| value.min(-h(x) as f32));
        out
    }

    /// The surface that a person sees.
    pub fn surface(&self) -> Surface {
        marching_cubes(&self.grid, &self.values, 0.0)
    }

    fn fill(&mut self, value: impl Fn(&Vec3, f32) -> f32) {
        let [nx, ny, nz] = self.grid.dims;
        let places = (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])));
        for (to, c) in self.values.iter_mut().zip(places) {
            *to = value(&self.grid.world(&Vec3::from(c.map(|c| c as f64))), *to);
        }
    }

    /// Trilinear; outside the grid as at its border.
    fn at(&self, x: &Vec3) -> f32 {
        let c = self.grid.coordinates(x);
        let cell = [0, 1, 2].map(|a| c[a].floor().clamp(0.0, self.grid.dims[a] as f64 - 2.0) as usize);
        let t = [0, 1, 2].map(|a| (c[a] - cell[a] as f64).clamp(0.0, 1.0) as f32);
        let mut sum = 0.0;
        for corner in 0..8 {
            let bit = |a: usize| corner >> a & 1;
            let w: f32 = (0..3).map(|a| if bit(a) == 1 { t[a] } else { 1.0 - t[a] }).product();
            sum += w * self.values[self.grid.index([0, 1, 2].map(|a| cell[a] + bit(a)))];
        }
        sum
    }
}

/// The controls' displacements, weighted by the inverse fourth power of their distance, m.
pub fn displacement(controls: &[Control], x: &Vec3) -> Vec3 {
    let (mut sum, mut weights) = (Vec3::zeros(), 0.0);
    for (X, u) in controls {
        let d2 = (x - X).norm_squared();
        if d2 == 0.0 {
            return *u;
        }
        let w = 1.0 / (d2 * d2);
        sum += w * u;
        weights += w;
    }
    sum / weights
}
