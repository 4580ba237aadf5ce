//! A head by formula, with all that makes jaws hard to part: teeth in contact, condyles a millimetre or two under their fossae.
//!
//! Origin midway between the condyles, millimetres, x to the left, y to the back, z up. Its proportions are not those of the
//! template that is fitted.
#![allow(non_snake_case)]
use cutis::geometry::{Grid, Labels, Volume};
use cutis::math::{Mat3, Random, Vec3, exp_rotation};

use super::heads::{Head, MANDIBLE, MM, SKULL, SPINE, points};

/// Label of the hyoid.
pub const HYOID: u8 = 6;
/// Height of the bite in front and how much it rises over 60 mm to the back.
const BITE: [f64; 2] = [-38.0, 5.0];
/// Half the width of the mouth.
pub const MOUTH: f64 = 24.0;
/// Tops of the condyles and their radii.
const CONDYLE: [f64; 3] = [51.0, 0.0, -1.0];
const CONDYLE_RADII: [f64; 3] = [9.0, 4.5, 5.0];

/// What a phantom is made by.
#[derive(Debug, Clone, Copy)]
pub struct Phantom {
    /// Size against the usual one.
    pub size: f64,
    /// Gap between the rows of teeth, mm; 0 in contact.
    pub bite: f64,
    /// Gap of the joints, mm.
    pub joint: f64,
    /// Teeth a side and row; 0 without teeth, the crests worn down.
    pub teeth: usize,
    /// Degrees by which the angle of the jaw is opened.
    pub steep: f64,
    /// Whether the ear canals hold air.
    pub ears: bool,
    /// Voxels, mm.
    pub spacing: [f64; 3],
    /// Noise, HU.
    pub noise: f64,
}

impl Default for Phantom {
    fn default() -> Self {
        Self { size: 1.0, bite: 0.0, joint: 1.5, teeth: 7, steep: 0.0, ears: true, spacing: [1.5; 3], noise: 10.0 }
    }
}

fn rod(p: &Vec3, a: [f64; 3], b: [f64; 3], r: f64) -> f64 {
    let (a, b) = (Vec3::from(a), Vec3::from(b));
    let t = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
    (p - a.lerp(&b, t)).norm() - r
}

fn ellipsoid(p: &Vec3, c: [f64; 3], r: [f64; 3]) -> f64 {
    let r = Vec3::from(r);
    let q = p - Vec3::from(c);
    let (k, l) = (q.component_div(&r).norm(), q.component_div(&r.component_mul(&r)).norm());
    if l == 0.0 { -r.min() } else { k * (k - 1.0) / l }
}

fn block(p: &Vec3, c: [f64; 3], half: [f64; 3], round: f64) -> f64 {
    let q = (p - Vec3::from(c)).abs() - Vec3::from(half) + Vec3::repeat(round);
    q.sup(&Vec3::zeros()).norm() + q.max().min(0.0) - round
}

/// Middle line of the arch: from the middle to the left.
const ARCH: [[f64; 2]; 7] =
    [[0.0, -76.0], [9.0, -74.5], [17.0, -69.0], [22.0, -60.0], [26.0, -49.0], [30.0, -38.0], [33.0, -29.0]];

/// Distance in plan from a line, and y of its nearest point.
fn plan(p: &Vec3, line: &[[f64; 2]]) -> (f64, f64) {
    line.windows(2).fold((f64::INFINITY, 0.0), |best, w| {
        let (a, b) = (nalgebra::Vector2::from(w[0]), nalgebra::Vector2::from(w[1]));
        let q = nalgebra::Vector2::new(p.x, p.y);
        let t = ((q - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        let at = a.lerp(&b, t);
        if (q - at).norm() < best.0 { ((q - at).norm(), at.y) } else { best }
    })
}

/// Place and direction along the arch at a share of its length.
fn along(share: f64) -> [f64; 2] {
    let length = |w: &[[f64; 2]]| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1]);
    let mut left = share * ARCH.windows(2).map(length).sum::<f64>();
    for w in ARCH.windows(2) {
        let l = length(w);
        if left <= l {
            return [0, 1].map(|a| w[0][a] + (w[1][a] - w[0][a]) * left / l);
        }
        left -= l;
    }
    ARCH[6]
}

