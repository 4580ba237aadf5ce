//! Steps of all lengths, and very many of them.

use super::scene::Block;
use super::trial::{End, Tally, Trial};
use super::{Case, LAWS, NONE, ONE_LAW};

/// Distance that counts as the same place, m: ten times the tolerance of the solver.
const SAME: f64 = 1e-6;
/// Drift allowed over all cycles, m.
const DRIFT: f64 = 1e-7;
const CYCLES: usize = 500;
const STEPS_A_CYCLE: usize = 20;
const INERTIA: &str = "[inertia]\nstart = \"rest\"\n";

pub const CASES: &[Case] = &[
    Case {
        name: "dt-1e-6-to-1e3",
        what: "Moves the jaw within a second, with inertia and steps from 1e-6 to 1e3 s and back; ends in equilibrium.",
        laws: LAWS,
        may_invert: NONE,
        may_refuse: NONE,
        body: dt,
    },
    Case {
        name: "ten-thousand-steps",
        what: "Opens and closes the jaw 500 times, 20 steps a cycle; each cycle is as the first to 1e-7 m.",
        laws: LAWS,
        may_invert: NONE,
        may_refuse: NONE,
        body: cycles,
    },
    Case {
        name: "zero-length-steps",
        what: "Steps of 0, -1, NaN and infinitely many seconds; each is refused.",
        laws: ONE_LAW,
        may_invert: NONE,
        may_refuse: ONE_LAW,
        body: zero,
    },
    Case {
        name: "vanishing-steps",
        what: "Steps of 1e-200 and 1e200 s with inertia, answered or refused, then a common one.",
        laws: LAWS,
        may_invert: NONE,
        may_refuse: LAWS,
        body: vanishing,
    },
];

fn dt(law: &str, tally: &mut Tally) -> Result<(), End> {
    let mut still_tally = Tally::default();
    let mut still = Trial::new(&Block::of(law).text(), &mut still_tally)?;
    still.jaw([0.005, 0.0, 0.005], [0.0; 3])?;
    still.step(1.0)?;
    let mut trial = Trial::new(&Block { more: INERTIA, ..Block::of(law) }.text(), tally)?;
    for exponent in (-6..=3).chain((-6..3).rev()).chain([3]) {
        let dt = 10.0_f64.powi(exponent);
        let part = (trial.sim.time() + dt).min(1.0);
        trial.jaw([0.005 * part, 0.0, 0.005 * part], [0.0; 3])?;
        trial.step(dt)?;
    }
    trial.near(still.sim.positions(), SAME, "equilibrium")
}

fn cycles(law: &str, tally: &mut Tally) -> Result<(), End> {
    let mut trial = Trial::new(&Block { cells: [2, 1, 1], ..Block::of(law) }.text(), tally)?;
    let mut first: Vec<Vec<_>> = Vec::new();
    for step in 0..CYCLES * STEPS_A_CYCLE {
        let k = step % STEPS_A_CYCLE;
        let angle = 0.3 * (std::f64::consts::TAU * (k + 1) as f64 / STEPS_A_CYCLE as f64).sin();
        trial.jaw([0.005 * angle, 0.0, -0.01 * angle], [0.0, angle, 0.0])?;
        trial.step(0.01)?;
        if step < STEPS_A_CYCLE {
            first.push(trial.sim.positions().to_vec());
        }
        trial.near(&first[k], DRIFT, "the first cycle")?;
    }
    Ok(())
}

fn zero(law: &str, tally: &mut Tally) -> Result<(), End> {
    let mut trial = Trial::new(&Block::of(law).text(), tally)?;
    let mut message = String::new();
    for dt in [0.0, -0.0, -1.0, f64::NAN, f64::INFINITY] {
        message = trial.refusal(dt, "positive, finite")?;
    }
    Err(End::Refused(message))
}

fn vanishing(law: &str, tally: &mut Tally) -> Result<(), End> {
    let mut trial = Trial::new(&Block { more: INERTIA, ..Block::of(law) }.text(), tally)?;
    trial.jaw([0.0, 0.0, 1e-3], [0.0; 3])?;
    trial.step(0.1)?;
    let mut refused = None;
    for dt in [1e-200, 1e200, f64::MIN_POSITIVE / 4.0, f64::MAX] {
        refused = trial.try_step(dt)?.or(refused);
    }
    trial.step(0.01)?;
    refused.map_or(Ok(()), |message| Err(End::Refused(message)))
}
