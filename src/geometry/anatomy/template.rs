//! The shape of a mandible: points inside bone, and points round it where no bone is.
//!
//! Origin midway between the condyles, x to the left, y to the back, z up, millimetres; the right half is the mirror
//! image. Numbers are those of an adult of middle size, read off computed tomographs.

use crate::math::{Mat3, Vec3, exp_rotation};

/// Body: x and y of its middle line, lower border, alveolar crest; from the chin to the angle.
const BODY: [[f64; 4]; 8] = [
    [0.0, -71.0, -80.0, -54.0],
    [13.0, -67.0, -79.0, -54.0],
    [21.0, -59.0, -76.0, -53.0],
    [26.0, -51.0, -73.0, -52.0],
    [30.0, -43.0, -70.0, -50.0],
    [34.0, -33.0, -67.0, -47.0],
    [38.0, -24.0, -63.0, -44.0],
    [42.0, -16.0, -60.0, -42.0],
];
/// Ramus: height; x and y of its front border; x and y of its back border.
const RAMUS: [[f64; 5]; 5] = [
    [-52.0, 40.0, -24.0, 46.0, -6.0],
    [-42.0, 40.0, -28.0, 47.0, -3.0],
    [-32.0, 42.0, -30.0, 49.0, -2.0],
    [-22.0, 43.0, -31.0, 50.0, -1.0],
    [-14.0, 44.0, -31.0, 51.0, 1.0],
];
const CORONOID: [[f64; 3]; 3] = [[45.0, -31.0, -10.0], [46.0, -31.0, -4.0], [46.0, -31.0, 1.0]];
const CONDYLE: [[f64; 3]; 5] =
    [[53.0, 2.0, -9.0], [53.0, 2.0, -4.0], [48.0, 3.0, -1.0], [53.0, 2.0, 0.0], [58.0, 1.0, -1.0]];
/// Top of the left condyle's head.
pub(super) const HEAD: [f64; 3] = [53.0, 2.0, 0.0];
/// The notch between coronoid and condyle: above this height, between these shares of the ramus' depth.
const NOTCH: (f64, [f64; 2]) = (-20.0, [0.3, 0.65]);
/// Soft places that no line leads to: behind the angle, before the chin, in the tongue, in the notch, beside the coronoid and
/// about the condyle's neck. The last ones keep the joint from sliding up into the temporal bone.
const SOFT: [[f64; 3]; 14] = [
    [46.0, 2.0, -58.0],
    [40.0, -8.0, -66.0],
    [0.0, -84.0, -66.0],
    [0.0, -55.0, -62.0],
    [0.0, -45.0, -62.0],
    [48.0, -14.0, -9.0],
    [48.0, -14.0, -5.0],
    [34.0, -28.0, -4.0],
    [56.0, -30.0, -4.0],
    [38.0, -2.0, -13.0],
    [38.0, -10.0, -8.0],
    [63.0, 0.0, -13.0],
    [63.0, -10.0, -10.0],
    [52.0, 12.0, -16.0],
];

/// Part of the mandible that a point belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Body,
    Ramus,
    Coronoid,
    Condyle,
}

impl Part {
    /// Weight of its points in a fit.
    pub fn weight(self) -> f64 {
        match self {
            Self::Body => 1.0,
            Self::Ramus => 1.1,
            Self::Coronoid | Self::Condyle => 1.5,
        }
    }
}

/// A row of a table at `n` places, evenly along the curve of its first `D` columns.
fn along<const N: usize, const D: usize>(table: &[[f64; N]], n: usize) -> Vec<[f64; N]> {
    let length = |a: &[f64; N], b: &[f64; N]| (0..D).map(|k| (b[k] - a[k]).powi(2)).sum::<f64>().sqrt();
    let mut way = vec![0.0];
    table.windows(2).for_each(|w| way.push(way[way.len() - 1] + length(&w[0], &w[1])));
    let last = way[way.len() - 1];
    let row = |i: usize| {
        let s = last * i as f64 / (n as f64 - 1.0);
        let k = way.iter().rposition(|&w| w <= s).unwrap_or(0).min(table.len() - 2);
        let u = ((s - way[k]) / (way[k + 1] - way[k])).clamp(0.0, 1.0);
        std::array::from_fn(|c| table[k][c] + u * (table[k + 1][c] - table[k][c]))
    };
    (0..n).map(row).collect()
}

