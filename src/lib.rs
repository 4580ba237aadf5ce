//! Soft tissue of the human face: from a head CT to skin that moves.
//!
//! The walk: a *scene* (one TOML file) and a *mesh* become an immutable [`Model`]; a [`Sim`] moves it step by step.
//! The same `Sim` stands behind the C library, the FMI 2.0/3.0 component and the command line.
//!
//! ```
//! use std::sync::Arc;
//!
//! use cutis::{Error, Scene, Sim};
//!
//! # fn main() -> Result<(), Error> {
//! let scene = Scene::parse(
//!     r#"
//!     [mesh.block]
//!     size = [0.06, 0.04, 0.02]
//!     cells = [6, 4, 2]
//!     [[tissue]]
//!     E = 15e3
//!     nu = 0.45
//!     [[bone]]
//!     name = "skull"
//!     nodes = "x_min"
//!     drive = "held"
//!     [[bone]]
//!     name = "mandible"
//!     nodes = "x_max"
//!     "#,
//! )?;
//! let mut sim = Sim::new(Arc::new(scene.model))?;
//! sim.initialise()?;
//! let rotation = sim.model().port("bone.rotation").expect("the scene has bones");
//! sim.set_f64(rotation, 3, &[0.1, 0.0, 0.0])?; // rad, of the second bone
//! sim.step(0.1)?;
//! let skin = sim.model().port("skin.position").expect("blocks have a skin");
//! let mut x = vec![0.0; sim.model().ports()[skin].len()];
//! sim.get_f64(skin, 0, &mut x)?; // m, three for each vertex
//! # Ok(())
//! # }
//! ```
#![deny(unsafe_code)]
#![warn(missing_docs)]
#![warn(
    clippy::print_stdout,
    clippy::print_stderr,
    clippy::exit,
    clippy::dbg_macro,
    clippy::todo,
    clippy::unimplemented
)]

pub mod bench;
pub mod bytes;
pub mod compare;
pub mod effect;
pub mod energy;
pub mod error;
pub mod fem;
pub mod ffi;
pub mod fmu;
pub mod geometry;
pub mod io;
pub mod load;
pub mod math;
pub mod mesh;
pub mod port;
pub mod scene;
pub mod sim;
pub mod solve;
pub mod study;
pub mod torture;
pub mod view;

pub use error::Error;
pub use load::Loaded as Scene;
pub use sim::{Model, Sim};
