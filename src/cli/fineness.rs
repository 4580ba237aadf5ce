//! Options of `cutis bake` that say how fine and how deep the mesh is, and in which layers.

use cutis::geometry::{Layers, Resolution};

#[derive(clap::Args)]
pub struct Fineness {
    /// Size of the tetrahedra at the face, mm: skin and bone are met to 0.10 and 0.25 mm in the mean at 4, with its square at
    /// other sizes [default: 4]
    #[arg(long, allow_negative_numbers = true)]
    edge: Option<f64>,
    /// Mean distance allowed between the skin of mesh and scan, mm, in place of what the edge brings
    #[arg(long, allow_negative_numbers = true)]
    skin_error: Option<f64>,
    /// Mean distance allowed between the bones of mesh and scan, mm, in place of what the edge brings
    #[arg(long, allow_negative_numbers = true)]
    bone_error: Option<f64>,
    /// Largest number of tetrahedra: errors are as small as it allows
    #[arg(long)]
    tets: Option<usize>,
    /// How many times larger errors and edges may be far from the mouth and deep under the skin; 1 is the same everywhere
    #[arg(long, default_value_t = 2.0, allow_negative_numbers = true)]
    growth: f64,
    /// Number of meshes of the same domain, each about 2.5 times coarser than the one before: NAME.cutis, NAME.1.cutis, ...
    #[arg(long, default_value_t = 1)]
    levels: usize,
    /// How far the mesh reaches under the outer skin, mm, measured round the bones
    #[arg(long, default_value_t = 50.0, allow_negative_numbers = true)]
    pub depth: f64,
    /// Thickness of the dermis, mm
    #[arg(long, default_value_t = 2.0, allow_negative_numbers = true)]
    dermis: f64,
    /// Share of the way from skin to bone where fat ends and muscle begins, in place of what Hounsfield units say
    #[arg(long, allow_negative_numbers = true)]
    pub fat: Option<f64>,
}

impl Fineness {
    /// The first option that makes no sense.
    pub fn checked(&self) -> Result<(), String> {
        let lengths = [
            ("--edge", self.edge),
            ("--skin-error", self.skin_error),
            ("--bone-error", self.bone_error),
            ("--depth", Some(self.depth)),
        ];
        for (option, mm) in lengths {
            if let Some(mm) = mm.filter(|mm| !(mm.is_finite() && *mm > 0.0)) {
                return Err(format!("{option} takes a length above 0 in mm; found {mm} mm"));
            }
        }
        for (option, found) in [("--tets", self.tets), ("--levels", Some(self.levels))] {
            if found == Some(0) {
                return Err(format!("{option} takes a number above 0; found 0"));
            }
        }
        if !(self.growth.is_finite() && self.growth >= 1.0) {
            return Err(format!("--growth takes a factor of 1 or more; found {}", self.growth));
        }
        if !(self.dermis.is_finite() && self.dermis >= 0.0) {
            return Err(format!("--dermis takes a length in mm, 0 or more; found {} mm", self.dermis));
        }
        match self.fat.filter(|f| !(0.0..=1.0).contains(f)) {
            Some(fat) => Err(format!("--fat takes a share from 0 to 1; found {fat}")),
            None => Ok(()),
        }
    }

    /// How fine; `edge` is that of a settings file, mm.
    pub fn resolution(&self, edge: Option<f64>) -> Resolution {
        let usual = Resolution::default();
        Resolution {
            edge: self.edge.or(edge).map_or(usual.edge, |e| 1e-3 * e),
            skin_error: self.skin_error.map(|e| 1e-3 * e),
            bone_error: self.bone_error.map(|e| 1e-3 * e),
            tets: self.tets,
            growth: self.growth,
            levels: self.levels,
        }
    }

    pub fn layers(&self) -> Layers {
        Layers { dermis: 1e-3 * self.dermis, fat: self.fat.unwrap_or(Layers::default().fat) }
    }
}
