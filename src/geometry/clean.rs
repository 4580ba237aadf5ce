//! A CT crop made fit for meshing: one body, solid bones, outer air told from inner air.

use super::{Distance, Grid, Volume};
use crate::math::Vec3;

/// Air, HU: what lies outside the body is set to it.
const AIR: f32 = -1000.0;
/// Bone pieces smaller than this that touch nothing, m3, are streaks of fillings, calcifications, splinters of turbinates:
/// soft tissue. A hyoid has 1.5 mL, a tooth stands in its jaw.
const ISLAND: f64 = 0.5e-6;
/// Soft tissue, HU.
const SOFT: f32 = 60.0;
/// Passages narrower than twice this are closed when bone is filled, m: marrow behind thin cortex, the brain behind the
/// orbits' fissures, sinuses, the joint's and the teeth's gaps.
const BONE_REACH: f64 = 3e-3;
/// Passages narrower than twice this part inner from outer air, m: nostrils and the mouth.
const AIR_REACH: f64 = 4e-3;
/// A region found beyond a reach is regrown by that reach and this many voxels, to touch the surface again.
const REGROW: f64 = 1.5;

/// The samples of a volume whose indices lie in `low..=high`.
pub(super) fn crop(volume: &Volume, low: [usize; 3], high: [usize; 3]) -> Volume {
    let grid = &volume.grid;
    let dims = [0, 1, 2].map(|a| high[a] - low[a] + 1);
    let origin = grid.world(&Vec3::from(low.map(|c| c as f64)));
    let mut samples = Vec::with_capacity(dims.iter().product());
    for k in low[2]..=high[2] {
        for j in low[1]..=high[1] {
            let row = grid.index([low[0], j, k]);
            samples.extend_from_slice(&volume.samples[row..row + dims[0]]);
        }
    }
    Volume { grid: Grid { dims, origin, ..grid.clone() }, samples }
}

/// Calls `visit` with the up to six neighbours of a sample.
pub(super) fn each_neighbour(grid: &Grid, at: usize, mut visit: impl FnMut(usize)) {
    let [nx, ny, nz] = grid.dims;
    let c = [at % nx, at / nx % ny, at / (nx * ny)];
    for (a, stride) in [1, nx, nx * ny].into_iter().enumerate() {
        if c[a] > 0 {
            visit(at - stride);
        }
        if c[a] + 1 < [nx, ny, nz][a] {
            visit(at + stride);
        }
    }
}

/// Samples connected to the seeds through samples that pass.
pub(super) fn flood(grid: &Grid, seeds: impl Iterator<Item = usize>, pass: impl Fn(usize) -> bool) -> Vec<bool> {
    let mut reached = vec![false; grid.len()];
    let mut stack: Vec<usize> = Vec::new();
    for seed in seeds {
        if pass(seed) && !reached[seed] {
            reached[seed] = true;
            stack.push(seed);
        }
    }
    while let Some(at) = stack.pop() {
        each_neighbour(grid, at, |other| {
            if !reached[other] && pass(other) {
                reached[other] = true;
                stack.push(other);
            }
        });
    }
    reached
}

/// Number (from 1) of the connected component of each sample that passes, 0 for the others; and their sizes.
pub(super) fn components(grid: &Grid, pass: impl Fn(usize) -> bool) -> (Vec<u32>, Vec<usize>) {
    let mut number = vec![0u32; grid.len()];
    let mut sizes = Vec::new();
    let mut stack = Vec::new();
    for seed in 0..grid.len() {
        if number[seed] != 0 || !pass(seed) {
            continue;
        }
        let mine = sizes.len() as u32 + 1;
        let mut size = 0;
        number[seed] = mine;
        stack.push(seed);
        while let Some(at) = stack.pop() {
            size += 1;
            each_neighbour(grid, at, |other| {
                if number[other] == 0 && pass(other) {
                    number[other] = mine;
                    stack.push(other);
                }
            });
        }
        sizes.push(size);
    }
    (number, sizes)
}

/// The largest of some components by their sizes, the first of equals.
pub(super) fn largest(sizes: &[usize]) -> Option<usize> {
    (0..sizes.len()).max_by_key(|&k| (sizes[k], usize::MAX - k))
}

