//! The domain of a face in a CT: what is read, where it ends inside, the surfaces that bound it and their distances.

use super::bones::BONES;
use super::clean::{crop, each_neighbour, flood};
use super::distance::{band, carry_on, travel};
use super::sampled::Sampled;
use super::{BakeOptions, Cuboid, Distance, Field, Grid, Surface, Volume};
use crate::math::Vec3;

/// What is read round the region of interest, m, so that distances at its rim are right.
const MARGIN: f64 = 0.010;
/// Ways into the depth pass bone at this distance at least, m: not through the thin roof of an orbit into the brain.
const PASSAGE: f64 = 3e-3;
/// Behind bones everything this much too deep is bone, m, of a density this far above the threshold, HU.
const BEHIND: f32 = 0.010;
const BACKING: f64 = 200.0;

/// The samples of a volume in and round a region.
pub(super) fn part_of(volume: &Volume, region: &Cuboid) -> Volume {
    let grid = &volume.grid;
    let far = Vec3::repeat(f64::INFINITY);
    let (low, high) = (0..8).fold((far, -far), |(low, high), corner| {
        let p =
            Vec3::from_fn(|a, _| if corner >> a & 1 == 0 { region.low[a] - MARGIN } else { region.high[a] + MARGIN });
        let c = grid.coordinates(&p);
        (low.inf(&c), high.sup(&c))
    });
    let bound = |c: f64, a: usize| c.clamp(0.0, grid.dims[a] as f64 - 1.0) as usize;
    crop(volume, [0, 1, 2].map(|a| bound(low[a].floor(), a)), [0, 1, 2].map(|a| bound(high[a].ceil(), a)))
}

/// Where the mesh ends inside: the way from the outer skin round the bones, less how far it may be, m. What lies behind
/// bones, too deep to be meshed, is made bone: a thin table of bone has no second side that a lattice could break through
/// to. What is only a little too deep stays, so that no such filling bounds the mesh.
pub(super) fn deep(part: &mut Volume, options: &BakeOptions, outer: &[bool], to_bone: &Distance) -> Vec<f32> {
    let tissue = |hu: &f32| f64::from(*hu) >= options.skin_hu;
    let sources: Vec<bool> = outer.iter().zip(&part.samples).map(|(&o, hu)| o && !tissue(hu)).collect();
    let most = options.depth as f32;
    // A volume without air in front of it has no skin to start from: then nothing is too deep.
    if !sources.contains(&true) {
        return vec![-most; part.grid.len()];
    }
    let blocked: Vec<bool> = to_bone.values.iter().map(|&d| f64::from(d) < PASSAGE).collect();
    let mut way = travel(&part.grid, &sources, &blocked);
    let front: Vec<bool> = way.iter().zip(&blocked).map(|(w, b)| !b && *w <= most + BEHIND).collect();
    // Tissue next to bone has no way of its own: it belongs to the side that it hangs on.
    let soft = |at: usize| f64::from(part.samples[at]) < options.bone_hu;
    let mut side: Vec<u8> = front.iter().zip(&blocked).map(|(&f, &b)| if f { 1 } else { 2 * u8::from(!b) }).collect();
    let mut queue: Vec<usize> = (0..side.len()).filter(|&at| side[at] != 0).collect();
    let mut next = 0;
    while next < queue.len() {
        let at = queue[next];
        next += 1;
        each_neighbour(&part.grid, at, |other| {
            if side[other] == 0 && soft(other) {
                side[other] = side[at];
                queue.push(other);
            }
        });
    }
    for (hu, _) in part.samples.iter_mut().zip(&side).filter(|(_, side)| **side != 1) {
        *hu = hu.max((options.bone_hu + BACKING) as f32);
    }
    carry_on(&part.grid, &mut way, &front);
    way.into_iter().map(|w| (w - most).clamp(-most, most)).collect()
}

/// Signed distance to an isosurface on another grid: exact next to it, sampled further off.
pub(super) fn resampled(grid: &Grid, volume: &Volume, iso: f64, distance: &Distance) -> Sampled {
    let mut values = band(grid, &distance.surface);
    for (at, d) in values.iter_mut().enumerate() {
        let p = grid.place(at);
        if !d.is_finite() {
            *d = distance.at(&p) as f32;
        } else if volume.sample(&p) >= iso {
            *d = -*d;
        }
    }
    Sampled::new(grid, values)
}

