//! Tissue whose stiffness a host may set: a material times a ratio of moduli.
//!
//! ```text
//! psi(F) = E/E0 psi0(F)
//! ```
//!
//! All laws are linear in their moduli at fixed Poisson's ratio and exponents, so Young's modulus at small strain stands for
//! all of them.

use std::ops::Range;

use pulp::Simd;

use crate::energy::InvariantTangent;
use crate::fem::{At, Material};
use crate::math::lane::{Lane, Tensor};
use crate::math::{Mat3, Mat9};

/// Which input is the modulus, and at which value the material is as given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tuning {
    /// Where Young's modulus (Pa) stands among the inputs.
    pub input: usize,
    /// Young's modulus of the material as given, Pa.
    pub E0: f64,
}

impl Tuning {
    /// E/E0.
    pub fn factor(&self, at: &At) -> f64 {
        at.inputs[self.input] / self.E0
    }
}

/// A material times E/E0.
pub struct Tuned<M> {
    /// The material at E0.
    pub material: M,
    /// What sets the factor.
    pub tuning: Tuning,
}

impl<M: Material> Material for Tuned<M> {
    fn name(&self) -> &'static str {
        self.material.name()
    }
    fn psi(&self, at: &At, p: usize, F: &Mat3) -> f64 {
        self.tuning.factor(at) * self.material.psi(at, p, F)
    }
    fn psi_and_P(&self, at: &At, p: usize, F: &Mat3) -> (f64, Mat3) {
        let (psi, P) = self.material.psi_and_P(at, p, F);
        let factor = self.tuning.factor(at);
        (factor * psi, factor * P)
    }
    #[inline(always)]
    fn psi_and_P_in<S: Simd>(
        &self,
        simd: S,
        at: &At,
        point: impl Fn(usize) -> usize,
        F: &Tensor<Lane<S>>,
    ) -> (Lane<S>, Tensor<Lane<S>>) {
        let (psi, mut P) = self.material.psi_and_P_in(simd, at, point, F);
        let factor = Lane::splat(simd, self.tuning.factor(at));
        for P in P.as_flattened_mut() {
            *P = factor * *P;
        }
        (factor * psi, P)
    }
    fn is_in_invariants(&self) -> bool {
        self.material.is_in_invariants()
    }
    #[inline(always)]
    fn tangent_in<S: Simd>(
        &self,
        simd: S,
        at: &At,
        F: &Tensor<Lane<S>>,
        g: &Tensor<Lane<S>>,
    ) -> InvariantTangent<Lane<S>> {
        let t = self.material.tangent_in(simd, at, F, g);
        let factor = Lane::splat(simd, self.tuning.factor(at));
        InvariantTangent {
            one: factor * t.one,
            ff: factor * t.ff,
            fg: factor * t.fg,
            gg: factor * t.gg,
            spin: factor * t.spin,
        }
    }
    fn dPdF(&self, at: &At, p: usize, F: &Mat3) -> Mat9 {
        self.tuning.factor(at) * self.material.dPdF(at, p, F)
    }
    fn is_quadratic(&self) -> bool {
        self.material.is_quadratic()
    }
    fn is_elastic(&self) -> bool {
        self.material.is_elastic()
    }
    fn inputs(&self) -> Range<usize> {
        self.tuning.input..self.tuning.input + 1
    }
    fn remembers(&self) -> bool {
        self.material.remembers()
    }
    fn commit(&self, at: &At, p: usize, F: &Mat3, history: &mut [f64]) {
        self.material.commit(at, p, F, history);
    }
}
