//! What accuracy costs in time: one scene over a ladder of methods, measured against a converged answer.
//!
//! ```text
//! scene -> plan: variants (law, element, mesh, solver, time, effects) -> measure: motion of the skin, time, memory
//!       -> row: errors against the reference -> front: who is never beaten, and what a budget buys -> page, csv, picture
//! ```
//!
//! All variants are read at the vertices of one skin, that of the finest mesh, which rides on the coarser ones.
#![forbid(unsafe_code)]
#![allow(non_snake_case)]

mod edit;
mod front;
mod measure;
mod page;
mod plan;
mod row;

pub use front::{advice, pareto};
pub use measure::{Answer, Probe, measure};
pub use page::{chart, page};
pub use plan::{Element, Level, Plan, Solver, Variant};
pub use row::{Reading, Row, errors, read_rows, write_rows};
