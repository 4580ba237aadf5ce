//! The graded body-centred cubic lattice: tetrahedra between the centres and corners of an octree's leaves.
//!
//! ```text
//! neighbour of the same size: four tetrahedra round their common face, halved where a finer leaf has a node on an edge
//! neighbour finer:   eight quarter pyramids (centre, face centre, corner, middle of an edge)
//! neighbour coarser: two half pyramids, their diagonal through the centre of the coarse face
//! end of the box:    four quarter pyramids with a node on the face's centre
//! ```
//! No node hangs; radius ratio at least .64, dihedral angles 45 to 120 degrees.
//!
//! Source: F. Labelle & J. R. Shewchuk, "Isosurface Stuffing: Fast Tetrahedral Meshes with Good Dihedral Angles",
//! ACM TOG 26(3), 2007, section 4.
//! Departure: leaves at a surface need not have one size; smoothing makes good what that costs.

use super::super::stencils::Stuffed;
use super::super::stuffing::NO_WALL;
use super::super::{Cuboid, MeshingError};
use super::octree::{Bits, Cell, Octree};
use super::stuff::orient;
use crate::math::Vec3;

/// Largest number of finest cells that are laid out.
const CELL_LIMIT: u64 = 2_000_000_000;

/// How a lattice is laid over a box.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Plan {
    pub region: Cuboid,
    /// Cells of the coarsest level along each axis, and their edges, m.
    pub roots: [usize; 3],
    pub edge: Vec3,
    /// How often a cell may be halved.
    pub depth: usize,
}

impl Plan {
    /// Cells of about `coarsest` m that end on the box's faces, halved down to `finest` m.
    ///
    /// # Errors
    /// [`MeshingError::NotPositive`], [`MeshingError::TooLarge`].
    pub fn new(region: Cuboid, coarsest: f64, finest: f64) -> Result<Self, MeshingError> {
        let size = region.high - region.low;
        for (what, found) in
            [("the finest edge", finest), ("the coarsest edge", coarsest), ("the box's size", size.min())]
        {
            if !(found.is_finite() && found > 0.0) {
                return Err(MeshingError::NotPositive { what: what.into(), found });
            }
        }
        let depth = (coarsest / finest).log2().round().clamp(0.0, 20.0);
        let cells: f64 = (0..3).map(|a| (size[a] / coarsest).round().max(1.0) * depth.exp2()).product();
        if cells > CELL_LIMIT as f64 {
            let found = cells.min(1e30) as u128;
            return Err(MeshingError::TooLarge { what: "the lattice".into(), found, limit: CELL_LIMIT });
        }
        let roots = [0, 1, 2].map(|a| (size[a] / coarsest).round().max(1.0) as usize);
        let edge = Vec3::from_fn(|a, _| size[a] / roots[a] as f64);
        Ok(Self { region, roots, edge, depth: depth as usize })
    }

    /// Edges of a cell of level `l`, m.
    pub fn edge_at(&self, l: usize) -> Vec3 {
        self.edge / (1u64 << l) as f64
    }

    /// Middle of a cell of level `l`, m.
    pub fn centre(&self, l: usize, c: [usize; 3]) -> Vec3 {
        let h = self.edge_at(l);
        self.region.low + Vec3::from_fn(|a, _| (c[a] as f64 + 0.5) * h[a])
    }
}

/// Coordinates in halves of the finest cell.
type Point = [i32; 3];

struct Builder<'a> {
    tree: &'a Octree,
    /// Corners of leaves, by finest cells.
    corner: Bits,
    /// Points along each axis.
    dims: [i32; 3],
    tets: Vec<[u64; 4]>,
}

fn plus(p: Point, q: Point, times: i32) -> Point {
    [0, 1, 2].map(|a| p[a] + times * q[a])
}

