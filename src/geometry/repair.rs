//! One component with a manifold boundary: loose pieces go, pinched nodes are parted, pinched edges lose a corner.

use super::stencils::Stuffed;
use super::topology::{boundary, components, fans, neighbours, pinched_edges, stars};
use crate::math::Vec3;
use crate::mesh::signed_volume;

/// Rounds of repair; each leaves fewer pinches, and two are usual.
pub(super) const ROUNDS: usize = 20;
/// A parted node moves this share of the way into its own piece, so that no two nodes share a place.
const PART: f64 = 0.01;

/// What a repair changed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Repair {
    /// Components that were dropped.
    pub dropped_components: usize,
    /// Their volume, m3.
    pub dropped_volume: f64,
    /// Nodes parted in two.
    pub parted_nodes: usize,
    /// Tetrahedra taken away at pinched edges.
    pub pinched_tets: usize,
}

/// Keeps the largest component, makes its boundary manifold, and numbers the nodes anew without gaps.
pub(super) fn repair(mesh: &mut Stuffed) -> Repair {
    let mut report = Repair::default();
    largest_component(mesh, &mut report);
    for _ in 0..ROUNDS {
        part_nodes(mesh, &mut report);
        let adjacent = neighbours(&mesh.tets);
        let edges = pinched_edges(&boundary(&mesh.tets, &adjacent));
        if edges.is_empty() {
            break;
        }
        let gone = smaller_fans(mesh, &edges, &adjacent);
        report.pinched_tets += gone.iter().filter(|g| **g).count();
        let mut gone = gone.into_iter();
        mesh.tets.retain(|_| gone.next() == Some(false));
        largest_component(mesh, &mut report);
    }
    compact(mesh);
    report
}

fn volume(mesh: &Stuffed, e: usize) -> f64 {
    signed_volume(mesh.tets[e].map(|a| mesh.nodes[a as usize]))
}

fn largest_component(mesh: &mut Stuffed, report: &mut Repair) {
    let (component, n) = components(&neighbours(&mesh.tets));
    if n < 2 {
        return;
    }
    let mut volumes = vec![0.0; n];
    component.iter().enumerate().for_each(|(e, &c)| volumes[c as usize] += volume(mesh, e));
    let keep = (0..n).max_by(|&a, &b| volumes[a].total_cmp(&volumes[b]).then(b.cmp(&a))).unwrap_or(0);
    report.dropped_components += n - 1;
    report.dropped_volume += volumes.iter().sum::<f64>() - volumes[keep];
    let mut component = component.into_iter();
    mesh.tets.retain(|_| component.next() == Some(keep as u32));
}

/// Gives every fan of tetrahedra that meets others only in a node a node of its own.
fn part_nodes(mesh: &mut Stuffed, report: &mut Repair) {
    let adjacent = neighbours(&mesh.tets);
    let mut on_boundary = vec![false; mesh.nodes.len()];
    boundary(&mesh.tets, &adjacent).iter().for_each(|(t, _)| t.iter().for_each(|&a| on_boundary[a as usize] = true));
    let (begin, items) = stars(&mesh.tets, mesh.nodes.len(), &on_boundary);
    for node in (0..on_boundary.len()).filter(|&a| on_boundary[a]) {
        let star = &items[begin[node] as usize..begin[node + 1] as usize];
        let (group, n) = fans(star, node as u32, &mesh.tets, &adjacent);
        for fan in 1..n {
            let mine: Vec<usize> = (0..star.len()).filter(|&k| group[k] == fan).map(|k| star[k] as usize).collect();
            let corners = mine.iter().flat_map(|&e| mesh.tets[e]);
            let centre: Vec3 = corners.map(|a| mesh.nodes[a as usize]).sum::<Vec3>() / (4 * mine.len()) as f64;
            let copy = mesh.nodes.len() as u32;
            mesh.nodes.push(mesh.nodes[node].lerp(&centre, PART));
            mesh.wall.push(mesh.wall[node]);
            mesh.plane.push(mesh.plane[node]);
            for e in mine {
                mesh.tets[e].iter_mut().filter(|a| **a == node as u32).for_each(|a| *a = copy);
            }
            report.parted_nodes += 1;
        }
    }
}

/// The tetrahedra that go: at each pinched edge all round it but the largest group that hangs together there.
pub(super) fn smaller_fans(mesh: &Stuffed, edges: &[[u32; 2]], adjacent: &[[u32; 4]]) -> Vec<bool> {
    let mut wanted = vec![false; mesh.nodes.len()];
    edges.iter().for_each(|e| wanted[e[0] as usize] = true);
    let (begin, items) = stars(&mesh.tets, mesh.nodes.len(), &wanted);
    let mut gone = vec![false; mesh.tets.len()];
    for [p, q] in edges {
        let star = &items[begin[*p as usize] as usize..begin[*p as usize + 1] as usize];
        let round: Vec<u32> = star.iter().copied().filter(|&e| mesh.tets[e as usize].contains(q)).collect();
        let mut group = vec![usize::MAX; round.len()];
        let mut volumes: Vec<f64> = Vec::new();
        for seed in 0..round.len() {
            if group[seed] != usize::MAX {
                continue;
            }
            let mut stack = vec![seed];
            group[seed] = volumes.len();
            volumes.push(0.0);
            while let Some(k) = stack.pop() {
                let e = round[k] as usize;
                volumes[group[seed]] += volume(mesh, e);
                for f in (0..4).filter(|&f| mesh.tets[e][f] != *p && mesh.tets[e][f] != *q) {
                    if let Ok(other) = round.binary_search(&adjacent[e][f])
                        && group[other] == usize::MAX
                    {
                        group[other] = group[seed];
                        stack.push(other);
                    }
                }
            }
        }
        let keep = (0..volumes.len()).max_by(|&a, &b| volumes[a].total_cmp(&volumes[b]).then(b.cmp(&a)));
        (0..round.len()).filter(|&k| Some(group[k]) != keep).for_each(|k| gone[round[k] as usize] = true);
    }
    gone
}

/// Drops nodes that no tetrahedron uses; returns the new number of each node, `u32::MAX` for the dropped.
pub(super) fn compact(mesh: &mut Stuffed) -> Vec<u32> {
    let mut new = vec![u32::MAX; mesh.nodes.len()];
    mesh.tets.as_flattened().iter().for_each(|&a| new[a as usize] = 0);
    (0u32..).zip(new.iter_mut().filter(|n| **n == 0)).for_each(|(next, n)| *n = next);
    let mut used = new.iter().map(|&n| n != u32::MAX);
    mesh.nodes.retain(|_| used.next() == Some(true));
    let mut used = new.iter().map(|&n| n != u32::MAX);
    mesh.wall.retain(|_| used.next() == Some(true));
    let mut used = new.iter().map(|&n| n != u32::MAX);
    mesh.plane.retain(|_| used.next() == Some(true));
    mesh.tets.iter_mut().for_each(|t| *t = t.map(|a| new[a as usize]));
    new
}
