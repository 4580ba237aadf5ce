//! Loads: forces and pressures, and where they act.

use super::SceneError;
use super::build::Builder;
use super::file::{LoadSpec, PressureSpec};
use super::place::{area_shares, patch, volume_shares};
use crate::effect::{DeadLoad, Pressure};
use crate::mesh::{SKIN, TetMesh};

impl Builder<'_> {
    pub(super) fn load(&self, spec: &LoadSpec, mesh: &TetMesh, input: usize) -> Result<DeadLoad, SceneError> {
        let radius = self.text.number("load", "radius", &spec.radius)?;
        let shares = match (&spec.at, &spec.region) {
            (Some(at), None) => {
                let p = self.text.vector("load", "at", at)?;
                let skin = mesh.face_set(SKIN).map_or(&[][..], |s| &s.triangles);
                match radius {
                    Some(r) => {
                        let faces = patch(mesh, skin, &p, r);
                        if faces.is_empty() {
                            return Err(self
                                .text
                                .at(at.span().start, format!("no skin triangle lies within {r} m of this place")));
                        }
                        area_shares(mesh, &faces)
                    }
                    None => {
                        let distance = |a: &u32| (mesh.nodes[*a as usize] - p).norm_squared();
                        let nearest = mesh.skin_nodes().into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
                        vec![(nearest.ok_or_else(|| self.text.no_skin(&spec.name))?, 1.0)]
                    }
                }
            }
            (None, Some(region)) => {
                let r = mesh.region_names.iter().position(|r| r == region.get_ref());
                let r =
                    r.ok_or_else(|| self.text.unknown("region", region, mesh.region_names.iter().map(String::as_str)))?;
                volume_shares(mesh, r as u32)
            }
            _ => {
                let message =
                    format!("load `{}` needs either `at` (with or without `radius`) or `region`", spec.name.get_ref());
                return Err(self.text.at(spec.name.span().start, message));
            }
        };
        Ok(DeadLoad { shares, input })
    }

    pub(super) fn pressure(&self, spec: &PressureSpec, mesh: &TetMesh, input: usize) -> Result<Pressure, SceneError> {
        let name = spec.faces.as_ref().map_or(SKIN, |f| f.get_ref());
        let set = mesh.face_set(name).ok_or_else(|| {
            let wanted = spec.faces.as_ref().unwrap_or(&spec.name);
            self.text.unknown("face set", wanted, mesh.face_sets.iter().map(|s| s.name.as_str()))
        })?;
        let radius = self.text.number("pressure", "radius", &spec.radius)?;
        let triangles = match (&spec.at, radius) {
            (Some(at), Some(r)) => patch(mesh, &set.triangles, &self.text.vector("pressure", "at", at)?, r),
            (None, None) => set.triangles.clone(),
            _ => {
                return Err(self
                    .text
                    .at(spec.name.span().start, "a patch of pressure needs both `at` and `radius`".into()));
            }
        };
        if triangles.is_empty() {
            return Err(self.text.at(
                spec.name.span().start,
                format!("pressure `{}` acts on no triangle of `{name}`", spec.name.get_ref()),
            ));
        }
        Ok(Pressure { triangles, input })
    }
}