impl Phantom {
    /// Height of the bite over a place.
    fn bite_at(y: f64) -> f64 {
        BITE[0] + BITE[1] * (y + 76.0) / 60.0
    }

    /// The bone of the mandible without its teeth.
    fn jaw(&self, p: &Vec3) -> f64 {
        let (s, c) = self.steep.to_radians().sin_cos();
        // The body turned about the angle of the jaw.
        let (dy, dz) = (p.y + 12.0, p.z + 55.0);
        let b = if p.y < -12.0 { Vec3::new(p.x, -12.0 + c * dy - s * dz, -55.0 + s * dy + c * dz) } else { *p };
        let line = [ARCH[0], ARCH[1], ARCH[2], ARCH[3], ARCH[4], [33.0, -35.0], [41.0, -14.0]];
        let (off, y) = plan(&b, &line);
        let worn = if self.teeth == 0 { 7.0 } else { 0.0 };
        let crest = Self::bite_at(y) - 9.0 - worn + 2.0 * (y + 40.0).max(0.0) / 25.0;
        let low = -84.0 + 24.0 * ((y + 76.0) / 62.0);
        let slab = |d: f64, half: f64, z: f64, low: f64, high: f64| {
            let q = [d - half + 3.0, (z - 0.5 * (low + high)).abs() - 0.5 * (high - low) + 3.0];
            q[0].max(0.0).hypot(q[1].max(0.0)) + q[0].max(q[1]).min(0.0) - 3.0
        };
        let mut d = slab(off, 6.5, b.z, low, crest);
        // Ramus, coronoid, neck, condyle.
        let t = ((p.z + 60.0) / 46.0).clamp(0.0, 1.0);
        let (x, front, back) = (41.0 + 4.0 * t, -28.0 - 2.0 * t, -8.0 + 5.0 * t);
        let q = [(p.x - x).abs() - 4.5, front - p.y, p.y - back, -62.0 - p.z, p.z + 14.0];
        d = d.min(q.into_iter().fold(f64::NEG_INFINITY, f64::max));
        d = d.min(rod(p, [45.0, -25.0, -16.0], [46.0, -27.0, -3.0], 3.5));
        d = d.min(rod(p, [45.5, -7.0, -16.0], [50.0, -1.0, -4.0], 4.2));
        d.min(ellipsoid(p, CONDYLE, CONDYLE_RADII))
    }

    /// The teeth of one jaw: crown and root.
    fn teeth(&self, p: &Vec3, upper: bool) -> f64 {
        let side = if upper { 1.0 } else { -1.0 };
        (0..self.teeth).fold(f64::INFINITY, |d, k| {
            let [x, y] = along((k as f64 + 0.5) / 7.2);
            let r = if k < 3 { 3.2 } else { 4.6 };
            let end = Self::bite_at(y) + side * (0.5 * self.bite + r * 0.5);
            let neck = Self::bite_at(y) + side * (0.5 * self.bite + 9.0);
            let crown = block(p, [x, y, 0.5 * (end + neck)], [r, r, 0.5 * (neck - end).abs() + r * 0.5], 1.5);
            d.min(crown).min(rod(p, [x, y, neck], [x, y, neck + side * 9.0], 2.2))
        })
    }

