//! What both FMI versions share: a simulation, where it stands in its life, and the host's logger.
//!
//! All of it is safe code; `fmi2` and `fmi3` turn pointers into slices and call here.

use std::path::Path;
use std::sync::Arc;

use super::guard::{self, Denied, Guarded, Handle};
use super::logger::{Category, Logger, Status, Told};
use super::modes::{self, Call, Mode};
use super::resources;
use super::snapshot::Snapshot;
use crate::fmu::{self, FmiVersion};
use crate::port::{Causality, Port, Type};
use crate::sim::{Allowance, Model, Sim, SimError, StepReport, View};

/// Communication points may differ from the instance's time by this, relative to the larger of time and step: ten
/// steps of 0.1 add up to 0.9999999999999999.
const TIME_ROUNDING: f64 = 1e-9;

/// Why a call is answered with something else than OK.
#[derive(Debug)]
pub(super) struct Refusal {
    pub(super) status: Status,
    pub(super) message: String,
}

/// The answer of every call.
pub(super) type Answer = Result<(), Refusal>;

/// An illegal call or argument, or a failure that the instance cannot go on from.
pub(super) fn error(message: impl Into<String>) -> Refusal {
    Refusal { status: Status::Error, message: message.into() }
}

/// What cannot be had now, and ends nothing: the instance is as before the call.
pub(super) fn discard(message: impl Into<String>) -> Refusal {
    Refusal { status: Status::Discard, message: message.into() }
}

/// One FMU instance.
pub(super) struct Instance {
    pub(super) sim: Sim,
    pub(super) mode: Mode,
    /// In Initialization Mode: a value was set since the last equilibrium, so outputs are out of date.
    stale: bool,
    pub(super) start: Option<f64>,
    stop: Option<f64>,
    pub(super) logger: Logger,
    /// The archive that it came from.
    pub(super) version: FmiVersion,
    /// Saved states; the host holds their addresses and can name no other.
    #[expect(clippy::vec_box, reason = "addresses must not move when the list grows")]
    states: Vec<Box<Snapshot>>,
    poisoned: Option<String>,
}

impl Instance {
    /// A new instance of the archive whose description carries `token`.
    ///
    /// # Errors
    /// In words: the scene cannot be read, or it is not the one that was described.
    pub(super) fn open(
        token: &str,
        versions: &[FmiVersion],
        folder: Option<&Path>,
        logger: Logger,
    ) -> Result<Self, (Logger, String)> {
        let model = match resources::model(folder) {
            Ok(model) => model,
            Err(why) => return Err((logger, chain(&why))),
        };
        let described = |version: &&FmiVersion| fmu::token(&model, **version) == token;
        let Some(&version) = versions.iter().find(described) else {
            let why = format!(
                "the token is `{token}`, but the scene at hand has `{}`: the description is of another scene or version",
                model.token()
            );
            return Err((logger, why));
        };
        for warning in model.warnings() {
            logger.log(Status::Warning, Category::Warning, warning);
        }
        match Sim::new(Arc::new(model)) {
            Ok(sim) => Ok(Self {
                sim,
                mode: modes::INSTANTIATED,
                stale: false,
                start: None,
                stop: None,
                logger,
                version,
                states: Vec::new(),
                poisoned: None,
            }),
            Err(why) => Err((logger, chain(&why))),
        }
    }

    /// Runs one call of the standard: legal now? then `body`; then status, log and mode follow from its answer.
    pub(super) fn answer(&mut self, call: Call, error_mode: Mode, body: impl FnOnce(&mut Self) -> Answer) -> Status {
        let answer = if let Some(why) = &self.poisoned {
            Err(error(format!("the instance failed earlier (`{why}`); only reset and free are left")))
        } else if call.legal & self.mode == 0 {
            Err(error(format!("not legal in {}", modes::name(self.mode))))
        } else {
            body(self)
        };
        let Err(Refusal { status, message }) = answer else { return Status::Ok };
        let category = if status == Status::Discard { Category::Discard } else { Category::Error };
        if self.logger.hears(status, category) {
            self.logger.log(status, category, &format!("{}: {message}", call.name));
        }
        if status == Status::Error {
            self.mode = error_mode;
        }
        status
    }

