//! Isosurface stuffing, first half: signs, cut points, and the lattice drawn to the surface.
//!
//! A node keeps a sign (inside -, on the surface 0, outside +); an edge from - to + carries a cut point. A node nearer to
//! a cut point of its own than `alpha` times the edge is moved onto it and becomes 0, which takes all its cuts away.
//!
//! Source: F. Labelle & J. R. Shewchuk, "Isosurface Stuffing: Fast Tetrahedral Meshes with Good Dihedral Angles",
//! ACM TOG 26(3), 2007, sections 3.1-3.3; the alphas of the 10.78..164.74 degree row of their table.
//! Departure: several surfaces at once, each cut remembers which; nodes on a rail plane move inside it.

use super::lattice::Lattice;
use super::{Field, gradient};
use crate::math::Vec3;

/// Warp thresholds for the cubes' edges and for the half diagonals.
const ALPHA_LONG: f64 = 0.24999;
const ALPHA_SHORT: f64 = 0.41189;
/// Halvings of an edge on the way to a root: 2^-28 of an edge is below a picometre.
const HALVINGS: usize = 28;
/// Steps back to the surface along a rail, and how far from its place a node may go, in edges.
const RAIL_STEPS: usize = 6;
const RAIL_REACH: f64 = 0.35;

/// Mark of a node that no surface holds.
pub const NO_WALL: u8 = u8::MAX;

/// Which side of a surface is tissue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Where the field is negative.
    Inside,
    /// Where the field is positive.
    Outside,
}

/// A surface that bounds the tissue.
#[derive(Clone, Copy)]
pub struct Wall<'a> {
    /// Name of the face set it becomes.
    pub name: &'a str,
    /// Its signed distance.
    pub field: &'a dyn Field,
    /// The side on which the tissue lies.
    pub side: Side,
}

impl Wall<'_> {
    /// Signed distance to the wall, negative in the tissue, m.
    pub fn depth(&self, p: &Vec3) -> f64 {
        if self.side == Side::Inside { self.field.at(p) } else { -self.field.at(p) }
    }

    /// [`Wall::depth`] and its gradient.
    pub fn slope(&self, p: &Vec3) -> (f64, Vec3) {
        let (d, slope) = self.field.slope(p);
        if self.side == Side::Inside { (d, slope) } else { (-d, -slope) }
    }

    fn level(&self, p: &Vec3) -> f64 {
        if self.side == Side::Inside { self.field.level(p) } else { -self.field.level(p) }
    }
}

/// A point where a surface crosses a lattice edge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cut {
    pub position: Vec3,
    pub wall: u8,
}

/// The warped lattice: node slots with sign, position and wall; cuts by edge.
pub(super) struct Warped<'a> {
    pub lattice: &'a Lattice,
    pub walls: &'a [Wall<'a>],
    /// -1 inside, 0 on a surface, 1 outside, 2 not part of the piece.
    pub sign: Vec<i8>,
    pub position: Vec<Vec3>,
    pub wall: Vec<u8>,
    pub cuts: Vec<Cut>,
    /// Cut number + 1 of each edge, 14 a node; both ends know it.
    edge: Vec<[u32; 14]>,
}

/// Steps to the 14 neighbours: six along the axes, then the eight half diagonals. Opposite steps are paired.
const STEPS: [[i32; 3]; 14] = [
    [2, 0, 0],
    [-2, 0, 0],
    [0, 2, 0],
    [0, -2, 0],
    [0, 0, 2],
    [0, 0, -2],
    [1, 1, 1],
    [-1, -1, -1],
    [1, 1, -1],
    [-1, -1, 1],
    [1, -1, 1],
    [-1, 1, -1],
    [1, -1, -1],
    [-1, 1, 1],
];

fn step(c: [i32; 3], k: usize) -> [i32; 3] {
    [0, 1, 2].map(|a| c[a] + STEPS[k][a])
}

/// The wall that a point is outside of most (or inside least), and by how much.
pub(super) fn depth(walls: &[Wall], p: &Vec3) -> (f64, u8) {
    let mut most = (f64::NEG_INFINITY, NO_WALL);
    for (w, wall) in walls.iter().enumerate() {
        let d = wall.depth(p);
        if d > most.0 {
            most = (d, w as u8);
        }
    }
    most
}

