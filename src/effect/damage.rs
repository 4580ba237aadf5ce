//! Damage: tissue that was stretched too far carries less for ever after.
//!
//! ```text
//! P = (1 - d) P0,   d = d_max (1 - exp(-(Xi - onset)/scale)) for Xi > onset, else 0,   Xi = max over time of psi0
//! W = G(psi0; Xi_n) = (1 - d_n) psi0 up to Xi_n, from there on its integral with d(psi0)
//! ```
//!
//! The potential W of the step counts what damage dissipates, so the step stays a minimisation, and `1 - d` never grows
//! back: no energy is created. Past the top of the load curve the tangent is negative; where that makes the minimum one
//! of several, the answer depends on the mesh (no length scale).
//!
//! Source: Simo, "On a fully three-dimensional finite-strain viscoelastic damage model", Comput. Methods Appl. Mech. Eng.
//! 60, 1987, section 2; departure: driven by the energy itself, so that the potential has a closed form.

use crate::fem::{At, Material};
use crate::math::{Mat3, Mat9, outer};

/// When damage begins, how fast it grows and where it ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Softening {
    /// Energy density at which damage begins, J/m3.
    pub onset: f64,
    /// Energy density over which it grows, J/m3.
    pub scale: f64,
    /// Damage that is never exceeded, below 1.
    pub most: f64,
}

impl Softening {
    fn damage(&self, xi: f64) -> f64 {
        -self.most * (-((xi - self.onset) / self.scale).max(0.0)).exp_m1()
    }

    /// Integral of 1 - d from 0 to `psi`.
    fn intact(&self, psi: f64) -> f64 {
        let beyond = (psi - self.onset).max(0.0);
        psi - self.most * (beyond + self.scale * (-beyond / self.scale).exp_m1())
    }

    /// The step's potential of psi0 and its first two derivatives.
    fn potential(&self, psi0: f64, xi: f64) -> [f64; 3] {
        if psi0 <= xi.max(self.onset) {
            let left = 1.0 - self.damage(xi);
            return [self.intact(xi) + left * (psi0 - xi), left, 0.0];
        }
        let slope = -self.most / self.scale * (-(psi0 - self.onset) / self.scale).exp();
        [self.intact(psi0), 1.0 - self.damage(psi0), slope]
    }
}

/// A material that damage weakens.
pub struct Damaged<M> {
    /// The intact material; it has no past of its own.
    pub intact: M,
    /// How it weakens.
    pub softening: Softening,
    /// Where the largest psi0 of point 0 lies among the remembered values; one a point.
    pub first: usize,
}

impl<M: Material> Material for Damaged<M> {
    fn name(&self) -> &'static str {
        self.intact.name()
    }
    fn psi(&self, at: &At, p: usize, F: &Mat3) -> f64 {
        self.softening.potential(self.intact.psi(at, p, F), at.history[self.first + p])[0]
    }
    fn psi_and_P(&self, at: &At, p: usize, F: &Mat3) -> (f64, Mat3) {
        let (psi0, P0) = self.intact.psi_and_P(at, p, F);
        if psi0 == f64::INFINITY {
            return (psi0, P0);
        }
        let [psi, first, _] = self.softening.potential(psi0, at.history[self.first + p]);
        (psi, first * P0)
    }
    fn dPdF(&self, at: &At, p: usize, F: &Mat3) -> Mat9 {
        let (psi0, P0) = self.intact.psi_and_P(at, p, F);
        let [_, first, second] = self.softening.potential(psi0, at.history[self.first + p]);
        let H = first * self.intact.dPdF(at, p, F);
        if second == 0.0 { H } else { H + second * outer(&P0, &P0) }
    }
    fn inputs(&self) -> std::ops::Range<usize> {
        self.intact.inputs()
    }
    fn remembers(&self) -> bool {
        true
    }
    fn commit(&self, at: &At, p: usize, F: &Mat3, history: &mut [f64]) {
        let xi = &mut history[self.first + p];
        *xi = xi.max(self.intact.psi(at, p, F));
    }
}
