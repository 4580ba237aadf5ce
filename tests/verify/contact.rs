//! Contacts against closed forms, balances and differences.

use std::f64::consts::PI;

use cutis::geometry::{Block, Pattern, block};
use cutis::math::Vec3;
use cutis::sim::Sim;

use crate::common::{get, largest, port, refused, rows, set, sim};

/// A pad held at its bottom, and a bone `probe` that no tissue sticks to.
fn pad(mesh: &str, tissue: &str, contact: &str) -> String {
    format!(
        "[mesh{mesh}\n[[tissue]]\n{tissue}\n[[bone]]\nname = \"base\"\nnodes = \"z_min\"\ndrive = \"held\"\n[[bone]]\n\
         name = \"probe\"\nnodes = \"none\"\n[[contact]]\nname = \"c\"\nbone = \"probe\"\n{contact}\n[solver]\n\
         method = \"newton\"\ntolerance = 1e-11\n"
    )
}

const PLATE: &str = "point = [0.02, 0.02, 0.02]\nnormal = [0, 0, -2]\nstiffness = 4e7";
const SMALL: &str = ".block]\nsize = [0.04, 0.04, 0.02]\ncells = [4, 4, 2]";
const SOFT: &str = "energy = \"linear\"\nE = 15e3\nnu = 0.0";

fn press(sim: &mut Sim, by: [f64; 3]) {
    set(sim, "bone.translation", 3, &by);
    sim.step(0.1).expect("an equilibrium");
}

fn sum(sim: &Sim, name: &str) -> Vec3 {
    rows(&get(sim, name)).iter().sum()
}

/// Without lateral contraction a plate squeezes a pad uniformly: E u/L = p(depth), u + depth = way of the plate.
#[test]
fn a_plate_on_a_pad_of_cork_meets_its_closed_form() {
    let mut sim = sim(&pad(SMALL, SOFT, PLATE));
    press(&mut sim, [0.0, 0.0, -1e-3]);
    let depth = get(&sim, "contact.depth")[0];
    let (E, L, A, k) = (15e3, 0.02, 0.04 * 0.04, 4e7);
    // An edge of the triangles' mean area (0.01 x 0.01 / 2), a fiftieth of which the contact sets in over.
    let t = 0.02 * (0.5e-4 * 4.0 / 3.0_f64.sqrt()).sqrt();
    let p = if depth < t { k * depth * depth / (2.0 * t) } else { k * (depth - 0.5 * t) };
    assert!((E * (1e-3 - depth) / L / p - 1.0).abs() < 1e-7, "pressure {p} at depth {depth}");
    let force = get(&sim, "contact.force");
    assert!((force[2] / (p * A) - 1.0).abs() < 1e-7 && force[0].abs() < 1e-9, "{force:?}");
    let felt = get(&sim, "bone.reactionForce");
    assert!((felt[5] / force[2] - 1.0).abs() < 1e-12, "the bone feels what its contact does: {felt:?}");
    let lowest = rows(&get(&sim, "skin.position")).iter().map(|x| x.z).fold(f64::INFINITY, f64::min);
    assert!(lowest > -1e-9, "nothing is pushed through the base: {lowest}");
}

/// Force of a ball pressed into a layer that is bonded to its base, linear and small.
///
/// Source: Dimitriadis et al., Biophys. J. 82, 2002.
fn bonded_layer(E: f64, nu: f64, R: f64, h: f64, depth: f64) -> f64 {
    let alpha = -(1.2876 - 1.4678 * nu + 1.3442 * nu * nu) / (1.0 - nu);
    let beta = (0.6387 - 1.0277 * nu + 1.5164 * nu * nu) / (1.0 - nu);
    let chi = (R * depth).sqrt() / h;
    let hertz = 4.0 / 3.0 * E / (1.0 - nu * nu) * R.sqrt() * depth.powf(1.5);
    let a = 2.0 * alpha / PI;
    hertz
        * (1.0 - a * chi + (a * chi).powi(2) - (a.powi(3) + 32.0 * beta / (15.0 * PI)) * chi.powi(3)
            + a * (a.powi(3) + 24.0 * beta / (5.0 * PI)) * chi.powi(4))
}

