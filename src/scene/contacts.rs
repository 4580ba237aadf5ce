//! Contacts: rigid shapes that bones carry, and the surfaces that they hold off.

use super::SceneError;
use super::bones::wants_no_nodes;
use super::build::Builder;
use super::file::{BoneSpec, ContactSpec, SceneFile};
use super::materials::small_strain;
use super::place::area;
use crate::effect::{Contact, Friction, Shape};
use crate::math::Vec3;
use crate::mesh::{SKIN, TetMesh};
use crate::sim::{Bone, Drive};

/// Pressure of a contact that goes as deep as an edge of the surface is long, in units of the stiffest tissue's modulus.
const STIFFNESS: f64 = 20.0;
/// Depth over which a contact sets in, in edges of the surface.
const ONSET: f64 = 0.02;
/// Radius below which tissue cannot follow a shape, in edges of the surface.
const SMALLEST: f64 = 1.0;
/// Size of the frame of a half-space, m; any will do.
const FRAME: f64 = 0.05;

impl Builder<'_> {
    /// The contacts of a scene, with their names and bones. Each adds four nodes to the mesh and to its bone, which move it.
    pub(super) fn contacts(
        &self,
        file: &SceneFile,
        mesh: &mut TetMesh,
        bones: &mut [Bone],
        n_history: &mut usize,
        warnings: &mut Vec<String>,
    ) -> Result<Vec<(String, usize, Contact)>, SceneError> {
        let names = self.text.names("contact", file.contact.iter().map(|c| &c.name))?;
        let mut contacts = Vec::new();
        for (name, spec) in names.into_iter().zip(&file.contact) {
            let (bone, mut contact) = self.contact(spec, file, mesh, bones, warnings)?;
            if let Some(mu) = self.text.number("contact", "friction", &spec.friction)?.filter(|mu| *mu > 0.0) {
                contact.friction = Some(Friction { mu, first: *n_history });
                *n_history += Contact::memory(contact.triangles.len());
            }
            contacts.push((name, bone, contact));
        }
        let idle = |(spec, bone): &(&BoneSpec, &Bone)| bone.nodes.is_empty() && wants_no_nodes(spec);
        if let Some((spec, _)) = file.bone.iter().zip(&*bones).find(idle) {
            let name = spec.name.get_ref();
            let message = format!("no tissue sticks to bone `{name}` and no [[contact]] is its own: it moves nothing");
            return Err(self.text.at(spec.name.span().start, message));
        }
        Ok(contacts)
    }

    fn contact(
        &self,
        spec: &ContactSpec,
        file: &SceneFile,
        mesh: &mut TetMesh,
        bones: &mut [Bone],
        warnings: &mut Vec<String>,
    ) -> Result<(usize, Contact), SceneError> {
        let at = spec.name.span().start;
        let shape = self.shape(spec)?;
        let faces = spec.faces.as_ref().map_or(SKIN, |f| f.get_ref());
        let set = mesh.face_set(faces).ok_or_else(|| match &spec.faces {
            Some(faces) => self.text.unknown("face set", faces, mesh.face_sets.iter().map(|s| s.name.as_str())),
            None => self.text.no_skin(&spec.name),
        })?;
        let held = |a: u32| bones.iter().any(|b| b.nodes.binary_search(&a).is_ok());
        let all: Vec<([u32; 3], f64)> = set.triangles.iter().map(|t| (*t, area(mesh, t))).collect();
        let whole: f64 = all.iter().map(|(_, area)| area).sum();
        let triangles: Vec<([u32; 3], f64)> =
            all.iter().filter(|(t, _)| !t.iter().all(|&a| held(a))).copied().collect();
        if triangles.is_empty() {
            let message = format!("contact `{}` can touch no part of `{faces}` that is free", spec.name.get_ref());
            return Err(self.text.at(at, message));
        }
        // Of the equilateral triangle of mean area.
        let edge = (whole / all.len() as f64 * 4.0 / 3.0_f64.sqrt()).sqrt();
        if shape.reach() < SMALLEST * edge {
            warnings.push(format!(
                "contact `{}` has a radius of {} m, and vertices of `{faces}` lie {edge:.4} m apart: the tissue cannot \
                 close around it; refine the mesh there, or take a larger radius",
                spec.name.get_ref(),
                shape.reach()
            ));
        }
        let stiffness = match self.text.number("contact", "stiffness", &spec.stiffness)? {
            Some(stiffness) => stiffness,
            None => STIFFNESS / edge * small_strain(self.text.0, file)?.iter().map(|t| t.E).fold(0.0, f64::max),
        };
        let bone = bones.iter().position(|b| b.name == *spec.bone.get_ref()).ok_or_else(|| {
            self.text.unknown("bone", &spec.bone, file.bone.iter().map(|b| b.name.get_ref().as_str()))
        })?;
        let carrier = &mut bones[bone];
        if carrier.drive == Drive::Displacement {
            let message = format!("bone `{}` is {}: a rigid shape wants one pose", carrier.name, carrier.drive);
            return Err(self.text.at(spec.bone.span().start, message));
        }
        if carrier.drive == Drive::Force && carrier.nodes.is_empty() {
            let message = format!(
                "bone `{}` is {} and no tissue sticks to it: nothing would hold it but contact; drive it by pose",
                carrier.name, carrier.drive
            );
            return Err(self.text.at(spec.bone.span().start, message));
        }
        let (middle, extent) = (shape.middle(), shape.extent());
        let size = if extent > 0.0 { extent } else { FRAME };
        let first = mesh.nodes.len() as u32;
        let frame = [0, 1, 2, 3].map(|i| first + i);
        mesh.nodes.extend(Contact::corners(middle, size));
        carrier.nodes.extend(frame);
        let onset = ONSET * edge;
        Ok((bone, Contact { shape, middle, frame, size, triangles, stiffness, onset, friction: None }))
    }

    fn shape(&self, spec: &ContactSpec) -> Result<Shape, SceneError> {
        let at = spec.name.span().start;
        let radius = self.text.number("contact", "radius", &spec.radius)?;
        match (&spec.path, radius, &spec.point, &spec.normal) {
            (Some(path), Some(radius), None, None) => {
                let points: Vec<Vec3> = path.get_ref().iter().map(|p| Vec3::from(*p)).collect();
                let finite = points.iter().all(|p| p.iter().all(|c| c.is_finite()));
                if points.is_empty() || !finite || points.windows(2).any(|ends| ends[0] == ends[1]) {
                    let message =
                        "`path` of [[contact]] wants points that are finite, at least one, and none twice in a row";
                    return Err(self.text.at(path.span().start, message.to_owned()));
                }
                Ok(Shape::Tube { path: points, radius })
            }
            (None, None, Some(point), Some(normal)) => {
                let n = self.text.vector("contact", "normal", normal)?;
                let point = self.text.vector("contact", "point", point)?;
                let Some(normal) = n.try_normalize(f64::MIN_POSITIVE) else {
                    return Err(self.text.at(normal.span().start, "`normal` of [[contact]] has no length".to_owned()));
                };
                Ok(Shape::HalfSpace { point, normal })
            }
            _ => {
                let message = format!(
                    "contact `{}` is either a tube, of `path` and `radius`, or a half-space, of `point` and `normal`",
                    spec.name.get_ref()
                );
                Err(self.text.at(at, message))
            }
        }
    }
}
