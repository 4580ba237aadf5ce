//! Elastic tissue: tetrahedra of one material; the catalogue of laws.

use super::nodal_pressure::Volume;
use super::tuned::{Tuned, Tuning};
use super::viscous::{Measure, Viscous};
use crate::energy::{
    Corotational, Energy, Fung, Isochoric, Lame, Linear, MooneyRivlin, NeoHookean, Ogden, PolyconvexNeoHookean,
    Principal, StVenantKirchhoff, StableNeoHookean, Stretches, VerondaWestmann, WithBulk, Yeoh,
};
use crate::fem::{Elastic, Material, OnElements, Solid, TET4_PLACES, TET10_PLACES, Term, tet4_points, tet10_points};
use crate::math::Vec3;

/// The elements of a tissue.
#[derive(Clone, Copy)]
pub struct Elements<'a> {
    /// Rest positions of all nodes, m.
    pub X: &'a [Vec3],
    /// Corners of each tetrahedron.
    pub tets: &'a [[u32; 4]],
    /// Mid-edge nodes of each tetrahedron; empty for linear elements.
    pub midsides: &'a [[u32; 6]],
}

impl Elements<'_> {
    /// A term of these elements made of `material`.
    pub fn of<M: Material + 'static>(&self, material: M) -> Box<dyn Term> {
        let Elements { X, tets, midsides } = *self;
        if midsides.is_empty() {
            return Box::new(OnElements(Solid::new(material, X, tets.iter().copied(), tet4_points)));
        }
        let ten = |(t, m): (&[u32; 4], &[u32; 6])| std::array::from_fn(|k| if k < 4 { t[k] } else { m[k - 4] });
        Box::new(OnElements(Solid::new(material, X, tets.iter().zip(midsides).map(ten), tet10_points)))
    }

    /// Points of integration of all elements.
    pub fn n_points(&self) -> usize {
        self.tets.len() * self.places().len()
    }

    /// Barycentric coordinates of the points of an element.
    pub fn places(&self) -> &'static [[f64; 4]] {
        if self.midsides.is_empty() { &TET4_PLACES } else { &TET10_PLACES }
    }

    /// A value for each point of integration: `of` is given element and barycentric coordinates.
    pub fn at_points<T>(&self, of: impl Fn(usize, &[f64; 4]) -> T) -> Vec<T> {
        let of = &of;
        (0..self.tets.len()).flat_map(|e| self.places().iter().map(move |L| of(e, L))).collect()
    }
}

/// Makes a law of its constants.
type MakeMaterial = fn(&[Vec<f64>]) -> Box<dyn Material>;
/// Makes a term of elements, given the constants of a law.
type MakeTerm = fn(&[Vec<f64>], Elements) -> Box<dyn Term>;
/// The same with a stiffness that a host may set.
type MakeTuned = fn(&[Vec<f64>], Elements, Tuning) -> Box<dyn Term>;
/// Makes the viscous overstress of a law.
type MakeOverstress = fn(&[Vec<f64>], Branches) -> Box<dyn Material>;

/// An elastic law that a scene can choose.
pub struct Law {
    /// Name.
    pub name: &'static str,
    /// Keys of its constants, in the order in which `moduli` and `term` take them.
    pub keys: &'static [&'static str],
    /// Lame's constants at small strain, Pa.
    pub moduli: fn(&[Vec<f64>]) -> Lame,
    /// The law by itself, for effects that wrap it.
    pub material: MakeMaterial,
    /// The tissue as a term.
    pub term: MakeTerm,
    /// The tissue as a term whose stiffness a host may set.
    pub tuned: MakeTuned,
    /// How its energy depends on volume.
    pub volume: Volume,
    /// Its viscous overstress.
    pub viscous: MakeOverstress,
}

impl Law {
    /// Young's modulus at small strain, Pa: as given where it is a constant of the law.
    pub fn young(&self, constants: &[Vec<f64>]) -> f64 {
        let Lame { mu, lambda } = (self.moduli)(constants);
        let given = self.keys.iter().position(|key| *key == "E").map(|k| constants[k][0]);
        given.unwrap_or(mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu))
    }

    /// The constants with another Lame's lambda and the same shear modulus.
    pub fn with_lambda(&self, constants: &[Vec<f64>], lambda: f64) -> Vec<Vec<f64>> {
        let mu = (self.moduli)(constants).mu;
        let of = |(key, value): (&&str, &Vec<f64>)| match *key {
            "E" => vec![mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu)],
            "nu" => vec![lambda / (2.0 * (lambda + mu))],
            "kappa" => vec![lambda + 2.0 / 3.0 * mu],
            _ => value.clone(),
        };
        self.keys.iter().zip(constants).map(of).collect()
    }
}

