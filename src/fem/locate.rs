//! Which tetrahedron holds a point, or is nearest to it: a grid of cells, searched ring by ring.

use std::collections::HashMap;

use crate::math::{Mat3, Vec3, nearest_weights};
use crate::mesh::TetMesh;

/// Distances that differ by less than this part of a grid cell are the same.
const TIE: f64 = 1e-9;

/// A tetrahedron and the point of it nearest to where it was looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// Tetrahedron.
    pub e: usize,
    /// Barycentric coordinates of the nearest point of it.
    pub L: [f64; 4],
    /// How far outside the tetrahedron the place lies, m; 0 within.
    pub distance: f64,
}

/// The corners' tetrahedra of a mesh by place.
pub struct Locator<'a> {
    mesh: &'a TetMesh,
    size: f64,
    low: Vec3,
    rings: i32,
    cells: HashMap<[i32; 3], Vec<u32>>,
}

impl<'a> Locator<'a> {
    /// Sorts the tetrahedra of `mesh` into cells about as large as they are.
    pub fn new(mesh: &'a TetMesh) -> Locator<'a> {
        let bounds = |e: usize| {
            let x = mesh.tets[e].map(|a| mesh.nodes[a as usize]);
            (x[0].inf(&x[1]).inf(&x[2]).inf(&x[3]), x[0].sup(&x[1]).sup(&x[2]).sup(&x[3]))
        };
        let n = mesh.tets.len();
        let size = (0..n).map(bounds).map(|(low, high)| (high - low).max()).sum::<f64>() / n as f64;
        let (low, high) =
            (0..n).map(bounds).reduce(|(l, h), (low, high)| (l.inf(&low), h.sup(&high))).unwrap_or_default();
        let mut cells: HashMap<[i32; 3], Vec<u32>> = HashMap::new();
        for e in 0..n {
            let [from, to] = <[Vec3; 2]>::from(bounds(e)).map(|x| cell(&(x - low), size));
            for i in from[0]..=to[0] {
                for j in from[1]..=to[1] {
                    for k in from[2]..=to[2] {
                        cells.entry([i, j, k]).or_default().push(e as u32);
                    }
                }
            }
        }
        let rings = ((high - low).max() / size).ceil() as i32 + 1;
        Locator { mesh, size, low, rings, cells }
    }

    /// The point of tetrahedron `e` nearest to `p`.
    pub fn nearest_in(&self, e: usize, p: &Vec3) -> Found {
        nearest(e, &self.mesh.tets[e].map(|a| self.mesh.nodes[a as usize]), p)
    }

    /// The tetrahedron that holds `p`, or the nearest to it within the extent of the mesh; of several alike the one that
    /// `towards` lies deepest in, or nearest to.
    pub fn find(&self, p: &Vec3, towards: &Vec3) -> Option<Found> {
        let centre = cell(&(p - self.low), self.size);
        let mut best: Option<(Found, f64)> = None;
        for ring in 0..=self.rings {
            for &e in ring_cells(centre, ring).filter_map(|at| self.cells.get(&at)).flatten() {
                let x = self.mesh.tets[e as usize].map(|a| self.mesh.nodes[a as usize]);
                let found = nearest(e as usize, &x, p);
                let depth = || match nearest(e as usize, &x, towards) {
                    within if within.distance == 0.0 => within.L.into_iter().fold(f64::INFINITY, f64::min),
                    outside => -outside.distance,
                };
                let better = match &best {
                    None => true,
                    Some((b, _)) if found.distance < b.distance - TIE * self.size => true,
                    Some((b, deepest)) => found.distance <= b.distance + TIE * self.size && depth() > *deepest,
                };
                if better {
                    best = Some((found, depth()));
                }
            }
            // Whatever is nearer than this has a cell in the rings seen.
            if let Some((found, _)) = best.filter(|(f, _)| f.distance <= f64::from(ring) * self.size) {
                return Some(found);
            }
        }
        best.map(|(found, _)| found)
    }
}

fn cell(x: &Vec3, size: f64) -> [i32; 3] {
    [0, 1, 2].map(|k| (x[k] / size).floor() as i32)
}

/// Cells at Chebyshev distance `ring`, in a fixed order.
fn ring_cells(centre: [i32; 3], ring: i32) -> impl Iterator<Item = [i32; 3]> {
    let side = move || -ring..=ring;
    let all = side().flat_map(move |i| side().flat_map(move |j| side().map(move |k| [i, j, k])));
    let on = all.filter(move |d| d.iter().any(|c| c.abs() == ring));
    on.map(move |d| [0, 1, 2].map(|a| centre[a].saturating_add(d[a])))
}

/// Barycentric coordinates of `p` in a tetrahedron.
fn barycentric(x: &[Vec3; 4], p: &Vec3) -> [f64; 4] {
    let edges = Mat3::from_columns(&[x[1] - x[0], x[2] - x[0], x[3] - x[0]]);
    let L = edges.try_inverse().expect("rest volumes are positive") * (p - x[0]);
    [1.0 - L.x - L.y - L.z, L.x, L.y, L.z]
}

fn nearest(e: usize, x: &[Vec3; 4], p: &Vec3) -> Found {
    let L = barycentric(x, p);
    if L.iter().all(|l| *l >= 0.0) {
        return Found { e, L, distance: 0.0 };
    }
    let face = |face: [usize; 3]| {
        let w = nearest_weights(p, face.map(|a| x[a]));
        let mut L = [0.0; 4];
        face.iter().zip(w).for_each(|(&a, w)| L[a] = w);
        let q: Vec3 = L.iter().zip(x).map(|(l, x)| *l * x).sum();
        Found { e, L, distance: (q - p).norm() }
    };
    let faces = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]].map(face);
    faces.into_iter().min_by(|a, b| a.distance.total_cmp(&b.distance)).expect("four faces")
}
