//! A simulation: what (the [`Model`]), where (the [`State`]), and the scratch of the solver.
#![forbid(unsafe_code)]
#![allow(non_snake_case)]

mod access;
mod adjoint;
mod ahead;
mod approach;
mod audit;
mod derivative;
mod linear_map;
mod linearisation;
mod modal;
mod model;
mod modes;
mod motion;
mod outputs;
mod pace;
mod past;
mod piece;
mod pieces;
mod ports;
mod recover;
mod replay;
mod report;
mod scheme;
mod skin;
mod start;
mod state;
mod step;
mod swing;
mod targets;
mod workspace;

pub use access::View;
pub use audit::{Place, worst_tets};
pub use model::{
    Bone, Contact, Drive, Inertia, Marker, Model, ModelParts, Reduction, StandIn, Unconstrained, osteotomy_edges,
    spans_a_plane, usual_solves,
};
pub use modes::Spectrum;
pub use ports::Layout;
pub(crate) use ports::MOST_TUNABLE;
pub use report::StepReport;
pub use scheme::Scheme;
pub use skin::Skin;
pub use state::{State, StateError};
pub(crate) use swing::undamped;

use std::sync::{Arc, OnceLock};

use past::Origin;

use crate::fem::Strain;
pub use crate::solve::{Allowance, SolveError};

/// Steps (s) outside of these make squares of dt overflow.
const SHORTEST_STEP: f64 = 1e-100;
const LONGEST_STEP: f64 = 1e100;

/// Why a simulation refused a call. The state is still the last accepted one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimError {
    /// The solver gave up, also with the host step cut into small pieces.
    #[error(
        "step from t = {t:?} s by {dt:?} s: {source} ({:.0} % of the step was reached, it was cut down to 1/{cuts}, {spent} linear solves spent{})",
        100.0 * reached,
        place.as_ref().map_or(String::new(), |place| format!("; worst element: {place}"))
    )]
    Solve {
        /// Start of the step, s.
        t: f64,
        /// Length of the step, s.
        dt: f64,
        /// The smallest piece tried was one part in this many.
        cuts: u32,
        /// Linear solves spent.
        spent: u32,
        /// All work in linear solves, forces and factors counted by what they take of one.
        work: f64,
        /// Share of the step that had an answer.
        reached: f64,
        /// The worst element where the solver gave up; `None` where that tells nothing.
        place: Option<Box<Place>>,
        /// What the solver said.
        source: SolveError,
    },
    /// The solver cannot be set up for this model.
    #[error(transparent)]
    Setup(#[from] SolveError),
    /// The step length is no positive number.
    #[error("a step must be a positive, finite number of seconds, from 1e-100 to 1e100; found {0:?}")]
    StepLength(f64),
    /// The table of a scene in modes would be too large.
    #[error(
        "{columns} inputs and modes would fill a table of {bytes} bytes, the limit is {limit} and what the machine gives: take fewer `modes` of \
         [inertia], drive bones by pose instead of node by node, or leave `modes` out"
    )]
    TooManyModes {
        /// Inputs and modes.
        columns: usize,
        /// Size of the table.
        bytes: usize,
        /// Most.
        limit: usize,
    },
    /// An input is NaN or infinite.
    #[error("input `{name}` is {value:?}; every input must be a finite number")]
    NotFinite {
        /// Port and element, 1-based: `bone.translation[2,1]`.
        name: String,
        /// What was found.
        value: f64,
    },
    /// A modulus is not positive.
    #[error("`{name}` is {value:?} Pa; a modulus must be positive")]
    NotPositive {
        /// Port.
        name: String,
        /// What was found, Pa.
        value: f64,
    },
    /// An input moves or pushes a bone that is not driven that way.
    #[error(
        "input `{name}` is {value:?}, but bone `{bone}` is {drive}: it takes no such input; change its `drive` in the scene"
    )]
    NotDriven {
        /// Port and element, 1-based.
        name: String,
        /// What was found.
        value: f64,
        /// Name of the bone.
        bone: String,
        /// How it is driven.
        drive: Drive,
    },
    /// No such port, or one of another type or causality.
    #[error("port {port} of {n_ports} is not {wanted}")]
    Port {
        /// Index asked for.
        port: usize,
        /// Ports in the model.
        n_ports: usize,
        /// What was wanted of it.
        wanted: &'static str,
    },
    /// A range of values outside a port.
    #[error("`{name}` has {len} values; {offset} to {end} were asked for")]
    Range {
        /// Name of the port.
        name: String,
        /// Values it has.
        len: usize,
        /// First value asked for, 0-based.
        offset: usize,
        /// One past the last value asked for.
        end: usize,
    },
    /// A state that belongs to another model, be it another material on the same mesh.
    #[error(transparent)]
    ForeignState(#[from] StateError),
    /// A bound that leaves no work at all.
    #[error("`{name}` was set to {value}; a step takes one linear solve at least")]
    TooFew {
        /// Port.
        name: String,
        /// What was found.
        value: i32,
    },
    /// A seed is NaN or infinite.
    #[error("element {0} of the seed is not finite")]
    SeedNotFinite(usize),
    /// A start that has not one position for each node.
    #[error("a start takes one position for each of the {wanted} nodes; found {found}")]
    StartLength {
        /// Positions found.
        found: usize,
        /// Nodes of the model.
        wanted: usize,
    },
    /// A start position is NaN or infinite.
    #[error("the start position of node {node} is ({x}, {y}, {z}); every position must be finite")]
    StartNotFinite {
        /// Node, 0-based.
        node: usize,
        /// Position found.
        x: f64,
        /// Position found.
        y: f64,
        /// Position found.
        z: f64,
    },
    /// A derivative that the scene or the state does not have.
    #[error("no derivative: {0}")]
    NoDerivative(String),
    /// The start equilibrium of a dynamic scene whose tissue, or a part of it, nothing holds.
    #[error(
        "no start equilibrium: {0} piece(s) of tissue are held by no bone, the largest around ({1:.4}, {2:.4}, {3:.4}) m: set out \
         at rest, with start = \"rest\" in [inertia], or attach a bone there"
    )]
    LooseStart(usize, f64, f64, f64),
    /// `[inertia] start = "rest"` with bones that do not start at rest.
    #[error(
        "the scene starts at rest, but bone `{0}` does not: give it a start pose of zero or start = \"equilibrium\""
    )]
    NotAtRest(String),
}

