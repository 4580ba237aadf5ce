//! Finite elements: what a term of the energy is, how elements are gathered and scattered, which nodes are unknown.
#![forbid(unsafe_code)]
#![allow(non_snake_case)]

mod assemble;
mod batch;
mod curved;
mod difference;
mod dofs;
mod embedding;
mod locate;
mod matrix;
mod quadratic;
mod solid;
mod term;
mod tet10;
mod tet4;

pub use crate::mesh::Elimination;
pub use assemble::Assembly;
pub use curved::{Curving, curve_midsides};
pub use difference::Difference;
pub use dofs::{Configuration, Dofs, RigidBody, Role};
pub use embedding::{Detached, Embedding};
pub use locate::{Found, Locator};
pub use matrix::{BlockMatrix, CouplingMatrix, Pattern};
pub use quadratic::{EDGES, add_midsides};
pub use solid::{Elastic, Material, Point, Solid};
pub use term::{At, Curvature, HessianSink, Kernel, OnElements, Strain, Term, Touch};
pub use tet4::{TET4_PLACES, tet4_points};
pub use tet10::{TET10_PLACES, tet10_points};
