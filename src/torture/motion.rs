//! Bones and forces that move far, fast, or back and forth.

use super::scene::Block;
use super::trial::{End, Tally, Trial, fail};
use super::{Case, FOLDING, LAWS, LINEAR, NONE};
use crate::math::{Vec3, exp_rotation};

/// Distance that counts as the same place, m: ten times the tolerance of the solver.
const SAME: f64 = 1e-6;
/// The promise of a way back, m: the tolerance of the solver.
const BACK: f64 = 1e-7;
/// A host step, s.
const DT: f64 = 0.1;

const fn case(name: &'static str, what: &'static str, body: fn(&str, &mut Tally) -> Result<(), End>) -> Case {
    Case { name, what, laws: LAWS, may_invert: LINEAR, may_refuse: NONE, body }
}

pub const CASES: &[Case] = &[
    case("twist-360", "Twists the jaw by a full turn and back, 10 degrees a step; ends at rest.", twist),
    Case {
        may_refuse: FOLDING,
        ..case(
            "compress-30",
            "Presses the block to 30 % of its length, 5 % a step, and lets go; half its length is answered, the rest may be refused; ends at rest.",
            compress,
        )
    },
    case(
        "carried",
        "Turns both bones by 120 degrees in one step, then back; tissue that knows rotations goes with them.",
        carried,
    ),
    case(
        "jump",
        "Pulls the jaw by 5 cm and turns it by 90 degrees in one step; ends where twenty small steps end.",
        jump,
    ),
    case(
        "ball",
        "Drives a ball 15 mm into the block in one step; ends where twenty small steps end; drawn off in one, at rest.",
        ball,
    ),
    Case {
        may_refuse: FOLDING,
        ..case("force-1e4", "Pushes with 1e4 times the force, answered or refused, then lets go; ends at rest.", force)
    },
    Case {
        may_invert: NONE,
        ..case("alternate", "Turns the load around at every step; each answer is as the first.", alternate)
    },
    Case {
        may_invert: NONE,
        ..case("unload", "Moves the jaw and pushes, then lets go; ends at rest to 1e-7 m.", unload)
    },
];

fn twist(law: &str, tally: &mut Tally) -> Result<(), End> {
    let mut trial = Trial::new(&Block::of(law).text(), tally)?;
    for k in (1..=36).chain((0..36).rev()) {
        trial.jaw([0.0; 3], [10.0_f64.to_radians() * f64::from(k), 0.0, 0.0])?;
        trial.step(DT)?;
    }
    trial.near(trial.rest(), SAME, "rest")
}

fn compress(law: &str, tally: &mut Tally) -> Result<(), End> {
    let scene = Block::of(law);
    let mut trial = Trial::new(&scene.text(), tally)?;
    let mut refused = None;
    for k in 1..=14 {
        trial.jaw([-0.05 * f64::from(k) * scene.size()[0], 0.0, 0.0], [0.0; 3])?;
        match trial.try_step(DT)? {
            Some(message) if k <= 10 => return fail(format!("refused at {} %: {message}", 100 - 5 * k)),
            Some(message) => {
                refused = Some(message);
                break;
            }
            None => {}
        }
    }
    trial.jaw([0.0; 3], [0.0; 3])?;
    trial.step(DT)?;
    trial.near(trial.rest(), SAME, "rest")?;
    refused.map_or(Ok(()), |message| Err(End::Refused(message)))
}

fn carried(law: &str, tally: &mut Tally) -> Result<(), End> {
    let mut trial = Trial::new(&Block::of(law).text(), tally)?;
    // The pivots are the middles of two ends, so that turns about x carry the block as one.
    let pivot = 0.5 * Vec3::from(Block::of(law).size());
    for angle in [120.0_f64, 0.0] {
        let w = Vec3::new(angle.to_radians(), 0.0, 0.0);
        trial.set("bone.rotation", 0, &[w.x, w.y, w.z, w.x, w.y, w.z])?;
        trial.step(DT)?;
        if law != "linear" {
            let carried: Vec<Vec3> = trial.rest().iter().map(|X| pivot + exp_rotation(&w) * (X - pivot)).collect();
            trial.near(&carried, SAME, "where the bones carry it")?;
        }
    }
    trial.near(trial.rest(), SAME, "rest")
}

