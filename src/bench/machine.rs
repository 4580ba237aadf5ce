//! What one core of this machine can do at best.

use std::hint::black_box;
use std::time::Instant;

use pulp::{Arch, Simd, WithSimd};

use super::{median, median_time};

/// Seconds that a measurement takes.
const LONG_ENOUGH: f64 = 0.2;
/// Sums that run side by side, so that no addition waits for the one before.
const SUMS: usize = 16;
/// Times that two cores read their lists, and tries of that.
const PASSES: usize = 8;
const TRIES: usize = 5;

/// Bytes a second that one core reads, again and again, from a list of `bytes` bytes: large lists lie in memory, small
/// ones in a cache.
pub fn bandwidth(bytes: usize) -> f64 {
    let list = vec![1.0_f32; (bytes / 4).next_multiple_of(16 * SUMS)];
    let time = median_time(LONG_ENOUGH, || {
        black_box(Arch::new().dispatch(Sum(black_box(&list))));
    });
    (4 * list.len()) as f64 / time
}

/// How many times the bytes of one core two read, each its own list of `bytes` bytes: what a second thread could add to
/// work that waits for memory. By the clock, so it wants a machine with nothing else to do.
pub fn second_core(bytes: usize) -> f64 {
    let list = vec![1.0_f32; (bytes / 4).next_multiple_of(16 * SUMS)];
    let pass = |list: &[f32]| {
        for _ in 0..PASSES {
            black_box(Arch::new().dispatch(Sum(black_box(list))));
        }
    };
    let time = |body: &dyn Fn()| {
        let mut times: Vec<f64> = (0..TRIES)
            .map(|_| {
                let start = Instant::now();
                body();
                start.elapsed().as_secs_f64()
            })
            .collect();
        median(&mut times)
    };
    let other = list.clone();
    let alone = time(&|| pass(&list));
    let both = time(&|| {
        std::thread::scope(|scope| {
            scope.spawn(|| pass(&other));
            pass(&list);
        });
    });
    2.0 * alone / both
}

struct Sum<'a>(&'a [f32]);

impl WithSimd for Sum<'_> {
    type Output = f32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f32 {
        let mut sums = [simd.splat_f32s(0.0); SUMS];
        for values in S::as_simd_f32s(self.0).0.chunks_exact(SUMS) {
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum = simd.add_f32s(*sum, *value);
            }
        }
        sums.iter().map(|sum| simd.reduce_sum_f32s(*sum)).sum()
    }
}
