//! Conjugate gradients give what the factor gives, and hold no factor.

use crate::common::{get, largest, set, sim};

/// A block between two bones.
fn scene(mesh: &str, tissue: &str, more: &str, linear: &str) -> String {
    format!(
        "[mesh]\n{mesh}[mesh.block]\nsize = [0.06, 0.04, 0.03]\ncells = [6, 4, 3]\n[[tissue]]\n{tissue}\n\
         [[bone]]\nname = \"skull\"\nnodes = \"x_min\"\ndrive = \"held\"\n[[bone]]\nname = \"jaw\"\nnodes = \"x_max\"\n{more}\
         [solver]\ntolerance = 1e-9\nlinear = \"{linear}\"\n"
    )
}

const NEO: &str = "energy = \"neo-hookean\"\nE = 15e3\nnu = 0.45\n";

#[test]
fn both_solvers_find_the_same_equilibria() {
    let cases = [
        (
            "order = 1\n",
            NEO,
            "[[load]]\nname = \"push\"\nat = [0.03, 0.02, 0.03]\nradius = 0.01\nforce = [0, 0, -0.3]\n",
        ),
        ("order = 2\n", NEO, ""),
        ("order = 1\n", "energy = \"corotational\"\nE = 15e3\nnu = 0.49\npressure = \"nodal\"\n", ""),
        ("order = 1\n", "energy = \"linear\"\nE = 15e3\nnu = 0.45\n", "[gravity]\n"),
        ("order = 1\n", NEO, "[gravity]\n[inertia]\nscheme = \"bdf2\"\nstart = \"rest\"\n"),
    ];
    for (mesh, tissue, more) in cases {
        let [mut direct, mut iterative] = ["direct", "iterative"].map(|l| sim(&scene(mesh, tissue, more, l)));
        assert!(direct.factor_len() > 0 && iterative.factor_len() == 0);
        for sim in [&mut direct, &mut iterative] {
            sim.initialise().expect("a start");
            for k in 1..=3 {
                set(sim, "bone.translation", 3, &[-1e-3 * f64::from(k), 0.0, 2e-3 * f64::from(k)]);
                set(sim, "bone.rotation", 3, &[0.1 * f64::from(k), 0.0, 0.0]);
                assert!(sim.step(0.02).expect("a step").converged);
            }
        }
        for (name, tolerance) in [("skin.position", 1e-8), ("bone.reactionForce", 1e-5)] {
            let off = largest(get(&direct, name).iter().zip(get(&iterative, name)).map(|(a, b)| a - b));
            assert!(off < tolerance, "{name} is off by {off:.1e}: {mesh}{tissue}{more}");
        }
    }
}

#[test]
fn a_bone_that_forces_drive_is_found_by_iteration_too() {
    let force = "drive = \"force\"\nforce = [0.3, 0.0, -0.2]\ntorque = [0.002, 0.001, 0.0]\n";
    let [direct, iterative] = ["direct", "iterative"].map(|l| {
        let mut sim = sim(&scene("", NEO, force, l));
        sim.initialise().expect("an equilibrium");
        get(&sim, "bone.poseTranslation")
    });
    assert!(largest(direct.iter().zip(&iterative).map(|(a, b)| a - b)) < 1e-8);
    assert!(largest(direct.iter().copied()) > 1e-4, "the bone moves");
}

#[test]
fn derivatives_do_not_need_a_factor() {
    let [mut direct, mut iterative] = ["direct", "iterative"].map(|l| sim(&scene("", NEO, "", l)));
    let answer = |sim: &mut cutis::sim::Sim| {
        sim.initialise().expect("a start");
        set(sim, "bone.translation", 3, &[2e-3, 0.0, 1e-3]);
        sim.step(0.1).expect("a step");
        let (pose, skin) = (crate::common::port(sim, "bone.translation"), crate::common::port(sim, "skin.position"));
        let mut out = vec![0.0; sim.model().ports()[skin].len()];
        sim.directional_derivative(&[pose], &[0.0, 0.0, 0.0, 1.0, 0.5, -1.0], &[skin], &mut out).expect("a derivative");
        out
    };
    let (a, b) = (answer(&mut direct), answer(&mut iterative));
    assert!(largest(a.iter().zip(&b).map(|(a, b)| a - b)) < 1e-6);
}

/// Stiffnesses a million times apart: a solve by iteration that stops early must not pass for the answer.
#[test]
fn converged_means_the_same_with_either_solver() {
    let scene = |linear: &str| {
        format!(
            "[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [6, 4, 4]\nlayers = [[\"hard\", 0.34]]\n[[tissue]]\nregions = [\"hard\"]\nE = 1e9\nnu = 0.45\n\
             [[tissue]]\nE = 1e3\nnu = 0.45\n[[bone]]\nname = \"skull\"\nnodes = \"x_min\"\ndrive = \"held\"\n[[load]]\nname = \"push\"\nat = [0.05, 0.02, 0.02]\n\
             radius = 0.01\nforce = [0, 0.05, -0.05]\n[solver]\nlinear = \"{linear}\"\n"
        )
    };
    let skin = |linear: &str| {
        let mut sim = crate::common::sim(&scene(linear));
        sim.initialise().expect("an equilibrium");
        crate::common::get(&sim, "skin.position")
    };
    let (direct, iterative) = (skin("direct"), skin("iterative"));
    let off = crate::common::largest(direct.iter().zip(&iterative).map(|(a, b)| a - b));
    assert!(off < 1e-6, "{off:.1e} m apart");
}
