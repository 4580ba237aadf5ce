//! The synthetic head: a face by formula, mirror-symmetric, with skull and mandible; the project's embedded model.
//!
//! LPS axes, m: x to the left, y to the back, z up. The jaw joint's axis lies in y = 0, the closed mouth in z = 0, the
//! median plane is x = 0. Skin and bones are smooth unions of ellipsoids and rods, so every error can be measured.
//! One half is meshed on a lattice whose tetrahedra end at x = 0 and z = 0, and mirrored: symmetric to the bit.

use super::assemble::{Assembled, Bone, Kind, Naming, assemble};
use super::label::Layers;
use super::mesher::SHEET;
use super::shapes::{arch, carve, ellipsoid, join, rod};
use super::stencils::Stuffed;
use super::stuffing::{Side, Wall};
use super::tetrahedralise::name_boundary;
use super::topology::{FACES, OPEN, neighbours};
use super::{Cuboid, Lattice, LatticePlane, MeshReport, MeshingError, stuff};
use crate::math::{Mat3, Vec3};
use crate::mesh::TetMesh;

/// Midpoint between the condyles, m: the jaw opens about the x axis through it.
pub const JAW_PIVOT: [f64; 3] = [0.0, 0.0, 0.044];
/// Direction of the jaw's axis: a positive rotation opens the mouth.
pub const JAW_AXIS: [f64; 3] = [1.0, 0.0, 0.0];
/// Half the width of the mouth, m.
const MOUTH: f64 = 0.026;
/// How far back the oral slit may reach, m: behind the front of the teeth.
const TEETH: f64 = -0.06;
/// The region of interest: brow, under the chin, in front of the ears, m.
const TOP: f64 = 0.088;
const BOTTOM: f64 = -0.062;
const BACK: f64 = 0.003;

/// The synthetic head at a lattice edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Head {
    /// Edge of the lattice's cubes, m.
    pub edge: f64,
    /// Tissue layers.
    pub layers: Layers,
}

impl Default for Head {
    /// About 20 000 tetrahedra.
    fn default() -> Self {
        Self { edge: 7.8e-3, layers: Layers::default() }
    }
}

/// Midpoint between the condyles, m.
pub fn jaw_pivot() -> Vec3 {
    Vec3::from(JAW_PIVOT)
}

/// Signed distance to the skin, exact to first order at it, m.
pub fn skin(p: &Vec3) -> f64 {
    let p = Vec3::new(p.x.abs(), p.y, p.z);
    let mut d = ellipsoid(&p, [0.0, 0.0, 0.095], [0.076, 0.098, 0.084]);
    d = join(d, ellipsoid(&p, [0.0, -0.040, 0.028], [0.066, 0.054, 0.064]), 0.020);
    d = join(d, ellipsoid(&p, [0.0, -0.034, -0.015], [0.062, 0.059, 0.046]), 0.020);
    d = join(d, ellipsoid(&p, [0.0, 0.006, 0.020], [0.071, 0.050, 0.070]), 0.020);
    d = join(d, rod(&p, [0.0, 0.010, -0.02], [0.0, 0.020, -0.15], 0.056), 0.020);
    // The gland before the ear, over the joint and the arch.
    d = join(d, ellipsoid(&p, [0.046, 0.002, 0.028], [0.024, 0.034, 0.046]), 0.014);
    d = join(d, ellipsoid(&p, [0.0, -0.082, -0.036], [0.022, 0.017, 0.016]), 0.016);
    d = join(d, ellipsoid(&p, [0.040, -0.058, 0.046], [0.024, 0.022, 0.018]), 0.016);
    d = join(d, rod(&p, [0.006, -0.086, 0.087], [0.030, -0.080, 0.091], 0.009), 0.012);
    d = carve(d, ellipsoid(&p, [0.031, -0.100, 0.069], [0.016, 0.014, 0.012]), 0.012);
    d = join(d, rod(&p, [0.0, -0.090, 0.074], [0.0, -0.103, 0.036], 0.0075), 0.010);
    d = join(d, ellipsoid(&p, [0.0, -0.107, 0.032], [0.010, 0.010, 0.0095]), 0.008);
    d = join(d, ellipsoid(&p, [0.011, -0.098, 0.028], [0.0085, 0.010, 0.008]), 0.006);
    d = join(d, ellipsoid(&p, [0.0, -0.088, 0.0065], [0.026, 0.0125, 0.0075]), 0.006);
    join(d, ellipsoid(&p, [0.0, -0.087, -0.0075], [0.024, 0.0125, 0.008]), 0.003)
}

