//! Which nodes are unknown: free, prescribed, or carried by a force-driven rigid bone.

use crate::math::{Mat3, Pose, Vec3, exp_rotation, skew};
use crate::mesh::Elimination;

/// What moves a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// An unknown of its own: block index.
    Free(u32),
    /// Set by the host: index into `Dofs::prescribed`.
    Prescribed(u32),
    /// Carried by a force-driven rigid body: index into `Dofs::bodies`.
    Rigid(u32),
}

/// A force-driven rigid bone: two unknown blocks, a translation and a rotation increment.
#[derive(Debug, Clone)]
pub struct RigidBody {
    /// Index of the bone in the model.
    pub bone: usize,
    /// Its nodes.
    pub nodes: Vec<u32>,
    /// Block of the translation; the rotation is the next one.
    pub block: u32,
}

/// The unknowns of the minimisation.
#[derive(Debug, Clone)]
pub struct Dofs {
    /// What moves each node.
    pub role: Vec<Role>,
    /// Node of each free block.
    pub free: Vec<u32>,
    /// Prescribed nodes.
    pub prescribed: Vec<u32>,
    /// Force-driven bones.
    pub bodies: Vec<RigidBody>,
    /// The order to eliminate them in, where it is known already.
    pub elimination: Option<Elimination>,
}

/// Where everything is: node positions and bone poses.
#[derive(Debug, Clone, PartialEq)]
pub struct Configuration {
    /// Node positions, m.
    pub x: Vec<Vec3>,
    /// Pose of every bone.
    pub poses: Vec<Pose>,
}

impl Configuration {
    /// Overwrites itself with `other` without allocating.
    pub fn copy_from(&mut self, other: &Configuration) {
        self.x.copy_from_slice(&other.x);
        self.poses.copy_from_slice(&other.poses);
    }
}

impl Dofs {
    /// Splits `n_nodes` nodes: those of `prescribed`, those of force-driven bones (`(bone, nodes)`), the rest free.
    pub fn new(n_nodes: usize, prescribed: Vec<u32>, rigid: Vec<(usize, Vec<u32>)>) -> Dofs {
        let mut role = vec![Role::Free(0); n_nodes];
        for (p, &a) in prescribed.iter().enumerate() {
            role[a as usize] = Role::Prescribed(p as u32);
        }
        for (b, (_, nodes)) in rigid.iter().enumerate() {
            for &a in nodes {
                role[a as usize] = Role::Rigid(b as u32);
            }
        }
        let mut free = Vec::new();
        for (a, role) in role.iter_mut().enumerate() {
            if let Role::Free(block) = role {
                *block = free.len() as u32;
                free.push(a as u32);
            }
        }
        let bodies = rigid
            .into_iter()
            .enumerate()
            .map(|(b, (bone, nodes))| RigidBody { bone, nodes, block: (free.len() + 2 * b) as u32 })
            .collect();
        Dofs { role, free, prescribed, bodies, elimination: None }
    }

    /// Number of 3-vectors of unknowns.
    pub fn n_blocks(&self) -> usize {
        self.free.len() + 2 * self.bodies.len()
    }

    /// Blocks that move node `a`, with dx_a / d(block); none for a prescribed node.
    ///
    /// `arm` is the node's place relative to its body's pivot.
    pub fn movers(&self, a: u32, arm: impl FnOnce(&RigidBody) -> Vec3) -> ([(u32, Mat3); 2], usize) {
        let nothing = (u32::MAX, Mat3::zeros());
        match self.role[a as usize] {
            Role::Free(block) => ([(block, Mat3::identity()), nothing], 1),
            Role::Prescribed(_) => ([nothing, nothing], 0),
            Role::Rigid(b) => {
                let body = &self.bodies[b as usize];
                ([(body.block, Mat3::identity()), (body.block + 1, -skew(&arm(body)))], 2)
            }
        }
    }

    /// Gathers a nodal gradient (N) into the gradient of the unknowns: forces, and torques about the pivots.
    pub fn reduce(&self, g: &[Vec3], config: &Configuration, pivots: &[Vec3], out: &mut [Vec3]) {
        for (block, &a) in self.free.iter().enumerate() {
            out[block] = g[a as usize];
        }
        for body in &self.bodies {
            let p = pivots[body.bone] + config.poses[body.bone].t;
            let (mut force, mut torque) = (Vec3::zeros(), Vec3::zeros());
            for &a in &body.nodes {
                let g_a = g[a as usize];
                force += g_a;
                torque += (config.x[a as usize] - p).cross(&g_a);
            }
            out[body.block as usize] = force;
            out[body.block as usize + 1] = torque;
        }
    }

    /// Moves `from` along `alpha d` into `to`: nodes by addition, bones by a turn about their pivots.
    ///
    /// `X` are the rest positions; prescribed nodes of `to` keep what they have.
    pub fn retract(
        &self,
        X: &[Vec3],
        pivots: &[Vec3],
        from: &Configuration,
        alpha: f64,
        d: &[Vec3],
        to: &mut Configuration,
    ) {
        for (&a, d) in self.free.iter().zip(d) {
            to.x[a as usize] = from.x[a as usize] + alpha * d;
        }
        for body in &self.bodies {
            let old = &from.poses[body.bone];
            let (dt, dw) = (d[body.block as usize], d[body.block as usize + 1]);
            let pose = Pose { t: old.t + alpha * dt, R: exp_rotation(&(alpha * dw)) * old.R };
            to.poses[body.bone] = pose;
            for &a in &body.nodes {
                to.x[a as usize] = pose.place(&pivots[body.bone], &X[a as usize]);
            }
        }
    }

    /// Largest displacement (m) that the increment `d` gives to any node.
    pub fn largest_motion(&self, d: &[Vec3], config: &Configuration, pivots: &[Vec3]) -> f64 {
        let free = d[..self.free.len()].iter().map(|d| d.norm_squared()).fold(0.0, f64::max).sqrt();
        let rigid = self.bodies.iter().map(|body| {
            let p = pivots[body.bone] + config.poses[body.bone].t;
            let (dt, dw) = (d[body.block as usize], d[body.block as usize + 1]);
            body.nodes.iter().map(|&a| (dt + dw.cross(&(config.x[a as usize] - p))).norm()).fold(0.0, f64::max)
        });
        rigid.fold(free, f64::max)
    }
}
