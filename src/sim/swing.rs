//! Free motion gains no energy: while no input changes the tissue has what it was let go with, or less.
//!
//! ```text
//! H = sum m |v|^2/2 + W(x) <= H at the start of the free motion,   W: the potential of tissue and dead loads
//! ```
//!
//! Under laws that are not linear a scheme of second order keeps H only up to the error of its quadrature, and where motions are not
//! resolved it may pump. So H is held against its start after each step in which nothing but time has changed; a step beyond it is done
//! again as if there had been none before, which is backward Euler in every scheme: it damps what was pumped. The bound does not
//! follow H down, so a motion that is resolved, whose H wavers about its mean, is touched once or never.
//!
//! Not watched: backward Euler, which cannot pump; linear tissue, for which that is proven (`scheme`); terms with a memory or a
//! friction of their own, and follower loads, which have no potential; modes.

use super::model::Model;
use super::motion::Motion;
use super::scheme::{Formula, Scheme};
use crate::fem::{At, Configuration, Dofs, Role};
use crate::math::Vec3;
use crate::solve::Problem;

/// Gain, in units of the largest kinetic energy of the motion, that is none: H wavers by about so much where motions are just resolved.
const SLACK: f64 = 0.01;
/// Length of the step before, in units of the step, that makes every scheme start anew.
const NONE_BEFORE: f64 = 1e-9;
/// Largest rho whose motions all lose something.
const MOST_RHO: f64 = 0.8;

/// What a free motion may have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Free {
    /// Energy at its start, J; the zero is that of the potential.
    pub most: f64,
    /// Largest kinetic energy so far, J.
    pub swing: f64,
}

/// Both ends of a step in which no input changes.
pub(super) struct Swing<'a> {
    pub model: &'a Model,
    pub problem: &'a Problem<'a>,
    pub motion: &'a Motion,
    pub formula: &'a Formula,
}

impl Swing<'_> {
    /// Whether somebody has to look.
    pub fn is_watched(&self) -> bool {
        let parts = self.model.parts();
        parts.inertia.as_ref().is_some_and(|i| i.scheme.remembers() && i.reduction.is_none())
            && parts.n_history == 0
            && !self.problem.is_quadratic()
            && !self.problem.is_lagged()
    }

    /// What the motion may have from now on, or `None` if it has gained: from `before` to `after`, whose energies with that of the
    /// inertia term are `energies` (J).
    pub fn judge(&self, before: &Configuration, after: &Configuration, energies: [f64; 2]) -> Option<Free> {
        let Swing { model, problem, motion, formula } = *self;
        let (dofs, at) = (problem.dofs, &problem.at);
        let m = &model.parts().inertia.as_ref().expect("somebody asked whether to look").m;
        let kinetic = [
            energy(m, dofs, |a| motion.v[a]),
            energy(m, dofs, |a| formula.arrive(&motion.past(a, &before.x), &after.x[a]).0),
        ];
        let potential = [energies[0] - inertial(m, at, &before.x), energies[1] - inertial(m, at, &after.x)];
        let free = motion.free.unwrap_or(Free { most: kinetic[0] + potential[0], swing: kinetic[0] });
        let swing = free.swing.max(kinetic[1]);
        (kinetic[1] + potential[1] <= free.most + SLACK * swing).then_some(Free { swing, ..free })
    }
}

/// Length of the step before (s) with which a step of `dt` is one of backward Euler, whatever the scheme.
pub(super) fn none_before(dt: f64) -> f64 {
    NONE_BEFORE * dt
}

/// What to say when a motion has gained.
pub(super) const GAINED: &str = "a free motion that the steps do not resolve gained energy: such steps are made by backward Euler, \
                                 which damps it; take shorter steps to see it, or a scheme that damps more";

/// What to say of a scheme under laws that are not linear; nothing where all motions are damped.
pub(crate) fn undamped(scheme: Scheme) -> Option<String> {
    matches!(scheme, Scheme::GeneralisedAlpha { rho } if rho > MOST_RHO).then(|| {
        format!(
            "{scheme:?} damps almost nothing that the steps do not resolve: free motion is kept from gaining energy under a law that is \
             not linear, but nothing tells it from work while bones or loads move; take rho up to {MOST_RHO}, or bdf2"
        )
    })
}

/// Kinetic energy of the nodes that no bone carries, J.
fn energy(m: &[f64], dofs: &Dofs, v: impl Fn(usize) -> Vec3) -> f64 {
    let free = dofs.role.iter().enumerate().filter(|(_, role)| !matches!(role, Role::Prescribed(_)));
    0.5 * free.map(|(a, _)| m[a] * v(a).norm_squared()).sum::<f64>()
}

/// Energy of the inertia term, J.
fn inertial(m: &[f64], at: &At, x: &[Vec3]) -> f64 {
    0.5 * at.inertia * m.iter().zip(x).zip(at.x_tilde).map(|((m, x), y)| m * (x - y).norm_squared()).sum::<f64>()
}