/// Signed distance to the skull with the upper teeth, m.
pub fn skull(p: &Vec3) -> f64 {
    let p = Vec3::new(p.x.abs(), p.y, p.z);
    let mut d = ellipsoid(&p, [0.0, 0.0, 0.097], [0.062, 0.083, 0.066]);
    d = join(d, ellipsoid(&p, [0.0, -0.046, 0.038], [0.040, 0.034, 0.034]), 0.012);
    d = join(d, rod(&p, [0.034, -0.058, 0.044], [0.051, -0.020, 0.052], 0.0065), 0.010);
    d = join(d, rod(&p, [0.051, -0.020, 0.052], [0.054, 0.020, 0.060], 0.0060), 0.010);
    join(d, arch(&p, [0.0, -0.050], [0.027, 0.030], [0.0, 0.030]), 0.004)
}

/// Signed distance to the mandible with the lower teeth, m.
pub fn mandible(p: &Vec3) -> f64 {
    let p = Vec3::new(p.x.abs(), p.y, p.z);
    let mut d = rod(&p, [0.0, -0.071, -0.030], [0.020, -0.064, -0.028], 0.0090);
    d = join(d, rod(&p, [0.020, -0.064, -0.028], [0.043, -0.014, -0.018], 0.0085), 0.006);
    d = join(d, rod(&p, [0.043, -0.014, -0.018], [0.046, -0.002, 0.036], 0.0075), 0.010);
    join(d, arch(&p, [0.0, -0.049], [0.026, 0.029], [-0.032, 0.0]), 0.006)
}

/// Signed distance to the space behind the face that is not meshed: mouth, throat and what lies deeper, m.
pub fn cavity(p: &Vec3) -> f64 {
    let p = Vec3::new(p.x.abs(), p.y, p.z);
    let d = ellipsoid(&p, [0.0, -0.006, 0.0], [0.039, 0.058, 0.046]);
    let d = join(d, ellipsoid(&p, [0.0, 0.0, 0.050], [0.044, 0.050, 0.050]), 0.02);
    join(d, rod(&p, [0.0, 0.005, -0.02], [0.0, 0.016, -0.10], 0.038), 0.02)
}

