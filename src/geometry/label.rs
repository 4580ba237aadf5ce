//! Tissue layers by depth: skin in absolute thickness, fat and muscle by their share of the way to the bone.
//!
//! ```text
//! d_s depth under the skin, d_b distance from the bone, s = d_s / (d_s + d_b)
//! dermis: d_s < dermis      fat: s < fat      muscle: the rest
//! ```
//!
//! Source: D. Terzopoulos & K. Waters, "Physically-based facial modelling, analysis, and animation", J. Visualization
//! and Computer Animation 1(2), 1990, for layers by fraction.
//! Departure: the dermis is absolute, since it does not thicken with the cheek.

use crate::math::Vec3;
use crate::mesh::TetMesh;

/// Names of the layers, from the skin inward.
pub const LAYERS: [&str; 3] = ["dermis", "fat", "muscle"];
/// Sample points in a tetrahedron for the share a layer should have: between the middle and each corner.
const INNER: f64 = 0.75;

/// Where one layer ends and the next begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layers {
    /// Thickness of the dermis, m.
    pub dermis: f64,
    /// Share of the way from skin to bone where fat ends.
    pub fat: f64,
}

impl Default for Layers {
    fn default() -> Self {
        Self { dermis: 2e-3, fat: 0.45 }
    }
}

/// How much of the volume a layer takes.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerShare {
    /// Layer.
    pub name: &'static str,
    /// Share of the volume its tetrahedra take.
    pub reached: f64,
    /// Share it has by depth inside the tetrahedra: what a finer mesh would reach.
    pub wanted: f64,
}

impl Layers {
    /// Layer of a place by its depth under the skin and its distance from the bone, m.
    fn of(&self, d_skin: f64, d_bone: f64) -> usize {
        let (d_skin, d_bone) = (d_skin.max(0.0), d_bone.max(0.0));
        if d_skin < self.dermis {
            0
        } else if d_skin < self.fat * (d_skin + d_bone) {
            1
        } else {
            2
        }
    }

    /// Sets the regions of a mesh. `depth` returns depth under the skin and distance from the bone, m; `fatty` may
    /// overrule depth below the dermis (CT: Hounsfield units of fat).
    pub fn label(
        &self,
        mesh: &mut TetMesh,
        depth: &dyn Fn(&Vec3) -> (f64, f64),
        fatty: &dyn Fn(&Vec3) -> Option<bool>,
    ) -> Vec<LayerShare> {
        let layer = |p: &Vec3| {
            let (d_skin, d_bone) = depth(p);
            match (self.of(d_skin, d_bone), fatty(p)) {
                (1 | 2, Some(fat)) => {
                    if fat {
                        1
                    } else {
                        2
                    }
                }
                (layer, _) => layer,
            }
        };
        let (mut reached, mut wanted) = ([0.0; 3], [0.0; 3]);
        mesh.region = (0..mesh.tets.len())
            .map(|e| {
                let x = mesh.tets[e].map(|a| mesh.nodes[a as usize]);
                let middle = (x[0] + x[1] + x[2] + x[3]) / 4.0;
                let own = layer(&middle);
                let volume = mesh.volume(e);
                reached[own] += volume;
                x.iter().for_each(|c| wanted[layer(&middle.lerp(c, INNER))] += volume / 4.0);
                own as u32
            })
            .collect();
        mesh.region_names = LAYERS.map(String::from).to_vec();
        let total: f64 = reached.iter().sum();
        let share = |k: usize| LayerShare { name: LAYERS[k], reached: reached[k] / total, wanted: wanted[k] / total };
        (0..3).map(share).collect()
    }
}
