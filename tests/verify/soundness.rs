//! What a step must not hide: wrong branches, snaps, squeezed elements, shapes inside tissue; and what a refusal says.

use cutis::sim::{SimError, StepReport};
use cutis::solve::SolveError;

use crate::common::{get, largest, set, sim};

/// A block whose left end is held and whose right end moves.
fn block(law: &str) -> String {
    format!(
        "[mesh.block]\nsize = [0.06, 0.02, 0.02]\ncells = [9, 3, 3]\n[[tissue]]\n{law}E = 15e3\nnu = 0.45\n[[bone]]\nname = \"skull\"\n\
         nodes = \"x_min\"\ndrive = \"held\"\n[[bone]]\nname = \"jaw\"\nnodes = \"x_max\"\n"
    )
}

const STABLE: &str = "energy = \"stable-neo-hookean\"\n";

fn off_rest(sim: &cutis::sim::Sim) -> f64 {
    largest(sim.positions().iter().zip(&sim.model().mesh().nodes).map(|(x, X)| (x - X).norm()))
}

fn says(report: &StepReport, text: &str) -> bool {
    report.warnings.iter().any(|w| w.contains(text))
}

#[test]
fn tissue_comes_back_from_afar() {
    for law in ["", STABLE, "energy = \"neo-hookean\"\n"] {
        let mut sim = sim(&block(law));
        sim.initialise().expect("rest");
        for x in [0.3, 0.0] {
            set(&mut sim, "bone.translation", 3, &[x, 0.0, 0.0]);
            sim.step(1.0).expect("a step");
        }
        assert!(off_rest(&sim) < 1e-6, "{law}: {:.1e} m off", off_rest(&sim));
    }
}

/// A bar that slips by a whole turn says so, and rest under inputs at rest is rest.
#[test]
fn a_twisted_bar_tells_when_it_slips() {
    for (law, told) in [("", "snapped"), (STABLE, "snapped")] {
        let mut sim = sim(&block(law));
        sim.initialise().expect("rest");
        let most = crate::common::port(&sim, "solver.mostSolves");
        sim.set_i32(most, 0, &[1700]).expect("a bound");
        let mut warned = false;
        let mut energy = vec![0.0];
        for k in (1..=16).chain((0..16).rev()) {
            set(&mut sim, "bone.rotation", 3, &[0.25 * std::f64::consts::PI * f64::from(k), 0.0, 0.0]);
            let report = sim.step(1.0).expect("a step");
            energy.push(get(&sim, "energy.elastic")[0]);
            let [before, after] = [energy[energy.len() - 2], energy[energy.len() - 1]];
            // Up to the slip nothing unloads; behind it the bar unwinds.
            if !warned && after < 0.5 * before {
                assert!(says(&report, told), "{law} {k}: {before:.1e} to {after:.1e} J, {report:?}");
                warned = true;
            }
        }
        assert!(warned, "{law}: no slip in {energy:?}");
        // Tissue that was taken back to rest keeps the host's bound.
        let mut kept = [0];
        sim.get_i32(most, 0, &mut kept).expect("a bound");
        assert_eq!(kept, [1700]);
        assert!(off_rest(&sim) < 1e-6, "{law}: {:.1e} m off", off_rest(&sim));
    }
}

/// Common steps, there and back, say nothing.
#[test]
fn what_is_sound_is_not_told() {
    for law in ["", STABLE, "energy = \"corotational\"\n"] {
        let mut sim = sim(&block(law));
        sim.initialise().expect("rest");
        for k in (1..=6).chain((0..6).rev()) {
            let k = f64::from(k);
            set(&mut sim, "bone.translation", 3, &[1e-3 * k, 0.0, 1e-3 * k]);
            set(&mut sim, "bone.rotation", 3, &[0.1 * k, 0.05 * k, 0.0]);
            let report = sim.step(1.0).expect("a step");
            assert!(report.warnings.is_empty(), "{law}: {report:?}");
        }
    }
}

#[test]
fn squeezed_elements_are_told_with_their_place_and_again_when_worse() {
    // A flat pad between two plates: it does not buckle.
    let pad = block("energy = \"neo-hookean\"\n")
        .replace("nu = 0.45", "nu = 0.1")
        .replace("[0.06, 0.02, 0.02]", "[0.01, 0.04, 0.04]");
    let mut sim = sim(&pad.replace("[9, 3, 3]", "[2, 4, 4]"));
    sim.initialise().expect("rest");
    let mut told = Vec::new();
    for k in 1..=33 {
        set(&mut sim, "bone.translation", 3, &[-0.0003 * f64::from(k), 0.0, 0.0]);
        let Ok(report) = sim.step(1.0) else { break };
        if let Some(w) = report.warnings.iter().find(|w| w.contains("squeezed")) {
            told.push((get(&sim, "quality.minDetF")[0], w.clone()));
        }
    }
    assert!(told.len() >= 2, "{told:?}");
    assert!(told[0].0 <= 0.1 && told.windows(2).all(|w| w[1].0 < w[0].0), "{told:?}");
    assert!(told[0].1.contains("mm at rest, region `tissue`") && told[0].1.contains("from bone `"), "{told:?}");
}

