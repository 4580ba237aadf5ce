//! Contact of a surface with a rigid shape that a bone carries: it may slide along, and not enter.
//!
//! ```text
//! W = int psi(depth) dA,   p = psi'(depth) = k depth^2 / (2 t)   up to the depth t,   k (depth - t/2)   beyond
//! depth = -d(X),   X = F^-1 (x - mean y),   F = sum_i y_i c_i^T
//! ```
//!
//! The integral is over the surface at rest, at three points of each triangle: vertices alone would let a shape slip between
//! them. The shape moves with four nodes y_i that its bone
//! carries like any other of its nodes: they give the place of a point x of the surface in the shape's rest position, and
//! take the force on it by their barycentric weights there, so that the bone feels force and torque exactly. Pressure and
//! its slope are continuous; how deep it goes is of the order p/k.
//!
//! With G the stiffness by x, f = dW/dx, w_i the weights of X and p_i = F^-T c_i, the blocks are
//!
//! ```text
//! K_xx = G,   K_xi = -w_i G - p_i f^T,   K_ij = w_i w_j G + w_j f p_i^T + w_i p_j f^T
//! ```
//!
//! and x in turn is shared by the corners of its triangle.
//!
//! Source: Wriggers, "Computational Contact Mechanics", 2nd ed., 2006, section 5.4 for the penalty; points inside
//! facets after Fischer & Wriggers, Comput. Mech. 36, 2005; the four nodes are ours.

use super::shape::{Distance, Shape};
use crate::fem::{At, Curvature, HessianSink, Term, Touch};
use crate::math::{Mat3, Vec3};

/// One rigid shape, and the surface that it holds off.
pub struct Contact {
    /// The shape in its rest position.
    pub shape: Shape,
    /// Its middle then, m.
    pub middle: Vec3,
    /// The four nodes that move it.
    pub frame: [u32; 4],
    /// Their size: half the edge of the cube whose corners they are, m.
    pub size: f64,
    /// Triangles of the surface and their areas at rest, m2.
    pub triangles: Vec<([u32; 3], f64)>,
    /// Slope of the pressure with depth, Pa/m.
    pub stiffness: f64,
    /// Depth over which it sets in, m.
    pub onset: f64,
}

/// Corners of a cube about its middle that make a regular tetrahedron.
const CORNERS: [[f64; 3]; 4] = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];

/// Weights of a triangle's corners at its three points, each a third of the area: exact for what is quadratic.
const POINTS: [[f64; 3]; 3] =
    [[2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0], [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0], [1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0]];

/// Where the frame has taken the shape.
struct Placed {
    middle: Vec3,
    F_inverse: Mat3,
}

/// A point of the surface inside the shape.
struct Inside {
    /// Weights of the corners of its triangle.
    N: [f64; 3],
    /// Its area, m2.
    area: f64,
    /// Pressure, Pa, its slope, Pa/m, and the energy of a unit of area, J/m2.
    pressure: f64,
    slope: f64,
    energy: f64,
    /// Barycentric weights of its place among the frame's nodes.
    w: [f64; 4],
    distance: Distance,
}

impl Contact {
    /// Rest positions of nodes that move a shape about `middle`, m.
    pub fn corners(middle: Vec3, size: f64) -> [Vec3; 4] {
        CORNERS.map(|corner| middle + size * Vec3::from(corner))
    }

    /// c_i: the gradient of a frame node's weight.
    fn c(&self, i: usize) -> Vec3 {
        Vec3::from(CORNERS[i]) / (4.0 * self.size)
    }

    fn placed(&self, x: &[Vec3]) -> Option<Placed> {
        let y = self.frame.map(|a| x[a as usize]);
        let F: Mat3 = (0..4).map(|i| y[i] * self.c(i).transpose()).sum();
        Some(Placed { middle: y.iter().sum::<Vec3>() / 4.0, F_inverse: F.try_inverse()? })
    }

    /// From the middle of the shape at rest to where a point at `x` would then be, and its distance there.
    fn distance(&self, placed: &Placed, x: &Vec3) -> (Vec3, Distance) {
        let arm = placed.F_inverse * (x - placed.middle);
        (arm, self.shape.distance(&(self.middle + arm)))
    }

