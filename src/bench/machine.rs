//! What one core of this machine can do at best.

use std::hint::black_box;

use pulp::{Arch, Simd, WithSimd};

use super::median_time;

/// Seconds that a measurement takes.
const LONG_ENOUGH: f64 = 0.2;
/// Sums that run side by side, so that no addition waits for the one before.
const SUMS: usize = 16;
/// Rounds of multiply-adds of a measurement.
const ROUNDS: usize = 100_000;

/// Bytes a second that one core reads, again and again, from a list of `bytes` bytes: large lists lie in memory, small
/// ones in a cache.
pub fn bandwidth(bytes: usize) -> f64 {
    let list = vec![1.0_f32; (bytes / 4).next_multiple_of(16 * SUMS)];
    let time = median_time(LONG_ENOUGH, || {
        black_box(Arch::new().dispatch(Sum(black_box(&list))));
    });
    (4 * list.len()) as f64 / time
}

/// Multiplications and additions a second in single precision that one core does in its registers.
pub fn multiply_adds() -> f64 {
    let mut count = 0;
    let time = median_time(LONG_ENOUGH, || {
        let (value, n) = Arch::new().dispatch(Multiply(black_box(0.999_999)));
        black_box(value);
        count = n;
    });
    2.0 * count as f64 / time
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

struct Multiply(f32);

impl WithSimd for Multiply {
    type Output = (f32, usize);

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> (f32, usize) {
        let factor = simd.splat_f32s(self.0);
        let mut sums = [simd.splat_f32s(1.0); SUMS];
        for _ in 0..ROUNDS {
            for sum in sums.iter_mut() {
                *sum = simd.mul_add_f32s(*sum, factor, factor);
            }
        }
        (sums.iter().map(|sum| simd.reduce_sum_f32s(*sum)).sum(), ROUNDS * SUMS * S::F32_LANES)
    }
}
