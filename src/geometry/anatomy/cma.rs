//! A minimum without derivatives: sampling that learns the covariance of what is good. The same numbers each time.
//!
//! Source: N. Hansen, "The CMA evolution strategy: a tutorial", arXiv:1604.00772, 2016, sections 2 and 3.
//! Departure: weights are those of the better half alone; the covariance is decomposed in each generation.

use nalgebra::{SMatrix, SVector, SymmetricEigen};

use super::template::PARAMETERS as N;
use crate::math::Random;

/// How far and how long is searched.
pub(super) struct Search {
    /// Points a generation.
    pub points: usize,
    /// Most generations.
    pub generations: usize,
}

/// Search ends when the steps are this small, in the units of `spread`.
const ENOUGH: f64 = 0.02;

/// Lowest point found about `start` and its value; `spread` is one standard deviation of each number.
pub(super) fn minimise(
    value: impl Fn(&[f64; N]) -> f64,
    start: &[f64; N],
    spread: &[f64; N],
    search: &Search,
) -> ([f64; N], f64) {
    let n = N as f64;
    let mu = search.points / 2;
    let weights: Vec<f64> = (1..=mu).map(|i| (mu as f64 + 0.5).ln() - (i as f64).ln()).collect();
    let sum: f64 = weights.iter().sum();
    let weights: Vec<f64> = weights.iter().map(|w| w / sum).collect();
    let mass = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
    let cc = 4.0 / (n + 4.0);
    let cs = (mass + 2.0) / (n + mass + 5.0);
    let c1 = 2.0 / ((n + 1.3).powi(2) + mass);
    let cm = (1.0 - c1).min(2.0 * (mass - 2.0 + 1.0 / mass) / ((n + 2.0).powi(2) + mass));
    let damping = 1.0 + cs + 2.0 * (((mass - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0);
    let length = n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));
    let at = |x: &SVector<f64, N>| std::array::from_fn(|k| start[k] + spread[k] * x[k]);

    let mut random = Random(1);
    let mut covariance = SMatrix::<f64, N, N>::identity();
    let (mut path_c, mut path_s) = (SVector::<f64, N>::zeros(), SVector::<f64, N>::zeros());
    let (mut middle, mut step) = (SVector::<f64, N>::zeros(), 1.0);
    let mut best = (middle, value(start));
    for generation in 0..search.generations {
        let eigen = SymmetricEigen::new(covariance);
        let (axes, lengths) = (eigen.eigenvectors, eigen.eigenvalues.map(|d| d.max(1e-12).sqrt()));
        let mut points: Vec<(f64, SVector<f64, N>)> = (0..search.points)
            .map(|_| {
                let y = axes * lengths.component_mul(&SVector::from_fn(|_, _| normal(&mut random)));
                (value(&at(&(middle + step * y))), y)
            })
            .collect();
        points.sort_by(|p, q| p.0.total_cmp(&q.0));
        if points[0].0 < best.1 {
            best = (middle + step * points[0].1, points[0].0);
        }
        let mean = points.iter().zip(&weights).fold(SVector::zeros(), |m, ((_, y), w)| m + *w * y);
        middle += step * mean;
        let white = axes * (axes.transpose() * mean).component_div(&lengths);
        path_s = (1.0 - cs) * path_s + (cs * (2.0 - cs) * mass).sqrt() * white;
        let grown = path_s.norm() / (1.0 - (1.0 - cs).powi(2 * generation as i32 + 2)).sqrt();
        let steady = if grown < (1.4 + 2.0 / (n + 1.0)) * length { 1.0 } else { 0.0 };
        path_c = (1.0 - cc) * path_c + steady * (cc * (2.0 - cc) * mass).sqrt() * mean;
        covariance = (1.0 - c1 - cm) * covariance + c1 * path_c * path_c.transpose();
        points.iter().zip(&weights).for_each(|((_, y), w)| covariance += cm * *w * y * y.transpose());
        step *= (cs / damping * (path_s.norm() / length - 1.0)).exp();
        if step * lengths.max() < ENOUGH {
            break;
        }
    }
    (at(&best.0), best.1)
}

/// A normally distributed number (Box and Muller).
fn normal(random: &mut Random) -> f64 {
    let (u, v) = (1.0 - random.number(), random.number());
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}
