//! Swaps: the worst tetrahedra are joined with their neighbours and parted anew.
//!
//! An inner edge goes and the ring of nodes round it is triangulated so that the worst new tetrahedron is best; an inner face
//! between two tetrahedra gives way to an edge; a flat tetrahedron with two boundary faces is peeled off; an edge is split by
//! a node in the middle of its ring. Each is done if the worst score rises. Faces of the sheet stay.
//!
//! Source: L. Freitag & C. Ollivier-Gooch, "Tetrahedral mesh improvement using swapping and smoothing", Int. J. Numer. Meth.
//! Engng 40, 1997; J. Shewchuk, "Two discrete optimization algorithms for the topological improvement of tetrahedral
//! meshes", 2002, for the triangulation of the ring.

use super::super::stencils::Stuffed;
use super::super::stuffing::{NO_WALL, Wall};
use super::super::topology::FACES;
use super::collapse::Face;
use super::fit::distance;
use super::linked::{GONE, Linked};
use super::shape::{Star, score};
use super::sheet::SHEET;
use crate::math::Vec3;

/// Largest ring that is triangulated anew.
const RING: usize = 7;
/// A swap must better the worst score by this factor.
const BETTER: f64 = 1.02;
/// Steps of a new node to its best place.
const INSERT_STEPS: usize = 8;
const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

struct Swapping<'a> {
    on: Linked<'a>,
    walls: &'a [Wall<'a>],
}

/// Swaps round tetrahedra whose score is below `limit`, at most `rounds` times over; returns how many swaps were made.
pub(super) fn swap(mesh: &mut Stuffed, faces: &mut Vec<Face>, walls: &[Wall], limit: f64, rounds: usize) -> usize {
    let mut s = Swapping { on: Linked::new(mesh, faces), walls };
    let mut all = 0;
    for _ in 0..rounds {
        let mut bad: Vec<(f64, u32)> = (0..s.on.mesh.tets.len() as u32)
            .filter(|&e| s.on.mesh.tets[e as usize][0] != GONE)
            .map(|e| (s.score_of(e), e))
            .filter(|b| b.0 < limit)
            .collect();
        bad.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)));
        let mut made = 0;
        for (_, e) in bad {
            if s.on.mesh.tets[e as usize][0] != GONE && (s.edges(e) || s.sides(e) || s.peel(e) || s.insert(e)) {
                made += 1;
            }
        }
        all += made;
        if made == 0 {
            break;
        }
    }
    s.on.finish();
    all
}

