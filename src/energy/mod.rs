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
pub use principal::{Principal, Stretches};
pub use st_venant_kirchhoff::StVenantKirchhoff;
pub use stable_neo_hookean::StableNeoHookean;
pub use strain_limit::StrainLimit;
pub use veronda_westmann::VerondaWestmann;
pub use yeoh::Yeoh;

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
    /// Tangent d2 psi / dF2 over `vec(F)`, Pa.
    fn dPdF(&self, F: &Mat3) -> Mat9;
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
