//! VTK unstructured grids: `.vtu` with raw appended data, legacy `.vtk` in text, `.pvd` time series; surfaces as `.vtp`.
//!
//! Source: "VTK File Formats", Kitware, the XML and the legacy chapter. Regions are cell data `region` with their names
//! in field data, node sets point data `set:<name>`, face sets field data `faces:<name>` or cell data of that name on triangles.

mod base64;
mod grid;
mod legacy;
mod vtp_write;
mod vtu_read;
mod vtu_write;

use std::path::Path;

use super::{IoError, write_bytes};
use crate::math::Vec3;
use crate::mesh::{FineSkin, TetMesh};

pub(crate) use legacy::legacy_text;
pub(crate) use vtu_write::vtu_bytes;

/// The tetrahedral mesh in the bytes of a `.vtu` file, or of a legacy `.vtk` one.
pub(crate) fn read(bytes: &[u8], path: &Path, legacy: bool, told: &mut Vec<String>) -> Result<TetMesh, IoError> {
    grid(bytes, path, legacy)?.into_mesh(path, told)
}

/// Points and triangles in the same.
pub(crate) fn read_triangles(
    bytes: &[u8],
    path: &Path,
    legacy: bool,
    told: &mut Vec<String>,
) -> Result<FineSkin, IoError> {
    grid(bytes, path, legacy)?.into_triangles(path, told)
}

fn grid(bytes: &[u8], path: &Path, legacy: bool) -> Result<grid::Grid, IoError> {
    if legacy { legacy::read_legacy(bytes, path) } else { vtu_read::read_vtu(bytes, path) }
}

/// A named field on nodes or tetrahedra: `components` values each, row by row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Data<'a> {
    /// Name shown by the viewer.
    pub name: &'a str,
    /// Values a node or tetrahedron: 1, 3, 9.
    pub components: usize,
    /// The values, row by row.
    pub values: &'a [f64],
}

/// Writes a mesh at positions `x` (the rest positions or a deformed state) with fields on nodes and tetrahedra.
///
/// # Errors
/// [`IoError::File`] when the file cannot be written.
///
/// # Panics
/// When `x` or a field is not as long as the mesh asks.
pub fn write_vtu(
    path: &Path,
    mesh: &TetMesh,
    x: &[Vec3],
    point_data: &[Data],
    cell_data: &[Data],
) -> Result<(), IoError> {
    write_bytes(path, &vtu_bytes(mesh, x, point_data, cell_data))
}

/// Writes a triangle surface as `.vtp`, with fields on its vertices.
///
/// # Errors
/// [`IoError::File`] when the file cannot be written.
///
/// # Panics
/// When a field is not as long as the vertices ask.
pub fn write_vtp(path: &Path, vertices: &[Vec3], triangles: &[[u32; 3]], point_data: &[Data]) -> Result<(), IoError> {
    write_bytes(path, vtp_write::vtp_text(vertices, triangles, point_data).as_bytes())
}

/// Writes the `.pvd` index of a time series: time in s, part (from 0) and file name (relative to the index) of each file.
///
/// # Errors
/// [`IoError::File`] when the file cannot be written.
pub fn write_pvd(path: &Path, files: &[(f64, usize, String)]) -> Result<(), IoError> {
    let mut out = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n<Collection>\n",
    );
    for (t, part, file) in files {
        let file = quick_xml::escape::escape(file.as_str());
        out += &format!("<DataSet timestep=\"{t}\" group=\"\" part=\"{part}\" file=\"{file}\"/>\n");
    }
    out += "</Collection>\n</VTKFile>\n";
    write_bytes(path, out.as_bytes())
}
