//! Tissue and meshes at the edge of what can be solved.

use super::scene::{Block, tissue};
use super::trial::{End, Tally, Trial, fail};
use super::{Case, LAWS, NONE};
use crate::geometry::{self, Pattern};
use crate::math::Vec3;
use crate::mesh::{TetMesh, signed_volume};

/// Distance that counts as the same place, m: ten times the tolerance of the solver.
const SAME: f64 = 1e-6;
/// Change of volume that nearly incompressible tissue may show on straight-edged elements.
const VOLUME: f64 = 0.02;
/// Volume of a sliver, in units of the mean.
const SLIVER: f64 = 1e-5;
/// Slivers wanted.
const SLIVERS: usize = 6;

const fn case(name: &'static str, what: &'static str, body: fn(&str, &mut Tally) -> Result<(), End>) -> Case {
    Case { name, what, laws: LAWS, may_invert: NONE, may_refuse: NONE, body }
}

pub const CASES: &[Case] = &[
    case("nu-0.4999", "Shears a nearly incompressible block of quadratic elements; its volume stays within 2 %.", nu),
    case("stiffness-1e6", "Shears a block whose top is 1e6 times as stiff as the rest, and back to rest.", layers),
    case("slivers", "Shears a block with elements of 1e-5 of the mean volume, and back to rest.", slivers),
];

fn nu(law: &str, tally: &mut Tally) -> Result<(), End> {
    let scene = Block { nu: 0.4999, order: 2, cells: [4, 3, 2], ..Block::of(law) };
    let mut trial = Trial::new(&scene.text(), tally)?;
    trial.jaw([0.0, 0.0, 0.006], [0.0; 3])?;
    trial.step(0.1)?;
    let volume = |x: &[Vec3]| -> f64 {
        trial.sim.model().mesh().tets.iter().map(|t| signed_volume(t.map(|a| x[a as usize]))).sum()
    };
    let change = volume(trial.sim.positions()) / volume(trial.rest()) - 1.0;
    if change.abs() <= VOLUME { Ok(()) } else { fail(format!("the volume changes by {:.1} %", 100.0 * change)) }
}

fn layers(law: &str, tally: &mut Tally) -> Result<(), End> {
    let block = Block::of(law);
    let scene = format!(
        "{}layers = [[\"hard\", 0.34]]\n[[tissue]]\nregions = [\"hard\"]\n{}[[tissue]]\n{}{}",
        block.mesh(),
        tissue(law, 1e9, 0.45),
        tissue(law, 1e3, 0.45),
        block.bones() + &block.solver()
    );
    there_and_back(&mut Trial::new(&scene, tally)?)
}

fn slivers(law: &str, tally: &mut Tally) -> Result<(), End> {
    let scene = Block::of(law);
    let mut mesh = mesh_of(&scene)?;
    let made = add_slivers(&mut mesh);
    if made < SLIVERS {
        return fail(format!("only {made} slivers could be made"));
    }
    there_and_back(&mut Trial::on(mesh, &scene.text(), tally)?)
}

fn there_and_back(trial: &mut Trial) -> Result<(), End> {
    trial.jaw([0.0, 0.005, 0.005], [0.0; 3])?;
    trial.step(0.1)?;
    trial.jaw([0.0; 3], [0.0; 3])?;
    trial.step(0.1)?;
    trial.near(trial.rest(), SAME, "rest")
}

/// The mesh of a block scene, to be edited.
pub fn mesh_of(scene: &Block) -> Result<TetMesh, End> {
    let block = geometry::Block {
        origin: Vec3::zeros(),
        size: scene.size().into(),
        cells: scene.cells,
        pattern: Pattern::Six,
        layers: Vec::new(),
    };
    geometry::block(&block).map_err(|e| End::Fail(e.to_string()))
}

/// Presses free nodes against the opposite face of one of their elements; returns how many.
fn add_slivers(mesh: &mut TetMesh) -> usize {
    let n_tets = mesh.tets.len();
    let volume = SLIVER * (0..n_tets).map(|e| mesh.volume(e)).sum::<f64>() / n_tets as f64;
    let mut fixed = vec![false; mesh.nodes.len()];
    for set in mesh.node_sets.iter().filter(|s| s.name.starts_with('x')) {
        set.nodes.iter().for_each(|&a| fixed[a as usize] = true);
    }
    let mut made = 0;
    for e in 0..n_tets {
        for k in 0..4 {
            let a = mesh.tets[e][k];
            if made == SLIVERS || fixed[a as usize] {
                continue;
            }
            let [p, q, r] = [1, 2, 3].map(|i| mesh.nodes[mesh.tets[e][(k + i) % 4] as usize]);
            let n = (q - p).cross(&(r - p)).normalize();
            let X = mesh.nodes[a as usize];
            mesh.nodes[a as usize] = X - n * (X - p).dot(&n) * (1.0 - volume / mesh.volume(e));
            let around: Vec<usize> = (0..n_tets).filter(|&e| mesh.tets[e].contains(&a)).collect();
            if around.iter().any(|&e| mesh.volume(e) < 0.5 * volume) {
                mesh.nodes[a as usize] = X;
                continue;
            }
            around.iter().flat_map(|&e| mesh.tets[e]).for_each(|b| fixed[b as usize] = true);
            made += 1;
        }
    }
    made
}
