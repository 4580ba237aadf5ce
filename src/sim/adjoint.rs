//! The gradient of any weighting of outputs by all inputs at once: the transpose of [`super::derivative`].
//!
//! ```text
//! L = w . y(x, s),  g(x, s) = 0:    A^T lambda = -(dy/dx)^T w,    dL/ds = (dy/ds)^T w + (dg/ds)^T lambda
//! ```
//!
//! One solve with the stiffness that directional derivatives use, whatever the number of inputs. Reactions are forces at
//! nodes, so their weights enter as a nodal field `eta` beside `lambda`: both are contracted with the change of the
//! gradient in one go. By poses that contraction is a force and a torque on the bone; by inputs that terms read it is a
//! difference of those terms alone, exact since they are linear in them. Where forces follow the surface, or a bone is free
//! to turn under a torque, `A` is not symmetric: its transpose is solved with `K` by iteration.
//!
//! Source: Griewank & Walther, "Evaluating Derivatives", 2nd ed., 2008, section 15.3, for the implicit function's adjoint.

use super::derivative::{
    MOST_PASSES, SETTLED, Sensitivity, Unknown, check_seed, check_settled, is_approximate, mismatch, too_strong,
};
use super::model::{Drive, Model};
use super::outputs::Slope;
use super::past::{Origin, Past};
use super::step::complete;
use super::targets::read_pivots;
use super::{Sim, SimError};
use crate::fem::{At, Configuration};
use crate::math::{Mat3, Pose, Vec3, extent, left_jacobian, log_rotation};
use crate::port::Slot;

/// Largest motion in a difference of gradients, in sizes of the model.
const CHANGE: f64 = 1e-6;

/// Coefficients of what moves: `dL = sum_a x_a . dx_a + sum_b pivot_b . dp_b + sum_a eta_a . dg_a`.
pub(super) struct Weights {
    /// Of node positions.
    x: Vec<Vec3>,
    /// Of the translations that the bones have reached, and of their turns from there.
    t: Vec<Vec3>,
    turn: Vec<Vec3>,
    /// Of the strain energy.
    elastic: f64,
    /// Of the current pivots of the bones.
    pivot: Vec<Vec3>,
    /// Of the nodal gradient.
    eta: Vec<Vec3>,
    /// Of nodal velocities; they go with the positions.
    v: Vec<Vec3>,
}

/// The accepted state with what its transposed stiffness needs.
pub(super) struct Place<'a> {
    model: &'a Model,
    past: &'a Past,
    at: At<'a>,
    config: &'a Configuration,
    /// Pivots at rest, m.
    pivots: &'a [Vec3],
    /// Gradient at the nodes, N.
    g: &'a [Vec3],
    /// Velocities of the nodes, m/s; none in quasi-static scenes.
    v: &'a [Vec3],
    /// Size of the model, m.
    size: f64,
}

