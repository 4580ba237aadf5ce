//! What meshes of other programs bring along: elements twice, faces wound at will or that are none, elements of two
//! finenesses that do not hang together, other units of length. What can be mended is, and all of it is told.

use std::collections::{BTreeMap, HashMap, HashSet};

use crate::math::{Vec3, bounds};
use crate::mesh::{FACES, TetMesh, sorted};

/// Longest edge of the box about a head or a part of it, m; beyond these a unit of length is doubtful.
const HEAD: [f64; 2] = [2e-3, 2.0];
/// A node lies on an edge or a face if it is nearer than this, as share of the face's longest edge.
const TOUCH: f64 = 1e-6;

/// Mends a mesh whose indices are in range; what was done, and what is doubtful, is added to `told`.
pub(super) fn mend(mesh: &mut TetMesh, told: &mut Vec<String>) {
    drop_unused(mesh, told);
    drop_copies(mesh, told);
    let faces = Faces::of(mesh);
    mend_faces(mesh, &faces, told);
    if faces.crowded > 0 {
        told.push(format!(
            "{} face(s) belong to more than two tetrahedra: elements overlap, tissue counts twice there",
            faces.crowded
        ));
    }
    pieces(mesh, told);
    hanging(mesh, &faces, told);
    let (low, high) = bounds(&mesh.nodes);
    let size = high - low;
    if !(HEAD[0]..=HEAD[1]).contains(&size.max()) {
        let slip = if size.max() > HEAD[1] { "is it in millimetres?" } else { "was it scaled once too often?" };
        told.push(format!(
            "the mesh measures {:.3e} x {:.3e} x {:.3e} m, which is no head: lengths are metres; {slip}",
            size.x, size.y, size.z
        ));
    }
}

/// Leaves out nodes that no tetrahedron uses, and faces and set members that need them.
fn drop_unused(mesh: &mut TetMesh, told: &mut Vec<String>) {
    let mut new = vec![u32::MAX; mesh.nodes.len()];
    mesh.tets.as_flattened().iter().for_each(|&a| new[a as usize] = 0);
    if !new.contains(&u32::MAX) {
        return;
    }
    (0u32..).zip(new.iter_mut().filter(|n| **n == 0)).for_each(|(next, n)| *n = next);
    let at = |a: u32| new.get(a as usize).copied().unwrap_or(u32::MAX);
    let mut keep = new.iter().map(|&n| n != u32::MAX);
    mesh.nodes.retain(|_| keep.next() == Some(true));
    mesh.tets.iter_mut().for_each(|tet| *tet = tet.map(at));
    let mut lost = |what: &str, name: &str, before: usize, after: usize| {
        if after < before {
            told.push(format!("{} {what} `{name}` lie at no tetrahedron and were left out", before - after));
        }
    };
    for set in &mut mesh.node_sets {
        let before = set.nodes.len();
        set.nodes = set.nodes.iter().map(|&a| at(a)).filter(|&a| a != u32::MAX).collect();
        lost("node(s) of the node set", &set.name, before, set.nodes.len());
    }
    for set in &mut mesh.face_sets {
        let before = set.triangles.len();
        set.triangles = set.triangles.iter().map(|t| t.map(at)).filter(|t| !t.contains(&u32::MAX)).collect();
        lost("triangle(s) of the face set", &set.name, before, set.triangles.len());
    }
}

