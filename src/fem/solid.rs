//! Solid elements: gradients of F-based materials over points of integration.
//!
//! ```text
//! F_q = sum_a x_a (x) dN_a,   W = sum_q w_q psi(F_q),   g_a = sum_q w_q P_q dN_a,   K_ab = sum_q w_q dN_a . dP/dF . dN_b
//! ```
//!
//! Source: Bonet & Wood, "Nonlinear Continuum Mechanics for Finite Element Analysis", 2nd ed., 2008, chapter 9.

use std::ops::Range;

use pulp::Simd;

use super::batch::{AddGradient, AddHessian, MinDetF, Points};
use super::term::each_hessian;
use super::{At, Curvature, HessianSink, Kernel, Strain};
use crate::energy::{Energy, InvariantTangent, lane_by_lane};
use crate::math::lane::{Lane, Tensor};
use crate::math::{Mat3, Mat9, Vec3, clamp_eigenvalues};

/// What stands at a point of integration: a law that may know the point (its fibre, its past) and the inputs.
pub trait Material: Send + Sync {
    /// What it is, for reports.
    fn name(&self) -> &'static str;
    /// Energy density at point `p`, J/m3; +inf where undefined.
    fn psi(&self, at: &At, p: usize, F: &Mat3) -> f64;
    /// Energy density and first Piola-Kirchhoff stress (Pa).
    fn psi_and_P(&self, at: &At, p: usize, F: &Mat3) -> (f64, Mat3);
    /// Both in many points at once, `point` by lane; psi may be NaN where the law is not defined.
    #[inline(always)]
    fn psi_and_P_in<S: Simd>(
        &self,
        simd: S,
        at: &At,
        point: impl Fn(usize) -> usize,
        F: &Tensor<Lane<S>>,
    ) -> (Lane<S>, Tensor<Lane<S>>)
    where
        Self: Sized,
    {
        lane_by_lane(simd, F, |lane, F| self.psi_and_P(at, point(lane), F))
    }
    /// Tangent over `vec(F)`, Pa.
    fn dPdF(&self, at: &At, p: usize, F: &Mat3) -> Mat9;
    /// Whether `tangent_in` says the tangent.
    fn is_in_invariants(&self) -> bool {
        false
    }
    /// Tangent of a function of |F|^2 and J, in many points at once; asked only where `is_in_invariants`.
    #[inline(always)]
    fn tangent_in<S: Simd>(
        &self,
        simd: S,
        _at: &At,
        _F: &Tensor<Lane<S>>,
        _g: &Tensor<Lane<S>>,
    ) -> InvariantTangent<Lane<S>>
    where
        Self: Sized,
    {
        InvariantTangent::zero(Lane::splat(simd, 0.0))
    }
    /// Whether its tangent is the same at every F.
    fn is_quadratic(&self) -> bool {
        false
    }
    /// Whether its energy is strain energy.
    fn is_elastic(&self) -> bool {
        true
    }
    /// Which of `At::inputs` it reads; its stress is linear in them.
    fn inputs(&self) -> Range<usize> {
        0..0
    }
    /// Writes what point `p` has to remember of an accepted step into `history`, the list that `at.history` was.
    fn commit(&self, _at: &At, _p: usize, _F: &Mat3, _history: &mut [f64]) {}
    /// Whether `commit` writes anything.
    fn remembers(&self) -> bool {
        false
    }
}

impl Material for Box<dyn Material> {
    fn name(&self) -> &'static str {
        (**self).name()
    }
    fn psi(&self, at: &At, p: usize, F: &Mat3) -> f64 {
        (**self).psi(at, p, F)
    }
    fn psi_and_P(&self, at: &At, p: usize, F: &Mat3) -> (f64, Mat3) {
        (**self).psi_and_P(at, p, F)
    }
    fn dPdF(&self, at: &At, p: usize, F: &Mat3) -> Mat9 {
        (**self).dPdF(at, p, F)
    }
    fn is_quadratic(&self) -> bool {
        (**self).is_quadratic()
    }
    fn is_elastic(&self) -> bool {
        (**self).is_elastic()
    }
    fn inputs(&self) -> Range<usize> {
        (**self).inputs()
    }
    fn commit(&self, at: &At, p: usize, F: &Mat3, history: &mut [f64]) {
        (**self).commit(at, p, F, history);
    }
    fn remembers(&self) -> bool {
        (**self).remembers()
    }
}

