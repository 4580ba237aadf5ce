//! Minimisation of a sum of terms over the unknowns: sparse Cholesky or conjugate gradients, quasi-Newton and Newton steps, line search.
#![forbid(unsafe_code)]
#![allow(non_snake_case)]

mod allowance;
mod choice;
mod cholesky;
mod eigen;
mod gradients;
mod halves;
mod incomplete;
mod lbfgs;
mod minimise;
mod ordering;
mod panels;
mod problem;
mod rung;
mod sweep;
mod worker;

pub use allowance::Allowance;
pub use cholesky::{Cholesky, MOST_ENTRIES};
pub use eigen::{Modes, slowest_modes};
pub use gradients::Gradients;
pub use minimise::{Clearance, Minimiser, Outcome, Strategy, Way};
pub use ordering::{elimination, nested_dissection};
pub use problem::Problem;
pub use rung::Rung;

/// Why a step was refused. The state is still the last accepted one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// The iteration budget ran out.
    #[error(
        "the equilibrium was not reached: after {iterations} linear solves the last correction moves a node by \
         {correction:.1e} m (wanted {tolerance:.1e} m) at a residual of {residual:.1e} N"
    )]
    NotConverged {
        /// Linear solves spent.
        iterations: u32,
        /// Largest nodal motion of the last correction, m.
        correction: f64,
        /// Tolerance, m.
        tolerance: f64,
        /// Norm of the force residual, N.
        residual: f64,
    },
    /// The stiffness is singular: something can move without any resistance.
    #[error(
        "the stiffness matrix is not positive definite at block {block} of {n_blocks}, even with projected tangents: \
         a part of the tissue can move freely; hold a bone of it, or add [inertia]"
    )]
    Singular {
        /// Block at which the factorisation stopped.
        block: usize,
        /// Blocks in total.
        n_blocks: usize,
    },
    /// The energy is not finite where the step starts.
    #[error(
        "the energy is not finite where the step starts: elements are inverted that the law does not allow to be, or the bones move further than the tissue can follow"
    )]
    NotFinite,
    /// The factor would not fit a common machine's memory.
    #[error(
        "the factor of {unknowns} unknowns would hold {entries} numbers of 8 bytes or more, the limit is {limit}: use a coarser mesh, or [solver] linear = \"iterative\""
    )]
    TooLarge {
        /// Scalar unknowns.
        unknowns: usize,
        /// Entries of the factor.
        entries: usize,
        /// Most entries.
        limit: usize,
    },
    /// The machine does not give the memory that the factor wants.
    #[error(
        "the factor of {unknowns} unknowns wants {bytes} bytes of memory, which the machine does not give: use a coarser mesh, \
         or [solver] linear = \"iterative\""
    )]
    Memory {
        /// Scalar unknowns.
        unknowns: usize,
        /// Bytes wanted.
        bytes: usize,
    },
    /// The step would turn elements inside out, at its end or on the way there; a smaller one may not.
    #[error(
        "elements would be turned inside out: on this path the tissue has no equilibrium without; move or load it less, \
         choose a law that resists collapse (polyconvex-neo-hookean, the default), or take it as it is with [solver] \
         inversion = \"allow\""
    )]
    Inverts {
        /// Linear solves spent.
        iterations: u32,
    },
    /// The tissue lies so deep in the shape of a contact that it may come out on the wrong side; a smaller step may not.
    #[error(
        "the tissue would lie {depth:.2e} m deep in the shape of contact `{contact}`, which can tell its sides to {most:.2e} m: \
         move the shape from outside, or make the contact stiffer"
    )]
    TooDeep {
        /// Name of the contact.
        contact: String,
        /// Depth of the deepest point, m.
        depth: f64,
        /// Most, m.
        most: f64,
    },
    /// The middle of a contact's shape would come to lie inside the tissue; after a smaller step it may not.
    #[error(
        "the middle of contact `{contact}` would lie inside the tissue: the shape goes through the surface that it should push \
         away, and its force and depth would mean nothing; move it from outside and less far, take a stiffer contact, or \
         refine the mesh there"
    )]
    Swallowed {
        /// Name of the contact.
        contact: String,
    },
    /// The loads are too large for any answer that makes sense.
    #[error(
        "the loads would move the tissue by {motion:.1e} m if it stayed as stiff as it is, more than fifty times its size          ({most:.1e} m): no law carries that; check their units (N, Pa)"
    )]
    BeyondReach {
        /// Predicted motion, m.
        motion: f64,
        /// Most, m.
        most: f64,
    },
    /// Pieces of the step have answers, but at a cost that promises no end.
    #[error(
        "the step was given up after the work of {most:.0} linear solves, what {steps:.0} good steps take, though parts of it \
         have answers: move or load the tissue less at once"
    )]
    GivenUp {
        /// Work, in linear solves.
        most: f64,
        /// The same in good steps.
        steps: f64,
    },
    /// The step has spent what it may.
    #[error(
        "the step was given up after {most} linear solves, the most that it may take (`most_solves` of [solver], port \
         `solver.mostSolves`): move or load the tissue less at once, or allow more"
    )]
    Spent {
        /// Linear solves allowed.
        most: u32,
    },
    /// The host wants the step no more.
    #[error("the step was cancelled")]
    Cancelled,
    /// The modes of vibration were not all found.
    #[error(
        "{found} of {wanted} modes of vibration were found among {size} directions: ask for other `modes` of [inertia], \
         or leave them out"
    )]
    Modes {
        /// Found.
        found: usize,
        /// Wanted.
        wanted: usize,
        /// Directions searched.
        size: usize,
    },
}

