//! Where things are in a head: the tip of the nose, the region of interest, the condyles, the mouth.

use super::clean::{components, largest};
use super::shapes::{both, join};
use super::{BakeOptions, Cuboid, Field, MeshingError, Surface, Volume};
use crate::math::Vec3;

/// The face about the nose tip, m: to the right, in front, below; to the left, behind, above.
const FACE: [[f64; 3]; 2] = [[-0.086, -0.006, -0.096], [0.086, 0.122, 0.082]];
/// Least size of the region of interest along each axis, m.
const OVERLAP: f64 = 8e-3;
/// Thickness of the foremost layer of skin, in voxels.
const LAYER: f64 = 0.5;
/// What places are rounded to, m.
const NANOMETRE: f64 = 1e-9;
/// Half width and half height of the mouth, and how far behind the front of the teeth the slit may reach, m.
const MOUTH: [f64; 3] = [0.025, 0.018, 0.010];
/// How far the rows of teeth reach beyond the mouth's box to the sides and to the back, and half the height of both
/// crowns, m.
const BITE: [f64; 3] = [0.030, 0.055, 0.012];
/// In the bite, tissue nearer than this to both jaws lies between their teeth, m: the crowns do not hold it.
const CROWN: f64 = 0.012;
/// Beside the lips the slit stays this far under the skin, m: the cheeks hang together.
const CHEEK: f64 = 0.008;

pub(super) fn empty(name: &'static str, iso: f64, volume: &Volume) -> MeshingError {
    let (least, most) = volume.range();
    MeshingError::EmptyIsosurface { name, iso, least: f64::from(least), most: f64::from(most) }
}

/// The middle of the foremost layer of skin in the volume: the tip of the nose, if the face is in it.
pub(super) fn nose_tip(volume: &Volume, options: &BakeOptions) -> Result<Vec3, MeshingError> {
    let grid = &volume.grid;
    let (number, sizes) = components(grid, |at| f64::from(volume.samples[at]) >= options.skin_hu);
    let largest = largest(&sizes);
    let Some(largest) = largest.filter(|&k| sizes[k] < grid.len()) else {
        return Err(empty("skin", options.skin_hu, volume));
    };
    let body = (0..grid.len()).filter(|&at| number[at] as usize == largest + 1);
    let front = body.clone().map(|at| grid.place(at).y).fold(f64::INFINITY, f64::min);
    // All voxels of the layer count: which of them is the foremost by round-off, or the first stored, says nothing.
    let depth = LAYER * (0..3).map(|a| (grid.direction[(1, a)] * grid.spacing[a]).abs()).sum::<f64>();
    let (n, sum) = body
        .map(|at| grid.place(at))
        .filter(|p| p.y < front + depth)
        .fold((0usize, Vec3::zeros()), |(n, s), p| (n + 1, s + p));
    if n == 0 {
        return Err(empty("skin", options.skin_hu, volume));
    }
    Ok(rounded(Vec3::new(sum.x / n as f64, front, sum.z / n as f64)))
}

/// Rounded so that sums in another order, or coordinates that were stored in another way, give the same.
fn rounded(p: Vec3) -> Vec3 {
    p.map(|x| (x / NANOMETRE).round() * NANOMETRE)
}

/// The region of interest, inside the volume.
pub(super) fn region(volume: &Volume, options: &BakeOptions, nose: &Vec3) -> Result<Cuboid, MeshingError> {
    let [low, high] = volume.grid.bounds();
    let [from, to] = options.roi.unwrap_or(FACE.map(|c| nose + Vec3::from(c)));
    let region = Cuboid { low: rounded(from.inf(&to).sup(&low)), high: rounded(from.sup(&to).inf(&high)) };
    if (region.high - region.low).min() < OVERLAP {
        return Err(MeshingError::Region {
            least: OVERLAP,
            region: [from.into(), to.into()],
            volume: [low.into(), high.into()],
        });
    }
    Ok(region)
}

