//! Numbers, meshes and scenes that mean nothing, or mean the same in other words.

use super::materials::mesh_of;
use super::scene::{Block, tissue};
use super::trial::{End, Tally, Trial, fail, near};
use super::{Case, LAWS, LINEAR, NONE, ONE_LAW};
use crate::error::Error;
use crate::load;
use crate::math::Vec3;
use crate::mesh::TetMesh;
use crate::scene::{SceneFile, build};

/// Tolerance of the solver where two ways to the same answer are compared, m.
const TIGHT: f64 = 1e-12;
/// Distance that counts as the same place there, in units of the block's length.
const SAME: f64 = 1e-9;

pub const CASES: &[Case] = &[
    Case {
        name: "not-a-number",
        what: "Sets NaN and the infinities into every input; each step is refused and names the input.",
        laws: ONE_LAW,
        may_invert: NONE,
        may_refuse: ONE_LAW,
        body: not_a_number,
    },
    Case {
        name: "denormal",
        what: "Sets the smallest numbers into every input; the tissue stays at rest.",
        laws: LAWS,
        may_invert: NONE,
        may_refuse: NONE,
        body: denormal,
    },
    Case {
        name: "huge",
        what: "Sets 1e150 and 1e300 into every input, answered or refused, and zero again; ends at rest.",
        laws: LAWS,
        may_invert: LINEAR,
        may_refuse: LAWS,
        body: huge,
    },
    Case {
        name: "renumbered",
        what: "Shuffles nodes and elements; the answer is the same to 1e-9 of the length.",
        laws: LAWS,
        may_invert: NONE,
        may_refuse: NONE,
        body: renumbered,
    },
    Case {
        name: "scaled-1e3",
        what: "Multiplies all lengths by 1e3; the shape is the same to 1e-9 of the length.",
        laws: LAWS,
        may_invert: NONE,
        may_refuse: NONE,
        body: scaled,
    },
    Case {
        name: "two-bones-one-node",
        what: "Lets two bones claim the nodes of an edge; the error names both bones.",
        laws: ONE_LAW,
        may_invert: NONE,
        may_refuse: ONE_LAW,
        body: two_bones,
    },
    Case {
        name: "unheld",
        what: "Leaves the block, then a second block beside it, without a bone; the error says where.",
        laws: ONE_LAW,
        may_invert: NONE,
        may_refuse: ONE_LAW,
        body: unheld,
    },
    Case {
        name: "bad-starts",
        what: "Starts from too few positions and from NaN; each is refused and changes nothing.",
        laws: ONE_LAW,
        may_invert: NONE,
        may_refuse: ONE_LAW,
        body: bad_starts,
    },
];

/// Inputs of the block with two bones: port and number of values.
const INPUTS: [(&str, usize); 4] =
    [("bone.translation", 6), ("bone.rotation", 6), ("load.force", 3), ("bone.pivot", 6)];

fn not_a_number(law: &str, tally: &mut Tally) -> Result<(), End> {
    let mut trial = Trial::new(&Block::of(law).text(), tally)?;
    trial.jaw([0.0, 0.0, 0.002], [0.0; 3])?;
    trial.step(0.1)?;
    let mut message = String::new();
    for (name, n) in INPUTS.into_iter().filter(|(name, _)| *name != "bone.pivot") {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            trial.set(name, n - 1, &[bad])?;
            message = trial.refusal(0.1, name)?;
        }
        trial.set(name, n - 1, &[0.0])?;
    }
    trial.step(0.1)?;
    Err(End::Refused(message))
}

fn denormal(law: &str, tally: &mut Tally) -> Result<(), End> {
    let mut trial = Trial::new(&Block::of(law).text(), tally)?;
    for (name, n) in INPUTS.into_iter().filter(|(name, _)| *name != "bone.pivot") {
        trial.set(name, 0, &vec![f64::from_bits(1); n])?;
        trial.step(0.1)?;
    }
    trial.near(trial.rest(), SAME, "rest")
}

fn huge(law: &str, tally: &mut Tally) -> Result<(), End> {
    let mut trial = Trial::new(&Block::of(law).text(), tally)?;
    let mut refused = None;
    for (name, n) in INPUTS.into_iter().filter(|(name, _)| *name != "bone.pivot") {
        for value in [1e150, 1e300] {
            trial.set(name, n - 1, &[value])?;
            refused = trial.try_step(0.1)?.or(refused);
            trial.set(name, n - 1, &[0.0])?;
        }
    }
    trial.step(0.1)?;
    trial.near(trial.rest(), 1e-6, "rest")?;
    refused.map_or(Ok(()), |message| Err(End::Refused(message)))
}

fn moved(trial: &mut Trial, scale: f64) -> Result<Vec<Vec3>, End> {
    trial.jaw([0.002 * scale, 0.0, 0.005 * scale], [0.2, 0.0, 0.1])?;
    trial.step(0.1)?;
    Ok(trial.sim.positions().to_vec())
}

