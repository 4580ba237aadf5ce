//! Rest is free of stress, rotations change nothing, tangents are symmetric, small strains return mu and lambda.

use cutis::effect::LAWS;
use cutis::energy::{
    Corotational, Energy, Fung, Lame, Linear, MooneyRivlin, NeoHookean, Ogden, PolyconvexNeoHookean, StVenantKirchhoff,
    StableNeoHookean, Stretches, VerondaWestmann, WithBulk, Yeoh,
};
use cutis::math::{Mat3, clamp_eigenvalues, exp_rotation, outer};

use crate::common::{Random, constants};

const LAME: Lame = Lame { mu: 3.0, lambda: 7.0 };

fn check<M: Energy>(energy: &M, objective: bool) {
    let I = Mat3::identity();
    assert!(energy.psi(&I).abs() < 1e-14 && energy.P(&I).norm() < 1e-13, "{}: stress at rest", M::NAME);
    let mut small = LAME.lambda * outer(&I, &I);
    for i in 0..3 {
        for j in 0..3 {
            small[(i + 3 * j, i + 3 * j)] += LAME.mu;
            small[(i + 3 * j, j + 3 * i)] += LAME.mu;
        }
    }
    assert!((energy.dPdF(&I) - small).norm() < 1e-12, "{}: small-strain moduli", M::NAME);
    let mut random = Random(7);
    for _ in 0..20 {
        let F = I + 0.3 * random.matrix();
        if F.determinant() < 0.1 {
            continue;
        }
        let H = energy.dPdF(&F);
        assert!((H - H.transpose()).norm() < 1e-12 * H.norm(), "{}: symmetry of dP/dF", M::NAME);
        let clamped = clamp_eigenvalues(&H);
        assert!(clamped.symmetric_eigenvalues().min() > -1e-10 * H.norm(), "{}: projection", M::NAME);
        if objective {
            let R = exp_rotation(&(2.0 * random.vector()));
            assert!((energy.psi(&(R * F)) - energy.psi(&F)).abs() < 1e-12 * energy.psi(&F), "{}: objectivity", M::NAME);
            assert!((energy.P(&(R * F)) - R * energy.P(&F)).norm() < 1e-12 * energy.P(&F).norm(), "{}: P", M::NAME);
            assert!((energy.psi(&(F * R)) - energy.psi(&F)).abs() < 1e-12 * energy.psi(&F), "{}: isotropy", M::NAME);
            let couple = energy.P(&F) * F.transpose();
            assert!((couple - couple.transpose()).norm() < 1e-12 * couple.norm(), "{}: symmetric stress", M::NAME);
        }
    }
}

#[test]
fn energies_obey_the_laws_of_elasticity() {
    check(&Linear(LAME), false);
    check(&Corotational(LAME), true);
    check(&StVenantKirchhoff(LAME), true);
    check(&StableNeoHookean(LAME), true);
    check(&PolyconvexNeoHookean(LAME), true);
    check(&NeoHookean(LAME), true);
    let kappa = LAME.lambda + 2.0 / 3.0 * LAME.mu;
    check(&WithBulk { law: MooneyRivlin { c10: 0.4 * LAME.mu, c01: 0.1 * LAME.mu }, kappa }, true);
    check(&WithBulk { law: Yeoh { c10: 0.5 * LAME.mu, c20: 0.2, c30: 0.1 }, kappa }, true);
    check(&WithBulk { law: Fung { mu: LAME.mu, b: 2.0 }, kappa }, true);
    check(&WithBulk { law: VerondaWestmann { c1: LAME.mu / 2.0, c2: 2.0 }, kappa }, true);
    check(&Stretches(Ogden { terms: vec![(2.0, 4.0), (1.0, -2.0)], kappa }), true);
}

#[test]
#[should_panic(expected = "objectivity")]
fn the_check_of_objectivity_can_fail() {
    check(&Linear(LAME), true);
}

#[test]
fn neo_hookean_refuses_inversion_by_infinite_energy() {
    let mut F = Mat3::identity();
    F[(0, 0)] = -0.5;
    assert_eq!(NeoHookean(LAME).psi(&F), f64::INFINITY);
    assert!(StableNeoHookean(LAME).psi(&F).is_finite());
}

#[test]
fn lame_constants_come_from_young_and_poisson() {
    let lame = Lame::new(15e3, 0.45);
    let young = lame.mu * (3.0 * lame.lambda + 2.0 * lame.mu) / (lame.lambda + lame.mu);
    assert!((young - 15e3).abs() < 1e-9 && (lame.lambda / (2.0 * (lame.lambda + lame.mu)) - 0.45).abs() < 1e-15);
}

#[test]
fn the_catalogue_says_the_moduli_that_its_laws_have() {
    for law in LAWS {
        let Lame { mu, lambda } = (law.moduli)(&constants(law, 15e3));
        let nu = lambda / (2.0 * (lambda + mu));
        assert!((nu - 0.4).abs() < 0.02 && (mu * 2.8 / 15e3 - 1.0).abs() < 0.02, "{}: mu {mu}, nu {nu}", law.name);
    }
}
