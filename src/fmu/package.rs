//! Description, library and scene -> one archive, byte for byte the same each time.

use std::io::{Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::{FmiVersion, MODEL_IDENTIFIER, description, documentation, terminals};
use crate::load::{Baked, Loaded};

/// Why an archive was not written.
#[derive(Debug, thiserror::Error)]
pub enum PackageError {
    /// There is nothing an importer could load.
    #[error("the library for binaries/{folder} is empty")]
    NoLibrary {
        /// Platform folder.
        folder: String,
    },
    /// The archive could not be put together.
    #[error("the archive could not be written")]
    Zip(#[from] zip::result::ZipError),
    /// The archive could not be put together.
    #[error("the archive could not be written")]
    Io(#[from] std::io::Error),
}

/// Folder of this platform's library inside an archive, for example `x86_64-linux` or, in FMI 2.0, `linux64`.
pub fn platform(version: FmiVersion) -> String {
    let os = if std::env::consts::OS == "macos" { "darwin" } else { std::env::consts::OS };
    match (version, std::env::consts::ARCH, os) {
        (FmiVersion::V2, "x86_64", "linux") => "linux64".to_owned(),
        (FmiVersion::V2, "x86_64", "windows") => "win64".to_owned(),
        (FmiVersion::V2, "x86_64", "darwin") => "darwin64".to_owned(),
        (_, arch, os) => format!("{arch}-{os}"),
    }
}

/// The archive of `scene`: `baked` goes into resources, `binary` is this platform's shared library.
///
/// # Errors
/// [`PackageError::NoLibrary`] without a library; others only where memory ends.
pub fn package(scene: &Loaded, baked: &Baked, binary: &[u8], version: FmiVersion) -> Result<Vec<u8>, PackageError> {
    let folder = platform(version);
    if binary.is_empty() {
        return Err(PackageError::NoLibrary { folder });
    }
    let library = format!("binaries/{folder}/{MODEL_IDENTIFIER}{}", std::env::consts::DLL_SUFFIX);
    let mut archive = Archive(ZipWriter::new(Cursor::new(Vec::new())));
    archive.add("modelDescription.xml", 0o644, description(scene, version).as_bytes())?;
    archive.add(&library, 0o755, binary)?;
    archive.add("documentation/index.html", 0o644, documentation(&scene.model, version).as_bytes())?;
    archive.add("documentation/licenses/license.txt", 0o644, LICENSE.as_bytes())?;
    archive.add("documentation/licenses/LICENSE-APACHE", 0o644, include_bytes!("../../LICENSE-APACHE"))?;
    archive.add("documentation/licenses/LICENSE-MIT", 0o644, include_bytes!("../../LICENSE-MIT"))?;
    archive.add("documentation/licenses/third-party.txt", 0o644, include_bytes!("../../fmu/third-party.txt"))?;
    archive.add("resources/model.cutis", 0o644, &baked.mesh)?;
    archive.add("resources/scene.toml", 0o644, baked.scene.as_bytes())?;
    if version == FmiVersion::V3 {
        archive.add("terminalsAndIcons/terminalsAndIcons.xml", 0o644, terminals(&scene.model).as_bytes())?;
    }
    Ok(archive.0.finish()?.into_inner())
}

const LICENSE: &str = "This component is licensed under either of the MIT license (LICENSE-MIT) or the Apache license 2.0 (LICENSE-APACHE),
at your option. SPDX: MIT OR Apache-2.0

The libraries inside it and their licenses are listed in third-party.txt.
";

struct Archive(ZipWriter<Cursor<Vec<u8>>>);

impl Archive {
    /// FMI allows deflate only; the date is the oldest a zip can tell.
    fn add(&mut self, path: &str, mode: u32, bytes: &[u8]) -> Result<(), PackageError> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .last_modified_time(DateTime::default())
            .unix_permissions(mode);
        self.0.start_file(path, options)?;
        self.0.write_all(bytes)?;
        Ok(())
    }
}
