//! The shape without weight that sags into the scanned one.
//!
//! ```text
//! X <- X - (x(X) - X_scan)   until x(X) = X_scan,   x(X): equilibrium of the shape X under the gravity of the scan
//! ```
//!
//! Source: Sellier, "An iterative method for the inverse elasto-static problem", J. Fluids Struct. 27, 2011.

use std::sync::Arc;

use super::SceneError;
use super::build::Builder;
use super::file::SceneFile;
use super::programme::Programme;
use crate::math::Vec3;
use crate::mesh::{MeshError, TetMesh};
use crate::port::Slot;
use crate::sim::{Model, Sim, SimError};

/// Iterations; each gains about a digit where the tissue is stiff enough to be scanned at all.
const MOST: usize = 40;
/// Largest distance to the scan, m, at which the shape is accepted.
const CLOSE: f64 = 1e-6;

/// Why no shape without weight was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RestShapeError {
    /// It came no nearer.
    #[error(
        "no shape without weight sags into the scan: after {iterations} tries the nearest is {distance:.1e} m away \
         (wanted {CLOSE:.0e} m); the tissue may be too soft for its weight: make it stiffer, or use rest = \"differential\""
    )]
    NotFound {
        /// Equilibria sought.
        iterations: usize,
        /// Largest distance of a node to its place in the scan, m.
        distance: f64,
    },
    /// A shape on the way turned inside out.
    #[error("the shape without weight turns inside out on the way: {0}; use rest = \"differential\"")]
    Mesh(#[from] MeshError),
    /// An equilibrium on the way was not found.
    #[error("the sag of the shape without weight was not found: {0}")]
    Sag(#[from] SimError),
}

impl Builder<'_> {
    /// The model whose equilibrium under the gravity `scan` is the shape of `mesh`.
    pub(super) fn unweighted(
        &self,
        file: &SceneFile,
        mesh: TetMesh,
        scan: [f64; 3],
    ) -> Result<(Model, Programme), SceneError> {
        let target = mesh.nodes.clone();
        let mut shape = mesh;
        let mut distance = f64::INFINITY;
        for _ in 0..MOST {
            let (model, programme) = self.forward(file, shape.clone())?;
            let model = Arc::new(model);
            let mut sim = Sim::new(model.clone()).map_err(RestShapeError::from)?;
            sim.start_under(Slot::Gravity, &scan).map_err(RestShapeError::from)?;
            let sag: Vec<Vec3> = target.iter().zip(sim.positions()).map(|(X, x)| x - X).collect();
            drop(sim);
            distance = sag.iter().map(|d| d.norm()).fold(0.0, f64::max);
            if distance <= CLOSE {
                let model = Arc::into_inner(model).expect("its simulation is gone");
                return Ok((model, programme));
            }
            shape.nodes.iter_mut().zip(&sag).for_each(|(X, d)| *X -= d);
            shape = shape.checked().map_err(RestShapeError::from)?;
        }
        Err(RestShapeError::NotFound { iterations: MOST, distance }.into())
    }
}
