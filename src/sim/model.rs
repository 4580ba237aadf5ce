//! The immutable model: mesh, bones, terms, ports. Shared by all simulations of it.

use std::sync::Arc;

use sha2::{Digest, Sha256};

use super::audit::folds;
use super::ports::{Layout, Source, table};
use super::scheme::Scheme;
use super::skin::Skin;
use crate::fem::{Assembly, At, Dofs, Elimination, Embedding, Term, Touch};
use crate::math::{Mat3, Vec3, svd};
use crate::mesh::{FineSkin, TetMesh};
use crate::port::Port;
use crate::solve::{Clearance, Rung, Strategy, nested_dissection};

/// How a bone moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drive {
    /// It stays at rest.
    Held,
    /// The host sets its pose.
    Pose,
    /// The host sets force and torque; the tissue holds it.
    Force,
    /// The host sets the displacement of every node.
    Displacement,
}

impl std::fmt::Display for Drive {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(match self {
            Drive::Held => "held",
            Drive::Pose => "pose-driven",
            Drive::Force => "force-driven",
            Drive::Displacement => "driven node by node",
        })
    }
}

/// A rigid (or nodally driven) bone and the tissue nodes that stick to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Bone {
    /// Name, unique among the bones.
    pub name: String,
    /// Attached nodes, ascending.
    pub nodes: Vec<u32>,
    /// How it moves.
    pub drive: Drive,
}

/// A point that rides on a triangle of the skin.
#[derive(Debug, Clone, PartialEq)]
pub struct Marker {
    /// Name, unique among the markers.
    pub name: String,
    /// Corners of the triangle: nodes of the mesh, or vertices of the fine skin where there is one.
    pub nodes: [u32; 3],
    /// Barycentric weights.
    pub weights: [f64; 3],
    /// Distance of that point from the place that was asked for, m.
    pub off: f64,
}

/// A rigid shape that a bone carries and the tissue cannot enter.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// Name, unique among the contacts.
    pub name: String,
    /// The bone that carries it.
    pub bone: usize,
    /// Nodes of the bone that move it.
    pub frame: [u32; 4],
    /// The term that it is.
    pub term: usize,
    /// Depth beyond which a point of the tissue may be pushed out on the wrong side, m.
    pub reach: f64,
    /// What it looks like at rest; no triangles where it has no end.
    pub surface: FineSkin,
    /// Points of its line at rest, no further apart than its radius, m; none where it has no line.
    pub axis: Vec<Vec3>,
}

impl Contact {
    /// The vertices of its surface where the nodes, at `X` when at rest, have gone to `x`, m.
    pub fn placed(&self, X: &[Vec3], x: &[Vec3]) -> Vec<Vec3> {
        let place = self.motion(X, x);
        self.surface.vertices.iter().map(place).collect()
    }

    /// Where a point of its rest position has gone.
    pub(super) fn motion(&self, X: &[Vec3], x: &[Vec3]) -> impl Fn(&Vec3) -> Vec3 {
        let edges = |x: &[Vec3]| {
            let [a, b, c, d] = self.frame.map(|i| x[i as usize]);
            (a, Mat3::from_columns(&[b - a, c - a, d - a]))
        };
        let ((A, D), (a, d)) = (edges(X), edges(x));
        let F = d * D.try_inverse().unwrap_or_else(Mat3::zeros);
        move |p| a + F * (p - A)
    }
}

/// Dynamics: nodal masses and how time starts.
#[derive(Debug, Clone, PartialEq)]
pub struct Inertia {
    /// Mass of each node, kg.
    pub m: Vec<f64>,
    /// Whether time starts at rest rather than in equilibrium.
    pub start_at_rest: bool,
    /// The time integrator.
    pub scheme: Scheme,
    /// Damping in proportion to the mass, 1/s.
    pub damping_mass: f64,
    /// Largest estimated error of a piece of a step, m; steps are not cut for it if there is none.
    pub accuracy: Option<f64>,
    /// Modes instead of all unknowns; the scene must be linear then.
    pub reduction: Option<Reduction>,
}

