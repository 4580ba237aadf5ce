//! Central differences along random directions at h and h/4 show order 2 for every energy and every term.
//!
//! Along a direction, since det F is linear in each single entry: entrywise differences would be exact and show no order.

use cutis::effect::{
    Contact, DeadLoad, Elements, Friction, Gravity, Inertia, LAWS, Measure, Muscle, Pressure, Shape, Springs,
    damping_memory, springs, stiffness_damping,
};
use cutis::energy::{
    Corotational, Energy, Fung, Lame, Linear, MooneyRivlin, NeoHookean, Ogden, PolyconvexNeoHookean, StVenantKirchhoff,
    StableNeoHookean, Stretches, VerondaWestmann, WithBulk, Yeoh,
};
use cutis::fem::{At, Curvature, Difference, HessianSink, OnElements, Term, add_midsides};
use cutis::math::{Mat3, Vec3, vec9};
use cutis::mesh::TetMesh;

use crate::common::{Random, constants};

const SEED: u64 = 20_240_917;
/// Orders that pass; the truth is 2.
const ORDER: std::ops::Range<f64> = 1.95..2.05;
/// Differences below this, relative to the value, are round-off and show no order.
const ROUND_OFF: f64 = 1e-9;

/// Order at which `difference(h)` approaches `exact`; 2 where it is exact already.
fn order(exact: f64, scale: f64, difference: impl Fn(f64) -> f64) -> f64 {
    let h = 4e-3;
    let [e1, e4] = [h, h / 4.0].map(|h| (difference(h) - exact).abs());
    if e1 <= ROUND_OFF * scale {
        return 2.0;
    }
    assert!(e4 <= 1e-2 * scale, "difference {e4:.3e} is no derivative of scale {scale:.3e}");
    0.5 * (e1 / e4).log2()
}

fn check_energy<M: Energy>(energy: &M, inverted: bool) {
    let mut random = Random(SEED);
    for k in 0..20 {
        let mut F = Mat3::identity() + 0.35 * random.matrix();
        if inverted && k % 2 == 1 {
            F.column_mut(0).neg_mut();
        }
        if !inverted && F.determinant() < 0.2 {
            continue;
        }
        let D = random.matrix();
        let first = order(energy.P(&F).dot(&D), energy.P(&F).norm(), |h| {
            (energy.psi(&(F + h * D)) - energy.psi(&(F - h * D))) / (2.0 * h)
        });
        assert!(ORDER.contains(&first), "{}: dpsi/dF of order {first:.3} at {F}", M::NAME);
        let E = random.matrix();
        let exact = vec9(&E).dot(&(energy.dPdF(&F) * vec9(&D)));
        let second = order(exact, energy.dPdF(&F).norm(), |h| {
            (energy.P(&(F + h * D)) - energy.P(&(F - h * D))).dot(&E) / (2.0 * h)
        });
        assert!(ORDER.contains(&second), "{}: dP/dF of order {second:.3} at {F}", M::NAME);
    }
}

fn lame() -> Lame {
    Lame::new(1.0, 0.45)
}

#[test]
fn energies_have_the_derivatives_they_claim() {
    check_energy(&Linear(lame()), true);
    check_energy(&Corotational(lame()), false);
    check_energy(&StVenantKirchhoff(lame()), true);
    check_energy(&StableNeoHookean(lame()), true);
    check_energy(&PolyconvexNeoHookean(lame()), false);
    check_energy(&NeoHookean(lame()), false);
    let kappa = 5.0;
    check_energy(&WithBulk { law: MooneyRivlin { c10: 0.3, c01: 0.2 }, kappa }, false);
    check_energy(&WithBulk { law: Yeoh { c10: 0.3, c20: 0.2, c30: 0.1 }, kappa }, false);
    check_energy(&WithBulk { law: Fung { mu: 0.5, b: 1.5 }, kappa }, false);
    check_energy(&WithBulk { law: VerondaWestmann { c1: 0.5, c2: 1.2 }, kappa }, false);
    check_energy(&Stretches(Ogden { terms: vec![(0.5, 6.0), (0.2, -3.0)], kappa }), false);
    assert_eq!(LAWS.len(), 11, "a law of the catalogue is not checked here");
}

