//! Terms: the summands of the energy that a step minimises, and their sums over elements.

use std::ops::Range;

use super::Difference;
use crate::math::lane::BATCH;
use crate::math::{Mat3, Vec3};

/// Everything a term sees besides the positions it is evaluated at.
#[derive(Clone, Copy)]
pub struct At<'a> {
    /// Time at the end of the step, s.
    pub t: f64,
    /// Length of the step, s; 0 while the start equilibrium is sought.
    pub dt: f64,
    /// All input values; a term knows where its own lie.
    pub inputs: &'a [f64],
    /// Coefficient of the inertia term, 1/s2; 0 where no time passes.
    pub inertia: f64,
    /// How the scheme makes rates of remembered values.
    pub difference: Difference,
    /// Where inertia alone would carry each node, m; empty in quasi-static scenes.
    pub x_tilde: &'a [Vec3],
    /// What terms remember of the steps before; a term knows where its own lies.
    pub history: &'a [f64],
    /// Positions at which follower loads take their direction, m.
    pub x_lag: &'a [Vec3],
}

impl At<'_> {
    /// Where no time passes and nothing is remembered, set or moved.
    pub const NOWHERE: At<'static> = At {
        t: 0.0,
        dt: 0.0,
        inputs: &[],
        inertia: 0.0,
        difference: Difference::STILL,
        x_tilde: &[],
        history: &[],
        x_lag: &[],
    };
}

/// Which Hessian is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Curvature {
    /// The true second derivative.
    Exact,
    /// With negative eigenvalues of each element's material tangent set to zero: always positive semi-definite.
    Projected,
}

/// How much the elements of a term are strained.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strain {
    /// Smallest det F.
    pub min_det_f: f64,
    /// Largest principal stretch.
    pub max_stretch: f64,
    /// Strain energy, J.
    pub energy: f64,
}

impl Strain {
    /// The strain of no element at all.
    pub const NONE: Strain = Strain { min_det_f: f64::INFINITY, max_stretch: 0.0, energy: 0.0 };

    /// The strain of both.
    pub fn and(self, other: Strain) -> Strain {
        Strain {
            min_det_f: self.min_det_f.min(other.min_det_f),
            max_stretch: self.max_stretch.max(other.max_stretch),
            energy: self.energy + other.energy,
        }
    }
}

/// How a surface touches a rigid shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Force of the surface on the shape, N.
    pub force: Vec3,
    /// Distance of its nearest point, m, or less where all are outside; negative inside.
    pub gap: f64,
}

impl Touch {
    /// No touch at all.
    pub const NONE: Touch = Touch { force: Vec3::new(0.0, 0.0, 0.0), gap: f64::INFINITY };

    /// Depth of the deepest point inside it, m; 0 if there is none.
    pub fn depth(&self) -> f64 {
        (-self.gap).max(0.0)
    }
}

/// Takes the Hessian blocks of one clique of nodes.
pub trait HessianSink {
    /// Adds the upper triangle of blocks of `nodes`, row by row: (0,0), (0,1), ... (1,1), (1,2), ...
    fn add(&mut self, nodes: &[u32], upper: &[Mat3]);

    /// The same for one of eight cliques side by side, whose blocks are given by their entries, column after column.
    fn add_lane(&mut self, nodes: &[u32], upper: &[[[f64; BATCH]; 9]], lane: usize) {
        let mut blocks = [Mat3::zeros(); MAX_BLOCKS];
        for (to, from) in blocks.iter_mut().zip(upper) {
            *to = Mat3::from_fn(|i, j| from[i + 3 * j][lane]);
        }
        self.add(nodes, &blocks[..upper.len()]);
    }

    /// Adds `scale c_a c_b^T` for every two of `nodes`: one clique, however many they are.
    fn add_outer(&mut self, nodes: &[u32], c: &[Vec3], scale: f64);
}

/// A summand of the energy. Terms own constants; what evolves lies in [`At`].
pub trait Term: Send + Sync {
    /// What it is, for reports.
    fn name(&self) -> &'static str;

    /// Energy at `x`, J; +inf where undefined.
    fn energy(&self, at: &At, x: &[Vec3]) -> f64;

    /// Adds the gradient to `g` (N) and returns the energy (J).
    fn add_gradient(&self, at: &At, x: &[Vec3], g: &mut [Vec3]) -> f64;

    /// Calls `clique` with every set of nodes that `add_hessian` will hand over, in the same order.
    fn couplings(&self, clique: &mut dyn FnMut(&[u32]));

    /// Hands the Hessian over, clique by clique.
    fn add_hessian(&self, at: &At, x: &[Vec3], curvature: Curvature, sink: &mut dyn HessianSink);

    /// Whether its force direction follows `At::x_lag` and must be brought up to date by an outer loop.
    fn is_lagged(&self) -> bool {
        false
    }

    /// Whether its Hessian is the same at every `x` and its gradient affine in `x`.
    fn is_quadratic(&self) -> bool {
        false
    }

    /// Which of `At::inputs` it reads; its gradient is linear in them.
    fn inputs(&self) -> Range<usize> {
        0..0
    }

    /// Adds to `out` the transposed derivative of its gradient by `At::x_lag`, applied to the nodal field `xi`.
    fn add_lag_transposed(&self, _at: &At, _xi: &[Vec3], _out: &mut [Vec3]) {}

    /// Smallest det F at `x`, for terms that have solid elements.
    fn min_det_f(&self, _x: &[Vec3]) -> f64 {
        f64::INFINITY
    }

    /// Strain at `x`, for terms that have elements.
    fn strain(&self, _at: &At, _x: &[Vec3]) -> Strain {
        Strain::NONE
    }

    /// Whether `strain` counts its energy; the gradient is then that of this energy.
    fn is_elastic(&self) -> bool {
        false
    }