fn jump(law: &str, tally: &mut Tally) -> Result<(), End> {
    let scene = Block::of(law).text();
    let mut slow_tally = Tally::default();
    let mut slow = Trial::new(&scene, &mut slow_tally)?;
    let mut trial = Trial::new(&scene, tally)?;
    let pose = |part: f64| ([0.05 * part, 0.0, 0.0], [90.0_f64.to_radians() * part, 0.0, 0.0]);
    let (t, w) = pose(1.0);
    trial.jaw(t, w)?;
    trial.step(DT)?;
    for k in 1..=20 {
        let (t, w) = pose(f64::from(k) / 20.0);
        slow.jaw(t, w)?;
        slow.step(DT)?;
    }
    trial.near(slow.sim.positions(), SAME, "where small steps lead")
}

fn ball(law: &str, tally: &mut Tally) -> Result<(), End> {
    // A bone that no tissue sticks to carries it, half a millimetre above the top.
    let more = "[[bone]]\nname = \"hand\"\nnodes = \"none\"\n[[contact]]\nname = \"ball\"\nbone = \"hand\"\n\
                path = [[0.03, 0.02, 0.0425]]\nradius = 0.012\n";
    let scene = Block { more, ..Block::of(law) }.text();
    let mut slow_tally = Tally::default();
    let mut slow = Trial::new(&scene, &mut slow_tally)?;
    let mut trial = Trial::new(&scene, tally)?;
    let hand = |trial: &mut Trial, depth: f64| trial.set("bone.translation", 6, &[0.0, 0.0, -depth]);
    hand(&mut trial, 0.015)?;
    trial.step(DT)?;
    for k in 1..=20 {
        hand(&mut slow, 0.015 * f64::from(k) / 20.0)?;
        slow.step(DT)?;
    }
    trial.near(slow.sim.positions(), SAME, "where small steps lead")?;
    hand(&mut trial, -0.01)?;
    trial.step(DT)?;
    // The last four nodes are the ball's.
    trial.near(&trial.rest()[..trial.rest().len() - 4], SAME, "rest")
}

fn force(law: &str, tally: &mut Tally) -> Result<(), End> {
    let mut trial = Trial::new(&Block::of(law).text(), tally)?;
    trial.push([0.0, 0.0, -0.1])?;
    trial.step(DT)?;
    trial.push([0.0, 0.0, -0.1e4])?;
    let refused = trial.try_step(DT)?;
    trial.push([0.0; 3])?;
    trial.step(DT)?;
    trial.near(trial.rest(), SAME, "rest")?;
    refused.map_or(Ok(()), |message| Err(End::Refused(message)))
}

fn alternate(law: &str, tally: &mut Tally) -> Result<(), End> {
    let mut trial = Trial::new(&Block::of(law).text(), tally)?;
    let mut first = [Vec::new(), Vec::new()];
    for k in 0..40 {
        trial.push([0.0, if k % 2 == 0 { 0.5 } else { -0.5 }, 0.0])?;
        trial.step(DT)?;
        if k < 2 {
            first[k] = trial.sim.positions().to_vec();
        }
        trial.near(&first[k % 2], SAME, "the first answer to this load")?;
    }
    Ok(())
}

fn unload(law: &str, tally: &mut Tally) -> Result<(), End> {
    let mut trial = Trial::new(&Block::of(law).text(), tally)?;
    trial.jaw([0.01, 0.005, 0.0], [0.2, 0.0, 0.3])?;
    trial.push([0.0, 0.0, -0.3])?;
    trial.step(DT)?;
    trial.jaw([0.0; 3], [0.0; 3])?;
    trial.push([0.0; 3])?;
    trial.step(DT)?;
    trial.near(trial.rest(), BACK, "rest")
}
