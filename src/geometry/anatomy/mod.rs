//! The anatomy of a head that nobody has labelled: its bones, its jaw's hinge, the seam between its teeth, and checks that
//! say whether to believe them.
//!
//! ```text
//! body without table and mask -> median plane -> template of the mandible, fitted -> seam along the arch of the teeth
//!     -> markers -> watershed -> condyles -> checks
//! ```
//!
//! In this folder lengths are millimetres along the axes of the scan, as its sources have them; metres and the patient's
//! axes end and begin in this file. What no check believes is not handed on.

mod checks;
mod cma;
mod condyles;
mod cubes;
mod fit;
mod flood;
mod lips;
mod median;
mod seam;
mod split;
mod template;

pub use checks::{About, Check};
pub(super) use flood::watershed;
pub use lips::Lips;

use super::bones::{BONES, LABELS, MANDIBLE, SKULL, bone_of};
use super::{Labels, Volume};
use crate::math::Vec3;
use checks::Checked;
use cubes::Cubes;
use lips::Face;
use seam::Seam;
use split::LOOSE;

/// Edge of the cubes that the template is fitted on, and of those that bone is split on, mm.
const FITTED_ON: f64 = 2.0;
const SPLIT_ON: f64 = 1.5;
/// What hangs on the head by less than twice this is not of it, mm; for the face less, or the hollow nose is lost.
const BODY: f64 = 4.0;
const FACE: f64 = 1.5;
/// Label of soft tissue.
const SOFT: u8 = 1;

/// What a user knows of a head and the scan does not show; places in LPS metres.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Hints {
    /// Right and left condyle: the line that the jaw opens about.
    pub hinge: Option<[Vec3; 2]>,
    /// A point of the surface where the teeth meet, and its normal.
    pub occlusal: Option<[Vec3; 2]>,
    /// Right and left corner of the mouth.
    pub commissures: Option<[Vec3; 2]>,
    /// Places of a bone, by its name: bone within 3 mm of one is that bone's. With places of both skull and mandible the
    /// bones are believed whatever the checks say, and where no mandible's shape is found they alone tell the bones apart.
    pub seeds: Vec<(String, Vec3)>,
}

impl Hints {
    /// Whether the seeds are enough to tell the jaw apart.
    pub(super) fn part_jaws(&self) -> bool {
        ["skull", "mandible"].iter().all(|bone| self.seeds.iter().any(|s| s.0 == *bone))
    }
}

/// What was found in a head.
#[derive(Debug, Clone, PartialEq)]
pub struct Anatomy {
    /// Labels of the upright scan: 0 outside, 1 soft tissue, and the bones' numbers.
    pub labels: Labels,
    /// Figures of the split and what they should be.
    pub checks: Vec<Check>,
    /// Right and left condyle, LPS, m, whether or not their checks hold.
    pub condyles: [Option<Vec3>; 2],
    /// Where the lips meet, whether or not its checks hold.
    pub lips: Lips,
    /// Tip of the nose, LPS, m, if it is in the scan.
    pub nose: Option<Vec3>,
}

impl Anatomy {
    /// The checks of bones or hinge that fail.
    pub fn doubts(&self, about: About) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(move |c| c.about == about && !c.holds())
    }
}

