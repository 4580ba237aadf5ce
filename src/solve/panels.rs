//! A Cholesky factor laid out for one right-hand side: single precision, in the order in which a solve reads it.
//!
//! ```text
//! L y = b, L^T x = y     supernode s with columns C and rows R below them:
//! M_s = [ L_CC^-1 ; -L_RC L_CC^-1 ]
//! forward, s ascending:   y_C = b_C,  b_C = 0,  b_CR += M_s y_C
//! backward, s descending: b_C = M_s^T b_CR
//! ```
//!
//! A solve reads every number twice and computes little, so memory sets its time: each M_s lies in tiles of rows, column
//! after column, and half the bytes of a double serve as well, since the quasi-Newton method sees its residuals in
//! double precision.
//!
//! Source: Rothberg & Gupta, "Parallel ICCG on a hierarchical memory multiprocessor", Parallel Computing 18(7), 1992,
//! for inverted diagonal blocks. Departure: they are multiplied into the rows below, so a supernode is one product.

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use faer::{Accum, MatMut, MatRef, Par};
use pulp::{Simd, WithSimd};

/// Rows of a tile; the last one of a supernode is cut to a multiple of [`LANES`].
const TILE: usize = 64;
/// Rows are padded to a multiple of this.
const LANES: usize = 16;

/// The products that stand for a factor.
pub struct Panels {
    supernodes: Vec<Supernode>,
    /// Rows of each supernode, padded; padding points behind the last unknown.
    rows: Vec<u32>,
    values: Vec<f32>,
    /// The right-hand side in the factor's order, and one number that padding writes to.
    b: Vec<f32>,
    /// Columns of the supernode at hand.
    y: Vec<f32>,
    /// Partial sums of each column.
    sums: Vec<[f32; LANES]>,
    /// A supernode in double precision.
    inverse: Vec<f64>,
    below: Vec<f64>,
    arch: pulp::Arch,
}

#[derive(Clone, Copy)]
struct Supernode {
    /// First column and number of columns.
    start: usize,
    width: usize,
    /// Where its rows and its values begin.
    rows: usize,
    values: usize,
    /// Rows with padding.
    height: usize,
}

/// Rows of the tile that begins at `row` and its columns: those of the inverse are zero above the diagonal.
fn tile(row: usize, s: &Supernode) -> (usize, usize) {
    let height = TILE.min(s.height - row);
    (height, s.width.min(row + height))
}

impl Panels {
    /// Room for the factors of this pattern.
    pub fn new(symbolic: &SymbolicSupernodalCholesky<u32>) -> Panels {
        let n = symbolic.nrows();
        let (mut supernodes, mut rows, mut len) = (Vec::new(), Vec::new(), 0);
        let (mut widest, mut largest) = (0, 0);
        for k in 0..symbolic.n_supernodes() {
            let (start, end) = (symbolic.supernode_begin()[k] as usize, symbolic.supernode_end()[k] as usize);
            let below = symbolic.supernode(k).pattern();
            let width = end - start;
            let height = (width + below.len()).next_multiple_of(LANES);
            let s = Supernode { start, width, rows: rows.len(), values: len, height };
            rows.extend((start..end).map(|r| r as u32).chain(below.iter().copied()));
            rows.resize(s.rows + height, n as u32);
            len += (0..height).step_by(TILE).map(|row| tile(row, &s)).map(|(h, w)| h * w).sum::<usize>();
            widest = widest.max(width);
            largest = largest.max(below.len() * width);
            supernodes.push(s);
        }
        Panels {
            supernodes,
            rows,
            values: vec![0.0; len],
            b: vec![0.0; n + 1],
            y: vec![0.0; widest],
            sums: vec![[0.0; LANES]; widest],
            inverse: vec![0.0; widest * widest],
            below: vec![0.0; largest],
            arch: pulp::Arch::new(),
        }
    }

    /// Bytes of its numbers and rows.
    pub fn memory(&self) -> usize {
        size_of_val(&self.values[..]) + size_of_val(&self.rows[..])
    }

    /// Takes the numbers of a factor of the same pattern.
    pub fn take(&mut self, symbolic: &SymbolicSupernodalCholesky<u32>, factor: &[f64]) {
        for (k, s) in self.supernodes.iter().enumerate() {
            let w = s.width;
            let r = symbolic.supernode(k).pattern().len();
            let from = symbolic.col_ptr_for_val()[k] as usize;
            let L = MatRef::from_column_major_slice(&factor[from..from + (w + r) * w], w + r, w);
            let (L_CC, L_RC) = L.split_at_row(w);
            let inverse = &mut self.inverse[..w * w];
            inverse.fill(0.0);
            let mut inverse = MatMut::from_column_major_slice_mut(inverse, w, w);
            invert_lower_triangular(inverse.as_mut(), L_CC, Par::Seq);
            let mut below = MatMut::from_column_major_slice_mut(&mut self.below[..r * w], r, w);
            matmul(
                below.as_mut(),
                BlockStructure::Rectangular,
                Accum::Replace,
                L_RC,
                BlockStructure::Rectangular,
                inverse.as_ref(),
                BlockStructure::TriangularLower,
                -1.0,
                Par::Seq,
            );
            let mut to = self.values[s.values..].iter_mut();
            for row in (0..s.height).step_by(TILE) {
                let (height, width) = tile(row, s);
                for c in 0..width {
                    for i in row..row + height {
                        let value = match i {
                            _ if i < c => 0.0,
                            _ if i < w => inverse[(i, c)],
                            _ if i < w + r => below[(i - w, c)],
                            _ => 0.0,
                        };
                        *to.next().expect("room for every tile") = value as f32;
                    }
                }
            }
        }
    }