struct WrongSign(StableNeoHookean);

impl Energy for WrongSign {
    const NAME: &'static str = "planted";
    fn psi(&self, F: &Mat3) -> f64 {
        self.0.psi(F)
    }
    fn P(&self, F: &Mat3) -> Mat3 {
        self.0.P(F) - 0.2 * F
    }
    fn dPdF(&self, F: &Mat3) -> cutis::math::Mat9 {
        self.0.dPdF(F)
    }
}

#[test]
#[should_panic]
fn a_planted_error_in_an_energy_is_found() {
    check_energy(&WrongSign(StableNeoHookean(lame())), true);
}

/// Two tetrahedra that share a face.
pub const REST: [[f64; 3]; 5] = [[0.0, 0.0, 0.0], [1.1, 0.1, 0.0], [0.2, 0.9, -0.1], [0.1, 0.2, 1.0], [1.0, 1.1, 0.9]];
pub const TETS: [[u32; 4]; 2] = [[0, 1, 2, 3], [1, 2, 3, 4]];

struct Dense(Vec<Vec<Mat3>>);

impl HessianSink for Dense {
    fn add(&mut self, nodes: &[u32], upper: &[Mat3]) {
        let mut blocks = upper.iter();
        for (k, &a) in nodes.iter().enumerate() {
            for &b in &nodes[k..] {
                let H = blocks.next().expect("as many blocks as pairs");
                self.0[a as usize][b as usize] += H;
                if a != b {
                    self.0[b as usize][a as usize] += H.transpose();
                }
            }
        }
    }
    fn add_outer(&mut self, nodes: &[u32], c: &[Vec3], scale: f64) {
        for (&a, ca) in nodes.iter().zip(c) {
            for (&b, cb) in nodes.iter().zip(c) {
                self.0[a as usize][b as usize] += scale * ca * cb.transpose();
            }
        }
    }
}

pub fn check_term(term: &dyn Term, rest: &[Vec3], seed: u64) {
    check_term_at(term, rest, seed, &[]);
}

/// The same with a past.
pub fn check_term_at(term: &dyn Term, rest: &[Vec3], seed: u64, history: &[f64]) {
    let n = rest.len();
    let mut random = Random(seed);
    let inputs: Vec<f64> = (0..8).map(|_| random.number()).collect();
    let x_tilde: Vec<Vec3> = rest.iter().map(|X| X + 0.2 * random.vector()).collect();
    let x_lag: Vec<Vec3> = rest.iter().map(|X| X + 0.2 * random.vector()).collect();
    let at =
        At { t: 0.1, dt: 0.3, inertia: 7.0, inputs: &inputs, history, x_tilde: &x_tilde, x_lag: &x_lag, ..At::NOWHERE };
    for _ in 0..10 {
        let x: Vec<Vec3> = rest.iter().map(|X| X + 0.1 * random.vector()).collect();
        let d: Vec<Vec3> = x.iter().map(|_| random.vector()).collect();
        let w: Vec<Vec3> = x.iter().map(|_| random.vector()).collect();
        let moved = |h: f64| x.iter().zip(&d).map(|(x, d)| x + h * d).collect::<Vec<_>>();
        let gradient = |x: &[Vec3]| {
            let mut g = vec![Vec3::zeros(); x.len()];
            let energy = term.add_gradient(&at, x, &mut g);
            assert!((energy - term.energy(&at, x)).abs() <= 1e-12 * energy.abs().max(1.0), "{}", term.name());
            g
        };
        let dot = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
        let g = gradient(&x);
        let first = order(dot(&g, &d), dot(&g, &g).sqrt(), |h| {
            (term.energy(&at, &moved(h)) - term.energy(&at, &moved(-h))) / (2.0 * h)
        });
        assert!(ORDER.contains(&first), "{}: gradient of order {first:.3}", term.name());
        let mut H = Dense(vec![vec![Mat3::zeros(); n]; n]);
        term.add_hessian(&at, &x, Curvature::Exact, &mut H);
        let Hd: Vec<Vec3> = (0..n).map(|a| (0..n).map(|b| H.0[a][b] * d[b]).sum::<Vec3>()).collect();
        let second = order(dot(&w, &Hd), dot(&Hd, &Hd).sqrt().max(1e-12), |h| {
            let (plus, minus) = (gradient(&moved(h)), gradient(&moved(-h)));
            (dot(&plus, &w) - dot(&minus, &w)) / (2.0 * h)
        });
        assert!(ORDER.contains(&second), "{}: Hessian of order {second:.3}", term.name());
    }
}

