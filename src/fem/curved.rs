//! Curved quadratic tetrahedra: mid-edge nodes of smooth surfaces, moved from the chord to the surface.
//!
//! ```text
//! x_m = (x_a + x_b)/2 + ((d . n_b) n_b - (d . n_a) n_a)/8,   d = x_b - x_a
//! n_a ~ sum over triangles at a of (e1 x e2)/(|e1|^2 |e2|^2)
//! ```
//!
//! Source: Vlachos, Peters, Boyd & Mitchell, "Curved PN triangles", I3D 2001 (the middle of their cubic edge); normals
//! after Max, "Weights for computing vertex normals from facet normals", J. Graphics Tools 4(2), 1999, exact for nodes
//! on a sphere. Departure: a surface is a face set, and its rim and its creases stay straight.
//!
//! The mesh alone decides, so that a baked mesh and the CT head are curved like the synthetic one.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use super::quadratic::EDGES;
use super::tet10::{NODES, TET10_PLACES, jacobian};
use crate::math::Vec3;
use crate::mesh::TetMesh;

/// An edge is part of a crease where the normal of an end is this far from that of a triangle beside it (cosine of 45
/// degrees).
const CREASE: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// An element is let curve while its Jacobian keeps this part of the straight one's everywhere it is looked at.
const LEAST_JACOBIAN: f64 = 0.2;

/// What curving did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Curving {
    /// Edges that left their chord.
    pub curved: usize,
    /// Edges put back on their chord because an element would fold.
    pub straightened: usize,
}

/// Triangles beside an edge by their corners, ascending.
type Beside = Vec<[u32; 3]>;

/// The triangles beside an edge in one face set: its ends, the triangles, their normals.
struct Edge {
    ends: [u32; 2],
    beside: Beside,
    normals: Vec<Vec3>,
}

/// Moves the mid-edge nodes of smooth face sets onto the surfaces that the corners' normals tell.
///
/// `midsides` are those that `add_midsides` returned for this mesh, whose face sets are cut in four accordingly.
pub fn curve_midsides(mesh: &mut TetMesh, midsides: &[[u32; 6]]) -> Curving {
    let chord = |[a, b]: [u32; 2]| 0.5 * (mesh.nodes[a as usize] + mesh.nodes[b as usize]);
    let mut target: HashMap<u32, (Beside, Option<Vec3>)> = HashMap::new();
    // A face may lie in two sets, one of which holds the other: the larger one knows the surface beyond the smaller one's rim.
    let mut sets: Vec<&[[u32; 3]]> = mesh.face_sets.iter().map(|set| &set.triangles[..]).collect();
    sets.sort_by_key(|triangles| std::cmp::Reverse(triangles.len()));
    for triangles in sets {
        for (middle, beside, offset) in offsets(mesh, triangles) {
            match target.entry(middle) {
                Entry::Vacant(entry) => {
                    entry.insert((beside, offset));
                }
                // An edge of two surfaces is a rim of both.
                Entry::Occupied(mut entry) if !beside.iter().all(|t| entry.get().0.contains(t)) => {
                    entry.get_mut().1 = None;
                }
                Entry::Occupied(_) => {}
            }
        }
    }
    let mut ends: HashMap<u32, [u32; 2]> = HashMap::new();
    for (tet, six) in mesh.tets.iter().zip(midsides) {
        ends.extend(six.iter().zip(EDGES).map(|(&m, [i, j])| (m, [tet[i], tet[j]])));
    }
    let mut moved: Vec<u32> =
        target.iter().filter(|(m, t)| t.1.is_some() && ends.contains_key(m)).map(|t| *t.0).collect();
    moved.sort_unstable();
    let places: Vec<Vec3> = moved.iter().map(|m| chord(ends[m]) + target[m].1.expect("kept above")).collect();
    moved.iter().zip(places).for_each(|(&m, x)| mesh.nodes[m as usize] = x);

    let mut straightened = 0;
    loop {
        let folded: Vec<u32> = (0..midsides.len())
            .filter(|&e| folds(mesh, e, &midsides[e]))
            .flat_map(|e| midsides[e])
            .filter(|m| moved.binary_search(m).is_ok())
            .collect();
        if folded.is_empty() {
            return Curving { curved: moved.len(), straightened };
        }
        for m in folded {
            let Ok(k) = moved.binary_search(&m) else { continue };
            moved.remove(k);
            mesh.nodes[m as usize] = ends[&m].map(|a| mesh.nodes[a as usize]).iter().sum::<Vec3>() * 0.5;
            straightened += 1;
        }
    }
}

/// For each mid-edge node of a face set the triangles beside it, and how far its surface lies from the chord; `None` at rims
/// and creases.
fn offsets(mesh: &TetMesh, triangles: &[[u32; 3]]) -> Vec<(u32, Beside, Option<Vec3>)> {
    let x = |a: u32| mesh.nodes[a as usize];
    let mut normal: HashMap<u32, Vec3> = HashMap::new();
    let mut edges: Vec<(u32, Edge)> = Vec::new();
    let mut index: HashMap<u32, usize> = HashMap::new();
    for four in triangles.chunks_exact(4) {
        // As `add_midsides` cut it: [a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca].
        let (corners, middles) = ([four[0][0], four[1][0], four[2][0]], [four[0][1], four[1][1], four[2][1]]);
        for k in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|j| corners[(k + j) % 3]);
            let (e1, e2) = (x(b) - x(a), x(c) - x(a));
            let flat = e1.cross(&e2);
            *normal.entry(a).or_default() += flat / (e1.norm_squared() * e2.norm_squared());
            let at = *index.entry(middles[k]).or_insert_with(|| {
                edges.push((middles[k], Edge { ends: [a, b], beside: Vec::new(), normals: Vec::new() }));
                edges.len() - 1
            });
            let mut key = corners;
            key.sort_unstable();
            edges[at].1.beside.push(key);
            edges[at].1.normals.push(flat.normalize());
        }
    }
    let offset = |edge: &Edge| {
        let [a, b] = edge.ends;
        let (n_a, n_b) = (normal[&a].normalize(), normal[&b].normalize());
        // A corner whose normals cancel has none: NaN is above no bound.
        let along = |n: &Vec3| n.dot(&n_a) > CREASE && n.dot(&n_b) > CREASE;
        let smooth = edge.normals.len() == 2 && edge.normals.iter().all(along);
        let d = x(b) - x(a);
        smooth.then(|| (d.dot(&n_b) * n_b - d.dot(&n_a) * n_a) / 8.0)
    };
    edges
        .into_iter()
        .map(|(middle, edge)| {
            let offset = offset(&edge);
            (middle, edge.beside, offset)
        })
        .collect()
}

/// Whether an element's Jacobian falls too far at its nodes or points of integration.
fn folds(mesh: &TetMesh, e: usize, midsides: &[u32; 6]) -> bool {
    let straight = 6.0 * mesh.volume(e);
    let nodes: [u32; 10] = std::array::from_fn(|k| if k < 4 { mesh.tets[e][k] } else { midsides[k - 4] });
    let X = nodes.map(|a| mesh.nodes[a as usize]);
    let low = |L: &[f64; 4]| jacobian(&X, *L).determinant() < LEAST_JACOBIAN * straight;
    NODES.iter().chain(&TET10_PLACES).any(low)
}
