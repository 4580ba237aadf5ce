//! Damping in proportion to the stiffness, blind to rotations.
//!
//! ```text
//! S = beta C : dE/dt,   dE/dt = rate (E - E_m),   E_m = last E(n) - before E(n-1)
//! psi = rate beta/2 (E - E_m) : C : (E - E_m)
//! ```
//!
//! E is Green-Lagrange strain and C the law's own stiffness at small strain, so small motions about rest feel `beta K v`.
//! The rate is the backward difference of the scene's scheme (`fem::Difference`). It is silent while the start equilibrium
//! is sought (dt = 0).
//!
//! Source: Rayleigh, "The Theory of Sound" I, 1877, section 81; as a solid of Kelvin and Voigt with a potential of the step
//! after Kharevych et al., "Geometric, variational integrators for computer animation", SCA 2006, section 5.

use super::tissue::Elements;
use super::viscous::{Measure, SYMMETRIC, add_stress, pack, unpack};
use crate::energy::{Energy, Lame, Linear, StVenantKirchhoff};
use crate::fem::{At, Material};
use crate::math::{Mat3, Mat9};

/// Stiffness damping over a law whose stress is linear in the strain of `measure`.
pub struct Rayleigh<M> {
    /// The law at small strain, its constants times beta, Pa s.
    law: M,
    constants: Lame,
    measure: Measure,
    /// Where point 0 begins among the remembered values.
    first: usize,
}

/// Values that one point remembers: E(n) and E(n-1).
const LEN: usize = 2 * SYMMETRIC;

/// Values that stiffness damping remembers on these elements.
pub fn damping_memory(elements: &Elements) -> usize {
    elements.n_points() * LEN
}

/// Stiffness damping: `constants` are beta times Lame's (Pa s), `first` is where its memory begins.
pub fn stiffness_damping(constants: Lame, measure: Measure, first: usize) -> Box<dyn Material> {
    match measure {
        Measure::Finite => Box::new(Rayleigh { law: StVenantKirchhoff(constants), constants, measure, first }),
        Measure::Small => Box::new(Rayleigh { law: Linear(constants), constants, measure, first }),
    }
}

impl<M: Energy> Rayleigh<M> {
    fn strain(&self, F: &Mat3) -> Mat3 {
        match self.measure {
            Measure::Finite => 0.5 * (F.tr_mul(F) - Mat3::identity()),
            Measure::Small => 0.5 * (F + F.transpose()) - Mat3::identity(),
        }
    }

    fn of_point<'a>(&self, p: usize, history: &'a [f64]) -> &'a [f64] {
        &history[self.first + LEN * p..self.first + LEN * (p + 1)]
    }

    /// `-rate beta C : E_m`.
    fn memory(&self, at: &At, p: usize) -> Mat3 {
        let (E, before) = self.of_point(p, at.history).split_at(SYMMETRIC);
        let d = &at.difference;
        let E = d.last * unpack(E) - d.before * unpack(before);
        -d.rate * (2.0 * self.constants.mu * E + self.constants.lambda * E.trace() * Mat3::identity())
    }
}

impl<M: Energy> Material for Rayleigh<M> {
    fn name(&self) -> &'static str {
        "stiffness damping"
    }
    fn psi(&self, at: &At, p: usize, F: &Mat3) -> f64 {
        if at.dt == 0.0 {
            return 0.0;
        }
        at.difference.rate * self.law.psi(F) + self.memory(at, p).dot(&self.strain(F))
    }
    fn psi_and_P(&self, at: &At, p: usize, F: &Mat3) -> (f64, Mat3) {
        if at.dt == 0.0 {
            return (0.0, Mat3::zeros());
        }
        let (rate, T) = (at.difference.rate, self.memory(at, p));
        let (psi, P) = self.law.psi_and_P(F);
        let remembered = match self.measure {
            Measure::Finite => F * T,
            Measure::Small => T,
        };
        (rate * psi + T.dot(&self.strain(F)), rate * P + remembered)
    }
    fn dPdF(&self, at: &At, p: usize, F: &Mat3) -> Mat9 {
        if at.dt == 0.0 {
            return Mat9::zeros();
        }
        let mut H = at.difference.rate * self.law.dPdF(F);
        if self.measure == Measure::Finite {
            add_stress(&mut H, &self.memory(at, p));
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
        let mut E = [0.0; SYMMETRIC];
        pack(&self.strain(F), &mut E);
        let before = if at.dt == 0.0 { E } else { std::array::from_fn(|k| self.of_point(p, at.history)[k]) };
        let after = &mut history[self.first + LEN * p..self.first + LEN * (p + 1)];
        after[..SYMMETRIC].copy_from_slice(&E);
        after[SYMMETRIC..].copy_from_slice(&before);
    }
}