impl Builder<'_> {
    fn key(&self, p: Point) -> u64 {
        let [nx, ny, _] = self.dims.map(|n| n as u64);
        (p[2] as u64 * ny + p[1] as u64) * nx + p[0] as u64
    }

    fn emit(&mut self, points: [Point; 4]) {
        self.tets.push(points.map(|p| self.key(p)));
    }

    /// The middle of an edge between corners, if a finer leaf has a node there.
    fn middle(&self, a: Point, b: Point) -> Option<Point> {
        let m = [0, 1, 2].map(|k| (a[k] + b[k]) / 2);
        (m.iter().all(|c| c % 2 == 0) && self.corner.get(m.map(|c| (c / 2) as usize))).then_some(m)
    }

    /// Tetrahedra from an edge of the leaf's face to two points, halved where the edge is.
    fn wedge(&mut self, p: Point, q: Point, a: Point, b: Point) {
        match self.middle(a, b) {
            None => self.emit([p, q, a, b]),
            Some(m) => {
                self.emit([p, q, a, m]);
                self.emit([p, q, m, b]);
            }
        }
    }

    fn leaf(&mut self, l: usize, cell: [usize; 3]) {
        let s = 1i32 << (self.tree.finest() - l);
        let n = self.tree.roots.map(|n| n << l);
        let centre = [0, 1, 2].map(|a| (2 * cell[a] as i32 + 1) * s);
        for axis in 0..3 {
            for up in [false, true] {
                let mut e = [0; 3];
                e[axis] = if up { 1 } else { -1 };
                let face = plus(centre, e, s);
                let unit = |k: usize| {
                    let mut u = [0; 3];
                    u[(axis + k) % 3] = s;
                    u
                };
                let at = |u: i32, v: i32| plus(plus(face, unit(1), u), unit(2), v);
                let corners = [at(1, 1), at(-1, 1), at(-1, -1), at(1, -1)];
                let next =
                    if up { cell[axis].checked_add(1).filter(|&c| c < n[axis]) } else { cell[axis].checked_sub(1) };
                let neighbour = next.map(|c| {
                    let mut other = cell;
                    other[axis] = c;
                    self.tree.cell(l, other)
                });
                for k in 0..4 {
                    let (a, b) = (corners[k], corners[(k + 1) % 4]);
                    match neighbour {
                        None => self.wedge(centre, face, a, b),
                        Some(Cell::Leaf) if up => self.wedge(centre, plus(centre, e, 2 * s), a, b),
                        Some(Cell::Leaf) => {}
                        Some(Cell::Refined) => {
                            let m = [0, 1, 2].map(|k| (a[k] + b[k]) / 2);
                            self.emit([centre, face, a, m]);
                            self.emit([centre, face, m, b]);
                        }
                        Some(Cell::Absent) => {
                            // The corner in the middle of the coarse face: odd in units of this cell along both its axes.
                            let odd = |d: usize| (a[(axis + d) % 3] / (2 * s)) % 2 == 1;
                            if odd(1) && odd(2) {
                                let opposite = corners[(k + 2) % 4];
                                self.emit([centre, a, b, opposite]);
                                self.emit([centre, a, opposite, corners[(k + 3) % 4]]);
                            }
                        }
                    }
                }
            }
        }
    }
}

/// The tetrahedra of an octree laid over a box; nodes on the box's faces know them.
pub(super) fn lattice(plan: &Plan, tree: &Octree) -> Stuffed {
    let finest = tree.finest();
    let cells = tree.roots.map(|n| (n << finest) as i32);
    let dims = cells.map(|n| 2 * n + 1);
    let corner = Bits::new(cells.map(|n| n as usize + 1));
    let mut b = Builder { tree, corner, dims, tets: Vec::new() };
    let leaves = tree.leaves();
    for (l, c) in &leaves {
        for k in 0..8 {
            b.corner.set([0, 1, 2].map(|a| (c[a] + (k >> a & 1)) << (finest - l)));
        }
    }
    for (l, c) in leaves {
        b.leaf(l, c);
    }
    let mut keys: Vec<u64> = b.tets.as_flattened().to_vec();
    keys.sort_unstable();
    keys.dedup();
    let unit = plan.edge_at(finest) / 2.0;
    let [nx, ny, _] = dims.map(|n| n as u64);
    let point = |key: u64| [key % nx, key / nx % ny, key / (nx * ny)];
    let nodes: Vec<Vec3> = keys
        .iter()
        .map(|&key| {
            let c = point(key);
            // The last points lie on the box's faces to the bit.
            Vec3::from_fn(|a, _| {
                if c[a] + 1 == dims[a] as u64 {
                    plan.region.high[a]
                } else {
                    plan.region.low[a] + unit[a] * c[a] as f64
                }
            })
        })
        .collect();
    let plane = keys
        .iter()
        .map(|&key| {
            let c = point(key);
            (0..3).fold(0u8, |bits, a| {
                let low = u8::from(c[a] == 0) << (2 * a);
                bits | low | u8::from(c[a] + 1 == dims[a] as u64) << (2 * a + 1)
            })
        })
        .collect();
    let number = |key: u64| keys.binary_search(&key).expect("every key is listed") as u32;
    let mut tets: Vec<[u32; 4]> = b.tets.iter().map(|t| t.map(number)).collect();
    orient(&nodes, &mut tets);
    Stuffed { wall: vec![NO_WALL; nodes.len()], nodes, plane, tets }
}
