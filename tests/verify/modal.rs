//! Linear dynamics in modes: all of them are the full dynamics, few of them are near it, and rest is exact.

use std::f64::consts::{PI, TAU};

use cutis::math::Vec3;
use cutis::sim::{Sim, State};
use cutis::solve::slowest_modes;
use nalgebra::{Cholesky, DMatrix, SymmetricEigen};

use crate::common::{Random, get, largest, port, rows, set, sim};

/// 81 unknowns between a held bone and one that moves.
const SCENE: &str = "[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [4, 2, 2]\n[[tissue]]\nenergy = \"linear\"\nE = 15e3\n\
    nu = 0.4\ntunable = \"all\"\n[[bone]]\nname = \"skull\"\nnodes = \"x_min\"\ndrive = \"held\"\n[[bone]]\nname = \"jaw\"\n\
    nodes = \"x_max\"\nDRIVE\n[[load]]\nname = \"push\"\nat = [0.03, 0.02, 0.02]\nradius = 0.015\n[gravity]\n[[marker]]\n\
    name = \"mid\"\nat = [0.03, 0.02, 0.02]\n[solver]\nmethod = \"newton\"\ntolerance = 1e-12\n[inertia]\n";
const UNKNOWNS: usize = 81;
const DAMPED: &str = "damping_mass = 3.0\ndamping_stiffness = 2e-3\n";
const SCHEMES: [&str; 5] = [
    "scheme = \"backward-euler\"\n",
    "scheme = \"bdf2\"\n",
    "scheme = \"generalised-alpha\"\n",
    "scheme = \"generalised-alpha\"\nrho = 0.3\n",
    "scheme = \"implicit-midpoint\"\n",
];
/// Ports, and how far apart modes and the full dynamics may be: a billionth of what each moves, or better.
const OUT: [(&str, f64); 8] = [
    ("skin.position", 1e-13),
    ("marker.position", 1e-13),
    ("skin.velocity", 1e-10),
    ("bone.reactionForce", 1e-10),
    ("bone.reactionTorque", 1e-11),
    ("energy.elastic", 1e-12),
    ("energy.kinetic", 1e-12),
    ("quality.minDetF", 1e-11),
];
/// The same of every node, m.
const NODES: f64 = 1e-13;

fn scene(drive: &str, inertia: &str) -> String {
    format!("{}{inertia}", SCENE.replace("DRIVE", drive))
}

fn modes(n: usize) -> String {
    format!("modes = {n}\n")
}

/// The largest difference of two simulations in units of what each port allows.
fn apart(a: &Sim, b: &Sim) -> (f64, String) {
    let mut worst = (0.0, String::new());
    let mut see = |off: f64, name: &str| {
        if off > worst.0 || off.is_nan() {
            worst = (off, format!("{name} is off by {off:.1e} tolerances"));
        }
    };
    for (name, tolerance) in OUT {
        see(largest(get(a, name).iter().zip(get(b, name)).map(|(a, b)| a - b)) / tolerance, name);
    }
    let nodes = a.positions().iter().zip(b.positions()).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    see(nodes / NODES, "positions");
    worst
}

/// Moves everything that the scene has, in steps of changing length.
fn go(sim: &mut Sim, k: usize) {
    let t = 0.7 * k as f64;
    set(sim, "load.force", 0, &[0.02 * t.sin(), 0.01, -0.05 * (1.3 * t).cos()]);
    set(sim, "gravity", 0, &[0.0, 3.0 * t.cos(), -9.81]);
    if sim.model().ports().iter().any(|p| p.name == "bone.translation") {
        set(sim, "bone.translation", 3, &[1e-3 * t.sin(), 2e-3 * (0.5 * t).sin(), -1e-3 * t.sin().powi(2)]);
        set(sim, "bone.rotation", 3, &[0.05 * t.sin(), 0.1 * (0.3 * t).sin(), -0.04 * t.sin()]);
    } else {
        set(sim, "bone.jaw.displacement", 6, &[1e-3 * t.sin(), 2e-3 * (0.5 * t).sin(), -1e-3, 4e-4 * t.sin()]);
    }
    if k == 9 {
        set(sim, "material.all.E", 0, &[11e3]);
    }
    if k == 13 {
        set(sim, "bone.pivot", 3, &[0.05, 0.01, 0.03]);
    }
    sim.step([5e-3, 3e-3, 8e-3, 30e-3][k % 4]).expect("a step");
}

