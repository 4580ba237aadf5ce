//! What the tests of this binary share: seeded numbers, scenes from text, ports by name.

use std::sync::Arc;

use cutis::effect::Law;
use cutis::math::{self, Mat3, Vec3};
use cutis::sim::Sim;

/// The crate's reproducible generator about zero.
pub struct Random(pub u64);

impl Random {
    /// Uniform in [-1, 1).
    pub fn number(&mut self) -> f64 {
        let mut random = math::Random(self.0);
        let number = 2.0 * random.number() - 1.0;
        self.0 = random.0;
        number
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

/// Why a scene is not taken.
pub fn refused(scene: &str) -> String {
    match cutis::load::from_text(scene, None) {
        Ok(_) => panic!("accepted:\n{scene}"),
        Err(e) => e.to_string(),
    }
}

pub fn port(sim: &Sim, name: &str) -> usize {
    sim.model().port(name).unwrap_or_else(|| panic!("no port {name}"))
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

/// Marks the lines of `[mesh]` of a kind of element whose tissue averages pressure at the nodes.
pub const NODAL: &str = "# nodal pressure\n";

/// `scene` with averaged pressure, if its `[mesh]` is so marked.
pub fn with_pressure(scene: &str) -> String {
    if scene.contains(NODAL) {
        scene.replace("[[tissue]]\n", "[[tissue]]\npressure = \"nodal\"\n")
    } else {
        scene.into()
    }
}

/// Constants of a law at a stiffness of about `E` Pa and a Poisson's ratio of 0.4, in the law's order.
pub fn constants(law: &Law, E: f64) -> Vec<Vec<f64>> {
    let mu = E / 2.8;
    let of = |key: &&str| match (*key, law.name) {
        ("E", _) => vec![E],
        ("nu", _) => vec![0.4],
        ("mu", "ogden") => vec![0.7 * mu, 0.3 * mu],
        ("alpha", _) => vec![5.0, -2.0],
        ("mu", _) => vec![mu],
        ("b", _) => vec![2.0],
        ("c10", "yeoh") => vec![0.5 * mu],
        ("c10", _) => vec![0.4 * mu],
        ("c01", _) => vec![0.1 * mu],
        ("c20", _) => vec![0.3 * mu],
        ("c30", _) => vec![0.1 * mu],
        ("c1", _) => vec![mu / 1.5],
        ("c2", _) => vec![1.5],
        ("kappa", _) => vec![mu * 14.0 / 3.0],
        (key, law) => panic!("no sample for {key} of {law}"),
    };
    law.keys.iter().map(of).collect()
}

/// The same as lines of a `[[tissue]]`.
pub fn tissue(law: &Law, E: f64) -> String {
    let lines = law.keys.iter().zip(constants(law, E)).map(|(key, v)| match v[..] {
        [one] => format!("{key} = {one:?}\n"),
        _ => format!("{key} = {v:?}\n"),
    });
    format!("energy = \"{}\"\n{}", law.name, lines.collect::<String>())
}
