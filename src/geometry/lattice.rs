//! The body-centred cubic lattice: cubes' corners and centres, and the tetrahedra between them.
//!
//! Nodes have integer coordinates `c`, all even (corners) or all odd (centres); `x = origin + axes * (edge/2 c)`.
//! Every plane `c_i +- c_j = even number` is a union of tetrahedron faces: there a mesh can end, be mirrored or cut
//! without cutting a single tetrahedron.
//!
//! Source: F. Labelle & J. R. Shewchuk, "Isosurface Stuffing: Fast Tetrahedral Meshes with Good Dihedral Angles",
//! ACM TOG 26(3), 2007, section 2.

use super::{Cuboid, Field, MeshingError, Sizing};
use crate::math::{Mat3, Vec3};

/// Largest number of lattice nodes that are laid out.
const NODE_LIMIT: u64 = 30_000_000;

/// A plane of lattice points: `normal . c = at`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LatticePlane {
    /// Integer normal; for faces to lie in the plane, two of its entries are +-1 and one is 0.
    pub normal: [i32; 3],
    /// Value of `normal . c` on the plane.
    pub at: i32,
}

impl LatticePlane {
    /// How far a lattice point lies above the plane, in lattice steps.
    pub fn above(&self, c: [i32; 3]) -> i32 {
        (0..3).map(|a| self.normal[a] * c[a]).sum::<i32>() - self.at
    }
}

/// A piece of the body-centred cubic lattice.
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice {
    /// Edge of the cubes (the long edge of a tetrahedron), m.
    pub edge: f64,
    /// Position of the lattice point (0, 0, 0), m.
    pub origin: Vec3,
    /// Directions of the cubes' edges as columns, orthonormal.
    pub axes: Mat3,
    /// Smallest corner, in cubes.
    pub low: [i32; 3],
    /// Number of cubes along each lattice axis.
    pub cubes: [usize; 3],
    /// Tetrahedra with a corner below one of these planes are left out.
    pub ends: Vec<LatticePlane>,
    /// Nodes on these planes stay on them when the surface draws them, inside the region given.
    pub rails: Vec<(LatticePlane, Option<Cuboid>)>,
}

impl Lattice {
    /// An axis-parallel lattice over a box, with the smallest edge that `sizing` asks for in it; corners lie on the
    /// box's low planes, and on its high ones where the edge divides the size.
    ///
    /// # Errors
    /// [`MeshingError::NotPositive`] for an edge or a box that is not, [`MeshingError::TooLarge`].
    pub fn over(region: &Cuboid, sizing: &dyn Sizing) -> Result<Self, MeshingError> {
        let samples = (0..125).map(|k| {
            let share = Vec3::new((k % 5) as f64, (k / 5 % 5) as f64, (k / 25) as f64) / 4.0;
            sizing.edge(&(region.low + share.component_mul(&(region.high - region.low))))
        });
        let edge = samples.fold(f64::INFINITY, f64::min);
        if !(edge.is_finite() && edge > 0.0) {
            return Err(MeshingError::NotPositive { what: "the lattice edge".into(), found: edge });
        }
        let size = region.high - region.low;
        if !(size.min() > 0.0 && size.iter().all(|s| s.is_finite())) {
            return Err(MeshingError::NotPositive { what: "the size of the region to mesh".into(), found: size.min() });
        }
        // One cube beyond the box on every side, so that what the box cuts is never cut by the lattice's own end.
        let cubes = [0, 1, 2].map(|a| (size[a] / edge).ceil().min(1e9) as usize + 2);
        let lattice = Self {
            edge,
            origin: region.low,
            axes: Mat3::identity(),
            low: [-1; 3],
            cubes,
            ends: Vec::new(),
            rails: Vec::new(),
        };
        lattice.checked()
    }

    /// Refuses a lattice too large to lay out.
    pub(super) fn checked(self) -> Result<Self, MeshingError> {
        let found = self.cubes.iter().map(|&n| n as u128 + 1).product::<u128>() * 2;
        if found > u128::from(NODE_LIMIT) {
            return Err(MeshingError::TooLarge { what: "the lattice".into(), found, limit: NODE_LIMIT });
        }
        Ok(self)
    }

