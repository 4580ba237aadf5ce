//! What the model description declares is answered: every derivative of every output by every input and tunable parameter, in
//! every scene there is, also right after a state was restored; and every velocity of what has one.

use std::path::Path;
use std::sync::Arc;

use cutis::port::{Causality, Port, Type};
use cutis::sim::{Sim, State};

use crate::common::{Random, get, port, set, sim};

/// Part of `<w, Jv>` by which the transposed may differ.
const CLOSE: f64 = 1e-6;
/// The same where a contact's pressure has kinks, which a difference of gradients steps over.
const CLOSE_IN_CONTACT: f64 = 1e-4;
/// What is no more than that part of a nominal value is round-off.
const NOISE: f64 = 1e-8;

fn scenes() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenes");
    let files = std::fs::read_dir(folder).expect("the scenes").filter_map(|f| Some(f.ok()?.path()));
    let mut files: Vec<_> = files.filter(|f| f.extension().is_some_and(|e| e == "toml")).collect();
    files.sort();
    assert!(files.len() > 30);
    files.into_iter().map(|f| f.display().to_string()).collect()
}

fn ports(sim: &Sim, wanted: &[Causality]) -> Vec<usize> {
    let is_one = |p: &Port| p.ty == Type::Float64 && wanted.contains(&p.causality);
    (0..sim.model().ports().len()).filter(|&k| is_one(&sim.model().ports()[k])).collect()
}

fn unknowns(sim: &Sim) -> Vec<usize> {
    ports(sim, &[Causality::Output])
}

fn knowns(sim: &Sim) -> Vec<usize> {
    ports(sim, &[Causality::Input, Causality::TunableParameter])
}

fn len(sim: &Sim, ports: &[usize]) -> usize {
    ports.iter().map(|&k| sim.model().ports()[k].len()).sum()
}

/// A seed of the size that the values of these ports have in life; rows that no input moves stay zero.
fn seed(sim: &Sim, ports: &[usize], random: &mut Random) -> Vec<f64> {
    let of = |&k: &usize| {
        let p = &sim.model().ports()[k];
        (0..p.len()).map(|i| (i, p)).collect::<Vec<_>>().into_iter().map(move |(i, p)| (k, i, p.nominal))
    };
    let elements: Vec<_> = ports.iter().flat_map(of).collect();
    let legal = |k: usize, i: usize| sim.check_f64(k, i, &[1.0]).is_ok();
    elements.into_iter().map(|(k, i, size)| if legal(k, i) { size * random.number() } else { 0.0 }).collect()
}

/// Every output by every input, alone and all at once: answered, and one the transpose of the other. Returns all directions.
fn answers(name: &str, sim: &mut Sim, planted: f64) -> Vec<f64> {
    let (outputs, inputs) = (unknowns(sim), knowns(sim));
    let mut random = Random(3);
    let mut all = Vec::new();
    for known in inputs.iter().map(|&k| vec![k]).chain([inputs.clone()]) {
        let v = seed(sim, &known, &mut random);
        for unknown in outputs.iter().map(|&k| vec![k]).chain([outputs.clone()]) {
            let told = |sim: &Sim, ports: &[usize]| {
                ports.iter().map(|&k| sim.model().ports()[k].name.clone()).collect::<Vec<_>>()
            };
            let what = format!("{name}: {:?} by {:?}", told(sim, &unknown), told(sim, &known));
            let mut Jv = vec![0.0; len(sim, &unknown)];
            sim.directional_derivative(&known, &v, &unknown, &mut Jv).unwrap_or_else(|e| panic!("{what}: {e}"));
            assert!(Jv.iter().all(|x| x.is_finite()), "{what}");
            // In sizes that values have in life, of which a little is round-off.
            let sizes: Vec<f64> = unknown
                .iter()
                .flat_map(|&k| vec![sim.model().ports()[k].nominal; sim.model().ports()[k].len()])
                .collect();
            let scale = Jv.iter().zip(&sizes).fold(1e-30_f64, |m, (x, s)| m.max((x / s).abs()));
            let weigh = |(x, s): (&f64, &f64)| (x / s / scale + 0.1 * random.number()) / s;
            let w: Vec<f64> = Jv.iter().zip(&sizes).map(weigh).collect();
            let mut JTw = vec![0.0; v.len()];
            sim.adjoint_derivative(&unknown, &w, &known, &mut JTw).unwrap_or_else(|e| panic!("{what}: {e}"));
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let (one, other) = (dot(&w, &Jv), planted * dot(&JTw, &v));
            let size: f64 = w.iter().zip(&Jv).map(|(w, j)| (w * j).abs()).sum();
            let close = if sim.model().parts().contacts.is_empty() { CLOSE } else { CLOSE_IN_CONTACT };
            assert!((one - other).abs() <= close * size + NOISE, "{what}: <w, Jv> = {one:e}, <J'w, v> = {other:e}");
            all.extend(Jv);
        }
    }
    all
}

/// Runs the first steps of a scene's programme.
fn run(sim: &mut Sim, programme: &cutis::scene::Programme, steps: usize) {
    for k in 1..=steps {
        for s in programme.settings(k as f64 * programme.dt) {
            sim.set_f64(s.port, s.offset, &s.values).expect("a setting");
        }
        sim.step(programme.dt).expect("a step");
    }
}

