//! The median plane of a head: the plane in which its bone is its own mirror image.

use super::cubes::Cubes;
use crate::math::{Mat3, Random, Vec3};

/// Hounsfield units from nothing to all of bone.
const BONE: [f32; 2] = [150.0, 500.0];
/// Blur of the bone that images are looked up in, mm.
const BLUR: f64 = 4.0;
/// Points reflected when planes are sought, and when the best are refined.
const POINTS: [usize; 2] = [700, 2500];
/// Planes tried: most degrees to each side and their step, most millimetres off the bone's middle and their step.
const ANGLES: (i32, usize) = (36, 6);
const OFFSETS: (i32, usize) = (12, 4);
/// Planes that are refined.
const KEPT: usize = 4;
/// Most steps of a refinement.
const STEPS: usize = 80;

/// A plane `normal . x = offset` in the frame of the cubes, the normal to the left.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Median {
    pub normal: Vec3,
    pub offset: f64,
    /// Share of the bone that the plane reflects onto bone.
    pub score: f64,
    /// Middle of the bone.
    pub centre: Vec3,
}

/// The plane that reflects the bone in `body` onto itself best; `axes` are left, back and up. None where there is no bone.
pub(super) fn median(hu: &Cubes, body: &[bool], axes: &Mat3) -> Option<Median> {
    let bone = |(&v, &b): (&f32, &bool)| if b { ((v - BONE[0]) / (BONE[1] - BONE[0])).clamp(0.0, 1.0) } else { 0.0 };
    let bone = hu.with(hu.values.iter().zip(body).map(bone).collect());
    let mut field = bone.blurred(BLUR);
    let most = field.values.iter().copied().fold(0.0f32, f32::max);
    let dense: Vec<usize> = (0..bone.values.len()).filter(|&at| bone.values[at] > 0.5).collect();
    if dense.is_empty() {
        return None;
    }
    field.values.iter_mut().for_each(|v| *v /= most);
    let mut random = Random(0);
    let points: Vec<Vec3> = (0..POINTS[1].min(dense.len()))
        .map(|_| hu.place(dense[((random.number() * dense.len() as f64) as usize).min(dense.len() - 1)]))
        .collect();
    let centre = points.iter().sum::<Vec3>() / points.len() as f64;
    let normal = |q: &[f64; 3]| {
        let (turn, tilt) = (q[0], q[1]);
        axes * Vec3::new(turn.cos() * tilt.cos(), turn.sin() * tilt.cos(), tilt.sin())
    };
    let score = |q: &[f64; 3], points: &[Vec3]| {
        let n = normal(q);
        let (mut sum, mut inside) = (0.0, 0);
        for p in points {
            let image = p - 2.0 * ((p - centre).dot(&n) - q[2]) * n;
            if let Some(v) = field.sample(&image) {
                (sum, inside) = (sum + v, inside + 1);
            }
        }
        if 2 * inside > points.len() { sum / points.len() as f64 } else { -1.0 }
    };
    let coarse = &points[..POINTS[0].min(points.len())];
    let mut tried = Vec::new();
    let angles = || (-ANGLES.0..=ANGLES.0).step_by(ANGLES.1).map(|a| f64::from(a).to_radians());
    for turn in angles() {
        for tilt in angles() {
            for offset in (-OFFSETS.0..=OFFSETS.0).step_by(OFFSETS.1) {
                let q = [turn, tilt, f64::from(offset)];
                tried.push((score(&q, coarse), q));
            }
        }
    }
    tried.sort_by(|a, b| b.0.total_cmp(&a.0));
    let refined = tried.iter().take(KEPT).map(|(_, q)| simplex(|q| -score(q, &points), q, &[0.06, 0.06, 3.0], STEPS));
    let (q, value) = refined.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let n = normal(&q);
    Some(Median { normal: n, offset: n.dot(&centre) + q[2], score: -value, centre })
}

/// Lowest point near `start` by a moving simplex, and its value.
///
/// Source: J. A. Nelder & R. Mead, "A simplex method for function minimization", Computer Journal 7, 1965.
fn simplex(value: impl Fn(&[f64; 3]) -> f64, start: &[f64; 3], size: &[f64; 3], steps: usize) -> ([f64; 3], f64) {
    let mut corners: Vec<([f64; 3], f64)> = (0..4)
        .map(|k| {
            let x = std::array::from_fn(|a| start[a] + if k == a + 1 { size[a] } else { 0.0 });
            (x, value(&x))
        })
        .collect();
    for _ in 0..steps {
        corners.sort_by(|a, b| a.1.total_cmp(&b.1));
        let middle: [f64; 3] = std::array::from_fn(|a| corners[..3].iter().map(|c| c.0[a]).sum::<f64>() / 3.0);
        let worst = corners[3];
        let at = |s: f64| {
            let x = std::array::from_fn(|a| middle[a] + s * (worst.0[a] - middle[a]));
            (x, value(&x))
        };
        let reflected = at(-1.0);
        if reflected.1 < corners[0].1 {
            let further = at(-2.0);
            corners[3] = if further.1 < reflected.1 { further } else { reflected };
        } else if reflected.1 < corners[2].1 {
            corners[3] = reflected;
        } else {
            let nearer = at(if reflected.1 < worst.1 { -0.5 } else { 0.5 });
            if nearer.1 < reflected.1.min(worst.1) {
                corners[3] = nearer;
            } else {
                let best = corners[0].0;
                for c in &mut corners[1..] {
                    c.0 = std::array::from_fn(|a| 0.5 * (best[a] + c.0[a]));
                    c.1 = value(&c.0);
                }
            }
        }
    }
    corners.sort_by(|a, b| a.1.total_cmp(&b.1));
    corners[0]
}
