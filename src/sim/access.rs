//! What a host sets and gets. Both are copies: nothing is solved, nothing is allocated.

use super::{Model, Sim, SimError, State};
use crate::fem::{At, Strain, Touch};
use crate::math::{Vec3, log_rotation};
use crate::port::{Port, Slot, Type};

impl Sim {
    /// Copies `values` into port `port`, from its element `offset` (row-major) on. They act at the next step.
    ///
    /// # Errors
    /// [`SimError::Port`] if the port cannot be set, [`SimError::Range`] if the values do not fit. Values that are not
    /// finite are refused by the next step.
    pub fn set_f64(&mut self, port: usize, offset: usize, values: &[f64]) -> Result<(), SimError> {
        let p = self.port(port, Type::Float64, "a settable Float64 port", Port::is_settable)?;
        check_range(p, offset, values.len())?;
        let first = self.model.parts().layout.first(p.slot).expect("every settable port lies in the layout") + offset;
        self.state.inputs[first..first + values.len()].copy_from_slice(values);
        Ok(())
    }

    /// Copies from port `port`, from its element `offset` (row-major) on: inputs as set last, outputs as of the last
    /// accepted step.
    ///
    /// # Errors
    /// [`SimError::Port`], [`SimError::Range`].
    pub fn get_f64(&self, port: usize, offset: usize, out: &mut [f64]) -> Result<(), SimError> {
        self.view(&|| self.strain()).get_f64(port, offset, out)
    }

    /// First derivative by time of all elements of an output, as of the last accepted step: of positions, in scenes with
    /// inertia.
    ///
    /// # Errors
    /// [`SimError::Port`], [`SimError::Range`], [`SimError::NoDerivative`] in scenes without inertia.
    pub fn time_derivative(&self, port: usize, offset: usize, out: &mut [f64]) -> Result<(), SimError> {
        self.view(&|| self.strain()).time_derivative(port, offset, out)
    }

    /// Copies from an Int32 port.
    ///
    /// # Errors
    /// [`SimError::Port`], [`SimError::Range`].
    pub fn get_i32(&self, port: usize, offset: usize, out: &mut [i32]) -> Result<(), SimError> {
        self.view(&|| self.strain()).get_i32(port, offset, out)
    }

    /// Copies from a Boolean port.
    ///
    /// # Errors
    /// [`SimError::Port`], [`SimError::Range`].
    pub fn get_bool(&self, port: usize, offset: usize, out: &mut [bool]) -> Result<(), SimError> {
        self.view(&|| self.strain()).get_bool(port, offset, out)
    }

    /// What can be read of the last accepted step.
    pub(super) fn view<'a>(&'a self, strain: &'a dyn Fn() -> Strain) -> View<'a> {
        View { model: &self.model, state: &self.state, strain }
    }

    pub(super) fn port(
        &self,
        k: usize,
        ty: Type,
        wanted: &'static str,
        also: impl Fn(&Port) -> bool,
    ) -> Result<&Port, SimError> {
        find(&self.model, k, ty, wanted, also)
    }
}

/// The port of this index, if it has this type and `also` holds.
fn find<'a>(
    model: &'a Model,
    k: usize,
    ty: Type,
    wanted: &'static str,
    also: impl Fn(&Port) -> bool,
) -> Result<&'a Port, SimError> {
    let ports = model.ports();
    ports.get(k).filter(|p| p.ty == ty && also(p)).ok_or(SimError::Port { port: k, n_ports: ports.len(), wanted })
}

/// What a host can read of one accepted state; also of those in the middle of a step that was cut.
#[derive(Clone, Copy)]
pub struct View<'a> {
    pub(super) model: &'a Model,
    pub(super) state: &'a State,
    pub(super) strain: &'a dyn Fn() -> Strain,
}

