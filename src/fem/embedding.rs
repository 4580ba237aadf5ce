//! A fine surface in a coarser cage: each vertex rides on one element.
//!
//! ```text
//! x = sum_a w_a x_a,   w_a = N_a(L) + dN_a(L) . (X - X(L))
//! ```
//!
//! `L` is the point of the element nearest to the vertex; beyond it the element's motion goes on along its gradient
//! there, so that at rest every vertex is where it was given, inside the cage and outside. Nothing is solved; loads and
//! pressures stay on the cage.
//!
//! Source: Capell, Green, Curless, Duchamp & Popovic, "Interactive skeleton-driven dynamic deformations", ACM TOG 21(3),
//! 2002, section 3.

use super::locate::Locator;
use super::tet10::{inverse_jacobian, reference_gradients, values};
use crate::math::{Mat3, Vec3};
use crate::mesh::{FineSkin, TetMesh};

/// Beyond this part of the nearest element's longest edge a vertex counts as far from the cage.
const FAR: f64 = 0.25;
/// Beyond this part the motion of that element says nothing about it.
const TOO_FAR: f64 = 1.0;
/// Which side of a slit a vertex belongs to, its triangles tell: this part of the way to their centroids.
const TOWARDS: f64 = 0.3;
/// Newton steps of the inverse of a curved element's map; two are enough for edges bent by a tenth.
const NEWTON: usize = 5;

/// A vertex that no element is near to.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "vertex {vertex} of the skin at ({x:.4}, {y:.4}, {z:.4}) m lies {distance:.4} m outside the mesh, more than the \
     nearest element's longest edge of {edge:.4} m: the surface and the mesh do not belong together, or differ in unit"
)]
pub struct Detached {
    /// Vertex, 0-based.
    pub vertex: usize,
    /// Its place, m.
    pub x: f64,
    /// Its place, m.
    pub y: f64,
    /// Its place, m.
    pub z: f64,
    /// Distance from the nearest element, m.
    pub distance: f64,
    /// Longest edge of that element, m.
    pub edge: f64,
}

/// Where the vertices of a surface ride.
#[derive(Debug, Clone, PartialEq)]
pub struct Embedding {
    /// Nodes of an element: 4 or 10.
    width: usize,
    nodes: Vec<u32>,
    weights: Vec<f64>,
    /// Vertices further outside the cage than a quarter of the nearest element's longest edge.
    pub n_far: usize,
    /// Largest distance of a vertex outside the cage, m.
    pub farthest: f64,
}

impl Embedding {
    /// Nodes that the vertices depend on, with repetition.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Binds the vertices of `skin` to the elements of `mesh`; `midsides` are the mid-edge nodes of quadratic ones.
    ///
    /// # Errors
    /// [`Detached`] for the first vertex further from the mesh than an element's edge.
    pub fn new(mesh: &TetMesh, midsides: &[[u32; 6]], skin: &FineSkin) -> Result<Embedding, Detached> {
        let locator = Locator::new(mesh);
        let width = if midsides.is_empty() { 4 } else { 10 };
        let mut out = Embedding { width, nodes: Vec::new(), weights: Vec::new(), n_far: 0, farthest: 0.0 };
        for (vertex, (X, towards)) in skin.vertices.iter().zip(inward(skin)).enumerate() {
            // Outside, the nearest element may be across a slit: the one nearest to its triangles is not.
            let found = match locator.find(X, &towards) {
                Some(outside) if outside.distance > 0.0 => {
                    locator.find(&towards, &towards).map(|f| locator.nearest_in(f.e, X))
                }
                inside => inside,
            };
            let (edge, distance) = found.map_or((0.0, f64::INFINITY), |f| (longest_edge(mesh, f.e), f.distance));
            let Some(found) = found.filter(|_| distance <= TOO_FAR * edge) else {
                return Err(Detached { vertex, x: X.x, y: X.y, z: X.z, distance, edge });
            };
            out.farthest = out.farthest.max(distance);
            out.n_far += usize::from(distance > FAR * edge);
            let tet = &mesh.tets[found.e];
            let corners = tet.map(|a| mesh.nodes[a as usize]);
            out.nodes.extend(tet);
            match midsides.get(found.e) {
                None => out.weights.extend(linear(&corners, found.L, X)),
                Some(six) => {
                    out.nodes.extend(six);
                    let nodes =
                        std::array::from_fn(|k| if k < 4 { corners[k] } else { mesh.nodes[six[k - 4] as usize] });
                    out.weights.extend(quadratic(&nodes, found.L, X));
                }
            }
        }
        Ok(out)
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.nodes.len() / self.width
    }

