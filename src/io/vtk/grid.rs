//! The unstructured grid both VTK formats carry, and how a mesh with its tags is told in it.

use std::collections::BTreeMap;
use std::path::Path;

use crate::io::IoError;
use crate::math::Vec3;
use crate::mesh::{FaceSet, FineSkin, NodeSet, TetMesh};

/// VTK's number for a linear tetrahedron.
pub(super) const VTK_TETRA: i64 = 10;
/// And for a triangle.
const VTK_TRIANGLE: i64 = 5;
/// Cells with nodes on their edges.
const QUADRATIC: std::ops::RangeInclusive<i64> = 21..=37;
/// Cell data that number regions; the second is what meshio makes of Gmsh's physical groups.
const REGIONS: [&str; 2] = [REGION, "gmsh:physical"];
/// Cell data of cells that are hidden or belong elsewhere.
const GHOSTS: &str = "vtkGhostType";
const REGION: &str = "region";
const REGION_NAMES: &str = "region_names";
const NODE_SET: &str = "set:";
const FACE_SET: &str = "faces:";

/// Values of a data array.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Values {
    F64(Vec<f64>),
    I64(Vec<i64>),
    I8(Vec<i8>),
    Text(Vec<String>),
}

/// A named data array.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Array {
    pub name: String,
    pub components: usize,
    pub values: Values,
}

impl Array {
    pub fn new(name: impl Into<String>, components: usize, values: Values) -> Self {
        Self { name: name.into(), components, values }
    }

    /// Integer values; floating-point ones that are whole count as such.
    pub fn integers(&self) -> Option<Vec<i64>> {
        match &self.values {
            Values::I64(v) => Some(v.clone()),
            Values::I8(v) => Some(v.iter().map(|&x| i64::from(x)).collect()),
            Values::F64(v) => v.iter().map(|&x| (x.fract() == 0.0).then_some(x as i64)).collect(),
            Values::Text(_) => None,
        }
    }
}

/// Points, cells and data, as read.
#[derive(Debug, Default)]
pub(super) struct Grid {
    pub points: Vec<Vec3>,
    pub types: Vec<i64>,
    pub offsets: Vec<i64>,
    pub connectivity: Vec<i64>,
    pub point_data: Vec<Array>,
    pub cell_data: Vec<Array>,
    pub field_data: Vec<Array>,
    /// Appended arrays not decoded yet: their group and attributes.
    pub pending: Vec<(String, BTreeMap<String, String>)>,
}

/// Tags of a mesh as point, cell and field data.
pub(super) fn tags(mesh: &TetMesh) -> [Vec<Array>; 3] {
    let point = mesh.node_sets.iter().map(|set| {
        let mut inside = vec![0i8; mesh.nodes.len()];
        set.nodes.iter().for_each(|&a| inside[a as usize] = 1);
        Array::new(format!("{NODE_SET}{}", set.name), 1, Values::I8(inside))
    });
    let region = Values::I64(mesh.region.iter().map(|&r| i64::from(r)).collect());
    let mut field = vec![Array::new(REGION_NAMES, 1, Values::Text(mesh.region_names.clone()))];
    field.extend(mesh.face_sets.iter().map(|set| {
        let corners = set.triangles.as_flattened().iter().map(|&a| i64::from(a)).collect();
        Array::new(format!("{FACE_SET}{}", set.name), 3, Values::I64(corners))
    }));
    [point.collect(), vec![Array::new(REGION, 1, region)], field]
}

impl Grid {
    /// Kind and corners of each cell.
    fn cells(&self, path: &Path) -> Result<Vec<(i64, &[i64])>, IoError> {
        if self.types.len() != self.offsets.len() {
            let found = format!("{} types for {} cells", self.types.len(), self.offsets.len());
            return Err(IoError::format(path, "cells", found, "as many types as cells"));
        }
        let mut begin = 0;
        let mut cells = Vec::with_capacity(self.types.len());
        for (cell, (&kind, &end)) in self.types.iter().zip(&self.offsets).enumerate() {
            let corners = usize::try_from(end).ok().and_then(|end| self.connectivity.get(begin..end));
            let corners = corners.ok_or_else(|| {
                let place = format!("cell {cell}");
                IoError::format(path, place, format!("offset {end}"), "offsets that grow and stay in range")
            })?;
            begin = end as usize;
            cells.push((kind, corners));
        }
        Ok(cells)
    }

