//! Factors made in the background: the same bits whoever makes them, and fewer solves.

use cutis::sim::{Sim, State};

use crate::common::{get, set, sim};

const SCENE: &str = "[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [8, 6, 3]\n[[tissue]]\nE = 15e3\nnu = 0.45\n[[bone]]\n\
    name = \"skull\"\nnodes = \"x_min\"\ndrive = \"held\"\n[[bone]]\nname = \"jaw\"\nnodes = \"x_max\"\nINERTIA\
    [solver]\nbackground = BACKGROUND\n";

fn scene(inertia: &str, background: bool) -> String {
    SCENE.replace("INERTIA", inertia).replace("BACKGROUND", if background { "true" } else { "false" })
}

/// Bends the block further; returns linear solves and factorisations.
fn step(sim: &mut Sim, k: u32) -> (u32, u32) {
    let s = f64::from(k) / 24.0;
    set(sim, "bone.translation", 3, &[0.01 * s, 0.0, 0.02 * s]);
    set(sim, "bone.rotation", 3, &[0.0, -1.2 * s, 0.5 * s]);
    let report = sim.step(0.02).expect("a step");
    (report.iterations, report.factorisations)
}

#[test]
fn the_same_bits_whether_a_thread_was_ahead_or_not() {
    for inertia in ["", "[inertia]\ndamping_mass = 5.0\n"] {
        let text = scene(inertia, true);
        let mut ahead = sim(&text);
        ahead.initialise().expect("equilibrium");
        let mut bytes = ahead.save().to_bytes(ahead.model());
        let mut taken_up = 0;
        for k in 1..=24 {
            let counts = step(&mut ahead, k);
            taken_up += counts.1;
            // A new simulation knows of no thread: it makes every factor on the spot.
            let mut alone = sim(&text);
            let state = State::from_bytes(&bytes, alone.model()).expect("its own bytes");
            alone.restore(&state).expect("the same model");
            let (solves, _) = step(&mut alone, k);
            assert_eq!(solves, counts.0, "solves of step {k}");
            bytes = alone.save().to_bytes(alone.model());
            assert!(bytes == ahead.save().to_bytes(ahead.model()), "bits of step {k}");
        }
        assert!(taken_up >= 2, "{taken_up} factors were taken up");
    }
}

#[test]
fn fewer_solves_and_the_same_answer() {
    let run = |background: bool| {
        let mut sim = sim(&scene("", background));
        sim.initialise().expect("equilibrium");
        let solves: u32 = (1..=24).map(|k| step(&mut sim, k).0).sum();
        (solves, get(&sim, "skin.position"))
    };
    let ((solves, x), (solves_before, x_before)) = (run(true), run(false));
    println!("{solves} solves with factors made in the background, {solves_before} without");
    assert!(solves < solves_before);
    let off = x.iter().zip(&x_before).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
    assert!(off < 1e-6, "{off:e} m apart");
}

#[test]
fn a_simulation_can_be_dropped_or_set_back_while_its_thread_is_at_work() {
    let mut busy = sim(&scene("", true));
    busy.initialise().expect("equilibrium");
    let start = busy.save();
    for k in 1..=6 {
        step(&mut busy, 4 * k);
        busy.restore(&start).expect("its own state");
    }
    step(&mut busy, 24);
    drop(busy);
}

#[test]
fn methods_without_a_kept_factor_want_no_thread() {
    for line in ["method = \"newton\"", "linear = \"iterative\""] {
        let text = format!("{}{line}\n", scene("", true));
        let message = cutis::load::from_text(&text, None).err().expect("a contradiction").to_string();
        assert!(message.contains("line") && message.contains("wants the methods that keep one"), "{message}");
    }
}