/// A block of `size` with `cells`, drawn together towards the middle of its upper face: spacings there are `fine` of the mean.
fn graded(size: [f64; 3], cells: [usize; 3], fine: [f64; 2]) -> std::path::PathBuf {
    let even =
        Block { origin: Vec3::zeros(), size: Vec3::from(size), cells, pattern: Pattern::Six, layers: Vec::new() };
    let mut mesh = block(&even).expect("a block");
    let near = |s: f64, c: f64| c * s + (1.0 - c) * s * s * s;
    for X in &mut mesh.nodes {
        for c in 0..2 {
            X[c] = 0.5 * size[c] * near(2.0 * X[c] / size[c] - 1.0, fine[0]);
        }
        X.z = -size[2] * near(1.0 - X.z / size[2], fine[1]);
    }
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("graded_{}.vtu", cells[0]));
    cutis::io::write_mesh(&path, &mesh).expect("a file");
    path
}

#[test]
fn a_ball_on_a_thick_layer_goes_to_the_closed_form_for_it() {
    let excess = |cells: [usize; 3], order: u32| {
        let mesh = format!("]\norder = {order}\nfile = {:?}", graded([0.2, 0.2, 0.1], cells, [0.12, 0.14]));
        let tissue = "energy = \"linear\"\nE = 15e3\nnu = 0.3";
        let scene = pad(&mesh, tissue, "path = [[0, 0, 0.04]]\nradius = 0.04\nstiffness = 1e9");
        let mut sim = sim(&scene.replace("method = \"newton\"\ntolerance = 1e-11", "tolerance = 1e-9"));
        press(&mut sim, [0.0, 0.0, -6e-4]);
        let force = get(&sim, "contact.force")[2];
        let reached = 6e-4 - get(&sim, "contact.depth")[0];
        let wanted = bonded_layer(15e3, 0.3, 0.04, 0.1, reached);
        println!("ball on a layer, {cells:?} cells of order {order}: {force:.5} N, closed form {wanted:.5} N");
        force / wanted - 1.0
    };
    let (coarse, fine, quadratic) = (excess([16, 16, 9], 1), excess([24, 24, 14], 1), excess([12, 12, 7], 2));
    assert!(fine > 0.0 && coarse / fine > 1.8, "too stiff by {coarse} and, 1.5 times as fine, by {fine}");
    assert!(quadratic.abs() < 0.09, "quadratic elements are too stiff by {quadratic}");
}

#[test]
fn what_the_shape_feels_the_base_feels_too() {
    let contact = "path = [[-0.01, 0.01, 0.035], [0.01, 0.015, 0.031], [0.03, 0.03, 0.034]]\nradius = 0.01";
    let mut sim = sim(&pad(SMALL, "E = 15e3\nnu = 0.4", contact));
    set(&mut sim, "bone.rotation", 3, &[0.1, -0.05, 0.3]);
    press(&mut sim, [0.001, -0.0005, -0.003]);
    let force = sum(&sim, "bone.reactionForce");
    let felt = Vec3::from_column_slice(&get(&sim, "contact.force"));
    assert!(felt.norm() > 0.1 && force.norm() < 1e-6 * felt.norm(), "{force} of {felt}");
    let (forces, torques) = (rows(&get(&sim, "bone.reactionForce")), rows(&get(&sim, "bone.reactionTorque")));
    let (pivots, ways) = (rows(&get(&sim, "bone.pivot")), rows(&get(&sim, "bone.translation")));
    let about_origin: Vec3 = (0..2).map(|b| torques[b] + (pivots[b] + ways[b]).cross(&forces[b])).sum();
    assert!(about_origin.norm() < 1e-6 * 0.04 * felt.norm(), "{about_origin}");
}

