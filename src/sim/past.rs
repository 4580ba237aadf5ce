//! What the accepted state came from besides its inputs; held while derivatives are taken.

use std::sync::Arc;

use super::modal::{Coordinates, Last};
use super::motion::in_time;
use super::workspace::Workspace;
use super::{Model, SimError, State};
use crate::fem::{At, Dofs, Role};
use crate::math::Vec3;

/// A piece of time that was accepted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    /// Its number among those that were kept; 0 before.
    pub number: u64,
    /// Its end, s.
    pub t: f64,
    /// Its length, s; 0 if no time passed.
    pub dt: f64,
    /// Length of the one before, s; 0 if there was none.
    pub dt_before: f64,
}

/// What came before a state, as its snapshot carries it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Before {
    /// Whether the state is the start at rest, where no input has moved anything yet.
    pub at_rest: bool,
    /// Length of the last piece of time and of the one before, s.
    pub dt: f64,
    pub dt_before: f64,
    /// What terms remembered before it.
    pub history: Vec<f64>,
    /// Where inertia alone would have carried each node, m.
    pub x_tilde: Vec<Vec3>,
    /// Where a scene in modes came from.
    pub from: Option<Coordinates>,
}

impl Before {
    /// Whether all its numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.history.iter().chain(self.x_tilde.iter().flatten()).all(|v| v.is_finite())
            && self.dt.is_finite()
            && self.dt_before.is_finite()
            && self.from.as_ref().is_none_or(Coordinates::is_finite)
    }
}

/// How the state of a simulation came about, as far as its workspace knows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Origin {
    /// Not by a step of which anything is known.
    Unknown,
    /// It is the start at rest.
    Rest,
    /// By this piece of time.
    Piece(Piece),
}

/// The same with what terms saw in the piece; written after every accepted step, so that a refused one changes nothing.
pub(super) struct Kept {
    pub origin: Origin,
    history: Vec<f64>,
    x_tilde: Vec<Vec3>,
    /// The last step of a scene in modes, if it was restored and the tables do not know of it yet.
    pub modal: Option<Last>,
    /// Pieces so far: the number of the last one.
    n_pieces: u64,
}

impl Kept {
    /// Nothing yet.
    pub fn new(n_history: usize, n_nodes: usize) -> Kept {
        Kept {
            origin: Origin::Unknown,
            history: vec![0.0; n_history],
            x_tilde: vec![Vec3::zeros(); n_nodes],
            modal: None,
            n_pieces: 0,
        }
    }

    /// Takes over an accepted piece with what came before it.
    pub fn take(&mut self, piece: &Piece, history: &[f64], x_tilde: &[Vec3]) {
        self.n_pieces += 1;
        self.origin = Origin::Piece(Piece { number: self.n_pieces, ..*piece });
        self.history.copy_from_slice(history);
        self.x_tilde.copy_from_slice(x_tilde);
    }

    /// As a snapshot of `state` carries it; `last` is the step that tables of modes know of.
    pub fn save(&self, model: &Model, state: &State, last: Option<&Last>) -> Option<Arc<Before>> {
        let (at_rest, dt, dt_before, from) = match self.origin {
            Origin::Rest => (true, 0.0, 0.0, None),
            _ if model.is_reduced() => {
                let last = last.into_iter().chain(&self.modal).find(|last| last.led_to(state))?;
                (false, last.dt, last.dt_before, Some(last.from.clone()))
            }
            Origin::Piece(piece) if model.remembers() => (false, piece.dt, piece.dt_before, None),
            Origin::Piece(_) | Origin::Unknown => return None,
        };
        let (history, x_tilde) = (self.history.clone(), self.x_tilde.clone());
        Some(Arc::new(Before { at_rest, dt, dt_before, history, x_tilde, from }))
    }

