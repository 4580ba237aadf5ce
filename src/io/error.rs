//! Why a file could not be read or written.

use std::path::{Path, PathBuf};

use crate::mesh::MeshError;

/// Why a file was refused. A refused file changed nothing.
#[derive(Debug, thiserror::Error)]
pub enum IoError {
    /// The operating system said no.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file name does not say what the file is.
    #[error("{}: no reader or writer for this kind of file; known are {choices}", path.display())]
    Extension {
        /// The file.
        path: PathBuf,
        /// What is known.
        choices: &'static str,
    },
    /// The content breaks the rules of its format.
    #[error("{}, {place}: found {found}, wanted {wanted}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Line, section or array.
        place: String,
        /// What stands there.
        found: String,
        /// What should.
        wanted: String,
    },
    /// The file ends too early.
    #[error("{}: the file ends early: {place} needs {wanted} bytes, {found} are there; fetch or write the file again", path.display())]
    Truncated {
        /// The file.
        path: PathBuf,
        /// Which part is cut off.
        place: String,
        /// Bytes needed.
        wanted: u64,
        /// Bytes there.
        found: u64,
    },
    /// A sound file of a kind this library does not take.
    #[error("{}: {found}; {advice}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What was found.
        found: String,
        /// What to do about it.
        advice: String,
    },
    /// Not a baked model at all.
    #[error("{}: not a baked model (it starts with {found:02x?}); bake one from a CT with `cutis bake`", path.display())]
    NotBaked {
        /// The file.
        path: PathBuf,
        /// Its first bytes.
        found: Vec<u8>,
    },
    /// A baked model of a later version.
    #[error("{}: baked model of format {found}, this library reads up to {known}; update the library or bake again", path.display())]
    TooNew {
        /// The file.
        path: PathBuf,
        /// Format version found.
        found: u32,
        /// Newest version known.
        known: u32,
    },
    /// The checksum does not fit the content.
    #[error("{}: checksum mismatch: the content was changed or damaged; bake or copy it again", path.display())]
    Corrupt {
        /// The file.
        path: PathBuf,
    },
    /// Not a CT.
    #[error("{}: modality {found}, wanted CT: Hounsfield thresholds mean nothing elsewhere; export the CT series", path.display())]
    Modality {
        /// The file.
        path: PathBuf,
        /// Modality found.
        found: String,
    },
    /// The slices are sheared against their stacking direction.
    #[error("{}: the slices are sheared by {degrees:.2} degrees (gantry tilt); resample to an untilted grid first", path.display())]
    GantryTilt {
        /// The series.
        path: PathBuf,
        /// Angle between the stacking direction and the slice normal.
        degrees: f64,
    },
    /// A series with holes.
    #[error("{}: {missing} slice(s) missing, the first between z = {after_mm:.2} and {before_mm:.2} mm at {spacing_mm:.3} mm spacing; export the whole series", path.display())]
    MissingSlices {
        /// The series.
        path: PathBuf,
        /// How many are missing.
        missing: usize,
        /// Position of the slice before the first hole, mm along the normal.
        after_mm: f64,
        /// Position of the slice after it, mm.
        before_mm: f64,
        /// Usual distance of slices, mm.
        spacing_mm: f64,
    },
    /// Slices at uneven distances.
    #[error("{}: slice distances range from {least_mm:.3} to {most_mm:.3} mm; resample to uniform spacing, or pick one series", path.display())]
    Spacing {
        /// The series.
        path: PathBuf,
        /// Smallest distance, mm.
        least_mm: f64,
        /// Largest distance, mm.
        most_mm: f64,
    },
    /// Several series in one folder.
    #[error("{}: {found} series are mixed here ({list}); put one series in a folder of its own", path.display())]
    MixedSeries {
        /// The folder.
        path: PathBuf,
        /// Number of series.
        found: usize,
        /// Each series and its number of files.
        list: String,
    },
    /// The file is sound but its mesh breaks a rule.
    #[error("{}: {source}", path.display())]
    Mesh {
        /// The file.
        path: PathBuf,
        /// The broken rule.
        source: MeshError,
    },
}

impl IoError {
    pub(crate) fn file(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::File { path, source }
    }

    pub(crate) fn format(path: &Path, place: impl Into<String>, found: impl Into<String>, wanted: &str) -> Self {
        let (place, found) = (place.into(), found.into());
        Self::Format { path: path.to_path_buf(), place, found, wanted: wanted.into() }
    }

    pub(crate) fn unsupported(path: &Path, found: impl Into<String>, advice: impl Into<String>) -> Self {
        Self::Unsupported { path: path.to_path_buf(), found: found.into(), advice: advice.into() }
    }

    pub(crate) fn truncated(path: &Path, place: impl Into<String>, wanted: u64, found: u64) -> Self {
        Self::Truncated { path: path.to_path_buf(), place: place.into(), wanted, found }
    }
}