/// Finds the anatomy of an upright scan by the thresholds of skin and bone, HU; with `labels` it is theirs, and only the
/// hinge and the checks are found. None where there is no bone.
pub fn anatomy(volume: &Volume, labels: Option<&Labels>, [skin, bone]: [f64; 2], hints: &Hints) -> Option<Anatomy> {
    let grid = &volume.grid;
    let world = |p: &Vec3| grid.origin + grid.direction * p * 1e-3;
    let local = |p: &Vec3| grid.direction.transpose() * (p - grid.origin) * 1e3;
    let axes = grid.direction.transpose();
    let coarse = Cubes::of(volume, FITTED_ON);
    let body = coarse.body(skin, BODY);
    let median = median::median(&coarse, &body, &axes)?;
    let given = |cubes: &Cubes, at: usize| labels.map_or(0, |l| bone_of(l.at(&world(&cubes.place(at)))));
    // Where the jaw is known nothing else is bone to the template.
    let jaw: Option<Vec<bool>> = labels.map(|_| (0..body.len()).map(|at| given(&coarse, at) == MANDIBLE).collect());
    let hinge = hints.hinge.map(|h| h.map(|p| local(&p)));
    let sought = fit::Sought { hu: &coarse, body: jaw.as_ref().unwrap_or(&body), axes, hinge };
    let fit = fit::fit(&sought, &median);
    let hu = Cubes::of(volume, SPLIT_ON);
    let finer = |body: &[bool]| -> Vec<bool> {
        (0..hu.values.len()).map(|at| body[coarse.grid.index(coarse.grid.nearest(&hu.place(at)))]).collect()
    };
    let inside = finer(&body);
    let seam = match hints.occlusal {
        Some([point, normal]) => Seam::along(&fit.placed, &local(&point), &(axes * normal)),
        None => seam::seam(&hu, &fit.placed),
    };
    let number = |name: &str| BONES.iter().zip(SKULL..).find(|(b, _)| **b == name).map(|(_, k)| k);
    let seeds: Vec<_> = hints.seeds.iter().filter_map(|(name, p)| Some((number(name)?, local(p)))).collect();
    let split = match labels {
        Some(_) => split::labelled(&hu, bone, &fit.placed, &seam, |at| given(&hu, at)),
        None if hints.part_jaws() && fit.score < checks::LIKENESS => {
            split::seeded(&hu, &inside, bone, &fit.placed, &seam, &seeds)
        }
        None => split::split(&hu, &inside, bone, &fit.placed, &seam, &seeds),
    };
    let condyles = condyles::condyles(&hu, &split);
    let mut checks = Checked { hu: &hu, median: &median, fit: &fit, seam: &seam, split: &split, condyles }.checks();
    // Labels say themselves which tooth is whose.
    checks.retain(|c| labels.is_none() || c.about != About::Bite);
    let whole = finer(&coarse.body(skin, FACE));
    let face = Face::of(&hu, &whole, skin, &fit, &seam);
    let (line, of_mouth) = face.lips();
    checks.extend(of_mouth);
    let lips = Lips { line: line.iter().map(world).collect() };
    let nose = face.nose().as_ref().map(world);
    let labels = match labels {
        Some(labels) => labels.clone(),
        None => Labels { grid: grid.clone(), ids: on_scan(volume, &hu, &inside, &split.map, skin, bone) },
    };
    Some(Anatomy { labels, checks, condyles: condyles.map(|c| c.as_ref().map(world)), lips, nose })
}

/// Labels of the voxels: those inside a part of the cubes take its number, between parts the scan's own density decides.
fn on_scan(volume: &Volume, hu: &Cubes, inside: &[bool], map: &[u8], skin: f64, bone: f64) -> Vec<u8> {
    let sure: Vec<u8> = (0..map.len())
        .map(|at| {
            let mut alone = true;
            super::clean::each_neighbour(&hu.grid, at, |other| alone &= map[other] == 0 || map[other] == map[at]);
            if alone { map[at] } else { 0 }
        })
        .collect();
    let grid = &volume.grid;
    let dims = grid.dims;
    // Grids have the same axes: cubes are found axis by axis.
    let along = |a: usize| -> Vec<usize> {
        let to = grid.spacing[a] * 1e3 / hu.h;
        (0..dims[a]).map(|i| ((i as f64 * to).round() as usize).min(hu.grid.dims[a] - 1)).collect()
    };
    let [x, y, z] = [along(0), along(1), along(2)];
    let cube = |at: usize| hu.grid.index([x[at % dims[0]], y[at / dims[0] % dims[1]], z[at / (dims[0] * dims[1])]]);
    let is_bone = |at: usize| f64::from(volume.samples[at]) >= bone && inside[cube(at)];
    let mut marks: Vec<u8> = (0..grid.len()).map(|at| if is_bone(at) { sure[cube(at)] } else { 0 }).collect();
    watershed(grid, |at| volume.samples[at], is_bone, &mut marks);
    let label = |at: usize| match marks[at] {
        0 | LOOSE if f64::from(volume.samples[at]) >= skin && inside[cube(at)] => SOFT,
        0 | LOOSE => 0,
        k => LABELS[usize::from(k) - 1],
    };
    (0..grid.len()).map(label).collect()
}