/// Each tetrahedron once, each triangle once in a set: the first stays.
fn drop_copies(mesh: &mut TetMesh, told: &mut Vec<String>) {
    let mut seen: HashMap<[u32; 4], u32> = HashMap::with_capacity(mesh.tets.len());
    let mut copies: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    let mut keep = Vec::with_capacity(mesh.tets.len());
    for (tet, &region) in mesh.tets.iter().zip(&mesh.region) {
        let first = *seen.entry(sorted(*tet)).or_insert(u32::MAX);
        keep.push(first == u32::MAX);
        if first == u32::MAX {
            seen.insert(sorted(*tet), region);
        } else {
            *copies.entry((first, region)).or_default() += 1;
        }
    }
    for ((first, second), count) in copies {
        let name = |r: u32| mesh.region_names.get(r as usize).map_or("", String::as_str);
        let where_ = if first == second {
            format!("in region `{}`", name(first))
        } else {
            format!("in regions `{}` and `{}`: the first counts", name(first), name(second))
        };
        told.push(format!("{count} tetrahedra are listed twice and count once, {where_}"));
    }
    if keep.contains(&false) {
        let mut of_tets = keep.iter();
        mesh.tets.retain(|_| of_tets.next() == Some(&true));
        let mut of_regions = keep.iter();
        mesh.region.retain(|_| of_regions.next() == Some(&true));
    }
    for set in &mut mesh.face_sets {
        let before = set.triangles.len();
        let mut seen = HashSet::with_capacity(before);
        set.triangles.retain(|t| seen.insert(sorted(*t)));
        if set.triangles.len() < before {
            let count = before - set.triangles.len();
            told.push(format!("{count} triangle(s) of the face set `{}` are listed twice and count once", set.name));
        }
    }
}

/// Faces of the tetrahedra by their nodes: wound outward for one of them, and how many share it.
struct Faces {
    all: Vec<([u32; 3], [u32; 3], u32)>,
    crowded: usize,
}

impl Faces {
    fn of(mesh: &TetMesh) -> Self {
        let mut all: Vec<([u32; 3], [u32; 3], u32)> = Vec::with_capacity(4 * mesh.tets.len());
        for tet in &mesh.tets {
            all.extend(FACES.map(|face| face.map(|a| tet[a])).map(|wound| (sorted(wound), wound, 1)));
        }
        all.sort_unstable();
        all.dedup_by(|next, first| {
            let same = next.0 == first.0;
            first.2 += u32::from(same);
            same
        });
        let crowded = all.iter().filter(|f| f.2 > 2).count();
        Self { all, crowded }
    }

    /// The face on these nodes, wound outward, and the number of tetrahedra at it.
    fn find(&self, triangle: [u32; 3]) -> Option<([u32; 3], u32)> {
        let key = sorted(triangle);
        let k = self.all.binary_search_by_key(&key, |f| f.0).ok()?;
        Some((self.all[k].1, self.all[k].2))
    }

    fn boundary(&self) -> impl Iterator<Item = [u32; 3]> {
        self.all.iter().filter(|f| f.2 == 1).map(|f| f.1)
    }
}

/// Winds triangles as the tetrahedron behind them says, and leaves out those that are no face of any.
fn mend_faces(mesh: &mut TetMesh, faces: &Faces, told: &mut Vec<String>) {
    for set in &mut mesh.face_sets {
        let (mut turned, mut inside, mut stray) = (0, 0, 0);
        set.triangles.retain_mut(|t| {
            match faces.find(*t) {
                Some((outward, 1)) if !same_turn(*t, outward) => {
                    *t = [t[0], t[2], t[1]];
                    turned += 1;
                }
                Some((_, 1)) => {}
                Some(_) => inside += 1,
                None => stray += 1,
            }
            faces.find(*t).is_some()
        });
        let name = &set.name;
        if turned > 0 {
            told.push(format!("{turned} triangle(s) of the face set `{name}` were wound inward and have been turned"));
        }
        if inside > 0 {
            told.push(format!(
                "{inside} triangle(s) of the face set `{name}` lie inside the tissue, not on its boundary"
            ));
        }
        if stray > 0 {
            told.push(format!(
                "{stray} triangle(s) of the face set `{name}` are no face of any tetrahedron and were left out"
            ));
        }
    }
}

/// Whether two triangles on the same nodes turn the same way.
fn same_turn(a: [u32; 3], b: [u32; 3]) -> bool {
    (0..3).any(|k| [b[k], b[(k + 1) % 3], b[(k + 2) % 3]] == a)
}