    /// Hands over the points of one triangle that are inside; returns the distance of its nearest point, or less than that
    /// of all its points where none can be inside.
    fn each_inside(
        &self,
        placed: &Placed,
        (nodes, area): &([u32; 3], f64),
        x: &[Vec3],
        mut inside: impl FnMut(Inside),
    ) -> f64 {
        let corners = nodes.map(|a| x[a as usize]);
        // No point is further from the first corner than the others are, here or where the shape rests.
        let (arm, first) = self.distance(placed, &corners[0]);
        let span = |k: usize| (placed.F_inverse * (corners[k] - placed.middle) - arm).norm();
        let least = first.d - span(1).max(span(2));
        // What is no number is left to the elements to refuse.
        if least > 0.0 || least.is_nan() {
            return least;
        }
        let mut nearest = f64::INFINITY;
        for N in POINTS {
            let at = N[0] * corners[0] + N[1] * corners[1] + N[2] * corners[2];
            let (arm, distance) = self.distance(placed, &at);
            nearest = nearest.min(distance.d);
            let depth = -distance.d;
            if depth <= 0.0 {
                continue;
            }
            let (k, t) = (self.stiffness, self.onset);
            let (pressure, slope, energy) = if depth < t {
                (k * depth * depth / (2.0 * t), k * depth / t, k * depth.powi(3) / (6.0 * t))
            } else {
                (k * (depth - 0.5 * t), k, k * (0.5 * depth * (depth - t) + t * t / 6.0))
            };
            let w = [0, 1, 2, 3].map(|i| 0.25 + self.c(i).dot(&arm));
            inside(Inside { N, area: area / 3.0, pressure, slope, energy, w, distance });
        }
        nearest
    }

    fn nodes(&self, [a, b, c]: [u32; 3]) -> [u32; 7] {
        let [i, j, k, l] = self.frame;
        [a, b, c, i, j, k, l]
    }
}

impl Inside {
    /// dW/dx, N.
    fn force(&self, placed: &Placed) -> Vec3 {
        placed.F_inverse.tr_mul(&(-self.area * self.pressure * self.distance.n))
    }

    /// Adds its blocks to the upper triangle of those of corners and frame.
    fn add_stiffness(&self, placed: &Placed, p: &[Vec3; 4], curvature: Curvature, upper: &mut [Mat3; 28]) {
        let Inside { N, area, pressure, slope, w, distance: Distance { n, H, .. }, .. } = self;
        // Along the shape pressure may be unstable: that part is left out where the stiffness must be definite.
        let exact = f64::from(u8::from(curvature == Curvature::Exact));
        let local = *area * (*slope * n * n.transpose() - exact * *pressure * H);
        let G = placed.F_inverse.tr_mul(&(local * placed.F_inverse));
        let f = exact * self.force(placed);
        let by_frame = [0, 1, 2, 3].map(|i| -w[i] * G - p[i] * f.transpose());
        let mut blocks = upper.iter_mut();
        let mut add = |block: Mat3| *blocks.next().expect("28 blocks") += block;
        for a in 0..3 {
            (a..3).for_each(|b| add(N[a] * N[b] * G));
            by_frame.iter().for_each(|block| add(N[a] * block));
        }
        for i in 0..4 {
            for j in i..4 {
                add(w[i] * w[j] * G + w[j] * f * p[i].transpose() + w[i] * p[j] * f.transpose());
            }
        }
    }
}

impl Term for Contact {
    fn name(&self) -> &'static str {
        "contact"
    }

    fn energy(&self, _at: &At, x: &[Vec3]) -> f64 {
        let Some(placed) = self.placed(x) else { return f64::INFINITY };
        let mut energy = 0.0;
        for triangle in &self.triangles {
            self.each_inside(&placed, triangle, x, |inside| energy += inside.area * inside.energy);
        }
        energy
    }

    fn add_gradient(&self, _at: &At, x: &[Vec3], g: &mut [Vec3]) -> f64 {
        let Some(placed) = self.placed(x) else { return f64::INFINITY };
        let mut energy = 0.0;
        for triangle in &self.triangles {
            self.each_inside(&placed, triangle, x, |inside| {
                let f = inside.force(&placed);
                energy += inside.area * inside.energy;
                triangle.0.iter().zip(inside.N).for_each(|(&a, N)| g[a as usize] += N * f);
                self.frame.iter().zip(inside.w).for_each(|(&i, w)| g[i as usize] -= w * f);
            });
        }
        energy
    }

    fn couplings(&self, clique: &mut dyn FnMut(&[u32])) {
        self.triangles.iter().for_each(|(corners, _)| clique(&self.nodes(*corners)));
    }

    fn add_hessian(&self, _at: &At, x: &[Vec3], curvature: Curvature, sink: &mut dyn HessianSink) {
        let placed = self.placed(x);
        for triangle in &self.triangles {
            let mut upper = [Mat3::zeros(); 28];
            if let Some(placed) = &placed {
                let p = [0, 1, 2, 3].map(|i| placed.F_inverse.tr_mul(&self.c(i)));
                self.each_inside(placed, triangle, x, |inside| {
                    inside.add_stiffness(placed, &p, curvature, &mut upper);
                });
            }
            sink.add(&self.nodes(triangle.0), &upper);
        }
    }

    fn touch(&self, x: &[Vec3]) -> Option<Touch> {
        let mut touch = Touch { reach: self.shape.reach(), ..Touch::NONE };
        let Some(placed) = self.placed(x) else { return Some(touch) };
        for triangle in &self.triangles {
            let nearest = self.each_inside(&placed, triangle, x, |inside| touch.force += inside.force(&placed));
            touch.gap = touch.gap.min(nearest);
        }
        Some(touch)
    }
}
