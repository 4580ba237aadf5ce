//! A tetrahedral mesh with its regions, node sets and face sets; checked on construction.
#![forbid(unsafe_code)]

use crate::math::Vec3;

/// Name of the face set that hosts read as the skin.
pub const SKIN: &str = "skin";

/// A named, sorted set of nodes (a bone's attachment, a group of markers).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NodeSet {
    /// Name by which a scene refers to it, unique among the mesh's node sets.
    pub name: String,
    /// Node indices, ascending, without repetition.
    pub nodes: Vec<u32>,
}

/// A named set of boundary triangles, wound so that the right-hand normal points out of the tissue.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FaceSet {
    /// Name by which a scene refers to it, unique among the mesh's face sets; the skin is named [`SKIN`].
    pub name: String,
    /// Corner nodes of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

/// A triangle surface that rides on the tissue: a skin finer than the mesh it is bound to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FineSkin {
    /// Rest positions of its vertices, m.
    pub vertices: Vec<Vec3>,
    /// Corner vertices of each triangle, wound outward.
    pub triangles: Vec<[u32; 3]>,
}

/// An order of elimination that was found before, so that it need not be found again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Elimination {
    /// Hash of the matrix pattern that it was found for; it serves no other.
    pub pattern: [u8; 32],
    /// Blocks of unknowns, first eliminated first.
    pub order: Vec<u32>,
}

/// Tetrahedra in rest position with everything a scene can refer to by name.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TetMesh {
    /// Rest positions, m.
    pub nodes: Vec<Vec3>,
    /// Corner nodes of each tetrahedron; positive volume: `(x1-x0) x (x2-x0) . (x3-x0) > 0`.
    pub tets: Vec<[u32; 4]>,
    /// For each tetrahedron an index into `region_names`.
    pub region: Vec<u32>,
    /// Names of the tissue regions ("dermis", "fat", "muscle").
    pub region_names: Vec<String>,
    /// Named node sets; those that a scene drives as bones must not share nodes.
    pub node_sets: Vec<NodeSet>,
    /// Named boundary face sets.
    pub face_sets: Vec<FaceSet>,
    /// The skin that hosts read instead of the face set [`SKIN`], if there is one.
    pub fine_skin: Option<FineSkin>,
    /// What a scene of this mesh has been analysed to, if it has.
    pub elimination: Option<Elimination>,
}

/// Why a mesh was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// There is nothing to simulate.
    #[error("the mesh has {nodes} nodes and {tets} tetrahedra; at least 4 and 1 are needed")]
    Empty {
        /// Nodes found.
        nodes: usize,
        /// Tetrahedra found.
        tets: usize,
    },
    /// An index points outside the node list.
    #[error("{what} refers to node {node}, but the mesh has {n_nodes} nodes (0-based)")]
    NodeOutOfRange {
        /// What refers: "tetrahedron 12", "node set `skull`".
        what: String,
        /// The index found.
        node: u32,
        /// Nodes in the mesh.
        n_nodes: usize,
    },
    /// A node position is NaN or infinite.
    #[error("node {node} has a position that is not finite: ({x}, {y}, {z})")]
    NotFinite {
        /// Node index.
        node: usize,
        /// Position found.
        x: f64,
        /// Position found.
        y: f64,
        /// Position found.
        z: f64,
    },
    /// A tetrahedron is flat or turned inside out.
    #[error("tetrahedron {tet} has rest volume {volume:.3e} m3; every rest volume must be positive ({count} are not)")]
    Inverted {
        /// First such tetrahedron.
        tet: usize,
        /// Its signed volume, m3.
        volume: f64,
        /// How many there are.
        count: usize,
    },
    /// Lists that belong together differ in length, or a region index has no name.
    #[error("{what}: found {found}, wanted {wanted}")]
    Inconsistent {
        /// What was compared.
        what: String,
        /// Found.
        found: usize,
        /// Wanted.
        wanted: usize,
    },
    /// Two regions or two sets share a name.
    #[error("two of the {kind} sets are named `{name}`; names must be unique")]
    DuplicateName {
        /// "region", "node" or "face".
        kind: &'static str,
        /// The name.
        name: String,
    },
}

