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

fn says(report: &cutis::sim::StepReport, text: &str) -> bool {
    report.warnings.iter().any(|w| w.contains(text))
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

/// A scheme and its order.
const SCHEMES: [(&str, f64); 5] = [
    ("scheme = \"backward-euler\"", 1.0),
    ("scheme = \"bdf2\"", 2.0),
    ("scheme = \"generalised-alpha\"\nrho = 0.5", 2.0),
    ("scheme = \"generalised-alpha\"", 2.0),
    ("scheme = \"implicit-midpoint\"", 2.0),
];
/// A small soft bar under a load that grows smoothly.
const SWUNG: &str = "[mesh.block]\nsize = [0.02, 0.02, 0.04]\ncells = [1, 1, 2]\n[solver]\nmethod = \"newton\"\n\
                     tolerance = 1e-11\n[[bone]]\nname = \"root\"\nnodes = \"z_min\"\n[gravity]\nacceleration = [0, 0, 0]\n";
/// Lengths of steps in turn, of mean 1.
const EVEN: &[f64] = &[1.0];
const UNEVEN: &[f64] = &[1.0, 2.0, 0.5, 0.5];
/// The same as far as generalised-alpha keeps its order.
const LESS_UNEVEN: &[f64] = &[1.0, 1.2, 0.9, 0.9];

/// The skin after 0.08 s in `n` steps.
fn swing(scheme: &str, tissue: &str, lengths: &[f64], n: usize) -> Vec<f64> {
    let mut sim = sim(&format!("{SWUNG}{tissue}[inertia]\nstart = \"rest\"\n{scheme}\n"));
    sim.initialise().expect("rest");
    let mut t = 0.0;
    for k in 0..n {
        let dt = 0.08 / n as f64 * lengths[k % lengths.len()];
        t += dt;
        let g = 20.0 * (30.0 * t).sin().powi(2);
        set(&mut sim, "gravity", 0, &[g, 0.3 * g, 0.0]);
        sim.step(dt).expect("a swing");
    }
    get(&sim, "skin.position")
}

fn order(scheme: &str, tissue: &str, lengths: &[f64]) -> f64 {
    let x = [128, 256, 512].map(|n| swing(scheme, tissue, lengths, n));
    let apart = |a: &[f64], b: &[f64]| largest(a.iter().zip(b).map(|(a, b)| a - b));
    (apart(&x[0], &x[1]) / apart(&x[1], &x[2])).log2()
}

const SOFT: &str = "[[tissue]]\nenergy = \"stable-neo-hookean\"\nE = 3e3\nnu = 0.3\n";
const VISCOUS: &str = "[tissue.viscous]\ng = [0.6]\ntau = [0.02]\n";

#[test]
fn each_scheme_shows_its_order() {
    for (scheme, wanted) in SCHEMES {
        let uneven = if scheme.contains("alpha") { LESS_UNEVEN } else { UNEVEN };
        for (tissue, lengths, damping) in [
            (SOFT.to_owned(), EVEN, ""),
            (SOFT.to_owned(), uneven, ""),
            (SOFT.to_owned(), uneven, "damping_mass = 5.0\ndamping_stiffness = 0.002"),
            (format!("{SOFT}{VISCOUS}"), EVEN, ""),
        ] {
            let found = order(&format!("{scheme}\n{damping}"), &tissue, lengths);
            assert!(
                (found - wanted).abs() < 0.15,
                "{scheme}\n{damping}\n{tissue}{lengths:?}: order {found:.3}, wanted {wanted}"
            );
        }
    }
}

#[test]
#[should_panic]
fn backward_euler_is_not_of_second_order() {
    assert!((order(SCHEMES[0].0, SOFT, EVEN) - 2.0).abs() < 0.15);
}

/// Energy of a bar of the linear law that is plucked and left to ring: at the first free step, and after `n` more.
fn ringing(scheme: &str, n: usize) -> [f64; 2] {
    let text =
        format!("{SWUNG}[[tissue]]\nenergy = \"linear\"\nE = 3e3\nnu = 0.3\n[inertia]\nstart = \"rest\"\n{scheme}\n");
    let mut sim = sim(&text);
    sim.initialise().expect("rest");
    set(&mut sim, "bone.translation", 0, &[2e-3, 0.0, 0.0]);
    let energy = |sim: &Sim| get(sim, "energy.elastic")[0] + get(sim, "energy.kinetic")[0];
    (0..3).for_each(|_| drop(sim.step(1e-3).expect("a pluck")));
    let first = energy(&sim);
    (0..n).for_each(|_| drop(sim.step(1e-3).expect("ringing")));
    [first, energy(&sim)]
}

#[test]
fn the_midpoint_rule_keeps_the_energy_of_a_linear_problem() {
    let [first, last] = ringing("scheme = \"implicit-midpoint\"", 1000);
    assert!((last / first - 1.0).abs() < 1e-6, "{first:.6e} J became {last:.6e} J");
    for (scheme, left) in
        [("scheme = \"backward-euler\"", 0.2..0.5), ("scheme = \"generalised-alpha\"\nrho = 0.5", 0.8..0.9999)]
    {
        let [first, last] = ringing(scheme, 400);
        assert!(left.contains(&(last / first)), "{scheme}: {first:.6e} J became {last:.6e} J");
    }
}

#[test]
fn every_scheme_repeats_its_bits() {
    for (scheme, _) in SCHEMES {
        // A force-driven bone as well: its curvature depends on where inertia carries it.
        let scene = format!(
            "{BAR}{scheme}\ndamping_mass = 2.0\ndamping_stiffness = 1e-3\n[[bone]]\nname = \"root\"\nnodes = \"z_min\"\n[[bone]]\nname = \"plate\"\n\
             nodes = \"z_max\"\ndrive = \"force\"\n[gravity]\n"
        );
        let go = |sim: &mut Sim, k: usize| {
            set(sim, "bone.force", 3, &[0.1 * (k as f64).sin(), 0.02, 0.0]);
            sim.step([0.01, 0.004, 0.02][k % 3]).expect("a dynamic step");
        };
        let mut straight = sim(&scene);
        straight.initialise().expect("rest");
        (0..7).for_each(|k| go(&mut straight, k));
        let bytes = straight.save().to_bytes(straight.model());
        let mut other = sim(&scene);
        let state = State::from_bytes(&bytes, other.model()).expect("bytes of the same model");
        assert_eq!(state, straight.save());
        other.restore(&state).expect("a state of the same model");
        for sim in [&mut straight, &mut other] {
            (7..15).for_each(|k| go(sim, k));
        }
        assert_eq!(straight.save().to_bytes(straight.model()), other.save().to_bytes(other.model()), "{scheme}");
    }
}

#[test]
fn bones_do_not_ring_in_any_scheme() {
    // A bone that sets off evenly: the reaction of its tissue's mass is that of one jolt, then none.
    for (scheme, _) in SCHEMES {
        let mut sim = sim(&format!("{SWUNG}{SOFT}[inertia]\nstart = \"rest\"\n{scheme}\ndamping_stiffness = 0.01\n"));
        sim.initialise().expect("rest");
        let mut kinetic = Vec::new();
        for k in 1..=400 {
            set(&mut sim, "bone.translation", 0, &[2e-4 * f64::from(k), 0.0, 0.0]);
            sim.step(2e-2).expect("an even motion");
            kinetic.push(get(&sim, "energy.kinetic")[0]);
        }
        // All 16 g at 1 cm/s.
        assert!((kinetic[399] - 0.5 * 0.016 * 1e-4).abs() < 1e-10, "{scheme}: {:e}", kinetic[399]);
    }
}

/// Damping in units of the critical one and angular frequency (rad/s) of the slowest sway of a bar let go; its mesh is
/// mirrored, so that it sways in one plane.
fn sway(law: &str, damping: &str) -> (f64, f64) {
    let mut sim = sim(&format!(
        "[mesh.block]\nsize = [0.01, 0.01, 0.06]\ncells = [1, 1, 3]\npattern = \"forty-eight\"\n[solver]\ntolerance = 1e-10\n[[bone]]\n\
         name = \"root\"\nnodes = \"z_min\"\n[gravity]\nacceleration = [0.2, 0, 0]\n[[tissue]]\nenergy = \"{law}\"\n\
         E = 20e3\nnu = 0.3\n[inertia]\nstart = \"equilibrium\"\nscheme = \"bdf2\"\n{damping}\n"
    ));
    sim.initialise().expect("bent by gravity");
    set(&mut sim, "gravity", 0, &[0.0; 3]);
    let rest = get(&sim, "skin.restPosition");
    let k = 3 * (0..rest.len() / 3).max_by(|a, b| rest[3 * a + 2].total_cmp(&rest[3 * b + 2])).expect("a tip");
    let (dt, mut before, mut crossings) = (1e-3, 1.0, Vec::new());
    for step in 0..20_000 {
        sim.step(dt).expect("a sway");
        let u = get(&sim, "skin.position")[k] - rest[k];
        if before < 0.0 && u >= 0.0 {
            crossings.push((dt * f64::from(step), get(&sim, "energy.elastic")[0] + get(&sim, "energy.kinetic")[0]));
        }
        before = u;
        if crossings.len() == 11 {
            break;
        }
    }
    // The first ones hold faster motions, too. Energy decays twice as fast as motion.
    let ((t0, e0), (t1, e1)) = (crossings[2], crossings[10]);
    let (decay, w) = ((e0 / e1).ln() / 16.0, 8.0 * std::f64::consts::TAU / (t1 - t0));
    (decay / decay.hypot(std::f64::consts::TAU), w)
}

#[test]
fn rayleigh_damping_has_its_ratio() {
    for law in ["linear", "stable-neo-hookean"] {
        for (a, b) in [(0.8, 0.0), (0.0, 2e-3), (0.5, 1e-3)] {
            let (zeta, w) = sway(law, &format!("damping_mass = {a:?}\ndamping_stiffness = {b:?}"));
            let wanted = 0.5 * (a / w + b * w);
            println!("{law}, a {a}, b {b}: w {w:.2} rad/s, zeta {zeta:.5}, formula {wanted:.5}");
            assert!((zeta - wanted).abs() < 0.02 * wanted, "{law}, a {a}, b {b}: {zeta} against {wanted} at {w} rad/s");
        }
    }
}

#[test]
fn stiffness_damping_feels_no_rotation() {
    // A bar carried round by its bone: damping that felt rotations would hold it back and turn the bone's torque.
    let torque = |damping: &str| {
        let mut sim = sim(&format!(
            "{SWUNG}[[tissue]]\nenergy = \"corotational\"\nE = 15e3\nnu = 0.3\n[inertia]\nstart = \"rest\"\nscheme = \"bdf2\"\n{damping}\n"
        ));
        sim.initialise().expect("rest");
        let mut angle = 0.0;
        for k in 0..600 {
            angle += 0.01 * (f64::from(k) / 300.0).min(1.0);
            set(&mut sim, "bone.rotation", 0, &[0.0, 0.0, angle]);
            sim.step(0.01).expect("a turn");
        }
        get(&sim, "bone.reactionTorque")[2]
    };
    let (free, damped) = (torque(""), torque("damping_stiffness = 0.05"));
    let felt = torque("damping_mass = 5.0");
    assert!((free - damped).abs() < 1e-3 * (free - felt).abs(), "{free:e} {damped:e} {felt:e}");
}

/// A bar that is jerked, then left to itself: skin after every host step of 0.02 s, and all pieces of time taken.
fn jerked(inertia: &str, cuts: u32) -> (Vec<Vec<f64>>, u32, f64) {
    let mut sim = sim(&format!("{SWUNG}{SOFT}[inertia]\nstart = \"rest\"\ndamping_mass = 8.0\n{inertia}\n"));
    sim.initialise().expect("rest");
    let (mut skins, mut pieces, mut worst) = (Vec::new(), 0, 0.0_f64);
    for k in 0..50 {
        for cut in 1..=cuts {
            let t = (f64::from(k) + f64::from(cut) / f64::from(cuts)) / 2.0;
            set(&mut sim, "bone.translation", 0, &[4e-3 * t.min(1.0), 0.0, 0.0]);
            let report = sim.step(0.02 / f64::from(cuts)).expect("a step");
            assert!(report.warnings.is_empty(), "{:?}", report.warnings);
            pieces += report.substeps;
            worst = worst.max(report.time_error);
        }
        skins.push(get(&sim, "skin.position"));
    }
    (skins, pieces, worst)
}

fn farthest(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    largest(a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a - b))
}

