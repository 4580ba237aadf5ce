//! A box of tetrahedra: cubes cut in six about a diagonal, or units of eight mirrored cubes.
//!
//! ```text
//! cube:  6 tetrahedra, one for each way to walk from a corner to the opposite one along x, y, z
//! unit:  8 half cubes mirrored about the cell's centre, 48 congruent tetrahedra of volume V/48
//! ```
//!
//! Source: H. W. Kuhn, "Some combinatorial lemmas in topology", IBM J. Res. Dev. 4(5), 1960, for the cube of six.
//! Departure: none; in the mirrored unit every inner node has at most 48 tetrahedra and no direction is preferred.

use super::MeshingError;
use crate::math::Vec3;
use crate::mesh::{FaceSet, NodeSet, SKIN, TetMesh, signed_volume};

/// Most nodes of a block: beyond it a slip of the pen would take all memory of a common machine.
const NODE_LIMIT: u64 = 1_000_000;
/// Slack of the layer fractions' sum against 1 (rounding of decimal fractions).
const FRACTION_SLACK: f64 = 1e-9;
/// Name of the region that no layer covers.
const REST: &str = "tissue";

/// How a cell of a block is cut into tetrahedra.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Pattern {
    /// Six tetrahedra round the main diagonal of each cell, the same diagonal everywhere.
    #[default]
    Six,
    /// 48 congruent tetrahedra: eight half cells, mirrored about the cell's centre.
    FortyEight,
}

/// A box of tissue.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Corner with the smallest coordinates, m.
    pub origin: Vec3,
    /// Edge lengths, m.
    pub size: Vec3,
    /// Cells along x, y and z.
    pub cells: [usize; 3],
    /// How a cell is cut.
    pub pattern: Pattern,
    /// Layers from the top (`z_max`) down: region name and its share of the height. What is left is `tissue`.
    pub layers: Vec<(String, f64)>,
}

/// Meshes a box. Node sets `x_min` .. `z_max`; face sets `x_min` .. `y_max`, `z_min` and, for the top, `skin`.
///
/// # Errors
/// [`MeshingError::NotPositive`] for an empty box, [`MeshingError::Layers`] for fractions beyond 1,
/// [`MeshingError::TooLarge`] beyond a million nodes.
pub fn block(spec: &Block) -> Result<TetMesh, MeshingError> {
    let n = grid(spec)?;
    let stride = n.map(|c| c + 1);
    let mut nodes = Vec::with_capacity(stride.iter().product());
    for k in 0..stride[2] {
        for j in 0..stride[1] {
            for i in 0..stride[0] {
                let share = Vec3::new(i as f64 / n[0] as f64, j as f64 / n[1] as f64, k as f64 / n[2] as f64);
                nodes.push(spec.origin + spec.size.component_mul(&share));
            }
        }
    }
    let index = |c: [usize; 3]| ((c[2] * stride[1] + c[1]) * stride[0] + c[0]) as u32;
    let mut tets = Vec::with_capacity(6 * n.iter().product::<usize>());
    for k in 0..n[2] {
        for j in 0..n[1] {
            for i in 0..n[0] {
                let cube = [i, j, k];
                tets.extend(kuhn(cube, mirrored(spec.pattern, cube)).map(|tet| oriented(tet.map(index), &nodes)));
            }
        }
    }
    let (region, region_names) = regions(spec, &nodes, &tets);
    let mut mesh = TetMesh { nodes, tets, region, region_names, ..TetMesh::default() };
    add_sides(&mut mesh, n);
    Ok(mesh.checked()?)
}

