//! What a host sets and gets. Both are copies: nothing is solved, nothing is allocated.

use super::outputs::Read;
use super::ports::Source;
use super::targets::{bone_of_input, read_pivots};
use super::{Model, Sim, SimError, State};
use crate::fem::{At, Strain, Touch};
use crate::math::{Mat3, Vec3, left_jacobian, log_rotation};
use crate::port::{Port, Slot, Type};

impl Sim {
    /// Copies `values` into port `port`, from its element `offset` (row-major) on. They act at the next step.
    ///
    /// # Errors
    /// [`SimError::Port`] if the port cannot be set, [`SimError::Range`] if the values do not fit, [`SimError::NotDriven`] if
    /// one of them moves or pushes a bone that is not driven that way; nothing has changed then. Values that are not finite are
    /// refused by the next step.
    pub fn set_f64(&mut self, port: usize, offset: usize, values: &[f64]) -> Result<(), SimError> {
        let first = self.settable(port, offset, values)?;
        self.state.inputs[first..first + values.len()].copy_from_slice(values);
        Ok(())
    }

    /// Whether [`Sim::set_f64`] would take these values, and [`Sim::initialise`] after it if that is yet to come.
    ///
    /// # Errors
    /// As for [`Sim::set_f64`], and [`SimError::NotAtRest`].
    pub fn check_f64(&self, port: usize, offset: usize, values: &[f64]) -> Result<(), SimError> {
        let first = self.settable(port, offset, values)?;
        let moved = (first..).zip(values).filter(|(_, value)| **value != 0.0);
        moved.map(|(k, _)| k).try_for_each(|k| self.check_start(self.model.ports()[port].slot, k))
    }

    /// Where the values go among the inputs.
    fn settable(&self, port: usize, offset: usize, values: &[f64]) -> Result<usize, SimError> {
        let p = self.port(port, Type::Float64, "a settable Float64 port", Port::is_settable)?;
        check_range(p, offset, values.len())?;
        let Source::Input(first) = self.model.source(port) else {
            return Err(SimError::Port { port, n_ports: self.model.ports().len(), wanted: "an input" });
        };
        let first = first + offset;
        for (k, &value) in (first..).zip(values).filter(|(_, value)| **value != 0.0) {
            bone_of_input(&self.model, k, value)?;
        }
        Ok(first)
    }

    /// Whether input `k` may be other than zero now: where time starts at rest, bones are there until it has started.
    fn check_start(&self, slot: Slot, k: usize) -> Result<(), SimError> {
        let parts = self.model.parts();
        let at_rest = parts.inertia.as_ref().is_some_and(|i| i.start_at_rest) && !self.is_settled();
        let bone = match slot {
            Slot::BoneNodal(bone) => Some(bone as usize),
            Slot::BoneTranslation | Slot::BoneRotation => parts.layout.first(slot).map(|first| (k - first) / 3),
            _ => None,
        };
        match bone.filter(|_| at_rest) {
            Some(bone) => Err(SimError::NotAtRest(parts.bones[bone].name.clone())),
            None => Ok(()),
        }
    }

    /// Sets an Int32 port: how many linear solves a step may take.
    ///
    /// # Errors
    /// [`SimError::Port`] if the port cannot be set, [`SimError::Range`] if the values do not fit, [`SimError::TooFew`] for
    /// less than one solve.
    pub fn set_i32(&mut self, port: usize, offset: usize, values: &[i32]) -> Result<(), SimError> {
        let p = self.port(port, Type::Int32, "a settable Int32 port", Port::is_settable)?;
        check_range(p, offset, values.len())?;
        let Some(&value) = values.first() else { return Ok(()) };
        let most = u32::try_from(value).ok().filter(|most| *most > 0);
        self.state.most_solves = most.ok_or_else(|| SimError::TooFew { name: p.name.clone(), value })?;
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

    /// First derivative by time of elements of an output, as of the last accepted step, in scenes with inertia: velocities of
    /// skin, markers and bones; of the skin's velocity the mean acceleration over the last piece of the step.
    ///
    /// # Errors
    /// [`SimError::Port`], [`SimError::Range`], [`SimError::NoDerivative`] for other ports, and in scenes without inertia.
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
        match self.model.source(port) {
            Source::Input(first) => {
                let first = first + offset;
                out.copy_from_slice(&self.state.inputs[first..first + out.len()]);
            }
            Source::Computed(row) => {
                if let Read::F64(read) = row.read {
                    read(self, offset, out);
                }
            }
            Source::MostSolves => out.fill(f64::from(self.state.most_solves)),
        }
        Ok(())
    }

