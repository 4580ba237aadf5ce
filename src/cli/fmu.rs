//! `cutis fmu`: a scene as FMI 3.0 and FMI 2.0 archives.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};

use cutis::fmu::{FmiVersion, package};
use cutis::load;

#[derive(clap::Args)]
pub struct Fmu {
    /// Scene file (TOML); the default scene without
    scene: Option<PathBuf>,
    /// Folder for cutis.fmu and cutis_fmi2.fmu
    #[arg(short, long, default_value = "out")]
    out: PathBuf,
    /// Shared library to pack; the one built beside this program without
    #[arg(long)]
    library: Option<PathBuf>,
}

impl Fmu {
    pub fn run(self) -> super::Done {
        let (loaded, baked) = match &self.scene {
            Some(scene) => (load::from_file(scene)?, load::baked(scene)?),
            None => (load::embedded()?, load::baked_default()?),
        };
        let library = self.library.map_or_else(beside_this_program, Ok)?;
        let binary = std::fs::read(&library).map_err(|why| format!("{}: {why}", library.display()))?;
        cutis::io::create_folder(&self.out)?;
        for version in [FmiVersion::V3, FmiVersion::V2] {
            let bytes = package(&loaded, &baked, &binary, version)?;
            let path = self.out.join(version.archive_name());
            cutis::io::write_bytes(&path, &bytes)?;
            println!("wrote {} ({:.1} MB)", path.display(), bytes.len() as f64 / 1e6);
        }
        Ok(())
    }
}

/// Cargo leaves the library beside the program or in `deps`; the newer one counts.
fn beside_this_program() -> Result<PathBuf, Box<dyn std::error::Error>> {
    let program = std::env::current_exe()?;
    let folder = program.parent().unwrap_or(Path::new("."));
    let name = format!("{DLL_PREFIX}cutis{DLL_SUFFIX}");
    let places = [folder.join(&name), folder.join("deps").join(&name), folder.join("../lib").join(&name)];
    let built = |path: &PathBuf| path.metadata().and_then(|m| m.modified()).ok();
    let newest = places.iter().filter_map(|path| Some((built(path)?, path))).max();
    newest.map(|(_, path)| path.clone()).ok_or_else(|| {
        format!("no {name} near {}: `cargo build --release` makes one, or name it with --library", program.display())
            .into()
    })
}
