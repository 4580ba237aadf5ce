//! What the numbers of a labels file mean.

use std::collections::BTreeSet;
use std::path::Path;
use std::str::FromStr;

use super::IoError;
use crate::geometry::{Grid, Labels};

/// Bones that labels tell apart, and their numbers in [`Labels`].
const BONES: [(&str, u8); 4] = [("skull", 2), ("mandible", 3), ("spine", 4), ("hyoid", 6)];
/// Numbers that are listed before the rest is only counted.
const LISTED: usize = 20;

/// Which numbers of a file stand for which bone; without entries they are those of [`Labels`] already.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LabelMap(Vec<(u32, u8)>);

impl FromStr for LabelMap {
    type Err = String;

    /// `skull=5,mandible=1`; a bone may be given several times.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut map = Vec::new();
        for entry in text.split(',') {
            let (name, number) = entry.split_once('=').ok_or_else(|| {
                format!("found `{entry}`, wanted a bone and its number in the file, such as `skull=5,mandible=1`")
            })?;
            let bone = BONES.iter().find(|(bone, _)| *bone == name.trim()).ok_or_else(|| {
                format!("unknown bone `{}`, expected {}", name.trim(), BONES.map(|(b, _)| format!("`{b}`")).join(", "))
            })?;
            let number: u32 = number
                .trim()
                .parse()
                .map_err(|_| format!("found `{}` for {}, wanted a number of the labels file", number.trim(), bone.0))?;
            if map.iter().any(|&(n, _)| n == number) {
                return Err(format!("number {number} is given twice"));
            }
            map.push((number, bone.1));
        }
        Ok(Self(map))
    }
}

impl LabelMap {
    /// Labels from the samples of a file.
    pub(super) fn labels(&self, path: &Path, grid: Grid, samples: &[f32]) -> Result<Labels, IoError> {
        let most = if self.0.is_empty() { f32::from(u8::MAX) } else { u32::MAX as f32 };
        let whole = |s: &f32| s.fract() == 0.0 && (0.0..=most).contains(s);
        if let Some(k) = samples.iter().position(|s| !whole(s)) {
            let wanted = if self.0.is_empty() {
                "label numbers 0..255 (2 skull, 3 mandible, 4 spine, 6 hyoid; other numbers with `--labels-map`)"
            } else {
                "whole label numbers"
            };
            return Err(IoError::format(path, format!("voxel {k}"), samples[k].to_string(), wanted));
        }
        if self.0.is_empty() {
            return Ok(Labels { grid, ids: samples.iter().map(|&s| s as u8).collect() });
        }
        let found: BTreeSet<u32> = samples.iter().map(|&s| s as u32).collect();
        if let Some((number, bone)) = self.0.iter().find(|(n, _)| !found.contains(n)) {
            let name = BONES.iter().find(|(_, b)| b == bone).map_or("", |(name, _)| name);
            let found = format!("the numbers {}", list(&found));
            return Err(IoError::format(path, "the labels", found, &format!("{number}, which stands for {name}")));
        }
        let of = |s: &f32| self.0.iter().find(|(n, _)| *n == *s as u32).map_or(0, |(_, bone)| *bone);
        Ok(Labels { grid, ids: samples.iter().map(of).collect() })
    }
}

fn list(found: &BTreeSet<u32>) -> String {
    let mut words: Vec<String> = found.iter().take(LISTED).map(u32::to_string).collect();
    if found.len() > LISTED {
        words.push(format!("and {} more", found.len() - LISTED));
    }
    words.join(", ")
}
