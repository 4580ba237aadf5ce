//! Scratch of the solver: never saved, made when a simulation is, and what it allocates then is all.

use std::sync::Arc;

use super::ahead::Ahead;
use super::audit::Look;
use super::linear_map::LinearMap;
use super::linearisation::Linearisation;
use super::model::Model;
use super::modes::Modal;
use super::motion::Motion;
use super::past::{Kept, Piece};
use super::state::State;
use super::{SimError, SolveError};
use crate::fem::{At, Configuration};
use crate::math::{Pose, Vec3};
use crate::solve::{Allowance, Minimiser, Problem};

/// Scratch of the solver; never saved. Allocates when made, then no more.
pub(super) struct Workspace {
    pub minimiser: Box<Minimiser>,
    /// What its steps may spend.
    pub allowance: Arc<Allowance>,
    /// The answer to every input, in scenes that are linear in them.
    pub table: Table,
    /// The same with modes of vibration, in scenes that ask for them.
    pub modal: Option<Box<Modal>>,
    /// Which linearisation the minimiser's factor was made from.
    pub factored: Option<Arc<Linearisation>>,
    /// The factor that the minimiser gets next.
    pub ahead: Ahead,
    pub config: Configuration,
    /// Where the piece at hand started from.
    pub before: Configuration,
    pub motion: Motion,
    /// Estimated error in time of the last piece, m.
    pub time_error: f64,
    /// The last accepted piece of time; its end is in `config`, what it remembered from before in `remembered`.
    pub last: Option<Piece>,
    /// How the accepted state came about.
    pub kept: Kept,
    /// What terms remember, and where the next memory is written.
    pub history: Vec<f64>,
    pub remembered: Vec<f64>,
    pub inputs: Vec<f64>,
    pub x_tilde: Vec<Vec3>,
    pub pivots: Vec<Vec3>,
    pub u: Vec<Vec3>,
    pub wrenches: Vec<(Vec3, Vec3)>,
    /// When elements of the table were looked at.
    pub look: Look,
    /// Whether it was told that a free motion gained energy.
    pub told_of_gain: bool,
    /// The last step without an answer: asked again, it is not tried again.
    pub refused: Option<Box<Refused>>,
}

/// A step that had no answer.
pub(super) struct Refused {
    pub from: State,
    pub dt: f64,
    pub error: SimError,
    /// Where the solver gave up, m.
    pub x: Vec<Vec3>,
}

/// Whether steps are read off a table.
pub(super) enum Table {
    /// Not asked yet.
    Unknown,
    /// The scene is not linear in its inputs, or the table would be too large.
    None,
    Made(Box<LinearMap>),
}

impl Workspace {
    pub fn new(model: &Model) -> Result<Workspace, SolveError> {
        let parts = model.parts();
        let X = &parts.mesh.nodes;
        let pivots = vec![Vec3::zeros(); parts.bones.len()];
        let wrenches = vec![(Vec3::zeros(), Vec3::zeros()); model.dofs().bodies.len()];
        let problem = Problem {
            terms: &parts.terms,
            dofs: model.dofs(),
            X,
            pivots: &pivots,
            wrenches: &wrenches,
            at: At { inputs: &parts.start, x_tilde: X, x_lag: X, ..At::NOWHERE },
        };
        Ok(Workspace {
            minimiser: Box::new(Minimiser::new(&problem, parts.strategy)?),
            allowance: Arc::default(),
            table: Table::Unknown,
            modal: None,
            factored: None,
            ahead: Ahead::default(),
            config: Configuration { x: X.clone(), poses: vec![Pose::REST; parts.bones.len()] },
            before: Configuration { x: X.clone(), poses: vec![Pose::REST; parts.bones.len()] },
            motion: Motion::still(X.len(), parts.inertia.as_ref()),
            time_error: 0.0,
            last: None,
            kept: Kept::new(parts.n_history, if parts.inertia.is_some() { X.len() } else { 0 }),
            history: vec![0.0; parts.n_history],
            remembered: vec![0.0; parts.n_history],
            inputs: parts.start.clone(),
            x_tilde: if parts.inertia.is_some() { X.clone() } else { Vec::new() },
            u: vec![Vec3::zeros(); model.dofs().prescribed.len()],
            pivots,
            wrenches,
            look: Look::none(),
            told_of_gain: false,
            refused: None,
        })
    }

    /// Where the last step without an answer was given up, m.
    pub fn refused(&self) -> Option<&[Vec3]> {
        self.refused.as_ref().map(|refused| &refused.x[..])
    }

    pub fn minimiser(&self) -> &Minimiser {
        &self.minimiser
    }

    /// The minimiser and the tables of a scene in modes.
    pub fn modal(&mut self) -> (&mut Minimiser, &mut Option<Box<Modal>>) {
        (&mut self.minimiser, &mut self.modal)
    }

    /// Completes a snapshot of `state` by what came before it.
    pub fn keep(&self, model: &Model, state: &mut State) {
        state.before = self.kept.save(model, state, self.modal.as_ref().map(|modal| &modal.last));
    }

    /// Takes over what a snapshot knows of what came before it.
    pub fn recall(&mut self, state: &mut State) {
        self.kept.restore(state);
        state.before = None;
    }
}
