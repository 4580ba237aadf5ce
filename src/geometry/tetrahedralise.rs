//! From surfaces to tetrahedra: the lattice, stuffed, repaired, its boundary named by the surface that cut.

use super::lattice::Lattice;
use super::repair::{Repair, repair};
use super::stencils::{Stuffed, stencils};
use super::stuffing::{NO_WALL, Wall, Warped};
use super::topology::{boundary, neighbours};
use super::{Cuboid, MeshingError, Sizing};
use crate::math::Vec3;

/// Tetrahedra between walls, with each boundary triangle's wall.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stuffing {
    /// Nodes, their walls, and the tetrahedra.
    pub mesh: Stuffed,
    /// Boundary triangles, wound outward, with the number of their wall; [`NO_WALL`] where the lattice ends.
    pub boundary: Vec<([u32; 3], u8)>,
    /// What the repair changed.
    pub repair: Repair,
}

/// Fills the space inside all walls and inside `region` with tetrahedra of the size asked for.
///
/// # Errors
/// [`MeshingError::NoTissue`] when nothing lies between the walls; [`Lattice::over`]'s.
pub fn tetrahedralise(walls: &[Wall], region: &Cuboid, sizing: &dyn Sizing) -> Result<Stuffing, MeshingError> {
    stuff(walls, &Lattice::over(region, sizing)?)
}

/// Fills the space inside all walls with the tetrahedra of one lattice.
///
/// # Errors
/// [`MeshingError::NoTissue`] when no lattice tetrahedron has a corner between the walls.
pub fn stuff(walls: &[Wall], lattice: &Lattice) -> Result<Stuffing, MeshingError> {
    let mut mesh = {
        let warped = Warped::new(lattice, walls);
        stencils(&warped)
    };
    let repair = repair(&mut mesh);
    if mesh.tets.is_empty() {
        let names = walls.iter().map(|w| w.name).collect::<Vec<_>>().join(", ");
        return Err(MeshingError::NoTissue { walls: names, edge: lattice.edge });
    }
    let boundary = name_boundary(&mesh, walls, 0.5 * lattice.edge);
    Ok(Stuffing { mesh, boundary, repair })
}

/// The wall of each boundary triangle: its corners' own if they agree, else the wall nearest to its middle within `reach`, m.
pub(super) fn name_boundary(mesh: &Stuffed, walls: &[Wall], reach: f64) -> Vec<([u32; 3], u8)> {
    let name = |t: [u32; 3]| {
        let [a, b, c] = t.map(|a| mesh.wall[a as usize]);
        if a == b && b == c && a != NO_WALL {
            return a;
        }
        let middle: Vec3 = t.iter().map(|&a| mesh.nodes[a as usize]).sum::<Vec3>() / 3.0;
        let distance = |w: &Wall| w.depth(&middle).abs();
        let nearest = (0..walls.len()).map(|w| (distance(&walls[w]), w)).min_by(|p, q| p.0.total_cmp(&q.0));
        nearest.filter(|(d, _)| *d < reach).map_or(NO_WALL, |(_, w)| w as u8)
    };
    let triangles = boundary(&mesh.tets, &neighbours(&mesh.tets));
    triangles.into_iter().map(|(t, _)| (t, name(t))).collect()
}