/// Evenly from 0 to 1.
fn shares(n: usize) -> impl Iterator<Item = f64> {
    (0..n).map(move |i| i as f64 / (n as f64 - 1.0))
}

/// Points and their images in x = 0.
fn both_sides<T: Clone>(half: Vec<(Vec3, T)>) -> Vec<(Vec3, T)> {
    let image = |(p, t): &(Vec3, T)| (Vec3::new(-p.x, p.y, p.z), t.clone());
    let other: Vec<_> = half.iter().map(image).collect();
    half.into_iter().chain(other).collect()
}

/// Points inside bone: `counts` along the body, over its height, up the ramus and across it.
pub(super) fn core(counts: [usize; 4]) -> Vec<(Vec3, Part)> {
    let mut half = Vec::new();
    for [x, y, low, crest] in along::<4, 2>(&BODY, counts[0]) {
        half.extend(shares(counts[1]).map(|t| (Vec3::new(x, y, low + 4.0 + (crest - low - 6.0) * t), Part::Body)));
    }
    for [z, xf, yf, xb, yb] in along::<5, 5>(&RAMUS, counts[2]) {
        let bone = |t: &f64| z <= NOTCH.0 || *t <= NOTCH.1[0] || *t >= NOTCH.1[1];
        let point = |t: f64| (Vec3::new(xf + (xb - xf) * t, yf + 3.0 + (yb - yf - 5.0) * t, z), Part::Ramus);
        half.extend(shares(counts[3]).filter(bone).map(point));
    }
    half.extend(along::<3, 3>(&CORONOID, 4).into_iter().map(|p| (Vec3::from(p), Part::Coronoid)));
    half.extend(CONDYLE.map(|p| (Vec3::from(p), Part::Condyle)));
    both_sides(half)
}

/// Points near the mandible where there is no bone. Without them the shape slides into the base of the skull.
pub(super) fn shell() -> Vec<Vec3> {
    let mut half = Vec::new();
    let body = along::<4, 2>(&BODY, 16);
    for (i, &[x, y, low, crest]) in body.iter().enumerate() {
        let normal = outward(&body, i);
        let mut beside = |out: f64, t: f64| half.push(Vec3::new(x, y, low + (crest - low) * t) + out * normal);
        [(11.0, 0.15), (11.0, 0.5), (-11.0, 0.2), (-11.0, 0.6)].into_iter().for_each(|(out, t)| beside(out, t));
        half.push(Vec3::new(x, y, low - 7.0));
    }
    for [z, xf, yf, xb, yb] in along::<5, 5>(&RAMUS, 9).into_iter().filter(|r| r[0] < -18.0) {
        for t in shares(3) {
            let (x, y) = (xf + (xb - xf) * t, yf + (yb - yf) * t);
            half.extend([Vec3::new(x + 11.0, y, z), Vec3::new(x - 10.0, y, z)]);
        }
        half.push(Vec3::new(xb, yb + 9.0, z));
    }
    half.extend(SOFT.map(Vec3::from));
    both_sides(half.into_iter().map(|p| (p, ())).collect()).into_iter().map(|(p, ())| p).collect()
}

/// Horizontal unit normal of the body's middle line, away from the tongue.
fn outward(body: &[[f64; 4]], i: usize) -> Vec3 {
    let (a, b) = (body[i.saturating_sub(1)], body[(i + 1).min(body.len() - 1)]);
    let normal = Vec3::new(a[1] - b[1], b[0] - a[0], 0.0).normalize();
    let [x, y, ..] = body[i];
    if normal.dot(&Vec3::new(x + 1e-9, y + 20.0, 0.0)) < 0.0 { -normal } else { normal }
}

/// The station of [`arch`] that lies in the median plane.
pub(super) const HALF_ARCH: usize = 19;