fn every_pair(planted: f64) {
    for file in scenes() {
        let loaded = cutis::load::from_file(Path::new(&file)).expect("a scene");
        let model = Arc::new(loaded.model);
        let mut sim = Sim::new(model.clone()).expect("a simulation");
        sim.initialise().expect("a start");
        answers(&format!("{file} at the start"), &mut sim, planted);
        run(&mut sim, &loaded.programme, 2);
        let there = answers(&file, &mut sim, planted);
        // Back there from another place, and in another simulation by way of bytes.
        let saved = sim.save();
        run(&mut sim, &loaded.programme, 1);
        sim.restore(&saved).expect("its own state");
        assert_eq!(answers(&format!("{file}, restored"), &mut sim, planted), there, "{file}, restored");
        let mut other = Sim::new(model.clone()).expect("a simulation");
        other
            .restore(&State::from_bytes(&saved.to_bytes(&model), &model).expect("its own state"))
            .expect("its own state");
        assert_eq!(answers(&format!("{file}, elsewhere"), &mut other, planted), there, "{file}, elsewhere");
        assert!(other.save() == saved, "{file}: asking changes nothing");
    }
}

#[test]
fn every_declared_pair_is_answered_in_every_scene() {
    every_pair(1.0);
}

#[test]
#[should_panic(expected = "<w, Jv>")]
fn a_planted_wrong_transpose_is_found() {
    every_pair(1.001);
}

const SWING: &str = "[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [6, 4, 2]\n[[tissue]]\nE = 15e3\nnu = 0.4\n[[bone]]\n\
    name = \"skull\"\nnodes = \"x_min\"\ndrive = \"held\"\n[[bone]]\nname = \"jaw\"\nnodes = \"x_max\"\ndrive = \"force\"\n\
    [[marker]]\nname = \"mid\"\nat = [0.03, 0.02, 0.02]\n[solver]\ntolerance = 1e-11\n[inertia]\n";

/// Rates are those of what is read, to the order of the step.
fn rates(planted: f64) {
    for scheme in ["backward-euler", "bdf2", "generalised-alpha"] {
        let mut sim = sim(&format!("{SWING}scheme = \"{scheme}\"\ndamping_mass = 2.0\n"));
        sim.initialise().expect("a start");
        set(&mut sim, "bone.force", 3, &[0.05, 0.02, -0.1]);
        set(&mut sim, "bone.torque", 3, &[1e-4, 3e-4, -2e-4]);
        let dt = 2e-5;
        (0..400).for_each(|_| drop(sim.step(dt).expect("a step")));
        let names = ["skin.position", "skin.velocity", "marker.position", "bone.poseTranslation", "bone.poseRotation"];
        let told: Vec<Vec<f64>> = names
            .iter()
            .map(|name| {
                let mut out = vec![0.0; get(&sim, name).len()];
                sim.time_derivative(port(&sim, name), 0, &mut out).unwrap_or_else(|e| panic!("{name}: {e}"));
                out
            })
            .collect();
        let before: Vec<Vec<f64>> = names.iter().map(|name| get(&sim, name)).collect();
        sim.step(dt).expect("a step");
        for ((name, told), before) in names.iter().zip(told).zip(before) {
            let scale = told.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            assert!(scale > 0.0, "{name} moves");
            for (k, ((told, before), after)) in told.iter().zip(&before).zip(get(&sim, name)).enumerate() {
                let difference = (after - before) / dt;
                assert!(
                    (planted * told - difference).abs() < 0.05 * scale,
                    "{scheme}: {name}[{k}]: {told}, {difference}"
                );
            }
        }
        for name in ["bone.reactionForce", "energy.elastic", "solver.residual", "bone.force"] {
            let mut out = vec![0.0; get(&sim, name).len()];
            let why = sim.time_derivative(port(&sim, name), 0, &mut out).unwrap_err().to_string();
            assert!(why.contains(name) && why.contains("not known"), "{why}");
        }
    }
}

#[test]
fn rates_of_outputs_are_differences_in_time() {
    rates(1.0);
}

#[test]
#[should_panic(expected = "skin.position[")]
fn a_planted_wrong_rate_is_found() {
    rates(1.1);
}

/// The start at rest has moved nothing yet, so nothing depends on the inputs but themselves.
#[test]
fn the_start_at_rest_has_derivatives_too() {
    let mut sim = sim(&format!("{SWING}start = \"rest\"\n"));
    sim.initialise().expect("at rest");
    let (force, skin) = (port(&sim, "bone.force"), port(&sim, "skin.position"));
    let mut out = vec![1.0; len(&sim, &[skin, force])];
    let v = [0.0, 0.0, 0.0, 1.0, 2.0, 3.0];
    sim.directional_derivative(&[force], &v, &[skin, force], &mut out).expect("nothing moves");
    let (of_skin, of_force) = out.split_at(out.len() - 6);
    assert!(of_skin.iter().all(|x| *x == 0.0) && of_force == v);
    let saved = sim.save();
    sim.step(1e-3).expect("a step");
    sim.restore(&saved).expect("its own state");
    sim.adjoint_derivative(&[skin], &vec![1.0; of_skin.len()], &[force], &mut out[..6]).expect("nothing moves");
    assert_eq!(out[..6], [0.0; 6]);
}
