//! Incomplete Cholesky factor by blocks of 3x3, without fill: the preconditioner of conjugate gradients.
//!
//! ```text
//! A ~ L L^T,   L on the pattern of A's lower triangle
//! column j:  L_jj L_jj^T = A_jj,   L_ij = A_ij L_jj^-T,   A_ik -= L_ij L_kj^T  where the pattern has (i, k)
//! ```
//!
//! Where a diagonal block is not positive definite, the whole is made anew with more on the diagonal.
//!
//! Source: Meijerink & van der Vorst, Math. Comp. 31, 1977; the shift after Manteuffel, Math. Comp. 34, 1980.

use crate::fem::{BlockMatrix, Pattern};
use crate::math::{Mat3, Vec3};

/// The first shift that is tried where none does not serve, in units of the diagonal, and its growth.
const FIRST_SHIFT: f64 = 1e-3;
const MORE: f64 = 4.0;
/// A shift that leaves nothing of the matrix but its diagonal.
const LARGEST_SHIFT: f64 = 1e3;

/// The factor, in single precision: it only has to be near.
pub struct Incomplete {
    /// Inverse of each diagonal block's factor, by columns.
    inverse: Vec<[f32; 9]>,
    /// The blocks below, in the pattern's order, by columns; diagonal places are unused.
    below: Vec<[f32; 9]>,
    /// The numbers as they are made.
    work: Vec<Mat3>,
}

impl Incomplete {
    pub fn new(pattern: &Pattern) -> Incomplete {
        Incomplete {
            inverse: vec![[0.0; 9]; pattern.n()],
            below: vec![[0.0; 9]; pattern.row.len()],
            work: vec![Mat3::zeros(); pattern.row.len()],
        }
    }

    pub fn memory(&self) -> usize {
        size_of_val(&self.inverse[..]) + size_of_val(&self.below[..]) + size_of_val(&self.work[..])
    }

    /// Takes the numbers of a matrix on the same pattern.
    ///
    /// # Errors
    /// The block at which even a diagonal that drowns all else is not positive definite.
    pub fn factor(&mut self, A: &BlockMatrix) -> Result<(), usize> {
        let mut shift = 0.0;
        loop {
            match self.factor_shifted(A, shift) {
                Err(_) if shift < LARGEST_SHIFT => shift = if shift == 0.0 { FIRST_SHIFT } else { MORE * shift },
                done => return done,
            }
        }
    }

    fn factor_shifted(&mut self, A: &BlockMatrix, shift: f64) -> Result<(), usize> {
        let Pattern { start, row } = &A.pattern;
        self.work.copy_from_slice(&A.blocks);
        for j in 0..A.pattern.n() {
            let (from, to) = (start[j] as usize, start[j + 1] as usize);
            for c in 0..3 {
                self.work[from][(c, c)] += shift * A.blocks[from][(c, c)];
            }
            let inverse = inverse_of_factor(&self.work[from]).ok_or(j)?;
            self.inverse[j] = single(&inverse);
            for k in from + 1..to {
                self.work[k] *= inverse.transpose();
                self.below[k] = single(&self.work[k]);
            }
            for k in from + 1..to {
                let L_kj = self.work[k].transpose();
                // Column row[k] of the pattern against what is left of this one, both ascending.
                let mut place = start[row[k] as usize] as usize;
                let end = start[row[k] as usize + 1] as usize;
                for i in k..to {
                    while place < end && row[place] < row[i] {
                        place += 1;
                    }
                    if place < end && row[place] == row[i] {
                        let update = self.work[i] * L_kj;
                        self.work[place] -= update;
                    }
                }
            }
        }
        Ok(())
    }

