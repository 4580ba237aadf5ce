//! Stiffness that a host sets: a scene told so later is the scene that was written so.

use cutis::effect::LAWS;
use cutis::sim::Sim;

use crate::common::{get, largest, port, set, sim, tissue};

const BLOCK: &str = "[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [6, 4, 2]\n[[bone]]\nname = \"skull\"\nnodes = \"x_min\"\n\
    drive = \"held\"\n[[bone]]\nname = \"jaw\"\nnodes = \"x_max\"\n[solver]\ntolerance = 1e-10\n[[load]]\nname = \"push\"\n\
    at = [0.03, 0.02, 0.02]\nradius = 0.01\n";
const E0: f64 = 15e3;

/// What stands on a law, or beside it, and follows its stiffness.
const EXTRAS: [&str; 6] = [
    "",
    "pressure = \"nodal\"\n",
    "[tissue.grade]\ndepth = [0, 1]\nfactor = [1, 3]\n",
    "[tissue.damage]\nonset = 1e9\nscale = 100\n",
    "[tissue.limit]\nlongest = 1.04\nshortest = 0.9\n",
    "[tissue.viscous]\ng = [0.5]\ntau = [0.2]\n",
];
const OUT: [&str; 4] = ["skin.position", "bone.reactionForce", "bone.reactionTorque", "energy.elastic"];

fn drive(sim: &mut Sim) {
    set(sim, "bone.translation", 3, &[3e-3, 1e-3, 2e-3]);
    set(sim, "load.force", 0, &[0.0, 0.02, -0.1]);
    sim.step(0.1).expect("a step");
    sim.step(0.1).expect("a step");
}

/// Largest relative difference of what two simulations tell.
fn apart(a: &Sim, b: &Sim) -> f64 {
    let one = |name: &&str| {
        let (a, b) = (get(a, name), get(b, name));
        largest(a.iter().zip(&b).map(|(a, b)| a - b)) / largest(b).max(1e-12)
    };
    OUT.iter().map(one).fold(0.0, f64::max)
}

#[test]
fn a_tissue_set_to_another_stiffness_is_the_tissue_written_with_it() {
    for law in LAWS {
        for extra in EXTRAS {
            let soft = format!("{BLOCK}[[tissue]]\n{}{extra}", tissue(law, 0.5 * E0));
            let tunable = format!("{BLOCK}[[tissue]]\n{}tunable = \"flesh\"\n{extra}", tissue(law, E0));
            let (mut written, mut told) = (sim(&soft), sim(&tunable));
            let young = get(&told, "material.flesh.E")[0];
            set(&mut told, "material.flesh.E", 0, &[0.5 * young]);
            for sim in [&mut written, &mut told] {
                sim.initialise().expect("equilibrium");
                drive(sim);
            }
            let off = apart(&told, &written);
            assert!(off < 1e-6, "{} {extra}: {off:.1e} apart", law.name);
        }
    }
}

#[test]
fn a_stiffness_left_alone_changes_no_bit() {
    let scene = format!("{BLOCK}[[tissue]]\nE = {E0}\nnu = 0.4\n");
    let (mut plain, mut tunable) = (sim(&scene), sim(&scene.replace("[[tissue]]", "[[tissue]]\ntunable = \"flesh\"")));
    for sim in [&mut plain, &mut tunable] {
        sim.initialise().expect("equilibrium");
        drive(sim);
    }
    assert_eq!(get(&plain, "skin.position"), get(&tunable, "skin.position"));
    assert_eq!(get(&tunable, "material.flesh.E"), [E0]);
}

/// Softened on the way, in small and in large steps; through the solver and, for linear tissue, off the table.
#[test]
fn a_stiffness_that_changes_on_the_way_is_felt_at_the_next_step() {
    for law in ["linear", "stable-neo-hookean"] {
        for method in ["quasi-newton", "newton"] {
            let scene = format!("{BLOCK}[[tissue]]\nenergy = \"{law}\"\nE = {E0}\nnu = 0.4\ntunable = \"flesh\"\n")
                .replace("[solver]\n", &format!("[solver]\nmethod = \"{method}\"\n"));
            let mut told = sim(&scene);
            told.initialise().expect("equilibrium");
            drive(&mut told);
            for E in [0.97 * E0, 0.95 * E0, 0.5 * E0, 4.0 * E0, 3.0 * E0] {
                set(&mut told, "material.flesh.E", 0, &[E]);
                let report = told.step(0.1).expect("a softer step");
                let mut fresh = sim(&scene);
                set(&mut fresh, "material.flesh.E", 0, &[E]);
                fresh.initialise().expect("equilibrium");
                drive(&mut fresh);
                let off = apart(&told, &fresh);
                assert!(off < 1e-6, "{law}, {method}: {off:.1e} apart at E = {E}, {report:?}");
            }
        }
    }
}

#[test]
fn a_snapshot_holds_the_stiffness() {
    let scene = format!("{BLOCK}[[tissue]]\nE = {E0}\nnu = 0.4\ntunable = \"flesh\"\n");
    let mut sim = sim(&scene);
    sim.initialise().expect("equilibrium");
    set(&mut sim, "material.flesh.E", 0, &[0.6 * E0]);
    drive(&mut sim);
    let state = sim.save();
    let bytes = state.to_bytes(sim.model());
    set(&mut sim, "material.flesh.E", 0, &[2.0 * E0]);
    set(&mut sim, "bone.translation", 3, &[1e-3, 0.0, 0.0]);
    sim.step(0.1).expect("a step");
    let read = cutis::sim::State::from_bytes(&bytes, sim.model()).expect("its own bytes");
    for state in [state, read] {
        sim.restore(&state).expect("its own state");
        assert_eq!(get(&sim, "material.flesh.E"), [0.6 * E0]);
        set(&mut sim, "bone.translation", 3, &[1e-3, 0.0, 0.0]);
        sim.step(0.1).expect("a step");
        let mut fresh = crate::common::sim(&scene);
        fresh.restore(&state).expect("its own state");
        set(&mut fresh, "bone.translation", 3, &[1e-3, 0.0, 0.0]);
        fresh.step(0.1).expect("a step");
        assert_eq!(get(&sim, "skin.position"), get(&fresh, "skin.position"));
    }
    sim.reset();
    assert_eq!(get(&sim, "material.flesh.E"), [E0]);
}

#[test]
fn what_cannot_be_tuned_says_why() {
    let of = |tissues: &str| cutis::load::from_text(&format!("{BLOCK}{tissues}"), None);
    let why = |tissues: &str| of(tissues).err().expect("refused").to_string();
    let one = "[[tissue]]\nE = 1e4\nnu = 0.4\n";
    assert!(why(&format!("{one}tunable = \"a b\"\n")).contains("no name"));
    assert!(why(&format!("{one}tunable = \"a\"\n{one}tunable = \"a\"\n")).contains("two"));
    assert!(why("[[tissue]]\nenergy = \"mass-spring\"\nE = 1e4\ntunable = \"a\"\n").contains("continuum"));
    let many: String = (0..20).map(|k| format!("{one}tunable = \"t{k}\"\n")).collect();
    assert!(why(&many).contains("19"));
    let mut sim = sim(&format!("{BLOCK}{one}tunable = \"flesh\"\n"));
    set(&mut sim, "material.flesh.E", 0, &[0.0]);
    assert!(sim.initialise().unwrap_err().to_string().contains("must be positive"));
    assert_eq!(sim.model().ports()[port(&sim, "material.flesh.E")].min, Some(10.0));
}
