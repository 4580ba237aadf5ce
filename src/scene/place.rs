//! From places in space to nodes and triangles of the mesh.

use crate::math::{Vec3, nearest_weights};
use crate::mesh::TetMesh;

/// Triangle and weights of the surface point nearest to `p`; `x` are the places of the triangles' corners.
pub fn nearest_point(x: &[Vec3], triangles: &[[u32; 3]], p: &Vec3) -> Option<([u32; 3], [f64; 3])> {
    let candidates = triangles.iter().map(|t| {
        let corners = t.map(|a| x[a as usize]);
        let w = nearest_weights(p, corners);
        let x: Vec3 = corners.iter().zip(w).map(|(x, w)| w * x).sum();
        ((x - p).norm_squared(), *t, w)
    });
    candidates.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, t, w)| (t, w))
}

/// Triangles whose centroid lies within `radius` of `p`.
pub fn patch(mesh: &TetMesh, triangles: &[[u32; 3]], p: &Vec3, radius: f64) -> Vec<[u32; 3]> {
    let centroid = |t: &[u32; 3]| t.iter().map(|&a| mesh.nodes[a as usize]).sum::<Vec3>() / 3.0;
    triangles.iter().filter(|t| (centroid(t) - p).norm() <= radius).copied().collect()
}

/// Share of each node in the area of the triangles; sums to one.
pub fn area_shares(mesh: &TetMesh, triangles: &[[u32; 3]]) -> Vec<(u32, f64)> {
    shares(triangles.iter().flat_map(|t| t.map(|a| (a, area(mesh, t) / 3.0))))
}

/// Area of a triangle, m2.
pub fn area(mesh: &TetMesh, triangle: &[u32; 3]) -> f64 {
    let [a, b, c] = triangle.map(|a| mesh.nodes[a as usize]);
    0.5 * (b - a).cross(&(c - a)).norm()
}

/// Share of each node in the volume of the tetrahedra of `region`; sums to one.
pub fn volume_shares(mesh: &TetMesh, region: u32) -> Vec<(u32, f64)> {
    let tets = (0..mesh.tets.len()).filter(|&e| mesh.region[e] == region);
    shares(tets.flat_map(|e| mesh.tets[e].map(|a| (a, 0.25 * mesh.volume(e)))))
}

fn shares(parts: impl Iterator<Item = (u32, f64)>) -> Vec<(u32, f64)> {
    let mut sum: std::collections::BTreeMap<u32, f64> = Default::default();
    for (a, w) in parts {
        *sum.entry(a).or_default() += w;
    }
    let total: f64 = sum.values().sum();
    sum.into_iter().map(|(a, w)| (a, w / total)).collect()
}
