//! From a linear mesh to one with a node in the middle of every edge.

use std::collections::HashMap;

use crate::mesh::{FaceSet, TetMesh};

/// Local corners of the six edges, in VTK's order of mid-edge nodes.
pub const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];

/// Adds a node to the middle of every edge. Returns the mid-edge nodes of each tetrahedron in the order of [`EDGES`].
///
/// A triangle of a face set becomes four. A mid-edge node joins a node set if its edge lies on the boundary and both its
/// ends are in the set, so that an edge that bridges tissue between two parts of a bone stays free.
pub fn add_midsides(mesh: &mut TetMesh) -> Vec<[u32; 6]> {
    let mut middle: HashMap<(u32, u32), u32> = HashMap::new();
    let key = |a: u32, b: u32| (a.min(b), a.max(b));
    let mut edges: Vec<(u32, u32)> = Vec::new();
    let mut midsides = Vec::with_capacity(mesh.tets.len());
    let corners = mesh.nodes.len() as u32;
    for tet in &mesh.tets {
        midsides.push(EDGES.map(|[i, j]| {
            let edge = key(tet[i], tet[j]);
            *middle.entry(edge).or_insert_with(|| {
                edges.push(edge);
                corners + edges.len() as u32 - 1
            })
        }));
    }
    let mut on_boundary = vec![false; edges.len()];
    for [a, b, c] in mesh.boundary() {
        for (a, b) in [(a, b), (b, c), (c, a)] {
            on_boundary[(middle[&key(a, b)] - corners) as usize] = true;
        }
    }
    for set in &mut mesh.node_sets {
        let has = |a: &u32| set.nodes.binary_search(a).is_ok();
        let inside = edges.iter().zip(&on_boundary).enumerate().filter(|(_, ((a, b), on))| **on && has(a) && has(b));
        let added: Vec<u32> = inside.map(|(k, _)| corners + k as u32).collect();
        set.nodes.extend(added);
    }
    mesh.face_sets = mesh
        .face_sets
        .iter()
        .map(|set| FaceSet {
            name: set.name.clone(),
            triangles: set
                .triangles
                .iter()
                .flat_map(|&[a, b, c]| {
                    let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(a, b)| middle[&key(a, b)]);
                    [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
                })
                .collect(),
        })
        .collect();
    mesh.nodes.extend(
        edges.iter().map(|&(a, b)| 0.5 * (mesh.nodes[a as usize] + mesh.nodes[b as usize])).collect::<Vec<_>>(),
    );
    midsides
}