/// Linear dynamics in the slowest modes of vibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reduction {
    /// How many.
    pub modes: usize,
    /// Damping in proportion to the stiffness, s: a number here, no term.
    pub damping_stiffness: f64,
}

/// Makes terms of all elements in a law that is defined everywhere and whose only rest is untangled.
pub type StandIn = fn(&TetMesh, &[[u32; 6]]) -> Vec<Box<dyn Term>>;

/// Everything a model is made of.
pub struct ModelParts {
    /// Name of the scene.
    pub name: String,
    /// The tissue.
    pub mesh: TetMesh,
    /// Mid-edge nodes of each tetrahedron; empty for linear elements.
    pub midsides: Vec<[u32; 6]>,
    /// How the mesh's fine skin rides on it, if it has one.
    pub embedding: Option<Embedding>,
    /// Bones, in the order of the ports' rows; no node belongs to two.
    pub bones: Vec<Bone>,
    /// Names of the tissues whose stiffness can be set, in order.
    pub tunable: Vec<String>,
    /// Names of the muscles, in order.
    pub muscles: Vec<String>,
    /// Names of the force loads, in order.
    pub loads: Vec<String>,
    /// Names of the pressure loads, in order.
    pub pressures: Vec<String>,
    /// Contacts, in order.
    pub contacts: Vec<Contact>,
    /// Markers, in order.
    pub markers: Vec<Marker>,
    /// The summands of the energy.
    pub terms: Vec<Box<dyn Term>>,
    /// Makes the elements' stand-in for untangling a start; called only then.
    pub stand_in: StandIn,
    /// Values that the terms remember from step to step.
    pub n_history: usize,
    /// Dynamics, if the scene has it.
    pub inertia: Option<Inertia>,
    /// Where the inputs lie.
    pub layout: Layout,
    /// Start values of all inputs.
    pub start: Vec<f64>,
    /// Whether a step may turn elements inside out where their law has an energy for it.
    pub may_invert: bool,
    /// How the minimum is sought.
    pub strategy: Strategy,
    /// Most linear solves of a step, until the host sets another bound.
    pub most_solves: u32,
    /// Whether stale factors are replaced by ones that a second thread makes while steps go on.
    pub background: bool,
    /// Text that, with the mesh and the ports, identifies the model (the scene).
    pub identity: String,
    /// What the user should know about the model.
    pub warnings: Vec<String>,
}

/// Linear solves of a step that nobody sets a bound to, in units of `max_iterations`; where pieces of a step keep an accuracy, of
/// each of them, of which there may be so many.
const SOLVES: u32 = 5;
const MOST_PIECES: u32 = 256;

/// Most linear solves of a step that nobody sets another bound to.
pub fn usual_solves(inertia: Option<&Inertia>, max_iterations: u32) -> u32 {
    let pieces = if inertia.is_some_and(|i| i.accuracy.is_some()) { MOST_PIECES } else { 1 };
    (pieces * SOLVES).saturating_mul(max_iterations)
}

/// Tissue that nothing holds.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "{count} piece(s) of tissue are held by no bone, so a quasi-static scene has no answer; the largest has {nodes} nodes \
     around ({x:.4}, {y:.4}, {z:.4}) m and {held} held nodes (at least 3 that are not in a line are needed): attach a \
     bone there, drop the piece from the mesh, or add [inertia]"
)]
pub struct Unconstrained {
    /// Loose pieces.
    pub count: usize,
    /// Nodes of the largest.
    pub nodes: usize,
    /// Held nodes in it.
    pub held: usize,
    /// Its centroid, m.
    pub x: f64,
    /// Its centroid, m.
    pub y: f64,
    /// Its centroid, m.
    pub z: f64,
}

/// What is simulated; immutable, shared, `Send + Sync`.
pub struct Model {
    parts: ModelParts,
    ports: Vec<Port>,
    sources: Vec<Source>,
    dofs: Dofs,
    skin: Skin,
    osteotomy: Vec<(u32, u32)>,
    folds: bool,
    clearance: Clearance,
    token: Arc<str>,
}