/// Where the jaws part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mouth {
    /// Box about the lips, from commissure to commissure and from the skin to the front teeth: the slit parts all of it.
    pub lips: Cuboid,
    /// Box about the rows of teeth: in it the slit parts what lies between them, and their crowns hold nothing.
    bite: Cuboid,
}

impl Mouth {
    fn of(lips: Cuboid) -> Self {
        let z = 0.5 * (lips.low.z + lips.high.z);
        let low = Vec3::new(lips.low.x - BITE[0], lips.low.y, z - BITE[2]);
        Self { lips, bite: Cuboid { low, high: Vec3::new(lips.high.x + BITE[0], lips.high.y + BITE[1], z + BITE[2]) } }
    }

    /// Corners of the box that lips and bite fill together, m.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        (self.lips.low.inf(&self.bite.low), self.lips.high.sup(&self.bite.high))
    }

    /// Distance from the rim of the slit, negative where tissue is parted: by the distances from skull and mandible and the
    /// depth under the skin, m; `blend` is the radius of its corners.
    pub fn rim(&self, p: &Vec3, to: [f64; 2], depth: f64, blend: f64) -> f64 {
        let beyond = |b: &Cuboid, a: usize| (b.low[a] - p[a]).max(p[a] - b.high[a]);
        let lips = [p.y - self.lips.high.y, beyond(&self.lips, 2)]
            .into_iter()
            .fold(beyond(&self.lips, 0), |all, d| both(all, d, blend));
        let bite = [to[1] - CROWN, CHEEK - depth, beyond(&self.bite, 0), p.y - self.bite.high.y, beyond(&self.bite, 2)]
            .into_iter()
            .fold(to[0] - CROWN, |all, d| both(all, d, blend));
        join(lips, bite, blend)
    }

    /// How near a second bone may be to a point that a bone holds, m; `joint` outside the bite.
    pub fn apart(&self, p: &Vec3, joint: f64) -> f64 {
        if self.bite.at(p) < 0.0 { joint.max(CROWN) } else { joint }
    }
}

/// The mouth: its box given, or about the front teeth, where skull and mandible come nearest near the median plane, and from
/// commissure to commissure.
pub(super) fn mouth(
    options: &BakeOptions,
    bones: &[Surface],
    nose: &Vec3,
    commissures: Option<[Vec3; 2]>,
    told: bool,
) -> Option<Mouth> {
    if !options.slit || !told {
        return None;
    }
    if let Some([a, b]) = options.mouth {
        return Some(Mouth::of(Cuboid { low: a.inf(&b), high: a.sup(&b) }));
    }
    let near = |p: &&Vec3| (p.x - nose.x).abs() < 0.012 && p.z < nose.z - 0.012 && p.z > nose.z - 0.085;
    let front = |s: &Surface| s.vertices.iter().filter(near).map(|p| p.y).fold(f64::INFINITY, f64::min);
    let teeth = |s: &Surface, y: f64| {
        s.vertices.iter().filter(near).filter(|p| p.y < y + 0.012).map(|p| p.z).collect::<Vec<_>>()
    };
    let (upper_y, lower_y) = (front(&bones[0]), front(&bones[1]));
    let upper = teeth(&bones[0], upper_y).into_iter().fold(f64::INFINITY, f64::min);
    let lower = teeth(&bones[1], lower_y).into_iter().fold(f64::NEG_INFINITY, f64::max);
    let z = 0.5 * (upper + lower);
    if !z.is_finite() {
        return None;
    }
    let back = upper_y.max(lower_y) + MOUTH[2];
    let [right, left] =
        commissures.map_or([nose.x - MOUTH[0], nose.x + MOUTH[0]], |[a, b]| [a.x.min(b.x), a.x.max(b.x)]);
    let low = Vec3::new(right, nose.y - 0.02, z - MOUTH[1]);
    Some(Mouth::of(Cuboid { low, high: Vec3::new(left, back, z + MOUTH[1]) }))
}
