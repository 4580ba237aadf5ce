//! `cutis fmu`: archives for co-simulation tools.

use std::path::{Path, PathBuf};

use cutis::ffi::host;
use cutis::fmu::{Binary, FmiVersion, Platform, package};
use cutis::{io, load};

#[derive(clap::Args)]
pub struct Fmu {
    /// Scene file (TOML); the default scene if left out
    scene: Option<PathBuf>,
    /// Also write cutis_fmi2_full.fmu, with a scalar for every coordinate of the skin
    #[arg(long)]
    full: bool,
    /// Folder for cutis.fmu and cutis_fmi2.fmu
    #[arg(short, long, default_value = "out")]
    out: PathBuf,
    /// Shared library to pack; found beside this program if left out
    #[arg(long, conflicts_with = "binary")]
    library: Option<PathBuf>,
    /// Shared library of a platform to pack, for example x86_64-windows=cutis.dll; once for each, instead of --library
    #[arg(long, value_name = "PLATFORM=PATH", value_parser = platform_and_path)]
    binary: Vec<(Platform, PathBuf)>,
}

fn platform_and_path(text: &str) -> Result<(Platform, PathBuf), String> {
    let (platform, path) = text.split_once('=').ok_or("wanted PLATFORM=PATH, for example x86_64-windows=cutis.dll")?;
    Ok((platform.parse().map_err(|why: cutis::fmu::UnknownPlatform| why.to_string())?, path.into()))
}

impl Fmu {
    pub fn run(self) -> super::Done {
        for (path, bytes) in write(self.scene.as_deref(), self.binaries()?, &self.out, self.full)? {
            say!("wrote {} ({:.2} MB)", path.display(), bytes as f64 / 1e6);
        }
        Ok(())
    }

    fn binaries(&self) -> Result<Vec<Binary>, Box<dyn std::error::Error>> {
        if self.binary.is_empty() {
            return own_binary(self.library.as_deref());
        }
        let read =
            |(platform, path): &(Platform, PathBuf)| Ok(Binary { platform: *platform, bytes: io::read_bytes(path)? });
        self.binary.iter().map(read).collect()
    }
}

/// The library for this machine: `library`, or the one beside this program.
pub fn own_binary(library: Option<&Path>) -> Result<Vec<Binary>, Box<dyn std::error::Error>> {
    let path = library.map_or_else(find_library, |l| Ok(l.to_path_buf()))?;
    Ok(vec![Binary { platform: Platform::here()?, bytes: io::read_bytes(&path)? }])
}

/// Writes both archives, or all three, into `out`, once each was instantiated as a host does it; returns their paths and sizes.
/// What cannot be instantiated leaves an older archive as it was. A library of another machine is not tried.
pub fn write(
    scene: Option<&Path>,
    binaries: Vec<Binary>,
    out: &Path,
    full: bool,
) -> Result<Vec<(PathBuf, usize)>, Box<dyn std::error::Error>> {
    let baked = match scene {
        Some(scene) => load::baked(scene)?,
        None => load::baked_default()?,
    };
    let loaded = baked.load()?;
    io::create_folder(out)?;
    let mut written = Vec::new();
    for version in [FmiVersion::V3, FmiVersion::V2, FmiVersion::V2Full].into_iter().take(if full { 3 } else { 2 }) {
        let archive = package(&loaded, &baked, &binaries, version)?;
        let path = out.join(version.archive_name());
        let tried = out.join(format!("{}.part", version.archive_name()));
        io::write_bytes(&tried, &archive)?;
        let here = Platform::here().is_ok_and(|here| binaries.iter().any(|b| b.platform == here));
        let answer = if here { host::instantiate(&tried, version) } else { Ok(()) };
        if let Err(why) = answer {
            io::remove_file(&tried)?;
            return Err(format!("{} was not written, for no host could open it: {why}", path.display()).into());
        }
        io::rename(&tried, &path)?;
        written.push((path, archive.len()));
    }
    Ok(written)
}

/// The shared library that was built together with this program.
fn find_library() -> Result<PathBuf, Box<dyn std::error::Error>> {
    let name = format!("{}cutis{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let here = std::env::current_exe()?;
    let folder = here.parent().unwrap_or(Path::new("."));
    // `cargo run` and `cargo test` leave a library that is only a dependency in deps.
    let places = [folder.join(&name), folder.join("deps").join(&name)];
    let newest = places.iter().filter(|p| p.is_file()).max_by_key(|p| p.metadata().and_then(|m| m.modified()).ok());
    newest.cloned().ok_or_else(|| {
        format!(
            "no {name} in {} or its deps folder: build it with `cargo build --release`, or name it with --library",
            folder.display()
        )
        .into()
    })
}
