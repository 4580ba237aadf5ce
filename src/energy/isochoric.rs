//! Laws written in the invariants of the volume-free part of F, and how they become functions of F.
//!
//! ```text
//! psi = W(I1b, I2b) + kappa/2 (J - 1)^2,   I1b = J^(-2/3) I1,   I2b = J^(-4/3) I2,   +inf for J <= 0
//! I1 = |F|^2,   I2 = (I1^2 - |F^T F|^2)/2
//! ```
//!
//! Source: Holzapfel, "Nonlinear Solid Mechanics", 2000, sections 6.4-6.5.

use pulp::Simd;

use super::{Energy, InvariantTangent};
use crate::math::lane::{BATCH, Lane, Real, Tensor, cofactors, det, norm_squared, tensor};
use crate::math::{Mat3, Mat9, cofactor, d2JdF2, outer};

/// First and second derivatives of a function of (I1b, I2b).
#[derive(Debug, Clone, Copy, Default)]
pub struct Slopes {
    /// By I1b, by I2b.
    pub first: [f64; 2],
    /// By I1b twice, by both, by I2b twice.
    pub second: [f64; 3],
}

/// The volume-free part of a law.
pub trait Isochoric: Send + Sync {
    /// Name by which a scene chooses it.
    const NAME: &'static str;
    /// Whether it does not depend on I2b.
    const OF_I1_ALONE: bool = false;
    /// W(I1b, I2b), J/m3; zero at (3, 3).
    fn W(&self, I1b: f64, I2b: f64) -> f64;
    /// Its derivatives, Pa.
    fn slopes(&self, I1b: f64, I2b: f64) -> Slopes;
}

/// A volume-free law with the bulk modulus `kappa`, Pa.
pub struct WithBulk<L> {
    /// The volume-free part.
    pub law: L,
    /// Bulk modulus, Pa.
    pub kappa: f64,
}

/// An invariant scaled by a power of J, with its derivatives by F.
struct Scaled {
    value: f64,
    first: Mat3,
    second: Option<Mat9>,
}

fn scaled(J: f64, power: f64, I: f64, dI: &Mat3, g: &Mat3, second: Option<(&Mat9, &Mat9)>) -> Scaled {
    let [j0, j1, j2] = [J.powf(power), power * J.powf(power - 1.0), power * (power - 1.0) * J.powf(power - 2.0)];
    Scaled {
        value: j0 * I,
        first: j0 * dI + j1 * I * g,
        second: second.map(|(d2I, d2J)| {
            let cross = outer(dI, g);
            j0 * d2I + j1 * (cross + cross.transpose()) + j2 * I * outer(g, g) + j1 * I * d2J
        }),
    }
}

/// I1b and I2b at F with J > 0.
fn invariants(F: &Mat3, J: f64, with_second: bool) -> [Scaled; 2] {
    let (C, g) = (F.tr_mul(F), cofactor(F));
    let I1 = C.trace();
    let I2 = 0.5 * (I1 * I1 - C.norm_squared());
    let (dI1, dI2) = (2.0 * F, 2.0 * (I1 * F - F * C));
    let second = with_second.then(|| (2.0 * Mat9::identity(), d2I2(F, &C, I1), d2JdF2(F)));
    [
        scaled(J, -2.0 / 3.0, I1, &dI1, &g, second.as_ref().map(|(a, _, j)| (a, j))),
        scaled(J, -4.0 / 3.0, I2, &dI2, &g, second.as_ref().map(|(_, b, j)| (b, j))),
    ]
}

/// d2I2/dF2 = 2 (2 F (x) F + I1 1 - d(F F^T F)/dF).
fn d2I2(F: &Mat3, C: &Mat3, I1: f64) -> Mat9 {
    let B = F * F.transpose();
    let mut H = 2.0 * outer(F, F) + I1 * Mat9::identity();
    for j in 0..3 {
        for i in 0..3 {
            for n in 0..3 {
                for m in 0..3 {
                    let mut h = F[(i, n)] * F[(m, j)];
                    if i == m {
                        h += C[(n, j)];
                    }
                    if j == n {
                        h += B[(i, m)];
                    }
                    H[(i + 3 * j, m + 3 * n)] -= h;
                }
            }
        }
    }
    2.0 * H
}

impl<L: Isochoric> Energy for WithBulk<L> {
    const NAME: &'static str = L::NAME;