impl Model {
    /// Finishes a model: splits the unknowns, lists the ports, checks that the tissue is held.
    ///
    /// # Errors
    /// [`Unconstrained`] for a scene with loose tissue that is quasi-static or in modes.
    pub fn new(mut parts: ModelParts) -> Result<Model, Unconstrained> {
        let mut prescribed: Vec<u32> =
            parts.bones.iter().filter(|b| b.drive != Drive::Force).flat_map(|b| b.nodes.iter().copied()).collect();
        prescribed.sort_unstable();
        let rigid = parts.bones.iter().enumerate().filter(|(_, b)| b.drive == Drive::Force);
        let rigid = rigid.map(|(k, b)| (k, b.nodes.clone())).collect();
        let mut dofs = Dofs::new(parts.mesh.nodes.len(), prescribed, rigid);
        dofs.elimination = parts.mesh.elimination.take();
        if parts.inertia.as_ref().is_none_or(|i| i.reduction.is_some()) {
            check_held(&parts, &dofs)?;
        }
        let skin = Skin::new(&parts.mesh, parts.embedding.take());
        let (ports, sources) = table(&parts, skin.len(), skin.triangles().len() / 3);
        let osteotomy = osteotomy_edges(&parts.mesh, &parts.bones);
        if !osteotomy.is_empty() {
            parts.warnings.push(format!(
                "{} edge(s) join nodes of two bones; if the bones move apart the answer depends on the mesh: release \
                 them with [attachment] free_rings = 1",
                osteotomy.len()
            ));
        }
        let folds = folds(&parts.terms, &parts.mesh.nodes, &parts.start, parts.n_history);
        let token = token(&parts, &ports).into();
        let clearance = Clearance(CLEARANCE * smallest_altitude(&parts.mesh));
        Ok(Model { parts, ports, sources, dofs, skin, osteotomy, folds, clearance, token })
    }

    /// The same without one rung of recovery, to measure what it buys.
    pub fn without(mut self, rung: Rung) -> Model {
        self.parts.strategy.without = Some(rung);
        self
    }

    /// Whether its state depends on the way it came: by inertia, or by tissue with a memory.
    pub fn remembers(&self) -> bool {
        self.parts.inertia.is_some() || self.parts.n_history > 0
    }

    /// Tissue that nothing holds, which a scene with inertia may have.
    pub(super) fn unconstrained(&self) -> Option<Unconstrained> {
        check_held(&self.parts, &self.dofs).err()
    }

    /// Whether its elements may turn inside out at a finite energy.
    pub(super) fn folds(&self) -> bool {
        self.folds
    }

    /// How far nodes may go before an element can have turned inside out.
    pub(super) fn clearance(&self) -> Clearance {
        self.clearance
    }

    /// Whether this node moves the shape of a contact, and is of no tissue.
    pub(super) fn is_frame(&self, a: u32) -> bool {
        self.parts.contacts.iter().any(|c| c.frame.contains(&a))
    }

    /// How contact `k` touches at `x`.
    pub(super) fn touch(&self, k: usize, at: &At, x: &[Vec3]) -> Touch {
        self.parts.terms[self.parts.contacts[k].term].touch(at, x).unwrap_or(Touch::NONE)
    }

