//! In-vivo tension: stress that the tissue carries in the shape it was scanned in.
//!
//! ```text
//! psi = S0 : (F^T F - I)/2,   P = F S0
//! ```
//!
//! `S0` is the second Piola-Kirchhoff stress at rest, for the skin a tension in its plane. The scanned shape is in
//! equilibrium, so forces that are not known hold what `S0` pulls: [`Balance`] adds them, dead.
//!
//! Source: Bonet & Wood, "Nonlinear Continuum Mechanics for Finite Element Analysis", 2nd ed., 2008, sections 5.5 and 9.3.

use crate::fem::{At, Curvature, HessianSink, Material, Term};
use crate::math::{Mat3, Mat9, Vec3};

/// Stress at rest.
pub struct Prestress {
    /// S0 at each point of integration, Pa; symmetric.
    pub S0: Vec<Mat3>,
}

impl Material for Prestress {
    fn name(&self) -> &'static str {
        "prestress"
    }
    fn psi(&self, _at: &At, p: usize, F: &Mat3) -> f64 {
        0.5 * self.S0[p].dot(&(F.tr_mul(F) - Mat3::identity()))
    }
    fn psi_and_P(&self, at: &At, p: usize, F: &Mat3) -> (f64, Mat3) {
        (self.psi(at, p, F), F * self.S0[p])
    }
    fn dPdF(&self, _at: &At, p: usize, _F: &Mat3) -> Mat9 {
        let S0 = &self.S0[p];
        let mut H = Mat9::zeros();
        for j in 0..3 {
            for l in 0..3 {
                for i in 0..3 {
                    H[(i + 3 * j, i + 3 * l)] = S0[(l, j)];
                }
            }
        }
        H
    }
    fn is_quadratic(&self) -> bool {
        true
    }
}

/// Dead forces that hold the shape at rest: `W = -sum_a f_a . (x_a - X_a)`.
pub struct Balance {
    /// Force on each node, N.
    pub f: Vec<Vec3>,
    /// Rest positions, m.
    pub X: Vec<Vec3>,
}

impl Balance {
    /// What holds the rest positions `X` against `term`.
    pub fn of(term: &dyn Term, X: &[Vec3]) -> Balance {
        let mut f = vec![Vec3::zeros(); X.len()];
        term.add_gradient(&At::NOWHERE, X, &mut f);
        Balance { f, X: X.to_vec() }
    }
}

impl Term for Balance {
    fn name(&self) -> &'static str {
        "balance"
    }
    fn energy(&self, _at: &At, x: &[Vec3]) -> f64 {
        -self.f.iter().zip(x).zip(&self.X).map(|((f, x), X)| f.dot(&(x - X))).sum::<f64>()
    }
    fn add_gradient(&self, at: &At, x: &[Vec3], g: &mut [Vec3]) -> f64 {
        for (f, g) in self.f.iter().zip(g) {
            *g -= f;
        }
        self.energy(at, x)
    }
    fn couplings(&self, _clique: &mut dyn FnMut(&[u32])) {}
    fn add_hessian(&self, _at: &At, _x: &[Vec3], _curvature: Curvature, _sink: &mut dyn HessianSink) {}
    fn is_quadratic(&self) -> bool {
        true
    }
}
