//! Directional derivatives against differences of whole steps, and their linearity.

use cutis::port::Type;
use cutis::sim::Sim;

use crate::common::{Random, get, port, set, sim};

const SCENE: &str = "[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [6, 4, 2]\n[[tissue]]\nE = 15e3\nnu = 0.4\n[tissue.fibre]\n\
    direction = [1, 1, 0]\nk1 = 5e3\nk2 = 1.0\n[[bone]]\nname = \"skull\"\nnodes = \"x_min\"\ndrive = \"held\"\n[[bone]]\n\
    name = \"jaw\"\nnodes = \"x_max\"\nDRIVE[[muscle]]\nname = \"m\"\npath = [[0, 0.02, 0.01], [0.06, 0.02, 0.01]]\nradius = 0.008\n\
    [[load]]\nname = \"push\"\nat = [0.03, 0.02, 0.02]\nradius = 0.01\n[[pressure]]\nname = \"air\"\n[gravity]\n[[marker]]\n\
    name = \"mid\"\nat = [0.03, 0.02, 0.02]\n[solver]\nmethod = \"newton\"\ntolerance = 1e-12\n";

const OUT: [&str; 11] = [
    "skin.position",
    "skin.velocity",
    "marker.position",
    "bone.reactionForce",
    "bone.reactionTorque",
    "bone.poseTranslation",
    "bone.poseRotation",
    "contact.force",
    "contact.depth",
    "energy.elastic",
    "energy.kinetic",
];

/// Tissue that remembers, on the keys of `[[tissue]]`.
const MEMORY: &str = "[[tissue]]\nviscous = { g = [0.4], tau = [0.05] }\ndamage = { onset = 20.0, scale = 200.0 }";

/// Those of the outputs that the model has.
fn outputs(sim: &Sim) -> Vec<&'static str> {
    OUT.into_iter().filter(|name| sim.model().ports().iter().any(|p| p.name == *name)).collect()
}

