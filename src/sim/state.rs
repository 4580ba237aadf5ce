//! What evolves: cloned for a snapshot, serialized for another process.

use std::sync::Arc;

use sha2::{Digest, Sha256};

use super::linearisation::Linearisation;
use super::modal::Coordinates;
use super::model::Model;
use super::motion::Motion;
use super::past::Before;
use super::swing::Free;
use crate::bytes::{Reader, Truncated, Writer};
use crate::fem::Configuration;
use crate::math::{Mat3, Pose, Vec3};

/// A linearisation at an accepted state that is taken up once its factor has had the time to be made beside the steps.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Upcoming {
    pub linearisation: Arc<Linearisation>,
    /// Linear solves until then.
    pub solves: u32,
}

/// What the last step left for the host to read.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Outputs {
    pub reaction_force: Vec<Vec3>,
    pub reaction_torque: Vec<Vec3>,
    pub iterations: u32,
    pub residual: f64,
    pub converged: bool,
    pub kinetic: f64,
    /// Smallest det F; [`State::UNSEEN`] where nobody looked.
    pub least: f64,
    /// Length of the step, s.
    pub dt: f64,
}

/// A snapshot of a simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Token of the model that it is a state of.
    model: Arc<str>,
    pub(super) t: f64,
    pub(super) config: Configuration,
    /// Whether only the nodes that ports read are where they belong; never so in a snapshot.
    pub(super) partial: bool,
    /// What inertia knows of the steps before.
    pub(super) motion: Motion,
    /// The same in modes of vibration; empty in scenes without.
    pub(super) modal: Coordinates,
    /// What terms remember of the steps before (viscous overstress); empty in scenes without.
    pub(super) history: Vec<f64>,
    /// Inputs as the host set them last.
    pub(super) inputs: Vec<f64>,
    /// Inputs of the last accepted step: where the next one starts from.
    pub(super) applied: Vec<f64>,
    pub(super) linearisation: Option<Arc<Linearisation>>,
    /// Never there without `[solver] background`.
    pub(super) upcoming: Option<Upcoming>,
    pub(super) outputs: Outputs,
    /// Most linear solves of a step, as the host set it last.
    pub(super) most_solves: u32,
    /// What came before the last step, for its derivatives; in snapshots of scenes that remember, nowhere else.
    pub(super) before: Option<Arc<Before>>,
}

/// Why bytes are no state of this model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StateError {
    /// The first bytes are not those of a state.
    #[error("these bytes are no saved cutis state (they begin with {0:02x?})")]
    Magic(Vec<u8>),
    /// A format this version cannot read.
    #[error("the saved state has format {found}; this version reads format {wanted}")]
    Format {
        /// Found.
        found: u32,
        /// Readable.
        wanted: u32,
    },
    /// It was saved by another model.
    #[error("the saved state belongs to model {found}; this model is {wanted}")]
    Model {
        /// Token found.
        found: String,
        /// Token of this model.
        wanted: String,
    },
    /// The checksum does not match.
    #[error("the saved state is damaged: its checksum does not match its content")]
    Checksum,
    /// A position, velocity or memory that no step leads to.
    #[error("the saved state holds numbers that are not finite: no simulation has written it")]
    NotFinite,
    /// It ends too early.
    #[error("the saved state is cut short: {0}")]
    Truncated(#[from] Truncated),
    /// A list has the wrong length.
    #[error("the saved state holds {found} {what}; the model has {wanted}")]
    Length {
        /// What is counted.
        what: &'static str,
        /// Found.
        found: usize,
        /// Wanted.
        wanted: usize,
    },
}

const MAGIC: &[u8; 8] = b"cutis-st";
const FORMAT: u32 = 6;

impl State {
    /// A det F that says nothing.
    pub(super) const UNSEEN: f64 = f64::NEG_INFINITY;

    /// At rest, t = 0, inputs at their start values.
    pub(super) fn start(model: &Model) -> State {
        let parts = model.parts();
        let n = parts.bones.len();
        State {
            model: model.shared_token(),
            t: 0.0,
            config: Configuration { x: parts.mesh.nodes.clone(), poses: vec![Pose::REST; n] },
            partial: false,
            motion: Motion::still(parts.mesh.nodes.len(), parts.inertia.as_ref()),
            modal: Coordinates::still(model),
            history: vec![0.0; parts.n_history],
            inputs: parts.start.clone(),
            applied: rest_inputs(model),
            linearisation: None,
            upcoming: None,
            outputs: Outputs {
                reaction_force: vec![Vec3::zeros(); n],
                reaction_torque: vec![Vec3::zeros(); n],
                iterations: 0,
                residual: 0.0,
                converged: false,
                kinetic: 0.0,
                least: State::UNSEEN,
                dt: 0.0,
            },
            most_solves: parts.most_solves,
            before: None,
        }
    }

