//! The mass-spring model as a choice of `[[tissue]] energy`: it is no law of F, so it stands outside their catalogue.

use super::SceneError;
use super::build::Builder;
use super::file::TissueSpec;
use super::keys::find;

/// Name of the model.
pub(super) const NAME: &str = "mass-spring";

impl Builder<'_> {
    /// Young's modulus (Pa) of a tissue made of springs; nothing for any other.
    pub(super) fn springs(&self, spec: &TissueSpec, is_linear: bool) -> Result<Option<f64>, SceneError> {
        let Some(energy) = spec.energy.as_ref().filter(|e| e.get_ref() == NAME) else { return Ok(None) };
        let refuse = |at: usize, why: &str| Err(self.text.at(at, format!("`{NAME}` {why}")));
        if let Some((key, Some(value))) = spec.constants().into_iter().find(|(key, v)| *key != "E" && v.is_some()) {
            return refuse(value.span().start, &format!("takes `E` alone, not `{key}`"));
        }
        if let Some(viscous) = &spec.viscous {
            return refuse(viscous.g.span().start, "has no viscous part");
        }
        let TissueSpec { pressure, fibre, damage, grade, limit, tension, .. } = spec;
        let tables = [fibre.is_some(), damage.is_some(), grade.is_some(), limit.is_some(), tension.is_some()];
        if pressure.is_some() || tables.contains(&true) {
            return refuse(
                energy.span().start,
                "is springs alone: no fibre, damage, grade, limit, tension or pressure",
            );
        }
        if !is_linear {
            return refuse(energy.span().start, "joins the corners of tetrahedra: it wants [mesh] order = 1");
        }
        let Some(E) = &spec.E else { return refuse(energy.span().start, "takes `E`, which is missing") };
        match E.get_ref().values()[..] {
            [value] if find("tissue", "E").range.holds(value) => Ok(Some(value)),
            [value] => Err(self.text.out_of_range("tissue", "E", E, &value)),
            _ => refuse(E.span().start, "takes one `E`"),
        }
    }
}
