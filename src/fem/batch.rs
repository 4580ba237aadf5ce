//! Elements side by side: shape gradients in batches of eight, and the loops over them.

use pulp::{Arch, Simd, WithSimd};

use super::solid::{Material, Point};
use super::term::MAX_BLOCKS;
use super::{At, HessianSink, Solid};
use crate::energy::InvariantTangent;
use crate::math::Vec3;
use crate::math::lane::{BATCH, Lane, Real, Tensor, cofactors, det, dot3, tensor};

/// Shape gradients and weights of elements with N nodes and Q points, eight elements side by side. The gradient of the
/// first node is minus the sum of the others'.
pub(super) struct Points<const N: usize, const Q: usize> {
    /// Of each batch and point: the weight, then dN_a for a = 1..N.
    values: Vec<[f64; BATCH]>,
}

impl<const N: usize, const Q: usize> Points<N, Q> {
    /// Numbers of a point.
    const LEN: usize = 1 + 3 * (N - 1);

    /// The given points, element by element; a last batch is filled up with copies of no weight.
    pub fn new(elements: impl ExactSizeIterator<Item = [Point<N>; Q]>) -> Self {
        let n = elements.len();
        let mut values = vec![[0.0; BATCH]; n.div_ceil(BATCH) * Q * Self::LEN];
        for (e, points) in elements.enumerate() {
            let lanes = if e + 1 == n { e % BATCH..BATCH } else { e % BATCH..e % BATCH + 1 };
            for (q, point) in points.iter().enumerate() {
                let to = &mut values[(e / BATCH * Q + q) * Self::LEN..][..Self::LEN];
                for lane in lanes.clone() {
                    to[0][lane] = if lane == e % BATCH { point.w } else { 0.0 };
                    for (to, dN) in to[1..].iter_mut().zip(point.dN[1..].iter().flatten()) {
                        to[lane] = *dN;
                    }
                }
            }
        }
        Points { values }
    }

    /// The points of one element.
    pub fn of(&self, e: usize) -> [Point<N>; Q] {
        std::array::from_fn(|q| {
            let from = &self.values[(e / BATCH * Q + q) * Self::LEN..][..Self::LEN];
            let mut dN = [Vec3::zeros(); N];
            for a in 1..N {
                dN[a] = Vec3::from_fn(|c, _| from[3 * a - 2 + c][e % BATCH]);
                dN[0] -= dN[a];
            }
            Point { dN, w: from[0][e % BATCH] }
        })
    }
}

/// What a loop over batches sees of each vector of elements.
struct Vector<'a, S: Simd, const N: usize, const Q: usize> {
    simd: S,
    /// Which vector of the batch it is.
    k: usize,
    /// x_a - x_0 for a = 1..N, by coordinates.
    edges: [[Lane<S>; 3]; N],
    points: &'a [[f64; BATCH]],
}

impl<'a, S: Simd, const N: usize, const Q: usize> Vector<'a, S, N, Q> {
    // Loops instead of maps: what is not inlined here does not know the machine's vectors.
    #[inline(always)]
    fn new(simd: S, k: usize, places: &[[[f64; BATCH]; 3]; N], points: &'a [[f64; BATCH]]) -> Self {
        let mut edges = [[Lane::splat(simd, 0.0); 3]; N];
        for a in 1..N {
            for c in 0..3 {
                edges[a][c] = Lane::load(simd, &places[a][c], k) - Lane::load(simd, &places[0][c], k);
            }
        }
        Vector { simd, k, edges, points }
    }
    #[inline(always)]
    fn dN(&self, q: usize, a: usize) -> [Lane<S>; 3] {
        let first = q * Points::<N, Q>::LEN + 3 * a - 2;
        let mut dN = [Lane::splat(self.simd, 0.0); 3];
        for (dN, values) in dN.iter_mut().zip(&self.points[first..first + 3]) {
            *dN = Lane::load(self.simd, values, self.k);
        }
        dN
    }
    #[inline(always)]
    fn w(&self, q: usize) -> Lane<S> {
        Lane::load(self.simd, &self.points[q * Points::<N, Q>::LEN], self.k)
    }
    /// F at a point.
    #[inline(always)]
    fn F(&self, q: usize) -> Tensor<Lane<S>> {
        let dN = self.dN(q, 1);
        let mut F = tensor!(|i, j| self.edges[1][i] * dN[j]);
        for a in 2..N {
            let dN = self.dN(q, a);
            F = tensor!(|i, j| self.edges[a][i].mul_add(dN[j], F[i][j]));
        }
        F
    }
}

