//! What a mesh is worth: shapes of its tetrahedra, soundness of its boundary, distance to the surfaces it stands for.
//!
//! ```text
//! radius ratio = 3 r_in / R_circ            1 for the regular tetrahedron, 0 for a flat one
//! dihedral angles between faces, degrees    70.5 for the regular tetrahedron
//! ```

use std::fmt;

use super::topology::{FACES, boundary, components, fans, neighbours, pinched_edges, stars};
use super::{Field, Nearest, Surface, doubled_area};
use crate::math::Vec3;
use crate::mesh::{TetMesh, signed_volume};

/// Radius ratio below which a tetrahedron counts as degenerate.
const DEGENERATE: f64 = 1e-3;
/// A surface is covered where the mesh comes nearer than this, m.
const COVER: f64 = 1e-3;
/// Share of the surface's area with a distance that is looked at beyond the cover (search reach), m.
const REACH: f64 = 0.02;

/// Figures of one surface of the mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceFigures {
    /// Face set.
    pub name: String,
    /// Its area in the mesh, m2.
    pub area: f64,
    /// Mean distance from the mesh to the surface it stands for, m.
    pub mean: f64,
    /// 95 % of the mesh's surface lies nearer than this, m.
    pub p95: f64,
    /// Largest distance, m.
    pub max: f64,
    /// Share of the wanted surface that the mesh comes within 1 mm of; `None` where it was not measured.
    pub cover: Option<f64>,
}

/// What a mesh is worth.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MeshReport {
    /// Number of nodes.
    pub nodes: usize,
    /// Number of tetrahedra.
    pub tets: usize,
    /// Tetrahedra of negative volume.
    pub inverted: usize,
    /// Tetrahedra of no volume to speak of.
    pub degenerate: usize,
    /// Nodes at the place of another, those of a slit left out.
    pub duplicate_nodes: usize,
    /// Boundary edges of more than two boundary triangles.
    pub pinched_edges: usize,
    /// Boundary nodes whose tetrahedra hang together only there.
    pub pinched_nodes: usize,
    /// Pieces connected through faces.
    pub components: usize,
    /// Smallest and largest dihedral angle, degrees.
    pub dihedral: [f64; 2],
    /// Radius ratio: smallest, 1 %, median.
    pub radius_ratio: [f64; 3],
    /// Volume, m3.
    pub volume: f64,
    /// Volume that the surfaces enclose, m3, where it is known.
    pub wanted_volume: Option<f64>,
    /// Distances to the surfaces.
    pub surfaces: Vec<SurfaceFigures>,
}

impl MeshReport {
    /// Shapes and soundness of a mesh. `slits` says how many coincident pairs of nodes are meant to be there.
    pub fn of(mesh: &TetMesh, slits: usize) -> Self {
        let mut report = Self { nodes: mesh.nodes.len(), tets: mesh.tets.len(), ..Self::default() };
        report.dihedral = [180.0, 0.0];
        let mut ratios = Vec::with_capacity(mesh.tets.len());
        for tet in &mesh.tets {
            let x = tet.map(|a| mesh.nodes[a as usize]);
            let volume = signed_volume(x);
            report.volume += volume;
            report.inverted += usize::from(volume < 0.0);
            let [least, most] = dihedrals(&x);
            report.dihedral = [report.dihedral[0].min(least), report.dihedral[1].max(most)];
            ratios.push(radius_ratio(&x));
        }
        report.degenerate = ratios.iter().filter(|&&r| r < DEGENERATE).count();
        ratios.sort_by(f64::total_cmp);
        if !ratios.is_empty() {
            report.radius_ratio = [0, ratios.len() / 100, ratios.len() / 2].map(|k| ratios[k]);
        }
        report.duplicate_nodes = duplicates(&mesh.nodes).saturating_sub(slits);
        let adjacent = neighbours(&mesh.tets);
        report.components = components(&adjacent).1;
        let faces = boundary(&mesh.tets, &adjacent);
        report.pinched_edges = pinched_edges(&faces).len();
        let mut wanted = vec![false; mesh.nodes.len()];
        faces.iter().for_each(|(t, _)| t.iter().for_each(|&a| wanted[a as usize] = true));
        let (begin, items) = stars(&mesh.tets, mesh.nodes.len(), &wanted);
        let pinched = |a: &usize| {
            fans(&items[begin[*a] as usize..begin[*a + 1] as usize], *a as u32, &mesh.tets, &adjacent).1 > 1
        };
        report.pinched_nodes = (0..mesh.nodes.len()).filter(|&a| wanted[a]).filter(pinched).count();
        report
    }

