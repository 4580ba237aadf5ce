//! Shapes: CT grids, isosurfaces, distance fields, and the tetrahedra between them.
//!
//! Everything here is a function of its arguments: no files, no clocks, no printing, and the same input gives the
//! same bits. Lengths are metres; CT samples are Hounsfield units only inside [`volume`](crate::geometry).
#![forbid(unsafe_code)]

mod block;
mod error;

pub use block::{Block, Pattern, block};
pub use error::MeshingError;
