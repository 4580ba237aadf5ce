//! What a split must keep to be believed: each figure with the limits that right heads keep and wrong ones break.

use super::super::bones::{MANDIBLE, SKULL, SPINE};
use super::cubes::Cubes;
use super::fit::Fit;
use super::median::Median;
use super::seam::Seam;
use super::split::{Cube, FRONT, Split};
use super::template::{HEAD, Part, core};
use crate::math::Vec3;

/// What a check speaks of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum About {
    /// Which bone is which.
    Bones,
    /// Where the teeth meet: told, but the bones are believed.
    Bite,
    /// Where the jaw turns.
    Hinge,
    /// Where the lips meet.
    Mouth,
}

/// A figure of a split and the limits it must keep.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    /// What was measured.
    pub what: &'static str,
    /// What it is.
    pub value: f64,
    /// Least and most that right heads have.
    pub limits: [f64; 2],
    /// Unit of both, for display.
    pub unit: &'static str,
    /// What fails with it.
    pub about: About,
}

impl Check {
    /// Whether the figure is within its limits.
    pub fn holds(&self) -> bool {
        // Written so that a figure that is no number fails.
        self.value >= self.limits[0] && self.value <= self.limits[1]
    }
}

impl std::fmt::Display for Check {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [least, most] = self.limits;
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        write!(f, "{} is {:.2}{unit}, ", self.what, self.value)?;
        match (least.is_finite(), most.is_finite()) {
            (true, true) => write!(f, "wanted {least} to {most}"),
            (true, false) => write!(f, "wanted at least {least}"),
            _ => write!(f, "wanted at most {most}"),
        }
    }
}

/// Least score of a fit that has found a mandible.
pub(super) const LIKENESS: f64 = 0.6;
/// A core point counts as found if mandible lies this near, mm.
const FOUND: f64 = 3.5;
/// A point nearer than this to the end of the field has no bone about it, mm.
const RIM: f64 = 3.0;
/// Joints lie beside, behind and above these, template's |x|, y, z, mm; teeth lie before this.
const JOINT: [f64; 3] = [30.0, -16.0, -18.0];
const TEETH: f64 = -24.0;
/// Below this the scan must hold the mandible whole, template's z, mm: over it only the hinge is lost.
const BELOW: f64 = -25.0;

/// What is checked.
pub(super) struct Checked<'a> {
    pub hu: &'a Cubes,
    pub median: &'a Median,
    pub fit: &'a Fit,
    pub seam: &'a Seam,
    pub split: &'a Split,
    /// Right and left condyle as found.
    pub condyles: [Option<Vec3>; 2],
}