#[test]
fn terms_have_the_derivatives_they_claim() {
    let rest = REST.map(Vec3::from);
    for law in LAWS {
        let elements = Elements { X: &rest, tets: &TETS, midsides: &[] };
        check_term(&*(law.term)(&constants(law, 1.0), elements), &rest, SEED);
    }
    let m = vec![1.0, 2.0, 0.5, 1.5, 3.0];
    check_term(&Gravity { m: m.clone(), input: 2, scan: Vec3::new(0.3, 0.0, -1.0) }, &rest, SEED + 1);
    check_term(&Inertia { m }, &rest, SEED + 2);
    check_term(&OnElements(Springs(springs(1.0, &rest, &TETS))), &rest, SEED + 7);
    check_term(&DeadLoad { shares: vec![(1, 0.25), (4, 0.75)], input: 1 }, &rest, SEED + 3);
    check_term(&Pressure { triangles: vec![[0, 1, 2], [1, 4, 2]], input: 3 }, &rest, SEED + 4);
}

/// Shapes so large that all points stay inside, in the onset and beyond: elsewhere slopes are continuous and no more. Their
/// frames are strained, which no bone does.
#[test]
fn contacts_have_the_derivatives_they_claim() {
    let tube =
        |points: &[[f64; 3]], radius| Shape::Tube { path: points.iter().map(|p| Vec3::from(*p)).collect(), radius };
    let normal = Vec3::new(1.0, 2.0, -2.0) / 3.0;
    for (k, shape) in [
        tube(&[[0.4, 0.5, -3.0]], 8.0),
        tube(&[[-9.0, 0.4, -3.0], [9.0, 2.5, -3.5]], 8.0),
        tube(&[[20.0, 0.0, 9.0], [9.0, 2.5, -3.5], [-9.0, 0.4, -3.0]], 8.0),
        Shape::HalfSpace { point: Vec3::new(2.0, 4.0, -4.0), normal },
    ]
    .into_iter()
    .enumerate()
    {
        let middle = shape.middle();
        let mut rest: Vec<Vec3> = REST.map(Vec3::from).to_vec();
        rest.extend(Contact::corners(middle, 1.2));
        // Without friction; held by it; sliding under it.
        for (onset, mu) in [(1e-3, 0.0), (50.0, 0.0), (1e-3, 40.0), (1e-3, 1e-3)] {
            let triangles = vec![([0, 1, 2], 0.5), ([1, 4, 2], 0.7), ([0, 3, 1], 0.4)];
            let shape = shape.clone();
            let friction = (mu > 0.0).then_some(Friction { mu, first: 2 });
            let mut random = Random(SEED + 30);
            let mut history: Vec<f64> = (0..2 + Contact::memory(3)).map(|_| random.number()).collect();
            history.iter_mut().skip(5).step_by(4).for_each(|touched| *touched = 1.0);
            let contact =
                Contact { shape, middle, frame: [5, 6, 7, 8], size: 1.2, triangles, stiffness: 3.0, onset, friction };
            assert!(contact.touch(&At::NOWHERE, &rest).expect("a contact").depth() > 0.5, "shape {k} touches nothing");
            check_term_at(&contact, &rest, SEED + 20 + k as u64, &history);
        }
    }
}