    /// Solves for the right-hand side that `fill` writes; both are in the factor's order.
    pub fn solve(&mut self, fill: impl FnOnce(&mut [f32])) -> &[f32] {
        fill(&mut self.b);
        let Panels { supernodes, rows, values, b, y, sums, arch, .. } = self;
        arch.dispatch(Sweep { supernodes, rows, values, b, y, sums });
        &self.b
    }
}

/// A solve, compiled for each width of vectors.
struct Sweep<'a> {
    supernodes: &'a [Supernode],
    rows: &'a [u32],
    values: &'a [f32],
    b: &'a mut [f32],
    y: &'a mut [f32],
    sums: &'a mut [[f32; LANES]],
}

impl WithSimd for Sweep<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Sweep { supernodes, rows, values, b, y, sums } = self;
        for s in supernodes {
            let y = &mut y[..s.width];
            let columns = &mut b[s.start..s.start + s.width];
            y.copy_from_slice(columns);
            columns.fill(0.0);
            let mut tiles = Tiles::new(s, values, rows);
            while let Some((tile, rows, width)) = tiles.next() {
                let (tile, y) = (S::as_simd_f32s(tile).0, &y[..width]);
                match rows.len() / S::F32_LANES {
                    1 => forward::<S, 1>(simd, tile, rows, y, b),
                    2 => forward::<S, 2>(simd, tile, rows, y, b),
                    3 => forward::<S, 3>(simd, tile, rows, y, b),
                    6 => forward::<S, 6>(simd, tile, rows, y, b),
                    8 => forward::<S, 8>(simd, tile, rows, y, b),
                    _ => forward::<S, 4>(simd, tile, rows, y, b),
                }
            }
        }
        for s in supernodes.iter().rev() {
            let sums = &mut S::as_mut_simd_f32s(sums.as_flattened_mut()).0[..s.width];
            sums.fill(simd.splat_f32s(0.0));
            let mut tiles = Tiles::new(s, values, rows);
            while let Some((tile, rows, width)) = tiles.next() {
                let (tile, sums) = (S::as_simd_f32s(tile).0, &mut sums[..width]);
                match rows.len() / S::F32_LANES {
                    1 => backward::<S, 1>(simd, tile, rows, sums, b),
                    2 => backward::<S, 2>(simd, tile, rows, sums, b),
                    3 => backward::<S, 3>(simd, tile, rows, sums, b),
                    6 => backward::<S, 6>(simd, tile, rows, sums, b),
                    8 => backward::<S, 8>(simd, tile, rows, sums, b),
                    _ => backward::<S, 4>(simd, tile, rows, sums, b),
                }
            }
            for (b, sum) in b[s.start..].iter_mut().zip(sums) {
                *b = simd.reduce_sum_f32s(*sum);
            }
        }
    }
}

/// The tiles of a supernode, one after another. No closures and no iterator adaptors over vectors: what is not inlined does
/// not know the machine's.
struct Tiles<'a> {
    s: &'a Supernode,
    values: &'a [f32],
    rows: &'a [u32],
    row: usize,
}

impl<'a> Tiles<'a> {
    #[inline(always)]
    fn new(s: &'a Supernode, values: &'a [f32], rows: &'a [u32]) -> Self {
        Tiles { s, values: &values[s.values..], rows: &rows[s.rows..s.rows + s.height], row: 0 }
    }

    /// Values, rows and width of the next tile.
    #[inline(always)]
    fn next(&mut self) -> Option<(&'a [f32], &'a [u32], usize)> {
        if self.row == self.s.height {
            return None;
        }
        let (height, width) = tile(self.row, self.s);
        let (values, later) = self.values.split_at(height * width);
        let rows = &self.rows[self.row..self.row + height];
        self.values = later;
        self.row += height;
        Some((values, rows, width))
    }
}

/// `b[rows] += M y` for a tile, K vectors of rows at a time.
#[inline(always)]
fn forward<S: Simd, const K: usize>(simd: S, tile: &[S::f32s], rows: &[u32], y: &[f32], b: &mut [f32]) {
    let height = rows.len() / S::F32_LANES;
    for (at, rows) in (0..height).step_by(K).zip(rows.chunks_exact(K * S::F32_LANES)) {
        let mut sum = [simd.splat_f32s(0.0); K];
        for (column, &y) in tile.chunks_exact(height).zip(y) {
            let y = simd.splat_f32s(y);
            for (sum, m) in sum.iter_mut().zip(&column[at..at + K]) {
                *sum = simd.mul_add_e_f32s(*m, y, *sum);
            }
        }
        let mut lanes = [0.0f32; TILE];
        S::as_mut_simd_f32s(&mut lanes).0[..K].copy_from_slice(&sum);
        for (&row, sum) in rows.iter().zip(&lanes) {
            b[row as usize] += sum;
        }
    }
}

/// `sums += M^T b[rows]` for a tile, lane by lane.
#[inline(always)]
fn backward<S: Simd, const K: usize>(simd: S, tile: &[S::f32s], rows: &[u32], sums: &mut [S::f32s], b: &[f32]) {
    let height = rows.len() / S::F32_LANES;
    for (at, rows) in (0..height).step_by(K).zip(rows.chunks_exact(K * S::F32_LANES)) {
        let mut x = [0.0f32; TILE];
        for (x, &row) in x.iter_mut().zip(rows) {
            *x = b[row as usize];
        }
        let mut vectors = [simd.splat_f32s(0.0); K];
        vectors.copy_from_slice(&S::as_simd_f32s(&x).0[..K]);
        for (column, sum) in tile.chunks_exact(height).zip(&mut *sums) {
            for (x, m) in vectors.iter().zip(&column[at..at + K]) {
                *sum = simd.mul_add_e_f32s(*m, *x, *sum);
            }
        }
    }
}