/// Positions of the nodes of a batch, by node and coordinate.
#[inline(always)]
fn gather<const N: usize>(nodes: &[[u32; N]], x: &[Vec3]) -> [[[f64; BATCH]; 3]; N] {
    let mut places = [[[0.0; BATCH]; 3]; N];
    for lane in 0..BATCH {
        // A last batch repeats its last element.
        let nodes = &nodes[lane.min(nodes.len() - 1)];
        for (place, &a) in places.iter_mut().zip(nodes) {
            let x = &x[a as usize];
            for c in 0..3 {
                place[c][lane] = x[c];
            }
        }
    }
    places
}

/// Adds the gradient of all elements to `g` and returns the energy.
pub(super) struct AddGradient<'a, M, const N: usize, const Q: usize> {
    pub solid: &'a Solid<M, N, Q>,
    pub at: &'a At<'a>,
    pub x: &'a [Vec3],
    pub g: &'a mut [Vec3],
}

impl<M: Material, const N: usize, const Q: usize> AddGradient<'_, M, N, Q> {
    pub fn run(self) -> f64 {
        let energy = Arch::new().dispatch(self);
        if energy.is_nan() { f64::INFINITY } else { energy }
    }
}

impl<M: Material, const N: usize, const Q: usize> WithSimd for AddGradient<'_, M, N, Q> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let AddGradient { solid, at, x, g } = self;
        let mut energy = Lane::splat(simd, 0.0);
        let mut forces = [[[0.0; BATCH]; 3]; N];
        let batches = solid.nodes.chunks(BATCH).zip(solid.points.values.chunks_exact(Q * Points::<N, Q>::LEN));
        for (b, (nodes, points)) in batches.enumerate() {
            let places = gather(nodes, x);
            for k in 0..BATCH / S::F64_LANES {
                let vector = Vector::<S, N, Q>::new(simd, k, &places, points);
                let mut f = [[Lane::splat(simd, 0.0); 3]; N];
                for q in 0..Q {
                    // Points of elements that only fill up a batch are those of its last one.
                    let last = b * BATCH + nodes.len() - 1;
                    let point = |lane: usize| (b * BATCH + k * S::F64_LANES + lane).min(last) * Q + q;
                    let (psi, P) = solid.material.psi_and_P_in(simd, at, point, &vector.F(q));
                    let w = vector.w(q);
                    energy = w.mul_add(psi, energy);
                    let wP = tensor!(|i, j| w * P[i][j]);
                    for a in 1..N {
                        let dN = vector.dN(q, a);
                        for c in 0..3 {
                            let share = dot3(&wP[c], &dN);
                            f[a][c] = f[a][c] + share;
                            f[0][c] = f[0][c] - share;
                        }
                    }
                }
                for (to, f) in forces.as_flattened_mut().iter_mut().zip(f.as_flattened()) {
                    f.store(to, k);
                }
            }
            for (lane, nodes) in nodes.iter().enumerate() {
                for (&a, f) in nodes.iter().zip(&forces) {
                    let g = &mut g[a as usize];
                    for c in 0..3 {
                        g[c] += f[c][lane];
                    }
                }
            }
        }
        energy.sum()
    }
}

