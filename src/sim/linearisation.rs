//! Where and how a stiffness was factored. Part of the state, so that a restored simulation repeats its bits.

use super::model::Model;
use super::motion::in_time;
use super::targets::{read_pivots, read_wrenches};
use crate::fem::{At, Configuration};
use crate::math::Vec3;
use crate::solve::Problem;

/// All that a factor follows from.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Linearisation {
    pub config: Configuration,
    pub t: f64,
    pub dt: f64,
    /// Length of the piece of time before, s.
    pub dt_before: f64,
    pub inputs: Vec<f64>,
    pub history: Vec<f64>,
    /// Empty in quasi-static scenes.
    pub x_tilde: Vec<Vec3>,
}

impl Linearisation {
    /// At `config`, with what terms see there.
    pub fn new(config: &Configuration, at: &At, dt_before: f64) -> Linearisation {
        Linearisation {
            config: config.clone(),
            t: at.t,
            dt: at.dt,
            dt_before,
            inputs: at.inputs.to_vec(),
            history: at.history.to_vec(),
            x_tilde: at.x_tilde.to_vec(),
        }
    }

    /// What terms saw when it was made.
    pub fn at(&self, model: &Model) -> At<'_> {
        let Linearisation { t, dt, inputs, history, x_tilde, .. } = self;
        in_time(model, At { t: *t, dt: *dt, inputs, history, x_tilde, ..At::NOWHERE }, self.dt_before)
    }
}

/// What is minimised where terms see `at`; pivots and wrenches are those of its inputs.
pub(super) fn with_problem<R>(model: &Model, at: At, body: impl FnOnce(&Problem) -> R) -> R {
    let parts = model.parts();
    let mut pivots = vec![Vec3::zeros(); parts.bones.len()];
    read_pivots(model, at.inputs, &mut pivots);
    let mut wrenches = vec![(Vec3::zeros(), Vec3::zeros()); model.dofs().bodies.len()];
    read_wrenches(model, at.inputs, &mut wrenches);
    body(&Problem {
        terms: &parts.terms,
        dofs: model.dofs(),
        X: &parts.mesh.nodes,
        pivots: &pivots,
        wrenches: &wrenches,
        at,
    })
}
