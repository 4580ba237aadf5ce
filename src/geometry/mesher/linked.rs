//! A mesh whose tetrahedra and surface triangles come and go: what hangs on each node is kept at hand.

use super::super::repair::compact;
use super::super::stencils::Stuffed;
use super::collapse::Face;

/// Mark of what is gone.
pub(super) const GONE: u32 = u32::MAX;

/// A mesh with its boundary and sheet, and for each node the tetrahedra and the triangles on it.
pub(super) struct Linked<'a> {
    pub mesh: &'a mut Stuffed,
    pub faces: &'a mut Vec<Face>,
    pub star: Vec<Vec<u32>>,
    pub fan: Vec<Vec<u32>>,
}

fn link<const N: usize>(n_nodes: usize, items: impl Iterator<Item = [u32; N]>) -> Vec<Vec<u32>> {
    let mut out = vec![Vec::new(); n_nodes];
    for (k, nodes) in items.enumerate() {
        nodes.iter().for_each(|&a| out[a as usize].push(k as u32));
    }
    out
}

impl<'a> Linked<'a> {
    pub fn new(mesh: &'a mut Stuffed, faces: &'a mut Vec<Face>) -> Self {
        let star = link(mesh.nodes.len(), mesh.tets.iter().copied());
        let fan = link(mesh.nodes.len(), faces.iter().map(|f| f.0));
        Self { mesh, faces, star, fan }
    }

    /// Leaves out what is gone, and nodes that nothing uses; the others keep their order.
    pub fn finish(self) {
        self.mesh.tets.retain(|t| t[0] != GONE);
        self.faces.retain(|t| t.0[0] != GONE);
        let new = compact(self.mesh);
        self.faces.iter_mut().for_each(|(t, _)| *t = t.map(|a| new[a as usize]));
    }
}
