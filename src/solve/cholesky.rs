//! Sparse Cholesky factorisation; the symbolic part is kept for the life of the pattern.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par, Side};

use super::panels::Panels;
use super::{LinearSolver, Precision, SolveError, elimination};
use crate::fem::{BlockMatrix, Elimination, Pattern};
use crate::math::Vec3;

/// Most entries of a factor: 12 GB of numbers.
pub const MOST_ENTRIES: usize = 1_500_000_000;

/// Supernodal Cholesky on one thread, solved with on one or two; the same bits whatever their number and the machine's load.
/// The factor is always made in double precision, so what is called positive definite does not depend on how it is solved
/// with.
pub struct Cholesky {
    scalar: SymbolicSparseColMat<u32>,
    values: Vec<f64>,
    symbolic: SymbolicCholesky<u32>,
    factor: Vec<f64>,
    rhs: Vec<f64>,
    scratch: MemBuffer,
    /// The factor for solves in single precision.
    panels: Option<Panels>,
}

impl Cholesky {
    /// Orders the pattern unless its order is `known`, analyses it, and allocates everything later calls need. With two
    /// `threads` a second one helps to solve in single precision.
    ///
    /// # Errors
    /// [`SolveError::TooLarge`] for a factor of more entries than `limit`.
    pub fn analyse(
        pattern: &Pattern,
        known: Option<&Elimination>,
        precision: Precision,
        threads: usize,
        limit: usize,
    ) -> Result<Cholesky, SolveError> {
        let n = 3 * pattern.n();
        let scalar = scalar_pattern(pattern);
        let order = elimination(pattern, known).map(|blocks| {
            let new_to_old: Vec<u32> = blocks.iter().flat_map(|b| [3 * b, 3 * b + 1, 3 * b + 2]).collect();
            let mut old_to_new = vec![0u32; n];
            for (new, &old) in new_to_old.iter().enumerate() {
                old_to_new[old as usize] = new as u32;
            }
            (new_to_old, old_to_new)
        });
        let ordering = match &order {
            Some((forward, inverse)) => SymmetricOrdering::Custom(PermRef::new_checked(forward, inverse, n)),
            None => SymmetricOrdering::Amd,
        };
        let too_large = |entries: usize| SolveError::TooLarge { unknowns: n, entries, limit };
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let symbolic = factorize_symbolic_cholesky(scalar.as_ref(), Side::Lower, ordering, params)
            .map_err(|_| too_large(u32::MAX as usize))?;
        if symbolic.len_val() > limit {
            return Err(too_large(symbolic.len_val()));
        }
        let scratch = StackReq::or(
            symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default()),
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
        );
        // Asked for at once and let go, since vectors that do not fit end the process.
        let single = if precision == Precision::Single { size_of::<f32>() } else { 0 };
        let bytes = symbolic.len_val().saturating_mul(size_of::<f64>() + single).saturating_add(scratch.size_bytes());
        if Vec::<u8>::new().try_reserve_exact(bytes).is_err() {
            return Err(SolveError::Memory { unknowns: n, bytes });
        }
        let panels = match symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(raw) if precision == Precision::Single => Some(Panels::new(raw, threads)),
            _ => None,
        };
        Ok(Cholesky {
            panels,
            values: vec![0.0; scalar.row_idx().len()],
            factor: vec![0.0; symbolic.len_val()],
            rhs: vec![0.0; n],
            scratch: MemBuffer::new(scratch),
            scalar,
            symbolic,
        })
    }
}

