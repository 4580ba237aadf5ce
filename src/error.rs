//! The one error of the crate's upper rooms: one variant a room, the source kept.
#![forbid(unsafe_code)]

use std::path::PathBuf;

/// Why something at the level of files and scenes failed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A scene was refused.
    #[error("{path}: {source}", path = path.display())]
    Scene {
        /// Which file; `<text>` for a scene that is none.
        path: PathBuf,
        /// What was wrong with it.
        source: Box<crate::scene::SceneError>,
    },
    /// A mesh or volume file was refused.
    #[error(transparent)]
    Io(#[from] crate::io::IoError),
    /// The tissue could not be meshed.
    #[error(transparent)]
    Meshing(#[from] crate::geometry::MeshingError),
    /// A simulation refused a call.
    #[error(transparent)]
    Sim(#[from] crate::sim::SimError),
}
