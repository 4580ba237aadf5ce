//! A Cholesky factor laid out for one right-hand side: single precision, in the order in which a solve reads it.
//!
//! ```text
//! L y = b, L^T x = y     supernode s with columns C and rows R below them:
//! M_s = [ L_CC^-1 ; -L_RC L_CC^-1 ]
//! forward in both halves of the tree, then in the top; backward in the top, then in both halves
//! ```
//!
//! A solve reads every number twice and computes little, so memory sets its time: each M_s lies in tiles of rows, column
//! after column, and half the bytes of a double serve as well, since the quasi-Newton method sees its residuals in
//! double precision. Each half holds all it needs, and what it adds to rows of the top until the top takes it: so two
//! threads can work on them, and compute what one computes.
//!
//! Source: Rothberg & Gupta, "Parallel ICCG on a hierarchical memory multiprocessor", Parallel Computing 18(7), 1992,
//! for inverted diagonal blocks. Departure: they are multiplied into the rows below, so a supernode is one product.

use std::ops::Range;

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use faer::{Accum, MatMut, MatRef, Par};
use pulp::Arch;

use super::halves::{Place, halves};
use super::sweep::{Backward, Forward, LANES, Supernode, TILE, tile};
use super::worker::Worker;

/// Numbers of a factor below which it has no halves: a solve then takes no longer than threads take to meet.
const SMALL: usize = 200_000;

/// The products that stand for a factor.
pub struct Panels {
    halves: [Part; 2],
    top: Part,
    /// The right-hand side in the factor's order.
    b: Vec<f32>,
    /// A supernode in double precision.
    inverse: Vec<f64>,
    below: Vec<f64>,
    worker: Option<Worker<Part>>,
}

/// Supernodes of a half, or of the top, with all that a sweep over them touches.
#[derive(Default)]
struct Part {
    supernodes: Vec<Supernode>,
    /// Which supernodes of the factor they are.
    numbers: Vec<usize>,
    /// Rows of each supernode in `b`, padded; padding points to its end.
    rows: Vec<u32>,
    values: Vec<f32>,
    /// Its columns in the factor, in pieces.
    columns: Vec<Range<usize>>,
    n_columns: usize,
    /// Right-hand side: its own columns, those of the top (for a half), and one number that padding writes to.
    b: Vec<f32>,
    /// Columns of the supernode at hand.
    y: Vec<f32>,
    /// Partial sums of each column.
    sums: Vec<[f32; LANES]>,
}

impl Panels {
    /// Room for the factors of this pattern, and a second thread where `threads` asks for one and it pays.
    pub fn new(symbolic: &SymbolicSupernodalCholesky<u32>, threads: usize) -> Panels {
        let places = places(symbolic);
        // Of each column: its part, and its number there.
        let mut sizes = [0; 3];
        let mut at = Vec::with_capacity(symbolic.nrows());
        for (k, &place) in places.iter().enumerate() {
            for _ in columns(symbolic, k) {
                at.push((place, sizes[place as usize]));
                sizes[place as usize] += 1;
            }
        }
        let part = |place| {
            let own = sizes[place as usize];
            let n = if place == Place::Top { own } else { own + sizes[Place::Top as usize] };
            let mut part = Part::default();
            for k in (0..places.len()).filter(|k| places[*k] == place) {
                let row = |r: &u32| match at[*r as usize] {
                    (p, number) if p == place => number,
                    (Place::Top, number) => own + number,
                    _ => unreachable!("halves share nothing but the top"),
                };
                let below = symbolic.supernode(k).pattern().iter().map(row);
                part.push(k, columns(symbolic, k), below, n);
            }
            part.finish(n);
            part
        };
        let halves = [part(Place::First), part(Place::Second)];
        let (mut widest, mut largest) = (0, 0);
        for k in 0..places.len() {
            let width = columns(symbolic, k).len();
            widest = widest.max(width);
            largest = largest.max(symbolic.supernode(k).pattern().len() * width);
        }
        Panels {
            worker: if threads > 1 && halves[1].n_columns > 0 { Worker::new() } else { None },
            halves,
            top: part(Place::Top),
            b: vec![0.0; symbolic.nrows()],
            inverse: vec![0.0; widest * widest],
            below: vec![0.0; largest],
        }
    }

    /// Bytes of its numbers and rows.
    pub fn memory(&self) -> usize {
        let of = |part: &Part| size_of_val(&part.values[..]) + size_of_val(&part.rows[..]);
        self.halves.iter().chain([&self.top]).map(of).sum()
    }

    /// Threads that solve.
    #[cfg(test)]
    pub fn n_threads(&self) -> usize {
        1 + usize::from(self.worker.is_some())
    }

    /// Takes the numbers of a factor of the same pattern.
    pub fn take(&mut self, symbolic: &SymbolicSupernodalCholesky<u32>, factor: &[f64]) {
        let Panels { halves, top, inverse, below, .. } = self;
        for part in halves.iter_mut().chain([top]) {
            part.take(symbolic, factor, inverse, below);
        }
    }