/// An [`Energy`] as a material that is the same everywhere and has no past.
pub struct Elastic<M>(pub M);

impl<M: Energy> Material for Elastic<M> {
    fn name(&self) -> &'static str {
        M::NAME
    }
    fn psi(&self, _at: &At, _p: usize, F: &Mat3) -> f64 {
        self.0.psi(F)
    }
    fn psi_and_P(&self, _at: &At, _p: usize, F: &Mat3) -> (f64, Mat3) {
        self.0.psi_and_P(F)
    }
    #[inline(always)]
    fn psi_and_P_in<S: Simd>(
        &self,
        simd: S,
        _at: &At,
        _point: impl Fn(usize) -> usize,
        F: &Tensor<Lane<S>>,
    ) -> (Lane<S>, Tensor<Lane<S>>) {
        self.0.psi_and_P_in(simd, F)
    }
    fn dPdF(&self, _at: &At, _p: usize, F: &Mat3) -> Mat9 {
        self.0.dPdF(F)
    }
    fn is_in_invariants(&self) -> bool {
        M::IN_INVARIANTS
    }
    #[inline(always)]
    fn tangent_in<S: Simd>(
        &self,
        simd: S,
        _at: &At,
        F: &Tensor<Lane<S>>,
        g: &Tensor<Lane<S>>,
    ) -> InvariantTangent<Lane<S>> {
        self.0.tangent_in(simd, F, g)
    }
    fn is_quadratic(&self) -> bool {
        M::NAME == crate::energy::Linear::NAME
    }
}

/// Shape gradients (1/m) and weight (m3) at a point of integration.
pub struct Point<const N: usize> {
    /// dN_a/dX.
    pub dN: [Vec3; N],
    /// Share of the rest volume.
    pub w: f64,
}

/// Elements with N nodes and Q points of one material. Point `p = Q e + q`.
pub struct Solid<M, const N: usize, const Q: usize> {
    pub(super) material: M,
    pub(super) nodes: Vec<[u32; N]>,
    pub(super) points: Points<N, Q>,
}

impl<M: Material, const N: usize, const Q: usize> Solid<M, N, Q> {
    /// The given elements of rest positions `X`; `points` makes the points of one element from its nodes' places.
    ///
    /// Nodes are kept in descending order, so that the upper blocks of an element's Hessian are lower ones of the matrix,
    /// which stores these, and none has to be turned round.
    pub fn new(
        material: M,
        X: &[Vec3],
        elements: impl Iterator<Item = [u32; N]>,
        points: fn(&[Vec3; N]) -> [Point<N>; Q],
    ) -> Self {
        let mut nodes: Vec<[u32; N]> = elements.collect();
        let points = Points::new(nodes.iter_mut().map(|nodes| {
            let points = points(&nodes.map(|a| X[a as usize]));
            let mut order: [usize; N] = std::array::from_fn(|a| a);
            order.sort_unstable_by_key(|&a| std::cmp::Reverse(nodes[a]));
            *nodes = order.map(|a| nodes[a]);
            points.map(|p| Point { dN: order.map(|a| p.dN[a]), w: p.w })
        }));
        Solid { material, nodes, points }
    }
}

/// F; positions are taken relative to the first node, since the shape gradients sum to zero: a translation changes no bit
/// beyond that of the differences.
fn deformation<const N: usize>(dN: &[Vec3; N], x: &[Vec3; N]) -> Mat3 {
    let mut F = (x[1] - x[0]) * dN[1].transpose();
    for a in 2..N {
        F += (x[a] - x[0]) * dN[a].transpose();
    }
    F
}