/// The triangles of each bone, by the bone of the nearest bone sample.
pub(super) fn split_bones(part: &Volume, surface: &Surface, map: &[u8]) -> [Surface; BONES.len()] {
    let grid = &part.grid;
    let bone_at = |t: usize| {
        let corners = surface.corners(t);
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let ([i, j, k], _) = grid.cell(&middle);
        let around = (0..8).map(|c| grid.index([i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1)]));
        let distance = |at: usize| (grid.place(at) - middle).norm_squared();
        let nearest = around.filter(|&at| map[at] != 0).min_by(|&p, &q| distance(p).total_cmp(&distance(q)));
        nearest.map_or(0, |at| usize::from(map[at]) - 1)
    };
    let mut parts: [Surface; BONES.len()] = std::array::from_fn(|_| Surface::default());
    for t in 0..surface.triangles.len() {
        parts[bone_at(t)].triangles.push(surface.triangles[t]);
    }
    parts.map(|p| compacted(surface, p.triangles))
}

/// A part of a surface with only the vertices it uses.
pub(super) fn compacted(surface: &Surface, mut triangles: Vec<[u32; 3]>) -> Surface {
    let mut new = vec![u32::MAX; surface.vertices.len()];
    let mut vertices = Vec::new();
    for a in triangles.iter_mut().flatten() {
        let n = &mut new[*a as usize];
        if *n == u32::MAX {
            *n = vertices.len() as u32;
            vertices.push(surface.vertices[*a as usize]);
        }
        *a = *n;
    }
    Surface { vertices, triangles }
}

/// The part of the skin that faces outer air, or that which does not.
pub(super) fn skin_part(surface: &Surface, part: &Volume, outer: &[bool], wanted: bool) -> Surface {
    let is_outer = |t: &[u32; 3]| outer[part.grid.index(part.grid.nearest(&surface.vertices[t[0] as usize]))];
    compacted(surface, surface.triangles.iter().filter(|t| is_outer(t) == wanted).copied().collect())
}

/// Samples of tissue that hang together with the outer skin, inside the region and not too deep.
pub(super) fn reached(
    part: &Volume,
    options: &BakeOptions,
    outer: &[bool],
    region: &Cuboid,
    deep: &dyn Field,
) -> Vec<bool> {
    let grid = &part.grid;
    let tissue = |at: usize| (options.skin_hu..options.bone_hu).contains(&f64::from(part.samples[at]));
    let inside = |at: usize| {
        let p = grid.place(at);
        tissue(at) && region.at(&p) <= 0.0 && deep.at(&p) <= 0.0
    };
    let seeds = (0..grid.len()).filter(|&at| outer[at]);
    let reached = flood(grid, seeds, inside);
    if reached.contains(&true) { reached } else { (0..grid.len()).map(inside).collect() }
}

/// Volume of samples inside a region, m3; those at its rim count with what lies inside.
pub(super) fn volume_of(part: &Volume, reached: &[bool], region: &Cuboid) -> f64 {
    let grid = &part.grid;
    // Half the extent of a voxel along the world axes.
    let half = grid.direction.map(f64::abs) * grid.spacing / 2.0;
    let share = |at: usize| {
        let p = grid.place(at);
        let overlap = (p + half).inf(&region.high) - (p - half).sup(&region.low);
        overlap.sup(&Vec3::zeros()).component_div(&(2.0 * half)).product()
    };
    (0..reached.len()).filter(|&at| reached[at]).map(share).sum::<f64>() * grid.spacing.product()
}

/// The part of a surface with tissue of the region beside it.
pub(super) fn beside(surface: &Surface, part: &Volume, reached: &[bool]) -> Surface {
    let grid = &part.grid;
    let near = |t: &&[u32; 3]| {
        let ([i, j, k], _) = grid.cell(&surface.vertices[t[0] as usize]);
        (0..8).any(|c| reached[grid.index([i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1)])])
    };
    compacted(surface, surface.triangles.iter().filter(near).copied().collect())
}