    /// Solves for the right-hand side that `fill` writes; both are in the factor's order.
    pub fn solve(&mut self, fill: impl FnOnce(&mut [f32])) -> &[f32] {
        let Panels { halves, top, b, worker, .. } = self;
        fill(b);
        for half in &mut *halves {
            half.read(b);
        }
        both(worker, halves, Part::forward);
        top.read(b);
        for half in &*halves {
            for (b, share) in top.b.iter_mut().zip(&half.b[half.n_columns..]) {
                *b += share;
            }
        }
        top.forward();
        top.backward();
        for half in &mut *halves {
            half.b[half.n_columns..].copy_from_slice(&top.b);
        }
        both(worker, halves, Part::backward);
        for part in halves.iter().chain([&*top]) {
            part.write(b);
        }
        b
    }
}

/// Does `job` with both halves, by two threads or by one.
fn both(worker: &Option<Worker<Part>>, halves: &mut [Part; 2], job: fn(&mut Part)) {
    match worker {
        Some(worker) => worker.both(halves, job),
        None => halves.iter_mut().for_each(job),
    }
}

fn columns(symbolic: &SymbolicSupernodalCholesky<u32>, k: usize) -> Range<usize> {
    symbolic.supernode_begin()[k] as usize..symbolic.supernode_end()[k] as usize
}

/// Where each supernode's work is done; the same for any number of threads, so that the bits are.
fn places(symbolic: &SymbolicSupernodalCholesky<u32>) -> Vec<Place> {
    let count = symbolic.n_supernodes();
    let rows = |k: usize| symbolic.supernode(k).pattern();
    let mut at = vec![0; symbolic.nrows()];
    for k in 0..count {
        at[columns(symbolic, k)].fill(k);
    }
    let parent: Vec<Option<usize>> = (0..count).map(|k| rows(k).iter().min().map(|r| at[*r as usize])).collect();
    let work: Vec<usize> =
        (0..count).map(|k| columns(symbolic, k).len() * (columns(symbolic, k).len() + rows(k).len())).collect();
    if work.iter().sum::<usize>() < SMALL {
        return vec![Place::Top; count];
    }
    halves(&parent, &work)
}

impl Part {
    /// Another supernode, with the numbers of the rows below its columns; `padding` is that of padding.
    fn push(
        &mut self,
        number: usize,
        columns: Range<usize>,
        below: impl ExactSizeIterator<Item = usize>,
        padding: usize,
    ) {
        let (start, width) = (self.n_columns, columns.len());
        let height = (width + below.len()).next_multiple_of(LANES);
        let values = self.supernodes.last().map_or(0, Supernode::end);
        let s = Supernode { start, width, rows: self.rows.len(), values, height };
        self.rows.extend((start..start + width).chain(below).map(|r| r as u32));
        self.rows.resize(s.rows + height, padding as u32);
        self.supernodes.push(s);
        self.numbers.push(number);
        self.n_columns += width;
        match self.columns.last_mut() {
            Some(last) if last.end == columns.start => last.end = columns.end,
            _ => self.columns.push(columns),
        }
    }

    /// Makes room for a right-hand side of `n` numbers, once all supernodes are there.
    fn finish(&mut self, n: usize) {
        let widest = self.supernodes.iter().map(|s| s.width).max().unwrap_or(0);
        self.rows.shrink_to_fit();
        self.values = vec![0.0; self.supernodes.last().map_or(0, Supernode::end)];
        self.b = vec![0.0; n + 1];
        self.y = vec![0.0; widest];
        self.sums = vec![[0.0; LANES]; widest];
    }

    /// Takes the numbers of a factor; `inverse` and `below` are room for a supernode.
    fn take(
        &mut self,
        symbolic: &SymbolicSupernodalCholesky<u32>,
        factor: &[f64],
        inverse: &mut [f64],
        below: &mut [f64],
    ) {
        for (s, &k) in self.supernodes.iter().zip(&self.numbers) {
            let w = s.width;
            let r = symbolic.supernode(k).pattern().len();
            let from = symbolic.col_ptr_for_val()[k] as usize;
            let L = MatRef::from_column_major_slice(&factor[from..from + (w + r) * w], w + r, w);
            let (L_CC, L_RC) = L.split_at_row(w);
            let inverse = &mut inverse[..w * w];
            inverse.fill(0.0);
            let mut inverse = MatMut::from_column_major_slice_mut(inverse, w, w);
            invert_lower_triangular(inverse.as_mut(), L_CC, Par::Seq);
            let mut below = MatMut::from_column_major_slice_mut(&mut below[..r * w], r, w);
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

    /// Its share of the right-hand side.
    fn read(&mut self, b: &[f32]) {
        let (own, others) = self.b.split_at_mut(self.n_columns);
        let mut from = 0;
        for columns in &self.columns {
            own[from..from + columns.len()].copy_from_slice(&b[columns.clone()]);
            from += columns.len();
        }
        others.fill(0.0);
    }

    /// Its share of the solution.
    fn write(&self, b: &mut [f32]) {
        let mut from = 0;
        for columns in &self.columns {
            b[columns.clone()].copy_from_slice(&self.b[from..from + columns.len()]);
            from += columns.len();
        }
    }

    fn forward(&mut self) {
        let Part { supernodes, rows, values, b, y, .. } = self;
        Arch::new().dispatch(Forward { supernodes, rows, values, b, y });
    }

    fn backward(&mut self) {
        let Part { supernodes, rows, values, b, sums, .. } = self;
        Arch::new().dispatch(Backward { supernodes, rows, values, b, sums });
    }
}
