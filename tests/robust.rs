//! Does it survive: inputs that are not numbers or far too large, violent motion, failed steps.
#![allow(non_snake_case)]

#[path = "verify/common.rs"]
#[allow(dead_code)]
mod common;
#[path = "robust/fuzz.rs"]
mod fuzz;
#[path = "robust/inputs.rs"]
mod inputs;
#[path = "robust/torture.rs"]
mod torture;
#[path = "robust/violent.rs"]
mod violent;
