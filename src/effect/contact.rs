//! Contact of a surface with a rigid shape that a bone carries: it may slide along, and not enter.
//!
//! ```text
//! W = int psi(depth) dA,   p = psi'(depth) = k depth^2 / (2 t)   up to the depth t,   k (depth - t/2)   beyond
//! depth = -d(X),   X = F^-1 (x - mean y),   F = sum_i y_i c_i^T
//! ```
//!
//! The integral is over the surface at rest, at three points of each triangle: vertices alone would let a shape slip between
//! them. The shape moves with four nodes y_i that its bone carries like any other of its nodes: they give the place of a point
//! x of the surface in the shape's rest position, and take the force on it by their barycentric weights there, so that the
//! bone feels force and torque exactly. Pressure and its slope are continuous; how deep it goes is of the order p/k.
//!
//! With G the stiffness by x, f = dW/dx, w_i the weights of X and p_i = F^-T c_i, the blocks are
//!
//! ```text
//! K_xx = G,   K_xi = -w_i G - p_i f^T,   K_ij = w_i w_j G + w_j f p_i^T + w_i p_j f^T
//! ```
//!
//! and x in turn is shared by the corners of its triangle.
//!
//! With friction a point that touched at the end of the last step sticks to the place X_0 of the shape, elastically, until the
//! traction reaches mu p; then it slides, and takes X_0 along:
//!
//! ```text
//! W_f = int (k s^2/2  up to k s = mu p,   mu p s - (mu p)^2/(2k)  beyond) dA,   s = |(1 - n n^T)(X - X_0)|
//! X_0 <- X - (traction)/k   after each step
//! ```
//!
//! Friction has no energy, so p and n are taken at the last iterate; at the solution they are exact.
//!
//! Source: Wriggers, "Computational Contact Mechanics", 2nd ed., 2006, for the penalty and for Coulomb's law with an elastic
//! part; points inside facets after Fischer & Wriggers, Comput. Mech. 36, 2005; the four nodes are ours.

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
    /// What holds the surface where it touches, if anything does.
    pub friction: Option<Friction>,
}

/// Friction of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Friction {
    /// Largest traction along the shape, in units of the pressure.
    pub mu: f64,
    /// Where what it remembers begins in the history.
    pub first: usize,
}

/// Corners of a cube about its middle that make a regular tetrahedron.
const CORNERS: [[f64; 3]; 4] = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];

/// Weights of a triangle's corners at its three points, each a third of the area: exact for what is quadratic.
const POINTS: [[f64; 3]; 3] =
    [[2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0], [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0], [1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0]];

/// Numbers that friction remembers of a point: its place X_0 from the middle of the shape, and whether it touched.
const REMEMBERED: usize = 4;
/// Change of a place in differences of tractions, in sizes of the frame.
const CHANGE: f64 = 1e-6;

/// Nodes, and where their frame has taken the shape.
struct Placed<'a> {
    x: &'a [Vec3],
    middle: Vec3,
    F_inverse: Mat3,
}

/// A point of a triangle that the shape acts on.
struct Touched {
    /// Its number among the triangle's points, and the weights of the corners.
    q: usize,
    N: [f64; 3],
    /// Its place from the middle of the shape at rest, and its weights among the frame's nodes.
    arm: Vec3,
    w: [f64; 4],
    /// dW/dX, N, and d2W/dX2 without and with what may be unstable, N/m.
    force: Vec3,
    definite: Mat3,
    stiffness: Mat3,
    /// W, J.
    energy: f64,
}

/// Pressure, Pa, its slope, Pa/m, and the energy of a unit of area, J/m2.
struct Push {
    pressure: f64,
    slope: f64,
    energy: f64,
}

/// Traction, Pa, its derivative by the place, Pa/m, and the energy of a unit of area, J/m2.
struct Hold {
    traction: Vec3,
    stiffness: Mat3,
    energy: f64,
}

impl Contact {
    /// Rest positions of nodes that move a shape about `middle`, m.
    pub fn corners(middle: Vec3, size: f64) -> [Vec3; 4] {
        CORNERS.map(|corner| middle + size * Vec3::from(corner))
    }

