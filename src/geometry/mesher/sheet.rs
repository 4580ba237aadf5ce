//! A sheet inside tissue along which it can part: made of faces, ending on a smooth rim.
//!
//! The sheet is the zero of one field where another, the distance from its rim along it, is negative. Nodes near it move onto
//! it, edges that still cross it are split there, and the sheet's nodes next to the rim are drawn onto the rim. Splitting an
//! edge splits all tetrahedra round it, so the mesh stays conforming whatever the order, and where the sheet ends too.

use std::collections::HashMap;

use super::super::Field;
use super::super::stencils::Stuffed;
use super::super::stuffing::{NO_WALL, Wall};
use super::super::topology::{FACES, OPEN, neighbours};
use super::collapse::Face;
use super::cut::Cuts;
use super::shape::Star;
use super::smooth::Stars;
use super::walls::Held;
use crate::math::Vec3;
use crate::mesh::signed_volume;

/// Bits of a node's bounds, behind the six faces of the box.
pub(in super::super) const ON_SHEET: u8 = 1 << 6;
pub(in super::super) const ON_RIM: u8 = 1 << 7;
/// Number of the sheet in the list of faces.
pub(in super::super) const SHEET: u8 = NO_WALL - 1;

/// A node moves onto the sheet over this share of its shortest edge.
const REACH: f64 = 0.35;
/// A star that gives way to the sheet keeps this score, or this share of what it had.
const LEAST: f64 = 0.12;
/// So far beyond its rim the mesh is cut too, in longest edges there: the rim has faces on both sides.
const BEYOND: f64 = 1.5;

/// A sheet and where it ends.
#[derive(Clone, Copy)]
pub(in super::super) struct Sheet<'a> {
    /// Signed distance to the sheet, m, near it.
    pub level: &'a dyn Field,
    /// Distance from the rim along the sheet, m; negative where the sheet is.
    pub rim: &'a dyn Field,
}

/// Puts a sheet into a mesh: its nodes are marked, its faces returned, each once. `faces` follow the splits.
pub(super) fn insert(mesh: &mut Stuffed, faces: &mut Vec<Face>, walls: &[Wall], sheet: &Sheet) -> Vec<[u32; 3]> {
    let active = active(mesh, sheet);
    let mut sign: Vec<i8> =
        mesh.nodes.iter().zip(&active).map(|(x, &on)| if on && sheet.level.at(x) < 0.0 { -1 } else { 1 }).collect();
    draw(mesh, walls, sheet, &active, &mut sign);
    split(mesh, faces, sheet, &active, &mut sign);
    let mut found = between(mesh, sheet, &sign);
    trim(mesh, walls, sheet, &mut found);
    found
}

/// Nodes of tetrahedra that the sheet crosses within its rim or little beyond.
fn active(mesh: &Stuffed, sheet: &Sheet) -> Vec<bool> {
    let mut active = vec![false; mesh.nodes.len()];
    for t in &mesh.tets {
        let x = t.map(|a| mesh.nodes[a as usize]);
        let edge = (x[0] - x[1]).norm().max((x[2] - x[3]).norm()).max((x[0] - x[2]).norm());
        let beyond = BEYOND * edge;
        if x.iter().any(|x| sheet.rim.at(x) < beyond && sheet.level.at(x).abs() < 2.0 * edge) {
            t.iter().for_each(|&a| active[a as usize] = true);
        }
    }
    active
}

/// Moves nodes that lie near the sheet onto it where their stars allow.
fn draw(mesh: &mut Stuffed, walls: &[Wall], sheet: &Sheet, active: &[bool], sign: &mut [i8]) {
    let stars = Stars::of(mesh);
    let held = Held::new(walls, mesh.nodes.len()).with_sheet(sheet);
    let mut star = Star::default();
    for a in (0..mesh.nodes.len()).filter(|&a| active[a]) {
        let x = mesh.nodes[a];
        star.read(&mesh.nodes, &mesh.tets, stars.star(a), a as u32);
        if sheet.level.at(&x).abs() > REACH * star.shortest {
            continue;
        }
        if bind(mesh, &held, &star, a, ON_SHEET, 1.5 * REACH * star.shortest) {
            sign[a] = 0;
        }
    }
}

