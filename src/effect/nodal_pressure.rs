//! Averaged nodal pressure: linear tetrahedra that do not lock near incompressibility.
//!
//! ```text
//! W = sum_a k_a U(J_a),   J_a = sum_e v_e / sum_e V_e over the tetrahedra at node a,   k_a = sum_e k_e V_e/4
//! ```
//!
//! `v_e`, `V_e` are current and rest volumes, `k_e` the part of Lame's lambda that volume feels here; the rest of it stays
//! in the elements as a stabilisation, for it stiffens patterns in which neighbours swell and shrink in turn while nodal
//! volumes keep. A part as small as the shear modulus does that and brings no locking back.
//!
//! Source: Bonet & Burton, "A simple average nodal pressure tetrahedral element for incompressible and nearly
//! incompressible dynamic explicit applications", Commun. Numer. Methods Eng. 14, 1998; Puso & Solberg, "A stabilized
//! nodally integrated tetrahedral", Int. J. Numer. Methods Eng. 67, 2006. Departure: the stabilisation is the law itself
//! at a lower Poisson's ratio.

use super::tissue::Elements;
use super::tuned::Tuning;
use crate::fem::{At, Curvature, HessianSink, Strain, Term};
use crate::math::{Mat3, Vec3, skew};
use crate::mesh::signed_volume;

/// How a law's energy depends on volume.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Volume {
    /// U = (tr eps)^2/2: the volume of small displacements.
    Linear,
    /// U = (J - 1)^2/2.
    Quadratic,
    /// U = (ln J)^2/2; +inf for J <= 0.
    Logarithmic,
    /// U = (J - 1/J)^2/8; +inf for J <= 0.
    Polyconvex,
}

impl Volume {
    /// U and its first two derivatives by J.
    fn U(self, J: f64) -> [f64; 3] {
        match self {
            Volume::Linear | Volume::Quadratic => [0.5 * (J - 1.0) * (J - 1.0), J - 1.0, 1.0],
            Volume::Logarithmic | Volume::Polyconvex if J <= 0.0 => [f64::INFINITY, 0.0, 0.0],
            Volume::Polyconvex => {
                let (swollen, cubed) = (J - 1.0 / J, J.powi(3));
                [0.125 * swollen * swollen, 0.25 * (J - 1.0 / cubed), 0.25 * (1.0 + 3.0 / (cubed * J))]
            }
            Volume::Logarithmic => {
                let l = J.ln();
                [0.5 * l * l, l / J, (1.0 - l) / (J * J)]
            }
        }
    }
}

/// The tetrahedra at one node.
struct Patch {
    /// Stiffness k_a, J.
    k: f64,
    /// Rest volume of its tetrahedra, m3.
    V: f64,
    /// Its tetrahedra.
    tets: Vec<u32>,
    /// Their nodes, each once.
    nodes: Vec<u32>,
    /// Place of each tetrahedron's corners in `nodes`.
    corners: Vec<[u16; 4]>,
}

/// The averaged volumetric energy of one tissue.
pub struct NodalPressure {
    volume: Volume,
    X: Vec<Vec3>,
    tets: Vec<[u32; 4]>,
    patches: Vec<Patch>,
    tuning: Option<Tuning>,
}

/// Nodes of a patch that are gathered without allocating.
const COMMON_PATCH: usize = 128;

impl NodalPressure {
    /// Over linear tetrahedra of which element `e` has the volumetric stiffness `k(e)`, Pa.
    pub fn new(volume: Volume, elements: Elements, k: impl Fn(usize) -> f64) -> NodalPressure {
        let Elements { X, tets, .. } = elements;
        let mut at_node = std::collections::BTreeMap::<u32, Vec<u32>>::new();
        for (e, tet) in tets.iter().enumerate() {
            tet.iter().for_each(|&a| at_node.entry(a).or_default().push(e as u32));
        }
        let patch = |members: Vec<u32>| {
            let mut nodes: Vec<u32> = members.iter().flat_map(|&e| tets[e as usize]).collect();
            nodes.sort_unstable();
            nodes.dedup();
            let place = |a: u32| nodes.binary_search(&a).expect("gathered above") as u16;
            let V = |e: &u32| signed_volume(tets[*e as usize].map(|a| X[a as usize]));
            Patch {
                k: members.iter().map(|e| 0.25 * k(*e as usize) * V(e)).sum(),
                V: members.iter().map(V).sum(),
                corners: members.iter().map(|&e| tets[e as usize].map(place)).collect(),
                tets: members,
                nodes,
            }
        };
        NodalPressure {
            volume,
            X: X.to_vec(),
            tets: tets.to_vec(),
            patches: at_node.into_values().map(patch).collect(),
            tuning: None,
        }
    }

    /// The same with a stiffness that a host may set.
    pub fn tuned(self, tuning: Tuning) -> NodalPressure {
        NodalPressure { tuning: Some(tuning), ..self }
    }

    /// Factor of every stiffness.
    fn factor(&self, at: &At) -> f64 {
        self.tuning.map_or(1.0, |tuning| tuning.factor(at))
    }

