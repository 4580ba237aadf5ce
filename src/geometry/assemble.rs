//! From stuffed tetrahedra to a mesh that scenes can name: slit, face sets, bones, what is released.

use super::Field;
use super::repair::{ROUNDS, compact, smaller_fans};
use super::stencils::Stuffed;
use super::stuffing::{NO_WALL, Wall};
use super::topology::{FACES, OPEN, boundary, components, fans, neighbours, pinched_edges, stars};
use crate::math::Vec3;
use crate::mesh::{FaceSet, NodeSet, SKIN, TetMesh};

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

/// Whether the face (its corners) between two tetrahedra (their middles) is part of the oral slit.
pub(super) type Slit<'a> = &'a dyn Fn([Vec3; 3], Vec3, Vec3) -> bool;

/// Everything that names a boundary.
pub(super) struct Naming<'a> {
    pub walls: &'a [Wall<'a>],
    pub kinds: &'a [Kind],
    pub bones: &'a [Bone<'a>],
    /// Lattice edge, m.
    pub edge: f64,
    /// Bone nodes nearer than this to a second bone are released, m.
    pub apart: &'a dyn Fn(&Vec3) -> f64,
    pub slit: Option<Slit<'a>>,
    /// Whether a skin point faces the outer air; inner air is free.
    pub is_outer: &'a dyn Fn(&Vec3) -> bool,
}

/// A named mesh and how many nodes the slit doubled.
pub(super) struct Assembled {
    pub mesh: TetMesh,
    pub slit_nodes: usize,
    pub released_nodes: usize,
}

/// Cuts the slit and names faces and nodes. Regions are left as one.
pub(super) fn assemble(mut stuffed: Stuffed, naming: &Naming) -> Assembled {
    let (outer, slit_nodes) = match naming.slit {
        Some(slit) => open(&mut stuffed, slit),
        None => (vec![[true; 4]; stuffed.tets.len()], 0),
    };
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
            let set = match kind(&stuffed, t, naming) {
                _ if !outer[e][f] => free,
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

/// What a boundary triangle is: its corners' wall if they agree, else the wall nearest to its middle.
fn kind(stuffed: &Stuffed, t: [u32; 3], naming: &Naming) -> Kind {
    let [a, b, c] = t.map(|a| stuffed.wall[a as usize]);
    let kind_of = |w: u8| naming.kinds.get(usize::from(w)).copied();
    if let (Some(a), Some(b), Some(c)) = (kind_of(a), kind_of(b), kind_of(c))
        && a == b
        && b == c
    {
        return a;
    }
    let p = middle(stuffed, &t);
    let distance = |w: usize| naming.walls[w].depth(&p).abs();
    let nearest = (0..naming.walls.len()).map(|w| (distance(w), w)).min_by(|p, q| p.0.total_cmp(&q.0));
    // Far from every wall the lattice itself ended.
    nearest.filter(|(d, _)| *d < 0.3 * naming.edge).map_or(Kind::Cut, |(_, w)| naming.kinds[w])
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

/// Parts the tetrahedra along the slit's faces, and drops what the slit cuts off or pinches. Returns for each tetrahedron
/// which of its faces were boundary before, and the number of nodes doubled.
fn open(stuffed: &mut Stuffed, slit: Slit) -> (Vec<[bool; 4]>, usize) {
    let mut adjacent = neighbours(&stuffed.tets);
    let mut outer: Vec<[bool; 4]> = adjacent.iter().map(|a| a.map(|other| other == OPEN)).collect();
    for [e, f, other, back] in slit_faces(stuffed, &adjacent, slit) {
        adjacent[e][f] = OPEN;
        adjacent[other][back] = OPEN;
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
        retain(stuffed, &mut outer, |e| !gone[e]);
        adjacent = neighbours(&stuffed.tets);
    }
    keep_largest(stuffed, &mut outer);
    let mut places: Vec<[u64; 3]> =
        stuffed.nodes.iter().map(|x| [x.x, x.y, x.z].map(|c| (c + 0.0).to_bits())).collect();
    places.sort_unstable();
    let doubled = places.windows(2).filter(|w| w[0] == w[1]).count();
    (outer, doubled)
}

fn retain(stuffed: &mut Stuffed, outer: &mut Vec<[bool; 4]>, keep: impl Fn(usize) -> bool) {
    let mut at = 0..stuffed.tets.len();
    stuffed.tets.retain(|_| at.next().is_some_and(&keep));
    let mut at = 0..outer.len();
    outer.retain(|_| at.next().is_some_and(&keep));
}

/// Faces of the slit: tetrahedron, face, and the same from the other side.
fn slit_faces(stuffed: &Stuffed, adjacent: &[[u32; 4]], slit: Slit) -> Vec<[usize; 4]> {
    let mut faces = Vec::new();
    for e in 0..stuffed.tets.len() {
        for f in 0..4 {
            let other = adjacent[e][f];
            if other == OPEN || (other as usize) < e {
                continue;
            }
            let corners = FACES[f].map(|a| stuffed.nodes[stuffed.tets[e][a] as usize]);
            let middles = [e, other as usize].map(|e| middle(stuffed, &stuffed.tets[e]));
            if slit(corners, middles[0], middles[1]) {
                let other = other as usize;
                let back = (0..4).find(|&g| adjacent[other][g] == e as u32).expect("neighbours know each other");
                faces.push([e, f, other, back]);
            }
        }
    }
    faces
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
            edits.extend((0..star.len()).filter(|&k| group[k] == fan).map(|k| (star[k] as usize, node as u32, copy)));
        }
    }
    for (e, old, new) in edits {
        stuffed.tets[e].iter_mut().filter(|a| **a == old).for_each(|a| *a = new);
    }
}

/// Drops all but the largest component.
fn keep_largest(stuffed: &mut Stuffed, outer: &mut Vec<[bool; 4]>) {
    let (component, n) = components(&neighbours(&stuffed.tets));
    let mut sizes = vec![0usize; n];
    component.iter().for_each(|&c| sizes[c as usize] += 1);
    let keep = (0..n).max_by_key(|&c| (sizes[c], n - c)).unwrap_or(0) as u32;
    retain(stuffed, outer, |e| component[e] == keep);
    compact(stuffed);
}