    /// Corners of a cell as node numbers.
    fn nodes<const N: usize>(&self, path: &Path, cell: usize, corners: &[i64]) -> Result<[u32; N], IoError> {
        let node = |&a: &i64| u32::try_from(a).ok().filter(|&a| (a as usize) < self.points.len());
        let nodes: Option<Vec<u32>> = corners.iter().map(node).collect();
        nodes.and_then(|n| n.try_into().ok()).ok_or_else(|| {
            let found = format!("corners {corners:?}");
            IoError::format(path, format!("cell {cell}"), found, &format!("{N} node numbers in range"))
        })
    }

    /// The triangles of the grid; other cells are passed over and told.
    pub fn into_triangles(self, path: &Path, told: &mut Vec<String>) -> Result<FineSkin, IoError> {
        let mut triangles = Vec::new();
        let mut others = Vec::new();
        for (cell, (kind, corners)) in self.cells(path)?.into_iter().enumerate() {
            match kind {
                VTK_TRIANGLE => triangles.push(self.nodes::<3>(path, cell, corners)?),
                kind => others.push(kind),
            }
        }
        passed_over(others, "a surface is made of triangles (type 5)", told);
        Ok(FineSkin { vertices: self.points, triangles })
    }

    /// The tetrahedra and tags of the grid. Triangles are faces of sets; other cells of lower dimension are passed over
    /// and told.
    pub fn into_mesh(self, path: &Path, told: &mut Vec<String>) -> Result<TetMesh, IoError> {
        let mut mesh = TetMesh::default();
        let (mut tets, mut triangles, mut others) = (Vec::new(), Vec::new(), Vec::new());
        for (cell, (kind, corners)) in self.cells(path)?.into_iter().enumerate() {
            match kind {
                VTK_TETRA => {
                    mesh.tets.push(self.nodes::<4>(path, cell, corners)?);
                    tets.push(cell);
                }
                VTK_TRIANGLE => triangles.push((cell, self.nodes::<3>(path, cell, corners)?)),
                0..=9 => others.push(kind),
                _ => {
                    let found = format!("cell {cell} of VTK type {kind} with {} corners", corners.len());
                    let advice = if QUADRATIC.contains(&kind) {
                        "save linear elements: a scene makes quadratic ones of them (`[mesh] order = 2`)"
                    } else {
                        "only linear tetrahedra (type 10) are read: tetrahedralise first"
                    };
                    return Err(IoError::unsupported(path, found, advice));
                }
            }
        }
        passed_over(others, "tetrahedra (type 10) and triangles (type 5) are read", told);
        self.no_ghosts(path, &tets)?;
        regions(&mut mesh, &self.cell_data, &self.field_data, &tets, path, told)?;
        for array in &self.point_data {
            let Some(name) = array.name.strip_prefix(NODE_SET) else { continue };
            let inside = array.integers().filter(|v| v.len() == self.points.len());
            let inside =
                inside.ok_or_else(|| IoError::format(path, &array.name, "another length or text", "0 or 1 a node"))?;
            let nodes = (0u32..).zip(&inside).filter(|(_, v)| **v != 0).map(|(a, _)| a).collect();
            mesh.node_sets.push(NodeSet { name: name.into(), nodes });
        }
        for array in &self.field_data {
            let Some(name) = array.name.strip_prefix(FACE_SET) else { continue };
            let corners: Option<Vec<u32>> =
                array.integers().and_then(|v| v.iter().map(|&a| u32::try_from(a).ok()).collect());
            let (corners, []) = corners.as_deref().map_or((&[][..], &[0][..]), |c| c.as_chunks::<3>()) else {
                return Err(IoError::format(path, &array.name, "other values", "three node numbers a triangle"));
            };
            mesh.face_sets.push(FaceSet { name: name.into(), triangles: corners.to_vec() });
        }
        self.faces_of_cells(&mut mesh, &triangles, path, told)?;
        mesh.nodes = self.points;
        Ok(mesh)
    }

    /// Cells that a viewer hides, or that another piece holds, too.
    fn no_ghosts(&self, path: &Path, tets: &[usize]) -> Result<(), IoError> {
        let ghosts = self.cell_data.iter().find(|a| a.name == GHOSTS).and_then(Array::integers).unwrap_or_default();
        match tets.iter().filter(|&&c| ghosts.get(c).is_some_and(|&g| g != 0)).count() {
            0 => Ok(()),
            n => {
                let found = format!("{n} cells that are hidden or belong to another piece (`{GHOSTS}`)");
                Err(IoError::unsupported(path, found, "remove ghost cells first (ParaView: Threshold, Remove Ghost)"))
            }
        }
    }