    /// The figures as a JSON object, lengths in m, angles in degrees.
    pub fn json(&self) -> String {
        let surface = |s: &SurfaceFigures| {
            format!(
                "{{\"name\": \"{}\", \"area\": {}, \"mean\": {}, \"p95\": {}, \"max\": {}, \"cover\": {}}}",
                s.name,
                s.area,
                s.mean,
                s.p95,
                s.max,
                s.cover.map_or("null".into(), |c| c.to_string())
            )
        };
        let surfaces: Vec<String> = self.surfaces.iter().map(surface).collect();
        format!(
            "{{\"nodes\": {}, \"tets\": {}, \"inverted\": {}, \"degenerate\": {}, \"duplicate_nodes\": {}, \
             \"pinched_edges\": {}, \"pinched_nodes\": {}, \"components\": {}, \"dihedral\": {:?}, \"radius_ratio\": {:?}, \
             \"volume\": {}, \"wanted_volume\": {}, \"surfaces\": [{}]}}",
            self.nodes,
            self.tets,
            self.inverted,
            self.degenerate,
            self.duplicate_nodes,
            self.pinched_edges,
            self.pinched_nodes,
            self.components,
            self.dihedral,
            self.radius_ratio,
            self.volume,
            self.wanted_volume.map_or("null".into(), |v| v.to_string()),
            surfaces.join(", ")
        )
    }

    /// Whether the mesh is sound: nothing inverted, degenerate, doubled or pinched, and one piece.
    pub fn is_sound(&self) -> bool {
        let faults = [self.inverted, self.degenerate, self.duplicate_nodes, self.pinched_edges, self.pinched_nodes];
        faults.iter().sum::<usize>() == 0 && self.components == 1
    }

    /// Adds the distance of a face set to a field's zero surface.
    pub fn measure_field(&mut self, mesh: &TetMesh, name: &str, field: &dyn Field) {
        self.measure(mesh, name, |p| field.at(p).abs());
    }

    /// Adds the distance of a face set to a triangle surface, and how much of that surface inside `within` it covers.
    pub fn measure_surface(&mut self, mesh: &TetMesh, name: &str, wanted: &Surface, within: &dyn Field) {
        let bins = Nearest::new(wanted, 2.0 * COVER);
        self.measure(mesh, name, |p| bins.distance(p, REACH).map_or(REACH, |d| d.0));
        let Some(set) = mesh.face_set(name) else { return };
        let own = Surface { vertices: mesh.nodes.clone(), triangles: set.triangles.clone() };
        let own_bins = Nearest::new(&own, 4.0 * COVER);
        let (mut all, mut covered) = (0.0, 0.0);
        for t in 0..wanted.triangles.len() {
            let corners = wanted.corners(t);
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            if within.at(&middle) < 0.0 {
                let area = doubled_area(corners).norm() / 2.0;
                all += area;
                covered += if own_bins.distance(&middle, COVER).is_some() { area } else { 0.0 };
            }
        }
        if let Some(figures) = self.surfaces.last_mut()
            && all > 0.0
        {
            figures.cover = Some(covered / all);
        }
    }

