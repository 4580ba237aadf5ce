//! Meshes by file extension: `.cutis` (baked), `.vtu`, `.vtk` (VTK), `.msh` (Gmsh).

use std::path::Path;

use super::{IoError, baked, gmsh, vtk};
use crate::mesh::{FineSkin, MeshError, SKIN, TetMesh};

const CHOICES: &str = ".cutis, .vtu, .vtk and .msh";
const SURFACE_CHOICES: &str = ".vtu, .vtk and .msh";

/// Reads a tetrahedral mesh with its regions, node sets and face sets. A foreign file without regions is one region
/// `tissue`; nodes that no tetrahedron uses are left out.
///
/// # Errors
/// [`IoError`]: unknown extension, unreadable, truncated or malformed file, a mesh that breaks [`TetMesh::checked`].
pub fn read_mesh(path: &Path) -> Result<TetMesh, IoError> {
    let kind = extension(path);
    if !matches!(kind.as_str(), "cutis" | "vtu" | "vtk" | "msh") {
        return Err(IoError::Extension { path: path.into(), choices: CHOICES });
    }
    let bytes = super::file::read_bytes(path)?;
    let mut mesh = match kind.as_str() {
        "cutis" => return baked::decode(&bytes, path),
        "vtu" | "vtk" => vtk::read(&bytes, path, kind == "vtk")?,
        _ => gmsh::read(&bytes, path)?,
    };
    in_range(&mesh).map_err(|source| IoError::Mesh { path: path.into(), source })?;
    drop_unused(&mut mesh);
    mesh.checked().map_err(|source| IoError::Mesh { path: path.into(), source })
}

/// Reads a triangle surface: the triangles of a VTK grid, or the physical surface `skin` of a Gmsh file (all of them if
/// none has that name). Points that no triangle uses are left out.
///
/// # Errors
/// [`IoError`]: unknown extension, unreadable or malformed file, no triangle in it.
pub fn read_surface(path: &Path) -> Result<FineSkin, IoError> {
    let kind = extension(path);
    if !matches!(kind.as_str(), "vtu" | "vtk" | "msh") {
        return Err(IoError::Extension { path: path.into(), choices: SURFACE_CHOICES });
    }
    let bytes = super::file::read_bytes(path)?;
    let mut skin = if kind == "msh" {
        let mesh = gmsh::read(&bytes, path)?;
        let all = || mesh.face_sets.iter().flat_map(|s| s.triangles.iter().copied()).collect();
        let triangles = mesh.face_set(SKIN).map_or_else(all, |s| s.triangles.clone());
        FineSkin { vertices: mesh.nodes, triangles }
    } else {
        vtk::read_triangles(&bytes, path, kind == "vtk")?
    };
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
    std::fs::write(path, bytes).map_err(IoError::file(path))
}

fn extension(path: &Path) -> String {
    path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase()
}

fn in_range(mesh: &TetMesh) -> Result<(), MeshError> {
    let n_nodes = mesh.nodes.len();
    match mesh.tets.as_flattened().iter().find(|&&a| a as usize >= n_nodes) {
        Some(&node) => Err(MeshError::NodeOutOfRange { what: "a tetrahedron".into(), node, n_nodes }),
        None => Ok(()),
    }
}

/// Leaves out nodes that no tetrahedron uses, and faces and set members that need them.
fn drop_unused(mesh: &mut TetMesh) {
    let mut new = vec![u32::MAX; mesh.nodes.len()];
    mesh.tets.as_flattened().iter().for_each(|&a| new[a as usize] = 0);
    if !new.contains(&u32::MAX) {
        return;
    }
    (0u32..).zip(new.iter_mut().filter(|n| **n == 0)).for_each(|(next, n)| *n = next);
    let at = |a: u32| new.get(a as usize).copied().unwrap_or(u32::MAX);
    let mut keep = new.iter().map(|&n| n != u32::MAX);
    mesh.nodes.retain(|_| keep.next() == Some(true));
    mesh.tets.iter_mut().for_each(|tet| *tet = tet.map(at));
    for set in &mut mesh.node_sets {
        set.nodes = set.nodes.iter().map(|&a| at(a)).filter(|&a| a != u32::MAX).collect();
    }
    for set in &mut mesh.face_sets {
        set.triangles = set.triangles.iter().map(|t| t.map(at)).filter(|t| !t.contains(&u32::MAX)).collect();
    }
}
