//! Dynamics: backward Euler's own closed forms, momentum, and states that repeat their bits.

use cutis::sim::{Sim, State};

use crate::common::{get, largest, set, sim};

const BAR: &str = "[mesh.block]\nsize = [0.02, 0.02, 0.06]\ncells = [2, 2, 6]\n\
                   [[tissue]]\nenergy = \"stable-neo-hookean\"\nE = 15e3\nnu = 0.4\n[inertia]\nstart = \"rest\"\n";

#[test]
fn free_fall_is_backward_eulers() {
    // No bone at all: after n steps the fall is g dt^2 n(n+1)/2, exactly, and nothing deforms.
    let mut sim = sim(&format!("{BAR}[gravity]\nacceleration = [0, 0, -10]\n"));
    sim.initialise().expect("rest");
    let dt = 0.01;
    for _ in 0..20 {
        sim.step(dt).expect("free fall");
    }
    let fall = 10.0 * dt * dt * 20.0 * 21.0 / 2.0;
    let (x, rest, v) = (get(&sim, "skin.position"), get(&sim, "skin.restPosition"), get(&sim, "skin.velocity"));
    assert!(largest((0..x.len() / 3).map(|k| rest[3 * k + 2] - x[3 * k + 2] - fall)) < 1e-6);
    assert!(largest((0..x.len() / 3).map(|k| v[3 * k + 2] + 10.0 * dt * 20.0)) < 1e-4);
    assert!(get(&sim, "energy.elastic")[0] < 1e-9);
}

#[test]
fn a_shaken_block_comes_to_the_static_answer() {
    let scene = |inertia: &str| {
        format!(
            "{}{inertia}[[bone]]\nname = \"root\"\nnodes = \"z_min\"\n[gravity]\nacceleration = [2, 0, -10]\n",
            &BAR[..BAR.find("[inertia]").unwrap()]
        )
    };
    let mut moving = sim(&scene("[inertia]\nstart = \"rest\"\n"));
    let mut still = sim(&scene(""));
    still.initialise().expect("equilibrium");
    moving.initialise().expect("rest");
    for _ in 0..400 {
        moving.step(1.0 / 60.0).expect("a dynamic step");
    }
    let error = largest(get(&moving, "skin.position").iter().zip(get(&still, "skin.position")).map(|(a, b)| a - b));
    assert!(error < 1e-6, "off by {error:.1e} m");
    assert!(get(&moving, "energy.kinetic")[0] < 1e-10);
}

fn shaken() -> Sim {
    sim(&format!("{BAR}[[bone]]\nname = \"root\"\nnodes = \"z_min\"\n[gravity]\n"))
}

fn drive(sim: &mut Sim, k: usize) {
    let t = k as f64 / 60.0;
    set(sim, "bone.translation", 0, &[0.01 * (12.0 * t).sin(), 0.0, 0.0]);
    sim.step(1.0 / 60.0).expect("a dynamic step");
}

#[test]
fn a_restored_state_repeats_its_bits() {
    let mut straight = shaken();
    straight.initialise().expect("rest");
    (0..5).for_each(|k| drive(&mut straight, k));
    let saved: State = straight.save();
    let bytes = saved.to_bytes(straight.model());
    (5..12).for_each(|k| drive(&mut straight, k));
    let wanted = get(&straight, "skin.position");

    // Back in time in the same simulation.
    straight.restore(&saved).expect("its own state");
    (5..12).for_each(|k| drive(&mut straight, k));
    assert_eq!(get(&straight, "skin.position"), wanted);

    // In a simulation that never ran, from bytes.
    let mut other = shaken();
    let state = State::from_bytes(&bytes, other.model()).expect("bytes of the same model");
    assert_eq!(state, saved);
    other.restore(&state).expect("a state of the same model");
    (5..12).for_each(|k| drive(&mut other, k));
    assert_eq!(get(&other, "skin.position"), wanted);

    // After a reset.
    other.reset();
    other.initialise().expect("rest");
    (0..12).for_each(|k| drive(&mut other, k));
    assert_eq!(get(&other, "skin.position"), wanted);
}

#[test]
fn a_state_saved_after_a_violent_step_repeats_its_bits_elsewhere() {
    // Steps that are cut leave factors of failed pieces behind; what follows must not depend on them.
    for (law, constants) in [("neo-hookean", "E = 15e3\nnu = 0.45\n"), ("fung", "mu = 5e3\nb = 2.0\nkappa = 5e4\n")] {
        let scene = format!(
            "[mesh.block]\nsize = [0.06, 0.04, 0.03]\ncells = [6, 4, 3]\n[[tissue]]\nenergy = \"{law}\"\n{constants}\
             [[bone]]\nname = \"skull\"\nnodes = \"x_min\"\n[[bone]]\nname = \"mandible\"\nnodes = \"x_max\"\n\
             [[load]]\nname = \"push\"\nat = [0.03, 0.02, 0.03]\nradius = 0.01\n"
        );
        let mut straight = sim(&scene);
        set(&mut straight, "bone.translation", 3, &[-0.03, 0.02, 0.0]);
        set(&mut straight, "bone.rotation", 3, &[2.0, 0.0, 0.5]);
        set(&mut straight, "load.force", 0, &[0.0, 0.0, -5.0]);
        let report = straight.step(0.1).expect("a violent step");
        assert!(report.substeps > 1, "{law}: the step was not cut: {report:?}");
        let mut other = sim(&scene);
        let bytes = straight.save().to_bytes(straight.model());
        let state = State::from_bytes(&bytes, other.model()).expect("the same model");
        other.restore(&state).expect("the same model");
        for sim in [&mut straight, &mut other] {
            for k in 1..4 {
                set(sim, "bone.translation", 3, &[-0.03 + 1e-3 * f64::from(k), 0.02, 0.0]);
                sim.step(0.1).expect("a small step");
            }
        }
        assert_eq!(get(&straight, "skin.position"), get(&other, "skin.position"), "{law}");
    }
}

#[test]
fn damaged_states_are_refused() {
    let sim = shaken();
    let bytes = sim.save().to_bytes(sim.model());
    for cut in [0, 4, 20, 60, bytes.len() - 1] {
        assert!(State::from_bytes(&bytes[..cut], sim.model()).is_err(), "cut to {cut}");
    }
    let mut flipped = bytes.clone();
    *flipped.last_mut().unwrap() ^= 1;
    assert!(State::from_bytes(&flipped, sim.model()).unwrap_err().to_string().contains("checksum"));
    let other = crate::common::sim(&format!("{BAR}[[bone]]\nname = \"root\"\nnodes = \"z_max\"\n"));
    assert!(State::from_bytes(&bytes, other.model()).unwrap_err().to_string().contains("belongs to model"));
}