    /// Adds `weight` times the gradient of its depth at `x` to a nodal field, for terms that are contacts.
    fn add_depth_gradient(&self, _weight: f64, _x: &[Vec3], _out: &mut [Vec3]) {}

    /// How it touches at `x`, for terms that are contacts.
    fn touch(&self, _at: &At, _x: &[Vec3]) -> Option<Touch> {
        None
    }

    /// Whether it remembers something of accepted steps.
    fn remembers(&self) -> bool {
        false
    }

    /// Writes its part of `history` after a step to `x` was accepted; `at.history` is still the old one.
    fn commit(&self, _at: &At, _x: &[Vec3], _history: &mut [f64]) {}
}

/// One element's share of a term: local nodes, 3x3 blocks, no global index.
pub trait Kernel<const N: usize>: Send + Sync {
    /// What it is, for reports.
    fn name(&self) -> &'static str;
    /// Number of elements.
    fn len(&self) -> usize;
    /// Whether there is no element.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Corner nodes of element `e`.
    fn nodes(&self, e: usize) -> [u32; N];
    /// Energy of element `e`, J.
    fn energy(&self, at: &At, e: usize, x: &[Vec3; N]) -> f64;
    /// Adds the gradient of all elements (N) and returns the energy (J), element after element.
    fn add_gradient(&self, at: &At, x: &[Vec3], g: &mut [Vec3]) -> f64;
    /// Smallest det F of all elements.
    fn min_det_f(&self, _x: &[Vec3]) -> f64 {
        f64::INFINITY
    }
    /// Upper triangle of Hessian blocks of element `e`, row by row, N/m.
    fn hessian(&self, at: &At, e: usize, x: &[Vec3; N], curvature: Curvature, upper: &mut [Mat3]);
    /// Hands the Hessians of all elements over, element after element.
    fn add_hessian(&self, at: &At, x: &[Vec3], curvature: Curvature, sink: &mut dyn HessianSink)
    where
        Self: Sized,
    {
        each_hessian(self, at, x, curvature, sink);
    }
    /// Whether `strain` counts its energy.
    fn is_elastic(&self) -> bool;
    /// Strain of element `e`.
    fn strain(&self, at: &At, e: usize, x: &[Vec3; N]) -> Strain;
    /// Whether the energy is quadratic in the positions.
    fn is_quadratic(&self) -> bool;
    /// Which of `At::inputs` it reads; its gradient is linear in them.
    fn inputs(&self) -> Range<usize> {
        0..0
    }
    /// Whether it remembers something of accepted steps.
    fn remembers(&self) -> bool {
        false
    }
    /// Writes what element `e` remembers into `history`.
    fn commit(&self, _at: &At, _e: usize, _x: &[Vec3; N], _history: &mut [f64]) {}
}

/// Upper-triangle blocks of the largest element, the ten-node tetrahedron.
pub(super) const MAX_BLOCKS: usize = 55;

/// Hessians made one element after the other.
pub(super) fn each_hessian<K: Kernel<N>, const N: usize>(
    kernel: &K,
    at: &At,
    x: &[Vec3],
    curvature: Curvature,
    sink: &mut dyn HessianSink,
) {
    let mut upper = [Mat3::zeros(); MAX_BLOCKS];
    let upper = &mut upper[..N * (N + 1) / 2];
    for e in 0..kernel.len() {
        let nodes = kernel.nodes(e);
        kernel.hessian(at, e, &nodes.map(|a| x[a as usize]), curvature, upper);
        sink.add(&nodes, upper);
    }
}

/// A kernel summed over its elements. Elements are visited in ascending order, so sums are reproducible to the bit.
pub struct OnElements<K, const N: usize>(pub K);

impl<K: Kernel<N>, const N: usize> OnElements<K, N> {
    fn gather(&self, e: usize, x: &[Vec3]) -> ([u32; N], [Vec3; N]) {
        let nodes = self.0.nodes(e);
        (nodes, nodes.map(|a| x[a as usize]))
    }
}

impl<K: Kernel<N>, const N: usize> Term for OnElements<K, N> {
    fn name(&self) -> &'static str {
        self.0.name()
    }

    fn energy(&self, at: &At, x: &[Vec3]) -> f64 {
        (0..self.0.len()).map(|e| self.0.energy(at, e, &self.gather(e, x).1)).sum()
    }

    fn add_gradient(&self, at: &At, x: &[Vec3], g: &mut [Vec3]) -> f64 {
        self.0.add_gradient(at, x, g)
    }

    fn min_det_f(&self, x: &[Vec3]) -> f64 {
        self.0.min_det_f(x)
    }

    fn couplings(&self, clique: &mut dyn FnMut(&[u32])) {
        for e in 0..self.0.len() {
            clique(&self.0.nodes(e));
        }
    }

    fn add_hessian(&self, at: &At, x: &[Vec3], curvature: Curvature, sink: &mut dyn HessianSink) {
        self.0.add_hessian(at, x, curvature, sink);
    }

    fn is_quadratic(&self) -> bool {
        self.0.is_quadratic()
    }

    fn inputs(&self) -> Range<usize> {
        self.0.inputs()
    }

    fn strain(&self, at: &At, x: &[Vec3]) -> Strain {
        (0..self.0.len()).fold(Strain::NONE, |s, e| s.and(self.0.strain(at, e, &self.gather(e, x).1)))
    }

    fn is_elastic(&self) -> bool {
        self.0.is_elastic()
    }

    fn remembers(&self) -> bool {
        self.0.remembers()
    }

    fn commit(&self, at: &At, x: &[Vec3], history: &mut [f64]) {
        for e in 0..self.0.len() {
            self.0.commit(at, e, &self.gather(e, x).1, history);
        }
    }
}
