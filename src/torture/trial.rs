//! A simulation under watch: after each call everything a host can read is finite, and a refusal has changed nothing.

use std::sync::Arc;

use crate::load;
use crate::math::Vec3;
use crate::mesh::TetMesh;
use crate::port::{Port, Type};
use crate::scene::{SceneFile, build};
use crate::sim::{Sim, SimError};
use crate::solve::Rung;

/// Most linear solves of one step; five times the scene's default of 200, and some.
const MOST_SOLVES: u32 = 1200;

/// Most work of a refused step, in good ones; what docs/torture.md says.
const MOST_OF_A_REFUSAL: f64 = 41.0;

/// What a case may use and what it took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tally {
    /// A rung of recovery that it has to do without.
    pub without: Option<Rung>,
    /// Linear solves, those spent in vain included.
    pub iterations: u32,
    /// Largest work of a refused step, in good ones.
    pub refused: f64,
    /// Smallest det F of all accepted steps; +inf before the first.
    pub min_det_f: f64,
    /// Strain energy after the last accepted step, J.
    pub energy: f64,
}

impl Default for Tally {
    fn default() -> Self {
        Tally { without: None, iterations: 0, refused: 0.0, min_det_f: f64::INFINITY, energy: 0.0 }
    }
}

/// Why a case ended early.
#[derive(Debug, Clone, PartialEq)]
pub enum End {
    /// A clear error; the state is intact.
    Refused(String),
    /// A broken promise.
    Fail(String),
}

pub fn fail<T>(message: impl Into<String>) -> Result<T, End> {
    Err(End::Fail(message.into()))
}

pub struct Trial<'a> {
    pub sim: Sim,
    /// Whether inputs or positions were set since the last accepted step.
    disturbed: bool,
    tally: &'a mut Tally,
}

