//! The two sweeps of a solve over supernodes, in the machine's vectors.
//!
//! ```text
//! forward, s ascending:   y_C = b_C,  b_C = 0,  b_CR += M_s y_C
//! backward, s descending: b_C = M_s^T b_CR
//! ```

use pulp::{Simd, WithSimd};

/// Rows of a tile; the last one of a supernode is cut to a multiple of [`LANES`].
pub const TILE: usize = 64;
/// Rows are padded to a multiple of this.
pub const LANES: usize = 16;

/// Columns C with the rows below them; its values are tiles of rows, column after column.
#[derive(Clone, Copy)]
pub struct Supernode {
    /// First column and number of columns.
    pub start: usize,
    pub width: usize,
    /// Where its rows and its values begin.
    pub rows: usize,
    pub values: usize,
    /// Rows with padding.
    pub height: usize,
}

impl Supernode {
    /// Where its values end.
    pub fn end(&self) -> usize {
        let tiles = (0..self.height).step_by(TILE).map(|row| tile(row, self));
        self.values + tiles.map(|(height, width)| height * width).sum::<usize>()
    }
}

/// Rows of the tile that begins at `row` and its columns: those of the inverse are zero above the diagonal.
pub fn tile(row: usize, s: &Supernode) -> (usize, usize) {
    let height = TILE.min(s.height - row);
    (height, s.width.min(row + height))
}

/// The forward sweep, compiled for each width of vectors.
pub struct Forward<'a> {
    pub supernodes: &'a [Supernode],
    pub rows: &'a [u32],
    pub values: &'a [f32],
    pub b: &'a mut [f32],
    /// Columns of the supernode at hand.
    pub y: &'a mut [f32],
}

/// The backward sweep.
pub struct Backward<'a> {
    pub supernodes: &'a [Supernode],
    pub rows: &'a [u32],
    pub values: &'a [f32],
    pub b: &'a mut [f32],
    /// Partial sums of each column of the supernode at hand.
    pub sums: &'a mut [[f32; LANES]],
}

impl WithSimd for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Forward { supernodes, rows, values, b, y } = self;
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
    }
}

impl WithSimd for Backward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Backward { supernodes, rows, values, b, sums } = self;
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