impl Checked<'_> {
    /// All figures.
    pub fn checks(&self) -> Vec<Check> {
        let bones = |what, value, limits, unit| Check { what, value, limits, unit, about: About::Bones };
        let most = |limit: f64| [f64::NEG_INFINITY, limit];
        let least = |limit: f64| [limit, f64::INFINITY];
        let ml = self.hu.h.powi(3) * 1e-3;
        let placed = &self.fit.placed;
        let jaw: Vec<&Cube> = self.split.cubes.iter().filter(|c| self.split.map[c.at] == MANDIBLE).collect();
        let count = |pass: &dyn Fn(&&&Cube) -> bool| jaw.iter().filter(|c| pass(c)).count() as f64;
        let n = jaw.len().max(1) as f64;
        let left =
            count(&|c| (self.hu.place(c.at) - self.median.offset * self.median.normal).dot(&self.median.normal) > 0.0);
        let far = count(&|c| c.off > if c.x.y < FRONT { 22.0 } else { 10.0 });
        let [body, ramus, condyle] = self.found();
        // Areas at middle size.
        let area = placed.size().product().powf(2.0 / 3.0);
        let [joint, elsewhere] = self.contact().map(|a| a / area);
        let mut checks = vec![
            bones("the likeness of the bone to a mandible", self.fit.score, least(LIKENESS), ""),
            bones("the share of the mandible's body that was found", body, least(0.8), ""),
            bones("the share of its rami that was found", ramus, least(0.75), ""),
            bones(
                "the volume of the mandible at middle size",
                jaw.len() as f64 * ml / placed.size().product(),
                [28.0, 120.0],
                "mL",
            ),
            bones("its difference between left and right", (2.0 * left / n - 1.0).abs(), most(0.16), ""),
            bones("what it has above the teeth", count(&|c| c.x.y < FRONT && c.over > 4.0) * ml, most(1.5), "mL"),
            bones("the share of it that lies off its place", far / n, most(0.04), ""),
            bones(
                "what of it the end of the scan cuts off below the joints",
                self.cut_off(&jaw) / area,
                most(16.0),
                "cm2",
            ),
            bones("its contact with the skull in the joints", joint, most(11.0), "cm2"),
            bones("its contact with the skull elsewhere", elsewhere, most(5.5), "cm2"),
        ];
        let bite = |what, value, limits, unit| Check { what, value, limits, unit, about: About::Bite };
        checks.push(bite("what stands in the way between upper and lower teeth", self.seam.cost, most(100.0), "HU"));
        let hinge = |what, value, limits, unit| Check { what, value, limits, unit, about: About::Hinge };
        let rim = self.heads().iter().map(|p| self.hu.inside_by(p)).fold(f64::INFINITY, f64::min);
        checks.push(hinge("the distance of the joints from the end of the scan", rim, least(RIM), "mm"));
        checks.push(hinge("the share of the condyles that was found", condyle, least(0.4), ""));
        let off = match self.condyles {
            [Some(right), Some(left)] => {
                let middle = 0.5 * (right + left);
                let reach = jaw.iter().map(|c| (self.hu.place(c.at) - middle).norm()).fold(0.0, f64::max);
                let size = (0.5 * (placed.p[7] + placed.p[8])).exp();
                checks.push(hinge("the length of the mandible at middle size", reach / size, [80.0, 125.0], "mm"));
                let from_plane = |p: Vec3| (p.dot(&self.median.normal) - self.median.offset).abs();
                let uneven = (from_plane(right) - from_plane(left)).abs();
                checks.push(hinge("the unevenness of the condyles about the median plane", uneven, most(9.0), "mm"));
                let [r, l] = self.heads();
                (right - r).norm().max((left - l).norm())
            }
            _ => f64::INFINITY,
        };
        checks.push(hinge("the distance of the condyles from where they are expected", off, most(10.0), "mm"));
        checks
    }

    /// Where the template has the heads of the condyles.
    fn heads(&self) -> [Vec3; 2] {
        [-1.0, 1.0].map(|side| self.fit.placed.place(&Vec3::new(side * HEAD[0], HEAD[1], HEAD[2])))
    }

    /// Shares of the template's points in the field with mandible near them, of the worse side: body, ramus, condyle.
    fn found(&self) -> [f64; 3] {
        let mut found = [[[0usize; 2]; 2]; 3];
        let grid = &self.hu.grid;
        let reach = (FOUND / self.hu.h).ceil() as i64;
        for (x, part) in core([16, 5, 9, 5]) {
            let p = self.fit.placed.place(&x);
            let kind = match part {
                Part::Body => 0,
                Part::Ramus => 1,
                Part::Condyle => 2,
                Part::Coronoid => continue,
            };
            // Above the field a ramus is not missing; that the body is, is.
            if kind > 0 && self.hu.inside_by(&p) < RIM {
                continue;
            }
            let c = grid.nearest(&p).map(|c| c as i64);
            let mut near = false;
            for k in c[2] - reach..=c[2] + reach {
                for j in c[1] - reach..=c[1] + reach {
                    for i in c[0] - reach..=c[0] + reach {
                        let inside = [i, j, k].iter().zip(grid.dims).all(|(&c, n)| c >= 0 && c < n as i64);
                        near |= inside && {
                            let at = grid.index([i, j, k].map(|c| c as usize));
                            self.split.map[at] == MANDIBLE && (self.hu.place(at) - p).norm() < FOUND
                        };
                    }
                }
            }
            let side = &mut found[kind][usize::from(x.x > 0.0)];
            side[0] += 1;
            side[1] += usize::from(near);
        }
        found.map(|sides| sides.iter().map(|[n, near]| *near as f64 / (*n).max(1) as f64).fold(1.0, f64::min))
    }

    /// Area of body and lower ramus on the faces of the field, cm2.
    fn cut_off(&self, jaw: &[&Cube]) -> f64 {
        let [nx, ny, nz] = self.hu.grid.dims;
        let faces = |c: &Cube| {
            let at = [(c.at % nx, nx), (c.at / nx % ny, ny), (c.at / (nx * ny), nz)];
            at.iter().filter(|(i, n)| *i == 0 || i + 1 == *n).count()
        };
        let below = jaw.iter().filter(|c| c.x.z < BELOW);
        below.map(|c| faces(c) as f64).sum::<f64>() * self.hu.h.powi(2) * 1e-2
    }

    /// Area of mandible against skull and spine in the joints, and elsewhere but between the teeth, cm2.
    fn contact(&self) -> [f64; 2] {
        let mut area = [0.0; 2];
        let face = self.hu.h.powi(2) * 1e-2;
        for c in self.split.cubes.iter().filter(|c| self.split.map[c.at] == MANDIBLE) {
            let x = &c.x;
            let joint = x.x.abs() > JOINT[0] && x.y > JOINT[1] && x.z > JOINT[2];
            if !joint && x.y < TEETH {
                continue;
            }
            super::super::clean::each_neighbour(&self.hu.grid, c.at, |other| {
                if [SKULL, SPINE].contains(&self.split.map[other]) {
                    area[usize::from(!joint)] += face;
                }
            });
        }
        area
    }
}
