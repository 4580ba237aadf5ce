//! Directional derivatives against differences of whole equilibria, and their linearity.

use cutis::sim::Sim;

use crate::common::{get, port, set, sim};

const SCENE: &str = "[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [6, 4, 2]\n[[tissue]]\nE = 15e3\nnu = 0.4\n[tissue.fibre]\n\
    direction = [1, 1, 0]\nk1 = 5e3\nk2 = 1.0\n[[bone]]\nname = \"skull\"\nnodes = \"x_min\"\ndrive = \"held\"\n[[bone]]\n\
    name = \"jaw\"\nnodes = \"x_max\"\nDRIVE[[muscle]]\nname = \"m\"\npath = [[0, 0.02, 0.01], [0.06, 0.02, 0.01]]\nradius = 0.008\n\
    [[load]]\nname = \"push\"\nat = [0.03, 0.02, 0.02]\nradius = 0.01\n[[pressure]]\nname = \"air\"\n[gravity]\n[[marker]]\n\
    name = \"mid\"\nat = [0.03, 0.02, 0.02]\n[solver]\nmethod = \"newton\"\ntolerance = 1e-12\n";

const OUT: [&str; 4] = ["skin.position", "marker.position", "bone.reactionForce", "bone.reactionTorque"];

fn derivative(sim: &mut Sim, input: &str, seed: &[f64]) -> Vec<Vec<f64>> {
    let known = port(sim, input);
    let outputs = OUT.map(|name| port(sim, name));
    let n: Vec<usize> = outputs.iter().map(|&p| sim.model().ports()[p].len()).collect();
    let mut all = vec![0.0; n.iter().sum()];
    sim.directional_derivative(&[known], seed, &outputs, &mut all).expect("a derivative");
    let mut rest = &all[..];
    n.iter()
        .map(|&n| {
            let (now, later) = rest.split_at(n);
            rest = later;
            now.to_vec()
        })
        .collect()
}

fn compare(drive: &str, cases: &[(&str, Vec<f64>)], settle: impl Fn(&mut Sim)) {
    let mut sim = sim(&SCENE.replace("DRIVE", drive));
    settle(&mut sim);
    sim.step(1.0).expect("a bent state");
    let state = sim.save();
    for (input, seed) in cases {
        let analytic = derivative(&mut sim, input, seed);
        let twice = derivative(&mut sim, input, &seed.iter().map(|s| -2.0 * s).collect::<Vec<_>>());
        let start = get(&sim, input);
        let h = 2e-6 / seed.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
        let [plus, minus] = [h, -h].map(|h| {
            sim.restore(&state).expect("its own state");
            let moved: Vec<f64> = start.iter().zip(seed).map(|(v, s)| v + h * s).collect();
            set(&mut sim, input, 0, &moved);
            sim.step(1.0).expect("nearby");
            OUT.map(|name| get(&sim, name))
        });
        sim.restore(&state).expect("its own state");
        for (k, name) in OUT.iter().enumerate() {
            let scale = analytic[k].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            if scale < 1e-9 {
                continue; // what holds a driven bone does not change
            }
            for (i, a) in analytic[k].iter().enumerate() {
                let difference = (plus[k][i] - minus[k][i]) / (2.0 * h);
                assert!(
                    (a - difference).abs() < 1e-4 * scale,
                    "d {name}[{i}] / d {input}: {a:.6e}, difference {difference:.6e}"
                );
                assert!((twice[k][i] + 2.0 * a).abs() < 1e-6 * scale, "d {name}[{i}] / d {input} is not linear");
            }
        }
    }
    assert_eq!(sim.save(), state, "asking changes nothing");
}

#[test]
fn derivatives_meet_differences_of_equilibria() {
    compare(
        "",
        &[
            ("bone.translation", vec![0.0, 0.0, 0.0, 0.3, -0.5, 1.0]),
            ("bone.rotation", vec![0.0, 0.0, 0.0, 1.0, -0.4, 0.2]),
            ("load.force", vec![0.2, 0.1, -1.0]),
            ("muscle.activation", vec![1.0]),
            ("load.pressure", vec![1000.0]),
            ("gravity", vec![1.0, 2.0, 3.0]),
        ],
        |sim| {
            set(sim, "bone.translation", 3, &[0.003, 0.001, 0.002]);
            set(sim, "bone.rotation", 3, &[0.2, -0.1, 0.3]);
            set(sim, "load.force", 0, &[0.0, 0.02, -0.1]);
            set(sim, "load.pressure", 0, &[150.0]);
            set(sim, "muscle.activation", 0, &[0.02]);
        },
    );
}

#[test]
fn derivatives_by_the_forces_on_a_bone_meet_differences_too() {
    compare(
        "drive = \"force\"\n",
        &[("bone.force", vec![0.0, 0.0, 0.0, 0.1, 1.0, -0.3]), ("bone.torque", vec![0.0, 0.0, 0.0, 0.01, 0.02, -0.01])],
        |sim| {
            set(sim, "bone.force", 3, &[0.1, 0.02, -0.05]);
            set(sim, "bone.torque", 3, &[1e-4, 5e-4, -2e-4]);
        },
    );
}

#[test]
fn what_has_no_derivative_says_why() {
    let mut sim = sim(&SCENE.replace("DRIVE", ""));
    let (known, unknown) = (port(&sim, "gravity"), port(&sim, "marker.position"));
    let mut out = [0.0; 3];
    let mut ask = |sim: &mut Sim, known: usize, seed: &[f64], unknown: usize| {
        sim.directional_derivative(&[known], seed, &[unknown], &mut out).unwrap_err().to_string()
    };
    assert!(ask(&mut sim, known, &[1.0, 0.0, 0.0], unknown).contains("no equilibrium yet"));
    sim.initialise().expect("equilibrium");
    assert!(ask(&mut sim, known, &[1.0, 0.0], unknown).contains("seed"));
    assert!(ask(&mut sim, unknown, &[1.0, 0.0, 0.0], unknown).contains("an input"));
    let residual = port(&sim, "energy.elastic");
    let message = ask(&mut sim, known, &[1.0, 0.0, 0.0], residual);
    assert!(message.contains("has derivatives"), "{message}");
    assert!(ask(&mut sim, known, &[f64::NAN, 0.0, 0.0], unknown).contains("not finite"));
    let mut dynamic = crate::common::sim(&format!("{}[inertia]\n", SCENE.replace("DRIVE", "")));
    dynamic.initialise().expect("equilibrium");
    assert!(ask(&mut dynamic, known, &[1.0, 0.0, 0.0], unknown).contains("depends on the way"));
}
