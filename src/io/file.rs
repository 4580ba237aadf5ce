//! Plain files and folders.

use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

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

/// Writes a file, replacing an older one: whole or not at all.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), IoError> {
    let Some(name) = path.file_name().filter(|_| !is_special(path)) else {
        return std::fs::write(path, bytes).map_err(IoError::file(path));
    };
    let mut part = name.to_owned();
    part.push(".part");
    let part = path.with_file_name(part);
    let written = std::fs::write(&part, bytes).and_then(|()| std::fs::rename(&part, path));
    written.map_err(|source| {
        // What is half-written would pass for a file.
        let _ = std::fs::remove_file(&part);
        IoError::file(path)(source)
    })
}

/// Whether something other than a file stands there, that a file must not take the place of: a pipe, a link, a device.
fn is_special(path: &Path) -> bool {
    std::fs::symlink_metadata(path).is_ok_and(|m| !m.is_file())
}

/// Makes a folder and those above it, if they are not there.
///
/// # Errors
/// [`IoError::File`].
pub fn create_folder(path: &Path) -> Result<(), IoError> {
    std::fs::create_dir_all(path).map_err(IoError::file(path))
}

/// A file that grows: what was appended is there whatever comes after.
pub struct Growing {
    path: PathBuf,
    file: File,
}

impl Growing {
    /// An empty file, in place of an older one.
    pub fn new(path: &Path) -> Result<Growing, IoError> {
        Ok(Growing { path: path.into(), file: File::create(path).map_err(IoError::file(path))? })
    }

    /// Appends `text`.
    pub fn append(&mut self, text: &str) -> Result<(), IoError> {
        self.file.write_all(text.as_bytes()).map_err(IoError::file(&self.path))
    }
}

/// Removes the files of a folder whose names are like `unwanted`.
pub fn remove_files(folder: &Path, unwanted: impl Fn(&str) -> bool) -> Result<(), IoError> {
    for entry in std::fs::read_dir(folder).map_err(IoError::file(folder))?.flatten() {
        if entry.file_name().to_str().is_some_and(&unwanted) {
            std::fs::remove_file(entry.path()).map_err(IoError::file(&entry.path()))?;
        }
    }
    Ok(())
}