    /// Returns to what a snapshot carries.
    pub fn restore(&mut self, state: &State) {
        self.n_pieces += 1;
        self.modal = None;
        let Some(before) = &state.before else {
            self.origin = Origin::Unknown;
            return;
        };
        let Before { at_rest, dt, dt_before, history, x_tilde, from } = &**before;
        self.history.copy_from_slice(history);
        self.x_tilde.copy_from_slice(x_tilde);
        let piece = Piece { number: self.n_pieces, t: state.t, dt: *dt, dt_before: *dt_before };
        self.origin = if *at_rest { Origin::Rest } else { Origin::Piece(piece) };
        self.modal = from.as_ref().map(|from| Last::to(state, from.clone(), *dt, *dt_before));
    }
}

/// The past of the last piece of time; empty where the scene has no memory.
pub(super) struct Past {
    piece: Piece,
    /// What terms remembered before it.
    history: Vec<f64>,
    /// Where inertia alone would have carried each node, m.
    pub x_tilde: Vec<Vec3>,
    /// dv/dx of nodes that bones do not move and of those that they do, 1/s.
    rates: [f64; 2],
    /// d x_tilde/dx of nodes that bones move.
    follows: f64,
}

impl Past {
    /// The piece of time that led to `state`; one of no number where the scene has no memory.
    ///
    /// # Errors
    /// [`SimError::NoDerivative`] where it matters and is no longer known.
    pub fn piece(model: &Model, state: &State, work: &Workspace) -> Result<Piece, SimError> {
        if !model.remembers() {
            return Ok(Piece { number: 0, t: state.t, dt: 0.0, dt_before: 0.0 });
        }
        match work.kept.origin {
            Origin::Piece(piece) => Ok(piece),
            Origin::Unknown | Origin::Rest => Err(unknown()),
        }
    }

    /// The past of that piece.
    pub fn new(model: &Model, piece: Piece, work: &Workspace) -> Past {
        let inertia = model.parts().inertia.as_ref().filter(|_| piece.dt > 0.0);
        let formula = inertia.map(|i| (i.scheme.formula(piece.dt, piece.dt_before), i.damping_mass));
        Past {
            piece,
            history: work.kept.history.clone(),
            x_tilde: work.kept.x_tilde.clone(),
            rates: [false, true].map(|of_bone| formula.map_or(0.0, |(formula, _)| formula.rate(of_bone))),
            follows: formula.map_or(0.0, |(formula, damping)| formula.follows_bone(damping)),
        }
    }

    /// Whether it is that of this piece.
    pub fn is_of(&self, piece: &Piece) -> bool {
        self.piece.number == piece.number
    }

    /// What terms see, under these inputs and with nodes carried there by inertia.
    pub fn at<'a>(&'a self, model: &Model, inputs: &'a [f64], x_tilde: &'a [Vec3]) -> At<'a> {
        let Piece { t, dt, dt_before, .. } = self.piece;
        in_time(model, At { t, dt, inputs, history: &self.history, x_tilde, ..At::NOWHERE }, dt_before)
    }

    /// What strain is told with: no time passes, and what the piece came from is still remembered.
    pub fn still<'a>(&'a self, inputs: &'a [f64]) -> At<'a> {
        At { t: self.piece.t, dt: self.piece.dt, inputs, history: &self.history, ..At::NOWHERE }
    }

    /// Where inertia alone carries the nodes once each has moved by `dx`: bones are on their way whatever the forces.
    pub fn carried(&self, dofs: &Dofs, dx: impl Fn(usize) -> Vec3) -> Vec<Vec3> {
        let mut carried = self.x_tilde.clone();
        if !carried.is_empty() {
            for &a in &dofs.prescribed {
                carried[a as usize] += self.follows * dx(a as usize);
            }
        }
        carried
    }

    /// dv/dx of each node, 1/s.
    pub fn rates(&self, dofs: &Dofs) -> Vec<f64> {
        dofs.role.iter().map(|role| self.rates[usize::from(matches!(role, Role::Prescribed(_)))]).collect()
    }
}

/// Nothing is known of what came before.
pub(super) fn unknown() -> SimError {
    let why = "the scene has inertia or tissue with a memory, and what came before this state is not known any more: \
               make a step, or set out from an equilibrium";
    SimError::NoDerivative(why.into())
}