    /// `EnterInitializationMode`, after `SetupExperiment` in FMI 2.0.
    pub(super) fn set_experiment(&mut self, tolerance: Option<f64>, start: f64, stop: Option<f64>) -> Answer {
        if let Some(tolerance) = tolerance.filter(|&t| !(t.is_finite() && t > 0.0)) {
            return Err(error(format!("tolerance {tolerance} is not positive")));
        }
        if !start.is_finite() {
            return Err(error(format!("start time {start} is not finite")));
        }
        if let Some(stop) = stop.filter(|stop| stop.is_nan() || *stop < start) {
            return Err(error(format!("stop time {stop} lies before start time {start}")));
        }
        if let Some(tolerance) = tolerance {
            let told =
                format!("tolerance {tolerance:e} is not used: `tolerance` of [solver] in the scene says how far");
            self.logger.log(Status::Ok, Category::NonlinearSystems, &told);
        }
        self.start = Some(start);
        self.stop = stop;
        self.sim.set_time(start);
        Ok(())
    }

    pub(super) fn enter_initialization(&mut self) -> Answer {
        self.mode = modes::INITIALIZATION;
        self.stale = true;
        Ok(())
    }

    pub(super) fn exit_initialization(&mut self) -> Answer {
        self.refresh()?;
        self.mode = modes::STEP;
        Ok(())
    }

    /// Finds the equilibrium of the start values if one of them moved since the last time. `Sim::initialise` seeks it from
    /// rest, so that a host which looks at outputs in between gets the same bits as one which does not.
    fn refresh(&mut self) -> Answer {
        if self.mode == modes::INITIALIZATION && self.stale {
            let report = self.sim.initialise().map_err(|why| discard(chain(&why)))?;
            self.tell("initial equilibrium", &report);
            self.stale = false;
        }
        Ok(())
    }

    /// Advances from `at` by `dt`, s. A step that fails leaves everything as it was and is a Discard.
    pub(super) fn step(&mut self, at: f64, dt: f64) -> Answer {
        self.check_step(at, dt)?;
        let stepped = self.sim.step(dt);
        self.conclude(stepped)
    }

    /// What came of a step.
    fn conclude(&self, stepped: Result<StepReport, SimError>) -> Answer {
        let report = stepped.map_err(|why| discard(chain(&why)))?;
        self.tell("step", &report);
        Ok(())
    }

    /// Whether a step from `at` by `dt`, s, may be made.
    fn check_step(&self, at: f64, dt: f64) -> Answer {
        if !(dt.is_finite() && dt > 0.0) {
            return Err(error(format!("communication step size {dt} is not positive and finite")));
        }
        let t = self.sim.time();
        let rounding = TIME_ROUNDING * t.abs().max(dt);
        let apart = (at - t).abs();
        if apart.is_nan() || apart > rounding {
            return Err(error(format!("current communication point {at} is not where the instance stands, {t}")));
        }
        if let Some(stop) = self.stop.filter(|&stop| t + dt > stop + TIME_ROUNDING * stop.abs().max(dt)) {
            return Err(error(format!("step from {t} by {dt} passes the stop time {stop}")));
        }
        Ok(())
    }

    fn tell(&self, what: &str, report: &StepReport) {
        for warning in &report.warnings {
            self.logger.log(Status::Warning, Category::Warning, warning);
        }
        if self.logger.hears(Status::Ok, Category::NonlinearSystems) {
            let text = format!(
                "{what} to t = {} s: {} iterations, residual {:.2e} N",
                self.sim.time(),
                report.iterations,
                report.residual
            );
            self.logger.log(Status::Ok, Category::NonlinearSystems, &text);
        }
    }

    pub(super) fn terminate(&mut self) -> Answer {
        self.mode = modes::TERMINATED;
        Ok(())
    }

    /// As after instantiation; logging and saved states stay. The one way back for a poisoned instance.
    pub(super) fn reset(&mut self) -> Answer {
        if self.poisoned.is_some() {
            let allowance = self.sim.allowance().clone();
            self.sim = Sim::new(self.sim.model().clone()).map_err(|why| error(chain(&why)))?;
            self.sim.share(&allowance);
            self.poisoned = None;
        } else {
            self.sim.reset();
        }
        self.mode = modes::INSTANTIATED;
        self.stale = false;
        self.start = None;
        self.stop = None;
        Ok(())
    }

    /// Whether a panic has left only reset and free.
    pub(super) fn is_poisoned(&self) -> bool {
        self.poisoned.is_some()
    }