impl Sim {
    /// Gradient of `seed . unknowns` by the ports `knowns`, at the last accepted state: `sensitivity` is overwritten with the
    /// derivative by each element of the knowns, one after another.
    ///
    /// Ports as for [`Sim::directional_derivative`], whose transpose it is. The cost is that of one direction, plus two
    /// gradients of the terms that read them for each known load, pressure, activation or parameter.
    ///
    /// # Errors
    /// As for [`Sim::directional_derivative`]. The state does not change.
    pub fn adjoint_derivative(
        &mut self,
        unknowns: &[usize],
        seed: &[f64],
        knowns: &[usize],
        sensitivity: &mut [f64],
    ) -> Result<(), SimError> {
        let model = self.model.clone();
        let wanted = knowns.iter().map(|&known| self.known(known)).collect::<Result<Vec<_>, _>>()?;
        let n = wanted.iter().map(|(_, range)| range.len()).sum();
        if n != sensitivity.len() {
            return Err(mismatch("sensitivity", n, sensitivity));
        }
        check_settled(&self.state)?;
        let unknown_ports = self.unknowns(unknowns)?;
        let n = unknown_ports.iter().map(|(_, n)| n).sum();
        if n != seed.len() {
            return Err(mismatch("seed", n, seed));
        }
        check_seed(seed)?;
        let mut of_inputs = vec![0.0; model.parts().layout.len()];
        let mut left = seed;
        for (unknown, n) in &unknown_ports {
            let (w, later) = left.split_at(*n);
            if let Unknown::Input(first) = unknown {
                of_inputs[*first..].iter_mut().zip(w).for_each(|(sum, w)| *sum += w);
            }
            left = later;
        }
        if model.remembers() && self.work.kept.origin == Origin::Rest {
            // Nothing has moved yet, whatever the inputs.
            let elements = wanted.into_iter().flat_map(|(_, range)| range);
            elements.zip(sensitivity).for_each(|(k, out)| *out = of_inputs[k]);
            return Ok(());
        }
        if model.is_reduced() {
            let elements = wanted.into_iter().flat_map(|(_, range)| range);
            return self.replayed_adjoint(unknowns, seed, elements, sensitivity);
        }
        complete(&model, &mut self.state, &self.work);
        let parts = model.parts();
        let mut pivots = vec![Vec3::zeros(); parts.bones.len()];
        read_pivots(&model, &self.state.applied, &mut pivots);
        let config = self.state.config.clone();
        let inputs = self.state.applied.clone();
        let v = self.state.motion.v.clone();
        let Sensitivity { minimiser, past, .. } = self.sensitivity(&model)?;
        let at = At { x_lag: &config.x, ..past.at(&model, &inputs, &past.x_tilde) };
        let mut g = vec![Vec3::zeros(); config.x.len()];
        for term in &parts.terms {
            term.add_gradient(&at, &config.x, &mut g);
        }
        let size = extent(&model.mesh().nodes);
        let place = Place { model: &model, past, at, config: &config, pivots: &pivots, g: &g, v: &v, size };

        let mut weights = Weights::nothing(&place);
        let mut left = seed;
        for (unknown, n) in &unknown_ports {
            let (w, later) = left.split_at(*n);
            if let Unknown::Output(Slope::Of(_, across)) = unknown {
                across(&mut weights, &place, w);
            }
            left = later;
        }

        weights.settle(&place);
        let repeats = is_approximate(&model, minimiser);
        let lambda = place.solve(&weights, repeats, |d| minimiser.apply_inverse(d))?;
        let xi: Vec<Vec3> = place.spread(&lambda).iter().zip(&weights.eta).map(|(l, e)| l + e).collect();
        let mut q = place.transposed(&xi);
        q.iter_mut().zip(&weights.x).for_each(|(q, w)| *q += w);
        let contraction = Contraction { place: &place, lambda: &lambda, xi: &xi, q: &q, weights: &weights };
        let mut left = sensitivity;
        for (slot, range) in wanted {
            let (now, later) = left.split_at_mut(range.len());
            contraction.by(slot, now);
            now.iter_mut().zip(&of_inputs[range]).for_each(|(sum, w)| *sum += w);
            left = later;
        }
        Ok(())
    }
}

impl Weights {
    fn nothing(place: &Place) -> Weights {
        let n = place.config.x.len();
        let n_bones = place.pivots.len();
        Weights {
            x: vec![Vec3::zeros(); n],
            t: vec![Vec3::zeros(); n_bones],
            turn: vec![Vec3::zeros(); n_bones],
            elastic: 0.0,
            pivot: vec![Vec3::zeros(); n_bones],
            eta: vec![Vec3::zeros(); n],
            v: Vec::new(),
        }
    }

    /// Velocities and strain energy counted as positions.
    fn settle(&mut self, place: &Place) {
        let rates = place.past.rates(place.model.dofs());
        self.x.iter_mut().zip(self.v.drain(..)).zip(rates).for_each(|((x, v), rate)| *x += rate * v);
        if self.elastic != 0.0 {
            let mut g = vec![Vec3::zeros(); self.x.len()];
            let at = At { x_lag: &place.config.x, ..place.past.still(place.at.inputs) };
            for term in place.model.parts().terms.iter().filter(|t| t.is_elastic()) {
                term.add_gradient(&at, &place.config.x, &mut g);
            }
            self.x.iter_mut().zip(&g).for_each(|(x, g)| *x += self.elastic * g);
        }
    }