    fn psi(&self, F: &Mat3) -> f64 {
        let J = F.determinant();
        if J <= 0.0 {
            return f64::INFINITY;
        }
        let [I1b, I2b] = invariants(F, J, false);
        self.law.W(I1b.value, I2b.value) + 0.5 * self.kappa * (J - 1.0).powi(2)
    }
    fn P(&self, F: &Mat3) -> Mat3 {
        let J = F.determinant();
        let [I1b, I2b] = invariants(F, J, false);
        let [w1, w2] = self.law.slopes(I1b.value, I2b.value).first;
        w1 * I1b.first + w2 * I2b.first + self.kappa * (J - 1.0) * cofactor(F)
    }
    fn dPdF(&self, F: &Mat3) -> Mat9 {
        let (J, g) = (F.determinant(), cofactor(F));
        let [a, b] = invariants(F, J, true);
        let Slopes { first: [w1, w2], second: [w11, w12, w22] } = self.law.slopes(a.value, b.value);
        let mixed = outer(&a.first, &b.first);
        let second = |s: &Scaled| s.second.expect("asked for above");
        w1 * second(&a)
            + w2 * second(&b)
            + w11 * outer(&a.first, &a.first)
            + w12 * (mixed + mixed.transpose())
            + w22 * outer(&b.first, &b.first)
            + self.kappa * (outer(&g, &g) + (J - 1.0) * d2JdF2(F))
    }
    #[inline(always)]
    fn psi_and_P_in<S: Simd>(&self, simd: S, F: &Tensor<Lane<S>>) -> (Lane<S>, Tensor<Lane<S>>) {
        let g = cofactors(F);
        let (J, I1) = (det(F, &g), norm_squared(F));
        let C = tensor!(|i, j| F[0][i].mul_add(F[0][j], F[1][i].mul_add(F[1][j], F[2][i] * F[2][j])));
        let I2 = (I1 * I1 - norm_squared(&C)) * 0.5;
        // psi, and P = 2 a F + 2 b (I1 F - F C) + c g.
        let (mut psi, mut a, mut b, mut c) = ([0.0; BATCH], [0.0; BATCH], [0.0; BATCH], [0.0; BATCH]);
        for (lane, [J, I1, I2]) in lanes([J, I1, I2]).into_iter().take(S::F64_LANES).enumerate() {
            if J <= 0.0 {
                psi[lane] = f64::INFINITY;
                continue;
            }
            let j = J.cbrt().powi(-2);
            let (I1b, I2b) = (j * I1, j * j * I2);
            let [w1, w2] = self.law.slopes(I1b, I2b).first;
            psi[lane] = self.law.W(I1b, I2b) + 0.5 * self.kappa * (J - 1.0).powi(2);
            (a[lane], b[lane]) = (w1 * j, w2 * j * j);
            c[lane] = self.kappa * (J - 1.0) - (2.0 / 3.0 * w1 * I1b + 4.0 / 3.0 * w2 * I2b) / J;
        }
        let [psi, a, b, c] = [psi, a, b, c].map(|v| Lane::load(simd, &v, 0));
        let (of_F, of_FC) = ((b.mul_add(I1, a)) * 2.0, b * -2.0);
        let FC = tensor!(|i, j| F[i][0].mul_add(C[0][j], F[i][1].mul_add(C[1][j], F[i][2] * C[2][j])));
        (psi, tensor!(|i, j| of_F.mul_add(F[i][j], of_FC.mul_add(FC[i][j], c * g[i][j]))))
    }
    const IN_INVARIANTS: bool = L::OF_I1_ALONE;
    #[inline(always)]
    fn tangent_in<S: Simd>(&self, simd: S, F: &Tensor<Lane<S>>, g: &Tensor<Lane<S>>) -> InvariantTangent<Lane<S>> {
        let (J, I1) = (det(F, g), norm_squared(F));
        let mut out = [[0.0; BATCH]; 5];
        for (lane, [J, I1]) in lanes([J, I1]).into_iter().take(S::F64_LANES).enumerate() {
            let j = J.cbrt().powi(-2);
            let I1b = j * I1;
            let Slopes { first: [w, _], second: [w2, ..] } = self.law.slopes(I1b, 0.0);
            // By J at fixed I1.
            let (d1, d2) = (-2.0 / 3.0 * I1b / J, 10.0 / 9.0 * I1b / (J * J));
            out[0][lane] = 2.0 * w * j;
            out[1][lane] = 4.0 * w2 * j * j;
            out[2][lane] = 2.0 * (w2 * j * d1 - 2.0 / 3.0 * w * j / J);
            out[3][lane] = w2 * d1 * d1 + w * d2 + self.kappa;
            out[4][lane] = w * d1 + self.kappa * (J - 1.0);
        }
        let [one, ff, fg, gg, spin] = out.map(|v| Lane::load(simd, &v, 0));
        InvariantTangent { one, ff, fg, gg, spin }
    }
}

/// The numbers of each lane.
#[inline(always)]
fn lanes<S: Simd, const N: usize>(of: [Lane<S>; N]) -> [[f64; N]; BATCH] {
    let mut stored = [[0.0; BATCH]; N];
    for (to, from) in stored.iter_mut().zip(of) {
        from.store(to, 0);
    }
    std::array::from_fn(|lane| std::array::from_fn(|n| stored[n][lane]))
}
