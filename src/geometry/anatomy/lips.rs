//! The line between the lips and the corners of the mouth, as a dark valley in what lies just beneath a smoothed face; and the
//! tip of the nose.

use super::checks::{About, Check};
use super::cubes::{Cubes, convolved, gaussian};
use super::fit::Fit;
use super::seam::Seam;
use super::template::HALF_ARCH;
use crate::math::{Mat3, Vec3};

/// Step of the map, mm.
const STEP: f64 = 0.75;
/// Half width of the map, and its reach below and above the bite, mm.
const WIDE: f64 = 45.0;
const LOW: f64 = -48.0;
const HIGH: f64 = 125.0;
/// Rays start this far before the joints, and end so far behind them, mm.
const START: f64 = -140.0;
const END: f64 = 25.0;
/// Skin has this much body behind it, mm.
const BEHIND: f64 = 2.0;
/// Heights within this are bridged by the smooth face, mm.
const BRIDGED: f64 = 13.0;
/// Depths under the smooth face that are looked at, mm, and what counts, HU.
const DEPTHS: [f64; 2] = [1.5, 8.0];
const CLIP: [f64; 2] = [-400.0, 200.0];
/// Half width of the valley, mm.
const VALLEY: f64 = 4.5;
/// Where the line is sought: to the sides, below and above the bite, mm.
const WINDOW: [f64; 3] = [36.0, -9.0, 12.0];
/// The mouth ends where the valley is this shallow (HU), or this share of its depth in the middle, over this length (mm).
const SHALLOW: (f64, f64, f64) = (18.0, 0.3, 4.0);
/// Where the nose is sought above the bite, mm; chin and forehead, whose chord it stands out from.
const NOSE: [f64; 2] = [14.0, 70.0];
const CHIN: [f64; 2] = [-45.0, -15.0];
const FOREHEAD: [f64; 2] = [75.0, 125.0];

/// Where the lips meet.
#[derive(Debug, Clone, PartialEq)]
pub struct Lips {
    /// Points of the face along the line, the gap between open lips bridged, from the right commissure to the left one, LPS, m.
    pub line: Vec<Vec3>,
}

impl Lips {
    /// The right and the left corner of the mouth.
    pub fn commissures(&self) -> [Vec3; 2] {
        [self.line[0], self.line[self.line.len() - 1]]
    }
}

/// The face seen from the front: for each column and height how far back the skin lies, in the frame of the jaw.
pub(super) struct Face<'a> {
    hu: &'a Cubes,
    inside: &'a [bool],
    rotation: Mat3,
    origin: Vec3,
    /// Height of the bite in front.
    bite: f64,
    /// Size of the jaw across, against the usual one.
    size: f64,
    columns: usize,
    rows: usize,
    /// Skin, row by row from below; [`END`] where there is none.
    depth: Vec<f32>,
}

impl<'a> Face<'a> {
    pub fn of(hu: &'a Cubes, inside: &'a [bool], skin: f64, fit: &Fit, seam: &Seam) -> Self {
        let front = seam.crest[HALF_ARCH] + Vec3::new(0.0, 0.0, seam.height[HALF_ARCH]);
        let (rotation, origin) = (*fit.placed.rotation(), fit.placed.place(&Vec3::zeros()));
        let bite = (rotation.transpose() * (fit.placed.place(&front) - origin)).z;
        let columns = (2.0 * WIDE / STEP) as usize + 1;
        let rows = ((HIGH - LOW) / STEP) as usize + 1;
        let size = fit.placed.size().x;
        let mut face = Self { hu, inside, rotation, origin, bite, size, columns, rows, depth: Vec::new() };
        face.depth =
            (0..rows).flat_map(|r| (0..columns).map(move |c| (c, r))).map(|(c, r)| face.skin(c, r, skin)).collect();
        face
    }

    fn x(c: usize) -> f64 {
        STEP * c as f64 - WIDE
    }

    /// Height of a row over the bite.
    fn z(r: usize) -> f64 {
        STEP * r as f64 + LOW
    }

    fn row(z: f64) -> usize {
        ((z - LOW) / STEP).round().max(0.0) as usize
    }

