//! Violent motion ends in an equilibrium or in a clear error, never in a NaN, and the way back leads to rest.

use std::f64::consts::FRAC_PI_2;

use cutis::effect::LAWS;

use super::inputs::block;
use crate::common::{get, largest, set, sim};

#[test]
fn huge_motion_and_force_end_in_an_answer_or_an_error() {
    for law in LAWS {
        let energy = law.name;
        for (name, values) in [
            ("bone.translation", vec![0.0, 0.0, 0.0, 0.05, 0.0, 0.0]),
            ("bone.translation", vec![0.0, 0.0, 0.0, 0.0, 0.05, 0.05]),
            ("bone.translation", vec![0.0, 0.0, 0.0, -0.05, 0.0, 0.0]),
            ("bone.translation", vec![0.0, 0.0, 0.0, 1e6, 0.0, 0.0]),
            ("bone.rotation", vec![0.0, 0.0, 0.0, FRAC_PI_2, 0.0, 0.0]),
            ("bone.rotation", vec![0.0, 0.0, 0.0, 0.0, 0.0, 3.1]),
            ("load.force", vec![0.0, 0.0, -5.0]),
            ("load.force", vec![1e4, 0.0, 1e4]),
        ] {
            let mut sim = sim(&block(energy));
            set(&mut sim, name, 0, &values);
            let outcome = sim.step(0.1);
            let x = get(&sim, "skin.position");
            assert!(x.iter().all(|c| c.is_finite()), "{energy}, {name} {values:?}: {outcome:?}");
            if outcome.is_err() {
                assert_eq!(x, get(&sim, "skin.restPosition"), "{energy}: a refused step changes nothing");
            }
        }
    }
}

#[test]
fn a_bone_jump_of_five_centimetres_and_a_right_angle_is_solved() {
    for energy in ["corotational", "stable-neo-hookean", "neo-hookean", "yeoh", "fung", "ogden"] {
        let mut sim = sim(&block(energy));
        set(&mut sim, "bone.translation", 3, &[0.05, 0.0, 0.0]);
        set(&mut sim, "bone.rotation", 3, &[FRAC_PI_2, 0.0, 0.0]);
        let report = sim.step(0.1).unwrap_or_else(|e| panic!("{energy}: {e}"));
        assert!(sim.strain().min_det_f > 0.0, "{energy}: {report:?}");
    }
}

#[test]
fn unloading_leads_back_to_rest() {
    for law in LAWS {
        let energy = law.name;
        let mut sim = sim(&block(energy));
        set(&mut sim, "bone.translation", 3, &[0.01, 0.005, 0.0]);
        set(&mut sim, "load.force", 0, &[0.0, 0.0, -0.3]);
        sim.step(0.1).unwrap_or_else(|e| panic!("{energy}: {e}"));
        set(&mut sim, "bone.translation", 3, &[0.0; 3]);
        set(&mut sim, "load.force", 0, &[0.0; 3]);
        sim.step(0.1).unwrap_or_else(|e| panic!("{energy}: {e}"));
        let error = largest(get(&sim, "skin.position").iter().zip(get(&sim, "skin.restPosition")).map(|(x, X)| x - X));
        assert!(error < 1e-7, "{energy}: {error:.1e} m from rest");
    }
}

#[test]
fn elements_inside_out_are_refused_unless_the_scene_allows_them() {
    let mut strict = sim(&block("stable-neo-hookean"));
    let mut lax = sim(&format!("{}[solver]\ninversion = \"allow\"\n", block("stable-neo-hookean")));
    let bytes = |sim: &cutis::sim::Sim| sim.save().to_bytes(sim.model());
    let (mut refused, mut told) = (None, false);
    for k in 1..=15 {
        let u = -0.003 * f64::from(k);
        set(&mut lax, "bone.translation", 3, &[u, 0.0, 0.0]);
        let report = lax.step(0.1).expect("an answer, if need be inside out");
        told |= report.warnings.iter().any(|w| w.contains("inside out"));
        if refused.is_none() {
            set(&mut strict, "bone.translation", 3, &[u, 0.0, 0.0]);
            let before = bytes(&strict);
            match strict.step(0.1) {
                Ok(report) => assert!(strict.strain().min_det_f > 0.0, "{report:?}"),
                Err(e) => {
                    assert_eq!(bytes(&strict), before);
                    refused = Some(e.to_string());
                }
            }
        }
    }
    assert!(told, "the block was to be pressed until it folds");
    assert!(refused.expect("a refusal").contains("inversion = \"allow\""));
}
