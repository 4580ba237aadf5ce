//! Smoothing: node by node, the energy of its star falls and its worst tetrahedron gets no worse.
//!
//! Inner nodes go anywhere, those on a wall slide along it, those on the box's faces stay in them. Gauss-Seidel in the order
//! of the nodes, so the result depends on nothing else.

use super::super::stencils::Stuffed;
use super::super::topology::stars;
use super::shape::Star;
use super::walls::Held;
use crate::math::{Mat3, Random, Vec3};

/// Shorter steps that are tried, each .4 of the one before.
const TRIES: usize = 4;
const SHORTER: f64 = 0.4;
/// A star may get worse down to this score if its energy falls.
const GOOD: f64 = 0.35;
/// Trial points of the search for the worst stars, and the share of the mean edge within which they lie.
const POINTS: usize = 16;
const SPREAD: f64 = 0.3;

/// Stars of all nodes of a mesh whose tetrahedra stay as they are.
pub(super) struct Stars {
    begin: Vec<u32>,
    items: Vec<u32>,
}

impl Stars {
    pub fn of(mesh: &Stuffed) -> Self {
        let (begin, items) = stars(&mesh.tets, mesh.nodes.len(), &vec![true; mesh.nodes.len()]);
        Self { begin, items }
    }

    pub fn star(&self, a: usize) -> &[u32] {
        &self.items[self.begin[a] as usize..self.begin[a + 1] as usize]
    }
}

/// Moves each node, in order, to the place that `place` finds for it in its star, if any.
fn visit(mesh: &mut Stuffed, stars: &Stars, place: impl Fn(&Stuffed, &Star, usize) -> Option<Vec3>) {
    let mut star = Star::default();
    for a in 0..mesh.nodes.len() {
        if stars.star(a).is_empty() {
            continue;
        }
        star.read(&mesh.nodes, &mesh.tets, stars.star(a), a as u32);
        if let Some(x) = place(mesh, &star, a) {
            mesh.nodes[a] = x;
        }
    }
}

/// One round over the nodes whose star's worst score is below `limit`, with the power `p` of the energy.
pub(super) fn round(mesh: &mut Stuffed, stars: &Stars, held: &Held, p: i32, limit: f64) {
    visit(mesh, stars, |mesh, star, a| better(mesh, star, held, a, p, limit));
}

/// A better place for a node, if a Newton step in its freedom leads to one.
fn better(mesh: &Stuffed, star: &Star, held: &Held, a: usize, p: i32, limit: f64) -> Option<Vec3> {
    let x = mesh.nodes[a];
    let (energy, worst) = star.energy(&x, p);
    if worst > limit || !energy.is_finite() {
        return None;
    }
    let (basis, n) = held.freedom(mesh, a);
    if n == 0 {
        return None;
    }
    let (gradient, hessian) = star.derivatives(&x, p);
    let mut step = newton(&gradient, &hessian, &basis[..n]);
    let length = step.norm();
    if length < 1e-4 * star.shortest {
        return None;
    }
    let most = 0.5 * star.shortest;
    if length > most {
        step *= most / length;
    }
    for _ in 0..TRIES {
        if let Some(y) = held.returned(mesh, a, x + step) {
            let (e, w) = star.energy(&y, p);
            if e < energy && (w >= worst || w > GOOD) {
                return Some(y);
            }
        }
        step *= SHORTER;
    }
    None
}

/// The Newton step within a basis; along a direction of no curvature, down the slope.
fn newton(gradient: &Vec3, hessian: &Mat3, basis: &[Vec3]) -> Vec3 {
    let mut small = Mat3::identity();
    let mut right = Vec3::zeros();
    for (i, u) in basis.iter().enumerate() {
        right[i] = -u.dot(gradient);
        for (j, v) in basis.iter().enumerate() {
            small[(i, j)] = u.dot(&(hessian * v));
        }
    }
    let solved = small.cholesky().map(|c| c.solve(&right));
    let y = solved.unwrap_or_else(|| {
        let scale = hessian.diagonal().abs().max().max(f64::MIN_POSITIVE);
        right / scale
    });
    basis.iter().enumerate().map(|(i, u)| u * y[i]).sum()
}

/// Searches round the nodes of the worst stars, those below `limit`, for places where the worst score rises.
pub(super) fn rescue(mesh: &mut Stuffed, stars: &Stars, held: &Held, limit: f64, rounds: usize) {
    for r in 0..rounds {
        visit(mesh, stars, |mesh, star, a| rescued(mesh, star, held, a, limit, r));
    }
}

/// The best of some places round a node, if its star is worse than `limit` and one of them is better.
fn rescued(mesh: &Stuffed, star: &Star, held: &Held, a: usize, limit: f64, seed: usize) -> Option<Vec3> {
    let mut x = mesh.nodes[a];
    let mut worst = star.worst(&x);
    if worst > limit {
        return None;
    }
    let (basis, n) = held.freedom(mesh, a);
    if n == 0 {
        return None;
    }
    let mut random = Random((a as u64) << 20 | seed as u64);
    let mut found = None;
    for k in 0..POINTS {
        let reach = SPREAD * star.mean * 0.5f64.powi((k % 5) as i32);
        let step: Vec3 = basis[..n].iter().map(|u| u * (reach * random.signed())).sum();
        let Some(y) = held.returned(mesh, a, x + step) else { continue };
        let w = star.worst(&y);
        if w > worst * 1.001 && w > 0.0 {
            (x, worst) = (y, w);
            found = Some(x);
        }
    }
    found
}