impl Swapping<'_> {
    fn at(&self, t: [u32; 4]) -> [Vec3; 4] {
        t.map(|a| self.on.mesh.nodes[a as usize])
    }

    fn score_of(&self, e: u32) -> f64 {
        score(&self.at(self.on.mesh.tets[e as usize]))
    }

    fn face(&self, a: u32, b: u32, c: u32) -> Option<u32> {
        self.on.fan[a as usize].iter().copied().find(|&f| {
            let t = self.on.faces[f as usize].0;
            t.contains(&b) && t.contains(&c)
        })
    }

    fn on_surface(&self, a: u32, b: u32) -> bool {
        self.on.fan[a as usize].iter().any(|&f| self.on.faces[f as usize].0.contains(&b))
    }

    /// The tetrahedra round an edge inside the mesh.
    fn round(&self, a: u32, b: u32) -> Option<Vec<u32>> {
        let star = self.on.star[a as usize].iter().copied();
        (!self.on_surface(a, b)).then(|| star.filter(|&e| self.on.mesh.tets[e as usize].contains(&b)).collect())
    }

    fn worst(&self, tets: &[u32]) -> f64 {
        tets.iter().map(|&e| self.score_of(e)).fold(f64::INFINITY, f64::min)
    }

    fn replace(&mut self, old: &[u32], new: &[[u32; 4]]) {
        for &e in old {
            for a in self.on.mesh.tets[e as usize] {
                self.on.star[a as usize].retain(|&other| other != e);
            }
            self.on.mesh.tets[e as usize] = [GONE; 4];
        }
        for t in new {
            let e = self.on.mesh.tets.len() as u32;
            self.on.mesh.tets.push(*t);
            t.iter().for_each(|&a| self.on.star[a as usize].push(e));
        }
    }

    /// Removes the edge of a tetrahedron whose ring is better without it.
    fn edges(&mut self, e: u32) -> bool {
        for [i, j] in EDGES {
            let t = self.on.mesh.tets[e as usize];
            let (a, b) = (t[i], t[j]);
            let Some(round) = self.round(a, b) else { continue };
            let Some(ring) = self.ring(a, b, &round) else { continue };
            let old = self.worst(&round);
            let Some((worst, triangles)) = self.triangulated(a, b, &ring) else { continue };
            if worst > BETTER * old && worst > 0.0 {
                let new: Vec<[u32; 4]> = triangles.iter().flat_map(|&[p, q, r]| [[p, q, r, b], [p, r, q, a]]).collect();
                self.replace(&round, &new);
                return true;
            }
        }
        false
    }

    /// The nodes round an inner edge in order, so that (a, b, ring[k], ring[k+1]) is positive.
    fn ring(&self, a: u32, b: u32, round: &[u32]) -> Option<Vec<u32>> {
        if !(3..=RING).contains(&round.len()) {
            return None;
        }
        let mut next: Vec<[u32; 2]> = Vec::with_capacity(round.len());
        for &e in round {
            let t = self.on.mesh.tets[e as usize];
            let rest: Vec<u32> = t.into_iter().filter(|&n| n != a && n != b).collect();
            let x = self.at([a, b, rest[0], rest[1]]);
            let positive = (x[1] - x[0]).cross(&(x[2] - x[0])).dot(&(x[3] - x[0])) > 0.0;
            next.push(if positive { [rest[0], rest[1]] } else { [rest[1], rest[0]] });
        }
        let mut ring = vec![next[0][0]];
        while ring.len() < next.len() {
            let last = *ring.last()?;
            let step = next.iter().find(|p| p[0] == last)?;
            ring.push(step[1]);
        }
        let last = *ring.last()?;
        next.iter().any(|p| *p == [last, ring[0]]).then_some(ring)
    }

    /// The triangulation of a ring whose worst tetrahedron, to both ends of the edge, is best.
    fn triangulated(&self, a: u32, b: u32, ring: &[u32]) -> Option<(f64, Vec<[u32; 3]>)> {
        let n = ring.len();
        // best[i][j]: worst score of the part of the ring from i to j, and the corner that its last triangle takes.
        let mut best = [[(f64::INFINITY, 0usize); RING]; RING];
        for span in 2..n {
            for i in 0..n - span {
                let j = i + span;
                let mut found = (f64::NEG_INFINITY, 0);
                for k in i + 1..j {
                    let [p, q, r] = [ring[i], ring[k], ring[j]];
                    let own = score(&self.at([p, q, r, b])).min(score(&self.at([p, r, q, a])));
                    let whole = own.min(best[i][k].0).min(best[k][j].0);
                    if whole > found.0 {
                        found = (whole, k);
                    }
                }
                best[i][j] = found;
            }
        }
        let worst = best[0][n - 1].0;
        if worst <= 0.0 {
            return None;
        }
        let mut triangles = Vec::new();
        let mut stack = vec![(0, n - 1)];
        while let Some((i, j)) = stack.pop() {
            if j > i + 1 {
                let k = best[i][j].1;
                triangles.push([ring[i], ring[k], ring[j]]);
                stack.extend([(i, k), (k, j)]);
            }
        }
        Some((worst, triangles))
    }

    /// Splits an inner edge of a tetrahedron where a node in the ring's middle makes all round it better.
    fn insert(&mut self, e: u32) -> bool {
        let mut star = Star::default();
        for [i, j] in EDGES {
            let t = self.on.mesh.tets[e as usize];
            let (a, b) = (t[i], t[j]);
            let Some(round) = self.round(a, b) else { continue };
            let old = self.worst(&round);
            // From a tetrahedron (.. a .. b ..) one half each: the new node in the place of a, and in that of b.
            let halves: Vec<([u32; 4], u32)> =
                round.iter().flat_map(|&e| [a, b].map(|gone| (self.on.mesh.tets[e as usize], gone))).collect();
            let face = |(t, gone): &([u32; 4], u32)| {
                let k = t.iter().position(|n| n == gone).unwrap_or(0);
                FACES[k].map(|c| self.on.mesh.nodes[t[c] as usize])
            };
            let mut x = 0.5 * (self.on.mesh.nodes[a as usize] + self.on.mesh.nodes[b as usize]);
            star.around(halves.iter().map(face), &x);
            let mut worst = star.worst(&x);
            for _ in 0..INSERT_STEPS {
                let (energy, _) = star.energy(&x, 6);
                if !energy.is_finite() {
                    break;
                }
                let (gradient, hessian) = star.derivatives(&x, 6);
                let Some(step) = hessian.cholesky().map(|c| -c.solve(&gradient)) else { break };
                let step = step * (0.5 * star.shortest / step.norm().max(f64::MIN_POSITIVE)).min(1.0);
                let better = [1.0, 0.4, 0.16].map(|s| x + step * s).into_iter().find(|y| star.energy(y, 6).0 < energy);
                let Some(y) = better else { break };
                x = y;
                worst = star.worst(&x);
            }
            if worst > BETTER * old {
                let m = self.on.mesh.nodes.len() as u32;
                self.on.mesh.nodes.push(x);
                self.on.mesh.wall.push(NO_WALL);
                self.on.mesh.plane.push(0);
                self.on.star.push(Vec::new());
                self.on.fan.push(Vec::new());
                let new: Vec<[u32; 4]> =
                    halves.iter().map(|&(t, gone)| t.map(|n| if n == gone { m } else { n })).collect();
                self.replace(&round, &new);
                return true;
            }
        }
        false
    }

    /// Replaces a face of a tetrahedron by the edge between the two corners opposite.
    fn sides(&mut self, e: u32) -> bool {
        for f in 0..4 {
            let t = self.on.mesh.tets[e as usize];
            let [p, q, r] = FACES[f].map(|k| t[k]);
            let a = t[f];
            if self.face(p, q, r).is_some() {
                continue;
            }
            let other = self.on.star[p as usize].iter().copied().find(|&o| {
                let t = self.on.mesh.tets[o as usize];
                o != e && t.contains(&q) && t.contains(&r)
            });
            let Some(other) = other else { continue };
            let Some(b) = self.on.mesh.tets[other as usize].into_iter().find(|&n| n != p && n != q && n != r) else {
                continue;
            };
            // The face p q r is wound outward from a: (p, q, r, b) is positive.
            let new = [[a, p, q, b], [a, q, r, b], [a, r, p, b]];
            let worst = new.iter().map(|t| score(&self.at(*t))).fold(f64::INFINITY, f64::min);
            if worst > 0.0 && worst > BETTER * self.score_of(e).min(self.score_of(other)) {
                self.replace(&[e, other], &new);
                return true;
            }
        }
        false
    }

    /// Takes away a flat tetrahedron with two boundary faces of one wall, if the surface gets no further off.
    fn peel(&mut self, e: u32) -> bool {
        let t = self.on.mesh.tets[e as usize];
        let own: Vec<(usize, u32)> = (0..4)
            .filter_map(|f| {
                let [p, q, r] = FACES[f].map(|k| t[k]);
                self.face(p, q, r).map(|face| (f, face))
            })
            .collect();
        let [(f, one), (g, two)] = own[..] else { return false };
        let wall = self.on.faces[one as usize].1;
        if wall == SHEET || wall == NO_WALL || self.on.faces[two as usize].1 != wall {
            return false;
        }
        // Faces f and g lie opposite corners f and g; the edge between those becomes one of the surface.
        if self.on_surface(t[f], t[g]) || self.on.star[t[f] as usize].len() < 2 {
            return false;
        }
        let rest: Vec<usize> = (0..4).filter(|k| *k != f && *k != g).collect();
        // An edge that ends with this tetrahedron would leave a node behind.
        if rest.iter().any(|&k| self.on.star[t[k] as usize].len() < 2) {
            return false;
        }
        let new: Vec<[u32; 3]> = rest.iter().map(|&k| FACES[k].map(|c| t[c])).map(|[p, q, r]| [p, r, q]).collect();
        let old = [one, two].map(|f| self.on.faces[f as usize].0);
        let field = self.walls[usize::from(wall)].field;
        let mean = |t: &[u32; 3]| distance(field, &t.map(|a| self.on.mesh.nodes[a as usize]))[0];
        let off = |list: &[[u32; 3]]| list.iter().map(mean).sum::<f64>();
        let size = (self.on.mesh.nodes[t[f] as usize] - self.on.mesh.nodes[t[g] as usize]).norm();
        if off(&new) > off(&old).max(0.02 * size) {
            return false;
        }
        self.replace(&[e], &[]);
        for f in [one, two] {
            for a in self.on.faces[f as usize].0 {
                self.on.fan[a as usize].retain(|&other| other != f);
            }
            self.on.faces[f as usize].0 = [GONE; 3];
        }
        for t in new {
            let f = self.on.faces.len() as u32;
            self.on.faces.push((t, wall));
            t.iter().for_each(|&a| self.on.fan[a as usize].push(f));
        }
        true
    }
}