/// A Prony series and where its memory begins.
#[derive(Debug, Clone, PartialEq)]
pub struct Branches {
    /// Pairs (g_i, tau_i in s).
    pub series: Vec<(f64, f64)>,
    /// First of its remembered values.
    pub first: usize,
}

impl Branches {
    /// Values it remembers on these elements.
    pub fn memory(&self, elements: &Elements) -> usize {
        elements.n_points() * Viscous::<Linear>::len_at_point(self.series.len())
    }

    fn over<M: Energy + 'static>(self, iso: M, measure: Measure) -> Box<dyn Material> {
        Box::new(Viscous { iso, branches: self.series, measure, first: self.first })
    }
}

/// The volume-free neo-Hookean law that has the shear modulus of a law in E and nu.
fn viscous_neo_hookean(c: &[Vec<f64>], b: Branches) -> Box<dyn Material> {
    let iso = WithBulk { law: MooneyRivlin { c10: 0.5 * lame(c).mu, c01: 0.0 }, kappa: 0.0 };
    b.over(iso, Measure::Finite)
}

fn viscous_linear(c: &[Vec<f64>], b: Branches) -> Box<dyn Material> {
    let mu = lame(c).mu;
    b.over(Linear(Lame { mu, lambda: -2.0 / 3.0 * mu }), Measure::Small)
}

fn viscous<L: Isochoric + 'static>(law: L, b: Branches) -> Box<dyn Material> {
    b.over(WithBulk { law, kappa: 0.0 }, Measure::Finite)
}

fn material<M: Energy + 'static>(law: M) -> Box<dyn Material> {
    Box::new(Elastic(law))
}

fn term<M: Energy + 'static>(law: M, elements: Elements) -> Box<dyn Term> {
    elements.of(Elastic(law))
}

fn tuned<M: Energy + 'static>(law: M, elements: Elements, tuning: Tuning) -> Box<dyn Term> {
    elements.of(Tuned { material: Elastic(law), tuning })
}

fn lame(c: &[Vec<f64>]) -> Lame {
    Lame::new(c[0][0], c[1][0])
}

/// Lame's constants of a shear modulus and the bulk modulus, which is the last constant.
fn with_bulk(mu: f64, c: &[Vec<f64>]) -> Lame {
    let kappa = c[c.len() - 1][0];
    Lame { mu, lambda: kappa - 2.0 / 3.0 * mu }
}

fn bulk<L: Isochoric>(law: L, c: &[Vec<f64>]) -> WithBulk<L> {
    WithBulk { law, kappa: c[c.len() - 1][0] }
}

fn ogden(c: &[Vec<f64>]) -> Ogden {
    Ogden { terms: c[0].iter().copied().zip(c[1].iter().copied()).collect(), kappa: c[2][0] }
}

fn mooney_rivlin(c: &[Vec<f64>]) -> MooneyRivlin {
    MooneyRivlin { c10: c[0][0], c01: c[1][0] }
}

fn yeoh(c: &[Vec<f64>]) -> Yeoh {
    Yeoh { c10: c[0][0], c20: c[1][0], c30: c[2][0] }
}

fn fung(c: &[Vec<f64>]) -> Fung {
    Fung { mu: c[0][0], b: c[1][0] }
}

fn veronda_westmann(c: &[Vec<f64>]) -> VerondaWestmann {
    VerondaWestmann { c1: c[0][0], c2: c[1][0] }
}

/// A law in Young's modulus and Poisson's ratio.
const fn in_e_nu(name: &'static str, material: MakeMaterial, term: MakeTerm, tuned: MakeTuned) -> Law {
    let volume = Volume::Quadratic;
    Law { name, keys: &["E", "nu"], moduli: lame, material, term, tuned, volume, viscous: viscous_neo_hookean }
}