impl LinearSolver for Cholesky {
    fn factor(&mut self, A: &BlockMatrix) -> Result<(), usize> {
        scalar_values(A, &mut self.values);
        let A = SparseColMatRef::new(self.scalar.as_ref(), &self.values);
        self.symbolic
            .factorize_numeric_llt(
                &mut self.factor,
                A,
                Side::Lower,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut self.scratch),
                Default::default(),
            )
            .map(drop)
            .map_err(|e| match e {
                faer::linalg::cholesky::llt::factor::LltError::NonPositivePivot { index } => index / 3,
            })?;
        if let (Some(panels), SymbolicCholeskyRaw::Supernodal(raw)) = (&mut self.panels, self.symbolic.raw()) {
            panels.take(raw, &self.factor);
        }
        Ok(())
    }

    fn solve(&mut self, b: &mut [Vec3]) {
        // Single precision has fewer powers of ten than forces may span.
        let scale = b.iter().flat_map(|b| b.iter()).fold(f64::MIN_POSITIVE, |scale, b| scale.max(b.abs()));
        let (Some(panels), Some(order), true) = (&mut self.panels, self.symbolic.perm(), scale.is_finite()) else {
            return self.solve_in_double(b);
        };
        let (old, new) = order.arrays();
        let x = panels.solve(|rhs| {
            for (rhs, &old) in rhs.iter_mut().zip(old) {
                *rhs = (b[old as usize / 3][old as usize % 3] / scale) as f32;
            }
        });
        for (b, new) in b.iter_mut().zip(new.as_chunks::<3>().0) {
            *b = Vec3::from_fn(|c, _| scale * f64::from(x[new[c] as usize]));
        }
    }

    fn solve_in_double(&mut self, b: &mut [Vec3]) {
        for (to, from) in self.rhs.chunks_exact_mut(3).zip(&*b) {
            to.copy_from_slice(from.as_slice());
        }
        let n = self.rhs.len();
        LltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut self.rhs, n, 1),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
        for (to, from) in b.iter_mut().zip(self.rhs.chunks_exact(3)) {
            to.copy_from_slice(from);
        }
    }

    fn memory(&self) -> usize {
        let scalar = self.values.len() * (size_of::<f64>() + size_of::<u32>());
        size_of_val(&self.factor[..]) + scalar + self.panels.as_ref().map_or(0, Panels::memory)
    }

    fn factor_len(&self) -> usize {
        self.factor.len()
    }
}

/// Scalar lower triangle of a block pattern, columns ascending.
fn scalar_pattern(pattern: &Pattern) -> SymbolicSparseColMat<u32> {
    let n = pattern.n();
    let mut start = vec![0u32; 3 * n + 1];
    let mut row = Vec::with_capacity(9 * pattern.row.len());
    for j in 0..n {
        let below = &pattern.row[pattern.start[j] as usize + 1..pattern.start[j + 1] as usize];
        for c in 0..3u32 {
            row.extend((c..3).map(|r| 3 * j as u32 + r));
            row.extend(below.iter().flat_map(|i| [3 * i, 3 * i + 1, 3 * i + 2]));
            start[3 * j + c as usize + 1] = row.len() as u32;
        }
    }
    SymbolicSparseColMat::new_checked(3 * n, 3 * n, start, None, row)
}

