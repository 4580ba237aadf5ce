//! From a scene file to a model: finds or makes the mesh, then builds.
#![forbid(unsafe_code)]

use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::geometry::{Block, Head, Pattern, block};
use crate::io;
use crate::mesh::{FineSkin, TetMesh};
use crate::scene::{self, MeshSource, Programme, SceneError, SceneFile, SkinSource, SmallStrain, build};
use crate::sim::Model;

/// The scene that stands in the library itself: the synthetic head.
pub const DEFAULT_SCENE: &str = include_str!("../fmu/scene.toml");

/// Name of the mesh file beside a packed scene.
pub const BAKED_NAME: &str = "model.cutis";

/// A scene, loaded: a model and the programme that it gives it.
pub struct Loaded {
    /// The model.
    pub model: Model,
    /// The programme of `cutis run`.
    pub programme: Programme,
}

impl Loaded {
    /// A scene file; files it names are relative to its folder.
    ///
    /// # Errors
    /// [`Error`].
    pub fn open(scene: &Path) -> Result<Loaded, Error> {
        from_file(scene)
    }

    /// A scene from its text; files it names are relative to the working directory.
    ///
    /// # Errors
    /// [`Error`].
    pub fn parse(text: &str) -> Result<Loaded, Error> {
        from_text(text, None)
    }
}

/// A scene made self-contained: its text reads the mesh from [`BAKED_NAME`], whose bytes are here.
pub struct Baked {
    /// Scene text.
    pub scene: String,
    /// Bytes of the baked mesh.
    pub mesh: Vec<u8>,
    /// What was noticed of the files that it was made from.
    pub notes: Vec<String>,
}

/// Loads `scene`; files it names are relative to its folder.
///
/// # Errors
/// [`Error`].
pub fn from_file(scene: &Path) -> Result<Loaded, Error> {
    let text = read(scene)?;
    load(&text, scene, scene.parent())
}

/// Loads a scene from its text; files it names are relative to `folder` (the working directory if `None`).
///
/// # Errors
/// [`Error`].
pub fn from_text(text: &str, folder: Option<&Path>) -> Result<Loaded, Error> {
    load(text, Path::new("<text>"), folder)
}

/// The same with this skin in place of the scene's own, whatever the mesh.
///
/// # Errors
/// [`Error`].
pub fn with_skin(text: &str, folder: Option<&Path>, skin: FineSkin) -> Result<Loaded, Error> {
    let path = Path::new("<text>");
    let file = parse(text, path)?;
    let (mesh, notes) = mesh_of(text, &file, path, folder)?;
    let mesh = TetMesh { fine_skin: Some(skin), ..mesh };
    let (model, programme) = build(text, &file, mesh).map_err(|e| scene_error(path, e))?;
    Ok(Loaded { model: model.with_notes(notes), programme })
}

/// Small-strain constants of the tissues of a scene, in order.
///
/// # Errors
/// [`Error`].
pub fn small_strain(text: &str) -> Result<Vec<SmallStrain>, Error> {
    let path = Path::new("<text>");
    scene::small_strain(text, &parse(text, path)?).map_err(|e| scene_error(path, e))
}

/// The mesh of a scene, as it is before elements are made of it.
///
/// # Errors
/// [`Error`].
pub fn mesh(text: &str, folder: Option<&Path>) -> Result<TetMesh, Error> {
    let path = Path::new("<text>");
    Ok(mesh_of(text, &parse(text, path)?, path, folder)?.0)
}

/// A mesh file that a scene names, relative to `folder`.
///
/// # Errors
/// [`Error`].
pub fn mesh_file(folder: Option<&Path>, name: &str) -> Result<TetMesh, Error> {
    Ok(io::read_mesh(&beside(folder, name), &mut Vec::new())?)
}

/// Loads the default scene.
///
/// # Errors
/// [`Error`]; none as long as the tests pass.
pub fn embedded() -> Result<Loaded, Error> {
    load(DEFAULT_SCENE, Path::new("<default scene>"), None)
}

