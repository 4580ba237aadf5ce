//! From walls to tetrahedra of one domain at any resolution.
//!
//! ```text
//! octree -> graded lattice -> cut along the walls -> one manifold piece -> smoothed, fitted -> coarsened, level by level
//! ```
//! The lattice is fine where a wall is not flat over a cell; edge collapses under error guards then leave the nodes that
//! the surface needs. Each level comes from the finer one, so all are the same domain.

mod clip;
mod collapse;
mod cut;
mod fit;
mod lattice;
mod linked;
mod octree;
mod refine;
mod shape;
mod sheet;
mod smooth;
mod stuff;
mod swap;
mod walls;

use super::repair::{Repair, repair};
use super::stencils::Stuffed;
use super::stuffing::{NO_WALL, Wall};
use super::topology::{boundary, neighbours};
use crate::math::Vec3;
use collapse::coarsen;
pub(super) use collapse::{Face, Goal};
pub(super) use lattice::Plan;
use lattice::lattice;
use octree::Octree;
pub(super) use refine::Detail;
pub(super) use sheet::{SHEET, Sheet, split_edges};
use smooth::{Stars, rescue, round};
use walls::Held;

/// A mesh between walls, its boundary triangles with the wall each lies on.
#[derive(Clone)]
pub(super) struct Meshed {
    pub mesh: Stuffed,
    pub faces: Vec<Face>,
    pub repair: Repair,
}

/// Fills the space inside all walls.
pub(super) fn fill(plan: &Plan, walls: &[Wall], detail: &Detail) -> Meshed {
    let tree = Octree::new(plan.roots, plan.depth, |l, c| detail.wants(walls, &plan.centre(l, c), &plan.edge_at(l)));
    let mut mesh = stuff::stuff(lattice(plan, &tree), walls);
    let repair = repair(&mut mesh);
    let faces = faces(&mesh, walls);
    Meshed { mesh, faces, repair }
}

/// The wall of each boundary triangle: that of two corners and more, or the nearest of those to its middle; none in a plane.
fn faces(mesh: &Stuffed, walls: &[Wall]) -> Vec<Face> {
    let triangles = boundary(&mesh.tets, &neighbours(&mesh.tets));
    let name = |t: [u32; 3]| {
        if t.iter().fold(u8::MAX, |bits, &a| bits & mesh.plane[a as usize]) != 0 {
            return NO_WALL;
        }
        let mut own: Vec<u8> = t.iter().map(|&a| mesh.wall[a as usize]).filter(|&w| w != NO_WALL).collect();
        own.sort_unstable();
        match own[..] {
            [] => NO_WALL,
            [a, b, _] if a == b => a,
            [_, b, c] if b == c => b,
            _ => {
                let middle = t.iter().map(|&a| mesh.nodes[a as usize]).sum::<Vec3>() / 3.0;
                let distance = |w: u8| walls[usize::from(w)].depth(&middle).abs();
                own.into_iter().min_by(|&p, &q| distance(p).total_cmp(&distance(q))).unwrap_or(NO_WALL)
            }
        }
    };
    triangles.into_iter().map(|(t, _)| (t, name(t))).collect()
}

/// Parts a mesh's faces along a sheet: they join the list of faces, under the number [`SHEET`].
pub(super) fn part(m: &mut Meshed, walls: &[Wall], sheet: &Sheet) {
    let faces = sheet::insert(&mut m.mesh, &mut m.faces, walls, sheet);
    m.faces.extend(faces.into_iter().map(|t| (t, SHEET)));
}

/// Smooths and fits a mesh whose connections stay.
pub(super) fn polish(m: &mut Meshed, walls: &[Wall], sheet: Option<&Sheet>, effort: Effort) {
    let mut stars = Stars::of(&m.mesh);
    let mut held = Held::new(walls, m.mesh.nodes.len());
    if let Some(sheet) = sheet {
        held = held.with_sheet(sheet);
    }
    for r in 0..effort.rounds {
        let last = r + 1 == effort.rounds;
        round(&mut m.mesh, &stars, &held, if last { 6 } else { 3 }, if r < effort.all { f64::INFINITY } else { 0.45 });
    }
    for _ in 0..effort.swaps {
        if swap::swap(&mut m.mesh, &mut m.faces, walls, POOR, 3) == 0 {
            break;
        }
        stars = Stars::of(&m.mesh);
        held.offset.resize(m.mesh.nodes.len(), 0.0);
        round(&mut m.mesh, &stars, &held, 6, 0.45);
        rescue(&mut m.mesh, &stars, &held, POOR, 2);
    }
    rescue(&mut m.mesh, &stars, &held, POOR, effort.rescue);
    if effort.fit > 0 {
        fit::fit(&mut m.mesh, &m.faces, &stars, &mut held, effort.fit);
        round(&mut m.mesh, &stars, &held, 6, 0.4);
        fit::fit(&mut m.mesh, &m.faces, &stars, &mut held, 2);
        rescue(&mut m.mesh, &stars, &held, POOR, effort.rescue.div_ceil(2));
    }
    // In a fold of a wall, or where the sheet grazes one, stars get better only off it.
    let held = held.planes();
    for _ in 0..effort.swaps {
        round(&mut m.mesh, &stars, &held, 6, BAD);
        rescue(&mut m.mesh, &stars, &held, BAD, 2);
        if swap::swap(&mut m.mesh, &mut m.faces, walls, BAD, 2) == 0 {
            break;
        }
        stars = Stars::of(&m.mesh);
    }
}

/// Stars below this score may leave what holds them, by a share of their edges.
const BAD: f64 = 0.33;

/// Stars with a score below this are searched for better places, and swapped.
const POOR: f64 = 0.4;

/// How much polish.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effort {
    /// Rounds of smoothing, and how many of them go over good stars, too.
    pub rounds: usize,
    pub all: usize,
    pub swaps: usize,
    pub rescue: usize,
    pub fit: usize,
}

/// Coarsens a mesh as far as the goal allows.
pub(super) fn coarser(m: &mut Meshed, goal: &Goal) {
    coarsen(&mut m.mesh, &mut m.faces, goal);
}