/// Stiffness damping with a past.
fn check_damping(measure: Measure, planted: f64) {
    let rest = REST.map(Vec3::from);
    let elements = Elements { X: &rest, tets: &TETS, midsides: &[] };
    let term = elements.of(stiffness_damping(lame(), measure, 0));
    let mut random = Random(SEED + 7);
    let history: Vec<f64> = (0..damping_memory(&elements)).map(|_| 0.1 * random.number()).collect();
    let at = At { dt: 0.3, difference: Difference::new(0.3, 0.2), history: &history, ..At::NOWHERE };
    let x: Vec<Vec3> = rest.iter().map(|X| X + 0.1 * random.vector()).collect();
    let [d, w] = [0, 1].map(|_| x.iter().map(|_| random.vector()).collect::<Vec<_>>());
    let dot = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
    let moved = |h: f64| x.iter().zip(&d).map(|(x, d)| x + h * d).collect::<Vec<_>>();
    let gradient = |x: &[Vec3]| {
        let mut g = vec![Vec3::zeros(); x.len()];
        let energy = term.add_gradient(&at, x, &mut g);
        assert!((energy - term.energy(&at, x)).abs() <= 1e-12 * energy.abs().max(1.0));
        g
    };
    let g = gradient(&x);
    let first = order(dot(&g, &d) + planted, dot(&g, &g).sqrt(), |h| {
        (term.energy(&at, &moved(h)) - term.energy(&at, &moved(-h))) / (2.0 * h)
    });
    assert!(ORDER.contains(&first), "{measure:?}: gradient of order {first:.3}");
    let mut H = Dense(vec![vec![Mat3::zeros(); x.len()]; x.len()]);
    term.add_hessian(&at, &x, Curvature::Exact, &mut H);
    let Hd: Vec<Vec3> = H.0.iter().map(|row| row.iter().zip(&d).map(|(H, d)| H * d).sum()).collect();
    let second = order(dot(&w, &Hd), dot(&Hd, &Hd).sqrt(), |h| {
        (dot(&gradient(&moved(h)), &w) - dot(&gradient(&moved(-h)), &w)) / (2.0 * h)
    });
    assert!(ORDER.contains(&second), "{measure:?}: Hessian of order {second:.3}");
}

#[test]
fn stiffness_damping_has_the_derivatives_it_claims() {
    check_damping(Measure::Finite, 0.0);
    check_damping(Measure::Small, 0.0);
}

#[test]
#[should_panic]
fn a_planted_error_in_damping_is_found() {
    check_damping(Measure::Finite, 0.1);
}

#[test]
fn muscles_have_the_derivatives_they_claim() {
    let rest = REST.map(Vec3::from);
    let elements = Elements { X: &rest, tets: &TETS, midsides: &[] };
    let fibre = vec![Vec3::new(0.6, 0.8, 0.0), Vec3::new(0.0, 0.6, 0.8)];
    for width in [None, Some(0.6)] {
        check_term(&*elements.of(Muscle { fibre: fibre.clone(), T0: 2.0, width, input: 1 }), &rest, SEED + 6);
    }
}

#[test]
fn quadratic_elements_have_the_derivatives_they_claim() {
    let mut mesh = TetMesh {
        nodes: REST[..4].iter().map(|x| Vec3::from(*x)).collect(),
        tets: vec![TETS[0]],
        region: vec![0],
        region_names: vec!["tissue".into()],
        ..TetMesh::default()
    };
    let midsides = add_midsides(&mut mesh);
    // Curved edges, so that the shape gradients differ from point to point.
    let mut random = Random(SEED);
    mesh.nodes[4..].iter_mut().for_each(|x| *x += 0.05 * random.vector());
    for law in LAWS {
        let elements = Elements { X: &mesh.nodes, tets: &mesh.tets, midsides: &midsides };
        check_term(&*(law.term)(&constants(law, 1.0), elements), &mesh.nodes, SEED + 5);
    }
}