impl SolveError {
    /// Linear solves spent in vain.
    pub fn iterations(&self) -> u32 {
        match self {
            SolveError::NotConverged { iterations, .. } | SolveError::Inverts { iterations } => *iterations,
            SolveError::Singular { .. }
            | SolveError::NotFinite
            | SolveError::TooDeep { .. }
            | SolveError::Swallowed { .. }
            | SolveError::TooLarge { .. }
            | SolveError::Memory { .. }
            | SolveError::BeyondReach { .. }
            | SolveError::GivenUp { .. }
            | SolveError::Spent { .. }
            | SolveError::Cancelled
            | SolveError::Modes { .. } => 1,
        }
    }

    /// Whether a smaller piece of the step is not to be tried.
    pub fn is_final(&self) -> bool {
        self.is_ended_by_host() || matches!(self, SolveError::BeyondReach { .. } | SolveError::GivenUp { .. })
    }

    /// Whether it says nothing about the answer.
    pub fn is_ended_by_host(&self) -> bool {
        matches!(self, SolveError::Spent { .. } | SolveError::Cancelled)
    }
}

/// Precision of the solves with a kept factor; residuals and the factor itself are always in double precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// Half the memory traffic and so about half the time; enough for directions of descent.
    Single,
    /// To the last digits that the condition of the stiffness leaves.
    Double,
}

/// How linear systems are solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinearSystems {
    /// By a factor where that fits a common machine's memory, else by conjugate gradients.
    Fitting,
    /// By a factor.
    Direct,
    /// By conjugate gradients: memory in proportion to the mesh.
    Iterative,
}

/// A solver for symmetric positive definite systems of 3x3 blocks.
pub trait LinearSolver: Send {
    /// Takes new numbers on the known pattern.
    ///
    /// # Errors
    /// The block at which the matrix is found not to be positive definite.
    fn factor(&mut self, A: &crate::fem::BlockMatrix) -> Result<(), usize>;

    /// Replaces the right-hand side `b` by the solution, good to the solver's [`Precision`]; allocates nothing.
    fn solve(&mut self, b: &mut [crate::math::Vec3]);

    /// The same, always in double precision.
    fn solve_in_double(&mut self, b: &mut [crate::math::Vec3]);

    /// Bytes of matrices and factors.
    fn memory(&self) -> usize;

    /// Stored entries of the factor; 0 where there is none, and solves are by iteration.
    fn factor_len(&self) -> usize;
}