/// All bones and the probe turned as one: nothing is strained anew.
#[test]
fn a_common_motion_of_pad_and_shape_changes_no_force() {
    let scene = pad(SMALL, "E = 15e3\nnu = 0.4", "path = [[0.02, 0.02, 0.029]]\nradius = 0.01");
    let mut sim = sim(&scene
        .replace("drive = \"held\"\n", "pivot = [0, 0, 0]\n")
        .replace("nodes = \"none\"\n", "nodes = \"none\"\npivot = [0, 0, 0]\n"));
    sim.initialise().expect("pressed from the start");
    let force = Vec3::from_column_slice(&get(&sim, "contact.force"));
    let place = rows(&get(&sim, "skin.position"));
    let turn = [0.4, -0.7, 0.2];
    set(&mut sim, "bone.translation", 0, &[0.01, 0.02, -0.03, 0.01, 0.02, -0.03]);
    set(&mut sim, "bone.rotation", 0, &[turn, turn].concat());
    sim.step(0.1).expect("a turn");
    let R = cutis::math::exp_rotation(&Vec3::from(turn));
    let turned = Vec3::from_column_slice(&get(&sim, "contact.force"));
    assert!(force.norm() > 0.1 && (turned - R * force).norm() < 1e-6 * force.norm(), "{turned} from {force}");
    let way = Vec3::new(0.01, 0.02, -0.03);
    let there = rows(&get(&sim, "skin.position"));
    assert!(largest(there.iter().zip(&place).map(|(x, X)| (x - way - R * X).norm())) < 1e-9);
}

/// A ball that a host throws through a thin flap in one step: it takes the flap along, as it does in small steps.
#[test]
fn a_shape_does_not_jump_through_tissue() {
    let scene = |steps: u32| {
        let mesh = ".block]\nsize = [0.06, 0.02, 0.004]\ncells = [24, 8, 2]";
        let text = pad(mesh, "E = 50e3\nnu = 0.3", "path = [[0.055, 0.01, 0.0105]]\nradius = 0.006");
        let mut sim = sim(&text.replace("z_min", "x_min").replace("method = \"newton\"\n", ""));
        let mut pieces = 0;
        for k in 1..=steps {
            let part = f64::from(k) / f64::from(steps);
            set(&mut sim, "bone.translation", 3, &[0.0, 0.0, -0.02 * part]);
            pieces += sim.step(0.1).expect("the flap gives way").substeps;
        }
        (get(&sim, "contact.force"), pieces)
    };
    let ((once, pieces), (slowly, _)) = (scene(1), scene(40));
    assert!(pieces > 5, "the step was cut into {pieces}");
    assert!(once[2] > 1e-3 && (once[2] / slowly[2] - 1.0).abs() < 1e-6, "{once:?}, in small steps {slowly:?}");
}

/// Far from the tissue a shape goes where it likes in one piece; on its way in it is slowed only where it touches.
#[test]
fn a_shape_in_the_air_costs_no_pieces() {
    let mut sim = sim(&pad(SMALL, "E = 15e3\nnu = 0.4", "path = [[0.02, 0.02, 0.031]]\nradius = 0.01"));
    let mut go = |way: [f64; 3]| {
        set(&mut sim, "bone.translation", 3, &way);
        sim.step(0.1).expect("a step")
    };
    let far = go([0.0, 0.0, 0.5]);
    assert_eq!((far.substeps, far.warnings.len()), (1, 0), "away from it");
    assert_eq!(go([0.4, 0.3, 0.5]).substeps, 1, "aside");
    assert_eq!(go([0.0, 0.0, 0.02]).substeps, 1, "back above it");
    let near = go([0.0, 0.0, -0.003]);
    assert!((2..=6).contains(&near.substeps) && near.warnings.is_empty(), "{near:?}");
    go([0.0, 0.0, 0.5]);
    let fast = go([0.0, 0.0, -0.004]);
    assert!(fast.warnings.iter().any(|w| w.contains("may have passed tissue")), "{fast:?}");
}

#[test]
fn tissue_that_would_lie_too_deep_is_refused_and_the_state_stays() {
    let soft = "path = [[0.02, 0.02, 0.031]]\nradius = 0.01\nstiffness = 1e3";
    let mut sim = sim(&pad(SMALL, "E = 15e3\nnu = 0.4", soft));
    sim.initialise().expect("it starts outside");
    let before = sim.save();
    set(&mut sim, "bone.translation", 3, &[0.0, 0.0, -0.008]);
    let message = sim.step(0.1).expect_err("the ball sinks in").to_string();
    assert!(message.contains("contact `c`") && message.contains("5.00e-3 m"), "{message}");
    set(&mut sim, "bone.translation", 3, &[0.0; 3]);
    assert_eq!(sim.save(), before);
}