/// Named points on the skin, m: soft-tissue landmarks for read-out.
pub fn markers() -> [(&'static str, Vec3); 9] {
    // Each is found along a ray from inside, so that it lies on the skin to rounding.
    let at = |from: [f64; 3], to: [f64; 3]| {
        let (from, to) = (Vec3::from(from), Vec3::from(to));
        let (mut a, mut b) = (0.0, 1.0);
        for _ in 0..60 {
            let m = 0.5 * (a + b);
            if skin(&from.lerp(&to, m)) < 0.0 { a = m } else { b = m }
        }
        from.lerp(&to, 0.5 * (a + b))
    };
    [
        ("pogonion", at([0.0, -0.05, -0.038], [0.0, -0.15, -0.038])),
        ("lip_upper", at([0.0, -0.05, 0.006], [0.0, -0.15, 0.006])),
        ("lip_lower", at([0.0, -0.05, -0.007], [0.0, -0.15, -0.007])),
        ("lip_corner_left", at([MOUTH, -0.05, 0.0], [MOUTH, -0.15, 0.0])),
        ("lip_corner_right", at([-MOUTH, -0.05, 0.0], [-MOUTH, -0.15, 0.0])),
        ("nose_tip", at([0.0, -0.05, 0.033], [0.0, -0.15, 0.033])),
        ("cheek_left", at([0.035, -0.03, 0.012], [0.065, -0.12, 0.012])),
        ("cheek_right", at([-0.035, -0.03, 0.012], [-0.065, -0.12, 0.012])),
        ("menton", at([0.0, -0.065, -0.03], [0.0, -0.085, -0.09])),
    ]
}

impl Head {
    /// The mesh and its report. Node sets `skull`, `mandible`; face sets `skin`, `skull`, `mandible`, `cut`, `free`;
    /// regions `dermis`, `fat`, `muscle`. Node positions mirror in x = 0 to the bit.
    ///
    /// # Errors
    /// [`MeshingError::NotPositive`] and [`MeshingError::TooLarge`] for an edge out of range,
    /// [`MeshingError::NoTissue`] for one longer than the head.
    pub fn mesh(&self) -> Result<(TetMesh, MeshReport), MeshingError> {
        let lattice = self.lattice()?;
        // A corner layer of the lattice nearest to the wanted end, so that the cut is flat.
        let back = (BACK / self.edge).round() * self.edge;
        let end = move |p: &Vec3| p.y - back;
        let wall = |name, field, side| Wall { name, field, side };
        let walls = [
            wall("skin", &skin, Side::Inside),
            wall("skull", &skull, Side::Outside),
            wall("mandible", &mandible, Side::Outside),
            wall("free", &cavity, Side::Outside),
            wall("cut", &end, Side::Inside),
        ];
        let half = stuff(&walls, &lattice)?;
        let whole = mirrored(&half.mesh);
        let in_slit = |corners: [Vec3; 3], a: Vec3, b: Vec3| {
            let flat = corners.iter().all(|c| c.z.abs() < 1e-3 * self.edge && c.x.abs() < MOUTH + 0.25 * self.edge);
            flat && a.z * b.z < 0.0 && corners.iter().all(|c| c.y < TEETH)
        };
        let mut faces = name_boundary(&whole, &walls, 0.3 * self.edge);
        faces.extend(inner_faces(&whole, in_slit).into_iter().map(|t| (t, SHEET)));
        let naming = Naming {
            kinds: &[Kind::Skin, Kind::Bone, Kind::Bone, Kind::Free, Kind::Cut],
            bones: &[Bone { name: "skull", field: &skull }, Bone { name: "mandible", field: &mandible }],
            apart: &|_| self.edge,
            is_outer: &|_| true,
        };
        let Assembled { mut mesh, slit_nodes, .. } = assemble(whole, &faces, &naming);
        let depth = |p: &Vec3| (-skin(p), skull(p).min(mandible(p)).min(cavity(p)));
        self.layers.label(&mut mesh, &depth, &|_| None);
        let mesh = mesh.checked()?;
        let mut report = MeshReport::of(&mesh, slit_nodes);
        report.measure_field(&mesh, "skin", &skin);
        report.measure_field(&mesh, "skull", &skull);
        report.measure_field(&mesh, "mandible", &mandible);
        Ok((mesh, report))
    }

    /// The half lattice x >= 0, its faces in the median plane, in the mouth's plane and at both ends.
    fn lattice(&self) -> Result<Lattice, MeshingError> {
        let edge = self.edge;
        if !(edge.is_finite() && edge > 0.0) {
            return Err(MeshingError::NotPositive { what: "the lattice edge".into(), found: edge });
        }
        let s = std::f64::consts::FRAC_1_SQRT_2;
        // x = (c0 - c1) edge/(2 sqrt 2), z = (c0 + c1) edge/(2 sqrt 2), y = c2 edge/2.
        let axes = Mat3::new(s, -s, 0.0, 0.0, 0.0, 1.0, s, s, 0.0);
        let layer = |z: f64| 2 * (z / (s * edge)).round() as i32;
        let plane = |normal: [i32; 3], at: i32| LatticePlane { normal, at };
        let reach = (0.2 / edge).ceil();
        if reach > 1e4 {
            return Err(MeshingError::TooLarge { what: "the head".into(), found: reach as u128, limit: 10_000 });
        }
        let cubes = |low: f64, high: f64| ((low / edge).floor() as i32 - 1, ((high - low) / edge).ceil() as usize + 3);
        // c0 = (x + z) / (s edge) and c1 = (z - x) / (s edge) over 0 <= x <= .09, in cubes of two.
        let (low0, n0) = cubes(BOTTOM * s, (0.09 + TOP) * s);
        let (low1, n1) = cubes((BOTTOM - 0.09) * s, TOP * s);
        let (low2, n2) = cubes(-0.125, BACK + edge);
        let mouth = Cuboid { low: Vec3::new(-MOUTH, -1.0, -1.0), high: Vec3::new(MOUTH + 0.5 * edge, TEETH, 1.0) };
        Lattice {
            edge,
            origin: Vec3::zeros(),
            axes,
            low: [low0, low1, low2],
            cubes: [n0, n1, n2],
            ends: vec![plane([1, -1, 0], 0), plane([1, 1, 0], layer(BOTTOM)), plane([-1, -1, 0], -layer(TOP))],
            rails: vec![(plane([1, 1, 0], 0), Some(mouth))],
        }
        .checked()
    }
}

/// Inner faces that are part of the slit, by their corners and the middles of the tetrahedra on both sides.
fn inner_faces(mesh: &Stuffed, in_slit: impl Fn([Vec3; 3], Vec3, Vec3) -> bool) -> Vec<[u32; 3]> {
    let adjacent = neighbours(&mesh.tets);
    let at = |a: u32| mesh.nodes[a as usize];
    let middle = |e: usize| mesh.tets[e].map(at).into_iter().sum::<Vec3>() / 4.0;
    let mut out = Vec::new();
    for (e, tet) in mesh.tets.iter().enumerate() {
        for f in (0..4).filter(|&f| adjacent[e][f] != OPEN && adjacent[e][f] as usize > e) {
            let t = FACES[f].map(|a| tet[a]);
            if in_slit(t.map(at), middle(e), middle(adjacent[e][f] as usize)) {
                out.push(t);
            }
        }
    }
    out
}

/// A half with its image in x = 0; nodes in that plane are shared.
fn mirrored(half: &Stuffed) -> Stuffed {
    let mut whole = half.clone();
    let image: Vec<u32> = half
        .nodes
        .iter()
        .zip(&half.wall)
        .zip(0u32..)
        .map(|((x, &wall), a)| {
            if x.x == 0.0 {
                return a;
            }
            whole.nodes.push(Vec3::new(-x.x, x.y, x.z));
            whole.wall.push(wall);
            whole.plane.push(0);
            whole.nodes.len() as u32 - 1
        })
        .collect();
    whole.tets.extend(half.tets.iter().map(|&[a, b, c, d]| [b, a, c, d].map(|n| image[n as usize])));
    whole
}