/// Both from the same start through the same motions; the largest difference on the way.
fn along(modal: &str, full: &str) -> (f64, String) {
    let (mut modal, mut full) = (sim(modal), sim(full));
    let mut worst = (0.0, String::new());
    for sim in [&mut modal, &mut full] {
        sim.initialise().expect("a start");
    }
    for k in 0..20 {
        let now = apart(&modal, &full);
        if now.0 > worst.0 || now.0.is_nan() {
            worst = (now.0, format!("before step {k} {}", now.1));
        }
        go(&mut modal, k);
        go(&mut full, k);
    }
    worst
}

#[test]
fn all_modes_are_the_full_dynamics() {
    for scheme in SCHEMES {
        for start in ["start = \"rest\"\n", "start = \"equilibrium\"\n"] {
            for (drive, damping) in [("", DAMPED), ("drive = \"displacement\"", DAMPED), ("", "")] {
                let full = scene(drive, &format!("{scheme}{start}{damping}"));
                let (off, what) = along(&format!("{full}{}", modes(UNKNOWNS)), &full);
                println!("{scheme:?} {start:?} {drive:?} {damping:?}: {off:.2e} tolerances");
                assert!(off <= 1.0, "{scheme} {start} {drive} {damping}: {what}");
            }
        }
    }
}

#[test]
#[should_panic(expected = "tolerances")]
fn a_planted_damping_is_found() {
    let full = scene("", &format!("{}{DAMPED}", SCHEMES[1]));
    let planted = full.replace("damping_stiffness = 2e-3", "damping_stiffness = 2.0001e-3");
    let (off, what) = along(&format!("{planted}{}", modes(UNKNOWNS)), &full);
    assert!(off <= 1.0, "{what}");
}

/// The largest distance of a node from the full dynamics on the way, m.
fn distance(n: usize) -> f64 {
    let inertia = format!("{}{DAMPED}start = \"rest\"\n", SCHEMES[1]);
    let (mut modal, mut full) = (sim(&scene("", &format!("{inertia}{}", modes(n)))), sim(&scene("", &inertia)));
    let mut worst = 0.0_f64;
    for k in 0..40 {
        for sim in [&mut modal, &mut full] {
            if k == 0 {
                sim.initialise().expect("a start");
            }
            let t = 5e-3 * k as f64;
            set(sim, "bone.translation", 3, &[2e-3 * (20.0 * t).sin().powi(4), 0.0, 1e-3 * (30.0 * t).sin().powi(4)]);
            set(sim, "load.force", 0, &[0.0, 0.0, -0.05 * (25.0 * t).sin().powi(4)]);
            sim.step(5e-3).expect("a step");
        }
        let nodes = modal.positions().iter().zip(full.positions());
        worst = nodes.map(|(a, b)| (a - b).norm()).fold(worst, f64::max);
    }
    worst
}

#[test]
fn few_modes_come_near_as_they_grow_more() {
    let errors = [1, 4, 12, 30, UNKNOWNS].map(distance);
    println!("off by {errors:?} m");
    assert!(errors.windows(2).all(|e| e[1] < e[0]), "{errors:?}");
    assert!(errors[2] < 0.3 * errors[0] && errors[4] < 1e-10, "{errors:?}");
}

