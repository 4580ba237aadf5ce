//! Plain files and folders.

use std::path::Path;

use super::IoError;

/// The text of a file.
///
/// # Errors
/// [`IoError::File`], as for every function here.
pub fn read_text(path: &Path) -> Result<String, IoError> {
    std::fs::read_to_string(path).map_err(IoError::file(path))
}

/// The bytes of a file.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, IoError> {
    std::fs::read(path).map_err(IoError::file(path))
}

/// Writes a file, replacing an older one.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), IoError> {
    std::fs::write(path, bytes).map_err(IoError::file(path))
}

/// Makes a folder and those above it, if they are not there.
pub fn create_folder(path: &Path) -> Result<(), IoError> {
    std::fs::create_dir_all(path).map_err(IoError::file(path))
}