    /// Place of a column and a row at a depth, in the frame of the cubes.
    fn place(&self, c: usize, r: usize, y: f64) -> Vec3 {
        self.origin + self.rotation * Vec3::new(Self::x(c), y, self.bite + Self::z(r))
    }

    /// Hounsfield units of the body; air outside of it.
    fn density(&self, p: &Vec3) -> f64 {
        let inside = self.inside[self.hu.grid.index(self.hu.grid.nearest(p))];
        self.hu.sample(p).filter(|_| inside).unwrap_or(-1000.0)
    }

    fn skin(&self, c: usize, r: usize, iso: f64) -> f32 {
        let steps = ((END - START) / STEP) as usize;
        let wanted = (BEHIND / STEP) as usize;
        let (mut body, mut last, mut first) = (0, -1000.0, END);
        for k in 0..steps {
            let y = START + STEP * k as f64;
            let v = self.density(&self.place(c, r, y));
            if v <= iso {
                body = 0;
            } else {
                if body == 0 {
                    first = y - STEP * if k > 0 { (v - iso) / (v - last).max(1e-3) } else { 0.0 }.clamp(0.0, 1.0);
                }
                body += 1;
                if body > wanted {
                    return first as f32;
                }
            }
            last = v;
        }
        END as f32
    }

    /// The tip of the nose: what stands out most from the chord of chin and forehead, near the median plane.
    pub fn nose(&self) -> Option<Vec3> {
        let middle = self.columns / 2;
        let profile: Vec<f32> = (0..self.rows)
            .map(|r| {
                let mut three = [0, 1, 2].map(|c| self.depth[r * self.columns + middle + c - 1]);
                three.sort_by(f32::total_cmp);
                three[1]
            })
            .collect();
        let profile = convolved(&profile, [self.rows, 1, 1], 0, &gaussian(1.0 / STEP));
        let foremost = |[low, high]: [f64; 2], less: &dyn Fn(usize) -> f32| {
            (Self::row(low)..=Self::row(high).min(self.rows - 1))
                .min_by(|&a, &b| (profile[a] - less(a)).total_cmp(&(profile[b] - less(b))))
        };
        let (chin, forehead) = (foremost(CHIN, &|_| 0.0)?, foremost(FOREHEAD, &|_| 0.0)?);
        let chord = |r: usize| {
            let t = (r as f32 - chin as f32) / (forehead as f32 - chin as f32);
            // Without a forehead in the field the chin alone says what stands out.
            let top = if f64::from(profile[forehead]) < END - 1.0 { profile[forehead] } else { profile[chin] };
            profile[chin] + t * (top - profile[chin])
        };
        let tip = foremost(NOSE, &chord)?;
        let place = self.place(middle, tip, f64::from(profile[tip]));
        // At the end of the scan the nose may go on.
        (self.hu.inside_by(&place) > BEHIND).then_some(place)
    }

