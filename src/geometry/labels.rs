//! Whether labels are of this scan, and what they lack.

use std::collections::BTreeSet;

use super::bones::{BONES, LABELS};
use super::warning::Warning;
use super::{Cuboid, Labels, MeshingError, Volume};

/// Labels lie on bone where at least this share of them does; marrow and soft rims do not.
const ON_BONE: f64 = 0.3;
/// Numbers that are listed before the rest is only counted.
const LISTED: usize = 20;

/// What to beware of in labels.
///
/// # Errors
/// [`MeshingError::Labels`] if they lie elsewhere, [`MeshingError::LabelNumbers`] if none of them is a bone.
pub(super) fn usable(
    labels: &Labels,
    volume: &Volume,
    bone: f64,
    region: &Cuboid,
) -> Result<Vec<Warning>, MeshingError> {
    let found: BTreeSet<u8> = labels.ids.iter().copied().collect();
    if !LABELS.iter().any(|l| found.contains(l)) {
        return Err(MeshingError::LabelNumbers { found: list(&found) });
    }
    let half = 0.5 * labels.grid.spacing.max();
    let [low, high] = labels.grid.bounds();
    if (0..3).any(|a| low[a] - half > region.high[a] || high[a] + half < region.low[a]) {
        return Err(MeshingError::Labels {
            region: [region.low.into(), region.high.into()],
            labels: [low.into(), high.into()],
        });
    }
    let mut warnings = Vec::new();
    let slack = 2.0 * labels.grid.spacing.max();
    if (0..3).any(|a| low[a] > region.low[a] + slack || high[a] < region.high[a] - slack) {
        warnings.push(Warning::LabelsCropped { labels: [low, high] });
    }
    // Without a label the spine counts as skull, as it does without labels.
    let movable = BONES.into_iter().zip(LABELS).take(2);
    warnings.extend(movable.filter(|(_, wanted)| !found.contains(wanted)).map(|(bone, wanted)| Warning::NoLabel {
        bone,
        wanted,
        found: list(&found),
    }));
    let grid = &labels.grid;
    let (mut on_bone, mut all) = (0usize, 0usize);
    for at in (0..grid.len()).filter(|&at| LABELS.contains(&labels.ids[at])) {
        all += 1;
        on_bone += usize::from(volume.sample(&grid.place(at)) >= bone);
    }
    let share = on_bone as f64 / all.max(1) as f64;
    if share < ON_BONE {
        warnings.push(Warning::LabelsOffBone { share });
    }
    Ok(warnings)
}

fn list(found: &BTreeSet<u8>) -> String {
    let mut words: Vec<String> = found.iter().take(LISTED).map(u8::to_string).collect();
    if found.len() > LISTED {
        words.push(format!("and {} more", found.len() - LISTED));
    }
    words.join(", ")
}
