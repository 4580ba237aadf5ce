//! Isosurface stuffing, second half: what is left of each lattice tetrahedron inside the surface.
//!
//! By its inside (-), surface (0) and outside (+) corners a tetrahedron leaves itself, a smaller one, a pyramid or a
//! prism. The quadrilaterals these share with neighbours are split along the shorter diagonal, ties by node number, so
//! both sides agree; a prism whose three diagonals chase each other gets a centre node.
//!
//! Source: F. Labelle & J. R. Shewchuk, "Isosurface Stuffing: Fast Tetrahedral Meshes with Good Dihedral Angles",
//! ACM TOG 26(3), 2007, figure 3.
//! Departure: the shorter diagonal instead of the parity rule; the angles measured stay inside the paper's bounds.

use super::stuffing::{NO_WALL, Warped};
use crate::math::Vec3;
use crate::mesh::signed_volume;

const NONE: u32 = u32::MAX;

/// Tetrahedra between surfaces, each boundary node with the surface that holds it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stuffed {
    /// Node positions, m.
    pub nodes: Vec<Vec3>,
    /// Wall that holds each node, [`NO_WALL`] inside.
    pub wall: Vec<u8>,
    /// Faces of the box that each node lies in: bit 2a for the low face along axis a, 2a + 1 for the high one.
    pub plane: Vec<u8>,
    /// Corners of each tetrahedron, positive volume.
    pub tets: Vec<[u32; 4]>,
}

struct Stencils<'a> {
    warped: &'a Warped<'a>,
    node_of_slot: Vec<u32>,
    node_of_cut: Vec<u32>,
    out: Stuffed,
}

/// Cuts every tetrahedron of a warped lattice to what lies inside.
pub(super) fn stencils(warped: &Warped) -> Stuffed {
    let mut s = Stencils {
        warped,
        node_of_slot: vec![NONE; warped.sign.len()],
        node_of_cut: vec![NONE; warped.cuts.len()],
        out: Stuffed::default(),
    };
    let lattice = warped.lattice;
    lattice.each_tet(|points| {
        let slots = points.map(|c| lattice.slot(c).expect("the piece holds its tetrahedra"));
        if slots.iter().any(|&s| warped.sign[s] == -1) {
            s.tet(points, slots);
        }
    });
    s.out
}

