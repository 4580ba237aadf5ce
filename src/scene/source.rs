//! Where the tissue of a scene comes from.

use super::SceneError;
use super::check::Text;
use super::file::{MeshSpec, SceneFile, SkinSpec};
use super::keys::find;
use crate::math::Vec3;

/// What the `[mesh]` table asks for.
#[derive(Debug, Clone, PartialEq)]
pub enum MeshSource {
    /// A mesh file, relative to the scene.
    File(String),
    /// The synthetic head, with the edge of its lattice cell (m) if the scene names one.
    Head {
        /// Edge, m.
        edge: Option<f64>,
    },
    /// A box.
    Block {
        /// Corner with the smallest coordinates, m.
        origin: Vec3,
        /// Edge lengths, m.
        size: Vec3,
        /// Cells along x, y and z.
        cells: [usize; 3],
        /// Whether a cell is 48 tetrahedra rather than six.
        forty_eight: bool,
        /// Layers from the top: region and share of the height.
        layers: Vec<(String, f64)>,
    },
}

/// What the `[skin]` table asks for.
#[derive(Debug, Clone, PartialEq)]
pub enum SkinSource {
    /// A surface file, relative to the scene.
    File(String),
    /// The skin of the synthetic head at this edge, m.
    Head {
        /// Edge, m.
        edge: f64,
    },
    /// The mesh's own skin, cut this many times.
    Subdivided(u32),
}

impl SceneFile {
    /// Where a fine skin comes from, if the scene has one.
    ///
    /// # Errors
    /// [`SceneError::Meaning`] for none or several sources, or values out of range.
    pub fn skin_source(&self, text: &str) -> Result<Option<SkinSource>, SceneError> {
        let text = Text(text);
        let Some(skin) = &self.skin else { return Ok(None) };
        Ok(Some(match skin.get_ref() {
            SkinSpec { file: Some(file), edge: None, subdivisions: None } => SkinSource::File(file.clone()),
            SkinSpec { file: None, edge: Some(edge), subdivisions: None } => {
                if self.mesh.get_ref().head.is_none() {
                    let message = "`edge` of [skin] is for the synthetic head: it wants [mesh.head]".to_owned();
                    return Err(text.at(edge.span().start, message));
                }
                SkinSource::Head { edge: text.checked("skin", "edge", edge)? }
            }
            SkinSpec { file: None, edge: None, subdivisions: Some(times) } => {
                let n = *times.get_ref();
                if !find("skin", "subdivisions").range.holds(f64::from(n)) {
                    return Err(text.out_of_range("skin", "subdivisions", times, &n));
                }
                SkinSource::Subdivided(n)
            }
            _ => {
                let message = "[skin] needs exactly one of `file`, `edge`, `subdivisions`".to_owned();
                return Err(text.at(skin.span().start, message));
            }
        }))
    }

    /// Where the mesh comes from.
    ///
    /// # Errors
    /// [`SceneError::Meaning`] for none or several sources, or values out of range.
    pub fn mesh_source(&self, text: &str) -> Result<MeshSource, SceneError> {
        let text = Text(text);
        match self.mesh.get_ref() {
            MeshSpec { file: Some(file), head: None, block: None, .. } => Ok(MeshSource::File(file.clone())),
            MeshSpec { file: None, head: Some(head), block: None, .. } => {
                Ok(MeshSource::Head { edge: text.number("mesh.head", "edge", &head.edge)? })
            }
            MeshSpec { file: None, head: None, block: Some(block), .. } => {
                let size = text.vector("mesh.block", "size", &block.size)?;
                if let Some(n) = block.cells.get_ref().iter().find(|n| **n < 1) {
                    return Err(text.out_of_range("mesh.block", "cells", &block.cells, n));
                }
                Ok(MeshSource::Block {
                    origin: text.triple("mesh.block", "origin", &block.origin)?.unwrap_or_default().into(),
                    size,
                    cells: *block.cells.get_ref(),
                    forty_eight: text.choice("mesh.block", "pattern", &block.pattern)? == Some("forty-eight"),
                    layers: block.layers.clone(),
                })
            }
            _ => Err(text.at(self.mesh.span().start, "[mesh] needs exactly one of `file`, `head`, `block`".into())),
        }
    }
}
