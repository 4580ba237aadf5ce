//! The slowest modes of vibration: block Lanczos with the inverse of the stiffness and full reorthogonalisation.
//!
//! ```text
//! K phi = lambda M phi   <=>   A y = y/lambda,   A = M^(1/2) K^-1 M^(1/2),   y = M^(1/2) phi,   phi^T M phi = 1
//! ```
//!
//! The basis V grows by `BLOCK` vectors a round, `V <- [V, (I - V V^T) A V_last]`, and Ritz pairs come from `V^T A V`. What the
//! last round adds beyond V bounds the residual `|A y - y/lambda|` of each pair. Directions that vanish are replaced by new
//! ones, so that a basis of all unknowns gives all modes, and modes of one frequency are found together, `BLOCK` at a time.
//! The start is the same each time, and so are the bits.
//!
//! Source: Parlett, "The Symmetric Eigenvalue Problem", 1980, chapter 13; the inverse after Ericsson & Ruhe, "The spectral
//! transformation Lanczos method for the numerical solution of large sparse generalized symmetric eigenvalue problems",
//! Math. Comp. 35, 1980. Departure: every vector is orthogonalised against all others, since few are wanted.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::SolveError;
use crate::math::{Random, Vec3};

/// Vectors that join the basis at once: most modes of one frequency that are sure to be found.
const BLOCK: usize = 4;
/// Largest residual of a pair in units of its 1/lambda.
const RESIDUAL: f64 = 1e-10;
/// Directions shorter than this part of what they are left of are round-off.
const VANISHED: f64 = 1e-10;
/// The basis may grow to this many vectors a mode, and this many beside.
const MOST: (usize, usize) = (4, 200);
/// Share of the basis by which it grows before the pairs are looked at again.
const PATIENCE: usize = 8;

/// Modes of vibration, slowest first.
#[derive(Debug, Clone, PartialEq)]
pub struct Modes {
    /// Squares of the angular frequencies, 1/s2.
    pub lambda: Vec<f64>,
    /// Shapes by block of unknowns, of unit mass: kg^(-1/2).
    pub phi: Vec<Vec<Vec3>>,
    /// Linear solves that it took.
    pub solves: u32,
}