    fn measure(&mut self, mesh: &TetMesh, name: &str, distance: impl Fn(&Vec3) -> f64) {
        let Some(set) = mesh.face_set(name) else { return };
        let mut samples: Vec<(f64, f64)> = Vec::with_capacity(4 * set.triangles.len());
        for t in &set.triangles {
            let x = t.map(|a| mesh.nodes[a as usize]);
            let weight = doubled_area(x).norm() / 8.0;
            // The middles of the four quarters of the triangle.
            let [a, b, c] = x;
            for p in [a + b + c, (a * 4.0 + b + c) / 2.0, (b * 4.0 + c + a) / 2.0, (c * 4.0 + a + b) / 2.0] {
                samples.push((distance(&(p / 3.0)), weight));
            }
        }
        samples.sort_by(|p, q| p.0.total_cmp(&q.0));
        let area: f64 = samples.iter().map(|s| s.1).sum();
        let mut sum = 0.0;
        let mut p95 = 0.0;
        let mut passed = 0.0;
        for &(d, w) in &samples {
            sum += d * w;
            if passed < 0.95 * area {
                p95 = d;
            }
            passed += w;
        }
        let max = samples.last().map_or(0.0, |s| s.0);
        let mean = if area > 0.0 { sum / area } else { 0.0 };
        self.surfaces.push(SurfaceFigures { name: name.into(), area, mean, p95, max, cover: None });
    }
}

/// Smallest and largest dihedral angle of a tetrahedron, degrees.
pub fn dihedrals(x: &[Vec3; 4]) -> [f64; 2] {
    let normal = FACES.map(|f| doubled_area(f.map(|a| x[a])).normalize());
    let mut out = [180.0f64, 0.0f64];
    for a in 0..4 {
        for b in 0..a {
            let angle = (-normal[a].dot(&normal[b])).clamp(-1.0, 1.0).acos().to_degrees();
            out = [out[0].min(angle), out[1].max(angle)];
        }
    }
    out
}

/// Three times the inner over the outer radius of a tetrahedron.
pub fn radius_ratio(x: &[Vec3; 4]) -> f64 {
    let [a, b, c] = [x[1] - x[0], x[2] - x[0], x[3] - x[0]];
    let volume6 = a.cross(&b).dot(&c).abs();
    let area2 = a.cross(&b).norm() + b.cross(&c).norm() + c.cross(&a).norm() + (b - a).cross(&(c - a)).norm();
    let round = a.norm_squared() * b.cross(&c) + b.norm_squared() * c.cross(&a) + c.norm_squared() * a.cross(&b);
    if round.norm() == 0.0 || area2 == 0.0 { 0.0 } else { 6.0 * volume6 * volume6 / (area2 * round.norm()) }
}

fn duplicates(nodes: &[Vec3]) -> usize {
    let mut places: Vec<[u64; 3]> = nodes.iter().map(|x| [x.x, x.y, x.z].map(|c| (c + 0.0).to_bits())).collect();
    places.sort_unstable();
    places.windows(2).filter(|w| w[0] == w[1]).count()
}

impl fmt::Display for MeshReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [least, most] = self.dihedral;
        let [r0, r1, r50] = self.radius_ratio;
        writeln!(f, "nodes {}  tetrahedra {}  components {}", self.nodes, self.tets, self.components)?;
        writeln!(
            f,
            "inverted {}  degenerate {}  duplicate nodes {}",
            self.inverted, self.degenerate, self.duplicate_nodes
        )?;
        writeln!(f, "pinched boundary edges {}  nodes {}", self.pinched_edges, self.pinched_nodes)?;
        writeln!(
            f,
            "dihedral {least:.1} .. {most:.1} degrees  radius ratio {r0:.3} least, {r1:.2} at 1 %, {r50:.2} median"
        )?;
        write!(f, "volume {:.2} mL", self.volume * 1e6)?;
        match self.wanted_volume {
            Some(v) => writeln!(f, " ({:+.2} % of {:.2} mL)", (self.volume / v - 1.0) * 100.0, v * 1e6)?,
            None => writeln!(f)?,
        }
        writeln!(
            f,
            "{:<12} {:>9} {:>8} {:>8} {:>8} {:>8}",
            "surface", "area cm2", "mean mm", "95 % mm", "max mm", "cover %"
        )?;
        for s in &self.surfaces {
            let cover = s.cover.map_or("-".into(), |c| format!("{:.1}", c * 100.0));
            let [mean, p95, max] = [s.mean, s.p95, s.max].map(|d| d * 1e3);
            writeln!(f, "{:<12} {:>9.1} {mean:>8.3} {p95:>8.3} {max:>8.2} {cover:>8}", s.name, s.area * 1e4)?;
        }
        Ok(())
    }
}