    /// How much the friction of a contact with this many triangles remembers.
    pub fn memory(n_triangles: usize) -> usize {
        REMEMBERED * POINTS.len() * n_triangles
    }

    /// c_i: the gradient of a frame node's weight.
    fn c(&self, i: usize) -> Vec3 {
        Vec3::from(CORNERS[i]) / (4.0 * self.size)
    }

    fn placed<'a>(&self, x: &'a [Vec3]) -> Option<Placed<'a>> {
        let y = self.frame.map(|a| x[a as usize]);
        let F: Mat3 = (0..4).map(|i| y[i] * self.c(i).transpose()).sum();
        Some(Placed { x, middle: y.iter().sum::<Vec3>() / 4.0, F_inverse: F.try_inverse()? })
    }

    fn distance(&self, arm: &Vec3) -> Distance {
        self.shape.distance(&(self.middle + arm))
    }

    /// At this distance, nothing outside.
    fn push(&self, d: f64) -> Push {
        let (k, t, depth) = (self.stiffness, self.onset, -d);
        let (pressure, slope, energy) = if depth <= 0.0 {
            (0.0, 0.0, 0.0)
        } else if depth < t {
            (k * depth * depth / (2.0 * t), k * depth / t, k * depth.powi(3) / (6.0 * t))
        } else {
            (k * (depth - 0.5 * t), k, k * (0.5 * depth * (depth - t) + t * t / 6.0))
        };
        Push { pressure, slope, energy }
    }

    /// What friction does to a point at `arm` that sticks to `origin`, where pressure and normal are those at `lag`.
    fn hold(&self, mu: f64, lag: &Vec3, origin: &Vec3, arm: &Vec3) -> Option<Hold> {
        let Distance { d, n, .. } = self.distance(lag);
        let (k, most) = (self.stiffness, mu * self.push(d).pressure);
        if most <= 0.0 {
            return None;
        }
        let along = Mat3::identity() - n * n.transpose();
        let u = along * (arm - origin);
        let s = u.norm();
        Some(if k * s <= most {
            Hold { traction: k * u, stiffness: k * along, energy: 0.5 * k * s * s }
        } else {
            let stiffness = most / s * (along - u * u.transpose() / (s * s));
            Hold { traction: most / s * u, stiffness, energy: most * (s - 0.5 * most / k) }
        })
    }

    /// Where point `q` of triangle `e` sticks, if it touched before.
    fn origin(&self, friction: &Friction, history: &[f64], e: usize, q: usize) -> Option<Vec3> {
        let at = friction.first + REMEMBERED * (POINTS.len() * e + q);
        let [x, y, z, touched] = history.get(at..at + REMEMBERED)?.try_into().ok()?;
        (touched != 0.0).then_some(Vec3::new(x, y, z))
    }

    /// Places of a triangle's corners from the middle of the shape at rest, and a bound that none of its points is nearer than.
    fn arms(&self, placed: &Placed, nodes: &[u32; 3]) -> ([Vec3; 3], f64) {
        let arms = nodes.map(|a| placed.F_inverse * (placed.x[a as usize] - placed.middle));
        // No point is further from the first corner than the others are.
        let span = (arms[1] - arms[0]).norm().max((arms[2] - arms[0]).norm());
        (arms, self.distance(&arms[0]).d - span)
    }

    /// Hands over the points of triangle `e` that the shape acts on, `lag` being where pressures for friction are taken; returns
    /// the distance of its nearest point, or less than that of all its points where none can be inside.
    fn each_touched(
        &self,
        history: &[f64],
        placed: &Placed,
        lag: Option<&Placed>,
        e: usize,
        mut touched: impl FnMut(Touched),
    ) -> f64 {
        let (nodes, area) = &self.triangles[e];
        let (arms, least) = self.arms(placed, nodes);
        let lag = lag.map(|placed| self.arms(placed, nodes)).filter(|(_, least)| *least <= 0.0);
        // What is no number is left to the elements to refuse.
        if least.is_nan() || least > 0.0 && lag.is_none() {
            return least;
        }
        let mut nearest = f64::INFINITY;
        for (q, N) in POINTS.into_iter().enumerate() {
            let at = |arms: &[Vec3; 3]| N[0] * arms[0] + N[1] * arms[1] + N[2] * arms[2];
            let arm = at(&arms);
            let Distance { d, n, H } = self.distance(&arm);
            nearest = nearest.min(d);
            let hold = self.friction.as_ref().zip(lag.as_ref()).and_then(|(friction, (lag, _))| {
                self.hold(friction.mu, &at(lag), &self.origin(friction, history, e, q)?, &arm)
            });
            if d >= 0.0 && hold.is_none() {
                continue;
            }
            let Push { pressure, slope, energy } = self.push(d);
            let area = area / POINTS.len() as f64;
            let w = [0, 1, 2, 3].map(|i| 0.25 + self.c(i).dot(&arm));
            let mut point = Touched {
                q,
                N,
                arm,
                w,
                force: -area * pressure * n,
                definite: area * slope * n * n.transpose(),
                stiffness: -area * pressure * H,
                energy: area * energy,
            };
            if let Some(Hold { traction, stiffness, energy }) = hold {
                point.force += area * traction;
                point.definite += area * stiffness;
                point.energy += area * energy;
            }
            point.stiffness += point.definite;
            touched(point);
        }
        nearest
    }

    /// The shape at the last iterate, where friction takes its pressures.
    fn lag<'a>(&self, at: &At<'a>) -> Option<Placed<'a>> {
        self.friction.as_ref().and_then(|_| self.placed(at.x_lag))
    }

    fn nodes(&self, [a, b, c]: [u32; 3]) -> [u32; 7] {
        let [i, j, k, l] = self.frame;
        [a, b, c, i, j, k, l]
    }
}