/// The elastic laws by name: the one list.
pub const LAWS: &[Law] = &[
    Law {
        viscous: viscous_linear,
        volume: Volume::Linear,
        ..in_e_nu(
            Linear::NAME,
            |c| material(Linear(lame(c))),
            |c, t| term(Linear(lame(c)), t),
            |c, t, s| tuned(Linear(lame(c)), t, s),
        )
    },
    in_e_nu(
        Corotational::NAME,
        |c| material(Corotational(lame(c))),
        |c, t| term(Corotational(lame(c)), t),
        |c, t, s| tuned(Corotational(lame(c)), t, s),
    ),
    in_e_nu(
        StVenantKirchhoff::NAME,
        |c| material(StVenantKirchhoff(lame(c))),
        |c, t| term(StVenantKirchhoff(lame(c)), t),
        |c, t, s| tuned(StVenantKirchhoff(lame(c)), t, s),
    ),
    in_e_nu(
        StableNeoHookean::NAME,
        |c| material(StableNeoHookean(lame(c))),
        |c, t| term(StableNeoHookean(lame(c)), t),
        |c, t, s| tuned(StableNeoHookean(lame(c)), t, s),
    ),
    Law {
        volume: Volume::Polyconvex,
        ..in_e_nu(
            PolyconvexNeoHookean::NAME,
            |c| material(PolyconvexNeoHookean(lame(c))),
            |c, t| term(PolyconvexNeoHookean(lame(c)), t),
            |c, t, s| tuned(PolyconvexNeoHookean(lame(c)), t, s),
        )
    },
    Law {
        volume: Volume::Logarithmic,
        ..in_e_nu(
            NeoHookean::NAME,
            |c| material(NeoHookean(lame(c))),
            |c, t| term(NeoHookean(lame(c)), t),
            |c, t, s| tuned(NeoHookean(lame(c)), t, s),
        )
    },
    Law {
        name: MooneyRivlin::NAME,
        keys: &["c10", "c01", "kappa"],
        moduli: |c| with_bulk(2.0 * (c[0][0] + c[1][0]), c),
        material: |c| material(bulk(mooney_rivlin(c), c)),
        term: |c, t| term(bulk(mooney_rivlin(c), c), t),
        tuned: |c, t, s| tuned(bulk(mooney_rivlin(c), c), t, s),
        volume: Volume::Quadratic,
        viscous: |c, b| viscous(mooney_rivlin(c), b),
    },
    Law {
        name: Yeoh::NAME,
        keys: &["c10", "c20", "c30", "kappa"],
        moduli: |c| with_bulk(2.0 * c[0][0], c),
        material: |c| material(bulk(yeoh(c), c)),
        term: |c, t| term(bulk(yeoh(c), c), t),
        tuned: |c, t, s| tuned(bulk(yeoh(c), c), t, s),
        volume: Volume::Quadratic,
        viscous: |c, b| viscous(yeoh(c), b),
    },
    Law {
        name: Fung::NAME,
        keys: &["mu", "b", "kappa"],
        moduli: |c| with_bulk(c[0][0], c),
        material: |c| material(bulk(fung(c), c)),
        term: |c, t| term(bulk(fung(c), c), t),
        tuned: |c, t, s| tuned(bulk(fung(c), c), t, s),
        volume: Volume::Quadratic,
        viscous: |c, b| viscous(fung(c), b),
    },
    Law {
        name: VerondaWestmann::NAME,
        keys: &["c1", "c2", "kappa"],
        moduli: |c| with_bulk(c[0][0] * c[1][0], c),
        material: |c| material(bulk(veronda_westmann(c), c)),
        term: |c, t| term(bulk(veronda_westmann(c), c), t),
        tuned: |c, t, s| tuned(bulk(veronda_westmann(c), c), t, s),
        volume: Volume::Quadratic,
        viscous: |c, b| viscous(veronda_westmann(c), b),
    },
    Law {
        name: <Ogden as Principal>::NAME,
        keys: &["mu", "alpha", "kappa"],
        moduli: |c| with_bulk(c[0].iter().sum(), c),
        material: |c| material(Stretches(ogden(c))),
        term: |c, t| term(Stretches(ogden(c)), t),
        tuned: |c, t, s| tuned(Stretches(ogden(c)), t, s),
        volume: Volume::Quadratic,
        viscous: |c, b| b.over(Stretches(Ogden { kappa: 0.0, ..ogden(c) }), Measure::Finite),
    },
];

/// The law of this name.
pub fn law(name: &str) -> Option<&'static Law> {
    LAWS.iter().find(|l| l.name == name)
}