/// Hands the Hessians of all elements to `sink`, for laws of |F|^2 and J:
///
/// ```text
/// K_ab = sum_q w (one (dN_a . dN_b) 1 + ff Fa Fb^T + fg (Fa gb^T + ga Fb^T) + gg ga gb^T + spin [F (dN_a x dN_b)]x)
/// Fa = F dN_a,   ga = g dN_a,   ([v]x)_ik = eps_ikm v_m
/// ```
pub(super) struct AddHessian<'a, M, const N: usize, const Q: usize> {
    pub solid: &'a Solid<M, N, Q>,
    pub at: &'a At<'a>,
    pub x: &'a [Vec3],
    pub sink: &'a mut dyn HessianSink,
}

impl<M: Material, const N: usize, const Q: usize> AddHessian<'_, M, N, Q> {
    pub fn run(self) {
        Arch::new().dispatch(self);
    }
}

/// `A v`.
#[inline(always)]
fn apply<T: Real>(A: &Tensor<T>, v: &[T; 3]) -> [T; 3] {
    [dot3(&A[0], v), dot3(&A[1], v), dot3(&A[2], v)]
}

/// `a x b`.
#[inline(always)]
fn cross<T: Real>(a: &[T; 3], b: &[T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

impl<M: Material, const N: usize, const Q: usize> WithSimd for AddHessian<'_, M, N, Q> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let AddHessian { solid, at, x, sink } = self;
        // Blocks of a batch by entry.
        let mut blocks = [[[0.0; BATCH]; 9]; MAX_BLOCKS];
        let n_blocks = N * (N + 1) / 2;
        let batches = solid.nodes.chunks(BATCH).zip(solid.points.values.chunks_exact(Q * Points::<N, Q>::LEN));
        for (nodes, points) in batches {
            let places = gather(nodes, x);
            for k in 0..BATCH / S::F64_LANES {
                let vector = Vector::<S, N, Q>::new(simd, k, &places, points);
                for q in 0..Q {
                    let F = vector.F(q);
                    let g = cofactors(&F);
                    let w = vector.w(q);
                    let t = solid.material.tangent_in(simd, at, &F, &g);
                    let InvariantTangent { one, ff, fg, gg, spin } =
                        InvariantTangent { one: w * t.one, ff: w * t.ff, fg: w * t.fg, gg: w * t.gg, spin: w * t.spin };
                    let mut dN = [[Lane::splat(simd, 0.0); 3]; N];
                    let (first, others) = dN.split_first_mut().expect("an element has nodes");
                    for (a, dN) in (1..).zip(others) {
                        *dN = vector.dN(q, a);
                        for c in 0..3 {
                            first[c] = first[c] - dN[c];
                        }
                    }
                    let mut along = [([Lane::splat(simd, 0.0); 3], [Lane::splat(simd, 0.0); 3]); N];
                    for (along, dN) in along.iter_mut().zip(&dN) {
                        *along = (apply(&F, dN), apply(&g, dN));
                    }
                    let mut block = blocks.iter_mut();
                    for a in 0..N {
                        let (Fa, ga) = &along[a];
                        let mut rows = [([Lane::splat(simd, 0.0); 2]); 3];
                        for (row, (Fa, ga)) in rows.iter_mut().zip(Fa.iter().zip(ga)) {
                            *row = [ff.mul_add(*Fa, fg * *ga), fg.mul_add(*Fa, gg * *ga)];
                        }
                        for b in a..N {
                            let (Fb, gb) = &along[b];
                            let block = block.next().expect("a block for each pair of nodes");
                            let diagonal = one * dot3(&dN[a], &dN[b]);
                            let v = apply(&F, &cross(&dN[a], &dN[b]));
                            let v = [spin * v[0], spin * v[1], spin * v[2]];
                            for i in 0..3 {
                                for j in 0..3 {
                                    let mut entry = rows[i][0].mul_add(Fb[j], rows[i][1] * gb[j]);
                                    if i == j {
                                        entry = entry + diagonal;
                                    } else if (i + 1) % 3 == j {
                                        entry = entry + v[(j + 1) % 3];
                                    } else {
                                        entry = entry - v[(i + 1) % 3];
                                    }
                                    let to = &mut block[i + 3 * j];
                                    if q > 0 {
                                        entry = entry + Lane::load(simd, to, k);
                                    }
                                    entry.store(to, k);
                                }
                            }
                        }
                    }
                }
            }
            for (lane, nodes) in nodes.iter().enumerate() {
                sink.add_lane(nodes, &blocks[..n_blocks], lane);
            }
        }
    }
}