/// Volumes below this share of the cube of the longest edge are rounding: such an element has no inverse.
const FLAT: f64 = 1e-15;

/// Faces of a tetrahedron by its corners, each opposite the corner of the same number, wound outward.
pub const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// The same numbers in ascending order.
pub(crate) fn sorted<const N: usize>(mut nodes: [u32; N]) -> [u32; N] {
    nodes.sort_unstable();
    nodes
}

/// Signed volume of a tetrahedron, m3; positive where the corners turn right-handed.
pub fn signed_volume(x: [Vec3; 4]) -> f64 {
    (x[1] - x[0]).cross(&(x[2] - x[0])).dot(&(x[3] - x[0])) / 6.0
}

impl FineSkin {
    /// Leaves out vertices that no triangle uses; the others keep their order.
    pub fn drop_unused(&mut self) {
        let mut new = vec![u32::MAX; self.vertices.len()];
        self.triangles.as_flattened().iter().for_each(|&a| new[a as usize] = 0);
        (0u32..).zip(new.iter_mut().filter(|n| **n == 0)).for_each(|(next, n)| *n = next);
        let mut keep = new.iter().map(|&n| n != u32::MAX);
        self.vertices.retain(|_| keep.next() == Some(true));
        self.triangles.iter_mut().for_each(|t| *t = t.map(|a| new[a as usize]));
    }

    /// The skin of `mesh` itself.
    pub fn of(mesh: &TetMesh) -> FineSkin {
        let triangles = mesh.face_set(SKIN).map_or(Vec::new(), |s| s.triangles.clone());
        let mut skin = FineSkin { vertices: mesh.nodes.clone(), triangles };
        skin.drop_unused();
        skin
    }

    /// Each triangle cut in four at the middles of its edges.
    pub fn subdivided(&self) -> FineSkin {
        let mut vertices = self.vertices.clone();
        let mut middle: std::collections::HashMap<(u32, u32), u32> = Default::default();
        let mut half = |a: u32, b: u32| {
            *middle.entry((a.min(b), a.max(b))).or_insert_with(|| {
                vertices.push(0.5 * (self.vertices[a as usize] + self.vertices[b as usize]));
                vertices.len() as u32 - 1
            })
        };
        let cut = |&[a, b, c]: &[u32; 3]| {
            let [p, q, r] = [half(a, b), half(b, c), half(c, a)];
            [[a, p, r], [b, q, p], [c, r, q], [p, q, r]]
        };
        let triangles = self.triangles.iter().flat_map(cut).collect();
        FineSkin { vertices, triangles }
    }

    fn check(&self) -> Result<(), MeshError> {
        let n_nodes = self.vertices.len();
        if self.triangles.is_empty() {
            return Err(MeshError::Inconsistent { what: "triangles of the fine skin".into(), found: 0, wanted: 1 });
        }
        if let Some((node, x)) = self.vertices.iter().enumerate().find(|(_, x)| !x.iter().all(|c| c.is_finite())) {
            return Err(MeshError::NotFinite { node, x: x.x, y: x.y, z: x.z });
        }
        match self.triangles.as_flattened().iter().find(|&&a| a as usize >= n_nodes) {
            Some(&node) => Err(MeshError::NodeOutOfRange { what: "the fine skin".into(), node, n_nodes }),
            None => Ok(()),
        }
    }
}

