//! How fine a baked mesh is: mean distances of its surfaces from the scan's, edges, where both may grow, and levels.
//!
//! ```text
//! errors ~ edge^2, about what flat triangles of that size miss of a curved surface
//! level k has edges 1.6^k and errors 1.6^2k times as large: about 2.5 times fewer tetrahedra each
//! ```

use super::mesher::{Effort, Goal, Meshed, Sheet, coarser, polish};
use super::sampled::Sampled;
use super::stuffing::Wall;
use super::{Field, MeshingError};
use crate::math::Vec3;

/// Edge to which the errors below belong, and these for skin and bone, m.
const EDGE: f64 = 4e-3;
const ERRORS: [f64; 2] = [0.10e-3, 0.25e-3];
/// Longest edges on surfaces, and anywhere, in edges asked for; and how fast they grow with depth.
const LONGEST: [f64; 2] = [1.75, 3.0];
const DEEPER: f64 = 0.5;
/// The cut surfaces may be this many times as far off as skin.
const CUT_ERROR: f64 = 8.0;
/// Beyond the first distance from the mouth, and from the first depth under the outer skin on, errors and edges grow; over
/// the second they have reached their largest, m.
const FAR: [f64; 2] = [0.060, 0.040];
const DEEP: [f64; 2] = [0.012, 0.010];
/// Ratio of the edges of two levels.
const LEVEL: f64 = 1.6;
/// Where a number of tetrahedra is asked for, edges start at this share of those asked for and grow by the second.
const SEARCH: [f64; 2] = [0.6, 1.35];
/// Share of them that collapse may leave: swaps and free nodes between bones add some.
const SPARE: f64 = 0.97;
/// An edge grows this often at most on the way to a number of tetrahedra.
const SEARCHES: usize = 12;
/// Most that given errors may coarsen the lattice: twice the cells.
const COARSEST: f64 = 2.0;
/// Polish after a mesh was coarsened.
const LAST: Effort = Effort { rounds: 3, all: 2, swaps: 3, rescue: 6, fit: 4 };

/// How fine to bake.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Size of the tetrahedra at the face, m; their longest edges are 1.75 times that. Without errors of their own, skin and
    /// bone are met to .10 and .25 mm (mean distance) at an edge of 4 mm, with its square at others.
    pub edge: f64,
    /// Mean distance allowed between the skin and the scan's, m; large ones leave out what they allow to be missed.
    pub skin_error: Option<f64>,
    /// Mean distance allowed between bones and the scan's, m.
    pub bone_error: Option<f64>,
    /// Largest number of tetrahedra: errors and edges are then as small as it allows.
    pub tets: Option<usize>,
    /// How many times larger errors and edges may be far from the mouth and deep under the skin; 1 is the same everywhere.
    pub growth: f64,
    /// Number of meshes of the same domain, each 1.6 times coarser than the one before.
    pub levels: usize,
}

impl Default for Resolution {
    fn default() -> Self {
        Self { edge: EDGE, skin_error: None, bone_error: None, tets: None, growth: 2.0, levels: 1 }
    }
}

impl Resolution {
    /// # Errors
    /// [`MeshingError::NotPositive`] for a length, number or factor that is not; [`MeshingError::Growth`] below 1.
    pub(super) fn checked(&self) -> Result<(), MeshingError> {
        let lengths = [Some(self.edge), self.skin_error, self.bone_error];
        for (what, found) in ["the edge", "the error of the skin", "the error of the bones"].into_iter().zip(lengths) {
            if let Some(found) = found.filter(|x| !(x.is_finite() && *x > 0.0)) {
                return Err(MeshingError::NotPositive { what: what.into(), found });
            }
        }
        for (what, found) in
            [("the number of levels", self.levels), ("the number of tetrahedra", self.tets.unwrap_or(1))]
        {
            if found == 0 {
                return Err(MeshingError::NotPositive { what: what.into(), found: 0.0 });
            }
        }
        if !(self.growth.is_finite() && self.growth >= 1.0) {
            return Err(MeshingError::Growth { found: self.growth });
        }
        Ok(())
    }

    /// Mean distances allowed for skin and bone, m, with edges `times` as long as those asked for.
    fn errors(&self, times: f64) -> [f64; 2] {
        let share = (self.edge / EDGE).powi(2);
        let asked = [self.skin_error, self.bone_error];
        [0, 1].map(|k| times * times * asked[k].unwrap_or(ERRORS[k] * share))
    }

    /// Cells that the lattice needs, in those that an edge of 4 mm needs: no coarser ones, since meshes of all edges are one
    /// domain, unless the errors themselves were given.
    pub(super) fn fineness(&self) -> f64 {
        let start = if self.tets.is_some() { SEARCH[0] } else { 1.0 };
        let coarsest = if self.skin_error.is_some() || self.bone_error.is_some() { COARSEST } else { 1.0 };
        let errors = self.errors(start);
        (0..2).map(|k| (errors[k] / ERRORS[k]).sqrt()).fold(coarsest, f64::min)
    }

    /// Mean residuals allowed in the lattice's cells for skin and bone, m.
    pub(super) fn lattice_errors(&self) -> [f64; 2] {
        ERRORS.map(|e| e * self.fineness().powi(2))
    }
}

/// Where errors and edges may grow.
pub(super) struct Places {
    /// Middle of the mouth, m.
    pub mouth: Vec3,
    /// Depth under the outer skin, m.
    pub under: Sampled,
    pub growth: f64,
}

impl Places {
    /// Factor on errors and edges.
    pub fn scale(&self, p: &Vec3) -> f64 {
        let far = ((p - self.mouth).norm() - FAR[0]) / FAR[1];
        let deep = (self.under.at(p) - DEEP[0]) / DEEP[1];
        1.0 + (self.growth - 1.0) * far.max(deep).clamp(0.0, 1.0)
    }
}

/// Coarsens a fine mesh to the next level and polishes it.
pub(super) fn level(
    meshed: &mut Meshed,
    walls: &[Wall],
    sheet: Option<Sheet>,
    places: &Places,
    resolution: &Resolution,
    number: usize,
) {
    let within = |p: &Vec3| walls.iter().map(|w| -w.depth(p)).fold(f64::INFINITY, f64::min).max(0.0);
    let times = LEVEL.powi(number as i32);
    let mut coarsen = |times: f64, target: usize| {
        let errors = resolution.errors(times);
        let edge = times * resolution.edge;
        let tolerance = |wall: u8, p: &Vec3| {
            places.scale(p)
                * match wall {
                    0 => errors[0],
                    1 => errors[1],
                    _ => CUT_ERROR * errors[0],
                }
        };
        let longest = |p: &Vec3| {
            let scale = places.scale(p);
            (edge * LONGEST[0] * scale + DEEPER * within(p)).min(LONGEST[1] * edge * scale)
        };
        coarser(meshed, &Goal { walls, sheet, tolerance: &tolerance, longest: &longest, target });
        meshed.mesh.tets.len()
    };
    match resolution.tets {
        None => {
            coarsen(times, 0);
        }
        Some(tets) => {
            let target = (SPARE * tets as f64 / (times * times)) as usize;
            let mut share = SEARCH[0];
            for _ in 0..SEARCHES {
                if coarsen(share * times, target) <= target {
                    break;
                }
                share *= SEARCH[1];
            }
        }
    }
    polish(meshed, walls, sheet.as_ref(), LAST);
}
