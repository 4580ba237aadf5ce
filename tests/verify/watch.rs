//! Steps that are watched piece by piece, and steps on which nothing acts.

use cutis::sim::View;

use crate::common::{get, port, set, sim};

const BLOCK: &str = "[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [6, 4, 2]\n[[tissue]]\nE = 15e3\nnu = 0.4\n[[bone]]\n\
    name = \"skull\"\nnodes = \"x_min\"\ndrive = \"held\"\n[[bone]]\nname = \"jaw\"\nnodes = \"x_max\"\n[[marker]]\nname = \"mid\"\n\
    at = [0.03, 0.02, 0.02]\n";

#[test]
fn every_piece_is_seen_once_and_watching_changes_no_bit() {
    let scene = format!("{BLOCK}[inertia]\naccuracy = 2e-6\n");
    let (mut watched, mut alone) = (sim(&scene), sim(&scene));
    let marker = port(&watched, "marker.position");
    for sim in [&mut watched, &mut alone] {
        sim.initialise().expect("equilibrium");
        set(sim, "bone.translation", 3, &[2e-3, 0.0, 1e-3]);
    }
    let (mut times, mut places, mut stretch) = (Vec::new(), Vec::new(), Vec::new());
    let report = watched
        .step_watched(0.1, &mut |view: &View| {
            let mut x = [0.0; 3];
            view.get_f64(marker, 0, &mut x).expect("a marker");
            let mut s = [0.0];
            let most = view.model().ports().iter().position(|p| p.name == "quality.maxStretch").expect("a port");
            view.get_f64(most, 0, &mut s).expect("a stretch");
            times.push(view.time());
            places.push(x.to_vec());
            stretch.push(s[0]);
        })
        .expect("a step");
    alone.step(0.1).expect("a step");
    assert!(report.substeps > 2 && times.len() == report.substeps as usize, "{report:?}, {times:?}");
    assert!(times.windows(2).all(|t| t[0] < t[1]) && times[times.len() - 1] == 0.1, "{times:?}");
    assert!(places.windows(2).all(|x| x[0] != x[1]) && stretch.iter().all(|s| *s > 1.0));
    assert_eq!(places[places.len() - 1], get(&watched, "marker.position"));
    assert_eq!(watched.save(), alone.save());
}

#[test]
fn pieces_before_one_that_fails_are_taken_back() {
    let mut sim = sim(&format!("{BLOCK}[solver]\nmax_iterations = 4\n"));
    sim.initialise().expect("equilibrium");
    set(&mut sim, "bone.translation", 3, &[-0.05, 0.0, 0.0]);
    let before = sim.save();
    let mut seen = 0;
    sim.step_watched(0.1, &mut |_| seen += 1).expect_err("too much for four iterations");
    assert_eq!(sim.save(), before, "{seen} pieces were seen");
}

#[test]
fn nothing_moves_while_nothing_acts() {
    let mut sim = sim(BLOCK);
    sim.initialise().expect("equilibrium");
    set(&mut sim, "bone.translation", 3, &[2e-3, 0.0, 1e-3]);
    let moved = sim.step(0.1).expect("a step");
    let (x, strain) = (get(&sim, "skin.position"), get(&sim, "energy.elastic"));
    let held = sim.step(0.1).expect("a step");
    assert!(moved.iterations > 0 && held.iterations == 0 && held.converged, "{moved:?}, {held:?}");
    assert_eq!(held.residual, moved.residual);
    assert_eq!(
        (get(&sim, "skin.position"), get(&sim, "energy.elastic"), get(&sim, "time")),
        (x.clone(), strain, vec![0.2])
    );
    // What is put elsewhere by hand seeks its equilibrium again.
    let far: Vec<_> = sim.positions().iter().map(|x| x + cutis::math::Vec3::new(0.0, 0.0, 1e-4)).collect();
    sim.start_from(&far).expect("finite places");
    assert!(sim.step(0.1).expect("back").iterations > 0);
    let off = get(&sim, "skin.position").iter().zip(&x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-6, "{off:e}");
    // With inertia time does act.
    let mut heavy = crate::common::sim(&format!("{BLOCK}[inertia]\n"));
    heavy.initialise().expect("equilibrium");
    set(&mut heavy, "bone.translation", 3, &[2e-3, 0.0, 1e-3]);
    heavy.step(0.01).expect("a step");
    assert!(heavy.step(0.01).expect("a step").iterations > 0);
}
