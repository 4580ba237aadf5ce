//! Where the mandible lies: the template fitted to bone, from many poses and sizes, then by its eleven numbers.
//!
//! ```text
//! score = mean of f over the core - SHELL mean of f over the shell,   f = bone, blurred
//! ```

use super::cma::{Search, minimise};
use super::cubes::Cubes;
use super::median::Median;
use super::template::{HEAD, PARAMETERS, Part, Placed, core, shell};
use crate::math::{Mat3, Vec3, exp_rotation};

/// Hounsfield units from nothing to all of bone.
const BONE: [f32; 2] = [120.0, 420.0];
/// Blurs of the bone for the coarse and the fine fit, mm.
const BLUR: [f64; 2] = [3.5, 1.6];
/// What a point of ramus or condyle beyond the field counts: with nothing the template slides in from its end.
const UNSEEN: f64 = 0.35;
/// Weight of bone where none should be.
const SHELL: f64 = 1.1;
/// Pitches tried: most degrees and their step.
const PITCH: (i32, usize) = (48, 8);
/// Sizes tried. With fewer the fit ends in a jaw of another size, its hinge 15 mm off.
const SIZES: [f64; 4] = [0.8, 0.92, 1.04, 1.17];
/// Places tried in the median plane about the bone's middle: half the range and step, mm.
const PLACES: (i32, usize) = (140, 7);
/// Below this share of the core on bone a place is not looked at further.
const LEAST: f64 = 0.2;
/// Best places of each pitch and size that are gathered; places that are fitted; fits that are refined.
const GATHERED: usize = 12;
const FITTED: usize = 8;
const REFINED: usize = 3;
/// Places nearer than this (mm) with pitches nearer than this (rad) are one.
const APART: (f64, f64) = (9.0, 0.2);
/// One standard deviation of each number at the start of a search.
const SPREAD: [f64; PARAMETERS] = [6.0, 6.0, 6.0, 0.08, 0.08, 0.12, 0.05, 0.07, 0.07, 0.1, 0.08];
const COARSE: (f64, Search) = (0.6, Search { points: 16, generations: 30 });
const FINE: (f64, Search) = (0.35, Search { points: 16, generations: 50 });
/// How jaws vary: common size (log), deviations of the three sizes from it, bend and narrowing; roll and yaw off the median plane, rad.
const COMMON: f64 = 0.16;
const DEVIATION: [f64; 3] = [0.06, 0.08, 0.05];
const SHAPE: [f64; 2] = [0.10, 0.08];
const SKEW: f64 = 0.12;
/// Weights of what is usual against the score.
const PRIOR: f64 = 0.006;
const SKEWED: f64 = 0.004;
/// How near a hinge that was given binds the condyles, mm, and its weight.
const HINGE: (f64, f64) = (4.0, 0.02);

/// What a fit looks at.
pub(super) struct Sought<'a> {
    /// Hounsfield units on cubes.
    pub hu: &'a Cubes,
    /// Where bone counts.
    pub body: &'a [bool],
    /// Left, back and up in the frame of the cubes.
    pub axes: Mat3,
    /// Right and left condyle, if they are given.
    pub hinge: Option<[Vec3; 2]>,
}

/// The template in its place, and its score.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fit {
    pub placed: Placed,
    pub score: f64,
}

/// The best fit. Where no place has bone as a mandible has it, the template in the middle of the bone and its poor score.
pub(super) fn fit(sought: &Sought, median: &Median) -> Fit {
    let bone = |(&v, &b): (&f32, &bool)| if b { ((v - BONE[0]) / (BONE[1] - BONE[0])).clamp(0.0, 1.0) } else { 0.0 };
    let bone = sought.hu.with(sought.hu.values.iter().zip(sought.body).map(bone).collect());
    let shape = Shape { core: core([16, 5, 9, 5]), shell: shell(), hinge: sought.hinge };
    let blurred = bone.blurred(BLUR[0]);
    let mut coarse: Vec<Fit> = shape
        .starts(&blurred, sought, median)
        .into_iter()
        .map(|start| shape.refined(&blurred, &start, &COARSE))
        .collect();
    coarse.sort_by(|a, b| b.score.total_cmp(&a.score));
    let blurred = bone.blurred(BLUR[1]);
    let fine = coarse.into_iter().take(REFINED).map(|f| shape.refined(&blurred, &f.placed, &FINE));
    fine.max_by(|a, b| a.score.total_cmp(&b.score)).unwrap_or_else(|| {
        let placed = Placed::new(sought.axes, median.centre, [0.0; PARAMETERS]);
        Fit { score: shape.score(&blurred, &placed), placed }
    })
}

/// The points that are fitted.
struct Shape {
    core: Vec<(Vec3, Part)>,
    shell: Vec<Vec3>,
    hinge: Option<[Vec3; 2]>,
}