impl<'a> Trial<'a> {
    /// A scene that must load.
    pub fn new(scene: &str, tally: &'a mut Tally) -> Result<Trial<'a>, End> {
        let loaded = load::from_text(scene, None).map_err(|e| End::Fail(format!("the scene does not load: {e}")))?;
        Self::of(loaded.model, tally)
    }

    /// The same with another mesh than the scene's own.
    pub fn on(mesh: TetMesh, scene: &str, tally: &'a mut Tally) -> Result<Trial<'a>, End> {
        let mesh = mesh.checked().map_err(|e| End::Fail(format!("the mesh is refused: {e}")))?;
        let built = SceneFile::parse(scene).and_then(|file| build(scene, &file, mesh));
        Self::of(built.map_err(|e| End::Fail(format!("the scene does not build: {e}")))?.0, tally)
    }

    fn of(model: crate::sim::Model, tally: &'a mut Tally) -> Result<Trial<'a>, End> {
        let model = match tally.without {
            Some(rung) => model.without(rung),
            None => model,
        };
        let sim = Sim::new(Arc::new(model)).map_err(|e| End::Fail(format!("no simulation: {e}")))?;
        Ok(Trial { sim, disturbed: false, tally })
    }

    /// Sets elements of an input port by name.
    pub fn set(&mut self, name: &str, offset: usize, values: &[f64]) -> Result<(), End> {
        let port = self.sim.model().ports().iter().position(|p| p.name == name);
        let port = port.ok_or_else(|| End::Fail(format!("no port `{name}`")))?;
        self.disturbed = true;
        self.sim.set_f64(port, offset, values).map_err(|e| End::Fail(e.to_string()))
    }

    /// Moves the jaw: translation (m) and rotation vector (rad).
    pub fn jaw(&mut self, t: [f64; 3], w: [f64; 3]) -> Result<(), End> {
        self.set("bone.translation", 3, &t)?;
        self.set("bone.rotation", 3, &w)
    }

    /// The force on the patch, N.
    pub fn push(&mut self, f: [f64; 3]) -> Result<(), End> {
        self.set("load.force", 0, &f)
    }

    /// Puts the free nodes at `x`.
    pub fn start_from(&mut self, x: &[Vec3]) -> Result<(), End> {
        self.disturbed = true;
        self.sim.start_from(x).map_err(|e| End::Fail(e.to_string()))
    }

    /// One watched step.
    pub fn step(&mut self, dt: f64) -> Result<(), End> {
        let before = self.bytes();
        match self.sim.step(dt) {
            Ok(report) => {
                self.tally.iterations += report.iterations;
                let strain = self.sim.strain();
                self.tally.min_det_f = self.tally.min_det_f.min(strain.min_det_f);
                self.tally.energy = strain.energy;
                self.disturbed = false;
                if report.iterations > MOST_SOLVES {
                    return fail(format!("a step took {} linear solves", report.iterations));
                }
                let numbers = [report.residual, report.correction, strain.min_det_f, strain.max_stretch, strain.energy];
                if !report.converged || numbers.iter().any(|v| !v.is_finite()) {
                    return fail(format!("the report is no answer: {report:?}"));
                }
                self.check_finite()
            }
            Err(e) => {
                if let SimError::Solve { spent, work, .. } = e {
                    self.tally.iterations += spent;
                    let took = work / self.sim.good_step();
                    self.tally.refused = self.tally.refused.max(took);
                    if took > MOST_OF_A_REFUSAL {
                        return fail(format!("a refused step took as much as {took:.0} good ones"));
                    }
                    if spent > MOST_SOLVES {
                        return fail(format!("a refused step took {spent} linear solves"));
                    }
                }
                if self.bytes() != before {
                    return fail(format!("a refused step changed the state: {e}"));
                }
                self.check_finite()?;
                let message = e.to_string();
                // Every scene here is held, and what nobody disturbed does not invert.
                if message.contains("hold a bone") || !self.disturbed && message.contains("elements are inverted") {
                    return fail(format!("refused with the wrong reason: {message}"));
                }
                Err(End::Refused(message))
            }
        }
    }

    /// A step that must be refused with a message that holds `name`; the message comes back.
    pub fn refusal(&mut self, dt: f64, name: &str) -> Result<String, End> {
        match self.step(dt) {
            Err(End::Refused(message)) if message.contains(name) => Ok(message),
            Err(End::Refused(message)) => fail(format!("the error does not say `{name}`: {message}")),
            Err(end) => Err(end),
            Ok(()) => fail("a step that means nothing was taken"),
        }
    }

    /// A step that may be refused, but must not fail.
    pub fn try_step(&mut self, dt: f64) -> Result<Option<String>, End> {
        match self.step(dt) {
            Ok(()) => Ok(None),
            Err(End::Refused(message)) => Ok(Some(message)),
            Err(end) => Err(end),
        }
    }

    pub fn rest(&self) -> &[Vec3] {
        &self.sim.model().mesh().nodes
    }

    /// Fails if the tissue is further than `tolerance` (m) from `wanted`.
    pub fn near(&self, wanted: &[Vec3], tolerance: f64, what: &str) -> Result<(), End> {
        near(self.sim.positions(), wanted, tolerance, what)
    }

    /// Every bit of the state.
    fn bytes(&self) -> Vec<u8> {
        self.sim.save().to_bytes(self.sim.model())
    }

    fn check_finite(&self) -> Result<(), End> {
        let outputs = |p: &&Port| p.ty == Type::Float64 && !p.is_settable();
        for (k, p) in self.sim.model().ports().iter().enumerate().filter(|(_, p)| outputs(p)) {
            let mut out = vec![0.0; p.len()];
            self.sim.get_f64(k, 0, &mut out).map_err(|e| End::Fail(e.to_string()))?;
            if let Some(value) = out.iter().find(|v| !v.is_finite()) {
                return fail(format!("port `{}` says {value}", p.name));
            }
        }
        match self.sim.positions().iter().any(|x| !x.iter().all(|c| c.is_finite())) {
            true => fail("a node's position is not finite"),
            false => Ok(()),
        }
    }
}

/// Fails if any of `found` is further than `tolerance` (m) from its place in `wanted`.
pub fn near(found: &[Vec3], wanted: &[Vec3], tolerance: f64, what: &str) -> Result<(), End> {
    let off = found.iter().zip(wanted).map(|(x, y)| (x - y).norm()).fold(0.0, f64::max);
    if off <= tolerance { Ok(()) } else { fail(format!("{off:.1e} m from {what} (allowed {tolerance:.0e} m)")) }
}
