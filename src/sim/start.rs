//! The acceleration that a scene at rest starts with: what its forces do to its masses.
//!
//! ```text
//! M a = -g for free nodes;   J^T M J (a_t, a_w) = -J^T g for a force-driven bone, whose nodes have a = a_t + a_w x r
//! ```

use nalgebra::{Matrix6, Vector6};

use crate::fem::{Configuration, Role};
use crate::math::{Mat3, Vec3, skew};
use crate::solve::Problem;

/// Acceleration of each node under the forces of `problem` at `config`, m/s2; those of prescribed nodes are zero, and so
/// is one that the masses `m` (kg) do not decide.
pub(super) fn accelerations(problem: &Problem, config: &Configuration, m: &[f64]) -> Vec<Vec3> {
    let dofs = problem.dofs;
    let mut nodal = vec![Vec3::zeros(); m.len()];
    let mut g = vec![Vec3::zeros(); dofs.n_blocks()];
    problem.gradient(config, config, &mut nodal, &mut g);
    let mut a: Vec<Vec3> = dofs
        .role
        .iter()
        .zip(&nodal)
        .zip(m)
        .map(|((role, g), m)| match role {
            Role::Free(_) if *m > 0.0 => -g / *m,
            _ => Vec3::zeros(),
        })
        .collect();
    for body in &dofs.bodies {
        let p = problem.pivots[body.bone] + config.poses[body.bone].t;
        let mut M = Matrix6::zeros();
        for &k in &body.nodes {
            let mut J = nalgebra::Matrix3x6::zeros();
            J.fixed_view_mut::<3, 3>(0, 0).copy_from(&Mat3::identity());
            J.fixed_view_mut::<3, 3>(0, 3).copy_from(&-skew(&(config.x[k as usize] - p)));
            M += m[k as usize] * J.tr_mul(&J);
        }
        let block = body.block as usize;
        let f = Vector6::from_iterator(g[block].iter().chain(g[block + 1].iter()).map(|c| -c));
        let Some(wrench) = M.cholesky().map(|M| M.solve(&f)) else { continue };
        let (t, w) = (wrench.fixed_rows::<3>(0).into_owned(), wrench.fixed_rows::<3>(3).into_owned());
        for &k in &body.nodes {
            a[k as usize] = t + w.cross(&(config.x[k as usize] - p));
        }
    }
    a
}
