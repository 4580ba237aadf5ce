//! Limited-memory BFGS over a kept factor: the two-loop recursion.
//!
//! Source: Nocedal & Wright, "Numerical Optimization", 2nd ed., 2006, algorithm 7.4.

use crate::math::Vec3;

/// The last few steps `s` and gradient changes `y`.
pub struct Lbfgs {
    pairs: Vec<Pair>,
    /// How many pairs hold something.
    used: usize,
    /// Where the next pair goes.
    next: usize,
}

struct Pair {
    s: Vec<Vec3>,
    y: Vec<Vec3>,
    rho: f64,
    alpha: f64,
}

/// Pairs with a smaller cosine between s and y carry no curvature.
const LEAST_COSINE: f64 = 1e-8;

pub(super) fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

impl Lbfgs {
    pub fn new(memory: usize, n: usize) -> Lbfgs {
        let pair = || Pair { s: vec![Vec3::zeros(); n], y: vec![Vec3::zeros(); n], rho: 0.0, alpha: 0.0 };
        Lbfgs { pairs: (0..memory).map(|_| pair()).collect(), used: 0, next: 0 }
    }

    pub fn is_empty(&self) -> bool {
        self.used == 0
    }

    pub fn forget(&mut self) {
        self.used = 0;
        self.next = 0;
    }

    /// Remembers the step `alpha d` and the change `g1 - g0`, unless it shows no positive curvature.
    pub fn remember(&mut self, alpha: f64, d: &[Vec3], g0: &[Vec3], g1: &[Vec3]) {
        let memory = self.pairs.len();
        let Some(pair) = self.pairs.get_mut(self.next) else {
            return;
        };
        for (s, d) in pair.s.iter_mut().zip(d) {
            *s = alpha * d;
        }
        for ((y, g1), g0) in pair.y.iter_mut().zip(g1).zip(g0) {
            *y = g1 - g0;
        }
        let sy = dot(&pair.s, &pair.y);
        if sy > LEAST_COSINE * (dot(&pair.s, &pair.s) * dot(&pair.y, &pair.y)).sqrt() {
            pair.rho = 1.0 / sy;
            self.next = (self.next + 1) % memory;
            self.used = (self.used + 1).min(memory);
        }
    }

    /// Replaces `q` by `H q`, where `solve` applies the inverse of the kept stiffness.
    pub fn apply(&mut self, q: &mut [Vec3], solve: impl FnOnce(&mut [Vec3])) {
        let memory = self.pairs.len();
        let nth = |k: usize, next: usize| (next + memory - 1 - k) % memory;
        for k in 0..self.used {
            let pair = &mut self.pairs[nth(k, self.next)];
            pair.alpha = pair.rho * dot(&pair.s, q);
            for (q, y) in q.iter_mut().zip(&pair.y) {
                *q -= pair.alpha * y;
            }
        }
        solve(q);
        for k in (0..self.used).rev() {
            let pair = &self.pairs[nth(k, self.next)];
            let beta = pair.rho * dot(&pair.y, q);
            for (q, s) in q.iter_mut().zip(&pair.s) {
                *q += (pair.alpha - beta) * s;
            }
        }
    }
}