#[test]
fn steps_are_cut_as_accuracy_asks() {
    let truth = jerked("scheme = \"generalised-alpha\"", 256).0;
    for (scheme, _) in &SCHEMES[..4] {
        let mut errors = Vec::new();
        for accuracy in [8e-6, 1e-6] {
            let (skins, pieces, worst) = jerked(&format!("{scheme}\naccuracy = {accuracy:e}"), 1);
            assert!(worst <= accuracy, "{scheme}: a piece of error {worst:e}");
            let error = farthest(&skins, &truth);
            let even = farthest(&jerked(scheme, pieces.div_ceil(50)).0, &truth);
            println!(
                "{scheme}, accuracy {accuracy:e}: {pieces} pieces, off by {error:.1e} m, even ones by {even:.1e} m"
            );
            // Each piece adds its own error, and time is spent where it is needed.
            assert!(error < f64::from(pieces) * accuracy, "{scheme}, {accuracy:e}: off by {error:e} m");
            assert!(error < 1.05 * even, "{scheme}, {accuracy:e}: {error:e} m, even pieces {even:e} m");
            errors.push(error);
        }
        assert!(errors[1] < 0.5 * errors[0], "{scheme}: {errors:?}");
    }
}

#[test]
fn accuracy_repeats_its_bits_and_is_told_where_it_fails() {
    let scene = format!("{SWUNG}{SOFT}[inertia]\nstart = \"rest\"\nscheme = \"bdf2\"\naccuracy = 1e-6\n");
    let go = |sim: &mut Sim, k: usize| {
        set(sim, "bone.translation", 0, &[2e-3 * (k as f64).sin(), 0.0, 0.0]);
        sim.step(0.02).expect("a step")
    };
    let mut straight = sim(&scene);
    straight.initialise().expect("rest");
    let pieces: u32 = (0..6).map(|k| go(&mut straight, k).substeps).sum();
    assert!(pieces > 12, "{pieces} pieces");
    let bytes = straight.save().to_bytes(straight.model());
    let mut other = sim(&scene);
    other.restore(&State::from_bytes(&bytes, other.model()).expect("its bytes")).expect("its state");
    for sim in [&mut straight, &mut other] {
        (6..12).for_each(|k| drop(go(sim, k)));
    }
    assert_eq!(straight.save().to_bytes(straight.model()), other.save().to_bytes(other.model()));

    let mut rough = sim(&scene.replace("1e-6", "1e-9"));
    rough.initialise().expect("rest");
    set(&mut rough, "bone.translation", 0, &[5e-3, 0.0, 0.0]);
    let report = rough.step(0.5).expect("a step that is too long");
    assert!(report.substeps <= 512 && report.warnings.iter().any(|w| w.contains("accuracy")), "{report:?}");
    let coarse = format!("{SWUNG}{SOFT}[inertia]\naccuracy = 5e-11\n");
    let message = cutis::load::from_text(&coarse, None).err().expect("below the solver's tolerance").to_string();
    assert!(message.contains("accuracy") && message.contains("ten times"), "{message}");
}