/// A plate that is pressed on and dragged along: it sticks, then slides under mu times the force, and sticks on its way back.
#[test]
fn a_plate_drags_what_it_presses_on_by_coulombs_law() {
    let scene = pad(SMALL, SOFT, &format!("{PLATE}\nfriction = 0.4"));
    let mut sim = sim(&scene.replace("method = \"newton\"\ntolerance = 1e-11", "tolerance = 1e-9"));
    let mut go = |x: f64, z: f64| {
        press(&mut sim, [x, 0.0, z]);
        let force = get(&sim, "contact.force");
        (-force[0], force[2])
    };
    go(0.0, -1e-3);
    let (along, _) = go(0.0, -2e-3);
    assert!(along.abs() < 1e-6, "nothing drags yet: {along}");
    let (first, _) = go(1e-4, -2e-3);
    let (twice, normal) = go(2e-4, -2e-3);
    assert!((twice / first - 2.0).abs() < 0.02 && twice < 0.4 * normal, "it sticks: {first}, {twice} of {normal}");
    let (back, _) = go(0.0, -2e-3);
    assert!(back.abs() < 0.02 * first, "and is let go without a loss: {back}");
    for k in 1..=6 {
        go(2e-3 * f64::from(k), -2e-3);
    }
    let (slides, normal) = go(14e-3, -2e-3);
    assert!((slides / (0.4 * normal) - 1.0).abs() < 1e-6, "it slides: {slides} of {normal}");
    let (turned, normal) = go(13.9e-3, -2e-3);
    assert!(turned < 0.99 * 0.4 * normal, "on its way back it sticks: {turned} of {normal}");
    let felt = get(&sim, "bone.reactionForce");
    let all = Vec3::new(felt[0] + felt[3], felt[1] + felt[4], felt[2] + felt[5]);
    assert!(all.norm() < 1e-5, "the base holds what is dragged: {all}");
}

#[test]
fn a_restored_stroke_goes_on_bit_for_bit() {
    let scene = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenes/contact_friction.toml");
    let stroke = |sim: &mut Sim, k: u32| {
        set(sim, "bone.translation", 3, &[0.0, 0.002 * f64::from(k), -0.003]);
        sim.step(0.25).expect("a step");
    };
    let model = std::sync::Arc::new(cutis::load::from_file(&scene).expect("a scene").model);
    let mut sim = Sim::new(model.clone()).expect("a simulation");
    (0..3).for_each(|k| stroke(&mut sim, k));
    let bytes = sim.save().to_bytes(&model);
    let mut other = Sim::new(model.clone()).expect("a simulation");
    other.restore(&cutis::sim::State::from_bytes(&bytes, &model).expect("its own state")).expect("its own state");
    assert_eq!(get(&other, "contact.force"), get(&sim, "contact.force"));
    for k in 3..6 {
        stroke(&mut sim, k);
        stroke(&mut other, k);
        assert_eq!(sim.positions(), other.positions());
    }
}

/// A loose pad falls onto a table, and comes to lie on it with its weight.
#[test]
fn a_pad_that_falls_on_a_table_rests_on_it_with_its_weight() {
    let scene = "[mesh.block]\nsize = [0.02, 0.02, 0.01]\ncells = [4, 4, 2]\n[[tissue]]\nE = 15e3\nnu = 0.3\n[[bone]]\n\
        name = \"table\"\nnodes = \"none\"\ndrive = \"held\"\n[[contact]]\nname = \"top\"\nbone = \"table\"\n\
        point = [0, 0, -0.002]\nnormal = [0, 0, 1]\nfaces = \"z_min\"\n[gravity]\n[inertia]\nstart = \"rest\"\ndamping_mass = 4.0\n";
    let mut sim = sim(scene);
    sim.initialise().expect("at rest");
    let mut bounced = 0.0_f64;
    for _ in 0..400 {
        sim.step(0.005).expect("a fall");
        bounced = bounced.max(get(&sim, "contact.force")[2].abs());
    }
    let weight = 1000.0 * 0.02 * 0.02 * 0.01 * 9.80665;
    let force = get(&sim, "contact.force");
    assert!(bounced > 1.5 * weight, "it lands harder than it lies: {bounced}");
    assert!((-force[2] / weight - 1.0).abs() < 1e-3, "{force:?}, weight {weight}");
}