    /// Weights of nodal velocities.
    fn v(&mut self) -> &mut [Vec3] {
        self.v.resize(self.x.len(), Vec3::zeros());
        &mut self.v
    }
}

fn rows(w: &[f64]) -> impl Iterator<Item = (usize, Vec3)> {
    w.chunks_exact(3).map(Vec3::from_column_slice).enumerate()
}

pub(super) fn skin_position(weights: &mut Weights, place: &Place, w: &[f64]) {
    rows(w).for_each(|(k, w)| place.model.skin().add_transposed(k, &w, &mut weights.x));
}
pub(super) fn skin_velocity(weights: &mut Weights, place: &Place, w: &[f64]) {
    rows(w).for_each(|(k, w)| place.model.skin().add_transposed(k, &w, weights.v()));
}
pub(super) fn marker_position(weights: &mut Weights, place: &Place, w: &[f64]) {
    for (k, w) in rows(w) {
        let marker = &place.model.parts().markers[k];
        place.model.skin().add_within_transposed(marker.nodes, marker.weights, &w, &mut weights.x);
    }
}
/// f = -sum_a g_a
pub(super) fn reaction_force(weights: &mut Weights, place: &Place, w: &[f64]) {
    for (k, w) in rows(w) {
        place.model.parts().bones[k].nodes.iter().for_each(|&a| weights.eta[a as usize] -= w);
    }
}
/// m = -sum_a r_a x g_a with r_a = x_a - p
pub(super) fn reaction_torque(weights: &mut Weights, place: &Place, w: &[f64]) {
    for (k, w) in rows(w) {
        for &a in &place.model.parts().bones[k].nodes {
            let (r, g) = (place.arm(k, a), place.g[a as usize]);
            weights.eta[a as usize] -= w.cross(&r);
            weights.x[a as usize] += w.cross(&g);
            weights.pivot[k] -= w.cross(&g);
        }
    }
}
pub(super) fn pose_translation(weights: &mut Weights, _: &Place, w: &[f64]) {
    rows(w).for_each(|(k, w)| weights.t[k] += w);
}
/// A turn by dw from R = exp(r) changes r by J(r)^-1 dw.
pub(super) fn pose_rotation(weights: &mut Weights, place: &Place, w: &[f64]) {
    for (k, w) in rows(w) {
        let J = left_jacobian(&log_rotation(&place.config.poses[k].R));
        weights.turn[k] += J.try_inverse().map_or(w, |inverse| inverse.tr_mul(&w));
    }
}
/// f = -sum_i g_i over its frame
pub(super) fn contact_force(weights: &mut Weights, place: &Place, w: &[f64]) {
    for (k, w) in rows(w) {
        place.model.parts().contacts[k].frame.iter().for_each(|&a| weights.eta[a as usize] -= w);
    }
}
pub(super) fn contact_depth(weights: &mut Weights, place: &Place, w: &[f64]) {
    let parts = place.model.parts();
    for (contact, w) in parts.contacts.iter().zip(w) {
        parts.terms[contact.term].add_depth_gradient(*w, &place.config.x, &mut weights.x);
    }
}
pub(super) fn elastic(weights: &mut Weights, _: &Place, w: &[f64]) {
    weights.elastic += w[0];
}
pub(super) fn kinetic(weights: &mut Weights, place: &Place, w: &[f64]) {
    let Some(inertia) = &place.model.parts().inertia else { return };
    let moving = inertia.m.iter().zip(place.v);
    weights.v().iter_mut().zip(moving).for_each(|(of, (m, v))| *of += w[0] * *m * v);
}