    /// The line between the lips in the frame of the cubes, and the figures that it is judged by.
    pub fn lips(&self) -> (Vec<Vec3>, Vec<Check>) {
        let bridged = self.bridged();
        let dark = self.beneath(&bridged);
        let dark = convolved(&dark, [self.columns, self.rows, 1], 1, &gaussian(0.8 / STEP));
        let dark = convolved(&dark, [self.columns, self.rows, 1], 0, &gaussian(1.5 / STEP));
        let side = (VALLEY / STEP).round() as usize;
        let at = |c: usize, r: usize| f64::from(dark[r * self.columns + c]);
        let valley = |c: usize, r: usize| (0.5 * (at(c, r + side) + at(c, r - side)) - at(c, r)).max(0.0);
        let wide = (WINDOW[0] / STEP) as usize;
        let (first, last) = (self.columns / 2 - wide, self.columns / 2 + wide);
        let (low, high) = (Self::row(WINDOW[1]), Self::row(WINDOW[2]));
        // Dynamic programming from right to left: deep, near the middle, little up and down.
        let worth =
            |c: usize, r: usize| valley(c, r) * (-(Self::x(c) / 30.0).powi(2)).exp() - 0.6 * (Self::z(r) - 2.0).abs();
        let n = high - low + 1;
        let mut sum: Vec<f64> = (low..=high).map(|r| worth(first, r)).collect();
        let mut from: Vec<Vec<usize>> = Vec::new();
        for c in first + 1..=last {
            let best = |k: usize| {
                (k.saturating_sub(1)..=(k + 1).min(n - 1))
                    .map(|q| (sum[q] - 4.0 * q.abs_diff(k) as f64, q))
                    .fold((f64::NEG_INFINITY, k), |b, s| if s.0 > b.0 { s } else { b })
            };
            let next: Vec<(f64, usize)> = (0..n).map(best).collect();
            sum = next.iter().enumerate().map(|(k, b)| b.0 + worth(c, low + k)).collect();
            from.push(next.into_iter().map(|b| b.1).collect());
        }
        let mut k = (0..n).fold(0, |b, k| if sum[k] > sum[b] { k } else { b });
        let mut path = vec![low + k];
        for step in from.iter().rev() {
            k = step[k];
            path.push(low + k);
        }
        path.reverse();
        let deep: Vec<f64> = path.iter().enumerate().map(|(i, &r)| valley(first + i, r)).collect();
        let mut central: Vec<f64> = deep[wide - 16..=wide + 16].to_vec();
        central.sort_by(f64::total_cmp);
        let middle = central[central.len() / 2];
        let least = SHALLOW.0.max(SHALLOW.1 * middle);
        let end = |way: &mut dyn Iterator<Item = usize>| {
            let (mut end, mut gap) = (wide, 0.0);
            for i in way {
                if deep[i] > least {
                    (end, gap) = (i, 0.0);
                } else {
                    gap += STEP;
                    if gap > SHALLOW.2 {
                        break;
                    }
                }
            }
            end
        };
        let (right, left) = (end(&mut (0..=wide).rev()), end(&mut (wide..deep.len())));
        let widths = [right, left].map(|i| Self::x(first + i).abs());
        let check = |what, value, limits, unit| Check { what, value, limits, unit, about: About::Mouth };
        let checks = vec![
            check("the depth of the line between the lips", middle, [SHALLOW.0, f64::INFINITY], "HU"),
            check("the width of the mouth at middle size", (widths[0] + widths[1]) / self.size, [35.0, 65.0], "mm"),
            check("the unevenness of its corners", (widths[0] - widths[1]).abs(), [f64::NEG_INFINITY, 6.0], "mm"),
        ];
        let line = (right..=left).map(|i| {
            let (c, r) = (first + i, path[i]);
            self.place(c, r, f64::from(bridged[r * self.columns + c]))
        });
        (line.collect(), checks)
    }

    /// Depth of the face with the mouth bridged, smoothed.
    fn bridged(&self) -> Vec<f32> {
        let reach = (0.5 * BRIDGED / STEP) as usize;
        let smooth = |c: usize, r: usize| {
            let rows = r.saturating_sub(reach)..=(r + reach).min(self.rows - 1);
            rows.map(|q| self.depth[q * self.columns + c]).fold(f32::INFINITY, f32::min)
        };
        let bridged: Vec<f32> =
            (0..self.rows).flat_map(|r| (0..self.columns).map(move |c| (c, r))).map(|(c, r)| smooth(c, r)).collect();
        let bridged = convolved(&bridged, [self.columns, self.rows, 1], 0, &gaussian(1.5 / STEP));
        convolved(&bridged, [self.columns, self.rows, 1], 1, &gaussian(2.5 / STEP))
    }

    /// Mean density just beneath that face, HU.
    fn beneath(&self, bridged: &[f32]) -> Vec<f32> {
        let steps = ((DEPTHS[1] - DEPTHS[0]) / STEP) as usize;
        let mean = |at: usize| {
            let (c, r) = (at % self.columns, at / self.columns);
            let value = |k: usize| {
                let y = f64::from(bridged[at]) + DEPTHS[0] + STEP * k as f64;
                self.density(&self.place(c, r, y)).clamp(CLIP[0], CLIP[1])
            };
            ((0..steps).map(value).sum::<f64>() / steps as f64) as f32
        };
        // Only the mouth is looked at.
        let seen = |r: usize| Self::z(r) < WINDOW[2] + 4.0 * VALLEY && Self::z(r) > WINDOW[1] - 4.0 * VALLEY;
        (0..bridged.len()).map(|at| if seen(at / self.columns) { mean(at) } else { 0.0 }).collect()
    }
}
