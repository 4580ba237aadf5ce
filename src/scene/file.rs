//! What the TOML says. Nothing is computed here; `keys` documents every key, `build` gives it meaning.
#![allow(missing_docs)] // each field is documented in `keys::KEYS`, which docs/scene.md prints

use serde::Deserialize;
use toml::Spanned;

use super::SceneError;
use super::check::Text;

/// A vector with the place where it stands in the text.
pub type Triple = Spanned<[f64; 3]>;

/// A scene as written.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    pub name: Option<String>,
    pub mesh: Spanned<MeshSpec>,
    pub skin: Option<Spanned<SkinSpec>>,
    pub tissue: Vec<TissueSpec>,
    #[serde(default)]
    pub bone: Vec<BoneSpec>,
    #[serde(default)]
    pub muscle: Vec<MuscleSpec>,
    #[serde(default)]
    pub load: Vec<LoadSpec>,
    #[serde(default)]
    pub pressure: Vec<PressureSpec>,
    #[serde(default)]
    pub contact: Vec<ContactSpec>,
    #[serde(default)]
    pub marker: Vec<MarkerSpec>,
    pub gravity: Option<GravitySpec>,
    pub inertia: Option<InertiaSpec>,
    pub attachment: Option<AttachmentSpec>,
    pub solver: Option<SolverSpec>,
    pub run: Option<RunSpec>,
    #[serde(default)]
    pub keyframe: Vec<KeyframeSpec>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshSpec {
    pub file: Option<String>,
    pub head: Option<HeadSpec>,
    pub block: Option<BlockSpec>,
    pub order: Option<Spanned<u32>>,
    pub curved: Option<Spanned<bool>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeadSpec {
    pub edge: Option<Spanned<f64>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BlockSpec {
    pub origin: Option<Triple>,
    pub size: Triple,
    pub cells: Spanned<[usize; 3]>,
    pub pattern: Option<Spanned<String>>,
    #[serde(default)]
    pub layers: Vec<(String, f64)>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SkinSpec {
    pub file: Option<String>,
    pub edge: Option<Spanned<f64>>,
    pub subdivisions: Option<Spanned<u32>>,
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TissueSpec {
    pub regions: Option<Vec<Spanned<String>>>,
    pub preset: Option<Spanned<String>>,
    pub level: Option<Spanned<String>>,
    pub energy: Option<Spanned<String>>,
    #[serde(rename = "E")]
    pub E: Option<Spanned<Constant>>,
    pub nu: Option<Spanned<Constant>>,
    pub mu: Option<Spanned<Constant>>,
    pub alpha: Option<Spanned<Constant>>,
    pub b: Option<Spanned<Constant>>,
    pub c1: Option<Spanned<Constant>>,
    pub c2: Option<Spanned<Constant>>,
    pub c10: Option<Spanned<Constant>>,
    pub c01: Option<Spanned<Constant>>,
    pub c20: Option<Spanned<Constant>>,
    pub c30: Option<Spanned<Constant>>,
    pub kappa: Option<Spanned<Constant>>,
    pub density: Option<Spanned<f64>>,
    pub pressure: Option<Spanned<String>>,
    pub viscous: Option<ViscousSpec>,
    pub fibre: Option<FibreSpec>,
    pub damage: Option<DamageSpec>,
    pub grade: Option<GradeSpec>,
    pub limit: Option<LimitSpec>,
    pub tension: Option<TensionSpec>,
    pub tunable: Option<Spanned<String>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FibreSpec {
    pub direction: Option<Triple>,
    pub path: Option<Spanned<Vec<[f64; 3]>>>,
    pub in_skin: Option<bool>,
    pub k1: Spanned<f64>,
    pub k2: Spanned<f64>,
    pub dispersion: Option<Spanned<f64>>,
    pub slack: Option<Spanned<f64>>,
    pub damage: Option<DamageSpec>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DamageSpec {
    pub onset: Spanned<f64>,
    pub scale: Spanned<f64>,
    pub most: Option<Spanned<f64>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GradeSpec {
    pub depth: Spanned<Vec<f64>>,
    pub factor: Spanned<Vec<f64>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimitSpec {
    pub longest: Option<Spanned<f64>>,
    pub shortest: Option<Spanned<f64>>,
    pub longest_at_bone: Option<Spanned<f64>>,
    pub shortest_at_bone: Option<Spanned<f64>>,
    pub band: Option<Spanned<f64>>,
    pub stiffness: Option<Spanned<f64>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TensionSpec {
    pub along: Spanned<f64>,
    pub across: Option<Spanned<f64>>,
    pub direction: Option<Triple>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViscousSpec {
    pub g: Spanned<Vec<f64>>,
    pub tau: Spanned<Vec<f64>>,
}

impl TissueSpec {
    /// The constants that stand in the table, by key.
    pub fn constants(&self) -> [(&'static str, &Option<Spanned<Constant>>); 12] {
        let Self {
            regions: _,
            preset: _,
            level: _,
            energy: _,
            E,
            nu,
            mu,
            alpha,
            b,
            c1,
            c2,
            c10,
            c01,
            c20,
            c30,
            kappa,
            density: _,
            pressure: _,
            viscous: _,
            fibre: _,
            damage: _,
            grade: _,
            limit: _,
            tension: _,
            tunable: _,
        } = self;
        [
            ("E", E),
            ("nu", nu),
            ("mu", mu),
            ("alpha", alpha),
            ("b", b),
            ("c1", c1),
            ("c2", c2),
            ("c10", c10),
            ("c01", c01),
            ("c20", c20),
            ("c30", c30),
            ("kappa", kappa),
        ]
    }
}

/// One number, or several for laws of several terms.
#[derive(Debug, Clone, Deserialize)]
#[serde(untagged)]
pub enum Constant {
    One(f64),
    Many(Vec<f64>),
}

impl Constant {
    pub fn values(&self) -> Vec<f64> {
        match self {
            Constant::One(v) => vec![*v],
            Constant::Many(v) => v.clone(),
        }
    }
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoneSpec {
    pub name: Spanned<String>,
    pub nodes: Option<Spanned<String>>,
    pub within: Option<Spanned<[[f64; 3]; 2]>>,
    pub drive: Option<Spanned<String>>,
    pub pivot: Option<Triple>,
    pub translation: Option<Triple>,
    pub rotation: Option<Triple>,
    pub force: Option<Triple>,
    pub torque: Option<Triple>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MuscleSpec {
    pub name: Spanned<String>,
    pub path: Spanned<Vec<[f64; 3]>>,
    pub radius: Spanned<f64>,
    pub stress: Option<Spanned<f64>>,
    pub width: Option<Spanned<f64>>,
    pub activation: Option<Spanned<f64>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadSpec {
    pub name: Spanned<String>,
    pub at: Option<Triple>,
    pub radius: Option<Spanned<f64>>,
    pub region: Option<Spanned<String>>,
    pub force: Option<Triple>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PressureSpec {
    pub name: Spanned<String>,
    pub faces: Option<Spanned<String>>,
    pub at: Option<Triple>,
    pub radius: Option<Spanned<f64>>,
    pub pressure: Option<Spanned<f64>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactSpec {
    pub name: Spanned<String>,
    pub bone: Spanned<String>,
    pub path: Option<Spanned<Vec<[f64; 3]>>>,
    pub radius: Option<Spanned<f64>>,
    pub point: Option<Triple>,
    pub normal: Option<Triple>,
    pub faces: Option<Spanned<String>>,
    pub stiffness: Option<Spanned<f64>>,
    pub friction: Option<Spanned<f64>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MarkerSpec {
    pub name: Spanned<String>,
    pub at: Triple,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GravitySpec {
    pub acceleration: Option<Triple>,
    pub scan: Option<Triple>,
    pub rest: Option<Spanned<String>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InertiaSpec {
    pub start: Option<Spanned<String>>,
    pub scheme: Option<Spanned<String>>,
    pub rho: Option<Spanned<f64>>,
    pub damping_mass: Option<Spanned<f64>>,
    pub damping_stiffness: Option<Spanned<f64>>,
    pub accuracy: Option<Spanned<f64>>,
    pub modes: Option<Spanned<u32>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AttachmentSpec {
    pub free_rings: Option<Spanned<u32>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolverSpec {
    pub method: Option<Spanned<String>>,
    pub tolerance: Option<Spanned<f64>>,
    pub max_iterations: Option<Spanned<u32>>,
    pub most_solves: Option<Spanned<u32>>,
    pub inversion: Option<Spanned<String>>,
    pub precision: Option<Spanned<String>>,
    pub linear: Option<Spanned<String>>,
    pub background: Option<Spanned<bool>>,
    pub threads: Option<Spanned<u32>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunSpec {
    pub dt: Option<Spanned<f64>>,
    pub end: Option<Spanned<f64>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeyframeSpec {
    pub t: Spanned<f64>,
    pub port: Spanned<String>,
    pub row: Option<Spanned<String>>,
    pub value: Spanned<toml::Value>,
}

impl SceneFile {
    /// Reads a scene.
    ///
    /// # Errors
    /// [`SceneError::Meaning`] with line, column and choices.
    pub fn parse(text: &str) -> Result<SceneFile, SceneError> {
        toml::from_str(text).map_err(|e| slip(text, &e))
    }
}

/// What the parser says of `text`, with line and column.
pub(super) fn slip(text: &str, error: &toml::de::Error) -> SceneError {
    let at = error.span().map_or(0, |span| span.start);
    let message = plain(&lacking(text, at, error.message()));
    // A value that is none of its key's: which key that is stands before it.
    let before = text[..at.min(text.len())].rsplit('\n').next().unwrap_or_default();
    let key = before.rsplit_once('=').map(|(key, _)| key.rsplit(['{', ',']).next().unwrap_or_default().trim());
    match key.filter(|key| !key.is_empty() && message.starts_with("found ")) {
        Some(key) => Text(text).at(at, format!("`{key}`: {message}")),
        None => Text(text).at(at, message),
    }
}

/// Where `message` misses a key, the same with the table that lacks it: the one whose heading stands at `at`.
fn lacking(text: &str, at: usize, message: &str) -> String {
    let Some(key) = message.strip_prefix("missing field ") else { return message.to_owned() };
    let heading = text[at.min(text.len())..].lines().next().unwrap_or_default().trim();
    match heading.rfind(']') {
        Some(end) if heading.starts_with('[') && !(at == 0 && key == "`mesh`") => {
            format!("{} lacks {key}", &heading[..=end])
        }
        _ if key == "`mesh`" => "the scene lacks the table [mesh]".to_owned(),
        _ => format!("{key} is missing"),
    }
}

/// The message of the parser in words of a scene instead of those of the program's types.
fn plain(message: &str) -> String {
    const WORDS: [(&str, &str); 20] = [
        ("invalid value: integer ", "found the whole number "),
        ("invalid value: ", "found "),
        ("unknown field ", "unknown key "),
        ("missing field ", "missing key "),
        ("invalid type: map, expected a sequence", "found one table, wanted an array of tables: [[name]]"),
        (
            "data did not match any variant of untagged enum Constant",
            "wanted a number, or an array of numbers for `ogden`",
        ),
        ("expected a sequence", "wanted an array"),
        ("expected a map", "wanted a table"),
        ("expected an array of length", "wanted an array of"),
        ("expected a tuple of size", "wanted an array of"),
        ("expected f64", "wanted a number"),
        ("expected u32", "wanted a whole number, zero or more"),
        ("expected usize", "wanted a whole number, zero or more"),
        ("expected a string", "wanted text in quotes"),
        ("expected a boolean", "wanted true or false"),
        ("invalid type: floating point ", "found the number "),
        ("invalid type: integer ", "found the whole number "),
        ("invalid type: string ", "found the text "),
        ("invalid type: ", "found a "),
        ("invalid length ", "found an array of "),
    ];
    let mut text = WORDS.iter().fold(message.to_owned(), |text, (theirs, ours)| text.replace(theirs, ours));
    // What is left names a type: a table of the scene.
    while let Some(at) = text.find("expected struct ") {
        let end = text[at + 16..].find(|c: char| !c.is_alphanumeric()).map_or(text.len(), |n| at + 16 + n);
        text.replace_range(at..end, "wanted a table");
    }
    text
}