impl Place<'_> {
    /// From the current pivot of a bone to a node.
    fn arm(&self, bone: usize, a: u32) -> Vec3 {
        self.config.x[a as usize] - self.pivots[bone] - self.config.poses[bone].t
    }

    /// A field of unknowns as one of nodes: nodes of force-driven bones turn with them, driven nodes stay.
    fn spread(&self, lambda: &[Vec3]) -> Vec<Vec3> {
        let dofs = self.model.dofs();
        let mut xi = vec![Vec3::zeros(); self.config.x.len()];
        for (&a, l) in dofs.free.iter().zip(lambda) {
            xi[a as usize] = *l;
        }
        for body in &dofs.bodies {
            let (t, w) = (lambda[body.block as usize], lambda[body.block as usize + 1]);
            for &a in &body.nodes {
                xi[a as usize] = t + w.cross(&self.arm(body.bone, a));
            }
        }
        xi
    }

    /// `(dg/dx)^T xi` over the nodes: the symmetric part by central differences, that of following forces in closed form.
    fn transposed(&self, xi: &[Vec3]) -> Vec<Vec3> {
        let terms = &self.model.parts().terms;
        let largest = xi.iter().map(Vec3::norm).fold(0.0, f64::max);
        let mut out = vec![Vec3::zeros(); xi.len()];
        if largest == 0.0 {
            return out;
        }
        let h = CHANGE * self.size / largest;
        let mut sides = [h, -h].map(|h| {
            let x: Vec<Vec3> = self.config.x.iter().zip(xi).map(|(x, xi)| x + h * xi).collect();
            let x_tilde = self.past.carried(self.model.dofs(), |a| h * xi[a]);
            let at = At { x_tilde: &x_tilde, ..self.at };
            let mut g = vec![Vec3::zeros(); x.len()];
            for term in terms {
                term.add_gradient(&at, &x, &mut g);
            }
            g
        });
        let [plus, minus] = &mut sides;
        for ((out, p), m) in out.iter_mut().zip(plus).zip(minus) {
            *out = (*p - *m) / (2.0 * h);
        }
        terms.iter().for_each(|t| t.add_lag_transposed(&self.at, xi, &mut out));
        out
    }

    /// A nodal field gathered into the unknowns: forces, and torques about the pivots.
    fn gather(&self, q: &[Vec3]) -> Vec<Vec3> {
        let mut out = vec![Vec3::zeros(); self.model.dofs().n_blocks()];
        self.model.dofs().reduce(q, self.config, self.pivots, &mut out);
        out
    }

    /// `A^T lambda`.
    fn transposed_of_unknowns(&self, lambda: &[Vec3]) -> Vec<Vec3> {
        let mut out = self.gather(&self.transposed(&self.spread(lambda)));
        // The arms of the gradient turn with the bone.
        for body in &self.model.dofs().bodies {
            let turn = body.block as usize + 1;
            for &a in &body.nodes {
                out[turn] += self.arm(body.bone, a).cross(&self.g[a as usize].cross(&lambda[turn]));
            }
        }
        out
    }

    /// lambda, by solves with `K` that are repeated where `K` is not `A^T`.
    fn solve(
        &self,
        weights: &Weights,
        repeats: bool,
        mut apply_inverse: impl FnMut(&mut [Vec3]),
    ) -> Result<Vec<Vec3>, SimError> {
        let mut q = self.transposed(&weights.eta);
        q.iter_mut().zip(&weights.x).for_each(|(q, w)| *q += w);
        let mut c = self.gather(&q);
        for body in &self.model.dofs().bodies {
            c[body.block as usize] += weights.pivot[body.bone] + weights.t[body.bone];
            c[body.block as usize + 1] += weights.turn[body.bone];
        }
        c.iter_mut().for_each(|c| *c = -*c);
        let mut lambda = c.clone();
        apply_inverse(&mut lambda);
        if !repeats {
            return Ok(lambda);
        }
        for _ in 0..MOST_PASSES {
            let mut r: Vec<Vec3> =
                c.iter().zip(self.transposed_of_unknowns(&lambda)).map(|(c, done)| c - done).collect();
            apply_inverse(&mut r);
            let (mut size, mut correction) = (0.0_f64, 0.0_f64);
            for (l, r) in lambda.iter_mut().zip(&r) {
                *l += r;
                size = size.max(l.norm());
                correction = correction.max(r.norm());
            }
            if correction <= SETTLED * size {
                return Ok(lambda);
            }
        }
        Err(too_strong())
    }
}