/// The crest of the lower teeth as stations from right to left, with the normal of the arch at each.
pub(super) fn arch() -> Vec<(Vec3, Vec3)> {
    /// Stations along the body on one side.
    const SIDE: usize = 24;
    let body = along::<4, 2>(&BODY, SIDE);
    let station = |i: usize| {
        let [x, y, _, crest] = body[i];
        (Vec3::new(x, y, crest), outward(&body, i))
    };
    let mirrored = |(p, n): (Vec3, Vec3)| (Vec3::new(-p.x, p.y, p.z), Vec3::new(-n.x, n.y, 0.0));
    let right = (1..=HALF_ARCH).rev().map(|i| mirrored(station(i)));
    right.chain((0..=HALF_ARCH).map(station)).collect()
}

/// The crest as a dense line on both sides: plan and height.
pub(super) fn crest(n: usize) -> Vec<Vec3> {
    let half: Vec<Vec3> = along::<4, 2>(&BODY, n).into_iter().map(|[x, y, _, z]| Vec3::new(x, y, z)).collect();
    half.iter().map(|p| Vec3::new(-p.x, p.y, p.z)).chain(half.iter().copied()).collect()
}

/// Numbers of a pose: shift (3), turn (3), logarithms of the sizes along x, y, z, bend at the angle of the jaw, narrowing in front.
pub(super) const PARAMETERS: usize = 11;

/// Where and how the template lies in a scan.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Placed {
    /// Axes that the turn starts from, as columns.
    pub axes: Mat3,
    /// Origin that the shift starts from.
    pub origin: Vec3,
    /// See [`PARAMETERS`].
    pub p: [f64; PARAMETERS],
    rotation: Mat3,
    size: Vec3,
}

impl Placed {
    pub fn new(axes: Mat3, origin: Vec3, p: [f64; PARAMETERS]) -> Self {
        let rotation = axes * exp_rotation(&Vec3::new(p[3], p[4], p[5]));
        Self { axes, origin, p, rotation, size: Vec3::new(p[6].exp(), p[7].exp(), p[8].exp()) }
    }

    /// Axes of the template in the scan, as columns: left, back, up.
    pub fn rotation(&self) -> &Mat3 {
        &self.rotation
    }

    /// Sizes along left, back and up against the template.
    pub fn size(&self) -> &Vec3 {
        &self.size
    }

    /// The template bent and narrowed, before it is scaled.
    fn shaped(&self, x: &Vec3) -> Vec3 {
        let narrow = (-(x.y + 8.0) / 60.0).clamp(0.0, 1.0);
        let mut y = Vec3::new(x.x * (1.0 + self.p[10] * narrow), x.y, x.z);
        let bend = self.p[9] * (-(x.y + 8.0) / 30.0).clamp(0.0, 1.0) * (-(x.z + 30.0) / 15.0).clamp(0.0, 1.0);
        if bend != 0.0 {
            /// What the bend turns about: y, z.
            const ANGLE: [f64; 2] = [-10.0, -50.0];
            let (s, c) = bend.sin_cos();
            let (dy, dz) = (y.y - ANGLE[0], y.z - ANGLE[1]);
            (y.y, y.z) = (ANGLE[0] + c * dy - s * dz, ANGLE[1] + s * dy + c * dz);
        }
        y
    }

    /// Place in the scan of a point of the template.
    pub fn place(&self, x: &Vec3) -> Vec3 {
        self.rotation * self.shaped(x).component_mul(&self.size)
            + self.origin
            + Vec3::new(self.p[0], self.p[1], self.p[2])
    }

    /// Point of the template at a place in the scan.
    pub fn local(&self, place: &Vec3) -> Vec3 {
        let shift = self.origin + Vec3::new(self.p[0], self.p[1], self.p[2]);
        let wanted = (self.rotation.transpose() * (place - shift)).component_div(&self.size);
        // Bend and narrowing are small: what they do is taken off again a few times.
        (0..4).fold(wanted, |x, _| x + wanted - self.shaped(&x))
    }
}