/// Makes `scene` self-contained.
///
/// # Errors
/// [`Error`].
pub fn baked(scene: &Path) -> Result<Baked, Error> {
    let text = read(scene)?;
    baked_text(&text, scene, scene.parent())
}

/// Makes the default scene self-contained.
///
/// # Errors
/// [`Error`]; none as long as the tests pass.
pub fn baked_default() -> Result<Baked, Error> {
    baked_text(DEFAULT_SCENE, Path::new("<default scene>"), None)
}

impl Baked {
    /// Loads it as a component will: the mesh from these bytes.
    ///
    /// # Errors
    /// [`Error`]; none for what [`baked`] made.
    pub fn load(&self) -> Result<Loaded, Error> {
        let path = Path::new(BAKED_NAME);
        let file = parse(&self.scene, path)?;
        let mesh = io::decode(&self.mesh, path)?;
        let (model, programme) = build(&self.scene, &file, mesh).map_err(|e| scene_error(path, e))?;
        Ok(Loaded { model: model.with_notes(self.notes.clone()), programme })
    }
}

fn baked_text(text: &str, path: &Path, folder: Option<&Path>) -> Result<Baked, Error> {
    let file = parse(text, path)?;
    let (mut mesh, notes) = mesh_of(text, &file, path, folder)?;
    let (model, _) = build(text, &file, mesh.clone()).map_err(|e| scene_error(path, e))?;
    mesh.elimination = model.elimination();
    let scene = scene::packed(text, BAKED_NAME).map_err(|e| scene_error(path, e))?;
    Ok(Baked { scene, mesh: io::encode(&mesh), notes })
}

fn read(path: &Path) -> Result<String, Error> {
    Ok(io::read_text(path)?)
}

fn scene_error(path: &Path, source: SceneError) -> Error {
    Error::Scene { path: path.into(), source: Box::new(source) }
}

fn parse(text: &str, path: &Path) -> Result<SceneFile, Error> {
    SceneFile::parse(text).map_err(|e| scene_error(path, e))
}

fn load(text: &str, path: &Path, folder: Option<&Path>) -> Result<Loaded, Error> {
    let file = parse(text, path)?;
    let (mesh, notes) = mesh_of(text, &file, path, folder)?;
    let (model, programme) = build(text, &file, mesh).map_err(|e| scene_error(path, e))?;
    Ok(Loaded { model: model.with_notes(notes), programme })
}

/// The mesh of a scene, and what was noticed of the files that it came from.
fn mesh_of(text: &str, file: &SceneFile, path: &Path, folder: Option<&Path>) -> Result<(TetMesh, Vec<String>), Error> {
    let mut notes = Vec::new();
    let mut mesh = match file.mesh_source(text).map_err(|e| scene_error(path, e))? {
        MeshSource::File(name) => io::read_mesh(&beside(folder, &name), &mut notes)?,
        MeshSource::Block { origin, size, cells, forty_eight, layers } => {
            let pattern = if forty_eight { Pattern::FortyEight } else { Pattern::Six };
            block(&Block { origin, size, cells, pattern, layers })?
        }
        MeshSource::Head { edge } => {
            let standard = Head::default();
            Head { edge: edge.unwrap_or(standard.edge), ..standard }.mesh()?.0
        }
    };
    if let Some(source) = file.skin_source(text).map_err(|e| scene_error(path, e))? {
        mesh.fine_skin = Some(match source {
            SkinSource::File(name) => io::read_surface(&beside(folder, &name), &mut notes)?,
            SkinSource::Head { edge } => FineSkin::of(&Head { edge, ..Head::default() }.mesh()?.0),
            SkinSource::Subdivided(times) => (0..times).fold(FineSkin::of(&mesh), |skin, _| skin.subdivided()),
        });
    }
    Ok((mesh, notes))
}

fn beside(folder: Option<&Path>, name: &str) -> PathBuf {
    folder.map_or_else(|| PathBuf::from(name), |f| f.join(name))
}