    /// The port that a host means by an FMI 3.0 value reference.
    pub(super) fn port(&self, reference: u32, ty: Type) -> Result<(usize, &Port), Refusal> {
        port(self.sim.model(), reference, ty)
    }

    /// Brings outputs up to date where the standard wants it: in Initialization Mode, when `port` is computed from
    /// values that were set meanwhile. Between steps nothing is ever solved here.
    pub(super) fn before_get(&mut self, port: usize) -> Answer {
        if self.stale && self.mode == modes::INITIALIZATION && self.sim.model().ports()[port].is_computed() {
            return self.refresh();
        }
        Ok(())
    }

    /// Whether `values` may be written to port `k` from element `offset` on: in this mode, or else Error; by their size and by
    /// what the scene's bones take, or else Discard, for a host has better values to try.
    pub(super) fn check_set(&self, k: usize, offset: usize, values: &[f64]) -> Answer {
        let port = &self.sim.model().ports()[k];
        self.check_mode(port)?;
        let wrong = values.iter().position(|&v| {
            !v.is_finite() || port.min.is_some_and(|min| v < min) || port.max.is_some_and(|max| v > max)
        });
        if let Some(k) = wrong {
            let (min, max) = (port.min.unwrap_or(f64::NEG_INFINITY), port.max.unwrap_or(f64::INFINITY));
            return Err(discard(format!(
                "element {} of `{}` was set to {} {}, wanted a finite value from {min} to {max}",
                offset + k,
                port.name,
                values[k],
                port.unit
            )));
        }
        if port.ty == Type::Float64 {
            self.sim.check_f64(k, offset, values).map_err(|why| discard(chain(&why)))?;
        }
        Ok(())
    }

    /// Whether a port may be written in this mode at all.
    fn check_mode(&self, port: &Port) -> Answer {
        let legal = match port.causality {
            Causality::Input | Causality::TunableParameter => modes::INSTANTIATED | modes::INITIALIZATION | modes::STEP,
            Causality::Parameter => modes::INSTANTIATED | modes::INITIALIZATION,
            Causality::Independent | Causality::Output | Causality::Local | Causality::CalculatedParameter => 0,
        };
        if legal & self.mode == 0 {
            return Err(error(format!(
                "`{}` ({:?}) cannot be set in {}",
                port.name,
                port.causality,
                modes::name(self.mode)
            )));
        }
        Ok(())
    }

    /// Writes what [`Instance::check_set`] allowed.
    pub(super) fn set(&mut self, port: usize, offset: usize, values: &[f64]) -> Answer {
        self.stale = true;
        self.sim.set_f64(port, offset, values).map_err(|why| error(chain(&why)))
    }

    /// As [`Instance::check_set`].
    pub(super) fn check_i32(&mut self, port: usize, offset: usize, values: &[i32]) -> Answer {
        values.iter().zip(offset..).try_for_each(|(v, offset)| self.check_set(port, offset, &[f64::from(*v)]))
    }

    /// Writes what [`Instance::check_i32`] allowed; no equilibrium depends on it.
    pub(super) fn set_i32(&mut self, port: usize, offset: usize, values: &[i32]) -> Answer {
        self.sim.set_i32(port, offset, values).map_err(|why| error(chain(&why)))
    }

    pub(super) fn get_f64(&self, port: usize, offset: usize, out: &mut [f64]) -> Answer {
        self.sim.get_f64(port, offset, out).map_err(|why| error(chain(&why)))
    }

