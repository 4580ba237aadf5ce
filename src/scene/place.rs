//! From places in space to nodes and triangles of the mesh.

use crate::math::Vec3;
use crate::mesh::TetMesh;

/// The point of triangle `abc` nearest to `p`, in barycentric weights.
///
/// Source: Ericson, "Real-Time Collision Detection", 2005, section 5.1.5.
pub fn nearest_on_triangle(p: &Vec3, [a, b, c]: [Vec3; 3]) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - w, w];
    }
    let sum = va + vb + vc;
    [va / sum, vb / sum, vc / sum]
}

/// Triangle and weights of the surface point nearest to `p`.
pub fn nearest_point(mesh: &TetMesh, triangles: &[[u32; 3]], p: &Vec3) -> Option<([u32; 3], [f64; 3])> {
    let candidates = triangles.iter().map(|t| {
        let corners = t.map(|a| mesh.nodes[a as usize]);
        let w = nearest_on_triangle(p, corners);
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
    let third = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|a| mesh.nodes[a as usize]);
        (b - a).cross(&(c - a)).norm() / 6.0
    };
    shares(triangles.iter().flat_map(|t| t.map(|a| (a, third(t)))))
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
