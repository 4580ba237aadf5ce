//! Legacy `.vtk`, text flavour: written as 4.2, read up to 5.1.

use std::fmt::Write;
use std::path::Path;

use super::grid::{Array, Grid, VTK_TETRA, Values, tags};
use crate::io::IoError;
use crate::io::text::{Words, exact};
use crate::math::Vec3;
use crate::mesh::TetMesh;

/// A mesh as legacy text, every number exact.
pub(crate) fn legacy_text(mesh: &TetMesh) -> String {
    let [point, cell, field] = tags(mesh);
    let (n_nodes, n_tets) = (mesh.nodes.len(), mesh.tets.len());
    let mut out = String::from("# vtk DataFile Version 4.2\ncutis mesh\nASCII\nDATASET UNSTRUCTURED_GRID\n");
    put_field(&mut out, &field);
    out += &format!("POINTS {n_nodes} double\n");
    for x in &mesh.nodes {
        out += &format!("{} {} {}\n", exact(x.x), exact(x.y), exact(x.z));
    }
    out += &format!("CELLS {n_tets} {}\n", 5 * n_tets);
    for [a, b, c, d] in &mesh.tets {
        writeln!(out, "4 {a} {b} {c} {d}").expect("a String takes everything");
    }
    out += &format!("CELL_TYPES {n_tets}\n");
    out.extend(std::iter::repeat_n("10\n", n_tets));
    out += &format!("CELL_DATA {n_tets}\n");
    put_field(&mut out, &cell);
    if !point.is_empty() {
        out += &format!("POINT_DATA {n_nodes}\n");
        put_field(&mut out, &point);
    }
    out
}

fn put_field(out: &mut String, arrays: &[Array]) {
    *out += &format!("FIELD FieldData {}\n", arrays.len());
    for array in arrays {
        let (kind, words): (&str, Vec<String>) = match &array.values {
            Values::F64(v) => ("double", v.iter().map(|&x| exact(x)).collect()),
            Values::I64(v) => (
                if v.iter().all(|&x| i32::try_from(x).is_ok()) { "int" } else { "vtktypeint64" },
                v.iter().map(i64::to_string).collect(),
            ),
            Values::I8(v) => ("char", v.iter().map(i8::to_string).collect()),
            // Character codes, as in .vtu: readers that know numbers only pass over them.
            Values::Text(v) => {
                ("unsigned_char", v.iter().flat_map(|w| w.bytes().chain([0])).map(|c| c.to_string()).collect())
            }
        };
        let rows = words.len() / array.components.max(1);
        *out += &format!("{} {} {rows} {kind}\n", percent(&array.name), array.components);
        *out += &words.join("\n");
        out.push('\n');
    }
}

/// Names as VTK's text files hold them: blanks and signs as %XX.
fn percent(name: &str) -> String {
    let mut out = String::new();
    for b in name.bytes() {
        if b.is_ascii_graphic() && b != b'%' && b != b'"' { out.push(b as char) } else { out += &format!("%{b:02X}") }
    }
    out
}

