//! A block of 10 x 10 x 4 cm on bone, in the sizes and motions that other codes are measured with, too.

use std::f64::consts::TAU;

/// A number of cells, six tetrahedra each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// About how many tetrahedra.
    pub name: &'static str,
    /// Cells along x, y and z.
    pub cells: [usize; 3],
}

/// From about a thousand to about 200,000 tetrahedra.
pub const SIZES: [Size; 4] = [
    Size { name: "1k", cells: [8, 8, 3] },
    Size { name: "10k", cells: [17, 17, 6] },
    Size { name: "50k", cells: [28, 28, 11] },
    Size { name: "200k", cells: [44, 44, 17] },
];

/// A block in motion.
pub struct Scene {
    /// Name for the command line.
    pub name: &'static str,
    /// What moves, in one sentence.
    pub what: &'static str,
    /// Tables beside mesh and solver.
    tables: fn() -> String,
    /// Length of a step, s.
    pub dt: f64,
    /// Number of steps.
    pub steps: usize,
    /// Translation and rotation vector of the last bone at the end of step `k`, counted from 1.
    pub pose: fn(k: usize) -> ([f64; 3], [f64; 3]),
    /// Whether every node is read after a step, not the skin alone.
    pub whole: bool,
    /// Modes of vibration that it moves in; the tables then end with `[inertia]`.
    pub modes: Option<u32>,
    /// Largest nodal motion of the last correction, m.
    pub tolerance: f64,
}

/// Two bones below the block with a gap of 2 cm between them.
const JAW: &str = "[[bone]]\nname = \"skull\"\nnodes = \"z_min\"\nwithin = [[-1, -1, -1], [0.0401, 1, 1]]\ndrive = \"held\"\n\
    [[bone]]\nname = \"mandible\"\nnodes = \"z_min\"\nwithin = [[0.0599, -1, -1], [1, 1, 1]]\npivot = [0.1, 0.05, -0.02]\n";

/// The lower face as one bone, weight, and time.
const SHAKEN: &str = "[[bone]]\nname = \"bone\"\nnodes = \"z_min\"\n[gravity]\n[inertia]\nstart = \"rest\"\n";

fn tissue(energy: &str, nu: f64) -> String {
    format!("[[tissue]]\nenergy = \"{energy}\"\nE = 15e3\nnu = {nu:?}\ndensity = 1000\n")
}

/// 1.1 mm a step, 11 mm in all.
fn advance(k: usize) -> ([f64; 3], [f64; 3]) {
    ([0.0, 1e-3 * k as f64, 0.5e-3 * k as f64], [0.0; 3])
}

fn shake(k: usize) -> ([f64; 3], [f64; 3]) {
    ([0.01 * (TAU * 2.0 * k as f64 / 60.0).sin(), 0.0, 0.0], [0.0; 3])
}

fn turn(k: usize) -> ([f64; 3], [f64; 3]) {
    let s = (TAU * k as f64 / 60.0).sin();
    ([0.0, 5e-3 * s, 3e-3 * s], [0.05 * s, 0.1 * s, 0.0])
}

/// What is measured.
pub const SCENES: [Scene; 7] = [
    Scene {
        name: "advance",
        what: "equilibrium, stable neo-Hookean, nu 0.45, the jaw goes 1.1 mm a step",
        tables: || tissue("stable-neo-hookean", 0.45) + JAW,
        dt: 0.1,
        steps: 10,
        pose: advance,
        whole: false,
        modes: None,
        tolerance: 3e-6,
    },
    Scene {
        name: "advance-0.49",
        what: "the same at nu 0.49",
        tables: || tissue("stable-neo-hookean", 0.49) + JAW,
        dt: 0.1,
        steps: 10,
        pose: advance,
        whole: false,
        modes: None,
        tolerance: 3e-6,
    },
    Scene {
        name: "shake",
        what: "backward Euler, stable neo-Hookean, nu 0.45, weight from t = 0 on, the bone shaken at 2 Hz, 1/60 s a step",
        tables: || tissue("stable-neo-hookean", 0.45) + SHAKEN,
        dt: 1.0 / 60.0,
        steps: 60,
        pose: shake,
        whole: false,
        modes: None,
        tolerance: 3e-6,
    },
    Scene {
        name: "linear",
        what: "linear tissue, nu 0.45, the jaw shifts and turns, every node read",
        tables: || tissue("linear", 0.45) + JAW,
        dt: 0.1,
        steps: 60,
        pose: turn,
        whole: true,
        modes: None,
        tolerance: 3e-6,
    },
    Scene {
        name: "linear-skin",
        what: "the same, the skin alone read",
        tables: || tissue("linear", 0.45) + JAW,
        dt: 0.1,
        steps: 60,
        pose: turn,
        whole: false,
        modes: None,
        tolerance: 3e-6,
    },
    Scene {
        name: "shake-modal",
        what: "`shake` with linear tissue in 60 modes; off by what they leave out of all unknowns",
        tables: || tissue("linear", 0.45) + SHAKEN,
        dt: 1.0 / 60.0,
        steps: 60,
        pose: shake,
        whole: false,
        modes: Some(60),
        tolerance: 3e-6,
    },
    Scene {
        name: "corotational",
        what: "equilibrium, corotational, nu 0.45, the jaw goes 1.1 mm a step",
        tables: || tissue("corotational", 0.45) + JAW,
        dt: 0.1,
        steps: 10,
        pose: advance,
        whole: false,
        modes: None,
        tolerance: 3e-6,
    },
];

impl Scene {
    /// The scene's text on a block of this size; `solver` goes into its table of that name, modes only where they are not to
    /// be `checked` against all unknowns.
    pub fn text(&self, size: &Size, solver: &str, checked: bool) -> String {
        let modes = self.modes.filter(|_| !checked).map_or(String::new(), |n| format!("modes = {n}\n"));
        format!(
            "{}{modes}[mesh.block]\nsize = [0.1, 0.1, 0.04]\ncells = {:?}\n[solver]\n{solver}",
            (self.tables)(),
            size.cells
        )
    }
}
