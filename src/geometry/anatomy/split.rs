//! Which bone a cube of bone belongs to: markers from the template and the seam, then a watershed between them.

use super::super::bones::{HYOID, MANDIBLE, SKULL, SPINE};
use super::super::clean::components;
use super::cubes::Cubes;
use super::flood::watershed;
use super::seam::Seam;
use super::template::{Part, Placed, core, crest};
use crate::math::{Vec3, bounds};

/// Bone that hangs on nothing: streaks of fillings, calcified cartilage.
pub(super) const LOOSE: u8 = 5;
/// Density above which the watershed sees no difference, HU: enamel and metal.
const DENSEST: f32 = 1600.0;
/// Distances from the template are not told apart beyond this, mm.
const REACH: f64 = 24.0;
/// Nearer to the template than this is mandible, mm: about the ramus, about the body.
const INNER: [f64; 2] = [3.0, 5.0];
/// Further from it than this is not, mm: above the seam, below it, after the flood.
const OUTER: [f64; 3] = [13.0, 17.0, 14.0];
/// Half the thickness of the layer about the seam that only the flood decides, mm.
const GAP: f64 = 2.0;
/// In front of this the seam parts the jaws: before the ramus, template's y.
pub(super) const FRONT: f64 = -34.0;
/// Mandible that the markers may take reaches up to here: at the coronoid, which is free all round, and behind the notch,
/// where the condyle's neck and head are the flood's; template's z, and the notch's y.
const TOP: [f64; 2] = [-4.0, -12.0];
const NOTCH: f64 = -16.0;
/// Volume of a hyoid, mm3; larger pieces are calcified cartilage, smaller ones splinters.
const HYOID_VOLUME: [f64; 2] = [500.0, 4000.0];

/// A place that the user says belongs to a bone, in the frame of the cubes; within `INNER` of it all bone does.
pub(super) type Seed = (u8, Vec3);
/// Markers nearer to a seed of another bone than this are dropped, mm.
const SEED_REACH: f64 = 8.0;

/// A cube of bone and where it lies.
pub(super) struct Cube {
    /// Place in memory.
    pub at: usize,
    /// In the template's frame.
    pub x: Vec3,
    /// Distance from the template, mm, at most [`REACH`]; crowns of lower teeth count by their distance from the arch.
    pub off: f64,
    /// Height over the seam, mm; not known where `off` is [`REACH`].
    pub over: f64,
    /// Whether the body of the mandible is what lies nearest.
    body: bool,
}

/// What a head's bone was split into.
pub(super) struct Split {
    /// Bone of each cube, 0 where there is none.
    pub map: Vec<u8>,
    /// The cubes of bone.
    pub cubes: Vec<Cube>,
}

/// Splits the cubes of at least `bone` HU in `body`.
pub(super) fn split(hu: &Cubes, body: &[bool], bone: f64, placed: &Placed, seam: &Seam, seeds: &[Seed]) -> Split {
    let is_bone: Vec<bool> = hu.values.iter().zip(body).map(|(&v, &b)| b && f64::from(v) >= bone).collect();
    let cubes = cubes(hu, &is_bone, placed, seam);
    let density = |at: usize| hu.values[at].min(DENSEST);
    let mut map = vec![0u8; is_bone.len()];
    cubes.iter().for_each(|c| map[c.at] = c.marker());
    let near = |c: &Cube, reach: f64, s: &Seed| (hu.place(c.at) - s.1).norm() < reach;
    for c in &cubes {
        if seeds.iter().any(|s| near(c, SEED_REACH, s) && s.0 != map[c.at]) {
            map[c.at] = 0;
        }
    }
    for seed in seeds {
        cubes.iter().filter(|c| near(c, INNER[0], seed)).for_each(|c| map[c.at] = seed.0);
    }
    let marks = map.clone();
    watershed(&hu.grid, density, |at| is_bone[at], &mut map);
    for c in cubes.iter().filter(|c| !seeds.iter().any(|s| near(c, SEED_REACH, s))) {
        let m = &mut map[c.at];
        if c.in_front() && c.over > GAP {
            *m = SKULL;
        } else if c.in_front() && c.over < -GAP && c.off < 12.0 {
            *m = MANDIBLE;
        }
        if *m == MANDIBLE && c.off > OUTER[2] {
            *m = SKULL;
        }
    }
    keep_marked(hu, &mut map, &marks);
    part_spine(hu, &cubes, &mut map, &marks, density);
    map.iter_mut().zip(&is_bone).filter(|(m, b)| **b && **m == 0).for_each(|(m, _)| *m = LOOSE);
    Split { map, cubes }
}