fn derivative(sim: &mut Sim, input: &str, seed: &[f64]) -> Vec<Vec<f64>> {
    let known = port(sim, input);
    let outputs: Vec<usize> = outputs(sim).iter().map(|name| port(sim, name)).collect();
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

/// A step of `dt` after `settle` has led up to it and set its inputs.
fn compare(scene: &str, dt: f64, cases: &[(&str, Vec<f64>)], settle: impl Fn(&mut Sim)) {
    compare_but_for(1.0, scene, dt, cases, settle);
}

/// The same with all derivatives off by a factor.
fn compare_but_for(planted: f64, scene: &str, dt: f64, cases: &[(&str, Vec<f64>)], settle: impl Fn(&mut Sim)) {
    let mut sim = sim(scene);
    settle(&mut sim);
    let before = sim.save();
    let names = outputs(&sim);
    for (input, seed) in cases {
        sim.restore(&before).expect("its own state");
        sim.step(dt).expect("a bent state");
        let state = sim.save();
        let analytic = derivative(&mut sim, input, seed);
        let twice = derivative(&mut sim, input, &seed.iter().map(|s| -2.0 * s).collect::<Vec<_>>());
        assert_eq!(sim.save(), state, "asking changes nothing");
        let start = get(&sim, input);
        let h = 2e-6 / seed.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
        let [plus, minus] = [h, -h].map(|h| {
            sim.restore(&before).expect("its own state");
            let moved: Vec<f64> = start.iter().zip(seed).map(|(v, s)| v + h * s).collect();
            set(&mut sim, input, 0, &moved);
            let report = sim.step(dt).expect("nearby");
            assert_eq!(report.substeps, 1, "the derivative is that of a whole step");
            names.iter().map(|name| get(&sim, name)).collect::<Vec<_>>()
        });
        for (k, name) in names.iter().enumerate() {
            let scale = analytic[k].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            if scale < 1e-8 {
                continue; // what holds a driven bone does not change
            }
            for (i, a) in analytic[k].iter().enumerate() {
                let difference = (plus[k][i] - minus[k][i]) / (2.0 * h);
                assert!(
                    (planted * a - difference).abs() < 1e-4 * scale,
                    "d {name}[{i}] / d {input}: {a:.6e}, difference {difference:.6e}"
                );
                assert!((twice[k][i] + 2.0 * a).abs() < 1e-6 * scale, "d {name}[{i}] / d {input} is not linear");
            }
        }
    }
}

#[test]
fn derivatives_meet_differences_of_equilibria() {
    compare(
        &SCENE.replace("DRIVE", ""),
        1.0,
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
        &SCENE.replace("DRIVE", "drive = \"force\"\n"),
        1.0,
        &[("bone.force", vec![0.0, 0.0, 0.0, 0.1, 1.0, -0.3]), ("bone.torque", vec![0.0, 0.0, 0.0, 0.01, 0.02, -0.01])],
        |sim| {
            set(sim, "bone.force", 3, &[0.1, 0.02, -0.05]);
            set(sim, "bone.torque", 3, &[1e-4, 5e-4, -2e-4]);
        },
    );
}

/// A ball presses into a pad, with friction and without; it touches before the step and after.
#[test]
fn derivatives_of_contacts_meet_differences() {
    for friction in ["", "friction = 0.3\n"] {
        let scene = format!(
            "[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [6, 4, 2]\n[[tissue]]\nE = 15e3\nnu = 0.4\n[[bone]]\n\
             name = \"skull\"\nnodes = \"z_min\"\ndrive = \"held\"\n[[bone]]\nname = \"ball\"\nnodes = \"none\"\n\
             [[contact]]\nname = \"tip\"\nbone = \"ball\"\npath = [[0.031, 0.019, 0.0301]]\nradius = 0.01\n\
             stiffness = 1e7\n{friction}[solver]\nmethod = \"newton\"\ntolerance = 1e-12\n"
        );
        let press = |sim: &mut Sim| {
            sim.initialise().expect("a start");
            set(sim, "bone.translation", 3, &[0.0, 0.0, -0.002]);
            sim.step(1.0).expect("a touch");
            set(sim, "bone.translation", 3, &[0.0003, 0.0002, -0.0024]);
        };
        compare(&scene, 1.0, &[("bone.translation", vec![0.0, 0.0, 0.0, 0.2, 0.1, -1.0])], press);
        // The pressure has kinks in its slope, which a difference steps over.
        transposes_to(1e-4, 1.0, 1.0, &scene, |sim| {
            press(sim);
            sim.step(1.0).expect("a touch");
            set(sim, "bone.translation", 3, &[0.0004, 0.0002, -0.0025]);
        });
    }
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
    let residual = port(&sim, "solver.residual");
    let message =
        sim.directional_derivative(&[known], &[1.0, 0.0, 0.0], &[residual], &mut [0.0]).unwrap_err().to_string();
    assert!(message.contains("solver.residual"), "{message}");
    assert!(ask(&mut sim, known, &[f64::NAN, 0.0, 0.0], unknown).contains("not finite"));
    let mut dynamic = crate::common::sim(&format!("{}[inertia]\n", SCENE.replace("DRIVE", "")));
    let (known, unknown) = (port(&dynamic, "gravity"), port(&dynamic, "marker.position"));
    dynamic.initialise().expect("equilibrium");
    set(&mut dynamic, "gravity", 0, &[1.0, 0.0, 0.0]);
    dynamic.step(0.01).expect("a step");
    dynamic.directional_derivative(&[known], &[1.0, 0.0, 0.0], &[unknown], &mut [0.0; 3]).expect("of that step");
    let x = dynamic.positions().to_vec();
    dynamic.start_from(&x).expect("a start");
    assert!(ask(&mut dynamic, known, &[1.0, 0.0, 0.0], unknown).contains("not known any more"));
}

/// Leads up to a step of 20 ms in the middle of a motion.
fn swing(sim: &mut Sim) {
    sim.initialise().expect("equilibrium");
    for k in 1..4 {
        let s = f64::from(k) / 4.0;
        set(sim, "bone.translation", 3, &[0.003 * s, 0.001 * s, 0.002 * s]);
        set(sim, "load.force", 0, &[0.0, 0.02 * s, -0.1 * s]);
        sim.step(0.015).expect("a step");
    }
    bend(sim);
}

#[test]
fn derivatives_of_steps_in_time_meet_differences() {
    let cases = [
        ("bone.translation", vec![0.0, 0.0, 0.0, 0.3, -0.5, 1.0]),
        ("bone.rotation", vec![0.0, 0.0, 0.0, 1.0, -0.4, 0.2]),
        ("load.force", vec![0.2, 0.1, -1.0]),
        ("load.pressure", vec![1000.0]),
        ("muscle.activation", vec![1.0]),
        ("gravity", vec![1.0, 2.0, 3.0]),
    ];
    let plain = SCENE.replace("DRIVE", "");
    let remembers = plain.replace("[[tissue]]", MEMORY);
    compare(&remembers, 0.02, &cases, swing);
    for scheme in ["backward-euler", "bdf2", "generalised-alpha"] {
        let inertia = format!("[inertia]\nscheme = \"{scheme}\"\ndamping_mass = 3.0\ndamping_stiffness = 0.004\n");
        compare(&format!("{plain}{inertia}"), 0.02, &cases, swing);
        compare(&format!("{remembers}{inertia}"), 0.02, &cases, swing);
    }
}

#[test]
fn derivatives_of_steps_in_time_by_the_forces_on_a_bone_meet_differences() {
    let scene = SCENE.replace("DRIVE", "drive = \"force\"\n") + "[inertia]\nscheme = \"bdf2\"\n";
    let cases =
        [("bone.force", vec![0.0, 0.0, 0.0, 0.1, 1.0, -0.3]), ("bone.torque", vec![0.0, 0.0, 0.0, 0.01, 0.02, -0.01])];
    let push = |sim: &mut Sim| {
        sim.initialise().expect("equilibrium");
        set(sim, "bone.force", 3, &[0.1, 0.02, -0.05]);
        sim.step(0.02).expect("a step");
        set(sim, "bone.torque", 3, &[1e-4, 5e-4, -2e-4]);
    };
    compare(&scene, 0.01, &cases, push);
}

#[test]
#[should_panic(expected = "difference")]
fn planted_wrong_derivative_of_a_step_in_time_is_found() {
    let scene = SCENE.replace("DRIVE", "") + "[inertia]\n";
    compare_but_for(1.001, &scene, 0.02, &[("gravity", vec![1.0, 2.0, 3.0])], swing);
}

/// `<w, J v> = <J^T w, v>` for every output weighted and every input moved at once, and for each input alone.
fn transposes(scene: &str, settle: impl Fn(&mut Sim)) {
    transposes_of_step(1.0, scene, settle);
}

/// The same in a step of `dt`.
fn transposes_of_step(dt: f64, scene: &str, settle: impl Fn(&mut Sim)) {
    transposes_but_for(1.0, dt, scene, settle);
}

/// The same with all adjoints off by a factor.
fn transposes_but_for(planted: f64, dt: f64, scene: &str, settle: impl Fn(&mut Sim)) {
    transposes_to(3e-7, planted, dt, scene, settle);
}

/// The same to this part of the product.
fn transposes_to(close: f64, planted: f64, dt: f64, scene: &str, settle: impl Fn(&mut Sim)) {
    // A ball that turns about its middle moves nothing but round-off.
    const NOISE: f64 = 1e-11;
    let mut sim = sim(scene);
    sim.initialise().expect("equilibrium");
    settle(&mut sim);
    sim.step(dt).expect("a bent state");
    let state = sim.save();
    let mut random = Random(11);
    let ports = sim.model().ports();
    let known: Vec<usize> =
        (0..ports.len()).filter(|&k| ports[k].is_settable() && ports[k].ty == Type::Float64).collect();
    let unknown: Vec<usize> = (0..ports.len()).filter(|&k| OUT.contains(&&*ports[k].name)).collect();
    let len = |ports: &[usize]| -> Vec<usize> { ports.iter().map(|&k| sim.model().ports()[k].len()).collect() };
    let (n_known, n_unknown) = (len(&known), len(&unknown));
    let names: Vec<String> = known.iter().map(|&k| sim.model().ports()[k].name.clone()).collect();
    // A seed of about the size that each input has in life.
    let unit = |name: &str| match name {
        "load.pressure" => 1e3,
        "bone.torque" => 1e-3,
        name if name.contains("force") || name == "gravity" || name == "muscle.activation" => 1.0,
        name if name.starts_with("material") => 1e4,
        _ => 1e-2,
    };
    let mut cases: Vec<Vec<usize>> = (0..known.len()).map(|k| vec![k]).collect();
    cases.push((0..known.len()).collect());
    for case in cases {
        let mut v = Vec::new();
        let knowns: Vec<usize> = case.iter().map(|&k| known[k]).collect();
        for &k in &case {
            v.extend((0..n_known[k]).map(|_| unit(&names[k]) * random.number()));
        }
        let mut Jv = vec![0.0; n_unknown.iter().sum()];
        sim.directional_derivative(&knowns, &v, &unknown, &mut Jv).expect("a direction");
        let mut w = Jv.clone();
        let mut first = 0;
        for n in &n_unknown {
            let part = &mut w[first..first + n];
            let scale = part.iter().map(|x| x * x).sum::<f64>().max(1e-30).sqrt();
            part.iter_mut().for_each(|x| *x = *x / scale + 0.3 * random.number());
            first += n;
        }
        let mut JTw = vec![0.0; v.len()];
        sim.adjoint_derivative(&unknown, &w, &knowns, &mut JTw).expect("an adjoint");
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (one, other) = (dot(&w, &Jv), planted * dot(&JTw, &v));
        let names: Vec<&str> = case.iter().map(|&k| &*names[k]).collect();
        let size: f64 = w.iter().zip(&Jv).map(|(w, j)| (w * j).abs()).sum();
        println!("{names:?}: {:.1e} of {size:.1e}", (one - other).abs());
        assert!(
            (one - other).abs() <= close * size + NOISE,
            "{names:?}: <w, Jv> = {one:.12e}, <J'w, v> = {other:.12e}"
        );
        let mut twice = vec![0.0; v.len()];
        let minus: Vec<f64> = w.iter().map(|w| -2.0 * w).collect();
        sim.adjoint_derivative(&unknown, &minus, &knowns, &mut twice).expect("an adjoint");
        let most = JTw.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        assert!(
            JTw.iter().zip(&twice).all(|(a, b)| (b + 2.0 * a).abs() <= close * most + NOISE),
            "{names:?} is not linear"
        );
    }
    let (w, mut out) = (vec![0.0; n_unknown.iter().sum()], vec![1.0; n_known.iter().sum()]);
    sim.adjoint_derivative(&unknown, &w, &known, &mut out).expect("an adjoint");
    assert!(out.iter().all(|x| *x == 0.0), "the gradient of nothing is nothing");
    assert_eq!(sim.save(), state, "asking changes nothing");
}

fn bend(sim: &mut Sim) {
    set(sim, "bone.translation", 3, &[0.003, 0.001, 0.002]);
    set(sim, "bone.rotation", 3, &[0.2, -0.1, 0.3]);
    set(sim, "load.force", 0, &[0.0, 0.02, -0.1]);
    set(sim, "load.pressure", 0, &[150.0]);
    set(sim, "muscle.activation", 0, &[0.02]);
}

#[test]
fn adjoint_is_the_transpose_with_bones_moved_by_pose() {
    transposes(&SCENE.replace("DRIVE", ""), bend);
}

#[test]
fn adjoint_is_the_transpose_in_steps_in_time() {
    let scene = SCENE.replace("DRIVE", "").replace("[[tissue]]", MEMORY);
    for inertia in ["", "[inertia]\nscheme = \"bdf2\"\ndamping_mass = 3.0\ndamping_stiffness = 0.004\n"] {
        transposes_of_step(0.02, &format!("{scene}{inertia}"), bend);
    }
    let scene = SCENE.replace("DRIVE", "drive = \"force\"\n") + "[inertia]\nscheme = \"generalised-alpha\"\n";
    transposes_of_step(0.02, &scene, |sim| {
        set(sim, "bone.force", 3, &[0.1, 0.02, -0.05]);
        set(sim, "bone.torque", 3, &[1e-4, 5e-4, -2e-4]);
        set(sim, "load.pressure", 0, &[150.0]);
    });
}

#[test]
#[should_panic(expected = "<w, Jv>")]
fn planted_wrong_adjoint_is_found() {
    transposes_but_for(1.0 + 1e-6, 1.0, &SCENE.replace("DRIVE", ""), bend);
}

#[test]
fn adjoint_is_the_transpose_with_a_bone_moved_by_force_and_torque() {
    transposes(&SCENE.replace("DRIVE", "drive = \"force\"\n"), |sim| {
        set(sim, "bone.force", 3, &[0.1, 0.02, -0.05]);
        set(sim, "bone.torque", 3, &[1e-4, 5e-4, -2e-4]);
        set(sim, "load.pressure", 0, &[150.0]);
    });
}

#[test]
fn adjoint_is_the_transpose_with_stiffness_among_the_inputs() {
    let scene =
        SCENE.replace("DRIVE", "").replace("[[tissue]]", "[[tissue]]\ntunable = \"flesh\"\npressure = \"nodal\"");
    transposes(&scene, |sim| {
        bend(sim);
        set(sim, "material.flesh.E", 0, &[12e3]);
    });
}

#[test]
fn adjoint_is_the_transpose_with_a_bone_moved_node_by_node() {
    transposes(&SCENE.replace("DRIVE", "drive = \"displacement\"\n"), |sim| {
        let n = get(sim, "bone.jaw.displacement").len();
        let u: Vec<f64> = (0..n).map(|k| 1e-3 * f64::sin(k as f64)).collect();
        set(sim, "bone.jaw.displacement", 0, &u);
    });
}

#[test]
fn adjoint_is_the_transpose_for_linear_tissue_read_off_a_table_and_for_a_finer_skin() {
    let linear =
        SCENE.replace("DRIVE", "").replace("[[tissue]]", "[skin]\nsubdivisions = 1\n[[tissue]]\nenergy = \"linear\"");
    let (fibre, bone) = (linear.find("[tissue.fibre]").expect("fibres"), linear.find("[[bone]]").expect("bones"));
    let (muscle, load) = (linear.find("[[muscle]]").expect("a muscle"), linear.find("[[load]]").expect("a load"));
    let (pressure, gravity) = (linear.find("[[pressure]]").expect("air"), linear.find("[gravity]").expect("weight"));
    let parts = [&linear[..fibre], &linear[bone..muscle], &linear[load..pressure], &linear[gravity..]];
    transposes(&parts.concat(), |sim| {
        set(sim, "bone.translation", 3, &[0.003, 0.001, 0.002]);
        set(sim, "bone.rotation", 3, &[0.2, -0.1, 0.3]);
    });
}

#[test]
fn adjoint_meets_differences_of_equilibria() {
    let mut sim = sim(&SCENE.replace("DRIVE", ""));
    sim.initialise().expect("equilibrium");
    bend(&mut sim);
    sim.step(1.0).expect("a bent state");
    let state = sim.save();
    let names = outputs(&sim);
    let outputs: Vec<usize> = names.iter().map(|name| port(&sim, name)).collect();
    let mut random = Random(5);
    let w: Vec<Vec<f64>> =
        names.iter().map(|name| (0..get(&sim, name).len()).map(|_| random.number()).collect()).collect();
    let loss = |sim: &Sim| -> f64 {
        names.iter().zip(&w).map(|(name, w)| get(sim, name).iter().zip(w).map(|(y, w)| y * w).sum::<f64>()).sum()
    };
    for (input, offset, h) in [
        ("bone.translation", 4, 1e-6),
        ("bone.rotation", 3, 1e-5),
        ("load.force", 2, 1e-5),
        ("load.pressure", 0, 1e-1),
        ("muscle.activation", 0, 1e-5),
        ("gravity", 1, 1e-3),
        ("bone.pivot", 5, 1e-5),
    ] {
        let known = port(&sim, input);
        let mut gradient = vec![0.0; get(&sim, input).len()];
        sim.adjoint_derivative(&outputs, &w.concat(), &[known], &mut gradient).expect("an adjoint");
        let here = get(&sim, input)[offset];
        let [plus, minus] = [h, -h].map(|h| {
            sim.restore(&state).expect("its own state");
            set(&mut sim, input, offset, &[here + h]);
            sim.step(1.0).expect("nearby");
            loss(&sim)
        });
        sim.restore(&state).expect("its own state");
        let difference = (plus - minus) / (2.0 * h);
        let found = gradient[offset];
        assert!((found - difference).abs() < 1e-4 * difference.abs(), "{input}[{offset}]: {found:e}, {difference:e}");
    }
}

#[test]
fn what_has_no_adjoint_says_why() {
    let mut sim = sim(&SCENE.replace("DRIVE", ""));
    let (known, unknown) = (port(&sim, "gravity"), port(&sim, "marker.position"));
    let ask = |sim: &mut Sim, unknown: usize, seed: &[f64], known: usize, n: usize| {
        sim.adjoint_derivative(&[unknown], seed, &[known], &mut vec![0.0; n]).unwrap_err().to_string()
    };
    assert!(ask(&mut sim, unknown, &[1.0; 3], known, 3).contains("no equilibrium yet"));
    sim.initialise().expect("equilibrium");
    assert!(ask(&mut sim, unknown, &[1.0; 2], known, 3).contains("seed"));
    assert!(ask(&mut sim, unknown, &[1.0; 4], known, 3).contains("seed"));
    assert!(ask(&mut sim, unknown, &[1.0; 3], known, 2).contains("sensitivity"));
    assert!(ask(&mut sim, unknown, &[1.0; 3], unknown, 3).contains("an input"));
    assert!(ask(&mut sim, unknown, &[1.0, f64::NAN, 0.0], known, 3).contains("not finite"));
    let residual = port(&sim, "solver.residual");
    assert!(ask(&mut sim, residual, &[1.0], known, 3).contains("solver.residual"));
}

/// A Jacobian times a vector is a sum over the knowns, also where one is named twice.
#[test]
fn knowns_named_twice_count_twice() {
    let scene = "[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [4, 3, 2]\n[[tissue]]\nE = 15e3\nnu = 0.4\n[[bone]]\nname = \"skull\"\n\
                 nodes = \"x_min\"\n[[bone]]\nname = \"jaw\"\nnodes = \"x_max\"\n";
    let mut sim = crate::common::sim(scene);
    sim.initialise().expect("rest");
    let [known, unknown] = ["bone.translation", "bone.reactionForce"].map(|name| crate::common::port(&sim, name));
    let seeds = [[0.0, 0.0, 0.0, 1.0, 0.5, 0.0], [0.0, 0.0, 0.0, 0.0, 0.25, -1.0]];
    let mut along = |knowns: &[usize], seed: &[f64]| {
        let mut out = [0.0; 6];
        sim.directional_derivative(knowns, seed, &[unknown], &mut out).expect("a derivative");
        out
    };
    let twice = along(&[known, known], seeds.as_flattened());
    let sum: Vec<f64> = seeds[0].iter().zip(seeds[1]).map(|(a, b)| a + b).collect();
    let once = along(&[known], &sum);
    assert!(once.iter().any(|v| v.abs() > 1.0) && twice == once, "{twice:?}, {once:?}");
}