    /// Name of the scene.
    pub fn name(&self) -> &str {
        &self.parts.name
    }
    /// What it is made of.
    pub fn parts(&self) -> &ModelParts {
        &self.parts
    }
    /// The tissue.
    pub fn mesh(&self) -> &TetMesh {
        &self.parts.mesh
    }
    /// The interface, ascending by value reference.
    pub fn ports(&self) -> &[Port] {
        &self.ports
    }
    /// Index of the port of this name, for example `bone.rotation`.
    pub fn port(&self, name: &str) -> Option<usize> {
        self.ports.iter().position(|p| p.name == name)
    }
    /// Where the values of a port are.
    pub(super) fn source(&self, port: usize) -> Source {
        self.sources[port]
    }
    /// What is unknown.
    pub fn dofs(&self) -> &Dofs {
        &self.dofs
    }
    /// Whether the stiffness is the same everywhere.
    pub(super) fn is_quadratic(&self) -> bool {
        self.dofs.bodies.is_empty() && self.parts.terms.iter().all(|t| t.is_quadratic())
    }
    /// Whether it moves in modes of vibration; its steps have no derivatives by inputs then.
    pub fn is_reduced(&self) -> bool {
        self.parts.inertia.as_ref().is_some_and(|i| i.reduction.is_some())
    }
    /// The order in which its unknowns are best eliminated, to be kept with the mesh; `None` for graphs that have none.
    pub fn elimination(&self) -> Option<Elimination> {
        let pattern = Assembly::new(&self.parts.terms, &self.dofs).K.pattern;
        Some(Elimination { pattern: pattern.hash(), order: nested_dissection(&pattern)? })
    }
    /// What a host reads of the surface.
    pub fn skin(&self) -> &Skin {
        &self.skin
    }
    /// Skin triangles as rows of `skin.position`, flattened.
    pub fn skin_triangles(&self) -> &[i32] {
        self.skin.triangles()
    }
    /// Edges between nodes of two bones.
    pub(super) fn osteotomy(&self) -> &[(u32, u32)] {
        &self.osteotomy
    }
    /// Hash of ports, mesh and scene in braces: FMI's instantiation token. What stands in the scene for people or for its own
    /// programme alone (comments, name, `[run]`, keyframes) is no part of it.
    pub fn token(&self) -> &str {
        &self.token
    }
    /// The token for states, which carry it without a copy.
    pub(super) fn shared_token(&self) -> Arc<str> {
        self.token.clone()
    }
    /// The same with these warnings before its own: what was noticed of the files that it came from.
    #[must_use]
    pub fn with_notes(mut self, notes: Vec<String>) -> Self {
        self.parts.warnings.splice(0..0, notes);
        self
    }

    /// What the user should know about the model.
    pub fn warnings(&self) -> &[String] {
        &self.parts.warnings
    }
}

/// Mesh edges whose ends belong to two bones: across them a bone motion is a jump within one element.
pub fn osteotomy_edges(mesh: &TetMesh, bones: &[Bone]) -> Vec<(u32, u32)> {
    let mut owner = vec![u32::MAX; mesh.nodes.len()];
    for (b, bone) in bones.iter().enumerate() {
        bone.nodes.iter().for_each(|&a| owner[a as usize] = b as u32);
    }
    let mut edges: Vec<(u32, u32)> = mesh
        .tets
        .iter()
        .flat_map(|t| [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)].map(|(i, j)| (t[i].min(t[j]), t[i].max(t[j]))))
        .filter(|&(a, b)| {
            let (p, q) = (owner[a as usize], owner[b as usize]);
            p != q && p != u32::MAX && q != u32::MAX
        })
        .collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

/// Share of the smallest altitude at rest that nodes may go: half of it divides among two ends, and stretches up to 3 in both
/// directions of a face make a deformed altitude a ninth of what det F says.
const CLEARANCE: f64 = 0.05;

/// Smallest altitude of the tetrahedra's corners at rest, m.
fn smallest_altitude(mesh: &TetMesh) -> f64 {
    let of = |tet: &[u32; 4]| {
        let x = tet.map(|a| mesh.nodes[a as usize]);
        let face = |[i, j, k]: [usize; 3]| (x[j] - x[i]).cross(&(x[k] - x[i])).norm();
        let largest = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]].map(face).into_iter().fold(0.0, f64::max);
        6.0 * crate::mesh::signed_volume(x) / largest
    };
    mesh.tets.iter().map(of).fold(f64::INFINITY, f64::min)
}