/// The split by seeds alone: each bone is what its seeds reach first, densest bone first.
pub(super) fn seeded(hu: &Cubes, body: &[bool], bone: f64, placed: &Placed, seam: &Seam, seeds: &[Seed]) -> Split {
    let is_bone: Vec<bool> = hu.values.iter().zip(body).map(|(&v, &b)| b && f64::from(v) >= bone).collect();
    let cubes = cubes(hu, &is_bone, placed, seam);
    let mut map = vec![0u8; is_bone.len()];
    for seed in seeds {
        cubes.iter().filter(|c| (hu.place(c.at) - seed.1).norm() < INNER[0]).for_each(|c| map[c.at] = seed.0);
    }
    watershed(&hu.grid, |at| hu.values[at].min(DENSEST), |at| is_bone[at], &mut map);
    map.iter_mut().zip(&is_bone).filter(|(m, b)| **b && **m == 0).for_each(|(m, _)| *m = LOOSE);
    Split { map, cubes }
}

/// The split that labels say, by the bone of each cube.
pub(super) fn labelled(hu: &Cubes, bone: f64, placed: &Placed, seam: &Seam, of: impl Fn(usize) -> u8) -> Split {
    let is_bone = |at: usize| f64::from(hu.values[at]) >= bone;
    let map: Vec<u8> = (0..hu.values.len()).map(|at| if is_bone(at) { of(at) } else { 0 }).collect();
    let is_bone: Vec<bool> = map.iter().map(|&m| m != 0).collect();
    Split { cubes: cubes(hu, &is_bone, placed, seam), map }
}

impl Cube {
    fn in_front(&self) -> bool {
        self.off < REACH && self.x.y < FRONT
    }

    /// Bone that is sure before the flood.
    fn marker(&self) -> u8 {
        let (x, near) = (&self.x, self.off < REACH);
        let joint = near && x.z > 9.0 && x.y > -18.0;
        let upper = near && (x.y < -22.0 && self.over > 3.0 && self.off > 8.0 || self.in_front() && self.over > GAP);
        let far = self.off > OUTER[1] || self.off > OUTER[0] && self.over > -GAP;
        if !near || joint || upper || far {
            return SKULL;
        }
        let reach = INNER[usize::from(self.body)];
        let below = !self.in_front() || self.over < -GAP;
        if self.off < reach && below && x.z < TOP[usize::from(x.y > NOTCH)] { MANDIBLE } else { 0 }
    }
}

