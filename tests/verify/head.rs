//! The synthetic head as a whole: its mirror symmetry, its smile.

use std::path::Path;
use std::sync::Arc;

use cutis::math::Vec3;
use cutis::sim::Sim;

use crate::common::{get, largest, rows, set};

#[test]
fn a_smile_lifts_and_widens_the_corners_of_the_mouth_alike() {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/smile.toml");
    let loaded = cutis::load::from_file(&scene).expect("the example");
    let mut sim = Sim::new(Arc::new(loaded.model)).expect("a simulation");
    sim.initialise().expect("rest");
    let rest = rows(&get(&sim, "marker.position"));
    for k in 1..=loaded.programme.steps() {
        for s in loaded.programme.settings(k as f64 * loaded.programme.dt) {
            sim.set_f64(s.port, s.offset, &s.values).expect("keyframes fit their ports");
        }
        let report = sim.step(loaded.programme.dt).expect("a muscle step");
        assert!(sim.strain().min_det_f > 0.0, "{report:?}");
    }
    let moved: Vec<_> = rows(&get(&sim, "marker.position")).iter().zip(&rest).map(|(x, X)| x - X).collect();
    let (left, right) = (moved[0], moved[1]);
    assert!(left.x > 0.004 && left.z > 0.004, "the left corner goes out and up: {left}");
    assert!(largest([left.x + right.x, left.y - right.y, left.z - right.z]) < 1e-6, "both alike: {left} {right}");
}

#[test]
fn a_finger_feels_the_cheek_that_it_presses() {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/finger.toml");
    let loaded = cutis::load::from_file(&scene).expect("the example");
    let mut sim = Sim::new(Arc::new(loaded.model)).expect("a simulation");
    sim.initialise().expect("rest");
    let mut before = 0.0;
    for k in 1..=4 {
        for s in loaded.programme.settings(k as f64 * loaded.programme.dt) {
            sim.set_f64(s.port, s.offset, &s.values).expect("keyframes fit their ports");
        }
        sim.step(loaded.programme.dt).expect("a step");
        let force = rows(&get(&sim, "contact.force"))[0];
        // It comes from the left front, so it is pushed back there.
        assert!(force.norm() > before && force.x > 0.0 && force.y < 0.0, "{force}");
        let all: Vec3 = rows(&get(&sim, "bone.reactionForce")).iter().sum();
        assert!(all.norm() < 1e-3 * force.norm(), "the bones hold what the finger pushes: {all} left");
        before = force.norm();
    }
    assert!(get(&sim, "contact.depth")[0] < 3e-4);
}

/// How far the markers go (mm) when these muscles, both sides of them, are activated alone.
fn expression(sim: &mut Sim, muscles: &[(&str, f64)]) -> impl Fn(&str) -> Vec3 + use<> {
    sim.reset();
    sim.initialise().expect("rest");
    let rest = rows(&get(sim, "marker.position"));
    let ports = sim.model().ports();
    let names = |port: &str| ports.iter().find(|p| p.name == port).expect("a port").rows.clone();
    let (activations, markers) = (names("muscle.activation"), names("marker.position"));
    let of = |row: &String| muscles.iter().filter(|(m, _)| row.starts_with(m)).map(|(_, a)| a).sum::<f64>();
    for k in 1..=4 {
        let values: Vec<f64> = activations.iter().map(|row| of(row) * f64::from(k) / 4.0).collect();
        set(sim, "muscle.activation", 0, &values);
        sim.step(0.1).expect("a muscle step");
    }
    let moved: Vec<Vec3> = rows(&get(sim, "marker.position")).iter().zip(&rest).map(|(x, X)| 1e3 * (x - X)).collect();
    move |marker: &str| moved[markers.iter().position(|m| m == marker).expect("a marker")]
}

/// Corners of the mouth go 5 to 14 mm in expressions; signs after the anatomy (LPS: x to the left, y back, z up).
#[test]
fn facial_muscles_move_what_anatomy_says() {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/expressions.toml");
    let mut sim = Sim::new(Arc::new(cutis::load::from_file(&scene).expect("the example").model)).expect("a simulation");
    let u = expression(&mut sim, &[("zygomaticus_major", 0.3), ("zygomaticus_minor", 0.2)]);
    let corner = u("lip_corner_left");
    println!("zygomatici: corner {corner:?}");
    assert!((5.0..14.0).contains(&corner.norm()) && corner.x > 2.0 && corner.z > 2.0, "up and out: {corner}");
    let u = expression(&mut sim, &[("orbicularis_oris", 0.6)]);
    println!("orbicularis oris: corner {:?}, upper lip {:?}", u("lip_corner_left"), u("lip_upper"));
    assert!(u("lip_corner_left").x < -2.0, "the mouth narrows");
    let u = expression(&mut sim, &[("depressor_anguli_oris", 0.5)]);
    println!("depressor anguli oris: corner {:?}", u("lip_corner_left"));
    assert!((-14.0..-3.0).contains(&u("lip_corner_left").z), "the corners go down");
    let u = expression(&mut sim, &[("corrugator", 0.9)]);
    println!("corrugator: brows {:?} {:?}", u("brow_left"), u("brow_right"));
    assert!(u("brow_left").x < -1.0 && u("brow_right").x > 1.0, "the brows come together");
    let u = expression(&mut sim, &[("frontalis", 0.9)]);
    println!("frontalis: brow {:?}", u("brow_left"));
    assert!((2.0..10.0).contains(&u("brow_left").z), "the brow goes up");
    let (l, r) = (u("brow_left"), u("brow_right"));
    assert!(largest([l.x + r.x, l.y - r.y, l.z - r.z]) < 1e-3, "both alike: {l} {r}");
}