#[test]
fn rest_is_the_equilibrium_with_any_number_of_modes() {
    for (n, scheme) in [(1, SCHEMES[0]), (5, SCHEMES[1]), (12, SCHEMES[3])] {
        let text = scene("", &format!("{scheme}damping_mass = 60.0\nstart = \"equilibrium\"\n{}", modes(n)));
        let mut moving = sim(&text);
        let mut still = sim(&text[..text.find("[inertia]").expect("inertia")]);
        for sim in [&mut moving, &mut still] {
            set(sim, "bone.translation", 3, &[2e-3, -1e-3, 3e-3]);
            set(sim, "load.force", 0, &[0.05, -0.02, 0.1]);
            sim.initialise().expect("an equilibrium");
        }
        let same = |moving: &Sim, still: &Sim| {
            for name in ["skin.position", "bone.reactionForce", "energy.elastic"] {
                let off = largest(get(moving, name).iter().zip(get(still, name)).map(|(a, b)| a - b));
                assert!(off < 1e-11, "{n} modes, {name}: off by {off:.1e}");
            }
        };
        same(&moving, &still);
        assert_eq!(largest(get(&moving, "skin.velocity")), 0.0);
        // Somewhere else, until it has come to rest.
        for sim in [&mut moving, &mut still] {
            set(sim, "bone.rotation", 3, &[0.1, 0.2, -0.1]);
            set(sim, "load.force", 0, &[0.0, 0.1, -0.1]);
        }
        still.step(0.1).expect("an equilibrium");
        (0..2000).for_each(|_| drop(moving.step(0.01).expect("a step")));
        same(&moving, &still);
        assert!(get(&moving, "energy.kinetic")[0] < 1e-15);
    }
}

#[test]
fn a_scan_in_its_own_weight_stays_at_rest() {
    for scheme in SCHEMES {
        let text = scene("", &format!("{scheme}{DAMPED}start = \"rest\"\n{}", modes(3)));
        let mut sim = sim(&text.replace("[gravity]\n", "[gravity]\nscan = [0, 0, -9.80665]\n"));
        sim.initialise().expect("rest");
        for _ in 0..5 {
            sim.step(4e-3).expect("a step");
            let off = get(&sim, "skin.position").into_iter().zip(get(&sim, "skin.restPosition")).map(|(x, X)| x - X);
            assert!(largest(off) < 1e-12 && largest(get(&sim, "skin.velocity")) < 1e-10, "{scheme}");
        }
    }
}

/// A bar along z on a bone, its law one of stretches along z alone (nu = 0), so that its slow modes are those of a string.
const BAR: &str = "[mesh.block]\nsize = [0.01, 0.01, 0.1]\ncells = [1, 1, 20]\n[[tissue]]\nenergy = \"linear\"\nE = 20e3\nnu = 0\n\
    [[bone]]\nname = \"root\"\nnodes = \"z_min\"\n[gravity]\nacceleration = [0, 0, 1]\n[solver]\ntolerance = 1e-10\n";

#[test]
fn a_bar_has_the_frequencies_of_its_formula() {
    let mut bar = sim(&format!("{BAR}[inertia]\nmodes = 40\n"));
    let spectrum = bar.spectrum().expect("modes").expect("a scene in modes");
    // Stretching: f_n = (2n - 1) c/(4 L), c = sqrt(E/rho); lumped masses on 20 cells: sin.
    let (c, L, cells) = (20.0_f64.sqrt(), 0.1, 20.0);
    for n in 1..=2 {
        let theta = (2.0 * f64::from(n) - 1.0) * PI / (4.0 * cells);
        let (discrete, string) = (c * cells / (PI * L) * theta.sin(), (2.0 * f64::from(n) - 1.0) * c / (4.0 * L));
        let nearest = spectrum.frequencies.iter().map(|f| (f / discrete - 1.0).abs()).fold(f64::INFINITY, f64::min);
        println!("stretching {n}: {discrete:.4} Hz (string {string:.4}), nearest mode off by {nearest:.1e}");
        assert!(nearest < 0.02 && (discrete / string - 1.0).abs() < 0.01, "{spectrum:?}");
    }
    assert!(spectrum.frequencies.is_sorted() && spectrum.left_out > spectrum.frequencies.last().copied());
    assert!(spectrum.mass_share.iter().all(|s| (0.5..1.0 + 1e-9).contains(s)), "{spectrum:?}");
}

#[test]
fn a_solver_without_a_factor_finds_the_same_modes() {
    let frequencies = |solver: &str| {
        let mut sim = sim(&scene("", &modes(12)).replace("[inertia]", &format!("{solver}[inertia]")));
        sim.spectrum().expect("modes").expect("a scene in modes").frequencies
    };
    let (direct, iterative) = (frequencies(""), frequencies("linear = \"iterative\"\n"));
    let off = largest(direct.iter().zip(&iterative).map(|(a, b)| a / b - 1.0));
    assert!(off < 1e-9, "off by {off:.1e}");
}

