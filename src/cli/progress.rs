//! Progress on long work; silent where standard error is no terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar of `n` steps with a caption.
pub fn bar(n: usize, caption: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg:24} [{bar:30}] {pos}/{len} {elapsed}").expect("a legal template");
    ProgressBar::new(n as u64).with_style(style).with_message(caption)
}

/// A bar that follows a stage's name and share done (0..1).
pub fn stages() -> ProgressBar {
    let style = ProgressStyle::with_template("{msg:24} [{bar:30}] {percent} % {elapsed}").expect("a legal template");
    ProgressBar::new(100).with_style(style)
}
