//! Triangle surfaces: what marching cubes returns and what distances are measured to.

use crate::math::Vec3;

/// Triangles with shared vertices, wound so that normals point out of the body.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surface {
    /// Vertex positions, m.
    pub vertices: Vec<Vec3>,
    /// Corner vertices of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// Corner positions of triangle `t`.
    pub fn corners(&self, t: usize) -> [Vec3; 3] {
        self.triangles[t].map(|a| self.vertices[a as usize])
    }

    /// Total area, m2.
    pub fn area(&self) -> f64 {
        (0..self.triangles.len()).map(|t| doubled_area(self.corners(t)).norm() / 2.0).sum()
    }

    /// Enclosed volume, m3; meaningful for a closed surface.
    pub fn volume(&self) -> f64 {
        let part = |[a, b, c]: [Vec3; 3]| a.cross(&b).dot(&c) / 6.0;
        (0..self.triangles.len()).map(|t| part(self.corners(t))).sum()
    }

    /// Edges that are not shared by exactly two triangles in opposite directions.
    pub fn open_edges(&self) -> usize {
        let mut edges: Vec<(u32, u32, bool)> = Vec::with_capacity(3 * self.triangles.len());
        for &[a, b, c] in &self.triangles {
            edges.extend([(a, b), (b, c), (c, a)].map(|(p, q)| (p.min(q), p.max(q), p < q)));
        }
        edges.sort_unstable();
        let groups = edges.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1));
        groups.filter(|g| g.len() != 2 || g[0].2 == g[1].2).count()
    }

    /// Vertices whose triangles do not form one closed fan.
    pub fn pinched_vertices(&self) -> usize {
        let mut fans: Vec<(u32, u32, u32)> = Vec::with_capacity(3 * self.triangles.len());
        for &[a, b, c] in &self.triangles {
            fans.extend([(a, b, c), (b, c, a), (c, a, b)]);
        }
        fans.sort_unstable();
        let closed = |fan: &[(u32, u32, u32)]| {
            let mut at = fan[0].2;
            let mut steps = 1;
            while at != fan[0].1 && steps <= fan.len() {
                let Ok(k) = fan.binary_search_by_key(&at, |f| f.1) else { return false };
                at = fan[k].2;
                steps += 1;
            }
            steps == fan.len()
        };
        fans.chunk_by(|x, y| x.0 == y.0).filter(|fan| !closed(fan)).count()
    }

    /// Euler characteristic: vertices used - edges + triangles.
    pub fn euler(&self) -> i64 {
        let mut used: Vec<u32> = self.triangles.as_flattened().to_vec();
        used.sort_unstable();
        used.dedup();
        let mut edges: Vec<(u32, u32)> = Vec::with_capacity(3 * self.triangles.len());
        for &[a, b, c] in &self.triangles {
            edges.extend([(a, b), (b, c), (c, a)].map(|(p, q)| (p.min(q), p.max(q))));
        }
        edges.sort_unstable();
        edges.dedup();
        used.len() as i64 - edges.len() as i64 + self.triangles.len() as i64
    }
}

/// Normal of a triangle with twice its area as length.
pub fn doubled_area([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(&(c - a))
}

/// Point of a triangle nearest to `p`.
///
/// Source: C. Ericson, "Real-Time Collision Detection", 2005, section 5.1.5.
pub fn nearest_on_triangle(p: &Vec3, [a, b, c]: [Vec3; 3]) -> Vec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    if sum <= 0.0 {
        return a;
    }
    a + ab * (vb / sum) + ac * (vc / sum)
}