#[test]
fn a_plucked_mode_swings_and_decays_as_it_should() {
    let (alpha, beta) = (1.5, 1e-3);
    let mut bar = sim(&format!(
        "{}[inertia]\nscheme = \"bdf2\"\nmodes = 1\ndamping_mass = {alpha:?}\ndamping_stiffness = {beta:?}\n",
        BAR.replace("[0, 0, 1]", "[0.1, 0, 0]")
    ));
    bar.initialise().expect("bent");
    set(&mut bar, "gravity", 0, &[0.0; 3]);
    let w = TAU * bar.spectrum().expect("modes").expect("a scene in modes").frequencies[0];
    let rest = rows(&get(&bar, "skin.restPosition"));
    let tip = (0..rest.len()).max_by(|&a, &b| rest[a].z.total_cmp(&rest[b].z)).expect("a tip");
    let at_tip = |bar: &Sim| rows(&get(bar, "skin.position"))[tip] - rest[tip];
    let (dt, mut crossings, mut peak, mut peaks) = (TAU / w / 400.0, Vec::new(), 0.0, Vec::new());
    // What gravity bent beyond the mode is gone with the first step.
    bar.step(dt).expect("let go");
    let mut before = at_tip(&bar).norm();
    let way = at_tip(&bar) / before;
    for k in 1..=4000 {
        bar.step(dt).expect("a swing");
        let u = way.dot(&at_tip(&bar));
        peak = f64::max(peak, u.abs());
        if before.signum() != u.signum() {
            crossings.push(dt * (f64::from(k) - u / (u - before)));
            peaks.push(std::mem::take(&mut peak));
        }
        before = u;
    }
    let n = crossings.len();
    let damped = PI * (n - 1) as f64 / (crossings[n - 1] - crossings[0]);
    let decay = (peaks[1] / peaks[n - 1]).ln() / (n - 2) as f64;
    let zeta = decay / decay.hypot(PI);
    let wanted = 0.5 * (alpha / w + beta * w);
    println!("w {:.5} of {w:.5} rad/s, zeta {zeta:.5} of {wanted:.5}", damped / (1.0 - zeta * zeta).sqrt());
    assert!((damped / (1.0 - zeta * zeta).sqrt() / w - 1.0).abs() < 1e-3, "{damped} of {w} rad/s");
    assert!((zeta / wanted - 1.0).abs() < 0.02, "{zeta} of {wanted}");
}

/// Seeded masses and a stiffness of springs between blocks, three of whose frequencies are one.
fn springs(n: usize) -> (DMatrix<f64>, Vec<f64>) {
    let mut random = Random(7);
    let m: Vec<f64> = (0..n).map(|_| 1.5 + random.number()).collect();
    let mut K = DMatrix::identity(3 * n, 3 * n);
    for a in 0..n - 1 {
        let (s, c) = (2.0 + random.number(), 0.5 * random.number());
        let B = nalgebra::Matrix3::new(s, c, 0.0, c, s, c, 0.0, c, s);
        for (i, j, sign) in [(a, a, 1.0), (a + 1, a + 1, 1.0), (a, a + 1, -1.0), (a + 1, a, -1.0)] {
            let mut part = K.view_mut((3 * i, 3 * j), (3, 3));
            part += sign * B;
        }
    }
    // The last block stands alone, equal in all directions.
    let last = 3 * (n - 1);
    K.view_mut((last, 0), (3, last)).fill(0.0);
    K.view_mut((0, last), (last, 3)).fill(0.0);
    K.view_mut((last, last), (3, 3)).fill_with_identity();
    (K, m)
}

