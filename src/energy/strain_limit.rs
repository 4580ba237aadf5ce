//! Strain limits: silent between two stretches, steep beyond them.
//!
//! ```text
//! psi = k w^2 sum_i [e(y_i) + e(z_i)],   y_i = (s_i - longest)/w + 3,   z_i = (shortest - s_i)/w + 3,   w = band/3
//! e(y) = 0 for y <= 0,   exp(y) - 1 - y - y^2/2 up to y = 6,   from there on the parabola that touches it
//! ```
//!
//! The limit sets in over its band, which ends at the limit; there the stress is 5 k band, and it grows by e with each third
//! of a band beyond. It is C2, zero inside, and finite everywhere, so a motion that breaks the limit still has an answer. At
//! equilibrium each element passes on to its neighbours exactly what it cannot take.
//!
//! Source: the limits are those of Provot, "Deformation constraints in a mass-spring model", Graphics Interface, 1995, on
//! principal stretches after Wang, O'Brien & Ramamoorthi, "Multi-resolution isotropic strain limiting", ACM TOG 29(6),
//! 2010; the energy is ours.

use super::Principal;
use crate::math::{Mat3, Vec3};

/// Where the exponential gives way to a parabola, in bands.
const STEEPEST: f64 = 6.0;
/// Widths w in a band.
const WIDTHS: f64 = 3.0;

/// Limits of the principal stretches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrainLimit {
    /// Largest stretch, above 1.
    pub longest: f64,
    /// Smallest stretch, below 1.
    pub shortest: f64,
    /// Width of the band, in stretch.
    pub band: f64,
    /// Stiffness scale k, Pa.
    pub stiffness: f64,
}

/// e(y) and its first two derivatives.
fn wall(y: f64) -> [f64; 3] {
    if y <= 0.0 {
        return [0.0; 3];
    }
    let c = y.min(STEEPEST);
    let (e2, d) = (c.exp_m1(), y - c);
    let (e1, e0) = (e2 - c, e2 - c - 0.5 * c * c);
    [e0 + d * (e1 + 0.5 * d * e2), e1 + d * e2, e2]
}

impl StrainLimit {
    fn walls(&self, s: f64) -> [[f64; 3]; 2] {
        let w = self.width();
        [wall((s - self.longest) / w + WIDTHS), wall((self.shortest - s) / w + WIDTHS)]
    }

    fn width(&self) -> f64 {
        self.band / WIDTHS
    }
}

impl Principal for StrainLimit {
    const NAME: &'static str = "strain-limit";

    fn psi(&self, s: &Vec3) -> f64 {
        let of = |s: &f64| self.walls(*s).iter().map(|e| e[0]).sum::<f64>();
        self.stiffness * self.width().powi(2) * s.iter().map(of).sum::<f64>()
    }
    fn first(&self, s: &Vec3) -> Vec3 {
        s.map(|s| {
            let [long, short] = self.walls(s);
            self.stiffness * self.width() * (long[1] - short[1])
        })
    }
    fn second(&self, s: &Vec3) -> Mat3 {
        Mat3::from_diagonal(&s.map(|s| self.stiffness * self.walls(s).iter().map(|e| e[2]).sum::<f64>()))
    }
}
