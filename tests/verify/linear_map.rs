//! Scenes that are linear in their inputs: the table gives what the solver gives.

use cutis::sim::Sim;

use crate::common::{get, largest, set, sim};

const SCENE: &str = "[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [6, 4, 2]\n[[tissue]]\nenergy = \"linear\"\nE = 15e3\n\
    nu = 0.45\ndensity = 1000\n[[bone]]\nname = \"skull\"\nnodes = \"x_min\"\ndrive = \"held\"\n[[bone]]\nname = \"jaw\"\n\
    nodes = \"x_max\"\nDRIVE[[load]]\nname = \"push\"\nat = [0.03, 0.02, 0.02]\nradius = 0.01\n[gravity]\n[[marker]]\n\
    name = \"mid\"\nat = [0.03, 0.02, 0.02]\n[solver]\ntolerance = 1e-12\n";
/// Scenes with muscles go through the solver, be they at rest.
const MUSCLE: &str = "[[muscle]]\nname = \"m\"\npath = [[0, 0.02, 0.01], [0.06, 0.02, 0.01]]\nradius = 0.008\n";
const OUT: [(&str, f64); 7] = [
    ("skin.position", 1e-12),
    ("marker.position", 1e-12),
    ("bone.reactionForce", 1e-10),
    ("bone.reactionTorque", 1e-11),
    ("energy.elastic", 1e-11),
    ("quality.minDetF", 1e-10),
    ("quality.maxStretch", 1e-10),
];

fn same(table: &Sim, solver: &Sim) {
    for (name, tolerance) in OUT {
        let (a, b) = (get(table, name), get(solver, name));
        let error = largest(a.iter().zip(&b).map(|(a, b)| a - b));
        assert!(error <= tolerance, "{name} is off by {error:.1e}");
    }
    let apart = table.positions().iter().zip(solver.positions()).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(apart <= 1e-12, "nodes are {apart:.1e} m apart");
}

#[test]
fn the_table_gives_what_the_solver_gives() {
    let posed: &[(&str, usize, &[f64])] = &[
        ("bone.translation", 3, &[2e-3, -1e-3, 3e-3]),
        ("bone.rotation", 3, &[0.1, 0.3, -0.2]),
        ("load.force", 0, &[0.05, -0.02, 0.1]),
        ("gravity", 0, &[0.0, 9.81, 1.0]),
        ("bone.pivot", 3, &[0.05, 0.01, 0.03]),
        ("bone.rotation", 3, &[-0.2, 0.1, 0.3]),
    ];
    let by_node: &[(&str, usize, &[f64])] =
        &[("bone.jaw.displacement", 6, &[1e-3, 2e-3, -1e-3, 4e-4]), ("load.force", 0, &[0.05, -0.02, 0.1])];
    for (drive, path) in [("", posed), ("drive = \"displacement\"\n", by_node)] {
        let mut table = sim(&SCENE.replace("DRIVE", drive));
        let mut solver = sim(&format!("{}{MUSCLE}", SCENE.replace("DRIVE", drive)));
        table.initialise().expect("a table");
        solver.initialise().expect("an equilibrium");
        same(&table, &solver);
        for (port, first, values) in path {
            for sim in [&mut table, &mut solver] {
                set(sim, port, *first, values);
            }
            let report = table.step(0.1).expect("a table");
            assert_eq!(report.iterations == 0, *port != "bone.pivot", "{port}: {report:?}");
            assert!(report.residual < 1e-10 && solver.step(0.1).expect("a step").iterations > 0);
            same(&table, &solver);
        }
    }
}

#[test]
fn a_snapshot_of_a_table_holds_every_node_and_repeats_its_bits() {
    let mut sim = sim(&SCENE.replace("DRIVE", ""));
    sim.initialise().expect("a table");
    set(&mut sim, "bone.rotation", 3, &[0.1, 0.3, -0.2]);
    sim.step(0.1).expect("a step");
    let (state, before) = (sim.save(), sim.positions().to_vec());
    set(&mut sim, "bone.rotation", 3, &[-0.2, 0.0, 0.1]);
    sim.step(0.1).expect("a step");
    let after = sim.save();
    let bytes = state.to_bytes(sim.model());
    let read = cutis::sim::State::from_bytes(&bytes, sim.model()).expect("its own bytes");
    for state in [&state, &read] {
        sim.restore(state).expect("its own state");
        assert_eq!(sim.positions(), before);
        set(&mut sim, "bone.rotation", 3, &[-0.2, 0.0, 0.1]);
        sim.step(0.1).expect("a step");
        assert_eq!(sim.save(), after);
    }
}

#[test]
fn inputs_beyond_the_table_go_to_the_solver() {
    let mut sim = sim(&SCENE.replace("DRIVE", "").replace("1e-12", "1e-7"));
    sim.initialise().expect("a table");
    set(&mut sim, "load.force", 0, &[1e12, 0.0, 0.0]);
    let bytes = sim.save().to_bytes(sim.model());
    if let Err(e) = sim.step(0.1) {
        assert_eq!(bytes, sim.save().to_bytes(sim.model()), "{e}");
    }
    set(&mut sim, "load.force", 0, &[0.0; 3]);
    assert!(sim.step(0.1).expect("back").residual < 1e-6);
}
