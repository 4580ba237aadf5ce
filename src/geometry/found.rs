//! What of the anatomy a bake may rely on, and what it must tell.

use super::anatomy::{About, Anatomy, Check, anatomy};
use super::bones::BONES;
use super::warning::Warning;
use super::{BakeOptions, Labels, MeshingError, Volume};
use crate::math::Vec3;

/// What is known of bones and hinge, and what is doubtful in it.
pub(super) struct Found {
    pub labels: Option<Labels>,
    /// Whether the labels are to be used.
    pub trusted: bool,
    pub checks: Vec<Check>,
    pub condyles: Option<[Vec3; 2]>,
    /// Right and left corner of the mouth.
    pub commissures: Option<[Vec3; 2]>,
    pub nose: Option<Vec3>,
    pub warnings: Vec<Warning>,
}

impl Found {
    /// Labels given are kept, whatever the checks say of them; labels found are dropped if one fails.
    pub fn of(volume: &Volume, labels: Option<&Labels>, options: &BakeOptions) -> Result<Self, MeshingError> {
        seeds_on_bone(volume, labels.is_some(), options)?;
        let found = anatomy(volume, labels, [options.skin_hu, options.bone_hu], &options.hints);
        let failed = |about| found.iter().flat_map(move |a| a.doubts(about)).cloned();
        let doubts: Vec<Check> = failed(About::Bones).chain(failed(About::Hinge)).collect();
        if options.strict && !(found.is_some() && doubts.is_empty()) {
            return Err(MeshingError::Doubtful { checks: doubts });
        }
        let given = labels.is_some() || options.hints.part_jaws();
        let bones = failed(About::Bones).next().is_none();
        let hinge = (given || bones) && failed(About::Hinge).next().is_none();
        let mut warnings: Vec<Warning> = failed(About::Bones).map(|check| Warning::Bones { check, given }).collect();
        let found_condyles = match &found {
            Some(Anatomy { condyles: [Some(right), Some(left)], .. }) if hinge => Some([*right, *left]),
            _ => None,
        };
        let condyles = options.hints.hinge.or(found_condyles);
        if condyles.is_none() && found.is_some() && (given || bones) {
            warnings.extend(failed(About::Hinge).map(|check| Warning::Hinge { check }));
        }
        if bones {
            warnings.extend(failed(About::Bite).map(|check| Warning::Bite { check }));
        }
        let believed = found.as_ref().filter(|_| given || bones);
        let mouth_seen = failed(About::Mouth).next().is_none();
        let seen = believed.filter(|_| mouth_seen).map(|a| a.lips.commissures());
        let commissures = options.hints.commissures.or(seen);
        if commissures.is_none() && believed.is_some() && options.slit && options.mouth.is_none() {
            warnings.extend(failed(About::Mouth).map(|check| Warning::Mouth { check }));
        }
        let nose = believed.and_then(|a| a.nose);
        let checks = found.as_ref().map_or(Vec::new(), |a| a.checks.clone());
        let labels = labels.cloned().or(found.map(|a| a.labels));
        Ok(Self { labels, trusted: given || bones, checks, condyles, commissures, nose, warnings })
    }
}

/// Refuses seeds that would do nothing.
fn seeds_on_bone(volume: &Volume, labelled: bool, options: &BakeOptions) -> Result<(), MeshingError> {
    /// Bone is looked for this far from a seed, in steps of this, m.
    const REACH: (i32, f64) = (3, 1e-3);
    for (bone, place) in &options.hints.seeds {
        let steps = || (-REACH.0..=REACH.0).map(|k| f64::from(k) * REACH.1);
        let around = || steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| Vec3::new(x, y, z))));
        let [low, high] = volume.grid.bounds();
        let inside = (0..3).all(|a| (low[a]..=high[a]).contains(&place[a]));
        let on_bone = || around().any(|d| volume.sample(&(place + d)) >= options.bone_hu);
        let why = match () {
            () if !BONES.contains(&bone.as_str()) => "known are `skull`, `mandible`, `spine` and `hyoid`",
            () if labelled => "labels are given: mend them instead",
            () if !inside => "it lies outside of the scan",
            () if !on_bone() => "no bone is within 3 mm of it",
            () => continue,
        };
        return Err(MeshingError::Seed { bone: bone.clone(), place: (*place).into(), why });
    }
    Ok(())
}
