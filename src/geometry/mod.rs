//! Shapes: CT grids, isosurfaces, distance fields, and the tetrahedra between them.
//!
//! Everything here is a function of its arguments: no files, no clocks, no printing, and the same input gives the
//! same bits. Lengths are metres; only CT samples are Hounsfield units.
#![forbid(unsafe_code)]

mod block;
mod error;
mod volume;

pub use block::{Block, Pattern, block};
pub use error::MeshingError;
pub use volume::{Grid, Labels, Volume};