impl<M: Material, const N: usize, const Q: usize> Kernel<N> for Solid<M, N, Q> {
    fn name(&self) -> &'static str {
        self.material.name()
    }
    fn len(&self) -> usize {
        self.nodes.len()
    }
    fn nodes(&self, e: usize) -> [u32; N] {
        self.nodes[e]
    }
    fn energy(&self, at: &At, e: usize, x: &[Vec3; N]) -> f64 {
        let psi =
            |(q, point): (usize, &Point<N>)| point.w * self.material.psi(at, Q * e + q, &deformation(&point.dN, x));
        self.points.of(e).iter().enumerate().map(psi).sum()
    }
    fn add_gradient(&self, at: &At, x: &[Vec3], g: &mut [Vec3]) -> f64 {
        AddGradient { solid: self, at, x, g }.run()
    }
    fn min_det_f(&self, x: &[Vec3]) -> f64 {
        if self.material.is_elastic() { MinDetF { solid: self, x }.run() } else { f64::INFINITY }
    }
    fn hessian(&self, at: &At, e: usize, x: &[Vec3; N], curvature: Curvature, upper: &mut [Mat3]) {
        upper.fill(Mat3::zeros());
        for (q, point) in self.points.of(e).iter().enumerate() {
            let mut H = self.material.dPdF(at, Q * e + q, &deformation(&point.dN, x));
            if curvature == Curvature::Projected {
                H = clamp_eigenvalues(&H);
            }
            let half = point.dN.map(|dN| contract(&H, &(point.w * dN)));
            let mut blocks = upper.iter_mut();
            for a in 0..N {
                for half_b in &half[a..] {
                    let block = blocks.next().expect("a block for each pair of nodes");
                    for (dN, slab) in point.dN[a].iter().zip(half_b) {
                        *block += *dN * slab;
                    }
                }
            }
        }
    }
    fn add_hessian(&self, at: &At, x: &[Vec3], curvature: Curvature, sink: &mut dyn HessianSink) {
        if curvature == Curvature::Exact && self.material.is_in_invariants() {
            AddHessian { solid: self, at, x, sink }.run();
        } else {
            each_hessian(self, at, x, curvature, sink);
        }
    }
    fn is_elastic(&self) -> bool {
        self.material.is_elastic()
    }
    fn strain(&self, at: &At, e: usize, x: &[Vec3; N]) -> Strain {
        if !self.material.is_elastic() {
            return Strain::NONE;
        }
        self.points.of(e).iter().enumerate().fold(Strain::NONE, |s, (q, point)| {
            let F = deformation(&point.dN, x);
            s.and(Strain {
                min_det_f: F.determinant(),
                max_stretch: largest_eigenvalue(&F.tr_mul(&F)).max(0.0).sqrt(),
                energy: point.w * self.material.psi(at, Q * e + q, &F),
            })
        })
    }
    fn is_quadratic(&self) -> bool {
        self.material.is_quadratic()
    }
    fn inputs(&self) -> Range<usize> {
        self.material.inputs()
    }
    fn remembers(&self) -> bool {
        self.material.remembers()
    }
    fn commit(&self, at: &At, e: usize, x: &[Vec3; N], history: &mut [f64]) {
        for (q, point) in self.points.of(e).iter().enumerate() {
            self.material.commit(at, Q * e + q, &deformation(&point.dN, x), history);
        }
    }
}

/// dP/dF . w as three 3x3 slabs, one for each column j of P.
fn contract(H: &Mat9, w: &Vec3) -> [Mat3; 3] {
    let slab = |j: usize, l: usize| H.fixed_view::<3, 3>(3 * j, 3 * l);
    [0, 1, 2].map(|j| slab(j, 0) * w[0] + slab(j, 1) * w[1] + slab(j, 2) * w[2])
}

/// Largest eigenvalue of a symmetric matrix, in closed form.
///
/// Source: Smith, "Eigenvalues of a symmetric 3 x 3 matrix", Comm. ACM 4(4), 1961.
fn largest_eigenvalue(A: &Mat3) -> f64 {
    let q = A.trace() / 3.0;
    let B = A - q * Mat3::identity();
    let p = (B.norm_squared() / 6.0).sqrt();
    if p <= f64::MIN_POSITIVE {
        return q;
    }
    let r = (0.5 * (B / p).determinant()).clamp(-1.0, 1.0);
    q + 2.0 * p * (r.acos() / 3.0).cos()
}