impl TetMesh {
    /// Returns the mesh itself if it can be simulated: indices in range, finite positions, positive rest volumes,
    /// unique set names, lists of equal length.
    ///
    /// # Errors
    /// The first broken rule as a [`MeshError`].
    pub fn checked(self) -> Result<Self, MeshError> {
        let n_nodes = self.nodes.len();
        if n_nodes < 4 || self.tets.is_empty() {
            return Err(MeshError::Empty { nodes: n_nodes, tets: self.tets.len() });
        }
        if self.region.len() != self.tets.len() {
            return Err(MeshError::Inconsistent {
                what: "region list against tetrahedra".into(),
                found: self.region.len(),
                wanted: self.tets.len(),
            });
        }
        if let Some(&r) = self.region.iter().find(|&&r| r as usize >= self.region_names.len()) {
            return Err(MeshError::Inconsistent {
                what: format!("region index {r} against region names"),
                found: self.region_names.len(),
                wanted: r as usize + 1,
            });
        }
        if let Some((node, x)) = self.nodes.iter().enumerate().find(|(_, x)| !x.iter().all(|c| c.is_finite())) {
            return Err(MeshError::NotFinite { node, x: x.x, y: x.y, z: x.z });
        }
        let in_range = |what: &dyn Fn() -> String, nodes: &[u32]| match nodes.iter().find(|&&a| a as usize >= n_nodes) {
            Some(&node) => Err(MeshError::NodeOutOfRange { what: what(), node, n_nodes }),
            None => Ok(()),
        };
        for (e, tet) in self.tets.iter().enumerate() {
            in_range(&|| format!("tetrahedron {e}"), tet)?;
        }
        for set in &self.node_sets {
            in_range(&|| format!("node set `{}`", set.name), &set.nodes)?;
        }
        for set in &self.face_sets {
            in_range(&|| format!("face set `{}`", set.name), set.triangles.as_flattened())?;
        }
        if let Some(skin) = &self.fine_skin {
            skin.check()?;
        }
        unique("region", self.region_names.iter())?;
        unique("node", self.node_sets.iter().map(|s| &s.name))?;
        unique("face", self.face_sets.iter().map(|s| &s.name))?;
        let inverted = |e: &usize| !self.has_room(*e);
        if let Some(tet) = (0..self.tets.len()).find(inverted) {
            let count = (0..self.tets.len()).filter(inverted).count();
            return Err(MeshError::Inverted { tet, volume: self.volume(tet), count });
        }
        Ok(self)
    }

    /// Whether tetrahedron `e` is neither inside out nor flat to rounding, and its volume is a number.
    fn has_room(&self, e: usize) -> bool {
        let x = self.tets[e].map(|a| self.nodes[a as usize]);
        let longest = (1..4).map(|a| (x[a] - x[0]).norm()).fold(0.0, f64::max);
        let volume = signed_volume(x);
        volume.is_normal() && volume > FLAT * longest.powi(3)
    }

    /// Signed rest volume of tetrahedron `e`, m3.
    pub fn volume(&self, e: usize) -> f64 {
        signed_volume(self.tets[e].map(|a| self.nodes[a as usize]))
    }

    /// Boundary triangles of all tetrahedra, wound outward, in the order of the tetrahedra they close.
    pub fn boundary(&self) -> Vec<[u32; 3]> {
        let mut faces: Vec<([u32; 3], [u32; 3])> = Vec::with_capacity(4 * self.tets.len());
        for tet in &self.tets {
            for face in FACES {
                let wound = face.map(|a| tet[a]);
                faces.push((sorted(wound), wound));
            }
        }
        let mut order: Vec<u32> = (0..faces.len() as u32).collect();
        order.sort_unstable_by_key(|&f| (faces[f as usize].0, f));
        let same = |p: usize, q: usize| faces[order[p] as usize].0 == faces[order[q] as usize].0;
        let mut single: Vec<u32> = (0..order.len())
            .filter(|&k| !(k > 0 && same(k - 1, k) || k + 1 < order.len() && same(k, k + 1)))
            .map(|k| order[k])
            .collect();
        single.sort_unstable();
        single.into_iter().map(|f| faces[f as usize].1).collect()
    }

    /// The face set of this name.
    pub fn face_set(&self, name: &str) -> Option<&FaceSet> {
        self.face_sets.iter().find(|s| s.name == name)
    }

    /// The node set of this name.
    pub fn node_set(&self, name: &str) -> Option<&NodeSet> {
        self.node_sets.iter().find(|s| s.name == name)
    }

    /// Nodes of the skin triangles, ascending: the order of `skin.position`. Empty if the mesh has no skin.
    pub fn skin_nodes(&self) -> Vec<u32> {
        let mut nodes = self.face_set(SKIN).map_or(Vec::new(), |s| s.triangles.as_flattened().to_vec());
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}

fn unique<'a>(kind: &'static str, names: impl Iterator<Item = &'a String>) -> Result<(), MeshError> {
    let mut seen = std::collections::BTreeSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err(MeshError::DuplicateName { kind, name: name.clone() });
        }
    }
    Ok(())
}
