//! The block between two bones that most cases are about, as scene text.

/// Stiffness of the tissue, Pa.
const STIFFNESS: f64 = 15e3;

/// A block of 60 x 40 x 30 mm; `skull` holds its left end, `jaw` its right, `push` a patch of its top.
pub struct Block<'a> {
    pub law: &'a str,
    /// Poisson's ratio.
    pub nu: f64,
    /// Factor of all lengths, the tolerance included.
    pub scale: f64,
    pub cells: [usize; 3],
    pub order: u32,
    /// Largest nodal motion of the last correction, m.
    pub tolerance: f64,
    /// Further tables.
    pub more: &'a str,
}

impl<'a> Block<'a> {
    pub fn of(law: &'a str) -> Block<'a> {
        Block { law, nu: 0.45, scale: 1.0, cells: [6, 4, 3], order: 1, tolerance: 1e-7, more: "" }
    }

    /// Edge lengths, m.
    pub fn size(&self) -> [f64; 3] {
        [0.06, 0.04, 0.03].map(|l| l * self.scale)
    }

    pub fn text(&self) -> String {
        format!(
            "{}[[tissue]]\n{}{}{}{}",
            self.mesh(),
            tissue(self.law, STIFFNESS, self.nu),
            self.bones(),
            self.solver(),
            self.more
        )
    }

    pub fn mesh(&self) -> String {
        format!("[mesh]\norder = {}\n[mesh.block]\nsize = {:?}\ncells = {:?}\n", self.order, self.size(), self.cells)
    }

    pub fn bones(&self) -> String {
        let [x, y, z] = self.size();
        format!(
            "[[bone]]\nname = \"skull\"\nnodes = \"x_min\"\n[[bone]]\nname = \"jaw\"\nnodes = \"x_max\"\n\
             [[load]]\nname = \"push\"\nat = {:?}\nradius = {:?}\n",
            [0.5 * x, 0.5 * y, z],
            0.4 * y
        )
    }

    pub fn solver(&self) -> String {
        format!("[solver]\ntolerance = {:e}\n", self.tolerance * self.scale)
    }
}

/// The constants of a law at Young's modulus `E` (Pa) and Poisson's ratio `nu`.
pub fn tissue(law: &str, E: f64, nu: f64) -> String {
    match law {
        "fung" => format!(
            "energy = \"fung\"\nmu = {:e}\nb = 2.0\nkappa = {:e}\n",
            E / (2.0 * (1.0 + nu)),
            E / (3.0 * (1.0 - 2.0 * nu))
        ),
        law => format!("energy = \"{law}\"\nE = {E:e}\nnu = {nu:?}\n"),
    }
}