    /// Directional derivative of Float64 variables by Float64 inputs, all named by value reference.
    pub(super) fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        sensitivity: &mut [f64],
    ) -> Answer {
        let (unknowns, knowns) = self.before_derivative(unknowns, knowns)?;
        self.sim.directional_derivative(&knowns, seed, &unknowns, sensitivity).map_err(no_derivative)
    }

    /// First derivatives by time of elements of an output; no other order is known.
    pub(super) fn time_derivative(&self, port: usize, offset: usize, orders: &[i32], out: &mut [f64]) -> Answer {
        check_orders(orders)?;
        self.sim.time_derivative(port, offset, out).map_err(no_derivative)
    }

    /// Gradient of the unknowns weighted by `seed`, as [`Instance::directional_derivative`] transposed.
    pub(super) fn adjoint_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        sensitivity: &mut [f64],
    ) -> Answer {
        let (unknowns, knowns) = self.before_derivative(unknowns, knowns)?;
        self.sim.adjoint_derivative(&unknowns, seed, &knowns, sensitivity).map_err(no_derivative)
    }

    /// Ports of unknowns and knowns, with outputs brought up to date.
    fn before_derivative(&mut self, unknowns: &[u32], knowns: &[u32]) -> Result<(Vec<usize>, Vec<usize>), Refusal> {
        let ports = |references: &[u32]| -> Result<Vec<usize>, Refusal> {
            references.iter().map(|&r| Ok(self.port(r, Type::Float64)?.0)).collect()
        };
        let (unknowns, knowns) = (ports(unknowns)?, ports(knowns)?);
        for &port in &unknowns {
            self.before_get(port)?;
        }
        Ok((unknowns, knowns))
    }

    pub(super) fn get_i32(&self, port: usize, offset: usize, out: &mut [i32]) -> Answer {
        self.sim.get_i32(port, offset, out).map_err(|why| error(chain(&why)))
    }

    /// One truth value.
    pub(super) fn get_bool(&self, port: usize, offset: usize) -> Result<bool, Refusal> {
        let mut out = [false];
        self.sim.get_bool(port, offset, &mut out).map_err(|why| error(chain(&why)))?;
        Ok(out[0])
    }

    fn snapshot(&self) -> Snapshot {
        Snapshot { mode: self.mode, stale: self.stale, start: self.start, stop: self.stop, state: self.sim.save() }
    }

    /// Saves the state and returns its address; a known `old` address is overwritten in place.
    pub(super) fn save(&mut self, old: *const Snapshot) -> Result<*const Snapshot, Refusal> {
        let snapshot = self.snapshot();
        self.keep(old, snapshot)
    }

    fn keep(&mut self, old: *const Snapshot, snapshot: Snapshot) -> Result<*const Snapshot, Refusal> {
        if old.is_null() {
            let kept = Box::new(snapshot);
            let address: *const Snapshot = &raw const *kept;
            self.states.push(kept);
            return Ok(address);
        }
        let i = self.find(old)?;
        *self.states[i] = snapshot;
        Ok(old)
    }

    fn find(&self, state: *const Snapshot) -> Result<usize, Refusal> {
        self.states
            .iter()
            .position(|kept| std::ptr::eq::<Snapshot>(&raw const **kept, state))
            .ok_or_else(|| error("the FMU state is none of this instance (a new one starts from NULL)"))
    }

    /// Goes back to a saved state: values, outputs, time and mode.
    pub(super) fn restore(&mut self, state: *const Snapshot) -> Answer {
        let i = self.find(state)?;
        let Snapshot { mode, stale, start, stop, ref state } = *self.states[i];
        self.sim.restore(state).map_err(|why| error(chain(&why)))?;
        (self.mode, self.stale, self.start, self.stop) = (mode, stale, start, stop);
        Ok(())
    }

    pub(super) fn forget(&mut self, state: *const Snapshot) -> Answer {
        if state.is_null() {
            return Ok(());
        }
        let i = self.find(state)?;
        self.states.swap_remove(i);
        Ok(())
    }

    /// The bytes of a saved state.
    pub(super) fn serialize(&self, state: *const Snapshot) -> Result<Vec<u8>, Refusal> {
        Ok(self.states[self.find(state)?].to_bytes(self.sim.model()))
    }

    /// A saved state from its bytes; where it is kept follows [`Instance::save`].
    pub(super) fn deserialize(&mut self, bytes: &[u8], old: *const Snapshot) -> Result<*const Snapshot, Refusal> {
        let snapshot = Snapshot::from_bytes(bytes, self.sim.model()).map_err(error)?;
        self.keep(old, snapshot)
    }

    /// Called after a panic.
    pub(super) fn poison(&mut self, why: String) {
        self.logger.log(Status::Error, Category::Error, &format!("internal failure: {why}"));
        self.poisoned = Some(why);
    }
}

fn port(model: &Model, reference: u32, ty: Type) -> Result<(usize, &Port), Refusal> {
    let ports = model.ports();
    let found = ports
        .binary_search_by_key(&reference, |p| p.reference)
        .ok()
        .map(|i| (i, &ports[i]))
        .filter(|(_, p)| !p.is_empty());
    let (i, port) = found.ok_or_else(|| error(format!("no variable has value reference {reference}")))?;
    if port.ty != ty {
        return Err(error(format!("`{}` (value reference {reference}) is {:?}, not {ty:?}", port.name, port.ty)));
    }
    Ok((i, port))
}

