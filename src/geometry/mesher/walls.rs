//! Where the nodes of a mesh may go: on their wall, on the sheet and its rim, in the planes of the box.

use super::super::stencils::Stuffed;
use super::super::stuffing::Wall;
use super::sheet::{ON_RIM, ON_SHEET, Sheet};
use crate::math::Vec3;

/// Steps back to what holds a node; each squares the error for one surface, several take turns.
const STEPS: [usize; 4] = [0, 3, 6, 10];
/// A surface whose slope within the rest of the freedom is less than this is met at a grazing angle: the node stays.
const GRAZING: f64 = 0.2;

/// What holds the nodes of a mesh.
pub(super) struct Held<'a> {
    pub walls: &'a [Wall<'a>],
    sheet: Option<Sheet<'a>>,
    /// How far off its wall each node is kept, m: where the fit put it.
    pub offset: Vec<f64>,
}

/// A vector's part within the planes in `bounds`.
pub(super) fn in_planes(bounds: u8, mut v: Vec3) -> Vec3 {
    for a in 0..3 {
        if bounds >> (2 * a) & 3 != 0 {
            v[a] = 0.0;
        }
    }
    v
}

impl<'a> Held<'a> {
    pub fn new(walls: &'a [Wall<'a>], nodes: usize) -> Self {
        Self { walls, sheet: None, offset: vec![0.0; nodes] }
    }

    pub fn with_sheet(mut self, sheet: &Sheet<'a>) -> Self {
        self.sheet = Some(*sheet);
        self
    }

    /// The planes of the box alone.
    pub fn planes(self) -> Self {
        Self { walls: &[], sheet: None, ..self }
    }

    pub fn wall(&self, mesh: &Stuffed, node: usize) -> Option<&Wall<'a>> {
        self.walls.get(usize::from(mesh.wall[node]))
    }

    /// Distance and slope at `x` of the surfaces that hold a node.
    fn surfaces(&self, mesh: &Stuffed, node: usize, x: &Vec3) -> ([(f64, Vec3); 3], usize) {
        let mut out = [(0.0, Vec3::zeros()); 3];
        let mut n = 0;
        if let Some(wall) = self.wall(mesh, node) {
            let (d, slope) = wall.slope(x);
            out[n] = (d - self.offset[node], slope);
            n += 1;
        }
        if let Some(sheet) = &self.sheet {
            for (bit, field) in [(ON_SHEET, sheet.level), (ON_RIM, sheet.rim)] {
                if mesh.plane[node] & bit != 0 {
                    out[n] = field.slope(x);
                    n += 1;
                }
            }
        }
        (out, n)
    }

    /// Directions in which a node may go: an orthonormal basis.
    pub fn freedom(&self, mesh: &Stuffed, node: usize) -> ([Vec3; 3], usize) {
        let none = ([Vec3::zeros(); 3], 0);
        // What a node may not do, orthonormal; the rest of space is free.
        let mut barred: Vec3x3 = Vec3x3::default();
        for a in (0..3).filter(|a| mesh.plane[node] >> (2 * a) & 3 != 0) {
            let mut v = Vec3::zeros();
            v[a] = 1.0;
            barred.push(v);
        }
        let (surfaces, n) = self.surfaces(mesh, node, &mesh.nodes[node]);
        for (_, slope) in &surfaces[..n] {
            let rest = barred.rest(slope);
            if barred.n == 3 || rest.norm() < GRAZING {
                return none;
            }
            barred.push(rest.normalize());
        }
        let mut all = barred;
        let mut free = ([Vec3::zeros(); 3], 0);
        for _ in barred.n..3 {
            let axis = |a: usize| {
                let mut v = Vec3::zeros();
                v[a] = 1.0;
                all.rest(&v)
            };
            let longest = (0..3).map(axis).fold(Vec3::zeros(), |m: Vec3, v| if v.norm() > m.norm() { v } else { m });
            let v = longest.normalize();
            all.push(v);
            free.0[free.1] = v;
            free.1 += 1;
        }
        free
    }

    /// A place near `x` on everything that holds the node; `None` where the way back is lost.
    pub fn returned(&self, mesh: &Stuffed, node: usize, mut x: Vec3) -> Option<Vec3> {
        let bounds = mesh.plane[node];
        let mut steps = 0;
        loop {
            let (surfaces, n) = self.surfaces(mesh, node, &x);
            if steps >= STEPS[n.min(3)] {
                return Some(x);
            }
            steps += 1;
            // Each in turn, within what those before it leave: a step of Newton's method for all together.
            let mut barred = Vec3x3::default();
            let mut step = Vec3::zeros();
            for (d, slope) in &surfaces[..n] {
                let slope = in_planes(bounds, *slope);
                let rest = barred.rest(&slope);
                let square = rest.norm_squared();
                if square < GRAZING * GRAZING {
                    return None;
                }
                step -= rest * ((d + slope.dot(&step)) / square);
                barred.push(rest / square.sqrt());
            }
            x += step;
        }
    }
}

/// Up to three orthonormal vectors.
#[derive(Clone, Copy, Default)]
struct Vec3x3 {
    v: [Vec3; 3],
    n: usize,
}

impl Vec3x3 {
    fn push(&mut self, v: Vec3) {
        if self.n < 3 {
            self.v[self.n] = v;
            self.n += 1;
        }
    }

    /// What of a vector none of these has.
    fn rest(&self, x: &Vec3) -> Vec3 {
        self.v[..self.n].iter().fold(*x, |x, v| x - v * v.dot(&x))
    }
}