/// Binds a node to the sheet or its rim and moves it there, if it is nearer than `most` and its star allows.
fn bind(mesh: &mut Stuffed, held: &Held, star: &Star, a: usize, bit: u8, most: f64) -> bool {
    let (x, bounds) = (mesh.nodes[a], mesh.plane[a]);
    mesh.plane[a] |= bit;
    let allowed = |y: &Vec3| (y - x).norm() < most && star.worst(y) > LEAST.min(0.5 * star.worst(&x));
    match held.returned(mesh, a, x).filter(allowed) {
        Some(y) => mesh.nodes[a] = y,
        None => mesh.plane[a] = bounds,
    }
    mesh.plane[a] & bit != 0
}

/// Splits every edge between nodes on both sides, the longest first.
fn split(mesh: &mut Stuffed, faces: &mut Vec<Face>, sheet: &Sheet, active: &[bool], sign: &mut Vec<i8>) {
    let level = |p: &Vec3| sheet.level.at(p);
    let value: Vec<f64> =
        mesh.nodes.iter().zip(active).map(|(x, &on)| if on { level(x) } else { f64::INFINITY }).collect();
    // Only edges whose ends are both looked at: beyond, the sheet just ends.
    let seen: Vec<i8> = sign.iter().zip(active).map(|(&s, &on)| if on { s } else { 0 }).collect();
    let cuts = Cuts::find(mesh, &seen, &value, &level);
    let length = |[a, b]: [usize; 2]| (mesh.nodes[a] - mesh.nodes[b]).norm();
    let mut edges: Vec<([usize; 2], Vec3)> = cuts.edges().map(|(e, x)| (e, *x)).collect();
    edges.sort_by(|p, q| length(q.0).total_cmp(&length(p.0)).then(p.0.cmp(&q.0)));
    split_edges(mesh, faces, edges);
    sign.resize(mesh.nodes.len(), 0);
    mesh.plane[seen.len()..].iter_mut().for_each(|b| *b |= ON_SHEET);
}

/// Splits edges at places on them, one after the other; triangles of `faces` are split with them.
pub(in super::super) fn split_edges(mesh: &mut Stuffed, faces: &mut Vec<Face>, edges: Vec<([usize; 2], Vec3)>) {
    let mut star: HashMap<u32, Vec<u32>> = HashMap::new();
    let mut fan: HashMap<u32, Vec<u32>> = HashMap::new();
    for &([a, b], _) in &edges {
        star.entry(a as u32).or_default();
        star.entry(b as u32).or_default();
    }
    for (e, t) in mesh.tets.iter().enumerate() {
        t.iter().for_each(|a| {
            if let Some(s) = star.get_mut(a) {
                s.push(e as u32);
            }
        });
    }
    for (f, (t, _)) in faces.iter().enumerate() {
        t.iter().filter(|a| star.contains_key(a)).for_each(|a| fan.entry(*a).or_default().push(f as u32));
    }
    for ([a, b], x) in edges {
        let (a, b) = (a as u32, b as u32);
        let new = mesh.nodes.len() as u32;
        mesh.nodes.push(x);
        let mut on_surface = false;
        let mine: Vec<u32> =
            fan.get(&a).into_iter().flatten().copied().filter(|&f| faces[f as usize].0.contains(&b)).collect();
        for f in mine {
            on_surface = true;
            let (t, wall) = faces[f as usize];
            faces[f as usize].0 = t.map(|n| if n == b { new } else { n });
            let other = faces.len() as u32;
            faces.push((t.map(|n| if n == a { new } else { n }), wall));
            relink(&mut fan, t, [a, b], [f, other]);
        }
        let (p, q) = (a as usize, b as usize);
        let same = on_surface && mesh.wall[p] == mesh.wall[q];
        mesh.wall.push(if same { mesh.wall[p] } else { NO_WALL });
        mesh.plane.push(if on_surface { mesh.plane[p] & mesh.plane[q] } else { 0 });
        let mine: Vec<u32> = star[&a].iter().copied().filter(|&e| mesh.tets[e as usize].contains(&b)).collect();
        for e in mine {
            let t = mesh.tets[e as usize];
            mesh.tets[e as usize] = t.map(|n| if n == b { new } else { n });
            let other = mesh.tets.len() as u32;
            mesh.tets.push(t.map(|n| if n == a { new } else { n }));
            relink(&mut star, t, [a, b], [e, other]);
        }
    }
}