/// Cubes along each axis after the pattern's refinement.
fn grid(spec: &Block) -> Result<[usize; 3], MeshingError> {
    let not_positive = |what: &str, found: f64| MeshingError::NotPositive { what: what.into(), found };
    for (a, axis) in ["x", "y", "z"].iter().enumerate() {
        if !(spec.size[a].is_finite() && spec.size[a] > 0.0) {
            return Err(not_positive(&format!("block size along {axis}"), spec.size[a]));
        }
        if spec.cells[a] == 0 {
            return Err(not_positive(&format!("number of block cells along {axis}"), 0.0));
        }
    }
    let mut sum = 0.0;
    for (name, fraction) in &spec.layers {
        sum += fraction;
        let fits = *fraction > 0.0 && sum <= 1.0 + FRACTION_SLACK;
        if !fits {
            return Err(MeshingError::Layers { name: name.clone(), sum });
        }
    }
    let factor = if spec.pattern == Pattern::FortyEight { 2 } else { 1 };
    let wanted = spec.cells.map(|c| c as u128 * factor + 1);
    let found = wanted.iter().try_fold(1u128, |p, &c| p.checked_mul(c)).unwrap_or(u128::MAX);
    if found > NODE_LIMIT as u128 {
        return Err(MeshingError::TooLarge { what: "the block".into(), found, limit: NODE_LIMIT });
    }
    Ok(wanted.map(|c| (c - 1) as usize))
}

/// For each axis: does the cube's diagonal start at its far end? In the mirrored unit it starts at the cell's centre.
fn mirrored(pattern: Pattern, cube: [usize; 3]) -> [bool; 3] {
    cube.map(|c| pattern == Pattern::FortyEight && c % 2 == 0)
}

/// Corners of the six tetrahedra of a cube, as grid coordinates.
fn kuhn(cube: [usize; 3], flip: [bool; 3]) -> [[[usize; 3]; 4]; 6] {
    const WALKS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    WALKS.map(|walk| {
        let mut done = [false; 3];
        let corner = |done: [bool; 3]| [0, 1, 2].map(|a| cube[a] + usize::from(done[a] != flip[a]));
        let mut tet = [corner(done); 4];
        for (step, &axis) in walk.iter().enumerate() {
            done[axis] = true;
            tet[step + 1] = corner(done);
        }
        tet
    })
}

fn oriented(tet: [u32; 4], nodes: &[Vec3]) -> [u32; 4] {
    if signed_volume(tet.map(|a| nodes[a as usize])) < 0.0 { [tet[0], tet[1], tet[3], tet[2]] } else { tet }
}

/// Region of each tetrahedron from the depth of its centroid under the top.
fn regions(spec: &Block, nodes: &[Vec3], tets: &[[u32; 4]]) -> (Vec<u32>, Vec<String>) {
    let mut names: Vec<String> = Vec::new();
    let mut bounds: Vec<(f64, u32)> = Vec::new();
    let mut id = |name: &str| match names.iter().position(|n| n == name) {
        Some(r) => r as u32,
        None => {
            names.push(name.into());
            names.len() as u32 - 1
        }
    };
    let mut depth = 0.0;
    for (name, fraction) in &spec.layers {
        depth += fraction;
        bounds.push((depth, id(name)));
    }
    if depth < 1.0 - FRACTION_SLACK {
        bounds.push((f64::INFINITY, id(REST)));
    }
    let last = bounds[bounds.len() - 1].1;
    let top = spec.origin.z + spec.size.z;
    let region = tets.iter().map(|tet| {
        let z = tet.iter().map(|&a| nodes[a as usize].z).sum::<f64>() / 4.0;
        let depth = (top - z) / spec.size.z;
        bounds.iter().find(|(bound, _)| depth < *bound).map_or(last, |(_, r)| *r)
    });
    (region.collect(), names)
}

fn add_sides(mesh: &mut TetMesh, n: [usize; 3]) {
    let stride = n.map(|c| c + 1);
    let coordinate = |node: u32, axis: usize| {
        let node = node as usize;
        [node % stride[0], node / stride[0] % stride[1], node / (stride[0] * stride[1])][axis]
    };
    let boundary = mesh.boundary();
    for (axis, letter) in ["x", "y", "z"].iter().enumerate() {
        for (end, at) in [("min", 0), ("max", n[axis])] {
            let name = format!("{letter}_{end}");
            let nodes = (0..mesh.nodes.len() as u32).filter(|&a| coordinate(a, axis) == at).collect();
            let on_side = |t: &&[u32; 3]| t.iter().all(|&a| coordinate(a, axis) == at);
            let triangles = boundary.iter().filter(on_side).copied().collect();
            let face_name = if name == "z_max" { SKIN.into() } else { name.clone() };
            mesh.node_sets.push(NodeSet { name, nodes });
            mesh.face_sets.push(FaceSet { name: face_name, triangles });
        }
    }
}