    fn corners(&self, e: u32, x: &[Vec3]) -> [Vec3; 4] {
        self.tets[e as usize].map(|a| x[a as usize])
    }

    /// dv_e/dx of the corners, at rest for the linear measure.
    fn volume_gradient(&self, e: u32, x: &[Vec3]) -> [Vec3; 4] {
        let x = self.corners(e, if self.volume == Volume::Linear { &self.X } else { x });
        let (a, b, c) = (x[1] - x[0], x[2] - x[0], x[3] - x[0]);
        let (n1, n2, n3) = (b.cross(&c) / 6.0, c.cross(&a) / 6.0, a.cross(&b) / 6.0);
        [-(n1 + n2 + n3), n1, n2, n3]
    }

    /// J_a.
    fn J(&self, patch: &Patch, x: &[Vec3]) -> f64 {
        let grown = |&e: &u32| match self.volume {
            Volume::Linear => {
                let corners = self.tets[e as usize].map(|a| a as usize);
                let n = self.volume_gradient(e, x);
                corners.iter().zip(n).map(|(&a, n)| n.dot(&(x[a] - self.X[a]))).sum()
            }
            _ => signed_volume(self.corners(e, x)) - signed_volume(self.corners(e, &self.X)),
        };
        1.0 + patch.tets.iter().map(grown).sum::<f64>() / patch.V
    }

    /// Upper triangle of d2v_e/dx2, times `scale`.
    fn volume_hessian(&self, e: u32, x: &[Vec3], scale: f64) -> [Mat3; 10] {
        let x = self.corners(e, x);
        let cross = |v: Vec3| scale / 6.0 * skew(&v);
        let (a, b, c) = (cross(x[1] - x[0]), cross(x[2] - x[0]), cross(x[3] - x[0]));
        let O = Mat3::zeros();
        // Blocks (1,2), (1,3), (2,3) are -[c], [b], -[a]; those of node 0 make each column sum to zero.
        [O, b - c, c - a, a - b, O, -c, b, O, -a, O]
    }
}

impl Term for NodalPressure {
    fn name(&self) -> &'static str {
        "nodal pressure"
    }
    fn energy(&self, at: &At, x: &[Vec3]) -> f64 {
        self.factor(at) * self.patches.iter().map(|p| p.k * self.volume.U(self.J(p, x))[0]).sum::<f64>()
    }
    fn add_gradient(&self, at: &At, x: &[Vec3], g: &mut [Vec3]) -> f64 {
        let mut energy = 0.0;
        let factor = self.factor(at);
        for patch in &self.patches {
            let [U, first, _] = self.volume.U(self.J(patch, x));
            energy += factor * patch.k * U;
            let pressure = factor * patch.k * first / patch.V;
            for &e in &patch.tets {
                for (a, n) in self.tets[e as usize].iter().zip(self.volume_gradient(e, x)) {
                    g[*a as usize] += pressure * n;
                }
            }
        }
        energy
    }
    fn couplings(&self, clique: &mut dyn FnMut(&[u32])) {
        for patch in &self.patches {
            clique(&patch.nodes);
            if self.volume != Volume::Linear {
                patch.tets.iter().for_each(|&e| clique(&self.tets[e as usize]));
            }
        }
    }
    fn add_hessian(&self, at: &At, x: &[Vec3], curvature: Curvature, sink: &mut dyn HessianSink) {
        let factor = self.factor(at);
        let (mut common, mut large) = ([Vec3::zeros(); COMMON_PATCH], Vec::new());
        for patch in &self.patches {
            let [_, first, second] = self.volume.U(self.J(patch, x));
            let n = patch.nodes.len();
            let c = if n <= COMMON_PATCH {
                &mut common[..n]
            } else {
                large.resize(n, Vec3::zeros());
                &mut large[..]
            };
            c.fill(Vec3::zeros());
            for (&e, corners) in patch.tets.iter().zip(&patch.corners) {
                for (&k, n) in corners.iter().zip(self.volume_gradient(e, x)) {
                    c[k as usize] += n / patch.V;
                }
            }
            let (projected, k) = (curvature == Curvature::Projected, factor * patch.k);
            sink.add_outer(&patch.nodes, c, k * if projected { second.max(0.0) } else { second });
            if self.volume != Volume::Linear {
                let pressure = if projected { 0.0 } else { k * first / patch.V };
                for &e in &patch.tets {
                    sink.add(&self.tets[e as usize], &self.volume_hessian(e, x, pressure));
                }
            }
        }
    }
    fn inputs(&self) -> std::ops::Range<usize> {
        self.tuning.map_or(0..0, |tuning| tuning.input..tuning.input + 1)
    }
    fn is_quadratic(&self) -> bool {
        self.volume == Volume::Linear
    }
    fn is_elastic(&self) -> bool {
        true
    }
    fn strain(&self, at: &At, x: &[Vec3]) -> Strain {
        Strain { energy: self.energy(at, x), ..Strain::NONE }
    }
}
