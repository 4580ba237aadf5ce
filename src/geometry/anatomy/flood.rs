//! Marked parts grown through the samples between them, densest first: they meet where the density has its valley.
//!
//! Source: F. Meyer, "Topographic distance and watershed lines", Signal Processing 38(1), 1994.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::super::Grid;
use super::super::clean::each_neighbour;

/// Grows the marks (0 where there is none) through all samples that are `open`, by falling `density`.
pub(in super::super) fn watershed(
    grid: &Grid,
    density: impl Fn(usize) -> f32,
    open: impl Fn(usize) -> bool,
    marks: &mut [u8],
) {
    /// Parts of one HU that densities are told apart by.
    const STEPS: f32 = 4.0;
    let mut queue: BinaryHeap<(i32, Reverse<u32>, Reverse<u32>, u8)> = BinaryHeap::new();
    let mut order = 0u32;
    let mut spread = |queue: &mut BinaryHeap<_>, marks: &[u8], at: usize| {
        each_neighbour(grid, at, |other| {
            if marks[other] == 0 && open(other) {
                queue.push(((density(other) * STEPS) as i32, Reverse(order), Reverse(other as u32), marks[at]));
                order = order.wrapping_add(1);
            }
        });
    };
    (0..marks.len()).filter(|&at| marks[at] != 0).for_each(|at| spread(&mut queue, marks, at));
    while let Some((_, _, Reverse(at), mark)) = queue.pop() {
        let at = at as usize;
        if marks[at] == 0 {
            marks[at] = mark;
            spread(&mut queue, marks, at);
        }
    }
}