#[test]
fn linear_tissue_that_turns_inside_out_is_told_once() {
    let mut sim = sim(&block("energy = \"linear\"\n"));
    sim.initialise().expect("rest");
    let mut n = 0;
    for k in 1..=20 {
        set(&mut sim, "bone.translation", 3, &[-0.004 * f64::from(k), 0.0, 0.0]);
        let report = sim.step(1.0).expect("a step");
        let told = report.warnings.iter().any(|w| w.contains("inside out"));
        assert!(!told || get(&sim, "quality.minDetF")[0] <= 0.0);
        n += usize::from(told);
    }
    assert!(get(&sim, "quality.minDetF")[0] < -0.1 && n == 1, "told {n} times");
}

#[test]
fn a_refusal_says_where_and_how_far_and_is_not_worked_out_twice() {
    let mut sim = sim(&block("energy = \"corotational\"\n"));
    sim.initialise().expect("rest");
    set(&mut sim, "bone.translation", 3, &[-0.055, 0.0, 0.0]);
    let before = sim.save();
    let start = std::time::Instant::now();
    let error = sim.step(1.0).expect_err("too far");
    let first = start.elapsed();
    let SimError::Solve { reached, place, .. } = &error else { panic!("{error}") };
    assert!((0.0..1.0).contains(reached) && place.as_ref().is_some_and(|p| p.region == "tissue"), "{error:?}");
    let text = error.to_string();
    assert!(text.contains("% of the step was reached") && text.contains("worst element: det F"), "{text}");
    assert!(sim.refused().is_some_and(|x| x.len() == sim.positions().len()));
    let start = std::time::Instant::now();
    assert_eq!(sim.step(1.0).expect_err("the same"), error);
    assert!(start.elapsed() < first / 2, "{:?} after {first:?}", start.elapsed());
    assert_eq!(sim.save(), before);
    // Another step is tried.
    set(&mut sim, "bone.translation", 3, &[-0.001, 0.0, 0.0]);
    sim.step(1.0).expect("less far");
}

