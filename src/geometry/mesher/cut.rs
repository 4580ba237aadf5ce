//! Drawing a mesh of tetrahedra to a surface: nodes near it move onto it, edges that cross it get a node there.
//!
//! A node nearer to a cut point of its own than `alpha` times the edge's length is moved onto the nearest such point and
//! lies on the surface from then on, which takes all its cuts away.
//!
//! Source: F. Labelle & J. R. Shewchuk, "Isosurface Stuffing: Fast Tetrahedral Meshes with Good Dihedral Angles",
//! ACM TOG 26(3), 2007, section 3.

use super::super::stencils::Stuffed;
use crate::math::Vec3;

/// Steps of the root search: a chord with halved weights (Illinois) gains a digit and more each.
const ROOT_STEPS: usize = 20;
/// A root is found when its level is below this share of the edge.
const ROOT: f64 = 1e-6;

/// Edges between nodes of opposite sign, sorted, each with its cut point.
pub(super) struct Cuts {
    keys: Vec<u64>,
    pub points: Vec<Vec3>,
}

fn key(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

impl Cuts {
    /// Cut points of `level` on all edges between nodes of opposite sign.
    pub fn find(mesh: &Stuffed, sign: &[i8], value: &[f64], level: &dyn Fn(&Vec3) -> f64) -> Self {
        let mut keys = Vec::new();
        for t in &mesh.tets {
            for (i, &a) in t.iter().enumerate() {
                for &b in &t[..i] {
                    if sign[a as usize] * sign[b as usize] < 0 {
                        keys.push(key(a, b));
                    }
                }
            }
        }
        keys.sort_unstable();
        keys.dedup();
        let point = |&k: &u64| {
            let [a, b] = ends(k);
            root(mesh.nodes[a], mesh.nodes[b], [value[a], value[b]], level)
        };
        let points = keys.iter().map(point).collect();
        Self { keys, points }
    }

    pub fn number(&self, a: u32, b: u32) -> usize {
        self.keys.binary_search(&key(a, b)).expect("an edge between signs has its cut")
    }

    pub fn edges(&self) -> impl Iterator<Item = ([usize; 2], &Vec3)> {
        self.keys.iter().map(|&k| ends(k)).zip(&self.points)
    }
}

fn ends(key: u64) -> [usize; 2] {
    [(key >> 32) as usize, (key & u64::from(u32::MAX)) as usize]
}

/// The zero of a level between two points whose levels have opposite signs.
fn root(a: Vec3, b: Vec3, [mut fa, mut fb]: [f64; 2], level: &dyn Fn(&Vec3) -> f64) -> Vec3 {
    let span = b - a;
    let small = ROOT * span.norm();
    let (mut s, mut t) = (0.0, 1.0);
    let mut side = 0;
    let mut m = 0.5;
    for _ in 0..ROOT_STEPS {
        m = (s * fb - t * fa) / (fb - fa);
        let f = level(&(a + span * m));
        if f.abs() < small {
            break;
        }
        if (f < 0.0) == (fa < 0.0) {
            (s, fa) = (m, f);
            if side == 1 {
                fb *= 0.5;
            }
            side = 1;
        } else {
            (t, fb) = (m, f);
            if side == 2 {
                fa *= 0.5;
            }
            side = 2;
        }
    }
    a + span * m
}

/// Moves nodes near a cut onto it, each to the nearest cut point of its own that `reaches` allows; their signs become 0.
/// `reaches(from, to)` is the share of the edge within which `from` may move along it.
pub(super) fn draw(
    mesh: &mut Stuffed,
    sign: &mut [i8],
    cuts: &Cuts,
    reaches: impl Fn(&Stuffed, usize, usize) -> f64,
) -> Vec<usize> {
    let mut nearest: Vec<(f64, usize)> = vec![(f64::INFINITY, usize::MAX); mesh.nodes.len()];
    for (n, ([a, b], x)) in cuts.edges().enumerate() {
        let length = (mesh.nodes[a] - mesh.nodes[b]).norm();
        for (from, to) in [(a, b), (b, a)] {
            let way = (x - mesh.nodes[from]).norm();
            // A node on the box's faces stays on all of them.
            let held = mesh.plane[from];
            if mesh.plane[to] & held == held && way < reaches(mesh, from, to) * length && way < nearest[from].0 {
                nearest[from] = (way, n);
            }
        }
    }
    let moved: Vec<usize> = (0..nearest.len()).filter(|&a| nearest[a].1 != usize::MAX).collect();
    for &a in &moved {
        mesh.nodes[a] = cuts.points[nearest[a].1];
        sign[a] = 0;
    }
    moved
}
