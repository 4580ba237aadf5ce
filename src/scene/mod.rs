//! The scene: one TOML file that says which effects exist, and what they are.
//!
//! [`SceneFile`] is what the text says, [`build`] what it means. Unknown keys are refused; only what stands in the file
//! exists at run time.
#![forbid(unsafe_code)]
#![allow(non_snake_case)]

mod bones;
mod build;
mod check;
mod contacts;
mod depth;
mod file;
mod keys;
mod loads;
mod materials;
mod place;
mod plausible;
mod presets;
mod programme;
mod reduction;
mod rest_shape;
mod source;
mod springs;
mod tables;
mod tissue;

pub use build::build;
pub use file::SceneFile;
pub use keys::{KEYS, Key, Range, key_reference, tables};
pub use materials::{SmallStrain, small_strain};
pub use presets::{Preset, preset_reference, presets};
pub use programme::{Programme, Setting};
pub use rest_shape::RestShapeError;
pub use source::{MeshSource, SkinSource};
pub use tables::packed;

/// Why a scene was refused; line and column are 1-based.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// The text is no TOML, a key is unknown, missing or of the wrong type, or a value means nothing: out of range, or a name that
    /// does not exist.
    #[error("line {line}, column {column}: {message}")]
    Meaning {
        /// Line.
        line: usize,
        /// Column.
        column: usize,
        /// What was wanted, what was found, what the choices are.
        message: String,
    },
    /// The shape without weight was not found.
    #[error(transparent)]
    RestShape(#[from] RestShapeError),
    /// The tissue is not held.
    #[error(transparent)]
    Unconstrained(#[from] crate::sim::Unconstrained),
}
