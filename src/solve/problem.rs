//! What is minimised: the terms plus the work of forces and torques on force-driven bones.

use crate::fem::{At, Configuration, Dofs, Term};
use crate::math::{Vec3, extent, log_rotation};

/// Sizes of the model beyond which a motion is no motion of tissue.
const FARTHEST: f64 = 1e6;

/// A sum of terms over the unknowns, with all it depends on.
#[derive(Clone, Copy)]
pub struct Problem<'a> {
    /// The summands.
    pub terms: &'a [Box<dyn Term>],
    /// What is unknown.
    pub dofs: &'a Dofs,
    /// Rest positions, m.
    pub X: &'a [Vec3],
    /// Rest position of each bone's pivot, m.
    pub pivots: &'a [Vec3],
    /// Force (N) at the pivot of, and torque (N m) on, each of `dofs.bodies`.
    pub wrenches: &'a [(Vec3, Vec3)],
    /// Time, inputs and inertia; its `x_lag` is replaced by the minimiser.
    pub at: At<'a>,
}

impl Problem<'_> {
    fn at<'b>(&'b self, lag: &'b Configuration) -> At<'b> {
        At { x_lag: &lag.x, ..self.at }
    }

    /// Whether some force follows the deformation and is brought up to date after each iteration.
    pub fn is_lagged(&self) -> bool {
        self.terms.iter().any(|t| t.is_lagged()) || self.wrenches.iter().any(|(_, torque)| *torque != Vec3::zeros())
    }

    /// Whether the stiffness is the same everywhere.
    pub fn is_quadratic(&self) -> bool {
        self.dofs.bodies.is_empty() && self.terms.iter().all(|t| t.is_quadratic())
    }

    /// Whether a node has gone so far that stiffnesses there and elsewhere share no digits.
    pub fn is_beyond_numbers(&self, config: &Configuration) -> bool {
        let far = FARTHEST * extent(self.X);
        config.x.iter().zip(self.X).any(|(x, X)| (x - X).norm() > far)
    }

    /// Smallest det F of all elements at `x`.
    pub fn min_det_f(&self, x: &[Vec3]) -> f64 {
        self.terms.iter().map(|t| t.min_det_f(x)).fold(f64::INFINITY, f64::min)
    }

    /// Energy, J.
    pub fn energy(&self, config: &Configuration, lag: &Configuration) -> f64 {
        let at = self.at(lag);
        self.terms.iter().map(|t| t.energy(&at, &config.x)).sum::<f64>() + self.body_energy(config, lag)
    }

    /// Energy (J); overwrites the nodal gradient `nodal` and the gradient of the unknowns `g`.
    pub fn gradient(&self, config: &Configuration, lag: &Configuration, nodal: &mut [Vec3], g: &mut [Vec3]) -> f64 {
        let at = self.at(lag);
        nodal.fill(Vec3::zeros());
        let energy: f64 = self.terms.iter().map(|t| t.add_gradient(&at, &config.x, nodal)).sum();
        self.dofs.reduce(nodal, config, self.pivots, g);
        for (body, (force, torque)) in self.dofs.bodies.iter().zip(self.wrenches) {
            let theta = turned(config, lag, body.bone);
            g[body.block as usize] -= force;
            g[body.block as usize + 1] -= inverse_left_jacobian_transposed(&theta, torque);
        }
        energy + self.body_energy(config, lag)
    }

    /// Fills the stiffness at `config`, where `nodal` is the nodal gradient.
    pub fn assemble(
        &self,
        assembly: &mut crate::fem::Assembly,
        config: &Configuration,
        nodal: &[Vec3],
        curvature: crate::fem::Curvature,
    ) {
        assembly.fill(self.terms, self.dofs, &self.at(config), config, self.pivots, nodal, curvature);
    }

    /// The potential `-f.t - tau.theta` of the wrenches, theta counted from the lagged pose.
    fn body_energy(&self, config: &Configuration, lag: &Configuration) -> f64 {
        let work = self.dofs.bodies.iter().zip(self.wrenches).map(|(body, (force, torque))| {
            force.dot(&config.poses[body.bone].t) + torque.dot(&turned(config, lag, body.bone))
        });
        -work.sum::<f64>()
    }
}

fn turned(config: &Configuration, lag: &Configuration, bone: usize) -> Vec3 {
    log_rotation(&(config.poses[bone].R * lag.poses[bone].R.transpose()))
}

/// `(d theta / d w)^T tau` for `exp(w) exp(theta)` at w = 0.
///
/// Source: Barfoot, "State Estimation for Robotics", 2017, eq. 7.77.
fn inverse_left_jacobian_transposed(theta: &Vec3, tau: &Vec3) -> Vec3 {
    let angle = theta.norm();
    let c = if angle < 1e-3 {
        1.0 / 12.0 + angle * angle / 720.0
    } else {
        1.0 / (angle * angle) - (1.0 + angle.cos()) / (2.0 * angle * angle.sin())
    };
    tau + 0.5 * theta.cross(tau) + c * theta.cross(&theta.cross(tau))
}
