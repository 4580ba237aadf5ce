//! From stuffed tetrahedra to a mesh that scenes can name: slit, face sets, bones, what is released.

use super::Field;
use super::stencils::Stuffed;
use super::stuffing::{NO_WALL, Wall};
use super::topology::{FACES, OPEN, fans, neighbours, stars};
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
    /// Lattice edge, m: bone nodes nearer than this to a second bone are released.
    pub edge: f64,
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
    let mut adjacent = neighbours(&stuffed.tets);
    let (slit_faces, slit_nodes) = match naming.slit {
        Some(slit) => open(&mut stuffed, &mut adjacent, slit),
        None => (Vec::new(), 0),
    };
    let (bone_of, released_nodes) = bones(&stuffed, naming);
    let mut names: Vec<&str> = vec![SKIN];
    names.extend(naming.bones.iter().map(|b| b.name));
    names.extend([CUT, FREE]);
    let (cut, free) = (names.len() - 2, names.len() - 1);
    let mut sets: Vec<FaceSet> = names.iter().map(|n| FaceSet { name: (*n).into(), triangles: Vec::new() }).collect();
    for (e, tet) in stuffed.tets.iter().enumerate() {
        for f in (0..4).filter(|&f| adjacent[e][f] == OPEN) {
            let t = FACES[f].map(|a| tet[a]);
            let in_slit = slit_faces.binary_search(&((4 * e + f) as u32)).is_ok();
            let set = match kind(&stuffed, t, naming) {
                _ if in_slit => free,
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
    let mesh = TetMesh {
        node_sets: (0..naming.bones.len()).map(node_set).collect(),
        face_sets: sets,
        region: vec![0; stuffed.tets.len()],
        region_names: vec!["tissue".into()],
        nodes: stuffed.nodes,
        tets: stuffed.tets,
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
        if near.len() > 1 && near[1].0 < naming.edge {
            released += 1;
            return None;
        }
        near.first().map(|n| n.1)
    });
    let held = held.collect();
    (held, released)
}

/// Parts the tetrahedra along the slit's faces; returns the new boundary faces (4 e + f, sorted) and the nodes doubled.
fn open(stuffed: &mut Stuffed, adjacent: &mut [[u32; 4]], slit: Slit) -> (Vec<u32>, usize) {
    let mut faces = Vec::new();
    let mut touched = vec![false; stuffed.nodes.len()];
    for e in 0..stuffed.tets.len() {
        for f in 0..4 {
            let other = adjacent[e][f];
            if other == OPEN || (other as usize) < e {
                continue;
            }
            let t = FACES[f].map(|a| stuffed.tets[e][a]);
            let corners = t.map(|a| stuffed.nodes[a as usize]);
            let middles = [e, other as usize].map(|e| middle(stuffed, &stuffed.tets[e]));
            if slit(corners, middles[0], middles[1]) {
                let back =
                    (0..4).find(|&g| adjacent[other as usize][g] == e as u32).expect("neighbours know each other");
                faces.extend([(4 * e + f) as u32, (4 * other as usize + back) as u32]);
                t.iter().for_each(|&a| touched[a as usize] = true);
            }
        }
    }
    for &face in &faces {
        adjacent[face as usize / 4][face as usize % 4] = OPEN;
    }
    faces.sort_unstable();
    let n_nodes = stuffed.nodes.len();
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
    (faces, stuffed.nodes.len() - n_nodes)
}