impl Touched {
    /// Adds to a nodal field what `by`, which belongs to the point's place X, is to corners and frame.
    fn add_to(&self, placed: &Placed, nodes: [u32; 7], by: &Vec3, out: &mut [Vec3]) {
        let by = placed.F_inverse.tr_mul(by);
        nodes[..3].iter().zip(self.N).for_each(|(&a, N)| out[a as usize] += N * by);
        nodes[3..].iter().zip(self.w).for_each(|(&i, w)| out[i as usize] -= w * by);
    }

    /// Adds its blocks to the upper triangle of those of corners and frame.
    fn add_stiffness(&self, placed: &Placed, p: &[Vec3; 4], curvature: Curvature, upper: &mut [Mat3; 28]) {
        let Touched { N, w, .. } = self;
        // Along the shape pressure may be unstable: that part is left out where the stiffness must be definite.
        let (local, f) = match curvature {
            Curvature::Exact => (self.stiffness, placed.F_inverse.tr_mul(&self.force)),
            Curvature::Projected => (self.definite, Vec3::zeros()),
        };
        let G = placed.F_inverse.tr_mul(&(local * placed.F_inverse));
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

    fn energy(&self, at: &At, x: &[Vec3]) -> f64 {
        let Some(placed) = self.placed(x) else { return f64::INFINITY };
        let lag = self.lag(at);
        let mut energy = 0.0;
        for e in 0..self.triangles.len() {
            self.each_touched(at.history, &placed, lag.as_ref(), e, |point| energy += point.energy);
        }
        energy
    }

    fn add_gradient(&self, at: &At, x: &[Vec3], g: &mut [Vec3]) -> f64 {
        let Some(placed) = self.placed(x) else { return f64::INFINITY };
        let lag = self.lag(at);
        let mut energy = 0.0;
        for (e, (corners, _)) in self.triangles.iter().enumerate() {
            self.each_touched(at.history, &placed, lag.as_ref(), e, |point| {
                energy += point.energy;
                point.add_to(&placed, self.nodes(*corners), &point.force, g);
            });
        }
        energy
    }

    fn couplings(&self, clique: &mut dyn FnMut(&[u32])) {
        self.triangles.iter().for_each(|(corners, _)| clique(&self.nodes(*corners)));
    }

    fn add_hessian(&self, at: &At, x: &[Vec3], curvature: Curvature, sink: &mut dyn HessianSink) {
        let placed = self.placed(x);
        let lag = self.lag(at);
        for (e, (corners, _)) in self.triangles.iter().enumerate() {
            let mut upper = [Mat3::zeros(); 28];
            if let Some(placed) = &placed {
                let p = [0, 1, 2, 3].map(|i| placed.F_inverse.tr_mul(&self.c(i)));
                self.each_touched(at.history, placed, lag.as_ref(), e, |point| {
                    point.add_stiffness(placed, &p, curvature, &mut upper);
                });
            }
            sink.add(&self.nodes(*corners), &upper);
        }
    }

    fn is_lagged(&self) -> bool {
        self.friction.is_some()
    }

    /// The lag is at the solution here, where it is the same place.
    fn add_lag_transposed(&self, at: &At, xi: &[Vec3], out: &mut [Vec3]) {
        let (Some(friction), Some(placed)) = (&self.friction, self.lag(at)) else { return };
        for (e, (corners, area)) in self.triangles.iter().enumerate() {
            let nodes = self.nodes(*corners);
            self.each_touched(at.history, &placed, None, e, |point| {
                let Some(origin) = self.origin(friction, at.history, e, point.q) else { return };
                let traction = |lag: &Vec3| {
                    self.hold(friction.mu, lag, &origin, &point.arm).map_or(Vec3::zeros(), |hold| hold.traction)
                };
                let seen: Vec3 = (0..3).map(|a| point.N[a] * xi[nodes[a] as usize]).sum::<Vec3>()
                    - (0..4).map(|i| point.w[i] * xi[nodes[3 + i] as usize]).sum::<Vec3>();
                let seen = area / POINTS.len() as f64 * (placed.F_inverse * seen);
                let h = CHANGE * self.size;
                let by = Vec3::from_fn(|c, _| {
                    let step = h * Vec3::ith(c, 1.0);
                    (traction(&(point.arm + step)) - traction(&(point.arm - step))).dot(&seen) / (2.0 * h)
                });
                point.add_to(&placed, nodes, &by, out);
            });
        }
    }

    /// The deepest point goes along -n of the shape: nothing of it turns with the point, since it is the deepest.
    fn add_depth_gradient(&self, weight: f64, x: &[Vec3], out: &mut [Vec3]) {
        let Some(placed) = self.placed(x) else { return };
        let mut deepest: Option<(f64, usize, Touched)> = None;
        for e in 0..self.triangles.len() {
            self.each_touched(&[], &placed, None, e, |point| {
                let d = self.distance(&point.arm).d;
                if deepest.as_ref().is_none_or(|(least, ..)| d < *least) {
                    deepest = Some((d, e, point));
                }
            });
        }
        if let Some((_, e, point)) = deepest {
            let by = -weight * self.distance(&point.arm).n;
            point.add_to(&placed, self.nodes(self.triangles[e].0), &by, out);
        }
    }

    fn touch(&self, at: &At, x: &[Vec3]) -> Option<Touch> {
        let mut touch = Touch::NONE;
        let Some(placed) = self.placed(x) else { return Some(touch) };
        let lag = self.friction.is_some().then_some(&placed);
        for e in 0..self.triangles.len() {
            let nearest = self.each_touched(at.history, &placed, lag, e, |point| {
                touch.force += placed.F_inverse.tr_mul(&point.force);
            });
            touch.gap = touch.gap.min(nearest);
        }
        Some(touch)
    }

    fn remembers(&self) -> bool {
        self.friction.is_some()
    }

    fn commit(&self, at: &At, x: &[Vec3], history: &mut [f64]) {
        let (Some(friction), Some(placed)) = (&self.friction, self.placed(x)) else { return };
        for e in 0..self.triangles.len() {
            let first = friction.first + REMEMBERED * POINTS.len() * e;
            history[first..first + REMEMBERED * POINTS.len()].fill(0.0);
            self.each_touched(at.history, &placed, None, e, |point| {
                let slack = self.origin(friction, at.history, e, point.q).and_then(|origin| {
                    Some(self.hold(friction.mu, &point.arm, &origin, &point.arm)?.traction / self.stiffness)
                });
                let origin = point.arm - slack.unwrap_or_default();
                let to = &mut history[first + REMEMBERED * point.q..][..REMEMBERED];
                to.copy_from_slice(&[origin.x, origin.y, origin.z, 1.0]);
            });
        }
    }
}
