//! Methods that finite elements are compared with, each as its source has it: no scene uses them.
#![forbid(unsafe_code)]
#![allow(non_snake_case)]

mod implicit;
mod pass_on;

pub use implicit::{Control, Implicit, displacement};
pub use pass_on::{Passed, Rules, pass_on};
