//! How fast the parts of a step are, beside what this machine's memory allows.
//!
//! ```text
//! machine: bytes read a second      parts: forces, stiffness, factor, solve on a block
//! steps:   CPU time, linear solves and error of the skin in scenes that other codes are measured in, too; time by the
//!          clock with one thread and with two
//! ```
#![forbid(unsafe_code)]
#![allow(non_snake_case)]

mod machine;
mod parts;
mod scenes;
mod steps;

pub use machine::{bandwidth, second_core};
pub use parts::{Parts, parts};
pub use scenes::{SCENES, SIZES, Scene, Size};
pub use steps::{Steps, second_thread, steps};

use cpu_time::ThreadTime;

/// CPU seconds of this thread for one run of `body`: the median of as many runs as fit into `seconds`, three at least.
pub fn median_time(seconds: f64, mut body: impl FnMut()) -> f64 {
    body();
    let (start, mut times) = (ThreadTime::now(), Vec::new());
    while times.len() < 3 || start.elapsed().as_secs_f64() < seconds {
        let start = ThreadTime::now();
        body();
        times.push(start.elapsed().as_secs_f64());
    }
    median(&mut times)
}

/// The middle one; 0 for none.
pub fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