/// Energy of a block in free swing, unloaded, after each of many steps.
fn free_swing(inertia: &str, steps: impl Iterator<Item = f64>) -> Vec<f64> {
    let scene = BAR.replace("start = \"rest\"\n", inertia);
    let mut sim = sim(&format!(
        "{scene}[[bone]]\nname = \"root\"\nnodes = \"z_min\"\n[[load]]\nname = \"push\"\nat = [0.01, 0.01, 0.06]\nradius = 0.01\nforce = [0.05, 0, 0]\n"
    ));
    sim.initialise().expect("equilibrium");
    set(&mut sim, "load.force", 0, &[0.0; 3]);
    steps
        .map(|dt| {
            sim.step(dt).expect("a dynamic step");
            get(&sim, "energy.elastic")[0] + get(&sim, "energy.kinetic")[0]
        })
        .collect()
}

/// Large free swings of a soft block under a law that is not linear: 5000 steps at random in a ratio of 1 to 10, far from resolved.
#[test]
fn large_swings_gain_no_energy_in_any_scheme() {
    let mut rows: Vec<String> =
        ["backward-euler", "bdf2", "implicit-midpoint"].map(|s| format!("scheme = \"{s}\"\n")).into();
    rows.extend([0.0, 0.5, 0.8, 0.95, 1.0].map(|rho| format!("scheme = \"generalised-alpha\"\nrho = {rho:?}\n")));
    let mut told = 0;
    for scheme in rows {
        let mut sim = sim(&format!(
            "[mesh.block]\nsize = [0.02, 0.02, 0.06]\ncells = [1, 1, 3]\n[[tissue]]\nE = 5e3\nnu = 0.4\n[[bone]]\nname = \"root\"\n\
             nodes = \"z_min\"\n[[load]]\nname = \"push\"\nat = [0.01, 0.01, 0.06]\nradius = 0.01\nforce = [0.2, 0.05, 0]\n[inertia]\n{scheme}"
        ));
        sim.initialise().expect("equilibrium");
        let start = get(&sim, "energy.elastic")[0];
        set(&mut sim, "load.force", 0, &[0.0; 3]);
        let mut random = crate::common::Random(5);
        let (mut most, mut warned) = (0.0_f64, false);
        for _ in 0..5000 {
            let report = sim.step(1e-3 * 10.0_f64.powf(0.5 + 0.5 * random.number())).expect("a free swing");
            warned |= says(&report, "gained energy");
            most = most.max(get(&sim, "energy.elastic")[0] + get(&sim, "energy.kinetic")[0]);
        }
        println!("{scheme}{start:.3e} {most:.3e} {warned}");
        assert!(most < 1.05 * start, "{scheme}: {start:.2e} J at first, {most:.2e} J at most");
        told += u32::from(warned);
    }
    assert!(told > 0, "no scheme pumps here: the test watches nothing");
}

/// Whatever the sequence of steps, within ratios of 1 to 10.
#[test]
fn free_swings_gain_no_energy() {
    let schemes = [
        "scheme = \"backward-euler\"\n",
        "scheme = \"bdf2\"\n",
        "scheme = \"generalised-alpha\"\n",
        "scheme = \"generalised-alpha\"\nrho = 0.5\n",
        "scheme = \"generalised-alpha\"\nrho = 0.0\n",
    ];
    for scheme in schemes {
        let mut random = crate::common::Random(11);
        let random: Vec<f64> = (0..1500).map(|_| 2e-3 * 10.0_f64.powf(0.5 + 0.5 * random.number())).collect();
        let cycles = [[0.02, 0.002, 0.002], [0.005, 0.02, 0.005]].map(|c| c.into_iter().cycle().take(900).collect());
        for steps in [random].into_iter().chain(cycles) {
            let energy = free_swing(scheme, steps.into_iter());
            let most = energy[1..].iter().fold(0.0_f64, |m, e| m.max(*e));
            assert!(most < 1.02 * energy[0], "{scheme}: {:.2e} J at first, {most:.2e} J at most", energy[0]);
            assert!(energy[energy.len() - 1] < energy[0], "{scheme}");
        }
    }
}
