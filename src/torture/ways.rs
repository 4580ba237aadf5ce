//! Ways out and back on which tissue may be left behind on another branch: what is at rest again must be where it was.

use super::scene::{Block, tissue};
use super::trial::{End, Tally, Trial, fail};
use super::{Case, FOLDING, LAWS, NONE};

/// Distance that counts as the same place, m: ten times the tolerance of the solver.
const SAME: f64 = 1e-6;
/// A host step, s.
const DT: f64 = 0.1;
/// Laws with a wall at J = 0, which muscles at full activation ask for.
const WALLED: &[&str] = &["polyconvex-neo-hookean", "neo-hookean"];
/// Laws that know rotations.
const TURNING: &[&str] = &["corotational", "stable-neo-hookean", "polyconvex-neo-hookean", "neo-hookean", "fung"];

const fn case(name: &'static str, what: &'static str, body: fn(&str, &mut Tally) -> Result<(), End>) -> Case {
    Case { name, what, laws: TURNING, may_invert: NONE, may_refuse: NONE, body }
}

pub const CASES: &[Case] = &[
    Case {
        may_refuse: TURNING,
        ..case(
            "far-and-back",
            "Pulls the jaw away by five lengths in one step, answered or refused, and back in one; ends at rest.",
            far,
        )
    },
    Case {
        may_refuse: &["corotational", "fung"],
        ..case("two-turns", "Twists a bar by two turns, 45 degrees a step, and back; ends at rest.", two_turns)
    },
    Case {
        laws: WALLED,
        ..case(
            "corner-press",
            "Drives a ball into a free corner by 2 mm steps until it is refused, which must be before its middle is inside, and draws it off; ends at rest.",
            corner,
        )
    },
    Case {
        laws: WALLED,
        ..case(
            "ball-row",
            "Presses a row of three balls 8 mm into the top, in steps answered or refused, and lifts them; ends at rest.",
            row,
        )
    },
    Case {
        laws: WALLED,
        may_refuse: WALLED,
        ..case(
            "jammed",
            "Drives a ball against tissue on a held floor until a step is refused, and draws it off; ends at rest.",
            jammed,
        )
    },
    Case {
        laws: WALLED,
        ..case(
            "twitch",
            "Activates a muscle fully and not at all in turn, 20 times; each answer is as the first.",
            twitch,
        )
    },
    Case {
        laws: LAWS,
        may_refuse: FOLDING,
        ..case("sheet", "Shears a sheet of 0.01 mm with the iterative solver, and back to rest.", sheet)
    },
];

fn far(law: &str, tally: &mut Tally) -> Result<(), End> {
    let mut trial = Trial::new(&Block::of(law).text(), tally)?;
    trial.jaw([0.3, 0.0, 0.0], [0.0; 3])?;
    let refused = trial.try_step(DT)?;
    trial.jaw([0.0; 3], [0.0; 3])?;
    trial.step(DT)?;
    trial.near(trial.rest(), SAME, "rest")?;
    refused.map_or(Ok(()), |message| Err(End::Refused(message)))
}

fn two_turns(law: &str, tally: &mut Tally) -> Result<(), End> {
    let mut trial = Trial::new(&Block { cells: [8, 3, 3], ..Block::of(law) }.text(), tally)?;
    let mut refused = None;
    for k in (1..=16).chain((0..16).rev()) {
        trial.jaw([0.0; 3], [45.0_f64.to_radians() * f64::from(k), 0.0, 0.0])?;
        refused = trial.try_step(DT)?.or(refused);
    }
    trial.near(trial.rest(), SAME, "rest")?;
    refused.map_or(Ok(()), |message| Err(End::Refused(message)))
}

/// Balls of 10 mm that a hand holds above the block.
fn balls(places: &[[f64; 3]]) -> String {
    let ball = |(k, at): (usize, &[f64; 3])| {
        format!("[[contact]]\nname = \"ball{k}\"\nbone = \"hand\"\npath = [{at:?}]\nradius = 0.01\n")
    };
    let balls: String = places.iter().enumerate().map(ball).collect();
    format!("[[bone]]\nname = \"hand\"\nnodes = \"none\"\n{balls}")
}

/// Nodes of the tissue; those behind them move shapes.
fn at_rest(trial: &Trial, n_balls: usize) -> Result<(), End> {
    trial.near(&trial.rest()[..trial.rest().len() - 4 * n_balls], SAME, "rest")
}