/// One simulation of a model.
pub struct Sim {
    model: Arc<Model>,
    state: State,
    work: workspace::Workspace,
    /// Strain of the accepted state, once somebody asked for it.
    strain: OnceLock<Strain>,
    /// All nodes where the state holds only those that ports read, once somebody asked for them.
    whole: OnceLock<Vec<crate::math::Vec3>>,
    /// Made when the first derivative is asked for.
    sensitivity: Option<Box<derivative::Sensitivity>>,
}

impl Sim {
    /// At rest, t = 0, inputs at their start values. Analyses the matrix; solves nothing.
    ///
    /// # Errors
    /// [`SimError::Setup`] for a model whose factor would not fit into memory.
    pub fn new(model: Arc<Model>) -> Result<Sim, SimError> {
        let state = State::start(&model);
        let work = workspace::Workspace::new(&model)?;
        Ok(Sim { model, state, work, strain: OnceLock::new(), whole: OnceLock::new(), sensitivity: None })
    }

    /// Lives on this allowance from now on, as another simulation did before.
    pub fn share(&mut self, allowance: &Arc<Allowance>) {
        self.work.allowance.clone_from(allowance);
    }

    /// What cancels its steps from another thread: see [`Allowance::cancel`].
    pub fn allowance(&self) -> &Arc<Allowance> {
        &self.work.allowance
    }

    /// The model it moves.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Whether it stands at an accepted equilibrium or step.
    pub fn is_settled(&self) -> bool {
        self.state.outputs.converged
    }

    /// Simulation time, s.
    pub fn time(&self) -> f64 {
        self.state.t
    }

    /// Sets the start time (s), before `initialise`.
    pub fn set_time(&mut self, t: f64) {
        self.state.t = t;
    }

    /// Seeks the equilibrium at the inputs as set, from rest, whatever came before; no time passes.
    ///
    /// # Errors
    /// As for [`Sim::step`].
    pub fn initialise(&mut self) -> Result<StepReport, SimError> {
        let mut state = self.state.at_rest(&self.model);
        self.work.allowance.grant(state.most_solves);
        let report = step::initialise(&self.model, &mut state, &mut self.work)?;
        self.state = state;
        self.forget();
        Ok(report)
    }