fn unpercent(word: &str) -> String {
    let mut out = Vec::new();
    let mut rest = word.as_bytes();
    while let Some((&b, tail)) = rest.split_first() {
        let code = (b == b'%').then(|| tail.get(..2)).flatten().and_then(|h| std::str::from_utf8(h).ok());
        match code.and_then(|h| u8::from_str_radix(h, 16).ok()) {
            Some(c) => {
                out.push(c);
                rest = &tail[2..];
            }
            None => {
                out.push(b);
                rest = tail;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

/// The grid in the bytes of a legacy `.vtk` file.
pub(super) fn read_legacy(bytes: &[u8], path: &Path) -> Result<Grid, IoError> {
    let text = String::from_utf8_lossy(bytes);
    let mut words = Words::new(path, &text);
    let first = words.line().unwrap_or("");
    if !first.starts_with("# vtk DataFile") {
        return Err(IoError::format(path, "line 1", format!("`{:.40}`", first), "`# vtk DataFile Version ...`"));
    }
    words.line();
    let flavour = words.need("ASCII or BINARY")?;
    if flavour.eq_ignore_ascii_case("binary") {
        return Err(IoError::unsupported(path, "a binary legacy file", "save it as ASCII or as .vtu"));
    }
    let mut grid = Grid::default();
    let mut into: Option<bool> = None;
    let mut rows = 0;
    while let Some(word) = words.word() {
        match word.to_ascii_uppercase().as_str() {
            "DATASET" => {
                let kind = words.need("a dataset type")?;
                if !kind.eq_ignore_ascii_case("unstructured_grid") {
                    let found = format!("a dataset of type {kind}");
                    return Err(IoError::unsupported(path, found, "an UNSTRUCTURED_GRID of tetrahedra is needed"));
                }
            }
            "POINTS" => {
                let n = words.count("number of points")?;
                words.need("a number type")?;
                grid.points = (0..n)
                    .map(|_| Ok(Vec3::new(words.parse("x")?, words.parse("y")?, words.parse("z")?)))
                    .collect::<Result<_, IoError>>()?;
            }
            "CELLS" => read_cells(&mut words, &mut grid)?,
            "CELL_TYPES" => {
                let n = words.count("number of cell types")?;
                grid.types = (0..n).map(|_| words.parse("a cell type")).collect::<Result<_, _>>()?;
            }
            "POINT_DATA" => (into, rows) = (Some(true), words.count("number of points")?),
            "CELL_DATA" => (into, rows) = (Some(false), words.count("number of cells")?),
            "FIELD" => {
                words.need("a field name")?;
                for _ in 0..words.count("number of arrays")? {
                    let name = unpercent(words.need("an array name")?);
                    let components = words.count("number of components")?;
                    let tuples = words.count("number of tuples")?;
                    let kind = words.need("a number type")?;
                    let array = read_array(&mut words, &name, components, tuples, kind)?;
                    store(&mut grid, into, array);
                }
            }
            "SCALARS" => {
                let (name, kind) = (unpercent(words.need("a name")?), words.need("a number type")?);
                let components = match words.peek() {
                    Some(w) if w != "LOOKUP_TABLE" => words.count("number of components")?,
                    _ => 1,
                };
                words.need("LOOKUP_TABLE")?;
                words.need("a table name")?;
                let array = read_array(&mut words, &name, components, rows, kind)?;
                store(&mut grid, into, array);
            }
            "VECTORS" | "NORMALS" | "TENSORS" => {
                let (name, kind) = (unpercent(words.need("a name")?), words.need("a number type")?);
                let components = if word.eq_ignore_ascii_case("tensors") { 9 } else { 3 };
                let array = read_array(&mut words, &name, components, rows, kind)?;
                store(&mut grid, into, array);
            }
            "LOOKUP_TABLE" => {
                words.need("a table name")?;
                for _ in 0..4 * words.count("size of the table")? {
                    words.need("a colour")?;
                }
            }
            "METADATA" => {
                words.line();
                while words.line().is_some_and(|l| !l.is_empty()) {}
            }
            _ => return Err(words.slip(&format!("`{word}`"), "a section of an unstructured grid")),
        }
    }
    Ok(grid)
}

fn store(grid: &mut Grid, into: Option<bool>, array: Array) {
    match into {
        None => grid.field_data.push(array),
        Some(true) => grid.point_data.push(array),
        Some(false) => grid.cell_data.push(array),
    }
}

fn read_array(words: &mut Words, name: &str, components: usize, tuples: usize, kind: &str) -> Result<Array, IoError> {
    let n = components.saturating_mul(tuples);
    let values = match kind {
        "string" => Values::Text((0..n).map(|_| Ok(unpercent(words.need("a word")?))).collect::<Result<_, IoError>>()?),
        "float" | "double" => Values::F64((0..n).map(|_| words.parse("a number")).collect::<Result<_, _>>()?),
        _ => Values::I64((0..n).map(|_| words.parse("an integer")).collect::<Result<_, _>>()?),
    };
    Ok(Array::new(name, components, values))
}

fn read_cells(words: &mut Words, grid: &mut Grid) -> Result<(), IoError> {
    let n = words.count("number of cells")?;
    let size = words.count("size of the cell list")?;
    if words.peek() == Some("OFFSETS") {
        words.word();
        words.need("a number type")?;
        let offsets: Vec<i64> = (0..n).map(|_| words.parse("an offset")).collect::<Result<_, _>>()?;
        if offsets.first().is_some_and(|&o| o != 0) {
            return Err(words.slip(&format!("first offset {}", offsets[0]), "0"));
        }
        grid.offsets = offsets[1.min(offsets.len())..].to_vec();
        if words.need("CONNECTIVITY")? != "CONNECTIVITY" {
            return Err(words.slip("another word", "CONNECTIVITY"));
        }
        words.need("a number type")?;
        grid.connectivity = (0..size).map(|_| words.parse("a node number")).collect::<Result<_, _>>()?;
        return Ok(());
    }
    grid.offsets.clear();
    for _ in 0..n {
        for _ in 0..words.count("number of corners")? {
            grid.connectivity.push(words.parse("a node number")?);
        }
        grid.offsets.push(grid.connectivity.len() as i64);
    }
    Ok(())
}

/// Cells of a mesh are linear tetrahedra.
const _: () = assert!(VTK_TETRA == 10);
