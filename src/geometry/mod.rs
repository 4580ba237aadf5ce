//! Shapes: CT grids, isosurfaces, distance fields, and the tetrahedra between them.
//!
//! Everything here is a function of its arguments: no files, no clocks, no printing, and the same input gives the
//! same bits. Lengths are metres; only CT samples are Hounsfield units.
#![forbid(unsafe_code)]

pub mod anatomy;
mod assemble;
mod bake;
mod block;
mod bones;
mod clean;
mod distance;
mod domain;
mod error;
mod face;
mod field;
mod found;
pub mod head;
mod label;
mod labels;
mod lattice;
mod marching_cubes;
mod mesher;
mod nearest;
mod quality;
mod repair;
mod resolution;
mod sampled;
mod shapes;
mod sizing;
mod slit;
mod stencils;
mod stuffing;
mod surface;
mod tetrahedralise;
mod topology;
mod volume;
mod warning;

pub use assemble::{CUT, FREE};
pub use bake::{BakeOptions, Baked, Level, bake};
pub use block::{Block, Pattern, block};
pub use bones::BONES;
pub use distance::{Distance, Isosurface, unsigned};
pub use error::MeshingError;
pub use field::{Ball, Cuboid, Field, gradient};
pub use head::Head;
pub use label::{LAYERS, LayerShare, Layers};
pub use lattice::{Lattice, LatticePlane};
pub use marching_cubes::marching_cubes;
pub use nearest::Nearest;
pub use quality::{MeshReport, SurfaceFigures, dihedrals, radius_ratio};
pub use repair::Repair;
pub use resolution::Resolution;
pub use sizing::{Sizing, Uniform};
pub use stencils::Stuffed;
pub use stuffing::{NO_WALL, Side, Wall};
pub use surface::{Surface, doubled_area, nearest_on_triangle};
pub use tetrahedralise::{Stuffing, stuff, tetrahedralise};
pub(crate) use volume::rounded;
pub use volume::{Grid, Labels, Volume};
pub use warning::Warning;