/// A jaw that forces drive, with a tooth that presses on the other side: all it is given, tissue and tooth take.
#[test]
fn a_tooth_on_a_jaw_that_forces_drive_feels_the_rest_of_them() {
    let scene = "[mesh.block]\nsize = [0.06, 0.02, 0.02]\ncells = [12, 4, 4]\n[[tissue]]\nE = 15e3\nnu = 0.4\n[[bone]]\n\
        name = \"skull\"\nnodes = \"x_min\"\ndrive = \"held\"\n[[bone]]\nname = \"jaw\"\nnodes = \"x_max\"\ndrive = \"force\"\n\
        [[contact]]\nname = \"tooth\"\nbone = \"jaw\"\npath = [[0.06, 0.01, 0.0262], [0.035, 0.01, 0.0262]]\nradius = 0.006\n\
        [solver]\nmethod = \"newton\"\ntolerance = 1e-11\n";
    let mut sim = sim(scene);
    set(&mut sim, "bone.force", 3, &[-0.05, 0.01, -0.02]);
    set(&mut sim, "bone.torque", 3, &[1e-4, -4e-4, 2e-4]);
    sim.step(0.1).expect("held by the tissue");
    let (force, torque) = (get(&sim, "bone.reactionForce"), get(&sim, "bone.reactionTorque"));
    let tooth = Vec3::from_column_slice(&get(&sim, "contact.force"));
    assert!(tooth.norm() > 1e-3, "the tooth touches: {tooth}");
    let left = |felt: &[f64], given: [f64; 3]| (Vec3::from_column_slice(&felt[3..]) + Vec3::from(given)).norm();
    assert!(left(&force, [-0.05, 0.01, -0.02]) < 1e-7, "{force:?}");
    assert!(left(&torque, [1e-4, -4e-4, 2e-4]) < 1e-9, "{torque:?}");
}

/// Both with friction that holds and with friction that slides.
#[test]
fn derivatives_know_of_friction() {
    for (mu, way) in [(5.0, 2e-4), (0.2, 6e-3)] {
        let contact = format!("path = [[0.0, 0.01, 0.034], [0.02, 0.022, 0.029]]\nradius = 0.01\nfriction = {mu:?}");
        let scene = pad(SMALL, "E = 15e3\nnu = 0.4", &contact);
        let mut sim = sim(&scene.replace("tolerance = 1e-11", "tolerance = 1e-12\nmax_iterations = 2000"));
        press(&mut sim, [0.0, 0.0, -0.002]);
        press(&mut sim, [0.0, 0.5 * way, -0.002]);
        compare(&mut sim, [0.0, way, -0.002], 1e-3);
    }
}

/// `<w, J v>` from one side and `<J' w, v>` from the other, and both from differences of whole steps.
#[test]
fn derivatives_know_of_contacts() {
    let contact = "path = [[0.0, 0.01, 0.034], [0.02, 0.022, 0.029]]\nradius = 0.01";
    let mut sim = sim(&pad(SMALL, "E = 15e3\nnu = 0.4", contact));
    compare(&mut sim, [0.0003, 0.0, -0.002], 1e-4);
}