fn renumbered(law: &str, tally: &mut Tally) -> Result<(), End> {
    let scene = Block { tolerance: TIGHT, ..Block::of(law) };
    let mesh = mesh_of(&scene)?;
    let wanted = moved(&mut Trial::on(mesh.clone(), &scene.text(), &mut Tally::default())?, 1.0)?;
    // 73 is prime to the number of nodes of a block, so this is a permutation.
    let n = mesh.nodes.len();
    let to = |a: usize| (73 * a + 5) % n;
    let x = moved(&mut Trial::on(renumber(&mesh, &to), &scene.text(), tally)?, 1.0)?;
    let back: Vec<Vec3> = (0..n).map(|a| x[to(a)]).collect();
    near(&back, &wanted, SAME * scene.size()[0], "the answer with the first numbers")
}

fn renumber(mesh: &TetMesh, to: &dyn Fn(usize) -> usize) -> TetMesh {
    let mut new = mesh.clone();
    let renamed = |a: &mut u32| *a = to(*a as usize) as u32;
    for (a, X) in mesh.nodes.iter().enumerate() {
        new.nodes[to(a)] = *X;
    }
    new.tets.reverse();
    new.region.reverse();
    new.tets.as_flattened_mut().iter_mut().for_each(renamed);
    for set in &mut new.node_sets {
        set.nodes.iter_mut().for_each(renamed);
        set.nodes.sort_unstable();
    }
    new.face_sets.iter_mut().flat_map(|s| s.triangles.as_flattened_mut()).for_each(renamed);
    new
}

fn scaled(law: &str, tally: &mut Tally) -> Result<(), End> {
    let small = Block { tolerance: TIGHT, ..Block::of(law) };
    let large = Block { scale: 1e3, tolerance: TIGHT, ..Block::of(law) };
    let wanted = moved(&mut Trial::new(&small.text(), &mut Tally::default())?, 1.0)?;
    let x = moved(&mut Trial::new(&large.text(), tally)?, large.scale)?;
    let back: Vec<Vec3> = x.iter().map(|x| x / large.scale).collect();
    near(&back, &wanted, SAME * small.size()[0], "the shape of the small block")
}

fn two_bones(law: &str, _: &mut Tally) -> Result<(), End> {
    let scene = Block::of(law);
    refused(load::from_text(&scene.text().replace("\"x_max\"", "\"y_max\""), None), &["skull", "jaw", "node"])
}

fn unheld(law: &str, _: &mut Tally) -> Result<(), End> {
    let scene = Block::of(law);
    let alone = format!("{}[[tissue]]\n{}", scene.mesh(), tissue(law, 15e3, 0.45));
    if let Err(End::Fail(message)) = refused(load::from_text(&alone, None), &["no bone", "around"]) {
        return fail(message);
    }
    let mesh = mesh_of(&scene)?;
    let mut two = mesh.clone();
    let n = mesh.nodes.len() as u32;
    two.nodes.extend(mesh.nodes.iter().map(|X| X + Vec3::new(0.0, 0.1, 0.0)));
    two.tets.extend(mesh.tets.iter().map(|t| t.map(|a| a + n)));
    two.region.extend(&mesh.region);
    let text = scene.text();
    let built = SceneFile::parse(&text).and_then(|file| build(&text, &file, two));
    refused(built, &["1 piece", "(0.0300, 0.1200, 0.0150)"])
}

/// Ends as refused if the error says all of `words`.
fn refused<T, E: Into<Refusal>>(found: Result<T, E>, words: &[&str]) -> Result<(), End> {
    let Err(e) = found else { return fail("a scene that means nothing was taken") };
    let Refusal(message) = e.into();
    match words.iter().find(|w| !message.contains(**w)) {
        Some(word) => fail(format!("the error does not say `{word}`: {message}")),
        None => Err(End::Refused(message)),
    }
}

struct Refusal(String);

impl From<Error> for Refusal {
    fn from(e: Error) -> Self {
        Refusal(e.to_string())
    }
}

impl From<crate::scene::SceneError> for Refusal {
    fn from(e: crate::scene::SceneError) -> Self {
        Refusal(e.to_string())
    }
}

fn bad_starts(law: &str, tally: &mut Tally) -> Result<(), End> {
    let mut trial = Trial::new(&Block::of(law).text(), tally)?;
    let mut x = trial.rest().to_vec();
    x[3].y = f64::NAN;
    let mut message = String::new();
    for (start, word) in [(&x[1..], "one position for each"), (&x[..], "node 3")] {
        match trial.sim.start_from(start) {
            Err(e) if e.to_string().contains(word) => message = e.to_string(),
            other => return fail(format!("wanted an error that says `{word}`; found {other:?}")),
        }
    }
    trial.step(0.1)?;
    trial.near(trial.rest(), 1e-12, "rest")?;
    Err(End::Refused(message))
}