#[test]
fn the_slowest_modes_are_those_of_the_dense_problem() {
    let n = 60;
    let (K, m) = springs(n);
    let factor = Cholesky::new(K.clone()).expect("positive definite");
    let root = |k: usize| m[k / 3].sqrt();
    let dense = SymmetricEigen::new(DMatrix::from_fn(3 * n, 3 * n, |i, j| K[(i, j)] / (root(i) * root(j))));
    let mut truth: Vec<f64> = dense.eigenvalues.iter().copied().collect();
    truth.sort_by(f64::total_cmp);
    for wanted in [1, 7, 40, 3 * n] {
        let solve = |b: &mut [Vec3]| {
            let x = factor.solve(&DMatrix::from_fn(3 * n, 1, |i, _| b[i / 3][i % 3]));
            b.iter_mut().enumerate().for_each(|(a, b)| *b = Vec3::new(x[3 * a], x[3 * a + 1], x[3 * a + 2]));
        };
        let found = slowest_modes(solve, &m, wanted).expect("all of them");
        let error = largest(found.lambda.iter().zip(&truth).map(|(a, b)| a / b - 1.0));
        let mut mixed = 0.0_f64;
        for (i, a) in found.phi.iter().enumerate() {
            for (j, b) in found.phi.iter().enumerate() {
                let product: f64 = a.iter().zip(b).zip(&m).map(|((a, b), m)| m * a.dot(b)).sum();
                mixed = mixed.max((product - if i == j { 1.0 } else { 0.0 }).abs());
            }
        }
        println!(
            "{wanted} modes in {} solves: frequencies off by {error:.1e}, shapes mixed by {mixed:.1e}",
            found.solves
        );
        assert!(found.lambda.len() == wanted && error < 1e-11 && mixed < 1e-12);
    }
}

#[test]
fn a_snapshot_of_modes_holds_every_node_and_repeats_its_bits() {
    for scheme in SCHEMES {
        let text = scene("", &format!("{scheme}{DAMPED}{}", modes(9)));
        let mut straight = sim(&text);
        straight.initialise().expect("a start");
        (0..6).for_each(|k| go(&mut straight, k));
        let (saved, there) = (straight.save(), straight.positions().to_vec());
        let velocity = get(&straight, "skin.velocity");
        let bytes = saved.to_bytes(straight.model());
        (6..16).for_each(|k| go(&mut straight, k));
        let wanted = straight.save();

        straight.restore(&saved).expect("its own state");
        assert_eq!(straight.positions(), there);
        assert_eq!(get(&straight, "skin.velocity"), velocity);
        (6..16).for_each(|k| go(&mut straight, k));
        assert!(straight.save() == wanted, "{scheme}: back in time");

        let mut other = sim(&text);
        let read = State::from_bytes(&bytes, other.model()).expect("bytes of the same model");
        assert!(read == saved);
        other.restore(&read).expect("a state of the same model");
        (6..16).for_each(|k| go(&mut other, k));
        assert!(other.save() == wanted, "{scheme}: elsewhere");
        assert!((0..bytes.len()).step_by(97).all(|cut| State::from_bytes(&bytes[..cut], other.model()).is_err()));

        other.reset();
        other.initialise().expect("a start");
        (0..16).for_each(|k| go(&mut other, k));
        assert_eq!(other.save().to_bytes(other.model()), wanted.to_bytes(straight.model()), "{scheme}: after a reset");
    }
}

#[test]
fn a_start_is_taken_as_far_as_the_modes_hold_it() {
    let text = scene("", &format!("{}start = \"rest\"\n", SCHEMES[0]));
    let (mut modal, mut full) = (sim(&format!("{text}{}", modes(UNKNOWNS))), sim(&text));
    for sim in [&mut modal, &mut full] {
        sim.initialise().expect("rest");
        let bent = |X: &Vec3| X + 1e-3 * Vec3::new((40.0 * X.y).sin(), (50.0 * X.z).sin(), (60.0 * X.x).sin());
        let start: Vec<Vec3> = sim.model().mesh().nodes.iter().map(bent).collect();
        sim.start_from(&start).expect("a start");
    }
    for _ in 0..5 {
        let (off, what) = apart(&modal, &full);
        assert!(off <= 1.0, "{what}");
        for sim in [&mut modal, &mut full] {
            sim.step(4e-3).expect("a step");
        }
    }
}