/// A thousand times what the head is pushed with otherwise takes bounded work, ten thousand times next to none, and the head goes on.
#[test]
fn loads_beyond_sense_are_refused_for_little() {
    let mut sim =
        sim(&std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/fmu/scene.toml")).expect("the scene"));
    sim.initialise().expect("rest");
    for (force, most) in [(1e3, 41.0), (1e4, 1.0), (1e6, 1.0)] {
        set(&mut sim, "load.force", 0, &[0.0, force, 0.0]);
        let error = sim.step(0.1).expect_err("no tissue bears that");
        let SimError::Solve { work, .. } = &error else { panic!("{error}") };
        assert!(*work <= most * sim.good_step(), "{force} N: the work of {work:.0} solves; {error}");
    }
    set(&mut sim, "load.force", 0, &[0.0, 1.0, 0.0]);
    sim.step(0.1).expect("a common load");
}

/// A host that allows more solves than usual gets a longer search.
#[test]
fn more_solves_buy_answers_that_cost_more() {
    let scene = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/fmu/scene.toml")).expect("the scene");
    for (most, answered) in [(1000, false), (4000, true)] {
        let mut sim = sim(&scene);
        sim.initialise().expect("rest");
        let port = crate::common::port(&sim, "solver.mostSolves");
        sim.set_i32(port, 0, &[most]).expect("a bound");
        set(&mut sim, "bone.rotation", 3, &[0.0, 0.0, 1.5]);
        let outcome = sim.step(0.1);
        assert_eq!(outcome.is_ok(), answered, "{most}: {outcome:?}");
        let given_up = |e: &SimError| matches!(e, SimError::Solve { source: SolveError::GivenUp { .. }, .. });
        assert!(answered || outcome.is_err_and(|e| given_up(&e)));
    }
}

#[test]
fn full_activation_is_answered_by_the_default_law() {
    let scene = format!(
        "{}[[muscle]]\nname = \"a\"\npath = [[0.0, 0.01, 0.01], [0.06, 0.01, 0.01]]\nradius = 0.02\n",
        block("")
    );
    let mut sim = sim(&scene);
    sim.initialise().expect("rest");
    set(&mut sim, "muscle.activation", 0, &[1.0]);
    let report = sim.step(0.02).expect("an answer");
    assert!(report.iterations < 150 && get(&sim, "quality.minDetF")[0] > 0.1, "{report:?}");
}

/// A ball that goes into a free corner is refused before its middle is inside the tissue.
#[test]
fn a_shape_does_not_come_to_lie_inside_tissue() {
    let scene = "[mesh.block]\nsize = [0.03, 0.03, 0.03]\ncells = [6, 6, 6]\n[[tissue]]\nenergy = \"neo-hookean\"\nE = 15e3\nnu = 0.45\n\
                 [[bone]]\nname = \"floor\"\nnodes = \"z_min\"\ndrive = \"held\"\n[[bone]]\nname = \"wall\"\nnodes = \"x_min\"\n\
                 within = [[-1, -1, 0.001], [1, 1, 1]]\ndrive = \"held\"\n[[bone]]\nname = \"finger\"\nnodes = \"none\"\n\
                 [[contact]]\nname = \"ball\"\nbone = \"finger\"\npath = [[0.040, 0.015, 0.040]]\nradius = 0.01\n";
    let mut sim = sim(scene);
    sim.initialise().expect("rest");
    let mut refused = None;
    for k in 1..=16 {
        let x = -0.002 * f64::from(k);
        set(&mut sim, "bone.translation", 6, &[x, 0.0, x]);
        match sim.step(1.0) {
            Ok(_) if k > 6 => assert!(get(&sim, "contact.depth")[0] > 0.0, "{k}: nothing is felt"),
            Ok(_) => {}
            Err(e) => {
                refused = Some(e);
                break;
            }
        }
    }
    let error = refused.expect("the ball cannot go all the way");
    let SimError::Solve { source, .. } = &error else { panic!("{error}") };
    let is_told = matches!(source, SolveError::Swallowed { .. } | SolveError::TooDeep { .. });
    assert!(is_told && error.to_string().contains("`ball`"), "{error}");
    set(&mut sim, "bone.translation", 6, &[0.0; 3]);
    sim.step(1.0).expect("drawn off");
    let n = sim.positions().len() - 4;
    let rest = &sim.model().mesh().nodes;
    assert!(largest((0..n).map(|a| (sim.positions()[a] - rest[a]).norm())) < 1e-6);
}

#[test]
fn a_loose_start_says_what_a_dynamic_scene_can_do() {
    let scene = "[mesh.block]\nsize = [0.06, 0.06, 0.02]\ncells = [6, 6, 2]\n[[tissue]]\nE = 15e3\nnu = 0.45\n[gravity]\n[inertia]\n";
    let error = sim(scene).initialise().expect_err("nothing holds it").to_string();
    assert!(error.contains("start = \"rest\"") && !error.contains("add [inertia]"), "{error}");
    sim(&format!("{scene}start = \"rest\"\n")).initialise().expect("rest");
}

/// A pose says nothing of whole turns: a large turn in one step ends where small steps end, and comes back.
#[test]
fn large_turns_in_one_step_go_the_way_of_small_ones() {
    let turned = |angles: &[f64]| {
        let mut sim = sim(&block(""));
        sim.initialise().expect("rest");
        for &angle in angles {
            set(&mut sim, "bone.rotation", 3, &[angle, 0.0, 0.0]);
            sim.step(1.0).expect("a turn");
        }
        (sim.positions().to_vec(), get(&sim, "energy.elastic")[0])
    };
    let slow: Vec<f64> = (1..=10).map(|k| 0.5 * f64::from(k)).collect();
    let ((x, E), (y, W)) = (turned(&[5.0]), turned(&slow));
    assert!(largest(x.iter().zip(&y).map(|(x, y)| (x - y).norm())) < 1e-6, "{E:.2e} J against {W:.2e} J");
    assert!(turned(&[5.0, 0.0]).1 < 1e-9);
}

/// Tissue that folded and finds no way back is at rest again once its inputs are.
#[test]
fn rest_has_an_answer_wherever_the_tissue_was() {
    let mut sim = sim(&block(STABLE).replace("[0.06, 0.02, 0.02]", "[0.05, 0.02, 0.015]"));
    sim.initialise().expect("rest");
    for x in [-0.03, -0.035, -0.02, 0.0] {
        set(&mut sim, "bone.translation", 3, &[x, 0.0, 0.0]);
        let answer = sim.step(1.0);
        assert!(x != 0.0 || answer.is_ok(), "{answer:?}");
    }
    assert!(off_rest(&sim) < 1e-6, "{:.1e} m off", off_rest(&sim));
}

/// Round-off that settles, and tissue that a shape lets go of, are no snaps.
#[test]
fn a_press_is_no_snap() {
    let scene = format!(
        "{}[[bone]]\nname = \"hand\"\nnodes = \"none\"\n[[contact]]\nname = \"ball\"\nbone = \"hand\"\npath = [[0.03, 0.01, 0.0305]]\nradius = 0.01\n",
        block("")
    );
    let mut sim = sim(&scene);
    sim.initialise().expect("rest");
    for z in [-0.006, 0.0, 0.004, -0.006, 0.0] {
        set(&mut sim, "bone.translation", 6, &[0.0, 0.0, z]);
        let report = sim.step(1.0).expect("a press");
        assert!(!says(&report, "snapped"), "{z}: {report:?}");
    }
}
