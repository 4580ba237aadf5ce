//! Derivatives of a step in modes: it is taken again with its inputs moved, which costs microseconds.
//!
//! The step is affine in all inputs but turns, so central differences are good to nine digits; the adjoint asks for one input
//! after another.

use super::audit::strain;
use super::modal::{self, Last};
use super::modes::Modal;
use super::past::unknown;
use super::step::complete;
use super::workspace::Workspace;
use super::{Model, Sim, SimError, State, View};

/// Largest change of an input in a difference, in its SI unit.
const CHANGE: f64 = 1e-5;

impl Sim {
    /// As [`Sim::directional_derivative`], along a direction of all inputs.
    pub(super) fn replayed(
        &mut self,
        direction: &[f64],
        unknowns: &[usize],
        sensitivity: &mut [f64],
    ) -> Result<(), SimError> {
        let scale = direction.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        sensitivity.fill(0.0);
        if scale == 0.0 {
            return Ok(());
        }
        let h = CHANGE / scale;
        let mut values = vec![0.0; sensitivity.len()];
        for side in [1.0, -1.0] {
            let moved = self.state.applied.iter().zip(direction).map(|(value, d)| value + side * h * d).collect();
            let state = again(&self.model, &self.state, &mut self.work, moved)?;
            let strain = || {
                let mut whole = state.clone();
                complete(&self.model, &mut whole, &self.work);
                strain(&self.model, &whole, &whole.config.x)
            };
            let view = View { model: &self.model, state: &state, strain: &strain };
            let mut left = &mut values[..];
            for &unknown in unknowns {
                let (now, later) = left.split_at_mut(self.model.ports()[unknown].len());
                view.get_f64(unknown, 0, now)?;
                left = later;
            }
            sensitivity.iter_mut().zip(&values).for_each(|(s, value)| *s += side * value / (2.0 * h));
        }
        Ok(())
    }

    /// As [`Sim::adjoint_derivative`], by these elements of all inputs.
    pub(super) fn replayed_adjoint(
        &mut self,
        unknowns: &[usize],
        seed: &[f64],
        elements: impl Iterator<Item = usize>,
        sensitivity: &mut [f64],
    ) -> Result<(), SimError> {
        let mut column = vec![0.0; seed.len()];
        let mut direction = vec![0.0; self.state.applied.len()];
        for (k, out) in elements.zip(sensitivity) {
            direction[k] = 1.0;
            self.replayed(&direction, unknowns, &mut column)?;
            direction[k] = 0.0;
            *out = column.iter().zip(seed).map(|(c, w)| c * w).sum();
        }
        Ok(())
    }
}

/// The state that the last step would have led to from the same past under other inputs.
fn again(model: &Model, state: &State, work: &mut Workspace, inputs: Vec<f64>) -> Result<State, SimError> {
    let refused = |why: &str| Err(SimError::NoDerivative(why.into()));
    let recalled = work.kept.modal.take_if(|last| last.led_to(state));
    let (minimiser, modal) = work.modal();
    if let Some(last) = recalled {
        if !modal.as_ref().is_some_and(|modal| modal.map.serves(&state.applied)) {
            *modal = Some(Box::new(Modal::new(model, minimiser, &state.applied)?.0));
        }
        modal.as_mut().expect("made above").last = last;
    }
    let made = modal.as_mut().filter(|modal| modal.last.led_to(state)).ok_or_else(unknown)?;
    if !made.map.serves(&inputs) {
        return refused(
            "moduli and pivots change the modes themselves: ask for no derivatives by them, or leave `modes` out",
        );
    }
    let last = made.last.clone();
    let Last { from, t, dt, dt_before, .. } = &last;
    let mut probe = state.clone();
    (probe.modal, probe.t, probe.motion.dt, probe.inputs) = (from.clone(), t - dt, *dt_before, inputs);
    let end = modal::advance(model, &mut probe, minimiser, modal, *dt);
    if let Some(made) = modal {
        made.last = last;
    }
    end.map(|_| probe)
}
