//! What `[inertia] modes` wants of a scene: forces that are linear in motions and inputs, and damping that keeps the modes apart.

use super::SceneError;
use super::build::Builder;
use super::file::{InertiaSpec, SceneFile};
use crate::fem::Term;
use crate::mesh::TetMesh;
use crate::sim::{Bone, Drive, Reduction};

impl Builder<'_> {
    /// The modes that a scene asks for; its terms are all there, `n_history` is the length of what they remember.
    pub(super) fn reduction(
        &self,
        spec: &InertiaSpec,
        file: &SceneFile,
        mesh: &TetMesh,
        bones: &[Bone],
        terms: &[Box<dyn Term>],
        n_history: usize,
    ) -> Result<Option<Reduction>, SceneError> {
        let Some(modes) = &spec.modes else { return Ok(None) };
        let refused = |found: String| {
            let message =
                format!("`modes` of [inertia] want a scene whose forces are linear in motions and inputs; {found}");
            Err(self.text.at(modes.span().start, message))
        };
        if let Some(contact) = file.contact.first() {
            return refused(format!("found contact `{}`, which pushes on one side only", contact.name.get_ref()));
        }
        if let Some(term) = terms.iter().find(|t| !t.is_quadratic()) {
            return refused(format!(
                "found `{}`: give the tissue energy = \"linear\", or leave `modes` out",
                term.name()
            ));
        }
        if let Some(muscle) = file.muscle.first() {
            return refused(format!("found muscle `{}`, whose force follows the tissue", muscle.name.get_ref()));
        }
        if let Some(pressure) = file.pressure.first() {
            return refused(format!("found pressure `{}`, which follows the surface", pressure.name.get_ref()));
        }
        if let Some(bone) = bones.iter().find(|b| b.drive == Drive::Force) {
            return refused(format!(
                "found bone `{}`, which is {}: hold it or drive it by pose",
                bone.name, bone.drive
            ));
        }
        if n_history > 0 {
            return refused("found tissue with a memory: leave `viscous` out, or `modes`".to_owned());
        }
        let damping_stiffness =
            self.text.number("inertia", "damping_stiffness", &spec.damping_stiffness)?.unwrap_or(0.0);
        let undamped = |t: &&super::file::TissueSpec| {
            t.tension.is_some() || t.pressure.as_ref().is_some_and(|p| p.get_ref() == "nodal")
        };
        if let (true, Some(_)) = (damping_stiffness > 0.0, file.tissue.iter().find(undamped)) {
            return refused(
                "`damping_stiffness` would mix the modes: it damps neither `tension` nor pressure = \"nodal\"; take \
                 `damping_mass`"
                    .to_owned(),
            );
        }
        if let Some(accuracy) = &spec.accuracy {
            let message = "`accuracy` of [inertia] cuts steps of the full dynamics; steps in `modes` cost so little that \
                           shorter ones do the same";
            return Err(self.text.at(accuracy.span().start, message.to_owned()));
        }
        let held: usize = bones.iter().map(|b| b.nodes.len()).sum();
        let (found, unknowns) = (*modes.get_ref() as usize, 3 * (mesh.nodes.len() - held));
        if !(1..=unknowns).contains(&found) {
            let message =
                format!("`modes` of [inertia] is {found}; the scene has {unknowns} unknowns: wanted 1 to {unknowns}");
            return Err(self.text.at(modes.span().start, message));
        }
        Ok(Some(Reduction { modes: found, damping_stiffness }))
    }
}
