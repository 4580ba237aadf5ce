//! Sparse matrices of 3x3 blocks on a fixed pattern.

use sha2::{Digest, Sha256};

use crate::math::{Mat3, Vec3};

/// Lower triangle of a symmetric block pattern, by columns: the diagonal block first, then rows in ascending order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern {
    /// First entry of each column; one more than there are columns.
    pub start: Vec<u32>,
    /// Block row of each entry.
    pub row: Vec<u32>,
}

impl Pattern {
    /// Pattern of `n` blocks with every diagonal block and the given couplings `(row, column)`, either way round.
    pub fn new(n: usize, couplings: impl Iterator<Item = (u32, u32)>) -> Pattern {
        let mut keys: Vec<u64> = couplings.map(|(i, j)| (u64::from(i.min(j)) << 32) | u64::from(i.max(j))).collect();
        keys.extend((0..n as u64).map(|j| (j << 32) | j));
        keys.sort_unstable();
        keys.dedup();
        let mut start = vec![0u32; n + 1];
        for key in &keys {
            start[(key >> 32) as usize + 1] += 1;
        }
        for j in 0..n {
            start[j + 1] += start[j];
        }
        Pattern { start, row: keys.into_iter().map(|key| key as u32).collect() }
    }

    /// Number of block columns.
    pub fn n(&self) -> usize {
        self.start.len() - 1
    }

    /// SHA-256 of its numbers: equal for equal patterns on every machine.
    pub fn hash(&self) -> [u8; 32] {
        let mut hash = Sha256::new();
        self.start.iter().chain(&self.row).for_each(|k| hash.update(k.to_le_bytes()));
        hash.finalize().into()
    }

    /// Index of the stored block at row `i` >= column `j`.
    pub fn find(&self, i: u32, j: u32) -> Option<usize> {
        let (from, to) = (self.start[j as usize] as usize, self.start[j as usize + 1] as usize);
        self.row[from..to].binary_search(&i).ok().map(|k| from + k)
    }
}

/// A symmetric matrix: the lower triangle's blocks on a [`Pattern`].
#[derive(Debug, Clone)]
pub struct BlockMatrix {
    /// Where the blocks are.
    pub pattern: Pattern,
    /// The blocks, N/m.
    pub blocks: Vec<Mat3>,
}

impl BlockMatrix {
    /// The zero matrix.
    pub fn zeros(pattern: Pattern) -> BlockMatrix {
        let blocks = vec![Mat3::zeros(); pattern.row.len()];
        BlockMatrix { pattern, blocks }
    }

    /// The stored block at row `i` >= column `j`.
    ///
    /// # Panics
    /// If the pattern does not hold it.
    pub fn at_mut(&mut self, i: u32, j: u32) -> &mut Mat3 {
        let k = self.pattern.find(i, j).expect("pattern holds every coupling");
        &mut self.blocks[k]
    }

    /// `y = A x`.
    pub fn multiply(&self, x: &[Vec3], y: &mut [Vec3]) {
        y.fill(Vec3::zeros());
        for j in 0..self.pattern.n() {
            for k in self.pattern.start[j] as usize..self.pattern.start[j + 1] as usize {
                let (i, B) = (self.pattern.row[k] as usize, &self.blocks[k]);
                y[i] += B * x[j];
                if i != j {
                    y[j] += B.tr_mul(&x[i]);
                }
            }
        }
    }
}

/// The blocks that couple unknowns (rows) to prescribed nodes (columns), row by row.
#[derive(Debug, Clone)]
pub struct CouplingMatrix {
    /// First entry of each row; one more than there are rows.
    pub start: Vec<u32>,
    /// Prescribed node of each entry.
    pub column: Vec<u32>,
    /// The blocks, N/m.
    pub blocks: Vec<Mat3>,
}

impl CouplingMatrix {
    /// The zero matrix with `n` rows and the given `(row, column)` blocks.
    pub fn new(n: usize, couplings: impl Iterator<Item = (u32, u32)>) -> CouplingMatrix {
        let mut keys: Vec<(u32, u32)> = couplings.collect();
        keys.sort_unstable();
        keys.dedup();
        let mut start = vec![0u32; n + 1];
        for (i, _) in &keys {
            start[*i as usize + 1] += 1;
        }
        for i in 0..n {
            start[i + 1] += start[i];
        }
        let blocks = vec![Mat3::zeros(); keys.len()];
        CouplingMatrix { start, column: keys.into_iter().map(|(_, p)| p).collect(), blocks }
    }

    /// Index of the stored block at `(i, p)`.
    pub fn find(&self, i: u32, p: u32) -> Option<usize> {
        let (from, to) = (self.start[i as usize] as usize, self.start[i as usize + 1] as usize);
        self.column[from..to].binary_search(&p).ok().map(|k| from + k)
    }

    /// The stored block at `(i, p)`.
    ///
    /// # Panics
    /// If the pattern does not hold it.
    pub fn at_mut(&mut self, i: u32, p: u32) -> &mut Mat3 {
        let k = self.find(i, p).expect("pattern holds every coupling");
        &mut self.blocks[k]
    }

    /// `y += A u` for the increments `u(p)` of the prescribed nodes.
    pub fn add_product(&self, u: impl Fn(usize) -> Vec3, y: &mut [Vec3]) {
        for (i, y) in y.iter_mut().enumerate() {
            for k in self.start[i] as usize..self.start[i + 1] as usize {
                *y += self.blocks[k] * u(self.column[k] as usize);
            }
        }
    }
}
