//! The part of a lattice between walls: signs, cut points, the lattice drawn to the walls and cut along them.

use super::super::stencils::Stuffed;
use super::super::stuffing::{NO_WALL, Wall, depth};
use super::clip::clip;
use super::cut::{Cuts, draw};
use crate::math::Vec3;
use crate::mesh::signed_volume;

/// How near a node must be to a cut point of an edge to be drawn onto it, in edges: along an axis, along a diagonal.
const ALPHA: [f64; 2] = [0.24999, 0.41189];
/// An edge runs along an axis if its largest component has this share of its length.
const AXIS: f64 = 0.99;
/// A tetrahedron whose corners all lie on walls is tissue if its middle is deeper than this, in edges.
const DEEP: f64 = 0.05;

/// Cuts a lattice along its walls and leaves what lies inside all of them.
pub(super) fn stuff(mut mesh: Stuffed, walls: &[Wall]) -> Stuffed {
    let level = |p: &Vec3| depth(walls, p).0;
    let mut value: Vec<f64> = mesh.nodes.iter().map(level).collect();
    let mut sign: Vec<i8> = value.iter().map(|&d| if d < 0.0 { -1 } else { i8::from(d > 0.0) }).collect();
    // Outer space is not looked at again.
    mesh.tets.retain(|t| t.iter().any(|&a| sign[a as usize] < 0));
    let cuts = Cuts::find(&mesh, &sign, &value, &level);
    let lattice = mesh.nodes.clone();
    let reach = |_: &Stuffed, from: usize, to: usize| {
        let span = lattice[to] - lattice[from];
        ALPHA[usize::from(span.amax() < AXIS * span.norm())]
    };
    for a in draw(&mut mesh, &mut sign, &cuts, reach) {
        value[a] = 0.0;
    }
    let cuts = Cuts::find(&mesh, &sign, &value, &level);
    let first = mesh.nodes.len() as u32;
    let mut tets = Vec::with_capacity(mesh.tets.len());
    let before = |a: u32, b: u32| (value[a as usize], b) > (value[b as usize], a);
    for t in &mesh.tets {
        clip(*t, |a| sign[a as usize], before, |a, b| first + cuts.number(a, b) as u32, &mut tets);
        if t.iter().all(|&a| sign[a as usize] == 0) {
            let x = t.map(|a| mesh.nodes[a as usize]);
            if level(&((x[0] + x[1] + x[2] + x[3]) / 4.0)) < -DEEP * (x[1] - x[0]).norm() {
                tets.push(*t);
            }
        }
    }
    let plane: Vec<u8> = cuts.edges().map(|([a, b], _)| mesh.plane[a] & mesh.plane[b]).collect();
    mesh.plane.extend(plane);
    mesh.nodes.extend(&cuts.points);
    mesh.wall = (0..mesh.nodes.len())
        .map(|a| if a < sign.len() && sign[a] != 0 { NO_WALL } else { depth(walls, &mesh.nodes[a]).1 })
        .collect();
    orient(&mesh.nodes, &mut tets);
    mesh.tets = tets;
    mesh
}

/// Turns tetrahedra so that their volumes are positive.
pub(super) fn orient(nodes: &[Vec3], tets: &mut [[u32; 4]]) {
    for t in tets {
        if signed_volume(t.map(|a| nodes[a as usize])) < 0.0 {
            t.swap(2, 3);
        }
    }
}