/// What no derivative there is ends nothing; ports and lengths that are none are the host's slip.
fn no_derivative(why: SimError) -> Refusal {
    let message = chain(&why);
    match why {
        SimError::Port { .. } | SimError::Range { .. } => error(message),
        _ => discard(message),
    }
}

fn check_orders(orders: &[i32]) -> Answer {
    match orders.iter().find(|&&order| order != 1) {
        Some(order) => {
            Err(discard(format!("output derivatives of order {order} are not known, only those of order 1")))
        }
        None => Ok(()),
    }
}

/// What variables can be read from: an instance, or the middle of one of its steps.
pub(super) trait Readable {
    /// The model whose ports are read.
    fn model(&self) -> &Model;
    /// Before an output is read: brings it up to date where the standard wants it.
    fn before_get(&mut self, port: usize) -> Answer;
    /// Elements of a Float64 port, from `offset` on.
    fn get_f64(&self, port: usize, offset: usize, out: &mut [f64]) -> Answer;
    /// Elements of an Int32 port, from `offset` on.
    fn get_i32(&self, port: usize, offset: usize, out: &mut [i32]) -> Answer;
    /// One truth value.
    fn get_bool(&self, port: usize, offset: usize) -> Result<bool, Refusal>;
    /// First derivatives by time of elements of an output; no other order is known.
    fn time_derivative(&self, port: usize, offset: usize, orders: &[i32], out: &mut [f64]) -> Answer;
    /// The port that a host means by an FMI 3.0 value reference.
    fn port(&self, reference: u32, ty: Type) -> Result<(usize, &Port), Refusal> {
        port(self.model(), reference, ty)
    }
}

impl Readable for Instance {
    fn model(&self) -> &Model {
        self.sim.model()
    }
    fn before_get(&mut self, port: usize) -> Answer {
        Instance::before_get(self, port)
    }
    fn get_f64(&self, port: usize, offset: usize, out: &mut [f64]) -> Answer {
        Instance::get_f64(self, port, offset, out)
    }
    fn get_i32(&self, port: usize, offset: usize, out: &mut [i32]) -> Answer {
        Instance::get_i32(self, port, offset, out)
    }
    fn get_bool(&self, port: usize, offset: usize) -> Result<bool, Refusal> {
        Instance::get_bool(self, port, offset)
    }
    fn time_derivative(&self, port: usize, offset: usize, orders: &[i32], out: &mut [f64]) -> Answer {
        Instance::time_derivative(self, port, offset, orders, out)
    }
}

/// The middle of a step, as the host's intermediate update sees it.
#[derive(Clone, Copy)]
pub(super) struct Inside<'a> {
    pub(super) view: &'a View<'a>,
    pub(super) logger: &'a Logger,
}

impl Readable for Inside<'_> {
    fn model(&self) -> &Model {
        self.view.model()
    }
    fn before_get(&mut self, _port: usize) -> Answer {
        Ok(())
    }
    fn get_f64(&self, port: usize, offset: usize, out: &mut [f64]) -> Answer {
        self.view.get_f64(port, offset, out).map_err(|why| error(chain(&why)))
    }
    fn get_i32(&self, port: usize, offset: usize, out: &mut [i32]) -> Answer {
        self.view.get_i32(port, offset, out).map_err(|why| error(chain(&why)))
    }
    fn get_bool(&self, port: usize, offset: usize) -> Result<bool, Refusal> {
        let mut out = [false];
        self.view.get_bool(port, offset, &mut out).map_err(|why| error(chain(&why)))?;
        Ok(out[0])
    }
    fn time_derivative(&self, port: usize, offset: usize, orders: &[i32], out: &mut [f64]) -> Answer {
        check_orders(orders)?;
        self.view.time_derivative(port, offset, out).map_err(no_derivative)
    }
}

/// An error and its sources in one line.
pub(super) fn chain(why: &dyn std::error::Error) -> String {
    let mut text = why.to_string();
    let mut source = why.source();
    while let Some(inner) = source {
        let more = inner.to_string();
        if !text.contains(&more) {
            text = format!("{text}: {more}");
        }
        source = inner.source();
    }
    text
}