/// The `wanted` slowest modes of a stiffness, given by its inverse, and of the masses `m` of its blocks (kg, positive).
///
/// # Errors
/// [`SolveError::Modes`] where the basis has grown too large before all were found, [`SolveError::NotFinite`] where a solve
/// gives no numbers.
pub fn slowest_modes(
    mut apply_inverse: impl FnMut(&mut [Vec3]),
    m: &[f64],
    wanted: usize,
) -> Result<Modes, SolveError> {
    let n = 3 * m.len();
    let wanted = wanted.min(n);
    if wanted == 0 {
        return Ok(Modes { lambda: Vec::new(), phi: Vec::new(), solves: 0 });
    }
    let root: Vec<f64> = m.iter().flat_map(|m| [m.sqrt(); 3]).collect();
    let mut b = vec![Vec3::zeros(); m.len()];
    let mut apply = |y: &mut [f64]| {
        for (b, (y, root)) in b.iter_mut().zip(y.chunks_exact(3).zip(root.chunks_exact(3))) {
            *b = Vec3::from_column_slice(y).component_mul(&Vec3::from_column_slice(root));
        }
        apply_inverse(&mut b);
        for (b, (y, root)) in b.iter().zip(y.chunks_exact_mut(3).zip(root.chunks_exact(3))) {
            y.copy_from_slice(b.component_mul(&Vec3::from_column_slice(root)).as_slice());
        }
    };
    let most = n.min(MOST.0 * wanted + MOST.1);
    let mut basis = Basis { V: DMatrix::zeros(n, 0), fresh: Random(1) };
    let mut T = DMatrix::<f64>::zeros(0, 0);
    let mut look_at = wanted;
    let mut added = basis.extend(&DMatrix::zeros(n, BLOCK), 1.0);
    let mut scale = 0.0_f64;
    loop {
        let (size, from) = (basis.V.ncols(), basis.V.ncols() - added);
        let mut W = basis.V.columns(from, added).into_owned();
        W.as_mut_slice().chunks_exact_mut(n).for_each(&mut apply);
        if !W.iter().all(|w| w.is_finite()) {
            return Err(SolveError::NotFinite);
        }
        scale = W.column_iter().map(|w| w.norm()).fold(scale, f64::max);
        let mut C = basis.V.tr_mul(&W);
        W -= &basis.V * &C;
        let D = basis.V.tr_mul(&W);
        W -= &basis.V * &D;
        C += D;
        T.resize_mut(size, size, 0.0);
        for j in from..size {
            for i in 0..size {
                let both = if i >= from { 0.5 * (C[(i, j - from)] + C[(j, i - from)]) } else { C[(i, j - from)] };
                (T[(i, j)], T[(j, i)]) = (both, both);
            }
        }
        if size >= look_at || size == most {
            let pairs = SymmetricEigen::new(T.clone());
            let mut order: Vec<usize> = (0..size).collect();
            order.sort_by(|&i, &j| pairs.eigenvalues[j].total_cmp(&pairs.eigenvalues[i]));
            order.truncate(wanted);
            let beyond = W.tr_mul(&W);
            let holds = |&k: &usize| {
                let last = pairs.eigenvectors.view((from, k), (added, 1));
                let residual = last.dot(&(&beyond * last)).max(0.0).sqrt();
                let theta = pairs.eigenvalues[k];
                theta > 0.0 && (size == n || residual <= RESIDUAL * theta)
            };
            let found = order.iter().filter(|k| holds(k)).count();
            if found == wanted {
                let Y = &basis.V * pairs.eigenvectors.select_columns(&order);
                let shape = |y: &[f64]| -> Vec<Vec3> {
                    y.chunks_exact(3).zip(m).map(|(y, m)| Vec3::from_column_slice(y) / m.sqrt()).collect()
                };
                return Ok(Modes {
                    lambda: order.iter().map(|&k| 1.0 / pairs.eigenvalues[k]).collect(),
                    phi: Y.as_slice().chunks_exact(n).map(shape).collect(),
                    solves: size as u32,
                });
            }
            if size == most {
                return Err(SolveError::Modes { found, wanted, size });
            }
            look_at = size + BLOCK.max(size / PATIENCE);
        }
        let room = BLOCK.min(most - size);
        added = basis.extend(&W.columns(0, added.min(room)).into_owned().resize_horizontally(room, 0.0), scale);
    }
}

/// Orthonormal columns, and a source of new ones.
struct Basis {
    V: DMatrix<f64>,
    fresh: Random,
}

impl Basis {
    /// Adds what each column of `W` holds beyond the basis, or a new direction where that is nothing beside `scale`.
    fn extend(&mut self, W: &DMatrix<f64>, scale: f64) -> usize {
        let room = W.ncols().min(self.V.nrows() - self.V.ncols());
        for w in W.column_iter().take(room) {
            let length = w.norm();
            let own = (length > VANISHED * scale).then(|| self.beyond(w / length)).flatten();
            let v = own.unwrap_or_else(|| self.another());
            let size = self.V.ncols();
            self.V = std::mem::replace(&mut self.V, DMatrix::zeros(0, 0)).insert_column(size, 0.0);
            self.V.set_column(size, &v);
        }
        room
    }

    /// Some direction beyond the basis.
    fn another(&mut self) -> DVector<f64> {
        loop {
            let w = DVector::from_fn(self.V.nrows(), |_, _| 2.0 * self.fresh.number() - 1.0).normalize();
            if let Some(v) = self.beyond(w) {
                return v;
            }
        }
    }

    /// The direction of a unit vector beyond the basis, if there is one.
    fn beyond(&self, mut w: DVector<f64>) -> Option<DVector<f64>> {
        for _ in 0..2 {
            w -= &self.V * self.V.tr_mul(&w);
            let length = w.norm();
            if length <= VANISHED {
                return None;
            }
            w /= length;
        }
        Some(w)
    }
}