/// Every connected piece of tissue must have three held nodes that are not in a line.
fn check_held(parts: &ModelParts, dofs: &Dofs) -> Result<(), Unconstrained> {
    let n = parts.mesh.nodes.len();
    let mut piece = DisjointSets::new(n);
    for tet in &parts.mesh.tets {
        tet.iter().for_each(|&a| piece.join(tet[0], a));
    }
    for (tet, midsides) in parts.mesh.tets.iter().zip(&parts.midsides) {
        midsides.iter().for_each(|&a| piece.join(tet[0], a));
    }
    for body in &dofs.bodies {
        body.nodes.iter().for_each(|&a| piece.join(body.nodes[0], a));
    }
    let roots: Vec<u32> = (0..n as u32).map(|a| piece.root(a)).collect();
    let mut held: std::collections::BTreeMap<u32, Vec<Vec3>> = Default::default();
    let mut size: std::collections::BTreeMap<u32, (usize, Vec3)> = Default::default();
    for (a, &root) in roots.iter().enumerate() {
        let entry = size.entry(root).or_insert((0, Vec3::zeros()));
        entry.0 += 1;
        entry.1 += parts.mesh.nodes[a];
    }
    for &a in &dofs.prescribed {
        held.entry(roots[a as usize]).or_default().push(parts.mesh.nodes[a as usize]);
    }
    // Nodes that move the shape of a contact are held one by one.
    let all_held = |root: &u32, nodes: usize| held.get(root).is_some_and(|held| held.len() == nodes);
    let is_loose =
        |root: &u32, nodes: usize| !all_held(root, nodes) && !held.get(root).is_some_and(|held| spans_a_plane(held));
    let loose: Vec<_> = size.iter().filter(|(root, (nodes, _))| is_loose(root, *nodes)).collect();
    let Some((root, (nodes, sum))) = loose.iter().max_by_key(|(_, (nodes, _))| *nodes) else {
        return Ok(());
    };
    let c = sum / *nodes as f64;
    let held = held.get(root).map_or(0, Vec::len);
    Err(Unconstrained { count: loose.len(), nodes: *nodes, held, x: c.x, y: c.y, z: c.z })
}

/// Whether points hold a body: they lie neither in a line nor in one place.
pub fn spans_a_plane(points: &[Vec3]) -> bool {
    if points.is_empty() {
        return false;
    }
    let c = points.iter().sum::<Vec3>() / points.len() as f64;
    let spread: Mat3 = points.iter().map(|p| (p - c) * (p - c).transpose()).sum();
    let s = svd(&spread).s;
    s[1] > 1e-12 * s[0] && s[0] > 0.0
}

struct DisjointSets(Vec<u32>);

impl DisjointSets {
    fn new(n: usize) -> Self {
        DisjointSets((0..n as u32).collect())
    }
    fn root(&mut self, mut a: u32) -> u32 {
        while self.0[a as usize] != a {
            self.0[a as usize] = self.0[self.0[a as usize] as usize];
            a = self.0[a as usize];
        }
        a
    }
    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

fn token(parts: &ModelParts, ports: &[Port]) -> String {
    let mut hash = Sha256::new();
    hash.update(env!("CARGO_PKG_VERSION"));
    hash.update(&parts.identity);
    for p in ports {
        hash.update(format!(
            "{} {} {:?} {:?} {} {:?} {:?}",
            p.name, p.reference, p.ty, p.shape, p.unit, p.causality, p.start
        ));
    }
    let mesh = &parts.mesh;
    mesh.nodes.iter().flat_map(|x| x.iter()).for_each(|c| hash.update(c.to_le_bytes()));
    mesh.tets.as_flattened().iter().chain(&mesh.region).for_each(|i| hash.update(i.to_le_bytes()));
    mesh.region_names.iter().for_each(|name| hash.update(format!("{name:?}")));
    parts.midsides.as_flattened().iter().for_each(|i| hash.update(i.to_le_bytes()));
    for set in &mesh.face_sets {
        hash.update(&set.name);
        set.triangles.as_flattened().iter().for_each(|i| hash.update(i.to_le_bytes()));
    }
    for bone in &parts.bones {
        bone.nodes.iter().for_each(|a| hash.update(a.to_le_bytes()));
    }
    if let Some(skin) = &mesh.fine_skin {
        skin.vertices.iter().flat_map(|x| x.iter()).for_each(|c| hash.update(c.to_le_bytes()));
        skin.triangles.as_flattened().iter().for_each(|i| hash.update(i.to_le_bytes()));
    }
    let digest = hash.finalize();
    let hex: String = digest.iter().take(16).map(|b| format!("{b:02x}")).collect();
    format!("{{{}-{}-{}-{}-{}}}", &hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..])
}
