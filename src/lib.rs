//! Soft tissue of the human face: from a head CT to skin that moves.
//!
//! The walk: a *scene* (one TOML file) and a *mesh* become an immutable [`Model`]; a [`Sim`] moves it step by step.
//! The same `Sim` stands behind the C library, the FMI 2.0/3.0 component and the command line.
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