/// Takes the probe to `to` in one step, and compares derivatives there.
fn compare(sim: &mut Sim, to: [f64; 3], slack: f64) {
    let before = sim.save();
    press(sim, to);
    let (input, outputs) =
        (port(sim, "bone.translation"), ["skin.position", "bone.reactionForce", "bone.reactionTorque"]);
    let unknowns = outputs.map(|name| port(sim, name));
    let seed = [0.0, 0.0, 0.0, 0.3, -0.2, 1.0];
    let n: usize = unknowns.iter().map(|&u| sim.model().ports()[u].len()).sum();
    let mut forward = vec![0.0; n];
    sim.directional_derivative(&[input], &seed, &unknowns, &mut forward).expect("a derivative");
    let skin = n - 12;
    let w: Vec<f64> = (0..n).map(|i| if i < skin { (i as f64).sin() } else { 1e-3 * (i as f64).cos() }).collect();
    let mut back = vec![0.0; 6];
    sim.adjoint_derivative(&unknowns, &w, &[input], &mut back).expect("an adjoint");
    let (one, other): (f64, f64) =
        (w.iter().zip(&forward).map(|(w, j)| w * j).sum(), back.iter().zip(seed).map(|(b, s)| b * s).sum());
    let size: f64 = w.iter().zip(&forward).map(|(w, j)| (w * j).abs()).sum();
    assert!((one - other).abs() < 1e-6 * size, "{one} forward, {other} back, of {size}");
    let start = get(sim, "bone.translation");
    let h = 1e-7;
    let mut side = |h: f64| {
        sim.restore(&before).expect("its own state");
        let moved: Vec<f64> = start.iter().zip(seed).map(|(v, s)| v + h * s).collect();
        set(sim, "bone.translation", 0, &moved);
        sim.step(0.1).expect("nearby");
        outputs.iter().flat_map(|name| get(sim, name)).collect::<Vec<f64>>()
    };
    let (plus, minus) = (side(h), side(-h));
    for (part, name) in [(0..skin, "skin"), (skin..n - 6, "force"), (n - 6..n, "torque")] {
        let scale = largest(forward[part.clone()].iter().copied());
        let error = largest(part.map(|i| (plus[i] - minus[i]) / (2.0 * h) - forward[i]));
        assert!(error < slack * scale, "{name}: off by {error:.1e} of {scale:.1e}");
    }
}

#[test]
fn slips_in_contacts_are_answered() {
    let good = pad(SMALL, "E = 15e3\nnu = 0.4", "path = [[0.02, 0.02, 0.04]]\nradius = 0.01");
    for (from, to, wanted) in [
        ("radius = 0.01", "radius = 0.0", "> 0"),
        ("radius = 0.01", "", "either a tube, of `path` and `radius`, or a half-space"),
        ("radius = 0.01", "radius = 0.01\npoint = [0, 0, 0]", "either a tube"),
        ("[[0.02, 0.02, 0.04]]", "[]", "at least one"),
        ("[[0.02, 0.02, 0.04]]", "[[0, 0, 1], [0, 0, 1]]", "none twice in a row"),
        ("path = [[0.02, 0.02, 0.04]]\nradius = 0.01", "point = [0, 0, 1]\nnormal = [0, 0, 0]", "no length"),
        ("bone = \"probe\"", "bone = \"finger\"", "unknown bone `finger`, expected `base`, `probe`"),
        ("radius = 0.01", "radius = 0.01\nfaces = \"sky\"", "unknown face set `sky`"),
        ("radius = 0.01", "radius = 0.01\nfaces = \"z_min\"", "can touch no part of `z_min` that is free"),
        ("nodes = \"none\"", "nodes = \"none\"\ndrive = \"displacement\"", "a rigid shape wants one pose"),
        ("nodes = \"none\"", "nodes = \"none\"\ndrive = \"force\"", "nothing would hold it but contact"),
        ("bone = \"probe\"", "bone = \"base\"", "no tissue sticks to bone `probe` and no [[contact]] is its own"),
    ] {
        let message = refused(&good.replacen(from, to, 1));
        assert!(message.contains(wanted), "`{wanted}` is missing from:\n{message}");
    }
    let fine = sim(&good.replace("radius = 0.01", "radius = 0.003"));
    assert!(fine.model().warnings().iter().any(|w| w.contains("cannot close around")), "{:?}", fine.model().warnings());
    let names: Vec<&str> = fine.model().ports().iter().map(|p| p.name.as_str()).collect();
    assert!(names.contains(&"contact.force") && names.contains(&"contact.depth"));
}