impl View<'_> {
    /// The model.
    pub fn model(&self) -> &Model {
        self.model
    }

    /// Simulation time, s.
    pub fn time(&self) -> f64 {
        self.state.t
    }

    /// As [`Sim::get_f64`].
    ///
    /// # Errors
    /// The same.
    pub fn get_f64(&self, port: usize, offset: usize, out: &mut [f64]) -> Result<(), SimError> {
        let p = find(self.model, port, Type::Float64, "a Float64 port", |_| true)?;
        check_range(p, offset, out.len())?;
        let o = &self.state.outputs;
        let rest = &self.model.mesh().nodes;
        match p.slot {
            Slot::Time => out.fill(self.state.t),
            Slot::SkinPosition => self.model.skin().gather(&self.state.config.x, offset, out),
            Slot::SkinVelocity => self.model.skin().gather(&self.state.motion.v, offset, out),
            Slot::SkinRestPosition => self.model.skin().gather(rest, offset, out),
            Slot::MarkerPosition => rows(|k| self.marker(k, &self.state.config.x), offset, out),
            Slot::BoneReactionForce => rows(|k| o.reaction_force[k], offset, out),
            Slot::BoneReactionTorque => rows(|k| o.reaction_torque[k], offset, out),
            Slot::ContactForce => rows(|k| self.touch(k).force, offset, out),
            Slot::ContactDepth => {
                out.iter_mut().zip(offset..).for_each(|(out, k)| *out = self.touch(k).depth());
            }
            Slot::BonePoseTranslation => rows(|k| self.state.config.poses[k].t, offset, out),
            Slot::BonePoseRotation => rows(|k| log_rotation(&self.state.config.poses[k].R), offset, out),
            Slot::SolverResidual => out.fill(o.residual),
            Slot::EnergyElastic => out.fill((self.strain)().energy),
            Slot::EnergyKinetic => out.fill(o.kinetic),
            Slot::MinDetF => out.fill((self.strain)().min_det_f),
            Slot::MaxStretch => out.fill((self.strain)().max_stretch),
            input => {
                let first = self.model.parts().layout.first(input).expect("every other port is an input") + offset;
                out.copy_from_slice(&self.state.inputs[first..first + out.len()]);
            }
        }
        Ok(())
    }

    /// As [`Sim::time_derivative`].
    ///
    /// # Errors
    /// The same.
    pub fn time_derivative(&self, port: usize, offset: usize, out: &mut [f64]) -> Result<(), SimError> {
        let moves = |p: &Port| matches!(p.slot, Slot::SkinPosition | Slot::MarkerPosition);
        let p = find(
            self.model,
            port,
            Type::Float64,
            "an output whose rate is known: skin.position, marker.position",
            moves,
        )?;
        check_range(p, offset, out.len())?;
        if self.model.parts().inertia.is_none() {
            let why = "without [inertia] nothing has a velocity: the scene goes from one equilibrium to the next";
            return Err(SimError::NoDerivative(why.into()));
        }
        let v = &self.state.motion.v;
        match p.slot {
            Slot::SkinPosition => self.model.skin().gather(v, offset, out),
            _ => rows(|k| self.marker(k, v), offset, out),
        }
        Ok(())
    }

    /// As [`Sim::get_i32`].
    ///
    /// # Errors
    /// The same.
    pub fn get_i32(&self, port: usize, offset: usize, out: &mut [i32]) -> Result<(), SimError> {
        let p = find(self.model, port, Type::Int32, "an Int32 port", |_| true)?;
        check_range(p, offset, out.len())?;
        match p.slot {
            Slot::SkinTriangles => out.copy_from_slice(&self.model.skin_triangles()[offset..offset + out.len()]),
            _ => out.fill(self.state.outputs.iterations as i32),
        }
        Ok(())
    }

    /// As [`Sim::get_bool`].
    ///
    /// # Errors
    /// The same.
    pub fn get_bool(&self, port: usize, offset: usize, out: &mut [bool]) -> Result<(), SimError> {
        let p = find(self.model, port, Type::Boolean, "a Boolean port", |_| true)?;
        check_range(p, offset, out.len())?;
        out.fill(self.state.outputs.converged);
        Ok(())
    }

    /// How contact `k` touches.
    fn touch(&self, k: usize) -> Touch {
        let at = At { history: &self.state.history, ..At::NOWHERE };
        self.model.touch(k, &at, &self.state.config.x)
    }

    /// A nodal field at a marker.
    fn marker(&self, k: usize, field: &[Vec3]) -> Vec3 {
        let marker = &self.model.parts().markers[k];
        self.model.skin().within(marker.nodes, marker.weights, field)
    }
}

fn check_range(port: &Port, offset: usize, n: usize) -> Result<(), SimError> {
    let (len, end) = (port.len(), offset.saturating_add(n));
    if end <= len { Ok(()) } else { Err(SimError::Range { name: port.name.clone(), len, offset, end }) }
}

/// Rows of three, flattened, from element `offset` on.
fn rows(row: impl Fn(usize) -> Vec3, offset: usize, out: &mut [f64]) {
    for (k, value) in out.iter_mut().enumerate() {
        *value = row((offset + k) / 3)[(offset + k) % 3];
    }
}
