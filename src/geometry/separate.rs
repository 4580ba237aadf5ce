//! Which bone a bone voxel belongs to: labels if there are any, else parts of dense bone that do not touch.
//!
//! Without labels the threshold is raised until the mandible (the dense bone behind the chin) hangs together with nothing
//! else; the dense parts are then grown back through the bone, densest first.
//!
//! Source: F. Meyer, "Topographic distance and watershed lines", Signal Processing 38(1), 1994, for the growth.

use std::collections::BinaryHeap;

use super::clean::{components, each_neighbour};
use super::{Labels, Volume};
use crate::math::Vec3;

/// Names of the bones, numbered from 1 in a bone map.
pub(super) const BONES: [&str; 3] = ["skull", "mandible", "spine"];
/// Their numbers in a labels file.
pub(super) const LABELS: [u8; 3] = [2, 3, 4];
const SKULL: u8 = 1;
const MANDIBLE: u8 = 2;
const SPINE: u8 = 3;

/// Thresholds tried for dense bone, HU.
const DENSE: [f64; 9] = [400.0, 500.0, 600.0, 700.0, 800.0, 900.0, 1000.0, 1150.0, 1300.0];
/// Dense volume of a mandible, m3, and the least of another bone's part.
const MANDIBLE_VOLUME: [f64; 2] = [4e-6, 90e-6];
const PART: f64 = 0.05e-6;
/// Below the nose tip the chin is sought between these depths, m.
const CHIN: [f64; 2] = [-0.095, -0.045];
/// Half width about the nose's plane in which the chin is sought, m.
const MEDIAN: f64 = 0.015;
/// A mandible does not rise more than this above the nose tip, m.
const CONDYLE: f64 = 0.025;

/// Bone number of each sample (0 where there is none), and whether skull and mandible could be told apart.
pub(super) fn bone_map(volume: &Volume, bone: f64, labels: Option<&Labels>, nose: &Vec3) -> (Vec<u8>, bool) {
    let grid = &volume.grid;
    let is_bone = |at: usize| f64::from(volume.samples[at]) >= bone;
    let position = |at: usize| {
        let [nx, ny, _] = grid.dims;
        grid.world(&Vec3::new((at % nx) as f64, (at / nx % ny) as f64, (at / (nx * ny)) as f64))
    };
    let (mut map, told) = match labels {
        Some(labels) => {
            let of = |at: usize| {
                let label = labels.at(&position(at));
                LABELS.iter().zip(SKULL..).find(|(l, _)| **l == label).map_or(0, |(_, bone)| bone)
            };
            let map: Vec<u8> = (0..grid.len()).map(|at| if is_bone(at) { of(at) } else { 0 }).collect();
            let told = map.contains(&SKULL) && map.contains(&MANDIBLE);
            (map, told)
        }
        None => match dense_parts(volume, nose, &position) {
            Some(map) => (map, true),
            None => ((0..grid.len()).map(|at| if is_bone(at) { SKULL } else { 0 }).collect(), false),
        },
    };
    grow_back(volume, bone, &mut map);
    // Bone that no part reached belongs to the skull: loose teeth, cartilage, streaks.
    (0..map.len())
        .filter(|&at| is_bone(at) && map[at] == 0)
        .collect::<Vec<_>>()
        .into_iter()
        .for_each(|at| map[at] = SKULL);
    (map, told)
}

/// Markers: the mandible, and the other dense parts by position.
fn dense_parts(volume: &Volume, nose: &Vec3, position: &dyn Fn(usize) -> Vec3) -> Option<Vec<u8>> {
    let grid = &volume.grid;
    let voxel = grid.spacing.product();
    for dense in DENSE {
        let (number, sizes) = components(grid, |at| f64::from(volume.samples[at]) >= dense);
        let in_chin = |p: &Vec3| (p.x - nose.x).abs() < MEDIAN && (nose.z + CHIN[0]..nose.z + CHIN[1]).contains(&p.z);
        let big = |at: usize| number[at] != 0 && sizes[number[at] as usize - 1] as f64 * voxel > MANDIBLE_VOLUME[0];
        let front = (0..grid.len())
            .filter(|&at| big(at))
            .map(|at| (position(at), number[at]))
            .filter(|(p, _)| in_chin(p))
            .min_by(|(p, _), (q, _)| p.y.total_cmp(&q.y));
        let Some((_, mandible)) = front else { continue };
        let n = sizes.len() + 1;
        let (mut sum, mut top, mut low) = (vec![Vec3::zeros(); n], vec![f64::NEG_INFINITY; n], vec![f64::INFINITY; n]);
        for at in (0..grid.len()).filter(|&at| number[at] != 0) {
            let (c, p) = (number[at] as usize, position(at));
            sum[c] += p;
            top[c] = top[c].max(p.z);
            low[c] = low[c].min(p.z);
        }
        let m = mandible as usize;
        let volume_of = |c: usize| sizes[c - 1] as f64 * voxel;
        if volume_of(m) > MANDIBLE_VOLUME[1] || top[m] > nose.z + CONDYLE {
            continue;
        }
        let centre = |c: usize| sum[c] / sizes[c - 1] as f64;
        let name = |c: usize| {
            if c == m {
                MANDIBLE
            } else if volume_of(c) < PART {
                0
            } else if centre(c).y > centre(m).y + 0.03 && top[c] < top[m] {
                SPINE
            } else if top[c] < centre(m).z + 0.02 && centre(c).y < centre(m).y + 0.03 {
                // Loose lower teeth and splinters of the jaw.
                MANDIBLE
            } else {
                SKULL
            }
        };
        let names: Vec<u8> = (0..n).map(|c| if c == 0 { 0 } else { name(c) }).collect();
        if names.contains(&SKULL) {
            return Some(number.iter().map(|&c| names[c as usize]).collect());
        }
    }
    None
}

/// Grows the marked parts through the bone, densest first.
fn grow_back(volume: &Volume, bone: f64, map: &mut [u8]) {
    let grid = &volume.grid;
    let key = |at: usize| (volume.samples[at] * 4.0) as i32;
    let mut queue: BinaryHeap<(i32, std::cmp::Reverse<u32>, std::cmp::Reverse<u32>, u8)> = BinaryHeap::new();
    let mut order = 0u32;
    let mut push = |queue: &mut BinaryHeap<_>, at: usize, id: u8| {
        queue.push((key(at), std::cmp::Reverse(order), std::cmp::Reverse(at as u32), id));
        order = order.wrapping_add(1);
    };
    let open = |map: &[u8], at: usize| map[at] == 0 && f64::from(volume.samples[at]) >= bone;
    for at in 0..map.len() {
        if map[at] != 0 {
            each_neighbour(grid, at, |other| {
                if open(map, other) {
                    push(&mut queue, other, map[at]);
                }
            });
        }
    }
    while let Some((_, _, std::cmp::Reverse(at), id)) = queue.pop() {
        let at = at as usize;
        if !open(map, at) {
            continue;
        }
        map[at] = id;
        each_neighbour(grid, at, |other| {
            if open(map, other) {
                push(&mut queue, other, id);
            }
        });
    }
}