/// What is left to do for each input.
struct Contraction<'a> {
    place: &'a Place<'a>,
    lambda: &'a [Vec3],
    /// Coefficients of the nodal gradient.
    xi: &'a [Vec3],
    /// Coefficients of the nodal positions, `xi` contracted with the stiffness included.
    q: &'a [Vec3],
    /// Coefficients of what bones and energy are.
    weights: &'a Weights,
}

impl Contraction<'_> {
    fn by(&self, slot: Slot, out: &mut [f64]) {
        let parts = self.place.model.parts();
        match slot {
            Slot::BoneTranslation | Slot::BoneRotation | Slot::BoneForce | Slot::BoneTorque | Slot::BonePivot => {
                for (b, row) in out.chunks_exact_mut(3).enumerate() {
                    row.copy_from_slice(self.by_bone(slot, b).as_slice());
                }
            }
            Slot::BoneNodal(b) => {
                for (&a, row) in parts.bones[b as usize].nodes.iter().zip(out.chunks_exact_mut(3)) {
                    row.copy_from_slice(self.q[a as usize].as_slice());
                }
            }
            read_by_terms => {
                let first = parts.layout.first(read_by_terms).expect("every other known is an input of terms");
                for (k, out) in (first..).zip(out) {
                    *out = self.by_input(k);
                }
            }
        }
    }

    fn by_bone(&self, slot: Slot, b: usize) -> Vec3 {
        let Place { model, config, g, at, .. } = self.place;
        let Weights { t, turn, pivot, .. } = self.weights;
        let bone = &model.parts().bones[b];
        let q = |a: &u32| self.q[*a as usize];
        let body = model.dofs().bodies.iter().find(|body| body.bone == b);
        let pushed = || bone.nodes.iter().map(q).sum::<Vec3>();
        match slot {
            Slot::BoneTranslation if bone.drive == Drive::Pose => pushed() + pivot[b] + t[b],
            Slot::BoneRotation if bone.drive == Drive::Pose => {
                let first = model.parts().layout.first(slot).expect("a port of the model") + 3 * b;
                let w = Vec3::from_column_slice(&at.inputs[first..first + 3]);
                let twist: Vec3 = bone.nodes.iter().map(|a| self.place.arm(b, *a).cross(&q(a))).sum();
                left_jacobian(&w).tr_mul(&(twist + turn[b]))
            }
            Slot::BoneForce => body.map_or(Vec3::zeros(), |body| -self.lambda[body.block as usize]),
            Slot::BoneTorque => body.map_or(Vec3::zeros(), |body| -self.lambda[body.block as usize + 1]),
            Slot::BonePivot => {
                // dx = (I - R) dp, and the arms of a force-driven bone turn by -R dp.
                let Pose { R, .. } = config.poses[b];
                let mut by = (Mat3::identity() - R).tr_mul(&pushed()) + pivot[b];
                if let Some(body) = body {
                    let held: Vec3 = bone.nodes.iter().map(|&a| g[a as usize]).sum();
                    by -= R.tr_mul(&held.cross(&self.lambda[body.block as usize + 1]));
                }
                by
            }
            _ => Vec3::zeros(),
        }
    }

    /// `xi . dg/ds_k`, with the strain energy's own share, by a difference of the terms that read it.
    fn by_input(&self, k: usize) -> f64 {
        let place = self.place;
        let Place { model, config, at, .. } = place;
        let mut inputs = at.inputs.to_vec();
        let h = at.inputs[k].abs().max(1.0);
        let mut g = vec![Vec3::zeros(); config.x.len()];
        let mut side = |value: f64| {
            inputs[k] = value;
            let at = At { inputs: &inputs, ..*at };
            g.fill(Vec3::zeros());
            let mut elastic = 0.0;
            for term in model.parts().terms.iter().filter(|t| t.inputs().contains(&k)) {
                term.add_gradient(&at, &config.x, &mut g);
                if self.weights.elastic != 0.0 {
                    elastic += self.weights.elastic * term.strain(&place.past.still(&inputs), &config.x).energy;
                }
            }
            elastic + g.iter().zip(self.xi).map(|(g, xi)| g.dot(xi)).sum::<f64>()
        };
        let value = at.inputs[k];
        (side(value + h) - side(value - h)) / (2.0 * h)
    }
}