    /// Rest, with time, inputs and bound of work as the host set them: where the way to these inputs begins anew.
    pub(super) fn at_rest(&self, model: &Model) -> State {
        State { t: self.t, inputs: self.inputs.clone(), most_solves: self.most_solves, ..State::start(model) }
    }

    /// Whether it is a state of this model: of no other mesh, and of no other material on the same mesh.
    ///
    /// # Errors
    /// [`StateError::Model`].
    pub fn belongs_to(&self, model: &Model) -> Result<(), StateError> {
        if *self.model == *model.token() {
            return Ok(());
        }
        Err(StateError::Model { found: self.model.to_string(), wanted: model.token().into() })
    }

    /// Whether all that steps make is; inputs are the host's, who may have set anything.
    fn is_finite(&self) -> bool {
        let config = |c: &Configuration| {
            let poses = c.poses.iter().flat_map(|pose| pose.t.iter().chain(pose.R.iter()));
            c.x.iter().flatten().chain(poses).all(|v| v.is_finite())
        };
        let made = |l: &Linearisation| {
            config(&l.config) && l.x_tilde.iter().flatten().chain(&l.inputs).chain(&l.history).all(|v| v.is_finite())
        };
        let moving = self.motion.v.iter().chain(&self.motion.a).chain(self.motion.memory.as_flattened()).flatten();
        config(&self.config)
            && self.modal.is_finite()
            && moving.chain(&self.history).chain(&self.applied).all(|v| v.is_finite())
            && self.before.as_ref().is_none_or(|before| before.is_finite())
            && self.linearisation.iter().chain(self.upcoming.iter().map(|u| &u.linearisation)).all(|l| made(l))
    }

    /// Versioned, checksummed little-endian bytes; readable in another process with the same model, to which it must belong.
    pub fn to_bytes(&self, model: &Model) -> Vec<u8> {
        let mut body = Writer::default();
        body.text(&self.model);
        body.f64(self.t);
        put_config(&mut body, &self.config);
        put_vectors(&mut body, &self.motion.v);
        put_vectors(&mut body, &self.motion.a);
        put_vectors(&mut body, self.motion.memory.as_flattened());
        body.f64(self.motion.dt);
        body.f64(self.motion.next_dt);
        body.u32(u32::from(self.motion.free.is_some()));
        if let Some(Free { most, swing }) = self.motion.free {
            body.f64s([most, swing].into_iter());
        }
        if model.is_reduced() {
            put_coordinates(&mut body, &self.modal);
        }
        body.f64s(self.history.iter().copied());
        body.f64s(self.inputs.iter().copied());
        body.f64s(self.applied.iter().copied());
        let o = &self.outputs;
        put_vectors(&mut body, &o.reaction_force);
        put_vectors(&mut body, &o.reaction_torque);
        body.u32(o.iterations);
        body.u32(u32::from(o.converged));
        [o.residual, o.kinetic, o.least, o.dt].into_iter().for_each(|v| body.f64(v));
        body.u32(u32::from(self.linearisation.is_some()));
        if let Some(l) = &self.linearisation {
            put_linearisation(&mut body, l);
        }
        body.u32(u32::from(self.upcoming.is_some()));
        if let Some(upcoming) = &self.upcoming {
            put_linearisation(&mut body, &upcoming.linearisation);
            body.u32(upcoming.solves);
        }
        body.u32(self.most_solves);
        body.u32(u32::from(self.before.is_some()));
        if let Some(before) = &self.before {
            put_before(&mut body, before);
        }
        let mut out = Writer::default();
        out.raw(MAGIC);
        out.u32(FORMAT);
        out.raw(&Sha256::digest(&body.0));
        out.raw(&body.0);
        out.0
    }

