//! `bake.toml`: what is known of a scan, kept beside it. Places are millimetres, LPS.
//!
//! ```toml
//! bone = 300                                          # HU
//! region = [[-60, -110, -130], [60, 20, 40]]
//! hinge = [[-76, -16, -14], [29, -11, -8]]            # right and left condyle
//! occlusal = { point = [-22, -95, -44], normal = [0, 0.1, 1] }
//! [seeds]
//! mandible = [[-22, -82, -80]]
//! ```

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use cutis::geometry::BONES;
use cutis::io;
use cutis::math::Vec3;

/// Its name beside a scan.
pub const NAME: &str = "bake.toml";
const MILLI: f64 = 1e-3;

type Place = [f64; 3];

/// The content of the file.
#[derive(Debug, Default, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BakeFile {
    /// Thresholds, HU.
    pub skin: Option<f64>,
    pub bone: Option<f64>,
    /// Lattice edge, mm.
    pub edge: Option<f64>,
    /// Labels, relative to the file.
    pub labels: Option<PathBuf>,
    pub region: Option<[Place; 2]>,
    pub mouth: Option<[Place; 2]>,
    pub hinge: Option<[Place; 2]>,
    pub commissures: Option<[Place; 2]>,
    pub occlusal: Option<Occlusal>,
    #[serde(default)]
    pub seeds: BTreeMap<String, Vec<Place>>,
}

/// The plane where the teeth meet.
#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Occlusal {
    pub point: Place,
    pub normal: Place,
}

impl BakeFile {
    /// The file that was named, else the one beside the scan, else nothing. Says what was read.
    pub fn of(scan: &Path, named: Option<&Path>) -> Result<Self, Box<dyn std::error::Error>> {
        let beside = scan.parent().unwrap_or(Path::new("")).join(NAME);
        let path = match named {
            Some(path) => path,
            None if beside.is_file() => &beside,
            None => return Ok(Self::default()),
        };
        let mut file: Self = toml::from_str(&io::read_text(path)?).map_err(|e| format!("{}: {e}", path.display()))?;
        if let Some(bone) = file.seeds.keys().find(|bone| !BONES.contains(&bone.as_str())) {
            return Err(format!("{}, seeds: {}", path.display(), unknown(bone)).into());
        }
        file.labels = file.labels.map(|labels| path.parent().unwrap_or(Path::new("")).join(labels));
        eprintln!("note: settings from {}; what the command line says counts more", path.display());
        Ok(file)
    }
}

fn unknown(bone: &str) -> String {
    format!("unknown bone `{bone}`, expected {}", BONES.map(|b| format!("`{b}`")).join(", "))
}

/// A place that belongs to a bone: `mandible=-22,-82,-80`, mm.
#[derive(Debug, Clone)]
pub struct Seed(pub String, pub Place);

impl FromStr for Seed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wanted =
            || format!("found `{text}`, wanted a bone and a place in mm (LPS), such as `mandible=-22,-82,-80`");
        let (bone, place) = text.split_once('=').ok_or_else(wanted)?;
        if !BONES.contains(&bone.trim()) {
            return Err(unknown(bone.trim()));
        }
        let numbers: Vec<f64> = place.split(',').map_while(|c| c.trim().parse().ok()).collect();
        let place: Place = numbers.try_into().map_err(|_| wanted())?;
        Ok(Self(bone.trim().into(), place))
    }
}

/// A place in metres.
pub fn metres(place: Place) -> Vec3 {
    Vec3::from(place) * MILLI
}

/// Two places as the command line has them.
pub fn pair(numbers: &[f64]) -> Option<[Place; 2]> {
    match *numbers {
        [a, b, c, d, e, f] => Some([[a, b, c], [d, e, f]]),
        _ => None,
    }
}
