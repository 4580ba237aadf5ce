//! Values that mean something else than they say: degrees for radians, millimetres for metres, kilopascals for pascals.
//!
//! Nothing is refused here; a scene may mean what it says. Each is told in a plain sentence.

use super::build::Builder;
use super::file::{BoneSpec, SceneFile};
use super::programme::numbers;
use crate::math::{Vec3, extent};
use crate::mesh::TetMesh;
use crate::sim::Marker;

/// Young's modulus below which no tissue is, Pa.
const SOFTEST: f64 = 100.0;
/// Diagonals that a head, or a part of one, may have, m.
const SIZES: std::ops::Range<f64> = 2e-3..3.0;
/// Distance of a marker from the skin beyond which it may be meant for another place, m.
const OFF_SKIN: f64 = 3e-3;

impl Builder<'_> {
    /// What of a scene on its mesh is beyond sense, one sentence each.
    pub(super) fn implausible(&self, file: &SceneFile, mesh: &TetMesh, markers: &[Marker], end: f64) -> Vec<String> {
        let mut told = Vec::new();
        let size = extent(&mesh.nodes);
        let moved = |what: String, values: &[f64], told: &mut Vec<String>| {
            let length = Vec3::from_column_slice(values).norm();
            if length > size {
                told.push(format!(
                    "{what} is {length} m long, more than the {size:.3} m that the tissue measures: metres are wanted"
                ));
            }
        };
        let turned = |what: String, values: &[f64], told: &mut Vec<String>| {
            let angle = Vec3::from_column_slice(values).norm();
            if angle > std::f64::consts::TAU {
                told.push(format!("{what} is {angle:.3} rad, more than a full turn: radians are wanted, not degrees"));
            }
        };
        for BoneSpec { name, translation, rotation, .. } in &file.bone {
            let name = name.get_ref();
            if let Some(t) = translation {
                moved(format!("`translation` of bone `{name}`"), t.get_ref(), &mut told);
            }
            if let Some(w) = rotation {
                turned(format!("`rotation` of bone `{name}`"), w.get_ref(), &mut told);
            }
        }
        for frame in &file.keyframe {
            let (t, port) = (*frame.t.get_ref(), frame.port.get_ref().as_str());
            let row = frame.row.as_ref().map_or(String::new(), |row| format!(" of `{}`", row.get_ref()));
            let what = format!("the keyframe of `{port}`{row} at t = {t} s");
            for values in numbers(frame.value.get_ref()).unwrap_or_default().chunks_exact(3) {
                match port {
                    "bone.translation" => moved(what.clone(), values, &mut told),
                    "bone.rotation" => turned(what.clone(), values, &mut told),
                    port if port.ends_with(".displacement") => moved(what.clone(), values, &mut told),
                    _ => {}
                }
            }
            if t > end {
                told.push(format!("{what} lies after the end of [run], {end} s: it counts only for the way there"));
            }
        }
        for E in file.tissue.iter().filter_map(|tissue| tissue.E.as_ref()) {
            if let Some(E) = E.get_ref().values().into_iter().find(|E| *E > 0.0 && *E < SOFTEST) {
                told.push(format!("a tissue has E = {E} Pa, softer than any: pascals are wanted, not kilopascals"));
            }
        }
        for marker in markers.iter().filter(|marker| marker.off > OFF_SKIN) {
            told.push(format!(
                "marker `{}` lies {:.1} mm from the skin: the nearest point of the skin is read in its place",
                marker.name,
                1e3 * marker.off
            ));
        }
        // Mesh files are told of where they are read.
        if file.mesh.get_ref().file.is_none() && !SIZES.contains(&size) {
            told.push(format!("the tissue measures {size} m from corner to corner, no head's size: metres are wanted"));
        }
        // A block has sets for all its sides; nobody holds them all.
        if file.mesh.get_ref().block.is_none() {
            let held = |name: &str| file.bone.iter().any(|b| b.nodes.as_ref().unwrap_or(&b.name).get_ref() == name);
            for set in mesh.node_sets.iter().filter(|set| !held(&set.name)) {
                told.push(format!(
                    "no [[bone]] takes the node set `{}` of the mesh: its {} nodes are free",
                    set.name,
                    set.nodes.len()
                ));
            }
        }
        told
    }
}
