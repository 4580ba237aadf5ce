//! What a host reads of the surface: nodes of the mesh, or a finer skin that rides on it.

use crate::fem::Embedding;
use crate::math::Vec3;
use crate::mesh::{SKIN, TetMesh};

/// The skin: vertices, in the order of `skin.position`, and triangles.
pub struct Skin {
    /// Mesh node of each vertex; empty where a finer skin is bound to the mesh.
    nodes: Vec<u32>,
    embedding: Option<Embedding>,
    triangles: Vec<i32>,
}

impl Skin {
    /// The fine skin of `mesh` if it is bound by `embedding`, else the face set of that name.
    pub(super) fn new(mesh: &TetMesh, embedding: Option<Embedding>) -> Skin {
        if let (Some(fine), Some(embedding)) = (&mesh.fine_skin, embedding) {
            let triangles = fine.triangles.as_flattened().iter().map(|&a| a as i32).collect();
            return Skin { nodes: Vec::new(), embedding: Some(embedding), triangles };
        }
        let nodes = mesh.skin_nodes();
        let row = |a: &u32| nodes.binary_search(a).expect("skin nodes come from the triangles") as i32;
        let triangles =
            mesh.face_set(SKIN).map_or(Vec::new(), |s| s.triangles.as_flattened().iter().map(row).collect());
        Skin { nodes, embedding: None, triangles }
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.embedding.as_ref().map_or(self.nodes.len(), Embedding::len)
    }

    /// Whether there is no skin.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Triangles as rows of `skin.position`, flattened.
    pub fn triangles(&self) -> &[i32] {
        &self.triangles
    }

    /// What rides on the mesh, if the skin is not the mesh's own.
    pub fn embedding(&self) -> Option<&Embedding> {
        self.embedding.as_ref()
    }

    /// Vertex `k` of a nodal field.
    pub fn of(&self, k: usize, field: &[Vec3]) -> Vec3 {
        match &self.embedding {
            Some(embedding) => embedding.of(k, field),
            None => field[self.nodes[k] as usize],
        }
    }

    /// Adds the transpose of [`Skin::of`]: what `w` at vertex `k` is at the nodes.
    pub(super) fn add_transposed(&self, k: usize, w: &Vec3, field: &mut [Vec3]) {
        match &self.embedding {
            Some(embedding) => embedding.add_transposed(k, w, field),
            None => field[self.nodes[k] as usize] += w,
        }
    }

    /// All vertices of a nodal field.
    pub fn all(&self, field: &[Vec3]) -> Vec<Vec3> {
        (0..self.len()).map(|k| self.of(k, field)).collect()
    }

    /// Calls `visit` with every node of the mesh that a vertex depends on.
    pub(super) fn each_node(&self, visit: impl FnMut(u32)) {
        let nodes = self.embedding.as_ref().map_or(&self.nodes[..], Embedding::nodes);
        nodes.iter().copied().for_each(visit);
    }

    /// A point in a triangle: `corners` are nodes of the mesh, or vertices of the finer skin where there is one.
    pub(super) fn within(&self, corners: [u32; 3], weights: [f64; 3], field: &[Vec3]) -> Vec3 {
        let corner = |a: u32| self.embedding.as_ref().map_or_else(|| field[a as usize], |e| e.of(a as usize, field));
        corners.iter().zip(weights).map(|(&a, w)| w * corner(a)).sum()
    }

    /// Adds the transpose of [`Skin::within`].
    pub(super) fn add_within_transposed(&self, corners: [u32; 3], weights: [f64; 3], w: &Vec3, field: &mut [Vec3]) {
        for (&a, weight) in corners.iter().zip(weights) {
            match &self.embedding {
                Some(embedding) => embedding.add_transposed(a as usize, &(weight * w), field),
                None => field[a as usize] += weight * w,
            }
        }
    }

    /// Rows of three from element `offset` of the flattened field on; a whole row at a time where `out` is aligned.
    pub(super) fn gather(&self, field: &[Vec3], offset: usize, out: &mut [f64]) {
        if !(offset.is_multiple_of(3) && out.len().is_multiple_of(3)) {
            for (k, value) in (offset..).zip(out) {
                *value = self.of(k / 3, field)[k % 3];
            }
            return;
        }
        match &self.embedding {
            Some(embedding) => embedding.rows_into(offset / 3, field, out),
            None => {
                for (&a, row) in self.nodes[offset / 3..].iter().zip(out.as_chunks_mut::<3>().0) {
                    *row = field[a as usize].into();
                }
            }
        }
    }
}