impl<'a> Warped<'a> {
    /// Signs and cuts of a lattice piece, and its nodes drawn to the surfaces.
    pub fn new(lattice: &'a Lattice, walls: &'a [Wall<'a>]) -> Self {
        let slots = lattice.slots();
        let mut warped = Self {
            lattice,
            walls,
            sign: vec![2; slots],
            position: vec![Vec3::zeros(); slots],
            wall: vec![NO_WALL; slots],
            cuts: Vec::new(),
            edge: vec![[0; 14]; slots],
        };
        for slot in 0..slots {
            let c = lattice.point(slot);
            // The far layer of the centres' slots lies outside the piece.
            if lattice.slot(c) != Some(slot) || !lattice.holds(c) {
                continue;
            }
            let p = lattice.position(c);
            let (d, wall) = depth(walls, &p);
            warped.position[slot] = p;
            warped.sign[slot] = if d < 0.0 { -1 } else { i8::from(d > 0.0) };
            if d == 0.0 {
                warped.wall[slot] = wall;
            }
        }
        warped.find_cuts();
        warped.draw();
        warped
    }

    fn find_cuts(&mut self) {
        for slot in (0..self.sign.len()).filter(|&s| self.sign[s] == -1).collect::<Vec<_>>() {
            let c = self.lattice.point(slot);
            for k in 0..14 {
                let Some(other) = self.lattice.slot(step(c, k)) else { continue };
                if self.sign[other] != 1 {
                    continue;
                }
                let cut = self.root(self.position[slot], self.position[other]);
                self.cuts.push(cut);
                let number = self.cuts.len() as u32;
                self.edge[slot][k] = number;
                self.edge[other][k ^ 1] = number;
            }
        }
    }

    /// First crossing found by halving from an inside point to an outside one.
    fn root(&self, inside: Vec3, outside: Vec3) -> Cut {
        let (mut a, mut b) = (0.0, 1.0);
        let span = outside - inside;
        for _ in 0..HALVINGS {
            let m = 0.5 * (a + b);
            let p = inside + span * m;
            if self.walls.iter().all(|w| w.level(&p) < 0.0) { a = m } else { b = m }
        }
        let beyond = inside + span * b;
        let crossed = self.walls.iter().position(|w| w.level(&beyond) >= 0.0);
        Cut { position: inside + span * (0.5 * (a + b)), wall: crossed.map_or(NO_WALL, |w| w as u8) }
    }

    /// Draws nodes onto cut points that are too near.
    fn draw(&mut self) {
        for slot in 0..self.sign.len() {
            if !matches!(self.sign[slot], -1 | 1) {
                continue;
            }
            let home = self.position[slot];
            let mut nearest: Option<(f64, Cut)> = None;
            for k in 0..14 {
                let Some(number) = self.edge[slot][k].checked_sub(1) else { continue };
                let cut = self.cuts[number as usize];
                let (length, alpha) = if k < 6 { (1.0, ALPHA_LONG) } else { (0.75f64.sqrt(), ALPHA_SHORT) };
                let share = (cut.position - home).norm() / (length * self.lattice.edge);
                if share < alpha && nearest.is_none_or(|n| share < n.0) {
                    nearest = Some((share, cut));
                }
            }
            if let Some((_, cut)) = nearest {
                self.move_to(slot, cut);
            }
        }
    }

    fn move_to(&mut self, slot: usize, cut: Cut) {
        let c = self.lattice.point(slot);
        let home = self.position[slot];
        let normals = self.lattice.tied(c, &home);
        let mut target = cut.position;
        if !normals.is_empty() {
            target = self.along_rails(home, target, &normals, cut.wall);
        }
        self.position[slot] = target;
        self.wall[slot] = cut.wall;
        self.sign[slot] = 0;
        for k in 0..14 {
            if self.edge[slot][k] != 0 {
                self.edge[slot][k] = 0;
                if let Some(other) = self.lattice.slot(step(c, k)) {
                    self.edge[other][k ^ 1] = 0;
                }
            }
        }
    }

    /// The surface point near `target` that keeps a node on its planes.
    fn along_rails(&self, home: Vec3, target: Vec3, normals: &[Vec3], wall: u8) -> Vec3 {
        let in_planes = |v: Vec3| normals.iter().fold(v, |v, n| v - n * n.dot(&v));
        let start = home + in_planes(target - home);
        let Some(wall) = self.walls.get(usize::from(wall)) else { return start };
        let mut p = start;
        for _ in 0..RAIL_STEPS {
            let along = in_planes(gradient(wall.field, &p, 1e-3 * self.lattice.edge));
            let slope = along.norm_squared();
            if slope < 0.04 {
                return start;
            }
            p -= along * (wall.field.at(&p) / slope);
        }
        if (p - home).norm() < RAIL_REACH * self.lattice.edge { p } else { start }
    }

    /// Cut of the edge between two neighbouring lattice points.
    pub fn cut_between(&self, from: usize, a: [i32; 3], b: [i32; 3]) -> Option<usize> {
        let d = [0, 1, 2].map(|k| b[k] - a[k]);
        let k = STEPS.iter().position(|s| *s == d)?;
        self.edge[from][k].checked_sub(1).map(|n| n as usize)
    }
}
