//! Meshes by file extension: `.cutis` (baked), `.vtu`, `.vtk` (VTK), `.msh` (Gmsh).

use std::path::Path;

use super::{IoError, baked, file, foreign, gmsh, vtk};
use crate::mesh::{FineSkin, MeshError, SKIN, TetMesh};

const CHOICES: &str = ".cutis, .vtu, .vtk and .msh";
const SURFACE_CHOICES: &str = ".vtu, .vtk and .msh";

/// Reads a tetrahedral mesh with its regions, node sets and face sets. A foreign file without regions is one region
/// `tissue`; nodes that no tetrahedron uses are left out, what is listed twice counts once, faces are wound outward.
/// What was mended, passed over or is doubtful is added to `notes`, a sentence each.
///
/// # Errors
/// [`IoError`]: unknown extension, unreadable, truncated or malformed file, a mesh that breaks [`TetMesh::checked`].
pub fn read_mesh(path: &Path, notes: &mut Vec<String>) -> Result<TetMesh, IoError> {
    let kind = extension(path);
    if !matches!(kind.as_str(), "cutis" | "vtu" | "vtk" | "msh") {
        return Err(IoError::Extension { path: path.into(), choices: CHOICES });
    }
    let bytes = file::read_bytes(path)?;
    let mut told = Vec::new();
    let mut mesh = match kind.as_str() {
        "cutis" => return baked::decode(&bytes, path),
        "vtu" | "vtk" => vtk::read(&bytes, path, kind == "vtk", &mut told)?,
        _ => gmsh::read(&bytes, path, &mut told)?,
    };
    let broken = |source| IoError::Mesh { path: path.into(), source };
    in_range(&mesh).map_err(broken)?;
    foreign::mend(&mut mesh, &mut told);
    notes.extend(told.into_iter().map(|note| format!("{}: {note}", path.display())));
    mesh.checked().map_err(broken)
}

/// Reads a triangle surface: the triangles of a VTK grid, or the physical surface `skin` of a Gmsh file (all of them if
/// none has that name). Points that no triangle uses are left out; `notes` as for [`read_mesh`].
///
/// # Errors
/// [`IoError`]: unknown extension, unreadable or malformed file, no triangle in it.
pub fn read_surface(path: &Path, notes: &mut Vec<String>) -> Result<FineSkin, IoError> {
    let kind = extension(path);
    if !matches!(kind.as_str(), "vtu" | "vtk" | "msh") {
        return Err(IoError::Extension { path: path.into(), choices: SURFACE_CHOICES });
    }
    let bytes = file::read_bytes(path)?;
    let mut told = Vec::new();
    let mut skin = if kind == "msh" {
        let mesh = gmsh::read(&bytes, path, &mut told)?;
        let all = || mesh.face_sets.iter().flat_map(|s| s.triangles.iter().copied()).collect();
        let triangles = mesh.face_set(SKIN).map_or_else(all, |s| s.triangles.clone());
        FineSkin { vertices: mesh.nodes, triangles }
    } else {
        vtk::read_triangles(&bytes, path, kind == "vtk", &mut told)?
    };
    notes.extend(told.into_iter().map(|note| format!("{}: {note}", path.display())));
    let n = skin.vertices.len();
    if skin.triangles.is_empty() || skin.triangles.as_flattened().iter().any(|&a| a as usize >= n) {
        let found = format!("{} triangles on {n} points", skin.triangles.len());
        return Err(IoError::format(path, "the surface", found, "triangles on points of the file"));
    }
    skin.drop_unused();
    Ok(skin)
}

/// Writes a mesh so that [`read_mesh`] returns the same bits.
///
/// # Errors
/// [`IoError`]: unknown extension, a name the format cannot hold, a file that cannot be written.
pub fn write_mesh(path: &Path, mesh: &TetMesh) -> Result<(), IoError> {
    let bytes = match extension(path).as_str() {
        "cutis" => baked::encode(mesh),
        "vtu" => vtk::vtu_bytes(mesh, &mesh.nodes, &[], &[]),
        "vtk" => vtk::legacy_text(mesh).into_bytes(),
        "msh" => gmsh::text(mesh, path)?.into_bytes(),
        _ => return Err(IoError::Extension { path: path.into(), choices: CHOICES }),
    };
    super::write_bytes(path, &bytes)
}

/// Whether [`write_mesh`] could write here: a known extension, a folder that is there, a place that may be written.
///
/// # Errors
/// As [`write_mesh`].
pub fn check_mesh_target(path: &Path) -> Result<(), IoError> {
    if !matches!(extension(path).as_str(), "cutis" | "vtu" | "vtk" | "msh") {
        return Err(IoError::Extension { path: path.into(), choices: CHOICES });
    }
    let fresh = !path.exists();
    std::fs::OpenOptions::new().append(true).create(true).open(path).map_err(IoError::file(path))?;
    if fresh {
        std::fs::remove_file(path).map_err(IoError::file(path))?;
    }
    Ok(())
}

fn extension(path: &Path) -> String {
    path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase()
}

fn in_range(mesh: &TetMesh) -> Result<(), MeshError> {
    let n_nodes = mesh.nodes.len();
    let check = |what: &dyn Fn() -> String, nodes: &[u32]| match nodes.iter().find(|&&a| a as usize >= n_nodes) {
        Some(&node) => Err(MeshError::NodeOutOfRange { what: what(), node, n_nodes }),
        None => Ok(()),
    };
    check(&|| "a tetrahedron".into(), mesh.tets.as_flattened())?;
    mesh.node_sets.iter().try_for_each(|s| check(&|| format!("node set `{}`", s.name), &s.nodes))?;
    mesh.face_sets.iter().try_for_each(|s| check(&|| format!("face set `{}`", s.name), s.triangles.as_flattened()))
}