    /// Corners (and, with room to spare, centres) along each axis.
    fn stride(&self) -> [usize; 3] {
        self.cubes.map(|n| n + 1)
    }

    /// Slots for nodes: first all corners, then all centres.
    pub(super) fn slots(&self) -> usize {
        2 * self.stride().iter().product::<usize>()
    }

    /// Slot of a lattice point; `None` outside the piece.
    pub(super) fn slot(&self, c: [i32; 3]) -> Option<usize> {
        let odd = c[0] & 1;
        let stride = self.stride();
        let mut at = [0; 3];
        for a in 0..3 {
            let k = (c[a] - odd) / 2 - self.low[a];
            let limit = stride[a] as i32 - odd;
            if k < 0 || k >= limit {
                return None;
            }
            at[a] = k as usize;
        }
        Some(((odd as usize * stride[2] + at[2]) * stride[1] + at[1]) * stride[0] + at[0])
    }

    /// Lattice point of a slot.
    pub(super) fn point(&self, slot: usize) -> [i32; 3] {
        let s = self.stride();
        let at = [slot % s[0], slot / s[0] % s[1], slot / (s[0] * s[1]) % s[2]];
        let odd = (slot / (s[0] * s[1] * s[2])) as i32;
        [0, 1, 2].map(|a| 2 * (at[a] as i32 + self.low[a]) + odd)
    }

    /// Whether a lattice point belongs to the piece: inside the box and on the kept side of every end plane.
    pub(super) fn holds(&self, c: [i32; 3]) -> bool {
        self.slot(c).is_some() && self.ends.iter().all(|p| p.above(c) >= 0)
    }

    /// World position of a lattice point.
    pub fn position(&self, c: [i32; 3]) -> Vec3 {
        let half = self.edge / 2.0;
        self.origin + self.axes * Vec3::new(f64::from(c[0]) * half, f64::from(c[1]) * half, f64::from(c[2]) * half)
    }

    /// Unit normals (world) of the planes a point must not leave.
    pub(super) fn tied(&self, c: [i32; 3], x: &Vec3) -> Vec<Vec3> {
        let ends = self.ends.iter().filter(|p| p.above(c) == 0);
        let rails = self.rails.iter().filter(|(p, region)| p.above(c) == 0 && region.is_none_or(|r| r.at(x) <= 0.0));
        let planes = ends.chain(rails.map(|(p, _)| p));
        planes.map(|p| (self.axes * Vec3::from(p.normal.map(f64::from))).normalize()).collect()
    }

    /// Calls `visit` with the lattice points of every tetrahedron of the piece.
    pub(super) fn each_tet(&self, mut visit: impl FnMut([[i32; 3]; 4])) {
        let n = self.cubes.map(|n| n as i32);
        for k in 0..n[2] {
            for j in 0..n[1] {
                for i in 0..n[0] {
                    let cube = [i + self.low[0], j + self.low[1], k + self.low[2]];
                    let centre = cube.map(|c| 2 * c + 1);
                    for axis in 0..3 {
                        self.round_face(centre, axis, &mut visit);
                    }
                }
            }
        }
    }

    /// The four tetrahedra round the edge from a centre to the next one along `axis`.
    fn round_face(&self, centre: [i32; 3], axis: usize, visit: &mut impl FnMut([[i32; 3]; 4])) {
        const RING: [[i32; 2]; 4] = [[-1, -1], [1, -1], [1, 1], [-1, 1]];
        let mut next = centre;
        next[axis] += 2;
        if !self.holds(centre) || !self.holds(next) {
            return;
        }
        let corner = |k: usize| {
            let mut c = centre;
            c[axis] += 1;
            c[(axis + 1) % 3] += RING[k % 4][0];
            c[(axis + 2) % 3] += RING[k % 4][1];
            c
        };
        for k in 0..4 {
            let (a, b) = (corner(k), corner(k + 1));
            if self.holds(a) && self.holds(b) {
                visit([centre, next, a, b]);
            }
        }
    }
}
