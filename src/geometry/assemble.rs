//! From stuffed tetrahedra to a mesh that scenes can name: slit, face sets, bones, what is released.

use super::Field;
use super::mesher::{Face, SHEET};
use super::repair::{ROUNDS, compact, smaller_fans};
use super::stencils::Stuffed;
use super::stuffing::NO_WALL;
use super::topology::{FACES, OPEN, boundary, components, fans, neighbours, pinched_edges, stars};
use crate::math::Vec3;
use crate::mesh::{FaceSet, NodeSet, SKIN, TetMesh, sorted};

/// Face set where the region of interest ends.
pub const CUT: &str = "cut";
/// Face set of surfaces that nothing holds: the oral slit, inner air, bone between two bones.
pub const FREE: &str = "free";

/// What a wall is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Skin,
    Bone,
    Cut,
    Free,
}

/// A bone by name and signed distance.
pub(super) struct Bone<'a> {
    pub name: &'a str,
    pub field: &'a dyn Field,
}

/// Everything that names a boundary.
pub(super) struct Naming<'a> {
    /// What each wall is; triangles of none are where the region of interest ends.
    pub kinds: &'a [Kind],
    pub bones: &'a [Bone<'a>],
    /// Bone nodes nearer than this to a second bone are released, m.
    pub apart: &'a dyn Fn(&Vec3) -> f64,
    /// Whether a skin point faces the outer air; inner air is free.
    pub is_outer: &'a dyn Fn(&Vec3) -> bool,
}

/// A named mesh and how many nodes the slit doubled.
pub(super) struct Assembled {
    pub mesh: TetMesh,
    pub slit_nodes: usize,
    pub released_nodes: usize,
}

/// Parts the mesh along its sheet and names faces and nodes. Regions are left as one.
pub(super) fn assemble(mut stuffed: Stuffed, faces: &[Face], naming: &Naming) -> Assembled {
    let mut walls = walls_of(&stuffed.tets, faces);
    let slit_nodes = if faces.iter().any(|f| f.1 == SHEET) { open(&mut stuffed, &mut walls) } else { 0 };
    let adjacent = neighbours(&stuffed.tets);
    let (bone_of, released_nodes) = bones(&stuffed, naming);
    let mut names: Vec<&str> = vec![SKIN];
    names.extend(naming.bones.iter().map(|b| b.name));
    names.extend([CUT, FREE]);
    let (cut, free) = (names.len() - 2, names.len() - 1);
    let mut sets: Vec<FaceSet> = names.iter().map(|n| FaceSet { name: (*n).into(), triangles: Vec::new() }).collect();
    for (e, tet) in stuffed.tets.iter().enumerate() {
        for f in (0..4).filter(|&f| adjacent[e][f] == OPEN) {
            let t = FACES[f].map(|a| tet[a]);
            let kind = match walls[e][f] {
                SHEET | INNER => Kind::Free,
                NO_WALL => Kind::Cut,
                wall => naming.kinds[usize::from(wall)],
            };
            let set = match kind {
                Kind::Skin if (naming.is_outer)(&middle(&stuffed, &t)) => 0,
                Kind::Bone => match t.map(|a| bone_of[a as usize]) {
                    [Some(a), Some(b), Some(c)] if a == b && b == c => 1 + a,
                    _ => free,
                },
                Kind::Cut => cut,
                _ => free,
            };
            sets[set].triangles.push(t);
        }
    }
    let node_set = |k: usize| NodeSet {
        name: naming.bones[k].name.into(),
        nodes: (0u32..).zip(&bone_of).filter(|(_, b)| **b == Some(k)).map(|(a, _)| a).collect(),
    };
    // A bone that the mesh does not reach is not named.
    let reached: Vec<usize> = (0..naming.bones.len()).filter(|&k| !sets[1 + k].triangles.is_empty()).collect();
    let unreached = |s: &FaceSet| s.triangles.is_empty() && naming.bones.iter().any(|b| b.name == s.name);
    sets.retain(|s| !unreached(s));
    let mesh = TetMesh {
        node_sets: reached.into_iter().map(node_set).collect(),
        face_sets: sets,
        region: vec![0; stuffed.tets.len()],
        region_names: vec!["tissue".into()],
        nodes: stuffed.nodes,
        tets: stuffed.tets,
        fine_skin: None,
        elimination: None,
    };
    Assembled { mesh, slit_nodes, released_nodes }
}

fn middle(stuffed: &Stuffed, nodes: &[u32]) -> Vec3 {
    nodes.iter().map(|&a| stuffed.nodes[a as usize]).sum::<Vec3>() / nodes.len() as f64
}

/// Mark of a face between two tetrahedra.
const INNER: u8 = SHEET - 1;

/// The wall of each tetrahedron's faces.
fn walls_of(tets: &[[u32; 4]], faces: &[Face]) -> Vec<[u8; 4]> {
    let mut listed: Vec<Face> = faces.iter().map(|&(t, wall)| (sorted(t), wall)).collect();
    listed.sort_unstable();
    let of = |t: [u32; 3]| listed.binary_search_by_key(&sorted(t), |f| f.0).map_or(INNER, |k| listed[k].1);
    tets.iter().map(|tet| FACES.map(|f| of(f.map(|a| tet[a])))).collect()
}

