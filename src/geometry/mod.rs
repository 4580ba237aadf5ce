//! Shapes: CT grids, isosurfaces, distance fields, and the tetrahedra between them.
//!
//! Everything here is a function of its arguments: no files, no clocks, no printing, and the same input gives the
//! same bits. Lengths are metres; only CT samples are Hounsfield units.
#![forbid(unsafe_code)]

mod block;
mod distance;
mod error;
mod field;
mod marching_cubes;
mod nearest;
mod sizing;
mod surface;
mod volume;

pub use block::{Block, Pattern, block};
pub use distance::{Distance, Isosurface, unsigned};
pub use error::MeshingError;
pub use field::{Ball, Cuboid, Field, gradient};
pub use marching_cubes::marching_cubes;
pub use nearest::Nearest;
pub use sizing::{Sizing, Uniform};
pub use surface::{Surface, doubled_area, nearest_on_triangle};
pub use volume::{Grid, Labels, Volume};
