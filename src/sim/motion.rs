//! What inertia knows of the steps before, and how it is carried on by a scheme.

use super::model::{Inertia, Model};
use super::scheme::{Formula, Past};
use super::swing::Free;
use crate::fem::{At, Configuration, Dofs, Role};
use crate::math::Vec3;

/// Velocities and what the scheme remembers; every list is empty in quasi-static scenes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Motion {
    /// Nodal velocities, m/s.
    pub v: Vec<Vec3>,
    /// Mean acceleration of each node over the last piece of time, m/s2; for hosts alone.
    pub a: Vec<Vec3>,
    /// What the scheme remembers of each node; empty for backward Euler.
    pub memory: Vec<[Vec3; 2]>,
    /// Length of the last piece of time, s; 0 before the first.
    pub dt: f64,
    /// Length that the next piece should have, s; 0 while nobody asked.
    pub next_dt: f64,
    /// What the motion may have while no input changes; `None` where nobody looks.
    pub free: Option<Free>,
}

impl Motion {
    /// Nothing moves.
    pub fn still(n_nodes: usize, inertia: Option<&Inertia>) -> Motion {
        // In modes it is their coordinates that are remembered.
        let remembers = inertia.is_some_and(|i| i.scheme.remembers() && i.reduction.is_none());
        Motion {
            v: vec![Vec3::zeros(); if inertia.is_some() { n_nodes } else { 0 }],
            a: vec![Vec3::zeros(); if inertia.is_some() { n_nodes } else { 0 }],
            memory: vec![[Vec3::zeros(); 2]; if remembers { n_nodes } else { 0 }],
            dt: 0.0,
            next_dt: 0.0,
            free: None,
        }
    }

    /// Overwrites itself with `other` without allocating.
    pub fn copy_from(&mut self, other: &Motion) {
        self.v.copy_from_slice(&other.v);
        self.a.copy_from_slice(&other.a);
        self.memory.copy_from_slice(&other.memory);
        (self.dt, self.next_dt, self.free) = (other.dt, other.next_dt, other.free);
    }

    /// Forgets all motion.
    pub fn halt(&mut self) {
        self.v.fill(Vec3::zeros());
        self.a.fill(Vec3::zeros());
        self.memory.fill([Vec3::zeros(); 2]);
        (self.dt, self.next_dt, self.free) = (0.0, 0.0, None);
    }

    /// Where inertia alone carries the nodes of `x` (m); those of bones are on their way by `u`.
    pub fn predict(&self, formula: &Formula, damping: f64, dofs: &Dofs, x: &[Vec3], u: &[Vec3], x_tilde: &mut [Vec3]) {
        for (a, y) in x_tilde.iter_mut().enumerate() {
            let past = self.past(a, x);
            *y = match dofs.role[a] {
                Role::Prescribed(p) => formula.x_tilde_of_bone(&past, damping, &(x[a] + u[p as usize])),
                _ => formula.x_tilde(&past, damping),
            };
        }
    }

    /// Largest estimated error of a node that is not set by a bone, m, after a step `from` to `to`.
    pub fn error(&self, formula: &Formula, dofs: &Dofs, from: &Configuration, to: &Configuration) -> f64 {
        let free = dofs.role.iter().enumerate().filter(|(_, role)| !matches!(role, Role::Prescribed(_)));
        free.map(|(a, _)| formula.error(&self.past(a, &from.x), &to.x[a]).norm()).fold(0.0, f64::max)
    }

    /// After a step of `dt` from `from` to `to`.
    pub fn arrive(&mut self, formula: &Formula, dt: f64, dofs: &Dofs, from: &Configuration, to: &Configuration) {
        for (a, role) in dofs.role.iter().enumerate() {
            let past = self.past(a, &from.x);
            let (v, memory) = match role {
                Role::Prescribed(_) => formula.arrive_with_bone(&past, &to.x[a]),
                _ => formula.arrive(&past, &to.x[a]),
            };
            self.a[a] = (v - self.v[a]) / dt;
            self.v[a] = v;
            if let Some(m) = self.memory.get_mut(a) {
                *m = memory;
            }
        }
        self.dt = dt;
    }

    pub fn past(&self, a: usize, x: &[Vec3]) -> Past {
        let memory = self.memory.get(a).copied().unwrap_or([Vec3::zeros(); 2]);
        Past { x: x[a], v: self.v[a], memory }
    }
}

/// `at` with the coefficients of the scene's scheme, after a piece of `dt_before`.
pub(super) fn in_time<'a>(model: &Model, at: At<'a>, dt_before: f64) -> At<'a> {
    match &model.parts().inertia {
        Some(i) if at.dt > 0.0 => At {
            inertia: i.scheme.formula(at.dt, dt_before).coefficient(i.damping_mass),
            difference: i.scheme.difference(at.dt, dt_before),
            ..at
        },
        _ => at,
    }
}
