//! Nearest point on a triangle surface, through a grid of bins.

use super::{Surface, nearest_on_triangle};
use crate::math::{Vec3, bounds};

/// Triangles sorted into the cells of a regular grid; answers distance queries.
#[derive(Debug, Clone)]
pub struct Nearest<'a> {
    surface: &'a Surface,
    low: Vec3,
    cell: f64,
    dims: [usize; 3],
    begin: Vec<u32>,
    items: Vec<u32>,
    /// Centre and radius of a ball about each triangle.
    balls: Vec<(Vec3, f64)>,
}

impl<'a> Nearest<'a> {
    /// Sorts a surface's triangles into cubic bins of edge `cell`, m.
    pub fn new(surface: &'a Surface, cell: f64) -> Self {
        let (low, high) = bounds(&surface.vertices);
        let dims = [0, 1, 2].map(|a| if high[a] >= low[a] { ((high[a] - low[a]) / cell) as usize + 1 } else { 1 });
        let ball = |t: usize| {
            let x = surface.corners(t);
            let middle = (x[0] + x[1] + x[2]) / 3.0;
            (middle, x.iter().fold(0.0, |r: f64, c| r.max((c - middle).norm())))
        };
        let balls = (0..surface.triangles.len()).map(ball).collect();
        let begin = vec![0; dims.iter().product::<usize>() + 1];
        let mut bins = Self { surface, low, cell, dims, begin, items: Vec::new(), balls };
        for fill in [false, true] {
            let mut place = bins.begin.clone();
            for t in 0..surface.triangles.len() {
                let corners = surface.corners(t);
                let first = bins.bin(&corners[0].inf(&corners[1]).inf(&corners[2]));
                let last = bins.bin(&corners[0].sup(&corners[1]).sup(&corners[2]));
                for k in first[2]..=last[2] {
                    for j in first[1]..=last[1] {
                        for i in first[0]..=last[0] {
                            let b = (k * dims[1] + j) * dims[0] + i;
                            if fill {
                                bins.items[place[b] as usize] = t as u32;
                            }
                            place[b] += 1;
                        }
                    }
                }
            }
            if !fill {
                let mut sum = 0;
                for b in &mut place {
                    sum += std::mem::replace(b, sum);
                }
                bins.items = vec![0; sum as usize];
                bins.begin = place;
            }
        }
        bins
    }

    fn bin(&self, p: &Vec3) -> [usize; 3] {
        [0, 1, 2].map(|a| ((p[a] - self.low[a]) / self.cell).clamp(0.0, self.dims[a] as f64 - 1.0) as usize)
    }

    /// Distance to the nearest triangle and its number, if one is nearer than `reach`.
    pub fn distance(&self, p: &Vec3, reach: f64) -> Option<(f64, usize)> {
        let centre = self.bin(p);
        // A point outside the bins looks at them from the nearest bin: its offset only makes rings later.
        let mut best: Option<(f64, usize)> = None;
        let outside =
            (0..3).map(|a| (self.low[a] - p[a]).max(p[a] - self.low[a] - self.cell * self.dims[a] as f64).max(0.0));
        let gap = outside.fold(0.0, f64::max);
        for ring in 0..*self.dims.iter().max().unwrap_or(&1) {
            let bound = best.map_or(reach, |b| b.0);
            if ((ring as f64 - 1.0) * self.cell).max(gap) > bound {
                break;
            }
            self.ring(centre, ring, |t| {
                let (middle, radius) = self.balls[t];
                if (p - middle).norm() - radius >= best.map_or(reach, |b| b.0) {
                    return;
                }
                let d = (nearest_on_triangle(p, self.surface.corners(t)) - p).norm();
                if d < best.map_or(reach, |b| b.0) {
                    best = Some((d, t));
                }
            });
        }
        best
    }

    /// Calls `visit` for the triangles of all bins exactly `ring` bins away.
    fn ring(&self, centre: [usize; 3], ring: usize, mut visit: impl FnMut(usize)) {
        let range = |a: usize| centre[a].saturating_sub(ring)..=(centre[a] + ring).min(self.dims[a] - 1);
        for k in range(2) {
            for j in range(1) {
                let inner = centre[2].abs_diff(k) < ring && centre[1].abs_diff(j) < ring;
                for i in range(0) {
                    if inner && centre[0].abs_diff(i) < ring {
                        continue;
                    }
                    let b = (k * self.dims[1] + j) * self.dims[0] + i;
                    for &t in &self.items[self.begin[b] as usize..self.begin[b + 1] as usize] {
                        visit(t as usize);
                    }
                }
            }
        }
    }
}