/// Tells of pieces that share no node.
fn pieces(mesh: &TetMesh, told: &mut Vec<String>) {
    let mut parent: Vec<u32> = (0..mesh.nodes.len() as u32).collect();
    fn root(parent: &mut [u32], mut a: u32) -> u32 {
        while parent[a as usize] != a {
            parent[a as usize] = parent[parent[a as usize] as usize];
            a = parent[a as usize];
        }
        a
    }
    for tet in &mesh.tets {
        let first = root(&mut parent, tet[0]);
        for &a in &tet[1..] {
            let other = root(&mut parent, a);
            parent[other as usize] = first;
        }
    }
    let mut sizes: BTreeMap<u32, usize> = BTreeMap::new();
    for tet in &mesh.tets {
        *sizes.entry(root(&mut parent, tet[0])).or_default() += 1;
    }
    if sizes.len() > 1 {
        let least = sizes.values().min().copied().unwrap_or(0);
        told.push(format!(
            "the mesh falls into {} pieces that share no node (the smallest of {least} tetrahedra): where they touch they do \
             not hang together",
            sizes.len()
        ));
    }
}

/// Tells of boundary nodes that lie on a boundary face or edge without being its corner.
fn hanging(mesh: &TetMesh, faces: &Faces, told: &mut Vec<String>) {
    let boundary: Vec<[u32; 3]> = faces.boundary().collect();
    let corners = |t: &[u32; 3]| t.map(|a| mesh.nodes[a as usize]);
    let longest = |x: &[Vec3; 3]| (0..3).map(|k| (x[k] - x[(k + 1) % 3]).norm()).fold(0.0, f64::max);
    let mean = boundary.iter().map(|t| longest(&corners(t))).sum::<f64>() / boundary.len().max(1) as f64;
    if !(mean.is_finite() && mean > 0.0) {
        return;
    }
    let cell = |x: &Vec3| [0, 1, 2].map(|c| (x[c] / mean).floor() as i64);
    let mut nodes: Vec<u32> = boundary.as_flattened().to_vec();
    nodes.sort_unstable();
    nodes.dedup();
    let mut bins: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    nodes.iter().for_each(|&a| bins.entry(cell(&mesh.nodes[a as usize])).or_default().push(a));
    let mut found: Vec<u32> = Vec::new();
    for triangle in &boundary {
        let x = corners(triangle);
        let reach = TOUCH * longest(&x);
        let rim = Vec3::repeat(reach);
        let (low, high) = (cell(&(x[0].inf(&x[1]).inf(&x[2]) - rim)), cell(&(x[0].sup(&x[1]).sup(&x[2]) + rim)));
        let n_cells: i64 =
            (0..3).map(|c| high[c].saturating_sub(low[c]).saturating_add(1)).fold(1, i64::saturating_mul);
        let mut look = |a: u32| {
            if !triangle.contains(&a) && lies_on(&mesh.nodes[a as usize], &x, reach) {
                found.push(a);
            }
        };
        // A face much larger than the others meets more cells than there are.
        if n_cells as usize > bins.len() {
            nodes.iter().for_each(|&a| look(a));
            continue;
        }
        for i in low[0]..=high[0] {
            for j in low[1]..=high[1] {
                for k in low[2]..=high[2] {
                    bins.get(&[i, j, k]).into_iter().flatten().for_each(|&a| look(a));
                }
            }
        }
    }
    found.sort_unstable();
    found.dedup();
    if let Some(&first) = found.first() {
        let p = mesh.nodes[first as usize];
        told.push(format!(
            "{} node(s) hang on an edge or a face without being its corner, the first at ({:.4}, {:.4}, {:.4}) m: elements \
             of two finenesses meet there without sharing nodes, and the tissue is torn along free faces inside the body",
            found.len(),
            p.x,
            p.y,
            p.z
        ));
    }
}

/// Whether a point lies in a triangle or on its edges, but on no corner.
fn lies_on(p: &Vec3, x: &[Vec3; 3], reach: f64) -> bool {
    if x.iter().any(|c| (p - c).norm() <= reach) {
        return false;
    }
    let normal = (x[1] - x[0]).cross(&(x[2] - x[0]));
    let doubled = normal.norm();
    // Also where it is no number.
    if doubled.is_nan() || doubled <= 0.0 || (p - x[0]).dot(&normal).abs() > reach * doubled {
        return false;
    }
    // Above each edge, by the same reach.
    (0..3).all(|k| {
        let edge = x[(k + 1) % 3] - x[k];
        normal.cross(&edge).dot(&(p - x[k])) >= -reach * doubled * edge.norm()
    })
}