impl Stencils<'_> {
    fn add(&mut self, x: Vec3, wall: u8) -> u32 {
        self.out.nodes.push(x);
        self.out.wall.push(wall);
        self.out.plane.push(0);
        self.out.nodes.len() as u32 - 1
    }

    fn node(&mut self, slot: usize) -> u32 {
        if self.node_of_slot[slot] == NONE {
            self.node_of_slot[slot] = self.add(self.warped.position[slot], self.warped.wall[slot]);
        }
        self.node_of_slot[slot]
    }

    fn tet(&mut self, points: [[i32; 3]; 4], slots: [usize; 4]) {
        let sign = slots.map(|s| self.warped.sign[s]);
        let with = |wanted: i8| (0..4).filter(move |&k| sign[k] == wanted).collect::<Vec<_>>();
        let (inside, zero, outside) = (with(-1), with(0), with(1));
        let node = inside.iter().chain(&zero).map(|&k| self.node(slots[k])).collect::<Vec<_>>();
        let mut cut = |i: usize, o: usize| {
            let n = self.warped.cut_between(slots[i], points[i], points[o]).expect("an edge from - to + has its cut");
            if self.node_of_cut[n] == NONE {
                let c = self.warped.cuts[n];
                self.node_of_cut[n] = self.add(c.position, c.wall);
            }
            self.node_of_cut[n]
        };
        match (inside.as_slice(), outside.as_slice()) {
            (_, []) => self.emit([node[0], node[1], node[2], node[3]]),
            (&[i], _) => {
                let mut corners = node;
                corners.extend(outside.iter().map(|&o| cut(i, o)));
                self.emit([corners[0], corners[1], corners[2], corners[3]]);
            }
            (&[i, j], &[o]) => {
                let (ci, cj) = (cut(i, o), cut(j, o));
                let (p, q, apex) = (node[0], node[1], node[2]);
                if self.splits(p, cj, q, ci) {
                    self.emit([p, q, cj, apex]);
                    self.emit([p, cj, ci, apex]);
                } else {
                    self.emit([p, q, ci, apex]);
                    self.emit([q, cj, ci, apex]);
                }
            }
            (&[i, j], &[o, r]) => {
                let low = [node[0], cut(i, o), cut(i, r)];
                let high = [node[1], cut(j, o), cut(j, r)];
                self.prism(low, high, false);
            }
            (&[i, j, k], &[o]) => {
                let high = [cut(i, o), cut(j, o), cut(k, o)];
                self.prism([node[0], node[1], node[2]], high, true);
            }
            _ => {}
        }
    }

    /// Whether the quadrilateral a-c, b-d is split by a-c: the shorter diagonal, ties by the lowest node.
    fn splits(&self, a: u32, c: u32, b: u32, d: u32) -> bool {
        let square = |p: u32, q: u32| (self.out.nodes[p as usize] - self.out.nodes[q as usize]).norm_squared();
        let (ac, bd) = (square(a, c), square(b, d));
        ac < bd || (ac == bd && a.min(c) < b.min(d))
    }

    /// A prism with columns low[k]-high[k]; the side between columns 1 and 2 is shared only if `closed`.
    fn prism(&mut self, low: [u32; 3], high: [u32; 3], closed: bool) {
        // up[k]: the diagonal between columns k and k+1 climbs from low[k] to high[k+1].
        let side = |k: usize| {
            let n = (k + 1) % 3;
            self.splits(low[k], high[n], low[n], high[k])
        };
        let mut up = [side(0), side(1), side(2)];
        if !closed {
            let choose = |climbs: bool| {
                let up = [up[0], climbs, up[2]];
                column_order(up).map_or(f64::NEG_INFINITY, |o| self.least_volume(&pieces(low, high, o)))
            };
            let (yes, no) = (choose(true), choose(false));
            if yes != no {
                up[1] = yes > no;
            } else if column_order(up).is_none() {
                up[1] = !up[1];
            }
        }
        match column_order(up) {
            Some(order) => pieces(low, high, order).into_iter().for_each(|t| self.emit(t)),
            None => self.round_centre(low, high, up),
        }
    }

    fn least_volume(&self, tets: &[[u32; 4]; 3]) -> f64 {
        let volume = |t: &[u32; 4]| signed_volume(t.map(|a| self.out.nodes[a as usize])).abs();
        tets.iter().map(volume).fold(f64::INFINITY, f64::min)
    }

    fn round_centre(&mut self, low: [u32; 3], high: [u32; 3], up: [bool; 3]) {
        let sum: Vec3 = low.iter().chain(&high).map(|&a| self.out.nodes[a as usize]).sum();
        let centre = self.add(sum / 6.0, NO_WALL);
        self.emit([low[0], low[1], low[2], centre]);
        self.emit([high[0], high[1], high[2], centre]);
        for k in 0..3 {
            let n = (k + 1) % 3;
            let (first, second) = if up[k] {
                ([low[k], low[n], high[n]], [low[k], high[n], high[k]])
            } else {
                ([low[k], low[n], high[k]], [low[n], high[n], high[k]])
            };
            for [a, b, c] in [first, second] {
                self.emit([a, b, c, centre]);
            }
        }
    }

    fn emit(&mut self, tet: [u32; 4]) {
        let positive = signed_volume(tet.map(|a| self.out.nodes[a as usize])) >= 0.0;
        self.out.tets.push(if positive { tet } else { [tet[0], tet[1], tet[3], tet[2]] });
    }
}

/// The order of the columns in which every diagonal climbs, if there is one.
fn column_order(up: [bool; 3]) -> Option<[usize; 3]> {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    ORDERS.into_iter().find(|order| {
        let rank = |c: usize| order.iter().position(|&o| o == c).unwrap_or(0);
        (0..3).all(|k| up[k] == (rank(k) < rank((k + 1) % 3)))
    })
}

fn pieces(low: [u32; 3], high: [u32; 3], [p, q, r]: [usize; 3]) -> [[u32; 4]; 3] {
    [[low[p], low[q], low[r], high[r]], [low[p], low[q], high[q], high[r]], [low[p], high[p], high[q], high[r]]]
}