    /// Whether there is no vertex.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// What vertex `k` takes of a nodal field: its place of the nodes' places, its velocity of their velocities.
    pub fn of(&self, k: usize, field: &[Vec3]) -> Vec3 {
        let range = k * self.width..(k + 1) * self.width;
        self.nodes[range.clone()].iter().zip(&self.weights[range]).map(|(&a, w)| *w * field[a as usize]).sum()
    }

    /// Vertices from `first` on as rows of three, as many as `out` holds.
    pub fn rows_into(&self, first: usize, field: &[Vec3], out: &mut [f64]) {
        match self.width {
            4 => self.rows::<4>(first, field, out),
            _ => self.rows::<10>(first, field, out),
        }
    }

    fn rows<const W: usize>(&self, first: usize, field: &[Vec3], out: &mut [f64]) {
        let nodes = self.nodes[W * first..].as_chunks::<W>().0;
        let weights = self.weights[W * first..].as_chunks::<W>().0;
        for ((nodes, weights), row) in nodes.iter().zip(weights).zip(out.as_chunks_mut::<3>().0) {
            let mut sum = [0.0; 3];
            for (&a, w) in nodes.iter().zip(weights) {
                let x = &field[a as usize];
                for (sum, x) in sum.iter_mut().zip(x.iter()) {
                    *sum += w * x;
                }
            }
            *row = sum;
        }
    }

    /// Adds the transpose of [`Embedding::of`]: what `w` at vertex `k` is at the nodes.
    pub fn add_transposed(&self, k: usize, w: &Vec3, field: &mut [Vec3]) {
        let range = k * self.width..(k + 1) * self.width;
        for (&a, weight) in self.nodes[range.clone()].iter().zip(&self.weights[range]) {
            field[a as usize] += *weight * w;
        }
    }
}

/// For each vertex a place a little way towards its triangles.
fn inward(skin: &FineSkin) -> Vec<Vec3> {
    let mut sum = vec![(Vec3::zeros(), 0.0); skin.vertices.len()];
    for t in &skin.triangles {
        let centroid = t.iter().map(|&a| skin.vertices[a as usize]).sum::<Vec3>() / 3.0;
        for &a in t {
            sum[a as usize].0 += centroid;
            sum[a as usize].1 += 1.0;
        }
    }
    let towards = |(X, (sum, n)): (&Vec3, (Vec3, f64))| if n > 0.0 { X.lerp(&(sum / n), TOWARDS) } else { *X };
    skin.vertices.iter().zip(sum).map(towards).collect()
}

fn longest_edge(mesh: &TetMesh, e: usize) -> f64 {
    let x = mesh.tets[e].map(|a| mesh.nodes[a as usize]);
    super::EDGES.iter().map(|[i, j]| (x[*i] - x[*j]).norm()).fold(0.0, f64::max)
}

fn linear(x: &[Vec3; 4], L: [f64; 4], X: &Vec3) -> [f64; 4] {
    let place: Vec3 = x.iter().zip(L).map(|(x, l)| l * x).sum();
    let edges = Mat3::from_columns(&[x[1] - x[0], x[2] - x[0], x[3] - x[0]]);
    let d = edges.try_inverse().expect("rest volumes are positive") * (X - place);
    [L[0] - d.x - d.y - d.z, L[1] + d.x, L[2] + d.y, L[3] + d.z]
}

fn quadratic(x: &[Vec3; 10], L: [f64; 4], X: &Vec3) -> [f64; 10] {
    let beyond = |L: [f64; 4]| X - x.iter().zip(values(L)).map(|(x, N)| N * x).sum::<Vec3>();
    let mut L = L;
    for _ in 0..NEWTON {
        let d = inverse_jacobian(x, L) * beyond(L);
        let next = [L[0] - d.x - d.y - d.z, L[1] + d.x, L[2] + d.y, L[3] + d.z];
        if next.iter().any(|l| *l < 0.0) {
            break;
        }
        L = next;
    }
    let d = inverse_jacobian(x, L) * beyond(L);
    let (N, dN) = (values(L), reference_gradients(L));
    std::array::from_fn(|a| N[a] + dN[a].dot(&d))
}
