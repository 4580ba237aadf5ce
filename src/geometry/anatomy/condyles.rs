//! The heads of a mandible, in the template's frame: what is highest behind and beside, on each side.

use super::super::bones::MANDIBLE;
use super::super::clean::{components, largest};
use super::cubes::Cubes;
use super::split::Split;
use crate::math::Vec3;

/// Condyles lie behind this and further than this from the median plane, template's y and x.
const BEHIND: f64 = -14.0;
const BESIDE: f64 = 25.0;
/// Height of a condyle's head, mm; the few highest cubes do not say where its top is.
const HEAD: f64 = 6.0;
const TOP: f64 = 0.995;
/// Fewer cubes than this are no condyle.
const LEAST: usize = 5;

/// Right and left condyle in the frame of the cubes; none where the mandible has nothing there.
pub(super) fn condyles(hu: &Cubes, split: &Split) -> [Option<Vec3>; 2] {
    [-1.0, 1.0].map(|side| {
        let mut at_side = vec![false; split.map.len()];
        let in_place = |x: &Vec3| side * x.x > BESIDE && x.y > BEHIND;
        let cubes = || split.cubes.iter().filter(|c| split.map[c.at] == MANDIBLE && in_place(&c.x));
        cubes().for_each(|c| at_side[c.at] = true);
        let (number, sizes) = components(&hu.grid, |at| at_side[at]);
        let largest = largest(&sizes)?;
        let piece = || cubes().filter(|c| number[c.at] as usize == largest + 1);
        let mut heights: Vec<f64> = piece().map(|c| c.x.z).collect();
        if heights.len() < LEAST {
            return None;
        }
        heights.sort_by(f64::total_cmp);
        let top = heights[(TOP * (heights.len() - 1) as f64) as usize];
        let (n, sum) = piece()
            .filter(|c| c.x.z > top - HEAD)
            .fold((0, Vec3::zeros()), |(n, sum), c| (n + 1, sum + hu.place(c.at)));
        Some(sum / f64::from(n))
    })
}