#[test]
fn what_modes_leave_out_is_told() {
    let mut few = sim(&scene("", &modes(2)));
    few.initialise().expect("a start");
    let report = few.step(1e-4).expect("a short step");
    assert!(report.warnings.iter().any(|w| w.contains("2 modes") && w.contains("Hz")), "{report:?}");
    assert!(few.step(1e-4).expect("another").warnings.is_empty());
    let mut slow = sim(&scene("", &modes(2)));
    slow.initialise().expect("a start");
    assert!(slow.step(0.1).expect("a long step").warnings.is_empty());
    assert!(sim(&scene("", "")).spectrum().expect("none").is_none());
}

/// Directional derivative of all outputs that have one, by the inputs of `names` along seeds of about their size in life.
fn derivative(sim: &mut Sim, names: &[&str], seed: &[f64]) -> Vec<f64> {
    let knowns: Vec<usize> = names.iter().map(|name| port(sim, name)).collect();
    let unknowns = OUT[..5].iter().map(|(name, _)| port(sim, name)).collect::<Vec<_>>();
    let mut out = vec![0.0; unknowns.iter().map(|&p| sim.model().ports()[p].len()).sum()];
    sim.directional_derivative(&knowns, seed, &unknowns, &mut out).expect("a derivative");
    out
}

#[test]
fn derivatives_of_steps_in_all_modes_are_those_of_the_full_dynamics() {
    let inputs = ["bone.translation", "bone.rotation", "load.force", "gravity"];
    for scheme in SCHEMES {
        let full = scene("", &format!("{scheme}{DAMPED}"));
        let (mut modal, mut full) = (sim(&format!("{full}{}", modes(UNKNOWNS))), sim(&full));
        for sim in [&mut modal, &mut full] {
            sim.initialise().expect("a start");
            (0..6).for_each(|k| go(sim, k));
        }
        let state = modal.save();
        let mut random = Random(3);
        for input in inputs {
            let seed: Vec<f64> = get(&modal, input).iter().map(|_| random.number()).collect();
            let (a, b) = (derivative(&mut modal, &[input], &seed), derivative(&mut full, &[input], &seed));
            let mut first = 0;
            for (name, _) in &OUT[..5] {
                let n = get(&modal, name).len();
                let (a, b) = (&a[first..first + n], &b[first..first + n]);
                let (off, scale) = (largest(a.iter().zip(b).map(|(a, b)| a - b)), largest(b.iter().copied()));
                assert!(off <= 1e-6 * scale, "{scheme} d {name} / d {input}: off by {off:.1e} of {scale:.1e}");
                first += n;
            }
        }
        // The adjoint is the transpose.
        let seed: Vec<f64> = inputs.iter().flat_map(|name| get(&modal, name)).map(|_| random.number()).collect();
        let Jv = derivative(&mut modal, &inputs, &seed);
        let w: Vec<f64> = Jv.iter().map(|v| v + 0.1 * random.number()).collect();
        let knowns = inputs.map(|name| port(&modal, name));
        let unknowns: Vec<usize> = OUT[..5].iter().map(|(name, _)| port(&modal, name)).collect();
        let mut JTw = vec![0.0; seed.len()];
        modal.adjoint_derivative(&unknowns, &w, &knowns, &mut JTw).expect("an adjoint");
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (one, other) = (dot(&w, &Jv), dot(&JTw, &seed));
        assert!((one - other).abs() <= 1e-7 * dot(&Jv, &Jv), "{scheme}: <w, Jv> = {one:e}, <J'w, v> = {other:e}");
        assert_eq!(modal.save(), state, "asking changes nothing");
        go(&mut modal, 7);
        go(&mut full, 7);
        let (off, what) = apart(&modal, &full);
        assert!(off <= 1.0, "after asking {what}");
    }
}

