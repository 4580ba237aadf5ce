//! A force passed on from vertex to vertex: displacement check against limits, excess to the neighbours, recursively.
//!
//! ```text
//! at a vertex with force f:   d = K^-1 f,   K = sum over its edges of k n n^T      (the neighbours stay)
//!                             s = largest part of d that keeps each of its edges within [0.75, 1.5] of its rest length
//!                             the vertex moves by s d and takes s f; the excess (1 - s) f goes to its neighbours
//! ```
//!
//! Source: "Human Facial Soft Tissue Modeling Using Finite Element Method", section 6.3 (limits +50 % and -25 %). What it
//! leaves open is chosen here: the edges' stiffness after Van Gelder (`effect::springs`), shares in proportion to that
//! stiffness, vertices in the order in which they are reached, a force too small to matter dropped, and a budget of visits.
//!
//! It is no equilibrium. Below the limits a force moves one vertex and no other, however long it acts; the order of visits
//! decides; torque is not conserved. What holds: every edge of a vertex that moved is within the limits, and force is
//! conserved as a ledger, `force = taken + held + left`.

use std::collections::VecDeque;

use crate::effect::{Spring, springs};
use crate::math::{Mat3, Vec3};
use crate::mesh::TetMesh;

/// How a force is passed on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rules {
    /// Least and largest length of an edge, in units of its rest length.
    pub limits: [f64; 2],
    /// Young's modulus, Pa.
    pub E: f64,
    /// A force below this part of the applied one is no longer passed on.
    pub least: f64,
    /// Most visits to vertices.
    pub budget: usize,
}

impl Rules {
    /// The source's limits at Young's modulus `E` (Pa), down to a thousandth of the force, in at most 100,000 visits.
    pub fn new(E: f64) -> Rules {
        Rules { limits: [0.75, 1.5], E, least: 1e-3, budget: 100_000 }
    }
}

/// Where it ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Passed {
    /// Positions, m.
    pub x: Vec<Vec3>,
    /// Force that displacements took, N.
    pub taken: Vec3,
    /// Force that ended at held vertices, N.
    pub held: Vec3,
    /// Force dropped as too small, or left when the budget ran out, N.
    pub left: Vec3,
    /// Visits to vertices.
    pub visits: usize,
}

/// Applies `loads` (vertex, N) to `mesh` at rest; the vertices of `held` do not move and keep what reaches them.
///
/// # Panics
/// If a vertex lies outside the mesh.
pub fn pass_on(mesh: &TetMesh, held: &[u32], loads: &[(u32, Vec3)], rules: &Rules) -> Passed {
    let n = mesh.nodes.len();
    let springs = springs(rules.E, &mesh.nodes, &mesh.tets);
    let mut around: Vec<Vec<(u32, Spring)>> = vec![Vec::new(); n];
    for s in &springs {
        let [a, b] = s.ends;
        around[a as usize].push((b, *s));
        around[b as usize].push((a, *s));
    }
    let mut is_held = vec![false; n];
    held.iter().for_each(|&a| is_held[a as usize] = true);
    let least = rules.least * loads.iter().map(|(_, f)| f.norm()).fold(0.0, f64::max);
    let mut out =
        Passed { x: mesh.nodes.clone(), taken: Vec3::zeros(), held: Vec3::zeros(), left: Vec3::zeros(), visits: 0 };
    // Forces that wait at a vertex add up until it is visited.
    let mut waiting = vec![Vec3::zeros(); n];
    let mut queue: VecDeque<u32> = VecDeque::new();
    let push = |queue: &mut VecDeque<u32>, waiting: &mut Vec<Vec3>, a: u32, f: Vec3| {
        if waiting[a as usize] == Vec3::zeros() {
            queue.push_back(a);
        }
        waiting[a as usize] += f;
    };
    loads.iter().for_each(|&(a, f)| push(&mut queue, &mut waiting, a, f));
    while out.visits < rules.budget {
        let Some(a) = queue.pop_front() else { break };
        let f = std::mem::take(&mut waiting[a as usize]);
        out.visits += 1;
        if is_held[a as usize] {
            out.held += f;
            continue;
        }
        if f.norm() <= least {
            out.left += f;
            continue;
        }
        let edges = &around[a as usize];
        let d = displacement(&out.x, a, edges, &f);
        let share = within_limits(&out.x, a, edges, &d, rules.limits);
        out.x[a as usize] += share * d;
        out.taken += share * f;
        let excess = (1.0 - share) * f;
        if excess != Vec3::zeros() {
            let stiffness: f64 = edges.iter().map(|(_, s)| s.k).sum();
            edges.iter().for_each(|&(b, s)| push(&mut queue, &mut waiting, b, s.k / stiffness * excess));
        }
    }
    out.left += waiting.iter().sum::<Vec3>();
    out
}

/// `K^-1 f` with the neighbours in their places; zero where the edges leave a direction free.
fn displacement(x: &[Vec3], a: u32, edges: &[(u32, Spring)], f: &Vec3) -> Vec3 {
    let part = |&(b, s): &(u32, Spring)| {
        let n = (x[b as usize] - x[a as usize]).normalize();
        s.k * n * n.transpose()
    };
    edges.iter().map(part).sum::<Mat3>().try_inverse().map_or(Vec3::zeros(), |inverse| inverse * f)
}

/// Largest part of `d`, at most 1, on all the way of which each edge is within the limits.
fn within_limits(x: &[Vec3], a: u32, edges: &[(u32, Spring)], d: &Vec3, limits: [f64; 2]) -> f64 {
    let share = edges.iter().map(|&(b, s)| {
        let r = x[a as usize] - x[b as usize];
        // |r + t d|^2 = c^2 as a t^2 + 2 h t + (|r|^2 - c^2) = 0
        let (a, h, rr) = (d.norm_squared(), r.dot(d), r.norm_squared());
        let [low, high] = limits.map(|c| rr - (c * s.L).powi(2));
        let reach_high = if high >= 0.0 && h >= 0.0 { 0.0 } else { (-h + (h * h - a * high).max(0.0).sqrt()) / a };
        let reach_low = match h * h - a * low {
            _ if h >= 0.0 => f64::INFINITY,
            discriminant if discriminant <= 0.0 => f64::INFINITY,
            _ if low <= 0.0 => 0.0,
            discriminant => (-h - discriminant.sqrt()) / a,
        };
        reach_high.min(reach_low)
    });
    let share = share.fold(1.0, f64::min);
    // No displacement at all: 0/0 above.
    if *d == Vec3::zeros() { 0.0 } else { share.clamp(0.0, 1.0) }
}
