//! Coarsening: edges collapse, one end onto the other, where shape and surface allow it.
//!
//! A collapse u -> v is made if the links of both ends meet in the link of the edge (the topology stays), the new star is
//! good, its edges are not too long, and each new triangle of a wall stays within the wall's tolerance: the mean distance of
//! ten samples below it, none above four times it, or no worse than the triangle replaced. A node of a wall goes only to
//! a node of the same wall along a surface edge, a node in planes of the box only within them.
//!
//! Source: M. Garland & P. Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997, for the operation;
//! T. Dey, H. Edelsbrunner, S. Guha & D. Nekhayev, "Topology preserving edge contraction", 1999, for the link condition.
//! Departure: sampled distances to the surface itself instead of quadrics, so errors do not add up.

use super::super::stencils::Stuffed;
use super::super::stuffing::{NO_WALL, Wall};
use super::fit::distance;
use super::linked::{GONE, Linked};
use super::shape::score;
use super::sheet::{SHEET, Sheet};
use crate::math::Vec3;
use crate::mesh::signed_volume;

/// A new star is good enough at this worst score; below it must be no worse than what it replaces.
const GOOD: f64 = 0.25;
/// The largest distance of a triangle's samples, in tolerances.
const LARGEST: f64 = 4.0;
/// Cosine of the most that a triangle may turn at once.
const TURN: f64 = 0.6;
/// Edges longer than this share of what is allowed are left alone.
const LONG: f64 = 0.9;
/// Passes over the edges at one tolerance, and the least share of nodes that makes another worth while.
const PASSES: usize = 12;
const WORTH: f64 = 0.004;

/// What a coarse mesh must keep.
pub(in super::super) struct Goal<'a> {
    pub walls: &'a [Wall<'a>],
    /// A sheet inside the mesh, whose faces are listed with the boundary's.
    pub sheet: Option<Sheet<'a>>,
    /// Mean distance that a triangle of a wall may have at a place, m.
    pub tolerance: &'a dyn Fn(u8, &Vec3) -> f64,
    /// Longest edge at a place, m.
    pub longest: &'a dyn Fn(&Vec3) -> f64,
    /// Number of tetrahedra at which to stop.
    pub target: usize,
}

/// A boundary triangle and its wall, or a face of the sheet.
pub(in super::super) type Face = ([u32; 3], u8);

struct Coarsening<'a> {
    on: Linked<'a>,
    longest: Vec<f64>,
    /// Stamps of nodes: what the last look at an edge found about them.
    mark: Vec<u32>,
    stamp: u32,
    alive: usize,
}

/// The surfaces that a triangle may belong to: the boundary and the sheet.
const SURFACES: [bool; 2] = [false, true];

/// Collapses edges until nothing more fits or the target is reached; faces and mesh are renumbered, nodes keep their order.
pub(super) fn coarsen(mesh: &mut Stuffed, faces: &mut Vec<Face>, goal: &Goal) {
    let n = mesh.nodes.len();
    let longest = mesh.nodes.iter().map(goal.longest).collect();
    let alive = mesh.tets.len();
    let mut c = Coarsening { on: Linked::new(mesh, faces), longest, mark: vec![0; n], stamp: 0, alive };
    // A node is looked at again once something near it changed.
    let mut changed = vec![true; n];
    for _ in 0..PASSES {
        let edges = c.edges(&changed);
        changed = vec![false; n];
        let mut collapsed = 0;
        for [a, b] in edges {
            if c.alive <= goal.target {
                break;
            }
            let way = [[a, b], [b, a]].into_iter().find(|&[u, v]| c.allows(u, v, goal));
            if let Some([u, v]) = way {
                c.collapse(u, v, &mut changed);
                collapsed += 1;
            }
        }
        if (collapsed as f64) < WORTH * n as f64 || c.alive <= goal.target {
            break;
        }
    }
    c.on.finish();
}

