//! Viscous overstress as a Prony series over the volume-free part of a law, exact for any step on straight paths.
//!
//! ```text
//! S = S_law + sum_i h_i,   h_i <- exp(-a_i) h_i + gamma_i (S_iso(n+1) - S_iso(n)),
//! a_i = dt/tau_i,   gamma_i = g_i (1 - exp(-a_i))/a_i
//! psi = sum_i gamma_i psi_iso(F) + T : F^T F / 2,   T = sum_i (exp(-a_i) h_i - gamma_i S_iso(n))
//! ```
//!
//! The second line is a potential of the step, so the line search still works. `g_i` counts the law's own stiffness: fast
//! loads feel 1 + sum g_i of it, slow ones 1. It is silent while the start equilibrium is sought (dt = 0): scenes start
//! relaxed.
//!
//! Source: Simo, "On a fully three-dimensional finite-strain viscoelastic damage model", Comput. Methods Appl. Mech. Eng.
//! 60, 1987; recurrence after Taylor, Pister & Goudreau, Int. J. Numer. Methods Eng. 2, 1970.

use crate::energy::Energy;
use crate::fem::{At, Material};
use crate::math::{Mat3, Mat9};

/// Numbers of a symmetric stress.
pub(super) const SYMMETRIC: usize = 6;

/// Where strain is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// Second Piola-Kirchhoff stress against Green-Lagrange strain: any rotation.
    Finite,
    /// Small strain, for the linear law.
    Small,
}

/// Branches of a Prony series over the volume-free law `iso`.
pub struct Viscous<M> {
    /// Volume-free law at the stiffness of slow loads.
    pub iso: M,
    /// Pairs (g_i, tau_i in s).
    pub branches: Vec<(f64, f64)>,
    /// Where strain is measured.
    pub measure: Measure,
    /// Where point 0 begins among the remembered values.
    pub first: usize,
}

impl<M: Energy> Viscous<M> {
    /// Values that one point remembers: S_iso and each h_i.
    pub fn len_at_point(n_branches: usize) -> usize {
        SYMMETRIC * (1 + n_branches)
    }

    fn of_point<'a>(&self, p: usize, history: &'a [f64]) -> &'a [f64] {
        let n = Self::len_at_point(self.branches.len());
        &history[self.first + n * p..self.first + n * (p + 1)]
    }

    fn gamma(&self, dt: f64) -> f64 {
        self.branches.iter().map(|&(g, tau)| g * mean_decay(dt / tau)).sum()
    }

    /// T of the potential.
    fn memory(&self, dt: f64, p: usize, history: &[f64]) -> Mat3 {
        let values = self.of_point(p, history);
        let (S_n, h) = values.split_at(SYMMETRIC);
        let mut T = -self.gamma(dt) * unpack(S_n);
        for (&(_, tau), h) in self.branches.iter().zip(h.chunks_exact(SYMMETRIC)) {
            T += (-dt / tau).exp() * unpack(h);
        }
        T
    }

    fn S_iso(&self, F: &Mat3) -> Mat3 {
        let P = self.iso.P(F);
        match self.measure {
            Measure::Small => P,
            Measure::Finite => F.try_inverse().map_or(Mat3::zeros(), |inverse| inverse * P),
        }
    }
}

/// Adds d(F T)/dF at a fixed T.
pub(super) fn add_stress(H: &mut Mat9, T: &Mat3) {
    for j in 0..3 {
        for l in 0..3 {
            for i in 0..3 {
                H[(i + 3 * j, i + 3 * l)] += T[(l, j)];
            }
        }
    }
}

/// (1 - exp(-a))/a.
fn mean_decay(a: f64) -> f64 {
    if a < 1e-8 { 1.0 - 0.5 * a } else { -(-a).exp_m1() / a }
}

pub(super) fn unpack(s: &[f64]) -> Mat3 {
    Mat3::new(s[0], s[3], s[5], s[3], s[1], s[4], s[5], s[4], s[2])
}

pub(super) fn pack(S: &Mat3, to: &mut [f64]) {
    let off = |i: usize, j: usize| 0.5 * (S[(i, j)] + S[(j, i)]);
    to.copy_from_slice(&[S[(0, 0)], S[(1, 1)], S[(2, 2)], off(0, 1), off(1, 2), off(0, 2)]);
}

impl<M: Energy> Material for Viscous<M> {
    fn name(&self) -> &'static str {
        "viscous"
    }
    fn psi(&self, at: &At, p: usize, F: &Mat3) -> f64 {
        self.psi_and_P(at, p, F).0
    }
    fn psi_and_P(&self, at: &At, p: usize, F: &Mat3) -> (f64, Mat3) {
        if at.dt == 0.0 {
            return (0.0, Mat3::zeros());
        }
        let (gamma, T) = (self.gamma(at.dt), self.memory(at.dt, p, at.history));
        let psi = self.iso.psi(F);
        if psi == f64::INFINITY {
            return (psi, Mat3::zeros());
        }
        let P = gamma * self.iso.P(F);
        match self.measure {
            Measure::Small => (gamma * psi + T.dot(&(F - Mat3::identity())), P + T),
            Measure::Finite => (gamma * psi + 0.5 * T.dot(&(F.tr_mul(F) - Mat3::identity())), P + F * T),
        }
    }
    fn dPdF(&self, at: &At, p: usize, F: &Mat3) -> Mat9 {
        if at.dt == 0.0 {
            return Mat9::zeros();
        }
        let mut H = self.gamma(at.dt) * self.iso.dPdF(F);
        if self.measure == Measure::Finite {
            add_stress(&mut H, &self.memory(at.dt, p, at.history));
        }
        H
    }
    fn is_quadratic(&self) -> bool {
        self.measure == Measure::Small
    }
    fn is_elastic(&self) -> bool {
        false
    }
    fn remembers(&self) -> bool {
        true
    }
    fn commit(&self, at: &At, p: usize, F: &Mat3, history: &mut [f64]) {
        let S = self.S_iso(F);
        let before = self.of_point(p, at.history);
        let S_n = unpack(&before[..SYMMETRIC]);
        let n = Self::len_at_point(self.branches.len());
        let after = &mut history[self.first + n * p..self.first + n * (p + 1)];
        pack(&S, &mut after[..SYMMETRIC]);
        for (k, &(g, tau)) in self.branches.iter().enumerate() {
            let range = SYMMETRIC * (k + 1)..SYMMETRIC * (k + 2);
            let h = if at.dt == 0.0 {
                Mat3::zeros()
            } else {
                let a = at.dt / tau;
                (-a).exp() * unpack(&before[range.clone()]) + g * mean_decay(a) * (S - S_n)
            };
            pack(&h, &mut after[range]);
        }
    }
}
