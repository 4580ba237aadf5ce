//! Conjugate gradients with an incomplete factor: memory in proportion to the mesh, for scenes whose factor is too large
//! or never used twice.
//!
//! ```text
//! p <- z + beta p,   alpha = r.z / p.A p,   d += alpha p,   r -= alpha A p,   z = M^-1 r   until |r| <= eta |b|
//! ```
//!
//! Where the matrix bends downwards along `p` the iteration ends with what it has, a direction of descent.
//!
//! Source: Nocedal & Wright, "Numerical Optimization", 2nd ed., 2006, algorithms 5.3 and 7.1.

use super::LinearSolver;
use super::incomplete::Incomplete;
use super::lbfgs::dot;
use crate::fem::{BlockMatrix, Pattern};
use crate::math::Vec3;

/// Relative residual at which a direction of Newton's method is good enough: each iteration then gains this much.
const ROUGH: f64 = 1e-2;
/// The same where a solution is wanted for itself.
const FINE: f64 = 1e-11;
/// Most iterations of a solve; a direction made of fewer is still one of descent.
const MOST: usize = 2000;

/// The iterative solver of one pattern.
pub struct Gradients {
    A: BlockMatrix,
    preconditioner: Incomplete,
    r: Vec<Vec3>,
    z: Vec<Vec3>,
    p: Vec<Vec3>,
    Ap: Vec<Vec3>,
}

impl Gradients {
    /// Room for matrices of this pattern.
    pub fn new(pattern: &Pattern) -> Gradients {
        let vector = || vec![Vec3::zeros(); pattern.n()];
        Gradients {
            A: BlockMatrix::zeros(pattern.clone()),
            preconditioner: Incomplete::new(pattern),
            r: vector(),
            z: vector(),
            p: vector(),
            Ap: vector(),
        }
    }

    /// Bytes of the matrix, the incomplete factor and the vectors.
    pub fn memory(&self) -> usize {
        size_of_val(&self.A.blocks[..])
            + size_of_val(&self.A.pattern.row[..])
            + self.preconditioner.memory()
            + 4 * size_of_val(&self.r[..])
    }

    /// Replaces `b` by the solution to the relative residual `eta`; returns the iterations.
    fn solve_to(&mut self, b: &mut [Vec3], eta: f64) -> usize {
        let Gradients { A, preconditioner, r, z, p, Ap } = self;
        let wanted = eta * eta * dot(b, b);
        r.copy_from_slice(b);
        preconditioner.apply(&A.pattern, r, z);
        p.copy_from_slice(z);
        b.fill(Vec3::zeros());
        let mut rz = dot(r, z);
        for k in 0..MOST {
            if dot(r, r) <= wanted {
                return k;
            }
            A.multiply(p, Ap);
            let pAp = dot(p, Ap);
            if pAp <= 0.0 || !pAp.is_finite() {
                if k == 0 {
                    b.copy_from_slice(p);
                }
                return k + 1;
            }
            let alpha = rz / pAp;
            for ((b, r), (p, Ap)) in b.iter_mut().zip(r.iter_mut()).zip(p.iter().zip(&*Ap)) {
                *b += alpha * p;
                *r -= alpha * Ap;
            }
            preconditioner.apply(&A.pattern, r, z);
            let next = dot(r, z);
            let beta = next / rz;
            rz = next;
            for (p, z) in p.iter_mut().zip(&*z) {
                *p = z + beta * *p;
            }
        }
        MOST
    }
}

impl LinearSolver for Gradients {
    fn factor(&mut self, A: &BlockMatrix) -> Result<(), usize> {
        self.A.blocks.copy_from_slice(&A.blocks);
        self.preconditioner.factor(A)
    }

    fn solve(&mut self, b: &mut [Vec3]) {
        self.solve_to(b, ROUGH);
    }

    fn solve_in_double(&mut self, b: &mut [Vec3]) {
        self.solve_to(b, FINE);
    }

    fn memory(&self) -> usize {
        Gradients::memory(self)
    }

    fn factor_len(&self) -> usize {
        0
    }
}