impl Coarsening<'_> {
    /// Edges short enough to go, the shortest for their place first.
    fn edges(&self, changed: &[bool]) -> Vec<[u32; 2]> {
        let mut out: Vec<(f64, [u32; 2])> = Vec::new();
        let mut near = Vec::new();
        for a in 0..self.on.star.len() as u32 {
            self.neighbours(a, &mut near);
            for &b in near.iter().filter(|&&b| b > a && (changed[a as usize] || changed[b as usize])) {
                let length = (self.on.mesh.nodes[a as usize] - self.on.mesh.nodes[b as usize]).norm();
                let share = length / self.longest[a as usize].min(self.longest[b as usize]);
                if share < LONG {
                    out.push((share, [a, b]));
                }
            }
        }
        out.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)));
        out.into_iter().map(|e| e.1).collect()
    }

    fn neighbours(&self, a: u32, out: &mut Vec<u32>) {
        out.clear();
        for &e in &self.on.star[a as usize] {
            out.extend(self.on.mesh.tets[e as usize].iter().filter(|&&b| b != a));
        }
        out.sort_unstable();
        out.dedup();
    }

    fn allows(&mut self, u: u32, v: u32, goal: &Goal) -> bool {
        let (i, j) = (u as usize, v as usize);
        let mesh = &*self.on.mesh;
        if self.on.star[i].is_empty() || self.on.star[j].is_empty() {
            return false;
        }
        let on_surface = !self.on.fan[i].is_empty();
        let fits = mesh.wall[i] == NO_WALL || mesh.wall[i] == mesh.wall[j];
        let nameless = on_surface && mesh.wall[i] == NO_WALL && mesh.plane[i] == 0;
        if nameless || !fits || mesh.plane[i] & !mesh.plane[j] != 0 || on_surface && self.on.fan[j].is_empty() {
            return false;
        }
        self.links_meet(u, v) && self.stays_good(u, v) && (!on_surface || self.stays_near(u, v, goal))
    }

    /// Whether the links of both ends meet in the link of the edge, in the mesh and on its surface.
    fn links_meet(&mut self, u: u32, v: u32) -> bool {
        let tets = &self.on.mesh.tets;
        if self.stamp > u32::MAX - 3 {
            self.mark.fill(0);
            self.stamp = 0;
        }
        let [of_u, common, closed] = [1, 2, 3].map(|k| self.stamp + k);
        self.stamp += 3;
        let (star_u, star_v) = (&self.on.star[u as usize], &self.on.star[v as usize]);
        for a in star_u.iter().flat_map(|&e| tets[e as usize]) {
            self.mark[a as usize] = of_u;
        }
        let (mut n_common, mut n_closed) = (0, 0);
        for a in star_v.iter().flat_map(|&e| tets[e as usize]).filter(|&a| a != u && a != v) {
            if self.mark[a as usize] == of_u {
                self.mark[a as usize] = common;
                n_common += 1;
            }
        }
        for t in star_u.iter().map(|&e| tets[e as usize]).filter(|t| t.contains(&v)) {
            for a in t.into_iter().filter(|&a| a != u && a != v) {
                if self.mark[a as usize] == common {
                    self.mark[a as usize] = closed;
                    n_closed += 1;
                }
            }
        }
        if n_closed == 0 || n_common != n_closed {
            return false;
        }
        // Faces u p q and v p q without the tetrahedron between them would become one.
        let mark = &self.mark;
        let pairs = |a: u32, other: u32, with: bool| {
            let mut out: Vec<[u32; 2]> = Vec::new();
            let star = self.on.star[a as usize].iter().map(|&e| tets[e as usize]);
            for t in star.filter(|t| t.contains(&other) == with) {
                let mut ring = [0; 4];
                let mut n = 0;
                for b in t.into_iter().filter(|&b| b != a && b != other && mark[b as usize] == closed) {
                    ring[n] = b;
                    n += 1;
                }
                for k in 0..n {
                    out.extend((0..k).map(|l| [ring[k].min(ring[l]), ring[k].max(ring[l])]));
                }
            }
            out
        };
        let (a, b) = (pairs(u, v, false), pairs(v, u, false));
        if a.iter().any(|p| b.contains(p)) {
            let shell = pairs(u, v, true);
            if a.iter().any(|p| b.contains(p) && !shell.contains(p)) {
                return false;
            }
        }
        SURFACES.into_iter().all(|sheet| self.surfaces_meet(u, v, sheet))
    }

    /// The same on the boundary or on the sheet, if `u` lies on it.
    fn surfaces_meet(&self, u: u32, v: u32, sheet: bool) -> bool {
        let of = |a: u32| {
            self.on.fan[a as usize]
                .iter()
                .map(|&f| self.on.faces[f as usize])
                .filter(move |f| (f.1 == SHEET) == sheet)
                .map(|f| f.0)
        };
        if of(u).next().is_none() {
            return true;
        }
        let ring = |a: u32| {
            let mut out: Vec<u32> = of(a).flatten().filter(|&b| b != a).collect();
            out.sort_unstable();
            out
        };
        let mut of_u = ring(u);
        // Round an inner node each neighbour stands twice; where the sheet ends, two stand once.
        let ends = of_u.chunk_by(|a, b| a == b).filter(|g| g.len() == 1).count();
        of_u.dedup();
        let of_v = ring(v);
        let common = of_u.iter().filter(|a| of_v.binary_search(a).is_ok()).count();
        let shared = of(u).filter(|t| t.contains(&v)).count();
        shared == if ends == 0 { 2 } else { 1 } && common == shared
    }

    fn stays_good(&self, u: u32, v: u32) -> bool {
        let mesh = &*self.on.mesh;
        let place = mesh.nodes[v as usize];
        let moved = |t: [u32; 4]| t.map(|a| if a == u { place } else { mesh.nodes[a as usize] });
        let rest = || self.on.star[u as usize].iter().map(|&e| mesh.tets[e as usize]).filter(|t| !t.contains(&v));
        for t in rest() {
            for a in t.into_iter().filter(|&a| a != u) {
                let most = self.longest[a as usize].min(self.longest[v as usize]);
                if (mesh.nodes[a as usize] - place).norm_squared() > most * most {
                    return false;
                }
            }
            if signed_volume(moved(t)) <= 0.0 {
                return false;
            }
        }
        // What is there now is looked at only once something is not good.
        let old = || {
            let all = self.on.star[u as usize].iter();
            all.map(|&e| score(&mesh.tets[e as usize].map(|a| mesh.nodes[a as usize]))).fold(f64::INFINITY, f64::min)
        };
        let mut least: Option<f64> = None;
        rest().all(|t| {
            let new = score(&moved(t));
            new >= GOOD || new > 0.0 && new >= *least.get_or_insert_with(old)
        })
    }

    fn stays_near(&self, u: u32, v: u32, goal: &Goal) -> bool {
        let mesh = &*self.on.mesh;
        let normal = |x: &[Vec3; 3]| (x[1] - x[0]).cross(&(x[2] - x[0]));
        for &f in &self.on.fan[u as usize] {
            let (t, wall) = self.on.faces[f as usize];
            if t.contains(&v) {
                continue;
            }
            let old = t.map(|a| mesh.nodes[a as usize]);
            let new = t.map(|a| mesh.nodes[if a == u { v } else { a } as usize]);
            let (m, n) = (normal(&old), normal(&new));
            if m.dot(&n) < TURN * m.norm() * n.norm() {
                return false;
            }
            if wall == NO_WALL {
                continue;
            }
            let tolerance = (goal.tolerance)(wall, &((new[0] + new[1] + new[2]) / 3.0));
            let field = match (&goal.sheet, wall) {
                (Some(sheet), SHEET) => sheet.level,
                _ => goal.walls[usize::from(wall)].field,
            };
            let [mean, most] = distance(field, &new);
            if (mean > tolerance || most > LARGEST * tolerance) && mean > distance(field, &old)[0] {
                return false;
            }
        }
        true
    }

    fn collapse(&mut self, u: u32, v: u32, changed: &mut [bool]) {
        for e in std::mem::take(&mut self.on.star[u as usize]) {
            let t = self.on.mesh.tets[e as usize];
            t.iter().for_each(|&a| changed[a as usize] = true);
            if t.contains(&v) {
                for a in t.into_iter().filter(|&a| a != u) {
                    self.on.star[a as usize].retain(|&other| other != e);
                }
                self.on.mesh.tets[e as usize] = [GONE; 4];
                self.alive -= 1;
            } else {
                self.on.mesh.tets[e as usize] = t.map(|a| if a == u { v } else { a });
                self.on.star[v as usize].push(e);
            }
        }
        for f in std::mem::take(&mut self.on.fan[u as usize]) {
            let t = self.on.faces[f as usize].0;
            if t.contains(&v) {
                for a in t.into_iter().filter(|&a| a != u) {
                    self.on.fan[a as usize].retain(|&other| other != f);
                }
                self.on.faces[f as usize].0 = [GONE; 3];
            } else {
                self.on.faces[f as usize].0 = t.map(|a| if a == u { v } else { a });
                self.on.fan[v as usize].push(f);
            }
        }
    }
}