/// Where each cube of bone lies.
fn cubes(hu: &Cubes, is_bone: &[bool], placed: &Placed, seam: &Seam) -> Vec<Cube> {
    let template: Vec<(Vec3, Vec3, Part)> =
        core([40, 9, 18, 9]).into_iter().map(|(x, part)| (x, placed.place(&x), part)).collect();
    let crest = crest(100);
    let (low, high) = bounds(template.iter().map(|(x, ..)| x));
    // Sizes below 1 bring the template nearer: the box is that much wider.
    let rim = Vec3::repeat(1.5 * REACH);
    let (low, high) = (low - rim, high + rim);
    let of = |at: usize| {
        let p = hu.place(at);
        let x = placed.local(&p);
        let mut cube = Cube { at, x, off: REACH, over: f64::INFINITY, body: false };
        if (0..3).any(|a| x[a] < low[a] || x[a] > high[a]) {
            return cube;
        }
        let nearest = template.iter().fold((f64::INFINITY, Part::Body), |best, (_, q, part)| {
            let d = (p - q).norm_squared();
            if d < best.0 { (d, *part) } else { best }
        });
        cube.off = nearest.0.sqrt().min(REACH);
        cube.body = nearest.1 == Part::Body;
        if cube.off < REACH {
            let plan = |c: &Vec3| (c.x - x.x).powi(2) + (c.y - x.y).powi(2);
            let nearest = crest.iter().min_by(|a, b| plan(a).total_cmp(&plan(b))).copied().unwrap_or_default();
            cube.over = x.z - nearest.z - seam.above_crest(&x);
            let beside = plan(&nearest).sqrt();
            // The tips of the incisors stand far above the crest.
            if x.y < FRONT && beside < 12.0 && cube.over < 0.0 && x.z > nearest.z - 6.0 {
                cube.off = cube.off.min(beside);
            }
        }
        cube
    };
    (0..is_bone.len()).filter(|&at| is_bone[at]).map(of).collect()
}

/// Leaves of the mandible what hangs together with most of its markers.
fn keep_marked(hu: &Cubes, map: &mut [u8], marks: &[u8]) {
    let (number, sizes) = components(&hu.grid, |at| map[at] == MANDIBLE);
    let mut marked = vec![0usize; sizes.len() + 1];
    (0..map.len()).filter(|&at| marks[at] == MANDIBLE).for_each(|at| marked[number[at] as usize] += 1);
    marked[0] = 0;
    let Some(kept) = (0..marked.len()).max_by_key(|&k| (marked[k], usize::MAX - k)) else { return };
    map.iter_mut().zip(&number).filter(|(m, n)| **m == MANDIBLE && **n as usize != kept).for_each(|(m, _)| *m = LOOSE);
}

/// Parts spine and hyoid from the skull by a second flood from places that are sure.
fn part_spine(hu: &Cubes, cubes: &[Cube], map: &mut [u8], seeds: &[u8], density: impl Fn(usize) -> f32) {
    let mut marks = vec![0u8; map.len()];
    for c in cubes.iter().filter(|c| map[c.at] == SKULL || map[c.at] == SPINE || map[c.at] == HYOID) {
        let (x, y, z) = (c.x.x.abs(), c.x.y, c.x.z);
        marks[c.at] = if z < -50.0 && y > -62.0 && y <= -14.0 && x < 32.0 {
            HYOID
        } else if z < -42.0 && y > -14.0 && y < 62.0 && x < 42.0 {
            SPINE
        } else if z > -6.0 || !(-30.0..=85.0).contains(&y) {
            SKULL
        } else {
            0
        };
        if seeds[c.at] == SPINE || seeds[c.at] == HYOID {
            marks[c.at] = seeds[c.at];
        }
    }
    watershed(&hu.grid, density, |at| [SKULL, SPINE, HYOID].contains(&map[at]), &mut marks);
    map.iter_mut().zip(&marks).filter(|(_, k)| **k != 0).for_each(|(m, k)| *m = *k);
    // The hyoid is the largest piece of a hyoid's size; the rest is the larynx and calcified ligaments.
    let (number, sizes) = components(&hu.grid, |at| map[at] == HYOID);
    let fits = |k: &usize| (HYOID_VOLUME[0]..HYOID_VOLUME[1]).contains(&(sizes[*k] as f64 * hu.h.powi(3)));
    let kept = (0..sizes.len()).filter(fits).max_by_key(|&k| (sizes[k], usize::MAX - k)).map(|k| k + 1);
    map.iter_mut().zip(&number).filter(|(_, n)| **n != 0 && Some(**n as usize) != kept).for_each(|(m, _)| *m = LOOSE);
}