    /// The state that [`State::to_bytes`] wrote.
    ///
    /// # Errors
    /// [`StateError`], for foreign, damaged or cut bytes.
    pub fn from_bytes(bytes: &[u8], model: &Model) -> Result<State, StateError> {
        let mut head = Reader::new(bytes);
        let magic = head.raw(8.min(bytes.len()))?;
        if magic != MAGIC {
            return Err(StateError::Magic(magic.to_vec()));
        }
        let found = head.u32()?;
        if found != FORMAT {
            return Err(StateError::Format { found, wanted: FORMAT });
        }
        let checksum = head.raw(32)?;
        let body = head.raw(head.left())?;
        if Sha256::digest(body).as_slice() != checksum {
            return Err(StateError::Checksum);
        }
        let mut r = Reader::new(body);
        let token = r.text()?;
        if token != model.token() {
            return Err(StateError::Model { found: token, wanted: model.token().into() });
        }
        let parts = model.parts();
        let (n, n_bones) = (parts.mesh.nodes.len(), parts.bones.len());
        let n_inputs = parts.layout.len();
        let t = r.f64()?;
        let config = take_config(&mut r, n, n_bones)?;
        let motion = take_motion(&mut r, &Motion::still(n, parts.inertia.as_ref()))?;
        let still = Coordinates::still(model);
        let modal = if model.is_reduced() { take_coordinates(&mut r, &still)? } else { still };
        let history = take_f64s(&mut r, "remembered values", parts.n_history)?;
        let inputs = take_f64s(&mut r, "inputs", n_inputs)?;
        let applied = take_f64s(&mut r, "inputs", n_inputs)?;
        let reaction_force = take_vectors(&mut r, "reactions", n_bones)?;
        let reaction_torque = take_vectors(&mut r, "reactions", n_bones)?;
        let (iterations, converged) = (r.u32()?, r.u32()? != 0);
        let [residual, kinetic, least, dt] = [r.f64()?, r.f64()?, r.f64()?, r.f64()?];
        let linearisation = match r.u32()? {
            0 => None,
            _ => Some(Arc::new(take_linearisation(&mut r, model)?)),
        };
        let upcoming = match r.u32()? {
            0 => None,
            _ => Some(Upcoming { linearisation: Arc::new(take_linearisation(&mut r, model)?), solves: r.u32()? }),
        };
        let most_solves = r.u32()?;
        let before = match r.u32()? {
            0 => None,
            _ => Some(Arc::new(take_before(&mut r, model)?)),
        };
        let outputs = Outputs { reaction_force, reaction_torque, iterations, residual, converged, kinetic, least, dt };
        let state = State {
            model: model.shared_token(),
            t,
            config,
            partial: false,
            motion,
            modal,
            history,
            inputs,
            applied,
            linearisation,
            upcoming,
            outputs,
            most_solves,
            before,
        };
        if state.is_finite() { Ok(state) } else { Err(StateError::NotFinite) }
    }
}

/// The inputs under which the rest state is in equilibrium: no motion, no load; parameters as they start.
pub(super) fn rest_inputs(model: &Model) -> Vec<f64> {
    (0..model.parts().layout.len()).map(|k| rest_input(model, k)).collect()
}

/// Whether these are those inputs.
pub(super) fn are_at_rest(model: &Model, inputs: &[f64]) -> bool {
    inputs.iter().enumerate().all(|(k, value)| *value == rest_input(model, k))
}

fn rest_input(model: &Model, k: usize) -> f64 {
    let parts = model.parts();
    let pivots = parts.layout.first(crate::port::Slot::BonePivot).map(|first| first..first + 3 * parts.bones.len());
    let is_parameter = k < parts.tunable.len() || pivots.is_some_and(|pivots| pivots.contains(&k));
    if is_parameter { parts.start[k] } else { 0.0 }
}

fn put_vectors(w: &mut Writer, vectors: &[Vec3]) {
    w.len(vectors.len());
    vectors.iter().flat_map(|v| v.iter()).for_each(|c| w.f64(*c));
}

fn put_config(w: &mut Writer, config: &Configuration) {
    put_vectors(w, &config.x);
    w.len(config.poses.len());
    for pose in &config.poses {
        pose.t.iter().chain(pose.R.iter()).for_each(|c| w.f64(*c));
    }
}

fn put_linearisation(w: &mut Writer, l: &Linearisation) {
    put_config(w, &l.config);
    [l.t, l.dt, l.dt_before].into_iter().for_each(|v| w.f64(v));
    w.f64s(l.inputs.iter().copied());
    w.f64s(l.history.iter().copied());
    put_vectors(w, &l.x_tilde);
}

fn take_linearisation(r: &mut Reader, model: &Model) -> Result<Linearisation, StateError> {
    let parts = model.parts();
    let n = parts.mesh.nodes.len();
    Ok(Linearisation {
        config: take_config(r, n, parts.bones.len())?,
        t: r.f64()?,
        dt: r.f64()?,
        dt_before: r.f64()?,
        inputs: take_f64s(r, "inputs", parts.layout.len())?,
        history: take_f64s(r, "remembered values", parts.n_history)?,
        x_tilde: take_vectors(r, "inertial predictions", if parts.inertia.is_some() { n } else { 0 })?,
    })
}