/// Brings lists up to date after an edge a-b of an item was split: the item keeps a, another has b and all the rest, too.
fn relink<const N: usize>(
    lists: &mut HashMap<u32, Vec<u32>>,
    nodes: [u32; N],
    [a, b]: [u32; 2],
    [own, other]: [u32; 2],
) {
    for n in nodes {
        if let Some(list) = lists.get_mut(&n) {
            if n == b {
                list.retain(|&k| k != own);
            }
            if n != a {
                list.push(other);
            }
        }
    }
}

/// Faces of nodes on the sheet between tetrahedra on its two sides.
fn between(mesh: &Stuffed, sheet: &Sheet, sign: &[i8]) -> Vec<[u32; 3]> {
    let side = |e: usize| {
        let sum: i32 = mesh.tets[e].iter().map(|&a| i32::from(sign[a as usize])).sum();
        if sum != 0 {
            return sum > 0;
        }
        let middle = mesh.tets[e].iter().map(|&a| mesh.nodes[a as usize]).sum::<Vec3>() / 4.0;
        sheet.level.at(&middle) > 0.0
    };
    let adjacent = neighbours(&mesh.tets);
    let mut out = Vec::new();
    for (e, t) in mesh.tets.iter().enumerate() {
        for f in 0..4 {
            let other = adjacent[e][f];
            let face = FACES[f].map(|k| t[k]);
            let on = face.iter().all(|&a| sign[a as usize] == 0);
            if other != OPEN && (other as usize) > e && on && side(e) != side(other as usize) {
                out.push(face);
            }
        }
    }
    out
}

/// Draws nodes next to the rim onto it and leaves the faces within it; nodes of other faces are free again.
fn trim(mesh: &mut Stuffed, walls: &[Wall], sheet: &Sheet, faces: &mut Vec<[u32; 3]>) {
    let mut edges: Vec<(f64, [u32; 2])> = Vec::new();
    for t in faces.iter() {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            let [p, q] = [a, b].map(|n| sheet.rim.at(&mesh.nodes[n as usize]));
            if p * q < 0.0 {
                let near = if p.abs() < q.abs() { [a, b] } else { [b, a] };
                edges.push((p.abs().min(q.abs()), near));
            }
        }
    }
    edges.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)));
    edges.dedup();
    let stars = Stars::of(mesh);
    let held = Held::new(walls, mesh.nodes.len()).with_sheet(sheet);
    let mut star = Star::default();
    for (_, [near, far]) in edges {
        if mesh.plane[near as usize] & ON_RIM != 0 || mesh.plane[far as usize] & ON_RIM != 0 {
            continue;
        }
        for a in [near as usize, far as usize] {
            star.read(&mesh.nodes, &mesh.tets, stars.star(a), a as u32);
            if bind(mesh, &held, &star, a, ON_RIM, star.mean) {
                break;
            }
        }
    }
    let inside = |a: u32| mesh.plane[a as usize] & ON_RIM != 0 || sheet.rim.at(&mesh.nodes[a as usize]) < 0.0;
    faces.retain(|t| {
        let middle = t.iter().map(|&a| mesh.nodes[a as usize]).sum::<Vec3>() / 3.0;
        t.iter().all(|&a| inside(a)) && sheet.rim.at(&middle) < 0.0
    });
    let mut used = vec![false; mesh.nodes.len()];
    faces.iter().flatten().for_each(|&a| used[a as usize] = true);
    for (bounds, used) in mesh.plane.iter_mut().zip(used) {
        if !used {
            *bounds &= !(ON_SHEET | ON_RIM);
        }
    }
    debug_assert!(mesh.tets.iter().all(|t| signed_volume(t.map(|a| mesh.nodes[a as usize])) > 0.0));
}