/// The bone each boundary node is held by; nodes near a second bone are held by none.
fn bones(stuffed: &Stuffed, naming: &Naming) -> (Vec<Option<usize>>, usize) {
    let mut released = 0;
    let held = stuffed.nodes.iter().zip(&stuffed.wall).map(|(x, &w)| {
        if w == NO_WALL || naming.kinds[usize::from(w)] != Kind::Bone {
            return None;
        }
        let mut near: Vec<(f64, usize)> =
            naming.bones.iter().enumerate().map(|(k, b)| (b.field.at(x).abs(), k)).collect();
        near.sort_by(|p, q| p.0.total_cmp(&q.0));
        if near.len() > 1 && near[1].0 < (naming.apart)(x) {
            released += 1;
            return None;
        }
        near.first().map(|n| n.1)
    });
    let held = held.collect();
    (held, released)
}

/// Edges between nodes that two bones hold, each with its middle: what joins bones must have a free node between them.
pub(super) fn bridges(stuffed: &Stuffed, naming: &Naming) -> Vec<([usize; 2], Vec3)> {
    let (bone_of, _) = bones(stuffed, naming);
    let mut out = Vec::new();
    for t in &stuffed.tets {
        for (i, &a) in t.iter().enumerate() {
            for &b in &t[..i] {
                let [a, b] = [a.min(b) as usize, a.max(b) as usize];
                if let (Some(p), Some(q)) = (bone_of[a], bone_of[b])
                    && p != q
                {
                    out.push([a, b]);
                }
            }
        }
    }
    out.sort_unstable();
    out.dedup();
    out.into_iter().map(|e| (e, 0.5 * (stuffed.nodes[e[0]] + stuffed.nodes[e[1]]))).collect()
}

/// Parts the tetrahedra along the sheet's faces, and drops what it cuts off or pinches; the walls of the faces follow.
/// Returns the number of nodes doubled.
fn open(stuffed: &mut Stuffed, walls: &mut Vec<[u8; 4]>) -> usize {
    let mut adjacent = neighbours(&stuffed.tets);
    for (a, walls) in adjacent.iter_mut().zip(&*walls) {
        for (other, wall) in a.iter_mut().zip(walls) {
            if *wall == SHEET {
                *other = OPEN;
            }
        }
    }
    for _ in 0..ROUNDS {
        double_nodes(stuffed, &adjacent);
        // A face whose corners all hang together round its rim stays closed.
        adjacent = neighbours(&stuffed.tets);
        let edges = pinched_edges(&boundary(&stuffed.tets, &adjacent));
        if edges.is_empty() {
            break;
        }
        let gone = smaller_fans(stuffed, &edges, &adjacent);
        retain(stuffed, walls, |e| !gone[e]);
        adjacent = neighbours(&stuffed.tets);
    }
    keep_largest(stuffed, walls);
    let mut places: Vec<[u64; 3]> =
        stuffed.nodes.iter().map(|x| [x.x, x.y, x.z].map(|c| (c + 0.0).to_bits())).collect();
    places.sort_unstable();
    places.windows(2).filter(|w| w[0] == w[1]).count()
}

fn retain(stuffed: &mut Stuffed, walls: &mut Vec<[u8; 4]>, keep: impl Fn(usize) -> bool) {
    let mut at = 0..stuffed.tets.len();
    stuffed.tets.retain(|_| at.next().is_some_and(&keep));
    let mut at = 0..walls.len();
    walls.retain(|_| at.next().is_some_and(&keep));
}

/// Gives every fan of tetrahedra round a boundary node a node of its own.
fn double_nodes(stuffed: &mut Stuffed, adjacent: &[[u32; 4]]) {
    let n_nodes = stuffed.nodes.len();
    let mut touched = vec![false; n_nodes];
    boundary(&stuffed.tets, adjacent).iter().for_each(|(t, _)| t.iter().for_each(|&a| touched[a as usize] = true));
    let (begin, items) = stars(&stuffed.tets, n_nodes, &touched);
    let mut edits = Vec::new();
    for node in (0..n_nodes).filter(|&a| touched[a]) {
        let star = &items[begin[node] as usize..begin[node + 1] as usize];
        let (group, n) = fans(star, node as u32, &stuffed.tets, adjacent);
        for fan in 1..n {
            let copy = stuffed.nodes.len() as u32;
            stuffed.nodes.push(stuffed.nodes[node]);
            stuffed.wall.push(stuffed.wall[node]);
            stuffed.plane.push(stuffed.plane[node]);
            edits.extend((0..star.len()).filter(|&k| group[k] == fan).map(|k| (star[k] as usize, node as u32, copy)));
        }
    }
    for (e, old, new) in edits {
        stuffed.tets[e].iter_mut().filter(|a| **a == old).for_each(|a| *a = new);
    }
}

/// Drops all but the largest component.
fn keep_largest(stuffed: &mut Stuffed, walls: &mut Vec<[u8; 4]>) {
    let (component, n) = components(&neighbours(&stuffed.tets));
    let mut sizes = vec![0usize; n];
    component.iter().for_each(|&c| sizes[c as usize] += 1);
    let keep = (0..n).max_by_key(|&c| (sizes[c], n - c)).unwrap_or(0) as u32;
    retain(stuffed, walls, |e| component[e] == keep);
    compact(stuffed);
}
