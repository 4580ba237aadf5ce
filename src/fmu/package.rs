//! Description, library and scene -> one archive, byte for byte the same each time.

use std::io::{Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use std::sync::Arc;

use super::picture::picture;
use super::reference::{self, FOLDER};
use super::{FmiVersion, Platform, description, documentation, licenses, terminals, token};
use crate::load::{Baked, Loaded};

/// Why an archive was not written.
#[derive(Debug, thiserror::Error)]
pub enum PackageError {
    /// There is nothing an importer could load.
    #[error("there is no library to pack")]
    NoLibrary,
    /// Two libraries would have one place.
    #[error("there are two libraries for {0}")]
    Twice(Platform),
    /// An importer there could not load it.
    #[error("the library for {wanted} {}", found.map_or("is no shared library".to_owned(), |p| format!("is one for {p}")))]
    Foreign {
        /// What it was given for.
        wanted: Platform,
        /// What it is, as far as that can be told.
        found: Option<Platform>,
    },
    /// The archive could not be put together.
    #[error("the archive could not be written")]
    Zip(#[from] zip::result::ZipError),
    /// The archive could not be put together.
    #[error("the archive could not be written")]
    Io(#[from] std::io::Error),
    /// What goes into the archive cannot be loaded again.
    #[error(transparent)]
    Scene(#[from] crate::error::Error),
    /// The packed scene is another one than the described, so no host could instantiate it.
    #[error("what was packed has the token {found}, but its description {described}: no host could instantiate it")]
    Other {
        /// Token of the description.
        described: String,
        /// Token of what was packed.
        found: String,
    },
    /// The scene's own programme fails in its first steps.
    #[error("the reference run of the component fails, so it would be of no use to a host: {0}")]
    Reference(#[from] crate::sim::SimError),
}

/// A shared library and the machines it runs on.
pub struct Binary {
    /// Where it runs.
    pub platform: Platform,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

/// The archive of `scene`: `baked` goes into resources, `binaries` are the shared library for one or more platforms.
///
/// # Errors
/// [`PackageError::NoLibrary`], [`PackageError::Twice`], [`PackageError::Foreign`] by what is wrong with the libraries,
/// [`PackageError::Reference`] for a scene that cannot be run (FMI 3.0); others only where memory ends.
pub fn package(
    scene: &Loaded,
    baked: &Baked,
    binaries: &[Binary],
    version: FmiVersion,
) -> Result<Vec<u8>, PackageError> {
    check(binaries)?;
    let packed = baked.load()?;
    let (described, found) = (token(&scene.model, version), token(&packed.model, version));
    if described != found {
        return Err(PackageError::Other { described, found });
    }
    let mut archive = Archive(ZipWriter::new(Cursor::new(Vec::new())));
    archive.add("modelDescription.xml", 0o644, description(scene, version).as_bytes())?;
    for binary in binaries {
        archive.add(&binary.platform.library(version), 0o755, &binary.bytes)?;
    }
    let picture = picture(&scene.model);
    let page = documentation(&scene.model, version, picture.is_some());
    archive.add("documentation/index.html", 0o644, page.as_bytes())?;
    if let Some(picture) = &picture {
        archive.add("documentation/picture.png", 0o644, picture)?;
        let icon = if version.is_3() { "terminalsAndIcons/icon.png" } else { "model.png" };
        archive.add(icon, 0o644, picture)?;
    }
    archive.add("documentation/licenses/license.txt", 0o644, LICENSE.as_bytes())?;
    archive.add("documentation/licenses/LICENSE-APACHE", 0o644, include_bytes!("../../LICENSE-APACHE"))?;
    archive.add("documentation/licenses/LICENSE-MIT", 0o644, include_bytes!("../../LICENSE-MIT"))?;
    archive.add("documentation/licenses/third-party.txt", 0o644, licenses::LIST.as_bytes())?;
    archive.add("documentation/licenses/third-party-notices.txt", 0o644, licenses::NOTICES.as_bytes())?;
    archive.add("documentation/licenses/license.spdx", 0o644, licenses::spdx(scene.model.token()).as_bytes())?;
    archive.add("resources/model.cutis", 0o644, &baked.mesh)?;
    archive.add("resources/scene.toml", 0o644, baked.scene.as_bytes())?;
    let terminals = terminals(&scene.model, version, picture.is_some() && version.is_3());
    archive.add("terminalsAndIcons/terminalsAndIcons.xml", 0o644, terminals.as_bytes())?;
    if version.is_3() {
        let run = reference::run(Arc::new(packed.model), &scene.programme)?;
        archive.add(&format!("{FOLDER}/fmi-ls-manifest.xml"), 0o644, reference::manifest().as_bytes())?;
        archive.add(&format!("{FOLDER}/cutis_in.csv"), 0o644, run.inputs.as_bytes())?;
        archive.add(&format!("{FOLDER}/cutis_out.csv"), 0o644, run.outputs.as_bytes())?;
    }
    Ok(archive.0.finish()?.into_inner())
}

fn check(binaries: &[Binary]) -> Result<(), PackageError> {
    if binaries.is_empty() {
        return Err(PackageError::NoLibrary);
    }
    for (k, Binary { platform, bytes }) in binaries.iter().enumerate() {
        if binaries[..k].iter().any(|b| b.platform == *platform) {
            return Err(PackageError::Twice(*platform));
        }
        let found = Platform::of_library(bytes);
        if found != Some(*platform) {
            return Err(PackageError::Foreign { wanted: *platform, found });
        }
    }
    Ok(())
}

const LICENSE: &str = "This component is licensed under either of the MIT license (LICENSE-MIT) or the Apache license 2.0 (LICENSE-APACHE),
at your option. SPDX: MIT OR Apache-2.0

The libraries inside it and their licenses are listed in third-party.txt, and as SPDX in license.spdx; their texts stand
in third-party-notices.txt.
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
