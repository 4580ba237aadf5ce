//! Elastic tissue: linear tetrahedra of one region and one energy.

use crate::energy::{Corotational, Energy, Lame, Linear, NeoHookean, StVenantKirchhoff, StableNeoHookean};
use crate::fem::{OnElements, Term, Tet4};
use crate::math::Vec3;

/// An elastic law by name with its small-strain constants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elastic<'a> {
    /// One of [`ENERGIES`].
    pub energy: &'a str,
    /// Young's modulus at small strain, Pa.
    pub E: f64,
    /// Poisson's ratio at small strain.
    pub nu: f64,
}

type Build = fn(Lame, &[Vec3], &mut dyn Iterator<Item = [u32; 4]>) -> Box<dyn Term>;

/// The elastic laws a scene can choose, by name: the catalogue's one list.
pub const ENERGIES: [(&str, Build); 5] = [
    (Linear::NAME, |l, X, tets| term(Linear(l), X, tets)),
    (Corotational::NAME, |l, X, tets| term(Corotational(l), X, tets)),
    (StVenantKirchhoff::NAME, |l, X, tets| term(StVenantKirchhoff(l), X, tets)),
    (StableNeoHookean::NAME, |l, X, tets| term(StableNeoHookean(l), X, tets)),
    (NeoHookean::NAME, |l, X, tets| term(NeoHookean(l), X, tets)),
];

fn term<M: Energy + 'static>(material: M, X: &[Vec3], tets: &mut dyn Iterator<Item = [u32; 4]>) -> Box<dyn Term> {
    Box::new(OnElements(Tet4::new(material, X, tets)))
}

/// The given tetrahedra of rest positions `X` as a term; `None` if no energy has this name.
pub fn elastic_tissue(law: &Elastic, X: &[Vec3], mut tets: impl Iterator<Item = [u32; 4]>) -> Option<Box<dyn Term>> {
    let (_, build) = ENERGIES.iter().find(|(name, _)| *name == law.energy)?;
    Some(build(Lame::new(law.E, law.nu), X, &mut tets))
}
