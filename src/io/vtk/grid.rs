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
    /// The triangles of the grid; other cells are passed over.
    pub fn into_triangles(self, path: &Path) -> Result<FineSkin, IoError> {
        let mut triangles = Vec::new();
        let mut begin = 0;
        for (cell, (&kind, &end)) in self.types.iter().zip(&self.offsets).enumerate() {
            let slip = || {
                let found = format!("offset {end}");
                IoError::format(path, format!("cell {cell}"), found, "offsets that grow, and corners in range")
            };
            let end = usize::try_from(end).map_err(|_| slip())?;
            let corners = self.connectivity.get(begin..end).ok_or_else(slip)?;
            begin = end;
            if kind == VTK_TRIANGLE {
                let corners: Result<Vec<u32>, _> = corners.iter().map(|&a| u32::try_from(a)).collect();
                triangles.push(corners.ok().and_then(|c| c.try_into().ok()).ok_or_else(slip)?);
            }
        }
        Ok(FineSkin { vertices: self.points, triangles })
    }

    /// The tetrahedra and tags of the grid; cells of lower dimension are passed over.
    pub fn into_mesh(self, path: &Path) -> Result<TetMesh, IoError> {
        let mut mesh = TetMesh { nodes: self.points, ..TetMesh::default() };
        let mut cells = Vec::new();
        let mut begin = 0;
        if self.types.len() != self.offsets.len() {
            let found = format!("{} types for {} cells", self.types.len(), self.offsets.len());
            return Err(IoError::format(path, "cells", found, "as many types as cells"));
        }
        for (cell, (&kind, &end)) in self.types.iter().zip(&self.offsets).enumerate() {
            let corners = usize::try_from(end).ok().and_then(|end| self.connectivity.get(begin..end));
            let corners = corners.ok_or_else(|| {
                IoError::format(
                    path,
                    format!("cell {cell}"),
                    format!("offset {end}"),
                    "offsets that grow and stay in range",
                )
            })?;
            begin = end as usize;
            match (kind, corners) {
                (VTK_TETRA, &[a, b, c, d]) => {
                    let node = |a: i64| u32::try_from(a).ok().filter(|&a| (a as usize) < mesh.nodes.len());
                    let tet = [node(a), node(b), node(c), node(d)];
                    let [Some(a), Some(b), Some(c), Some(d)] = tet else {
                        let found = format!("corners {corners:?}");
                        return Err(IoError::format(path, format!("cell {cell}"), found, "node numbers in range"));
                    };
                    mesh.tets.push([a, b, c, d]);
                    cells.push(cell);
                }
                (0..=9, _) => {}
                _ => {
                    let found = format!("cell {cell} of VTK type {kind} with {} corners", corners.len());
                    return Err(IoError::unsupported(
                        path,
                        found,
                        "only linear tetrahedra (type 10) are read: tetrahedralise first",
                    ));
                }
            }
        }
        regions(&mut mesh, &self.cell_data, &self.field_data, &cells, path)?;
        for array in &self.point_data {
            let Some(name) = array.name.strip_prefix(NODE_SET) else { continue };
            let inside = array.integers().filter(|v| v.len() == mesh.nodes.len());
            let inside =
                inside.ok_or_else(|| IoError::format(path, &array.name, "another length or text", "0 or 1 a node"))?;
            let nodes = (0u32..).zip(&inside).filter(|(_, v)| **v != 0).map(|(a, _)| a).collect();
            mesh.node_sets.push(NodeSet { name: name.into(), nodes });
        }
        for array in &self.field_data {
            let Some(name) = array.name.strip_prefix(FACE_SET) else { continue };
            let corners = array.integers().filter(|v| v.len() % 3 == 0).unwrap_or_default();
            let corners: Option<Vec<u32>> = corners.iter().map(|&a| u32::try_from(a).ok()).collect();
            let corners =
                corners.ok_or_else(|| IoError::format(path, &array.name, "negative numbers", "node numbers"))?;
            let triangles = corners.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
            mesh.face_sets.push(FaceSet { name: name.into(), triangles });
        }
        Ok(mesh)
    }
}

fn regions(mesh: &mut TetMesh, cell: &[Array], field: &[Array], cells: &[usize], path: &Path) -> Result<(), IoError> {
    let named = |arrays: &'_ [Array], name| arrays.iter().find(|a| a.name == name).cloned();
    let Some(ids) = named(cell, REGION).and_then(|a| a.integers()) else {
        mesh.region = vec![0; mesh.tets.len()];
        mesh.region_names = vec!["tissue".into()];
        return Ok(());
    };
    let ids: Option<Vec<i64>> = cells.iter().map(|&c| ids.get(c).copied()).collect();
    let ids = ids.ok_or_else(|| IoError::format(path, "cell data `region`", "too few values", "one a cell"))?;
    if let Some(Values::Text(names)) = named(field, REGION_NAMES).map(|a| text(&a.values))
        && ids.iter().all(|&r| r >= 0 && (r as usize) < names.len())
    {
        mesh.region = ids.iter().map(|&r| r as u32).collect();
        mesh.region_names = names;
        return Ok(());
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
