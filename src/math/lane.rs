//! Numbers that formulas are written in: one double, or as many side by side as the machine computes at once.
//!
//! A formula over [`Real`] is written once and serves both a single point and a batch of elements.

use std::ops::{Add, Mul, Neg, Sub};

use pulp::Simd;

/// Most doubles that any machine computes at once; batches hold this many.
pub const BATCH: usize = 8;

/// A number with the operations that energies need.
pub trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
{
    /// `self a + b`, rounded once where the machine can.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// `f` of each number.
    fn map(self, f: impl Fn(f64) -> f64) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn mul_add(self, a: f64, b: f64) -> f64 {
        self * a + b
    }
    #[inline(always)]
    fn map(self, f: impl Fn(f64) -> f64) -> f64 {
        f(self)
    }
}

/// As many doubles as a vector of the machine holds.
#[derive(Clone, Copy)]
pub struct Lane<S: Simd> {
    simd: S,
    v: S::f64s,
}

impl<S: Simd> Lane<S> {
    /// The same number in every lane.
    #[inline(always)]
    pub fn splat(simd: S, value: f64) -> Self {
        Lane { simd, v: simd.splat_f64s(value) }
    }
    /// The `k`-th vector of a batch.
    #[inline(always)]
    pub fn load(simd: S, batch: &[f64; BATCH], k: usize) -> Self {
        Lane { simd, v: S::as_simd_f64s(batch).0[k] }
    }
    /// Writes the `k`-th vector of a batch.
    #[inline(always)]
    pub fn store(self, batch: &mut [f64; BATCH], k: usize) {
        S::as_mut_simd_f64s(batch).0[k] = self.v;
    }
    /// Sum of the lanes.
    #[inline(always)]
    pub fn sum(self) -> f64 {
        self.simd.reduce_sum_f64s(self.v)
    }
    /// Smallest of the lanes.
    #[inline(always)]
    pub fn least(self) -> f64 {
        self.simd.reduce_min_f64s(self.v)
    }
    /// Largest of the lanes; +inf if one is no number.
    #[inline(always)]
    pub fn largest(self) -> f64 {
        let mut lanes = [0.0; BATCH];
        self.store(&mut lanes, 0);
        lanes.iter().fold(f64::NEG_INFINITY, |m, v| if v.is_nan() { f64::INFINITY } else { m.max(*v) })
    }
    /// The smaller number of each lane.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Lane { v: self.simd.min_f64s(self.v, other.v), ..self }
    }
}

impl<S: Simd> Real for Lane<S> {
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        Lane { v: self.simd.mul_add_e_f64s(self.v, a.v, b.v), ..self }
    }
    #[inline(always)]
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        let mut lanes = [0.0; BATCH];
        self.store(&mut lanes, 0);
        for x in &mut lanes[..S::F64_LANES] {
            *x = f(*x);
        }
        Lane::load(self.simd, &lanes, 0)
    }
}

impl<S: Simd> Add for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Lane { v: self.simd.add_f64s(self.v, other.v), ..self }
    }
}
impl<S: Simd> Sub for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Lane { v: self.simd.sub_f64s(self.v, other.v), ..self }
    }
}
impl<S: Simd> Mul for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Lane { v: self.simd.mul_f64s(self.v, other.v), ..self }
    }
}
impl<S: Simd> Neg for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Lane { v: self.simd.neg_f64s(self.v), ..self }
    }
}
impl<S: Simd> Add<f64> for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: f64) -> Self {
        self + Lane::splat(self.simd, other)
    }
}
impl<S: Simd> Sub<f64> for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: f64) -> Self {
        self - Lane::splat(self.simd, other)
    }
}
impl<S: Simd> Mul<f64> for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        self * Lane::splat(self.simd, other)
    }
}

/// A 3x3 matrix of any numbers, by rows.
pub type Tensor<T> = [[T; 3]; 3];

/// A tensor by its entries, `tensor!(|i, j| ...)`. No closure: one that is not inlined does not know the machine's vectors.
macro_rules! tensor {
    (|$i:ident, $j:ident| $entry:expr) => {
        [
            [
                {
                    let ($i, $j) = (0, 0);
                    $entry
                },
                {
                    let ($i, $j) = (0, 1);
                    $entry
                },
                {
                    let ($i, $j) = (0, 2);
                    $entry
                },
            ],
            [
                {
                    let ($i, $j) = (1, 0);
                    $entry
                },
                {
                    let ($i, $j) = (1, 1);
                    $entry
                },
                {
                    let ($i, $j) = (1, 2);
                    $entry
                },
            ],
            [
                {
                    let ($i, $j) = (2, 0);
                    $entry
                },
                {
                    let ($i, $j) = (2, 1);
                    $entry
                },
                {
                    let ($i, $j) = (2, 2);
                    $entry
                },
            ],
        ]
    };
}
pub(crate) use tensor;

/// `dJ/dF`.
#[inline(always)]
pub fn cofactors<T: Real>(F: &Tensor<T>) -> Tensor<T> {
    tensor!(|i, j| {
        let (i1, i2, j1, j2): (usize, usize, usize, usize) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
        F[i1][j1].mul_add(F[i2][j2], -(F[i1][j2] * F[i2][j1]))
    })
}

/// J, from a row of F and of its cofactors.
#[inline(always)]
pub fn det<T: Real>(F: &Tensor<T>, cofactors: &Tensor<T>) -> T {
    dot3(&F[0], &cofactors[0])
}

/// `a . b`.
#[inline(always)]
pub fn dot3<T: Real>(a: &[T; 3], b: &[T; 3]) -> T {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

/// `F : F`.
#[inline(always)]
pub fn norm_squared<T: Real>(F: &Tensor<T>) -> T {
    dot3(&F[0], &F[0]) + dot3(&F[1], &F[1]) + dot3(&F[2], &F[2])
}

/// `F : I`.
#[inline(always)]
pub fn trace<T: Real>(F: &Tensor<T>) -> T {
    F[0][0] + F[1][1] + F[2][2]
}