fn corner(law: &str, tally: &mut Tally) -> Result<(), End> {
    let block = Block { cells: [6, 6, 6], ..Block::of(law) };
    let scene = format!(
        "[mesh.block]\nsize = [0.03, 0.03, 0.03]\ncells = [6, 6, 6]\n[[tissue]]\n{}[[bone]]\nname = \"floor\"\nnodes = \"z_min\"\n\
         drive = \"held\"\n[[bone]]\nname = \"wall\"\nnodes = \"x_min\"\nwithin = [[-1, -1, 0.001], [1, 1, 1]]\ndrive = \"held\"\n{}{}",
        tissue(law, 15e3, 0.45),
        balls(&[[0.04, 0.015, 0.04]]),
        block.solver()
    );
    let mut trial = Trial::new(&scene, tally)?;
    for k in 1..=16 {
        let in_by = 0.002 * f64::from(k);
        trial.set("bone.translation", 6, &[-in_by, 0.0, -in_by])?;
        if trial.try_step(DT)?.is_some() {
            trial.set("bone.translation", 6, &[0.0; 3])?;
            trial.step(DT)?;
            return at_rest(&trial, 1);
        }
        // The ball's middle is in the corner's place after 10 mm: tissue there must have been pushed away.
        let mut force = [0.0; 3];
        let port = trial.sim.model().ports().iter().position(|p| p.name == "contact.force").expect("a contact");
        trial.sim.get_f64(port, 0, &mut force).map_err(|e| End::Fail(e.to_string()))?;
        if k > 5 && force.iter().all(|f| *f == 0.0) {
            return fail(format!("the ball is {} mm in and feels nothing", 2 * k));
        }
    }
    fail("the ball went all the way in")
}

fn row(law: &str, tally: &mut Tally) -> Result<(), End> {
    let more = balls(&[[0.012, 0.02, 0.0405], [0.03, 0.02, 0.0405], [0.048, 0.02, 0.0405]]);
    let mut trial = Trial::new(&Block { more: &more, ..Block::of(law) }.text(), tally)?;
    for k in (1..=8).chain((0..8).rev()) {
        trial.set("bone.translation", 6, &[0.0, 0.0, -1e-3 * f64::from(k)])?;
        trial.try_step(DT)?;
    }
    at_rest(&trial, 3)
}

fn jammed(law: &str, tally: &mut Tally) -> Result<(), End> {
    let block = Block::of(law);
    let [x, y, z] = block.size();
    let scene = format!(
        "{}[[tissue]]\n{}[[bone]]\nname = \"floor\"\nnodes = \"z_min\"\ndrive = \"held\"\n{}{}",
        block.mesh(),
        tissue(law, 15e3, 0.45),
        balls(&[[0.5 * x, 0.5 * y, z + 0.0105]]),
        block.solver()
    );
    let mut trial = Trial::new(&scene, tally)?;
    let mut refused = None;
    for k in 1..=12 {
        trial.set("bone.translation", 3, &[0.0, 0.0, -0.003 * f64::from(k)])?;
        refused = trial.try_step(DT)?;
        if refused.is_some() {
            break;
        }
    }
    trial.set("bone.translation", 3, &[0.0; 3])?;
    trial.step(DT)?;
    at_rest(&trial, 1)?;
    refused.map_or(Ok(()), |message| Err(End::Refused(message)))
}

fn twitch(law: &str, tally: &mut Tally) -> Result<(), End> {
    let more = "[[muscle]]\nname = \"m\"\npath = [[0.0, 0.02, 0.015], [0.06, 0.02, 0.015]]\nradius = 0.012\n";
    let mut trial = Trial::new(&Block { more, ..Block::of(law) }.text(), tally)?;
    let mut first = Vec::new();
    for k in 0..20 {
        trial.set("muscle.activation", 0, &[if k % 2 == 0 { 1.0 } else { 0.0 }])?;
        trial.step(DT)?;
        if k == 0 {
            first = trial.sim.positions().to_vec();
        }
        match k % 2 {
            0 => trial.near(&first, SAME, "the first answer")?,
            _ => trial.near(trial.rest(), SAME, "rest")?,
        }
    }
    Ok(())
}

fn sheet(law: &str, tally: &mut Tally) -> Result<(), End> {
    let scene = format!(
        "[mesh.block]\nsize = [0.06, 0.04, 1e-5]\ncells = [6, 4, 1]\n[[tissue]]\n{}[[bone]]\nname = \"skull\"\nnodes = \"x_min\"\n[[bone]]\n\
         name = \"jaw\"\nnodes = \"x_max\"\n[solver]\ntolerance = 1e-7\nlinear = \"iterative\"\n",
        tissue(law, 15e3, 0.45),
    );
    let mut trial = Trial::new(&scene, tally)?;
    trial.jaw([0.0, 0.002, 0.0], [0.0; 3])?;
    let refused = trial.try_step(DT)?;
    trial.jaw([0.0; 3], [0.0; 3])?;
    trial.step(DT)?;
    trial.near(trial.rest(), SAME, "rest")?;
    refused.map_or(Ok(()), |message| Err(End::Refused(message)))
}