    /// Face sets of the triangles: cell data `faces:<name>` that are not 0 on them.
    fn faces_of_cells(
        &self,
        mesh: &mut TetMesh,
        triangles: &[(usize, [u32; 3])],
        path: &Path,
        told: &mut Vec<String>,
    ) -> Result<(), IoError> {
        let mut taken = vec![false; triangles.len()];
        for array in &self.cell_data {
            let Some(name) = array.name.strip_prefix(FACE_SET) else { continue };
            let inside = array.integers().filter(|v| v.len() == self.types.len());
            let inside =
                inside.ok_or_else(|| IoError::format(path, &array.name, "another length or text", "0 or 1 a cell"))?;
            let mut set = FaceSet { name: name.into(), triangles: Vec::new() };
            for ((cell, triangle), taken) in triangles.iter().zip(&mut taken) {
                if inside[*cell] != 0 {
                    set.triangles.push(*triangle);
                    *taken = true;
                }
            }
            mesh.face_sets.push(set);
        }
        let left = taken.iter().filter(|t| !**t).count();
        if left > 0 {
            told.push(format!(
                "{left} triangles belong to no face set and were passed over: a set is cell data `{FACE_SET}NAME`, 1 on its \
                 triangles"
            ));
        }
        Ok(())
    }
}

fn passed_over(mut kinds: Vec<i64>, read: &str, told: &mut Vec<String>) {
    let n = kinds.len();
    kinds.sort_unstable();
    kinds.dedup();
    if n > 0 {
        let kinds = kinds.iter().map(i64::to_string).collect::<Vec<_>>().join(", ");
        told.push(format!("{n} cells of VTK type {kinds} were passed over: {read}"));
    }
}

/// Regions by the array `region`, else by the one that meshio writes, else one for all.
fn regions(
    mesh: &mut TetMesh,
    cell: &[Array],
    field: &[Array],
    cells: &[usize],
    path: &Path,
    told: &mut Vec<String>,
) -> Result<(), IoError> {
    let Some(array) = REGIONS.iter().find_map(|name| cell.iter().find(|a| a.name == *name)) else {
        mesh.region = vec![0; mesh.tets.len()];
        mesh.region_names = vec!["tissue".into()];
        let others: Vec<String> =
            cell.iter().filter(|a| !a.name.starts_with(FACE_SET)).map(|a| format!("`{}`", a.name)).collect();
        if !others.is_empty() {
            told.push(format!(
                "no cell data `{REGION}`: all tissue is one region `tissue`; cell data there are {} (rename the one that \
                 numbers regions)",
                others.join(", ")
            ));
        }
        return Ok(());
    };
    let place = format!("cell data `{}`", array.name);
    if cell.iter().filter(|a| a.name == array.name).count() > 1 {
        return Err(IoError::format(path, place, "two arrays of that name", "one"));
    }
    let ids = array.integers().filter(|_| array.components == 1);
    let ids = ids.ok_or_else(|| IoError::format(path, &place, "text, fractions or vectors", "an integer a cell"))?;
    let ids: Option<Vec<i64>> = cells.iter().map(|&c| ids.get(c).copied()).collect();
    let ids = ids.ok_or_else(|| IoError::format(path, &place, "too few values", "one a cell"))?;
    if array.name != REGION {
        told.push(format!("regions were taken from the cell data `{}`", array.name));
    }
    if let Some(Values::Text(names)) = field.iter().find(|a| a.name == REGION_NAMES).map(|a| text(&a.values)) {
        if ids.iter().all(|&r| r >= 0 && (r as usize) < names.len()) {
            mesh.region = ids.iter().map(|&r| r as u32).collect();
            mesh.region_names = names;
            return Ok(());
        }
        told.push(format!(
            "`{REGION_NAMES}` has {} names, some numbers of regions are others: they serve as names",
            names.len()
        ));
    }
    let mut distinct = ids.clone();
    distinct.sort_unstable();
    distinct.dedup();
    mesh.region_names = distinct.iter().map(|r| format!("region_{r}")).collect();
    mesh.region = ids.iter().map(|r| distinct.partition_point(|d| d < r) as u32).collect();
    Ok(())
}

/// Zero-terminated character codes as strings.
pub(super) fn text(codes: &Values) -> Values {
    let Values::I64(codes) = codes else { return codes.clone() };
    let bytes: Vec<u8> = codes.iter().map(|&c| c as u8).collect();
    if bytes.is_empty() {
        return Values::Text(Vec::new());
    }
    let bytes = bytes.strip_suffix(&[0]).unwrap_or(&bytes);
    Values::Text(bytes.split(|&b| b == 0).map(|w| String::from_utf8_lossy(w).into_owned()).collect())
}
