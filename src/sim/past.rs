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
    /// The past of `state`.
    ///
    /// # Errors
    /// [`SimError::NoDerivative`] where it matters and is no longer known.
    pub fn of(model: &Model, state: &State, work: &Workspace) -> Result<Past, SimError> {
        let nothing = Past {
            piece: Piece { number: 0, t: state.t, dt: 0.0, dt_before: 0.0 },
            history: Vec::new(),
            x_tilde: Vec::new(),
            rates: [0.0; 2],
            follows: 0.0,
        };
        if !model.remembers() {
            return Ok(nothing);
        }
        let Some((piece, history, x_tilde)) = work.piece_to(state) else {
            let why = "the scene has inertia or tissue with a memory, and what came before this state is not known any more: \
                       make a step, or set out from an equilibrium";
            return Err(SimError::NoDerivative(why.into()));
        };
        let past = Past { piece, history: history.to_vec(), x_tilde: x_tilde.to_vec(), ..nothing };
        Ok(match model.parts().inertia.as_ref().filter(|_| piece.dt > 0.0) {
            None => past,
            Some(inertia) => {
                let formula = inertia.scheme.formula(piece.dt, piece.dt_before);
                let rates = [false, true].map(|of_bone| formula.rate(of_bone));
                Past { rates, follows: formula.follows_bone(inertia.damping_mass), ..past }
            }
        })
    }

    /// Whether both are of one piece of time, or of none.
    pub fn is_same(&self, other: &Past) -> bool {
        self.piece.number == other.piece.number
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