    /// Seeks the equilibrium under one group of inputs alone, all others as at rest.
    ///
    /// # Errors
    /// As for [`Sim::step`].
    ///
    /// # Panics
    /// If the model has no such inputs, or fewer.
    pub(crate) fn start_under(&mut self, slot: crate::port::Slot, values: &[f64]) -> Result<StepReport, SimError> {
        let first = self.model.parts().layout.first(slot).expect("the caller knows its scene");
        self.state.inputs.copy_from_slice(&state::rest_inputs(&self.model));
        self.state.inputs[first..first + values.len()].copy_from_slice(values);
        self.initialise()
    }

    /// Advances by `dt` seconds; all or nothing.
    ///
    /// A step spends `solver.mostSolves` linear solves at most, however it is cut: unless the scene or the host says otherwise
    /// five times `max_iterations`, with `[inertia] accuracy` for each of its pieces, of which there are 256 at most.
    ///
    /// # Errors
    /// [`SimError`]; the state is then the last accepted one, with the inputs as set.
    pub fn step(&mut self, dt: f64) -> Result<StepReport, SimError> {
        if !(SHORTEST_STEP..=LONGEST_STEP).contains(&dt) {
            return Err(SimError::StepLength(dt));
        }
        self.work.allowance.grant(self.state.most_solves);
        let report = step::advance(&self.model, &mut self.state, &mut self.work, dt)?;
        self.forget();
        Ok(report)
    }

    /// Begins the same step, to be gone on with piece by piece; dropped before its end it has changed nothing.
    ///
    /// # Errors
    /// As for [`Sim::step`].
    pub fn begin(&mut self, dt: f64) -> Result<Step<'_>, SimError> {
        if !(SHORTEST_STEP..=LONGEST_STEP).contains(&dt) {
            return Err(SimError::StepLength(dt));
        }
        self.work.allowance.grant(self.state.most_solves);
        let begun = step::begin(&self.model, &mut self.state, &mut self.work, dt)?;
        Ok(Step { sim: self, begun: Some(begun), piece: None })
    }

    /// The same; `watch` sees every piece of the step as soon as it is accepted. Pieces before one that fails are taken back.
    ///
    /// # Errors
    /// As for [`Sim::step`].
    pub fn step_watched(&mut self, dt: f64, watch: &mut dyn FnMut(&View)) -> Result<StepReport, SimError> {
        let mut step = self.begin(dt)?;
        loop {
            let report = step.go_on()?;
            step.look(|view| watch(view));
            if let Some(report) = report {
                return Ok(report);
            }
        }
    }

    /// How much the elements were strained by the last accepted step; found when first asked for.
    pub fn strain(&self) -> Strain {
        if !self.state.outputs.converged {
            return Strain { min_det_f: 1.0, max_stretch: 1.0, energy: 0.0 };
        }
        *self.strain.get_or_init(|| audit::strain(&self.model, &self.state, self.positions()))
    }

    /// Drops what was found out about the state before.
    fn forget(&mut self) {
        self.strain.take();
        self.whole.take();
    }

    /// A snapshot: time, positions, velocities, inputs, outputs and what the solver remembers.
    pub fn save(&self) -> State {
        let mut state = self.state.clone();
        step::complete(&self.model, &mut state, &self.work);
        self.work.keep(&self.model, &mut state);
        state
    }

    /// Returns to a snapshot; outputs are back at once, and the next step gives the same bits as it did then.
    ///
    /// # Errors
    /// [`SimError::ForeignState`].
    pub fn restore(&mut self, state: &State) -> Result<(), SimError> {
        state.belongs_to(&self.model)?;
        self.state.clone_from(state);
        self.work.recall(&mut self.state);
        self.forget();
        Ok(())
    }

    /// Puts the free nodes at the positions `x` (m, one for each node of the mesh) and forgets the linearisation: the
    /// next step seeks the equilibrium from there. Nodes of bones, time, velocities and outputs stay as they are. A scene in
    /// modes takes of the positions what its modes hold.
    ///
    /// # Errors
    /// [`SimError::StartLength`], [`SimError::StartNotFinite`], and as for [`Sim::spectrum`]; nothing has changed then.
    pub fn start_from(&mut self, x: &[crate::math::Vec3]) -> Result<(), SimError> {
        let wanted = self.model.mesh().nodes.len();
        if x.len() != wanted {
            return Err(SimError::StartLength { found: x.len(), wanted });
        }
        if let Some((node, x)) = x.iter().enumerate().find(|(_, x)| !x.iter().all(|c| c.is_finite())) {
            return Err(SimError::StartNotFinite { node, x: x.x, y: x.y, z: x.z });
        }
        self.strain();
        step::complete(&self.model, &mut self.state, &self.work);
        if step::start_from(&self.model, &mut self.state, &mut self.work, x)? {
            return Ok(());
        }
        for &a in &self.model.dofs().free {
            self.state.config.x[a as usize] = x[a as usize];
        }
        self.state.linearisation = None;
        self.state.outputs.least = State::UNSEEN;
        self.state.motion.memory.fill([crate::math::Vec3::zeros(); 2]);
        self.state.motion.dt = 0.0;
        self.state.motion.free = None;
        self.work.kept.origin = Origin::Unknown;
        Ok(())
    }

    /// As after [`Sim::new`].
    pub fn reset(&mut self) {
        self.state = State::start(&self.model);
        self.work.kept.origin = Origin::Unknown;
        self.forget();
    }

    /// The solver's current positions, m, by node of the mesh.
    pub fn positions(&self) -> &[crate::math::Vec3] {
        if !self.state.partial {
            return &self.state.config.x;
        }
        self.whole.get_or_init(|| self.save().config.x)
    }

    /// What the modes of a scene hold and what they leave out, under the inputs as set; `None` for scenes not in modes.
    ///
    /// # Errors
    /// [`SimError::TooManyModes`], and [`SimError::Setup`] if the modes are not found.
    pub fn spectrum(&mut self) -> Result<Option<Spectrum>, SimError> {
        step::spectrum(&self.model, &self.state, &mut self.work)
    }

    /// Where the solver gave up, m, by node of the mesh: of the last step that was refused for want of an answer.
    pub fn refused(&self) -> Option<&[crate::math::Vec3]> {
        self.work.refused()
    }

    /// Bytes of matrices, factor and solver, twice that with a factor made in the background; those of the model and of the
    /// state left out.
    pub fn memory(&self) -> usize {
        self.work.minimiser().memory() * if self.model.parts().background { 2 } else { 1 }
    }

    /// What a good step takes, in linear solves: some of them, and a factor.
    pub fn good_step(&self) -> f64 {
        self.work.minimiser().good_step()
    }

    /// Stored entries of the stiffness matrix's factor (8 bytes each).
    pub fn factor_len(&self) -> usize {
        self.work.minimiser().factor_len()
    }
}

