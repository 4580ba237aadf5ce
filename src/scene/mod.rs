//! The scene: one TOML file that says which effects exist, and what they are.
//!
//! [`SceneFile`] is what the text says, [`build`] what it means. Unknown keys are refused; only what stands in the file
//! exists at run time.
#![forbid(unsafe_code)]
#![allow(non_snake_case)]

mod bones;
mod build;
mod check;
mod file;
mod keys;
mod loads;
mod materials;
mod place;
mod programme;
mod source;
mod springs;

pub use build::build;
pub use file::SceneFile;
pub use keys::{KEYS, Key, Range, key_reference, tables};
pub use programme::{Programme, Setting};
pub use source::{MeshSource, SkinSource};

/// Why a scene was refused; line and column are 1-based.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// The text is no TOML, or a key is unknown, missing or of the wrong type. Says line, column and choices.
    #[error("{0}")]
    Syntax(String),
    /// A value means nothing: out of range, or a name that does not exist.
    #[error("line {line}, column {column}: {message}")]
    Meaning {
        /// Line.
        line: usize,
        /// Column.
        column: usize,
        /// What was wanted, what was found, what the choices are.
        message: String,
    },
    /// The tissue is not held.
    #[error(transparent)]
    Unconstrained(#[from] crate::sim::Unconstrained),
}
