//! What the tests of this binary share: seeded numbers, scenes from text, ports by name.

use std::sync::Arc;

use cutis::math::{Mat3, Vec3};
use cutis::sim::Sim;

/// A small reproducible generator (SplitMix64; Steele, Lea & Flood, OOPSLA 2014).
pub struct Random(pub u64);

impl Random {
    /// Uniform in [-1, 1).
    pub fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.number(), self.number(), self.number())
    }
    pub fn matrix(&mut self) -> Mat3 {
        Mat3::from_fn(|_, _| self.number())
    }
}

pub fn sim(scene: &str) -> Sim {
    let loaded = cutis::load::from_text(scene, None).unwrap_or_else(|e| panic!("{e}"));
    Sim::new(Arc::new(loaded.model)).expect("a new simulation")
}

pub fn port(sim: &Sim, name: &str) -> usize {
    sim.model().ports().iter().position(|p| p.name == name).unwrap_or_else(|| panic!("no port {name}"))
}

pub fn set(sim: &mut Sim, name: &str, offset: usize, values: &[f64]) {
    let p = port(sim, name);
    sim.set_f64(p, offset, values).expect(name);
}

pub fn get(sim: &Sim, name: &str) -> Vec<f64> {
    let p = port(sim, name);
    let mut out = vec![0.0; sim.model().ports()[p].len()];
    sim.get_f64(p, 0, &mut out).expect(name);
    out
}

/// Rows of three as vectors.
pub fn rows(values: &[f64]) -> Vec<Vec3> {
    values.chunks_exact(3).map(Vec3::from_column_slice).collect()
}

pub fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().map(f64::abs).fold(0.0, f64::max)
}
