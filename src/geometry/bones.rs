//! Which bone a bone voxel belongs to, from labels; what they leave open is grown from them, densest first.

use super::anatomy::watershed;
use super::{Labels, Volume};

/// Names of the bones that a bake knows, numbered from 1 in a bone map.
pub const BONES: [&str; 4] = ["skull", "mandible", "spine", "hyoid"];
/// Their numbers in a labels file.
pub(super) const LABELS: [u8; 4] = [2, 3, 4, 6];
pub(super) const SKULL: u8 = 1;
pub(super) const MANDIBLE: u8 = 2;
pub(super) const SPINE: u8 = 3;
pub(super) const HYOID: u8 = 4;

/// The bone that a label stands for, 0 if it is none.
pub(super) fn bone_of(label: u8) -> u8 {
    LABELS.iter().zip(SKULL..).find(|(l, _)| **l == label).map_or(0, |(_, bone)| bone)
}

/// Bone number of each sample (0 where there is none), and whether skull and mandible are told apart. Without labels all
/// bone is skull.
pub(super) fn bone_map(volume: &Volume, bone: f64, labels: Option<&Labels>) -> (Vec<u8>, bool) {
    let grid = &volume.grid;
    let is_bone = |at: usize| f64::from(volume.samples[at]) >= bone;
    let of = |at: usize| labels.map_or(SKULL, |labels| bone_of(labels.at(&grid.place(at))));
    let mut map: Vec<u8> = (0..grid.len()).map(|at| if is_bone(at) { of(at) } else { 0 }).collect();
    let told = map.contains(&SKULL) && map.contains(&MANDIBLE);
    watershed(grid, |at| volume.samples[at], is_bone, &mut map);
    // Bone that no label reached belongs to the skull: loose teeth, cartilage, streaks.
    (0..map.len()).filter(|&at| is_bone(at)).for_each(|at| map[at] = map[at].max(SKULL));
    (map, told)
}