    /// `to = (L L^T)^-1 from`.
    pub fn apply(&self, pattern: &Pattern, from: &[Vec3], to: &mut [Vec3]) {
        let Pattern { start, row } = pattern;
        to.copy_from_slice(from);
        for j in 0..pattern.n() {
            let y = multiply(&self.inverse[j], &to[j]);
            to[j] = y;
            for k in start[j] as usize + 1..start[j + 1] as usize {
                to[row[k] as usize] -= multiply(&self.below[k], &y);
            }
        }
        for j in (0..pattern.n()).rev() {
            let mut sum = to[j];
            for k in start[j] as usize + 1..start[j + 1] as usize {
                sum -= multiply_transposed(&self.below[k], &to[row[k] as usize]);
            }
            to[j] = multiply_transposed(&self.inverse[j], &sum);
        }
    }
}

/// The inverse of the lower factor of a symmetric block; `None` where that is not positive definite.
fn inverse_of_factor(A: &Mat3) -> Option<Mat3> {
    let l00 = positive_root(A[(0, 0)])?;
    let (l10, l20) = (A[(1, 0)] / l00, A[(2, 0)] / l00);
    let l11 = positive_root(A[(1, 1)] - l10 * l10)?;
    let l21 = (A[(2, 1)] - l20 * l10) / l11;
    let l22 = positive_root(A[(2, 2)] - l20 * l20 - l21 * l21)?;
    let (m00, m11, m22) = (1.0 / l00, 1.0 / l11, 1.0 / l22);
    let (m10, m21) = (-l10 * m00 * m11, -l21 * m11 * m22);
    let m20 = -(l20 * m00 + l21 * m10) * m22;
    Some(Mat3::new(m00, 0.0, 0.0, m10, m11, 0.0, m20, m21, m22))
}

fn positive_root(value: f64) -> Option<f64> {
    (value > 0.0 && value.is_finite()).then(|| value.sqrt())
}

fn single(A: &Mat3) -> [f32; 9] {
    std::array::from_fn(|k| A.as_slice()[k] as f32)
}

#[inline(always)]
fn multiply(A: &[f32; 9], x: &Vec3) -> Vec3 {
    let row = |i: usize| f64::from(A[i]) * x.x + f64::from(A[i + 3]) * x.y + f64::from(A[i + 6]) * x.z;
    Vec3::new(row(0), row(1), row(2))
}

#[inline(always)]
fn multiply_transposed(A: &[f32; 9], x: &Vec3) -> Vec3 {
    let column = |j: usize| f64::from(A[3 * j]) * x.x + f64::from(A[3 * j + 1]) * x.y + f64::from(A[3 * j + 2]) * x.z;
    Vec3::new(column(0), column(1), column(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(n: usize, diagonal: f64) -> BlockMatrix {
        let mut A = BlockMatrix::zeros(Pattern::new(n, (1..n as u32).map(|i| (i, i - 1))));
        for j in 0..n as u32 {
            *A.at_mut(j, j) = diagonal * Mat3::identity() + Mat3::from_fn(|r, c| if r == c { 0.0 } else { 0.1 });
            if j > 0 {
                *A.at_mut(j, j - 1) = Mat3::from_fn(|r, c| -0.5 + 0.1 * (r as f64) - 0.2 * (c as f64));
            }
        }
        A
    }

    #[test]
    fn without_fill_the_factor_is_exact() {
        let A = chain(20, 4.0);
        let mut factor = Incomplete::new(&A.pattern);
        factor.factor(&A).expect("positive definite");
        let x: Vec<Vec3> = (0..20).map(|k| Vec3::new((k as f64).sin(), 1.0, -0.3 * k as f64)).collect();
        let mut b = vec![Vec3::zeros(); 20];
        A.multiply(&x, &mut b);
        let mut found = b.clone();
        factor.apply(&A.pattern, &b, &mut found);
        assert!(x.iter().zip(&found).all(|(x, f)| (x - f).norm() < 1e-5), "single precision");
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_gets_a_shift_or_a_refusal() {
        let A = chain(20, 1.2);
        let mut factor = Incomplete::new(&A.pattern);
        assert!(factor.factor_shifted(&A, 0.0).is_err(), "it breaks down as it is");
        factor.factor(&A).expect("with more on the diagonal it does not");
        let mut A = chain(20, 4.0);
        *A.at_mut(7, 7) = -Mat3::identity();
        assert_eq!(factor.factor(&A), Err(7));
    }
}
