//! Isosurface of a sampled volume: closed and manifold wherever it does not leave the grid.
//!
//! On each cell face the crossings are joined as the bilinear interpolant joins them; the joins of the six faces close
//! into loops, and each loop is filled. A face is decided by its own four values alone, so both cells agree.
//!
//! ```text
//! face values a, c > iso > b, d across:  a and c are joined  <=>  (a-iso)(c-iso) > (b-iso)(d-iso)
//! ```
//!
//! Source: G. M. Nielson & B. Hamann, "The Asymptotic Decider: Resolving the Ambiguity in Marching Cubes",
//! IEEE Visualization 1991, section 3.
//! Departure: loops are traced, not looked up; a loop is filled by diagonals that lie on no cell face, else round a
//! centre vertex, because a diagonal on a face can meet the neighbour's and give an edge four triangles.

use super::{Grid, Surface};
use crate::math::Vec3;

const NONE: u32 = u32::MAX;

/// Corners of a cell, bit 0 = x, 1 = y, 2 = z; the four of each face run counter-clockwise seen from outside.
const FACES: [[usize; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// Triangles between samples at or above `iso` (the body) and below it; normals point to lower values.
///
/// # Panics
/// When `values` is not as long as the grid.
pub fn marching_cubes(grid: &Grid, values: &[f32], iso: f64) -> Surface {
    assert_eq!(values.len(), grid.len(), "one value a grid sample");
    let mut walker = Walker {
        grid,
        values,
        iso,
        edge_vertex: vec![NONE; 3 * values.len()],
        surface: Surface::default(),
        mirrored: grid.direction.determinant() < 0.0,
    };
    let cells = grid.dims.map(|n| n.saturating_sub(1));
    for k in 0..cells[2] {
        for j in 0..cells[1] {
            for i in 0..cells[0] {
                walker.cell([i, j, k]);
            }
        }
    }
    walker.surface
}

struct Walker<'a> {
    grid: &'a Grid,
    values: &'a [f32],
    iso: f64,
    /// Vertex on the edge that leaves a sample along +x, +y, +z.
    edge_vertex: Vec<u32>,
    surface: Surface,
    mirrored: bool,
}

/// A crossing of a cell edge: its lower corner and axis.
type Crossing = (usize, usize);

impl Walker<'_> {
    fn cell(&mut self, at: [usize; 3]) {
        let [nx, ny, _] = self.grid.dims;
        let base = self.grid.index(at);
        let offset = |corner: usize| (corner & 1) + nx * ((corner >> 1 & 1) + ny * (corner >> 2 & 1));
        let mut value = [0.0; 8];
        let mut inside = 0u8;
        for (corner, v) in value.iter_mut().enumerate() {
            *v = f64::from(self.values[base + offset(corner)]) - self.iso;
            inside |= u8::from(*v >= 0.0) << corner;
        }
        if inside == 0 || inside == 255 {
            return;
        }
        // Follower of each crossing, by slot (lower corner * 3 + axis).
        let mut next = [usize::MAX; 24];
        for face in FACES {
            join(&value, face, &mut next);
        }
        for start in 0..24 {
            if next[start] == usize::MAX {
                continue;
            }
            let mut loop_slots: Vec<usize> = Vec::with_capacity(12);
            let mut slot = start;
            while next[slot] != usize::MAX {
                loop_slots.push(slot);
                slot = std::mem::replace(&mut next[slot], usize::MAX);
            }
            let vertices: Vec<u32> = loop_slots
                .iter()
                .map(|&slot| {
                    let (corner, axis) = (slot / 3, slot % 3);
                    self.vertex(base + offset(corner), at, (corner, axis), &value)
                })
                .collect();
            self.fill(loop_slots, vertices);
        }
    }

    fn vertex(&mut self, sample: usize, at: [usize; 3], (corner, axis): Crossing, value: &[f64; 8]) -> u32 {
        let slot = 3 * sample + axis;
        if self.edge_vertex[slot] == NONE {
            let (v0, v1) = (value[corner], value[corner | 1 << axis]);
            let mut c = Vec3::from_fn(|a, _| (at[a] + (corner >> a & 1)) as f64);
            c[axis] += v0 / (v0 - v1);
            self.edge_vertex[slot] = self.surface.vertices.len() as u32;
            self.surface.vertices.push(self.grid.world(&c));
        }
        self.edge_vertex[slot]
    }

    /// Fills a loop by clipping ears whose diagonal lies on no cell face, shortest first.
    fn fill(&mut self, mut slots: Vec<usize>, mut loop_: Vec<u32>) {
        while loop_.len() > 3 {
            let n = loop_.len();
            let position = |k: usize| self.surface.vertices[loop_[k % n] as usize];
            let ear = (0..n).filter(|&k| faces_of(slots[k]) & faces_of(slots[(k + 2) % n]) == 0).min_by(|&p, &q| {
                let length = |k: usize| (position(k) - position(k + 2)).norm_squared();
                length(p).total_cmp(&length(q))
            });
            let Some(k) = ear else { break };
            self.triangle([loop_[k], loop_[(k + 1) % n], loop_[(k + 2) % n]]);
            slots.remove((k + 1) % n);
            loop_.remove((k + 1) % n);
        }
        if let [a, b, c] = loop_[..] {
            self.triangle([a, b, c]);
            return;
        }
        let sum: Vec3 = loop_.iter().map(|&a| self.surface.vertices[a as usize]).sum();
        let centre = self.surface.vertices.len() as u32;
        self.surface.vertices.push(sum / loop_.len() as f64);
        for k in 0..loop_.len() {
            self.triangle([loop_[k], loop_[(k + 1) % loop_.len()], centre]);
        }
    }

    fn triangle(&mut self, [a, b, c]: [u32; 3]) {
        self.surface.triangles.push(if self.mirrored { [a, b, c] } else { [a, c, b] });
    }
}

/// Bit set of the two cell faces an edge slot lies on.
fn faces_of(slot: usize) -> u8 {
    let (corner, axis) = (slot / 3, slot % 3);
    let (p, q) = ((axis + 1) % 3, (axis + 2) % 3);
    let side = |a: usize| 1 << (2 * a + (corner >> a & 1));
    side(p) | side(q)
}

/// Joins the crossings of one face: each entry into the body leads to an exit from it.
fn join(value: &[f64; 8], face: [usize; 4], next: &mut [usize; 24]) {
    let inside = face.map(|c| value[c] >= 0.0);
    let slot = |k: usize| {
        let (p, q) = (face[k], face[(k + 1) % 4]);
        3 * p.min(q) + (p ^ q).trailing_zeros() as usize
    };
    let enters = |k: usize| !inside[k] && inside[(k + 1) % 4];
    let leaves = |k: usize| inside[k] && !inside[(k + 1) % 4];
    let entries = (0..4).filter(|&k| enters(k)).count();
    let alternating = entries == 2;
    // Of the two exits next to an entry, the one behind it joins the body's corners, the one before parts them.
    let joined = alternating && {
        let product = |body: bool| (0..4).filter(|&k| inside[k] == body).map(|k| value[face[k]]).product::<f64>();
        product(true) > product(false)
    };
    for k in (0..4).filter(|&k| enters(k)) {
        let exit = if alternating {
            if joined { (k + 3) % 4 } else { (k + 1) % 4 }
        } else {
            (0..4).find(|&e| leaves(e)).expect("a face that is entered is left")
        };
        next[slot(exit)] = slot(k);
    }
}
