//! The boundary: the C library (`capi`) and the FMI 2.0 / 3.0 components (`fmi2`, `fmi3`), two dialects of one port table.
//!
//! This is the only room with `unsafe` in it. What it does is always the same and always small: a pointer becomes a
//! reference or a slice, a safe function runs inside `guard`, its answer becomes a status.
//!
//! ```text
//!   C host ---- capi ----+
//!   FMI 3.0 --- fmi3 --+ |
//!   FMI 2.0 --- fmi2 --+-+--> instance / Sim --> port table
//!   host: an importer of our own, to knock on the door from outside
//! ```
#![allow(unsafe_code)]
#![deny(unsafe_op_in_unsafe_fn)]

pub mod capi;
pub mod fmi2;
pub mod fmi3;
#[cfg(unix)]
pub mod host;

mod floats;
mod guard;
mod instance;
mod logger;
mod modes;
mod pointer;
mod resources;
mod snapshot;
#[cfg(target_os = "linux")]
mod unload;
