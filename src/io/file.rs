//! Plain files and folders.

use std::path::Path;

use super::IoError;

/// The text of a file.
///
/// # Errors
/// As [`read_bytes`], and where it is not UTF-8.
pub fn read_text(path: &Path) -> Result<String, IoError> {
    check_plain(path)?;
    std::fs::read_to_string(path).map_err(IoError::file(path))
}

/// The bytes of a file.
///
/// # Errors
/// [`IoError::File`], also for what is no plain file: a pipe may never answer, a device never end.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, IoError> {
    check_plain(path)?;
    std::fs::read(path).map_err(IoError::file(path))
}

/// A pipe or a device may never end, so nothing is read from one.
fn check_plain(path: &Path) -> Result<(), IoError> {
    let kind = std::fs::metadata(path).map_err(IoError::file(path))?.file_type();
    if kind.is_file() {
        return Ok(());
    }
    let why = match kind.is_dir() {
        true => "this is a folder; wanted a plain file",
        false => "this is a pipe, a socket or a device; wanted a plain file",
    };
    Err(IoError::file(path)(std::io::Error::new(std::io::ErrorKind::InvalidInput, why)))
}

/// Moves a file, replacing an older one.
pub fn rename(from: &Path, to: &Path) -> Result<(), IoError> {
    std::fs::rename(from, to).map_err(IoError::file(to))
}

/// Removes a file.
pub fn remove_file(path: &Path) -> Result<(), IoError> {
    std::fs::remove_file(path).map_err(IoError::file(path))
}

/// Writes a file, replacing an older one.
///
/// # Errors
/// [`IoError::File`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), IoError> {
    std::fs::write(path, bytes).map_err(IoError::file(path))
}

/// Makes a folder and those above it, if they are not there.
///
/// # Errors
/// [`IoError::File`].
pub fn create_folder(path: &Path) -> Result<(), IoError> {
    std::fs::create_dir_all(path).map_err(IoError::file(path))
}