    /// Skull without teeth.
    fn skull(&self, p: &Vec3) -> f64 {
        let vault = ellipsoid(p, [0.0, 12.0, 60.0], [74.0, 93.0, 66.0]);
        let mut d = vault.max(-(vault + 6.0));
        d = d.min(block(p, [0.0, 22.0, 8.0], [62.0, 42.0, 4.0], 2.0));
        d = d.min(ellipsoid(p, [34.0, 16.0, 8.0], [18.0, 9.0, 9.0]));
        d = d.min(ellipsoid(p, [52.0, 27.0, -6.0], [9.0, 8.0, 17.0]));
        // The fossa lies over the condyle at the joint's gap.
        let joint = |more: f64| ellipsoid(p, CONDYLE, CONDYLE_RADII.map(|r| r + self.joint + more));
        let roof = joint(4.0).max(-joint(0.0)).max(-1.0 - p.z);
        d = d.min(roof).min(rod(p, [45.0, -14.0, 3.0], [57.0, -14.0, 3.0], 4.0)).max(-joint(0.0));
        d = d.min(rod(p, [60.0, -6.0, 9.0], [66.0, -30.0, 3.0], 3.5));
        d = d.min(rod(p, [66.0, -30.0, 3.0], [48.0, -58.0, -2.0], 4.0));
        d = d.min(ellipsoid(p, [46.0, -58.0, -3.0], [9.0, 7.0, 9.0]));
        d = d.min(rod(p, [46.0, -60.0, -3.0], [24.0, -64.0, -6.0], 5.0));
        let sinus = ellipsoid(p, [20.0, -52.0, 0.0], [14.0, 17.0, 16.0]);
        d = d.min(sinus.max(-(sinus + 2.5)));
        let (off, y) = plan(p, &ARCH);
        let worn = if self.teeth == 0 { 5.0 } else { 0.0 };
        let low = Self::bite_at(y) + 0.5 * self.bite + 9.0 + worn;
        let q = [off - 5.5, low - p.z, p.z - low - 18.0];
        d = d.min(q.into_iter().fold(f64::NEG_INFINITY, f64::max));
        d = d.min(block(p, [0.0, -50.0, -18.0], [26.0, 22.0, 2.0], 1.0));
        d = d.min(rod(p, [14.0, -22.0, -26.0], [15.0, -14.0, 8.0], 4.0));
        d.min(rod(p, [10.0, -72.0, -8.0], [13.0, -74.0, 38.0], 4.5))
    }

    fn spine(&self, p: &Vec3) -> f64 {
        let mut d = f64::INFINITY;
        for k in 0..8 {
            let z = -14.0 - 18.0 * f64::from(k);
            let ring = ((p.x.hypot(p.y - 24.0)) - 9.5).max((p.z - z).abs() - 7.0);
            d = d.min(ring).min(rod(p, [9.0, 27.0, z], [14.0, 40.0, z], 4.0)).min(rod(
                p,
                [14.0, 40.0, z],
                [0.0, 60.0, z - 4.0],
                3.5,
            ));
        }
        d.min(rod(p, [14.0, 20.0, -6.0], [12.0, 22.0, -14.0], 4.0))
    }

    fn hyoid(&self, p: &Vec3) -> f64 {
        rod(p, [0.0, -42.0, -86.0], [12.0, -36.0, -85.0], 3.6).min(rod(
            p,
            [12.0, -36.0, -85.0],
            [17.0, -18.0, -80.0],
            2.6,
        ))
    }

    fn skin(&self, p: &Vec3) -> f64 {
        ellipsoid(p, [0.0, 12.0, 58.0], [82.0, 102.0, 76.0])
            .min(ellipsoid(p, [0.0, -36.0, -42.0], [74.0, 60.0, 74.0]))
            .min(ellipsoid(p, [0.0, 0.0, -10.0], [76.0, 62.0, 70.0]))
            .min(rod(p, [0.0, 25.0, -30.0], [0.0, 30.0, -180.0], 58.0))
            .min(rod(p, [0.0, -88.0, 26.0], [0.0, -106.0, -12.0], 9.0))
    }