/// The numbers on [`scalar_pattern`], in its order.
fn scalar_values(A: &BlockMatrix, values: &mut [f64]) {
    let mut k = 0;
    for j in 0..A.pattern.n() {
        let (from, to) = (A.pattern.start[j] as usize, A.pattern.start[j + 1] as usize);
        for c in 0..3 {
            let diagonal = &A.blocks[from].as_slice()[4 * c..3 * c + 3];
            values[k..k + diagonal.len()].copy_from_slice(diagonal);
            k += diagonal.len();
            for B in &A.blocks[from + 1..to] {
                values[k..k + 3].copy_from_slice(&B.as_slice()[3 * c..3 * c + 3]);
                k += 3;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Mat3;

    /// Noise on a pattern, with a diagonal that outweighs it.
    fn noise(pattern: Pattern) -> BlockMatrix {
        let mut A = BlockMatrix::zeros(pattern);
        for j in 0..A.pattern.n() {
            for k in A.pattern.start[j] as usize..A.pattern.start[j + 1] as usize {
                let noise = Mat3::from_fn(|r, c| ((7 * k + 3 * r + c) as f64).sin());
                A.blocks[k] = if A.pattern.row[k] as usize == j {
                    noise + noise.transpose() + 60.0 * Mat3::identity()
                } else {
                    noise
                };
            }
        }
        A
    }

    fn random_block_system(n: usize) -> BlockMatrix {
        noise(Pattern::new(n, (1..n as u32).flat_map(|i| [(i, i - 1), (i, i / 3), (i, 31 % i)])))
    }

    #[test]
    fn solves_a_random_block_system() {
        let n = 40;
        let mut A = random_block_system(n);
        let x: Vec<Vec3> = (0..n).map(|i| Vec3::new(i as f64, 1.0, -0.5 * i as f64)).collect();
        let mut b = vec![Vec3::zeros(); n];
        A.multiply(&x, &mut b);
        let mut solver =
            Cholesky::analyse(&A.pattern, None, Precision::Double, 1, MOST_ENTRIES).expect("a small system");
        solver.factor(&A).expect("diagonally dominant");
        solver.solve(&mut b);
        assert!(x.iter().zip(&b).all(|(x, b)| (x - b).norm() < 1e-10));
        A.blocks[0] = -Mat3::identity();
        assert!(solver.factor(&A).is_err());
    }

    #[test]
    fn single_precision_is_good_to_six_digits_at_any_scale() {
        for (n, scale) in [(5, 1.0), (40, 1e-60), (300, 1e60)] {
            let A = random_block_system(n);
            let x: Vec<Vec3> = (0..n).map(|i| scale * Vec3::new((i as f64).sin(), 1.0, -0.5)).collect();
            let mut b = vec![Vec3::zeros(); n];
            A.multiply(&x, &mut b);
            let mut solver =
                Cholesky::analyse(&A.pattern, None, Precision::Single, 1, MOST_ENTRIES).expect("a small system");
            solver.factor(&A).expect("diagonally dominant");
            let mut again = b.clone();
            solver.solve(&mut again);
            assert!(x.iter().zip(&again).all(|(x, b)| (x - b).norm() < 1e-5 * scale));
            solver.solve_in_double(&mut b);
            assert!(x.iter().zip(&b).all(|(x, b)| (x - b).norm() < 1e-12 * scale));
            let mut none = vec![Vec3::zeros(); n];
            solver.solve(&mut none);
            assert!(none.iter().all(|b| *b == Vec3::zeros()));
        }
    }
    /// A stiffness on a lattice of n x n x n blocks.
    fn lattice(n: u32) -> BlockMatrix {
        let at = |i: u32, j: u32, k: u32| (i * n + j) * n + k;
        let cells = (0..n * n * n).map(|a| [a / n / n, a / n % n, a % n]);
        let edges = cells.flat_map(|[i, j, k]| {
            let next = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1), (1, 1, 1)]
                .map(|(a, b, c)| (i + a, j + b, k + c));
            next.into_iter().filter(|c| c.0.max(c.1).max(c.2) < n).map(move |c| (at(c.0, c.1, c.2), at(i, j, k)))
        });
        noise(Pattern::new((n * n * n) as usize, edges))
    }

    #[test]
    fn two_threads_solve_to_the_bits_of_one() {
        let A = lattice(12);
        let x: Vec<Vec3> = (0..A.pattern.n()).map(|i| Vec3::new((i as f64).sin(), 1.0, -0.5)).collect();
        let mut b = vec![Vec3::zeros(); x.len()];
        A.multiply(&x, &mut b);
        let found = [1, 2].map(|threads| {
            let mut solver =
                Cholesky::analyse(&A.pattern, None, Precision::Single, threads, MOST_ENTRIES).expect("small enough");
            let panels = solver.panels.as_ref().expect("single precision");
            assert_eq!(panels.n_threads(), threads, "a factor of {} numbers has halves", solver.factor_len());
            [(); 3].map(|()| {
                solver.factor(&A).expect("diagonally dominant");
                let mut found = b.clone();
                solver.solve(&mut found);
                found
            })
        });
        assert!(x.iter().zip(&found[0][0]).all(|(x, found)| (x - found).norm() < 1e-5));
        assert!(found.iter().flatten().all(|f| *f == found[0][0]));
    }
}
