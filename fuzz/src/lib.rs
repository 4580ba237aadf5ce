//! What the fuzzers do with their bytes. `fuzz/run` drives it with coverage and AddressSanitizer; `tests/fuzz.rs` replays
//! seeds and old findings through the same functions with the everyday toolchain.
//!
//! Each target has `once(data)`, which panics on a finding, and `seeds()`, which are valid inputs to start from.

pub mod baked;
pub mod capi;
pub mod fmi;
pub mod mesh;
pub mod scene;
pub mod scenes;
pub mod state;
pub mod taste;
pub mod volume;

/// A target: name, what it does with bytes, what it starts from.
pub type Target = (&'static str, fn(&[u8]), fn() -> Vec<Vec<u8>>);

/// All of them.
pub const TARGETS: [Target; 7] = [
    ("scene", scene::once, scene::seeds),
    ("baked", baked::once, baked::seeds),
    ("state", state::once, state::seeds),
    ("mesh", mesh::once, mesh::seeds),
    ("volume", volume::once, volume::seeds),
    ("capi", capi::once, capi::seeds),
    ("fmi", fmi::once, fmi::seeds),
];