/// Grows a region by `radius` metres.
fn grow(grid: &Grid, region: &[bool], radius: f64) -> Vec<bool> {
    let mut grown = region.to_vec();
    let reach = [0, 1, 2].map(|a| (radius / grid.spacing[a]).floor() as i64);
    let mut ball = Vec::new();
    for k in -reach[2]..=reach[2] {
        for j in -reach[1]..=reach[1] {
            for i in -reach[0]..=reach[0] {
                let d = Vec3::new(i as f64, j as f64, k as f64).component_mul(&grid.spacing);
                if d.norm() <= radius {
                    ball.push([i, j, k]);
                }
            }
        }
    }
    let dims = grid.dims.map(|n| n as i64);
    for at in (0..region.len()).filter(|&at| region[at]) {
        let mut rim = false;
        each_neighbour(grid, at, |other| rim |= !region[other]);
        if !rim {
            continue;
        }
        let c = [at as i64 % dims[0], at as i64 / dims[0] % dims[1], at as i64 / (dims[0] * dims[1])];
        for step in &ball {
            let p = [0, 1, 2].map(|a| c[a] + step[a]);
            if (0..3).all(|a| p[a] >= 0 && p[a] < dims[a]) {
                grown[((p[2] * dims[1] + p[1]) * dims[0] + p[0]) as usize] = true;
            }
        }
    }
    grown
}

/// Keeps the largest connected body at or above `iso`; loose parts become air.
pub(super) fn one_body(volume: &mut Volume, iso: f64) {
    let (number, sizes) = components(&volume.grid, |at| f64::from(volume.samples[at]) >= iso);
    let Some(largest) = largest(&sizes) else { return };
    for (s, &n) in volume.samples.iter_mut().zip(&number) {
        if n != 0 && n as usize != largest + 1 {
            *s = AIR;
        }
    }
}

/// Makes small pieces of bone that hang on nothing soft tissue; those at the rim may go on beyond it and stay. Returns how many.
pub(super) fn soften_islands(volume: &mut Volume, bone: f64) -> usize {
    let grid = &volume.grid;
    let [nx, ny, nz] = grid.dims;
    let (number, sizes) = components(grid, |at| f64::from(volume.samples[at]) >= bone);
    let mut small: Vec<bool> = sizes.iter().map(|&n| (n as f64) * grid.spacing.product() < ISLAND).collect();
    let at_rim = |at: usize| {
        let c = [(at % nx, nx), (at / nx % ny, ny), (at / (nx * ny), nz)];
        c.iter().any(|&(c, n)| c == 0 || c + 1 == n)
    };
    (0..number.len()).filter(|&at| number[at] != 0 && at_rim(at)).for_each(|at| small[number[at] as usize - 1] = false);
    let soft = SOFT.min(bone as f32 - 1.0);
    for (s, _) in volume.samples.iter_mut().zip(&number).filter(|(_, n)| **n != 0 && small[**n as usize - 1]) {
        *s = soft;
    }
    small.iter().filter(|s| **s).count()
}

/// Fills marrow, sinuses, the skull's inside and whatever else only narrow passages lead to with bone. Returns the number of samples filled.
pub(super) fn solid_bones(volume: &mut Volume, bone: f64, to_bone: &Distance) -> usize {
    let grid = &volume.grid;
    // Air that only narrow passages lead to is a sinus: it belongs to the bone as well.
    let tissue = |at: usize| f64::from(volume.samples[at]) < bone;
    let wide = |at: usize| f64::from(volume.samples[at]) < bone && f64::from(to_bone.values[at]) > BONE_REACH;
    // Open is what the largest wide region (the air and the flesh of the face) leads to.
    let (number, sizes) = components(grid, wide);
    let Some(largest) = largest(&sizes) else { return 0 };
    let open: Vec<bool> = number.iter().map(|&n| n as usize == largest + 1).collect();
    let grown = grow(grid, &open, BONE_REACH + REGROW * grid.spacing.mean());
    let closed: Vec<usize> = (0..grid.len()).filter(|&at| tissue(at) && !grown[at]).collect();
    let filled = closed.len();
    for at in closed {
        // As far beyond the threshold as it was below: the surface of the filling stays where the grown region ends.
        volume.samples[at] = (bone + (bone - f64::from(volume.samples[at])).clamp(20.0, 200.0)) as f32;
    }
    filled
}

/// Samples in or near the air in front of the face, as far as wide passages lead.
pub(super) fn outer_air(volume: &Volume, skin: f64, to_skin: &Distance) -> Vec<bool> {
    let grid = &volume.grid;
    let air = |at: usize| f64::from(volume.samples[at]) < skin && f64::from(to_skin.values[at]) > AIR_REACH;
    let y = |at: usize| grid.place(at).y;
    let front = (0..grid.len()).filter(|&at| air(at)).map(y).fold(f64::INFINITY, f64::min);
    let step = grid.spacing.max();
    let seeds = (0..grid.len()).filter(|&at| air(at) && y(at) < front + step);
    let reached = flood(grid, seeds, air);
    grow(grid, &reached, AIR_REACH + REGROW * step)
}