/// A step of a simulation under way.
pub struct Step<'a> {
    sim: &'a mut Sim,
    /// What there is to go on with.
    begun: Option<step::Begun>,
    /// Where the last piece ended, if the step did not end with it.
    piece: Option<Box<State>>,
}

impl Step<'_> {
    /// Goes on to the end of the next piece; the report once that is the end of the step.
    ///
    /// # Errors
    /// As for [`Sim::step`]; there is no way on then.
    ///
    /// # Panics
    /// After the end of the step, or an error.
    pub fn go_on(&mut self) -> Result<Option<StepReport>, SimError> {
        let Sim { model, state, work, .. } = &mut *self.sim;
        let report = match self.begun.take().expect("the step goes on") {
            step::Begun::Done(report) => report,
            step::Begun::Running(mut run) => match run.go_on(model, state, work, true)? {
                pieces::Progress::Done(report) => report,
                pieces::Progress::Piece(piece) => {
                    (self.begun, self.piece) = (Some(step::Begun::Running(run)), Some(piece));
                    return Ok(None);
                }
            },
        };
        self.piece = None;
        self.sim.forget();
        Ok(Some(report))
    }

    /// Shows where the last piece ended.
    pub fn look(&self, watch: impl FnOnce(&View)) {
        let model = &self.sim.model;
        match &self.piece {
            Some(state) => {
                let strain = || audit::strain(model, state, &state.config.x);
                watch(&View { model, state, strain: &strain });
            }
            None => watch(&self.sim.view(&|| self.sim.strain())),
        }
    }
}