/// An instance made through the FMI 3.0 functions.
pub(super) struct Instance3 {
    pub(super) common: Instance,
    /// The host's intermediate update, if it has one.
    pub(super) update: Option<Update>,
}

/// `fmi3IntermediateUpdateCallback` with the host's environment.
pub(super) struct Update {
    pub(super) callback: super::fmi3::IntermediateUpdate,
    pub(super) environment: *mut std::ffi::c_void,
}

impl Instance3 {
    /// The same as [`Instance::step`], piece by piece, each of which `show` shows to the host outside of all that catches: an
    /// exception of the host leaves the state of the last accepted step.
    ///
    /// # Errors
    /// The message of a panic.
    pub(super) fn step_watched(
        &mut self,
        call: Call,
        at: f64,
        dt: f64,
        mut show: impl FnMut(&Update, &Inside),
    ) -> Result<Status, String> {
        let Instance3 { common, update } = self;
        let may = guard::caught(|| common.answer(call, modes::ERROR, |i| i.check_step(at, dt)))?;
        let Some(update) = update.as_ref().filter(|_| may == Status::Ok) else { return Ok(may) };
        let Instance { sim, logger, .. } = common;
        let stepped = match guard::caught(|| sim.begin(dt))? {
            Err(why) => Err(why),
            Ok(mut step) => loop {
                match guard::caught(|| step.go_on())? {
                    Err(why) => break Err(why),
                    Ok(report) => {
                        step.look(|view| show(update, &Inside { view, logger }));
                        if let Some(report) = report {
                            break Ok(report);
                        }
                    }
                }
            },
        };
        guard::caught(|| common.answer(call, modes::ERROR, |i| i.conclude(stepped)))
    }
}

/// An instance made through the FMI 2.0 functions.
pub(super) struct Instance2 {
    pub(super) common: Instance,
    /// Answer of the last `fmi2DoStep`.
    pub(super) last_step: Status,
}

/// Runs one call on an instance of either version and tells the host's logger what came of it once the call is over.
///
/// # Safety
/// As for [`guard::with`].
pub(super) unsafe fn answered<T: Common>(handle: *mut Handle<T>, body: impl FnOnce(&mut T) -> Status) -> Status {
    let mut told = Told::nothing();
    let mut take = |i: &mut T| told = i.common().logger.take();
    // SAFETY: the caller's promise.
    let outcome = unsafe {
        guard::with(handle, |i| {
            let status = body(i);
            take(i);
            status
        })
    };
    if outcome == Err(Denied::Panicked) {
        // SAFETY: the caller's promise.
        let _ = unsafe { guard::with(handle, take) };
    }
    told.tell();
    outcome.unwrap_or(Status::Error)
}

/// The same for a body that calls the host in between.
///
/// # Safety
/// As for [`guard::with_callbacks`].
pub(super) unsafe fn answered_with_callbacks<T: Common>(
    handle: *mut Handle<T>,
    body: impl FnOnce(&mut T) -> Result<Status, String>,
) -> Status {
    // SAFETY: the caller's promise.
    let outcome = unsafe { guard::with_callbacks(handle, body) };
    let mut told = Told::nothing();
    // SAFETY: the caller's promise.
    let _ = unsafe { guard::with(handle, |i| told = i.common().logger.take()) };
    told.tell();
    outcome.unwrap_or(Status::Error)
}

/// An instance of either version.
pub(super) trait Common: Guarded {
    /// What both share.
    fn common(&mut self) -> &mut Instance;
}

impl Common for Instance3 {
    fn common(&mut self) -> &mut Instance {
        &mut self.common
    }
}

impl Common for Instance2 {
    fn common(&mut self) -> &mut Instance {
        &mut self.common
    }
}

impl Guarded for Instance3 {
    const TAG: u64 = u64::from_le_bytes(*b"cutisFM3");
    fn allowance(&self) -> Arc<Allowance> {
        self.common.sim.allowance().clone()
    }
    fn poison(&mut self, why: String) {
        self.common.poison(why);
    }
}

impl Guarded for Instance2 {
    const TAG: u64 = u64::from_le_bytes(*b"cutisFM2");
    fn allowance(&self) -> Arc<Allowance> {
        self.common.sim.allowance().clone()
    }
    fn poison(&mut self, why: String) {
        self.common.poison(why);
    }
}
