//! What the accepted state came from besides its inputs; held while derivatives are taken.

use super::step::{Piece, Workspace, in_time};
use super::{Model, SimError, State};
use crate::fem::{At, Dofs, Role};
use crate::math::Vec3;

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
        let why = "the scene has inertia or tissue with a memory, and what came before this state is not known any more: \
                   make a step, or set out from an equilibrium";
        work.piece_to(state).ok_or_else(|| SimError::NoDerivative(why.into()))
    }

    /// The past of that piece.
    pub fn new(model: &Model, piece: Piece, work: &Workspace) -> Past {
        let inertia = model.parts().inertia.as_ref().filter(|_| piece.dt > 0.0);
        let formula = inertia.map(|i| (i.scheme.formula(piece.dt, piece.dt_before), i.damping_mass));
        let (history, x_tilde) = work.before_last();
        Past {
            piece,
            history: history.to_vec(),
            x_tilde: x_tilde.to_vec(),
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
