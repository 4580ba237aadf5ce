//! Pictures: a small software renderer, so that a person can look at a result without other programs.
#![forbid(unsafe_code)]

mod chart;
mod colour;
mod font;
mod image;
mod render;

pub use chart::{Chart, Mark, escape};
pub use colour::{Rgb, heat};
pub use image::Image;
pub use render::{Camera, Surface, draw};
