//! Depth below the skin as a field: 0 on the skin, 1 on the bones, harmonic between them.
//!
//! ```text
//! minimise 1/2 int |grad d|^2,   d = 0 on the skin, d = 1 on bone nodes
//! ```
//!
//! Its gradient points from the skin to the bone: across it lies the plane of the skin.

use std::collections::BTreeSet;

use crate::effect::Elements;
use crate::fem::{At, Configuration, Dofs, Material, Term};
use crate::math::{Mat3, Mat9, Pose, Vec3};
use crate::mesh::{TetMesh, signed_volume};
use crate::solve::{LinearSystems, Minimiser, Precision, Problem, SolveError, Strategy};

/// Depth at the corners of the mesh.
pub(super) struct Depth(Vec<f64>);

/// psi = |F|^2/2: each coordinate of x is a harmonic function of its own.
struct Harmonic;

impl Material for Harmonic {
    fn name(&self) -> &'static str {
        "harmonic"
    }
    fn psi(&self, _at: &At, _p: usize, F: &Mat3) -> f64 {
        0.5 * F.norm_squared()
    }
    fn psi_and_P(&self, _at: &At, _p: usize, F: &Mat3) -> (f64, Mat3) {
        (0.5 * F.norm_squared(), *F)
    }
    fn dPdF(&self, _at: &At, _p: usize, _F: &Mat3) -> Mat9 {
        Mat9::identity()
    }
    fn is_quadratic(&self) -> bool {
        true
    }
}

impl Depth {
    /// Solves for the depth of the corners of `mesh` between its skin and the nodes `bones`; a node of both is bone.
    /// `None` without skin or without bone.
    pub(super) fn new(mesh: &TetMesh, bones: &BTreeSet<u32>) -> Option<Result<Depth, SolveError>> {
        let skin = mesh.skin_nodes();
        if skin.is_empty() || bones.is_empty() {
            return None;
        }
        // Mid-edge nodes come after all corners.
        let n = mesh.tets.as_flattened().iter().max().map_or(0, |&a| a as usize + 1);
        Some(solve(mesh, n, &skin, bones))
    }

    /// Depth at barycentric coordinates `L` of a tetrahedron.
    pub(super) fn at(&self, tet: &[u32; 4], L: &[f64; 4]) -> f64 {
        tet.iter().zip(L).map(|(&a, L)| L * self.0[a as usize]).sum()
    }

    /// Unit normal of the skin plane at a tetrahedron, pointing to the bone; zero where the depth is the same all over.
    pub(super) fn inward(&self, tet: &[u32; 4], X: &[Vec3]) -> Vec3 {
        let x = tet.map(|a| X[a as usize]);
        let d = tet.map(|a| self.0[a as usize]);
        let (a, b, c) = (x[1] - x[0], x[2] - x[0], x[3] - x[0]);
        let gradient = ((d[1] - d[0]) * b.cross(&c) + (d[2] - d[0]) * c.cross(&a) + (d[3] - d[0]) * a.cross(&b))
            / (6.0 * signed_volume(x));
        gradient.try_normalize(0.0).unwrap_or(Vec3::zeros())
    }
}

fn solve(mesh: &TetMesh, n: usize, skin: &[u32], bones: &BTreeSet<u32>) -> Result<Depth, SolveError> {
    let mut x = vec![Vec3::zeros(); n];
    bones.iter().filter(|&&a| (a as usize) < n).for_each(|&a| x[a as usize].x = 1.0);
    let held: BTreeSet<u32> = skin.iter().chain(bones).copied().filter(|&a| (a as usize) < n).collect();
    // Corners of no tetrahedron have no depth to find.
    let mut used = vec![false; n];
    mesh.tets.as_flattened().iter().for_each(|&a| used[a as usize] = true);
    let held: Vec<u32> = (0..n as u32).filter(|a| held.contains(a) || !used[*a as usize]).collect();
    let dofs = Dofs::new(n, held, Vec::new());
    let mut config = Configuration { x, poses: Vec::<Pose>::new() };
    if dofs.free.is_empty() {
        return Ok(Depth(config.x.iter().map(|x| x.x).collect()));
    }
    let X = &mesh.nodes[..n];
    let terms: Vec<Box<dyn Term>> = vec![Elements { X, tets: &mesh.tets, midsides: &[] }.of(Harmonic)];
    let problem = Problem { terms: &terms, dofs: &dofs, X, pivots: &[], wrenches: &[], at: At::NOWHERE };
    // The first solve is exact; a correction of a millionth of the whole range ends it.
    let strategy = Strategy {
        memory: 1,
        refresh_after: 2,
        tolerance: 1e-6,
        max_iterations: 20,
        linear: LinearSystems::Fitting,
        precision: Precision::Double,
        threads: 1,
        without: None,
    };
    let mut minimiser = Minimiser::new(&problem, strategy)?;
    minimiser.linearise(&problem, &config)?;
    minimiser.minimise(&problem, &mut config)?;
    Ok(Depth(config.x.iter().map(|x| x.x).collect()))
}