    /// Hounsfield units and label at a place of a head of usual size, and how far off the next surface may be.
    fn at(&self, p: &Vec3) -> (f64, u8, f64) {
        let p = Vec3::new(p.x.abs(), p.y, p.z);
        let skin = self.skin(&p);
        if skin > 0.0 {
            return (-1000.0, 0, skin);
        }
        let slit = (p.x - MOUTH).max(p.y + 84.0).max((p.z - BITE[0]).abs() - 1.0);
        let canal = if self.ears { rod(&p, [44.0, 15.0, 0.0], [95.0, 15.0, 0.0], 3.5) } else { f64::INFINITY };
        let throat = rod(&p, [0.0, -6.0, -10.0], [0.0, 4.0, -180.0], 7.0);
        let sinus = ellipsoid(&p, [20.0, -52.0, 0.0], [14.0, 17.0, 16.0]) + 2.5;
        let air = slit.min(canal).min(throat).min(sinus);
        let mut clear = skin.abs().min(air.abs());
        if air < 0.0 {
            return (-1000.0, 0, clear);
        }
        let near = p.z > -60.0 && p.z < -10.0 && p.y < -20.0 && p.x < 45.0;
        let tooth = |upper: bool| if near { self.teeth(&p, upper) } else { f64::INFINITY };
        let bones = [
            (self.skull(&p), tooth(true), SKULL),
            (self.jaw(&p), tooth(false), MANDIBLE),
            (self.spine(&p), f64::INFINITY, SPINE),
            (self.hyoid(&p), f64::INFINITY, HYOID),
        ];
        for (bone, tooth, _) in bones {
            clear = clear.min(bone.abs()).min((bone + 2.5).abs()).min(tooth.abs()).min((tooth + 1.0).abs());
        }
        for (bone, tooth, label) in bones {
            if tooth < 0.0 {
                return (if tooth < -1.0 { 1500.0 } else { 2300.0 }, label, clear);
            }
            if bone < 0.0 {
                return (if bone < -2.5 { 320.0 } else { 1150.0 }, label, clear);
            }
        }
        (40.0, 1, clear)
    }

    /// The scan: each voxel the mean of eight points.
    pub fn head(&self) -> Head {
        let spacing = Vec3::from(self.spacing) * MM;
        let low = Vec3::new(-92.0, -122.0, -135.0) * (self.size * MM);
        let high = Vec3::new(92.0, 122.0, 140.0) * (self.size * MM);
        let dims = [0, 1, 2].map(|a| ((high[a] - low[a]) / spacing[a]) as usize + 1);
        let grid = Grid { dims, spacing, origin: low, direction: Mat3::identity() };
        let scale = 1.0 / (self.size * MM);
        let steps: Vec<Vec3> = (0..8)
            .map(|c| Vec3::from_fn(|a, _| if c >> a & 1 == 0 { -0.25 } else { 0.25 }).component_mul(&spacing) * scale)
            .collect();
        let voxel = |p: Vec3| {
            let p = p * scale;
            let (hu, label, clear) = self.at(&p);
            // Far from all surfaces the mean is the middle's value.
            if clear > 0.6 * spacing.norm() * scale {
                return (hu, label);
            }
            (steps.iter().map(|s| self.at(&(p + s)).0).sum::<f64>() / 8.0, label)
        };
        let half = dims[2] / 2;
        let rows = |from: usize, to: usize| -> Vec<(f64, u8)> {
            let part = Grid {
                dims: [dims[0], dims[1], to - from],
                origin: grid.world(&Vec3::new(0.0, 0.0, from as f64)),
                ..grid.clone()
            };
            points(&part).map(voxel).collect()
        };
        let values = std::thread::scope(|scope| {
            let upper = scope.spawn(|| rows(half, dims[2]));
            let mut values = rows(0, half);
            values.extend(upper.join().unwrap());
            values
        });
        let mut random = Random(5);
        let noise =
            |random: &mut Random| self.noise * ((0..6).map(|_| random.number()).sum::<f64>() - 3.0) * 2f64.sqrt();
        let samples =
            values.iter().map(|(hu, _)| (hu + noise(&mut random)).clamp(-1024.0, 3071.0).round() as f32).collect();
        let ids = values.iter().map(|v| v.1).collect();
        let condyle = |side: f64| Vec3::new(side * CONDYLE[0], CONDYLE[1], CONDYLE[2] + 1.5) * (self.size * MM);
        Head {
            volume: Volume { grid: grid.clone(), samples },
            labels: Labels { grid, ids },
            condyles: [condyle(-1.0), condyle(1.0)],
        }
    }
}

/// A head whose scanner axes are turned against the patient's: the same voxels, another direction matrix.
pub fn oblique(head: &Head, axis: usize, degrees: f64) -> Head {
    let R = exp_rotation(&Vec3::from_fn(|a, _| if a == axis { degrees.to_radians() } else { 0.0 }));
    let mut head = head.clone();
    for grid in [&mut head.volume.grid, &mut head.labels.grid] {
        grid.direction = R * grid.direction;
        grid.origin = R * grid.origin;
    }
    head.condyles = head.condyles.map(|c| R * c);
    head
}