impl Shape {
    /// The most promising places, no two of them alike.
    fn starts(&self, field: &Cubes, sought: &Sought, median: &Median) -> Vec<Placed> {
        let n = median.normal;
        let up = sought.axes.column(2).into_owned();
        let up = (up - up.dot(&n) * n).normalize();
        let axes = Mat3::from_columns(&[n, up.cross(&n), up]);
        let origin = median.centre - (median.centre.dot(&n) - median.offset) * n;
        let range = || (-PLACES.0..=PLACES.0).step_by(PLACES.1).map(f64::from);
        let on_plane = |y: f64, z: f64| origin + axes.column(1) * y + axes.column(2) * z;
        let places: Vec<Vec3> = match self.hinge {
            Some([right, left]) => vec![0.5 * (right + left)],
            None => range()
                .flat_map(|y| range().map(move |z| (y, z)))
                .map(|(y, z)| on_plane(y, z))
                .filter(|p| field.inside_by(p) > 0.0)
                .collect(),
        };
        let mut found: Vec<(f64, f64, f64, Vec3)> = Vec::new();
        for pitch in (-PITCH.0..=PITCH.0).step_by(PITCH.1).map(|d| f64::from(d).to_radians()) {
            let turned = axes * exp_rotation(&Vec3::new(pitch, 0.0, 0.0));
            for size in SIZES {
                let core: Vec<(Vec3, f64)> =
                    self.core.iter().step_by(3).map(|(p, part)| (turned * p * size, part.weight())).collect();
                let shell: Vec<Vec3> = self.shell.iter().step_by(2).map(|p| turned * p * size).collect();
                let mass: f64 = core.iter().map(|c| c.1).sum();
                let score = |t: &Vec3| {
                    let on = core.iter().map(|(p, w)| w * field.sample(&(p + t)).unwrap_or(0.0)).sum::<f64>() / mass;
                    (on > LEAST).then(|| {
                        let off: f64 = shell.iter().filter_map(|p| field.sample(&(p + t))).sum();
                        on - SHELL * off / shell.len() as f64
                    })
                };
                let mut scores: Vec<_> = places.iter().filter_map(|t| score(t).map(|s| (s, pitch, size, *t))).collect();
                scores.sort_by(|a, b| b.0.total_cmp(&a.0));
                found.extend(scores.into_iter().take(GATHERED));
            }
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut kept: Vec<(f64, f64, f64, Vec3)> = Vec::new();
        for f in found {
            let alone = |k: &(f64, f64, f64, Vec3)| (f.3 - k.3).norm() > APART.0 || (f.1 - k.1).abs() > APART.1;
            if kept.len() < FITTED && kept.iter().all(alone) {
                kept.push(f);
            }
        }
        let placed = |(_, pitch, size, at): (f64, f64, f64, Vec3)| {
            let mut p = [0.0; PARAMETERS];
            p[6..9].fill(size.ln());
            Placed::new(axes * exp_rotation(&Vec3::new(pitch, 0.0, 0.0)), at, p)
        };
        kept.into_iter().map(placed).collect()
    }

    fn refined(&self, field: &Cubes, start: &Placed, (share, search): &(f64, Search)) -> Fit {
        let at = |p: &[f64; PARAMETERS]| Placed::new(start.axes, start.origin, *p);
        let spread = SPREAD.map(|s| s * share);
        let (p, value) = minimise(|p| -self.score(field, &at(p)), &start.p, &spread, search);
        Fit { placed: at(&p), score: -value }
    }

    fn score(&self, field: &Cubes, placed: &Placed) -> f64 {
        let (mut on, mut mass) = (0.0, 0.0);
        for (x, part) in &self.core {
            // What lies over the end of the scan is not known; what is below is a jaw without its chin.
            let beyond = if *part == Part::Body { 0.0 } else { UNSEEN };
            on += part.weight() * field.sample(&placed.place(x)).unwrap_or(beyond);
            mass += part.weight();
        }
        let off: f64 = self.shell.iter().filter_map(|x| field.sample(&placed.place(x))).sum();
        let p = &placed.p;
        let common = (p[6] + p[7] + p[8]) / 3.0;
        let squares = |values: &[f64], middle: f64, spread: &[f64]| {
            values.iter().zip(spread).map(|(v, s)| ((v - middle) / s).powi(2)).sum::<f64>()
        };
        let unusual = squares(&p[6..9], common, &DEVIATION) + squares(&p[9..], 0.0, &SHAPE) + (common / COMMON).powi(2);
        let skew = squares(&p[4..6], 0.0, &[SKEW; 2]);
        let off_hinge = self.hinge.map_or(0.0, |[right, left]| {
            let of = |side: f64, given: Vec3| {
                let head = Vec3::new(side * HEAD[0], HEAD[1], HEAD[2]);
                (placed.place(&head) - given).norm_squared() / HINGE.0.powi(2)
            };
            of(-1.0, right) + of(1.0, left)
        });
        on / mass - SHELL * off / self.shell.len() as f64 - PRIOR * unusual - SKEWED * skew - HINGE.1 * off_hinge
    }
}
