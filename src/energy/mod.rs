//! Strain energy densities of elastic tissue, one a file: each knows F and nothing of meshes.
#![forbid(unsafe_code)]
#![allow(non_snake_case)]

mod corotational;
mod fung;
mod isochoric;
mod linear;
mod mooney_rivlin;
mod neo_hookean;
mod ogden;
mod polyconvex_neo_hookean;
mod principal;
mod st_venant_kirchhoff;
mod stable_neo_hookean;
mod strain_limit;
mod veronda_westmann;
mod yeoh;

pub use corotational::Corotational;
pub use fung::Fung;
pub use isochoric::{Isochoric, Slopes, WithBulk};
pub use linear::Linear;
pub use mooney_rivlin::MooneyRivlin;
pub use neo_hookean::NeoHookean;
pub use ogden::Ogden;
pub use polyconvex_neo_hookean::PolyconvexNeoHookean;
pub use principal::{Principal, Stretches};
pub use st_venant_kirchhoff::StVenantKirchhoff;
pub use stable_neo_hookean::StableNeoHookean;
pub use strain_limit::StrainLimit;
pub use veronda_westmann::VerondaWestmann;
pub use yeoh::Yeoh;

use pulp::Simd;

use crate::math::lane::{BATCH, Lane, Tensor, tensor};
use crate::math::{Mat3, Mat9};

/// A strain energy density psi(F), J/m3, with its first two derivatives.
pub trait Energy: Send + Sync {
    /// Name by which a scene chooses it.
    const NAME: &'static str;
    /// psi(F), J/m3; +inf where the law is not defined, so that a line search steps back before a stress is asked.
    fn psi(&self, F: &Mat3) -> f64;
    /// First Piola-Kirchhoff stress P = d psi / dF, Pa.
    fn P(&self, F: &Mat3) -> Mat3;
    /// Both at once, for laws whose two share work.
    fn psi_and_P(&self, F: &Mat3) -> (f64, Mat3) {
        (self.psi(F), self.P(F))
    }
    /// Both in many points at once; psi may be NaN where the law is not defined. Laws that are formulas over any numbers
    /// say so here, all others are evaluated point by point.
    #[inline(always)]
    fn psi_and_P_in<S: Simd>(&self, simd: S, F: &Tensor<Lane<S>>) -> (Lane<S>, Tensor<Lane<S>>)
    where
        Self: Sized,
    {
        lane_by_lane(simd, F, |_, F| self.psi_and_P(F))
    }
    /// Tangent d2 psi / dF2 over `vec(F)`, Pa.
    fn dPdF(&self, F: &Mat3) -> Mat9;
    /// Whether the law is a function of |F|^2 and J alone and says its tangent as such.
    const IN_INVARIANTS: bool = false;
    /// Tangent in many points at once, where J is positive; asked only of laws [`Energy::IN_INVARIANTS`].
    #[inline(always)]
    fn tangent_in<S: Simd>(&self, simd: S, _F: &Tensor<Lane<S>>, _g: &Tensor<Lane<S>>) -> InvariantTangent<Lane<S>> {
        InvariantTangent::zero(Lane::splat(simd, 0.0))
    }
}

/// Tangent of a law psi(I1, J) with I1 = |F|^2 and g = dJ/dF, Pa:
///
/// ```text
/// dP/dF = one 1 + ff F (x) F + fg (F (x) g + g (x) F) + gg g (x) g + spin d2J/dF2
/// one = 2 psi_1, ff = 4 psi_11, fg = 2 psi_1J, gg = psi_JJ, spin = psi_J
/// ```
#[derive(Debug, Clone, Copy)]
pub struct InvariantTangent<T> {
    /// Of the identity.
    pub one: T,
    /// Of F with itself.
    pub ff: T,
    /// Of F with g.
    pub fg: T,
    /// Of g with itself.
    pub gg: T,
    /// Of the second derivative of J.
    pub spin: T,
}

impl<T: Copy> InvariantTangent<T> {
    /// With every coefficient the given zero.
    #[inline(always)]
    pub fn zero(zero: T) -> Self {
        InvariantTangent { one: zero, ff: zero, fg: zero, gg: zero, spin: zero }
    }
}

/// `psi_and_P` of each lane and its F.
#[inline(always)]
pub fn lane_by_lane<S: Simd>(
    simd: S,
    F: &Tensor<Lane<S>>,
    psi_and_P: impl Fn(usize, &Mat3) -> (f64, Mat3),
) -> (Lane<S>, Tensor<Lane<S>>) {
    let mut entries = [[[0.0; BATCH]; 3]; 3];
    let mut psi = [0.0; BATCH];
    for (to, from) in entries.as_flattened_mut().iter_mut().zip(F.as_flattened()) {
        from.store(to, 0);
    }
    for lane in 0..S::F64_LANES {
        let (psi_l, P) = psi_and_P(lane, &Mat3::from_fn(|i, j| entries[i][j][lane]));
        psi[lane] = psi_l;
        for i in 0..3 {
            for j in 0..3 {
                entries[i][j][lane] = P[(i, j)];
            }
        }
    }
    (Lane::load(simd, &psi, 0), tensor!(|i, j| Lane::load(simd, &entries[i][j], 0)))
}

/// Lame's constants, Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lame {
    /// Shear modulus.
    pub mu: f64,
    /// Lame's first constant.
    pub lambda: f64,
}

impl Lame {
    /// From Young's modulus `E` (Pa) and Poisson's ratio `nu`: the only such conversion in the crate.
    pub fn new(E: f64, nu: f64) -> Lame {
        Lame { mu: E / (2.0 * (1.0 + nu)), lambda: E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)) }
    }
}