fn put_coordinates(w: &mut Writer, c: &Coordinates) {
    let Coordinates { p, v, memory, p_before, q, q_before, rate, pace } = c;
    [&p[..], v, memory.as_flattened(), p_before].into_iter().for_each(|list| put_vectors(w, list));
    [q, q_before, rate, pace].into_iter().for_each(|list| w.f64s(list.iter().copied()));
}

fn expect_len(what: &'static str, found: usize, wanted: usize) -> Result<(), StateError> {
    if found == wanted { Ok(()) } else { Err(StateError::Length { what, found, wanted }) }
}

fn take_vectors(r: &mut Reader, what: &'static str, wanted: usize) -> Result<Vec<Vec3>, StateError> {
    let n = r.len(24)?;
    expect_len(what, n, wanted)?;
    (0..n).map(|_| Ok(Vec3::new(r.f64()?, r.f64()?, r.f64()?))).collect()
}

fn take_motion(r: &mut Reader, like: &Motion) -> Result<Motion, StateError> {
    let v = take_vectors(r, "velocities", like.v.len())?;
    let a = take_vectors(r, "accelerations", like.a.len())?;
    let memory = take_vectors(r, "remembered motions", 2 * like.memory.len())?;
    let memory = memory.chunks_exact(2).map(|m| [m[0], m[1]]).collect();
    let (dt, next_dt) = (r.f64()?, r.f64()?);
    let free = match r.u32()? {
        0 => None,
        _ => Some(Free { most: r.f64()?, swing: r.f64()? }),
    };
    Ok(Motion { v, a, memory, dt, next_dt, free })
}

/// Those of scenes in modes; other scenes write none.
fn take_coordinates(r: &mut Reader, like: &Coordinates) -> Result<Coordinates, StateError> {
    let (n, n_causes) = (like.p.len(), like.q.len());
    let mut vectors = |n: usize| take_vectors(r, "modal coordinates", n);
    let (p, v, memory, p_before) = (vectors(n)?, vectors(n)?, vectors(2 * n)?, vectors(n)?);
    let memory = memory.chunks_exact(2).map(|m| [m[0], m[1]]).collect();
    let mut numbers = || take_f64s(r, "causes", n_causes);
    let (q, q_before, rate, pace) = (numbers()?, numbers()?, numbers()?, numbers()?);
    Ok(Coordinates { p, v, memory, p_before, q, q_before, rate, pace })
}

fn put_before(w: &mut Writer, before: &Before) {
    let Before { at_rest, dt, dt_before, history, x_tilde, from } = before;
    w.u32(u32::from(*at_rest));
    [*dt, *dt_before].into_iter().for_each(|v| w.f64(v));
    w.f64s(history.iter().copied());
    put_vectors(w, x_tilde);
    w.u32(u32::from(from.is_some()));
    if let Some(from) = from {
        put_coordinates(w, from);
    }
}

fn take_before(r: &mut Reader, model: &Model) -> Result<Before, StateError> {
    let parts = model.parts();
    Ok(Before {
        at_rest: r.u32()? != 0,
        dt: r.f64()?,
        dt_before: r.f64()?,
        history: take_f64s(r, "remembered values", parts.n_history)?,
        x_tilde: take_vectors(
            r,
            "inertial predictions",
            if parts.inertia.is_some() { parts.mesh.nodes.len() } else { 0 },
        )?,
        from: match r.u32()? {
            0 => None,
            _ => Some(take_coordinates(r, &Coordinates::still(model))?),
        },
    })
}

fn take_f64s(r: &mut Reader, what: &'static str, wanted: usize) -> Result<Vec<f64>, StateError> {
    let values = r.f64s()?;
    expect_len(what, values.len(), wanted)?;
    Ok(values)
}

fn take_config(r: &mut Reader, n: usize, n_bones: usize) -> Result<Configuration, StateError> {
    let x = take_vectors(r, "nodes", n)?;
    let found = r.len(96)?;
    expect_len("bones", found, n_bones)?;
    let mut poses = Vec::with_capacity(found);
    for _ in 0..found {
        let t = Vec3::new(r.f64()?, r.f64()?, r.f64()?);
        let mut R = Mat3::zeros();
        for c in R.iter_mut() {
            *c = r.f64()?;
        }
        poses.push(Pose { t, R });
    }
    Ok(Configuration { x, poses })
}
