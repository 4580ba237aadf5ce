//! The parts of a step on a block: forces, stiffness, factor, solve.

use super::{Size, bandwidth, median_time};
use crate::error::Error;
use crate::fem::{Assembly, At, Configuration, Curvature};
use crate::load;
use crate::math::{Pose, Vec3};

use crate::sim::SimError;
use crate::solve::{Cholesky, LinearSolver, MOST_ENTRIES, Precision, Problem};

/// Seconds that the measurement of a part takes.
const LONG_ENOUGH: f64 = 0.3;

/// CPU seconds of the parts of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Parts {
    /// Tetrahedra.
    pub n_tets: usize,
    /// Scalar unknowns.
    pub n_dofs: usize,
    /// Energy and forces of all elements.
    pub forces: f64,
    /// Stiffness of all elements, summed into the matrix.
    pub stiffness: f64,
    /// Ordering and symbolic factorisation.
    pub analysis: f64,
    /// Numbers of the factor.
    pub factor: f64,
    /// Entries of the factor.
    pub n_factor: usize,
    /// A solve in double precision.
    pub solve_double: f64,
    /// A solve in single precision, as quasi-Newton steps do.
    pub solve: f64,
    /// Bytes a second at which one core reads a list as long as the factor in single precision.
    pub bandwidth: f64,
}

impl Parts {
    /// Time in which memory alone could deliver what a solve reads: the factor, twice.
    pub fn solve_limit(&self) -> f64 {
        8.0 * self.n_factor as f64 / self.bandwidth
    }
}

/// Measures the parts with this law on a block of this size, slightly deformed.
///
/// # Errors
/// [`Error`] for a law that the catalogue does not have.
pub fn parts(size: &Size, law: &str) -> Result<Parts, Error> {
    let text = format!(
        "[mesh.block]\nsize = [0.1, 0.1, 0.04]\ncells = {:?}\n[[tissue]]\nenergy = \"{law}\"\nE = 15e3\nnu = 0.45\n\
         [[bone]]\nname = \"bone\"\nnodes = \"z_min\"\ndrive = \"held\"\n",
        size.cells
    );
    let model = load::from_text(&text, None)?.model;
    let (mesh, dofs, terms) = (model.mesh(), model.dofs(), &model.parts().terms);
    let pivots = [Vec3::zeros()];
    let bent = |X: &Vec3| X + 1e-3 * Vec3::new((40.0 * X.y).sin(), (50.0 * X.z).sin(), (60.0 * X.x).sin());
    let config = Configuration { x: mesh.nodes.iter().map(bent).collect(), poses: vec![Pose::REST] };
    let problem = Problem { terms, dofs, X: &mesh.nodes, pivots: &pivots, wrenches: &[], at: At::NOWHERE };
    let mut nodal = vec![Vec3::zeros(); mesh.nodes.len()];
    let forces = median_time(LONG_ENOUGH, || {
        nodal.fill(Vec3::zeros());
        std::hint::black_box(terms.iter().map(|t| t.add_gradient(&At::NOWHERE, &config.x, &mut nodal)).sum::<f64>());
    });
    let mut assembly = Assembly::new(terms, dofs);
    let stiffness = median_time(LONG_ENOUGH, || problem.assemble(&mut assembly, &config, &nodal, Curvature::Exact));
    problem.assemble(&mut assembly, &config, &nodal, Curvature::Projected);
    let mut analysed = None;
    let analysis = median_time(0.0, || {
        analysed = Some(Cholesky::analyse(&assembly.K.pattern, None, Precision::Single, 1, MOST_ENTRIES))
    });
    let mut cholesky = analysed.expect("ran at least once").map_err(SimError::from)?;
    let mut found = Ok(());
    let factor = median_time(LONG_ENOUGH, || found = cholesky.factor(&assembly.K));
    assert!(found.is_ok(), "projected stiffness of held tissue is positive definite");
    let mut b: Vec<Vec3> = (0..dofs.n_blocks()).map(|k| Vec3::repeat((k as f64).sin())).collect();
    let rhs = b.clone();
    let solve = median_time(LONG_ENOUGH, || {
        b.copy_from_slice(&rhs);
        cholesky.solve(&mut b);
    });
    let solve_double = median_time(LONG_ENOUGH, || {
        b.copy_from_slice(&rhs);
        cholesky.solve_in_double(&mut b);
    });
    let n_factor = cholesky.factor_len();
    Ok(Parts {
        n_tets: mesh.tets.len(),
        n_dofs: 3 * dofs.n_blocks(),
        forces,
        stiffness,
        analysis,
        factor,
        n_factor,
        solve_double,
        solve,
        bandwidth: bandwidth(4 * n_factor),
    })
}