    /// As [`Sim::time_derivative`].
    ///
    /// # Errors
    /// The same.
    pub fn time_derivative(&self, port: usize, offset: usize, out: &mut [f64]) -> Result<(), SimError> {
        let p = find(self.model, port, Type::Float64, "a Float64 port", |_| true)?;
        check_range(p, offset, out.len())?;
        let rate = match self.model.source(port) {
            Source::Computed(row) => row.rate,
            Source::Input(_) | Source::MostSolves => None,
        };
        let Some(rate) = rate else {
            return Err(SimError::NoDerivative(format!("how `{}` changes in time is not known", p.name)));
        };
        if self.model.parts().inertia.is_none() {
            let why = "without [inertia] nothing has a velocity: the scene goes from one equilibrium to the next";
            return Err(SimError::NoDerivative(why.into()));
        }
        rate(self, offset, out)
    }

    /// As [`Sim::get_i32`].
    ///
    /// # Errors
    /// The same.
    pub fn get_i32(&self, port: usize, offset: usize, out: &mut [i32]) -> Result<(), SimError> {
        let p = find(self.model, port, Type::Int32, "an Int32 port", |_| true)?;
        check_range(p, offset, out.len())?;
        match self.model.source(port) {
            Source::MostSolves => out.fill(i32::try_from(self.state.most_solves).unwrap_or(i32::MAX)),
            Source::Computed(row) => {
                if let Read::I32(read) = row.read {
                    read(self, offset, out);
                }
            }
            Source::Input(first) => {
                let inputs = &self.state.inputs[first + offset..];
                out.iter_mut().zip(inputs).for_each(|(out, value)| *out = *value as i32);
            }
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
        if let Source::Computed(row) = self.model.source(port)
            && let Read::Bool(read) = row.read
        {
            read(self, offset, out);
        }
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

    /// Velocity of the current pivot of bone `k`, m/s, and its angular velocity, rad/s, from those of its nodes.
    fn motion_of_bone(&self, k: usize) -> Result<(Vec3, Vec3), SimError> {
        let parts = self.model.parts();
        let nodes = &parts.bones[k].nodes;
        let (x, v) = (&self.state.config.x, &self.state.motion.v);
        let mean = |field: &[Vec3]| nodes.iter().map(|&a| field[a as usize]).sum::<Vec3>() / nodes.len().max(1) as f64;
        let (c, drift) = (mean(x), mean(v));
        let (mut inertia, mut spin) = (Mat3::zeros(), Vec3::zeros());
        for &a in nodes {
            let (r, v) = (x[a as usize] - c, v[a as usize] - drift);
            inertia += r.norm_squared() * Mat3::identity() - r * r.transpose();
            spin += r.cross(&v);
        }
        let Some(inverse) = inertia.try_inverse().filter(|m| m.iter().all(|c| c.is_finite())) else {
            let why = format!("the nodes of bone `{}` lie in a line, so its rotation has no rate", parts.bones[k].name);
            return Err(SimError::NoDerivative(why));
        };
        let omega = inverse * spin;
        let mut pivots = vec![Vec3::zeros(); parts.bones.len()];
        read_pivots(self.model, &self.state.applied, &mut pivots);
        Ok((drift + omega.cross(&(pivots[k] + self.state.config.poses[k].t - c)), omega))
    }
}

pub(super) fn time(view: &View, _: usize, out: &mut [f64]) {
    out.fill(view.state.t);
}
pub(super) fn skin_position(view: &View, offset: usize, out: &mut [f64]) {
    view.model.skin().gather(&view.state.config.x, offset, out);
}
pub(super) fn skin_velocity(view: &View, offset: usize, out: &mut [f64]) {
    view.model.skin().gather(&view.state.motion.v, offset, out);
}
pub(super) fn skin_rest_position(view: &View, offset: usize, out: &mut [f64]) {
    view.model.skin().gather(&view.model.mesh().nodes, offset, out);
}
pub(super) fn triangles(view: &View, offset: usize, out: &mut [i32]) {
    out.copy_from_slice(&view.model.skin_triangles()[offset..offset + out.len()]);
}
pub(super) fn marker_position(view: &View, offset: usize, out: &mut [f64]) {
    rows(|k| view.marker(k, &view.state.config.x), offset, out);
}
pub(super) fn reaction_force(view: &View, offset: usize, out: &mut [f64]) {
    rows(|k| view.state.outputs.reaction_force[k], offset, out);
}
pub(super) fn reaction_torque(view: &View, offset: usize, out: &mut [f64]) {
    rows(|k| view.state.outputs.reaction_torque[k], offset, out);
}
pub(super) fn pose_translation(view: &View, offset: usize, out: &mut [f64]) {
    rows(|k| view.state.config.poses[k].t, offset, out);
}
pub(super) fn pose_rotation(view: &View, offset: usize, out: &mut [f64]) {
    rows(|k| log_rotation(&view.state.config.poses[k].R), offset, out);
}
pub(super) fn contact_force(view: &View, offset: usize, out: &mut [f64]) {
    rows(|k| view.touch(k).force, offset, out);
}
pub(super) fn contact_depth(view: &View, offset: usize, out: &mut [f64]) {
    out.iter_mut().zip(offset..).for_each(|(out, k)| *out = view.touch(k).depth());
}
pub(super) fn iterations(view: &View, _: usize, out: &mut [i32]) {
    out.fill(view.state.outputs.iterations as i32);
}
pub(super) fn residual(view: &View, _: usize, out: &mut [f64]) {
    out.fill(view.state.outputs.residual);
}
pub(super) fn converged(view: &View, _: usize, out: &mut [bool]) {
    out.fill(view.state.outputs.converged);
}
pub(super) fn elastic(view: &View, _: usize, out: &mut [f64]) {
    out.fill((view.strain)().energy);
}
pub(super) fn kinetic(view: &View, _: usize, out: &mut [f64]) {
    out.fill(view.state.outputs.kinetic);
}
pub(super) fn min_det_f(view: &View, _: usize, out: &mut [f64]) {
    out.fill((view.strain)().min_det_f);
}
pub(super) fn max_stretch(view: &View, _: usize, out: &mut [f64]) {
    out.fill((view.strain)().max_stretch);
}

pub(super) fn skin_position_rate(view: &View, offset: usize, out: &mut [f64]) -> Result<(), SimError> {
    skin_velocity(view, offset, out);
    Ok(())
}
pub(super) fn skin_velocity_rate(view: &View, offset: usize, out: &mut [f64]) -> Result<(), SimError> {
    view.model.skin().gather(&view.state.motion.a, offset, out);
    Ok(())
}
pub(super) fn marker_position_rate(view: &View, offset: usize, out: &mut [f64]) -> Result<(), SimError> {
    rows(|k| view.marker(k, &view.state.motion.v), offset, out);
    Ok(())
}
pub(super) fn pose_translation_rate(view: &View, offset: usize, out: &mut [f64]) -> Result<(), SimError> {
    each_row(|k| Ok(view.motion_of_bone(k)?.0), offset, out)
}
/// `dR/dt = skew(w) R` with R = exp(r) gives `dr/dt = J(r)^-1 w`.
pub(super) fn pose_rotation_rate(view: &View, offset: usize, out: &mut [f64]) -> Result<(), SimError> {
    let rate = |k: usize| {
        let (_, omega) = view.motion_of_bone(k)?;
        let J = left_jacobian(&log_rotation(&view.state.config.poses[k].R));
        Ok(J.try_inverse().map_or(omega, |inverse| inverse * omega))
    };
    each_row(rate, offset, out)
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

/// The same for rows that may not be known.
fn each_row(row: impl Fn(usize) -> Result<Vec3, SimError>, offset: usize, out: &mut [f64]) -> Result<(), SimError> {
    for (k, value) in out.iter_mut().enumerate() {
        *value = row((offset + k) / 3)?[(offset + k) % 3];
    }
    Ok(())
}