#[test]
fn derivatives_that_modes_do_not_have_are_told_why() {
    let mut sim = sim(&scene("", &modes(4)));
    let unknown = port(&sim, "marker.position");
    let ask = |sim: &mut Sim, name: &str| {
        let known = port(sim, name);
        let seed = vec![1.0; get(sim, name).len()];
        sim.directional_derivative(&[known], &seed, &[unknown], &mut [0.0; 3]).map_err(|e| e.to_string())
    };
    assert!(ask(&mut sim, "gravity").unwrap_err().contains("no equilibrium yet"));
    sim.initialise().expect("a start");
    ask(&mut sim, "gravity").expect("of the equilibrium");
    go(&mut sim, 0);
    let state = sim.save();
    go(&mut sim, 1);
    ask(&mut sim, "gravity").expect("of a step");
    assert!(ask(&mut sim, "material.all.E").unwrap_err().contains("change the modes"));
    assert!(ask(&mut sim, "bone.pivot").unwrap_err().contains("change the modes"));
    sim.restore(&state).expect("its own state");
    ask(&mut sim, "gravity").expect("the state carries what came before");
    let x = sim.positions().to_vec();
    sim.start_from(&x).expect("a start");
    assert!(ask(&mut sim, "gravity").unwrap_err().contains("not known any more"));
}

#[test]
fn scenes_that_are_not_linear_are_told_so() {
    let block =
        "[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [4, 2, 2]\n[[bone]]\nname = \"skull\"\nnodes = \"x_min\"\n";
    let linear = "[[tissue]]\nenergy = \"linear\"\nE = 15e3\nnu = 0.4\n";
    let cases = [
        (linear.replace("linear", "corotational"), "corotational"),
        (format!("{linear}[tissue.viscous]\ng = [0.5]\ntau = [0.1]\n"), "memory"),
        (
            format!("{linear}[[muscle]]\nname = \"m\"\npath = [[0, 0.02, 0.01], [0.06, 0.02, 0.01]]\nradius = 0.008\n"),
            "active muscle",
        ),
        (format!("{linear}[[pressure]]\nname = \"wind\"\nat = [0.03, 0.02, 0.02]\nradius = 0.01\n"), "wind"),
        (format!("{linear}[[bone]]\nname = \"jaw\"\nnodes = \"x_max\"\ndrive = \"force\"\n"), "jaw"),
    ];
    for (tissue, word) in cases {
        let text = format!("{block}{tissue}[inertia]\nmodes = 4\n");
        let message = cutis::load::from_text(&text, None).err().expect(word).to_string();
        println!("{message}");
        assert!(message.contains("`modes` of [inertia]") && message.contains("line "), "{message}");
    }
    for (inertia, word) in [
        ("modes = 0\n", "wanted 1 to 108"),
        ("modes = 109\n", "wanted 1 to 108"),
        ("modes = 4\naccuracy = 1e-5\n", "accuracy"),
    ] {
        let text = format!("{block}{linear}[inertia]\n{inertia}");
        let message = cutis::load::from_text(&text, None).err().expect(word).to_string();
        assert!(message.contains(word), "{message}");
    }
    let loose = format!("{}{linear}[inertia]\nmodes = 4\n", &block[..block.find("[[bone]]").expect("a bone")]);
    assert!(cutis::load::from_text(&loose, None).err().expect("loose").to_string().contains("held by no bone"));
    let mixed = format!("{block}{linear}pressure = \"nodal\"\n[inertia]\nmodes = 4\ndamping_stiffness = 1e-3\n");
    assert!(cutis::load::from_text(&mixed, None).err().expect("mixed").to_string().contains("mix the modes"));
}

/// Modes let tissue turn inside out as linear tables do, and tell of it once; small motions cost no look at the elements.
#[test]
fn elements_that_modes_turn_inside_out_are_told_once() {
    for modes in ["modes = 3\n", "modes = 40\n"] {
        let mut sim = sim(&scene("", modes));
        sim.initialise().expect("rest");
        let (mut told, mut first) = (0, f64::INFINITY);
        for k in 1..=20 {
            set(&mut sim, "bone.translation", 3, &[-0.004 * f64::from(k), 0.0, 0.0]);
            let report = sim.step(0.5).expect("a step");
            if report.warnings.iter().any(|w| w.contains("inside out") && w.contains("mm at rest")) {
                (told, first) = (told + 1, first.min(get(&sim, "quality.minDetF")[0]));
            }
        }
        assert!(told == 1 && first <= 0.0, "{modes}: told {told} times, at {first}");
        assert!(get(&sim, "quality.minDetF")[0] < -0.1);
    }
}