/// The smallest det F of all points.
pub(super) struct MinDetF<'a, M, const N: usize, const Q: usize> {
    pub solid: &'a Solid<M, N, Q>,
    pub x: &'a [Vec3],
}

impl<M: Material, const N: usize, const Q: usize> MinDetF<'_, M, N, Q> {
    pub fn run(self) -> f64 {
        Arch::new().dispatch(self)
    }
}

impl<M: Material, const N: usize, const Q: usize> WithSimd for MinDetF<'_, M, N, Q> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let MinDetF { solid, x } = self;
        let mut least = Lane::splat(simd, f64::INFINITY);
        let batches = solid.nodes.chunks(BATCH).zip(solid.points.values.chunks_exact(Q * Points::<N, Q>::LEN));
        for (nodes, points) in batches {
            let places = gather(nodes, x);
            for k in 0..BATCH / S::F64_LANES {
                let vector = Vector::<S, N, Q>::new(simd, k, &places, points);
                for q in 0..Q {
                    let F = vector.F(q);
                    least = least.min(det(&F, &cofactors(&F)));
                }
            }
        }
        least.least()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::{Lame, NeoHookean};
    use crate::fem::{Elastic, tet4_points};

    #[test]
    fn every_width_of_vectors_finds_the_same_forces() {
        let mut random = (0_u32..).map(|k| 0.1 * (f64::from(k) * 12.9898).sin());
        let mut noise = move || random.next().expect("endless");
        let X: Vec<Vec3> = (0..4).map(|a| Vec3::ith(a.min(2), if a < 3 { 1.0 } else { 0.0 })).collect();
        let X: Vec<Vec3> =
            (0..11).flat_map(|_| X.iter().map(|X| X + Vec3::from_fn(|_, _| noise())).collect::<Vec<_>>()).collect();
        // Eleven elements: one full batch and one that is filled up.
        let nodes = (0..11_u32).map(|e| [4 * e + 3, 4 * e, 4 * e + 1, 4 * e + 2]);
        let law = NeoHookean(Lame::new(15e3, 0.45));
        let solid = Solid::new(Elastic(law), &X, nodes, tet4_points);
        let x: Vec<Vec3> = X.iter().map(|X| X + Vec3::from_fn(|_, _| noise())).collect();
        let forces = |run: &dyn Fn(AddGradient<Elastic<NeoHookean>, 4, 1>) -> f64| {
            let mut g = vec![Vec3::zeros(); X.len()];
            let energy = run(AddGradient { solid: &solid, at: &At::NOWHERE, x: &x, g: &mut g });
            (energy, g)
        };
        let same = |(energy, g): (f64, Vec<Vec3>)| {
            let (wanted, by_one) = forces(&|loop_| loop_.with_simd(pulp::Scalar::new()));
            assert!((energy - wanted).abs() < 1e-12 * wanted.abs());
            assert!(g.iter().zip(&by_one).all(|(g, one)| (g - one).norm() < 1e-9));
        };
        same(forces(&|loop_| loop_.run()));
        #[cfg(target_arch = "x86_64")]
        if let Some(simd) = pulp::x86::V3::try_new() {
            same(forces(&|loop_| pulp::Simd::vectorize(simd, loop_)));
        }
    }
}
