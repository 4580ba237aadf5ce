//! Starts from anywhere: the bones at rest, the tissue not. The truth is the rest state.

use super::scene::Block;
use super::trial::{End, Tally, Trial, fail};
use super::{Case, LAWS, NONE};
use crate::math::{Random, Vec3};

/// Distance from rest that counts as there, m: ten times the tolerance of the solver.
const AT_REST: f64 = 1e-6;
/// Scrambled starts, each with its own seed.
const SEEDS: u64 = 8;

const fn start(name: &'static str, what: &'static str, body: fn(&str, &mut Tally) -> Result<(), End>) -> Case {
    Case { name, what, laws: LAWS, may_invert: NONE, may_refuse: NONE, body }
}

pub const CASES: &[Case] = &[
    start(
        "start-inverted",
        "Reflects the free nodes through the centre; the rest state must come back.",
        |law, tally| recover(law, tally, |x, c| 2.0 * c - x),
    ),
    start("start-mirrored", "Mirrors the free nodes in a plane; the rest state must come back.", |law, tally| {
        recover(law, tally, |x, c| Vec3::new(x.x, x.y, 2.0 * c.z - x.z))
    }),
    start("start-plane", "Collapses the free nodes to a plane; the rest state must come back.", |law, tally| {
        recover(law, tally, |x, c| Vec3::new(x.x, x.y, c.z))
    }),
    start("start-line", "Collapses the free nodes to a line; the rest state must come back.", |law, tally| {
        recover(law, tally, |x, c| Vec3::new(x.x, c.y, c.z))
    }),
    start("start-point", "Collapses the free nodes to a point; the rest state must come back.", |law, tally| {
        recover(law, tally, |_, c| c)
    }),
    start(
        "start-scrambled",
        "Throws the free nodes anywhere into the box, eight times; the rest state must come back.",
        scrambled,
    ),
    start(
        "start-scrambled-moved",
        "The same with the jaw moved by 12 mm; the equilibrium reached from rest must come back.",
        scrambled_moved,
    ),
    start("start-blown-up", "Blows the free nodes up tenfold; the rest state must come back.", |law, tally| {
        recover(law, tally, |x, c| c + 10.0 * (x - c))
    }),
];

fn recover(law: &str, tally: &mut Tally, place: fn(Vec3, Vec3) -> Vec3) -> Result<(), End> {
    let scene = Block::of(law);
    let mut trial = Trial::new(&scene.text(), tally)?;
    let centre = 0.5 * Vec3::from(scene.size());
    let x: Vec<Vec3> = trial.rest().iter().map(|X| place(*X, centre)).collect();
    trial.start_from(&x)?;
    trial.step(0.1)?;
    trial.near(trial.rest(), AT_REST, "rest")
}

fn scrambled(law: &str, tally: &mut Tally) -> Result<(), End> {
    scramble(law, tally, [0.0; 3])
}

fn scrambled_moved(law: &str, tally: &mut Tally) -> Result<(), End> {
    scramble(law, tally, [0.006, 0.0, 0.01])
}

fn scramble(law: &str, tally: &mut Tally, jaw: [f64; 3]) -> Result<(), End> {
    let scene = Block::of(law);
    let (size, text) = (Vec3::from(scene.size()), scene.text());
    let mut elsewhere = Vec::new();
    for seed in 1..=SEEDS {
        let mut random = Random(seed);
        let mut trial = Trial::new(&text, tally)?;
        trial.jaw(jaw, [0.0; 3])?;
        trial.step(0.1)?;
        let wanted = trial.sim.positions().to_vec();
        let x: Vec<Vec3> = wanted.iter().map(|_| size.component_mul(&random.vector())).collect();
        trial.start_from(&x)?;
        trial.step(0.1)?;
        if let Err(End::Fail(message)) = trial.near(&wanted, AT_REST, "the equilibrium") {
            elsewhere.push(format!("seed {seed} {message}"));
        }
    }
    if elsewhere.is_empty() { Ok(()) } else { fail(elsewhere.join("; ")) }
}
