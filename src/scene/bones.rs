//! Bones: which nodes they hold, where they start, what is released between them.

use toml::Spanned;

use super::SceneError;
use super::build::Builder;
use super::file::BoneSpec;
use crate::math::Vec3;
use crate::mesh::TetMesh;
use crate::port::Slot;
use crate::sim::{Bone, Drive, Layout, spans_a_plane};

/// Says that no tissue sticks to a bone: it carries the shape of a contact only.
const NO_NODES: &str = "none";
/// Slack of a box's walls, in sizes of the box.
const ROUND_OFF: f64 = 1e-9;

impl Builder<'_> {
    /// Bones and their nodes, and the nodes that two of them claim: with `rings` > 0 these belong to neither.
    pub(super) fn bones(
        &self,
        specs: &[BoneSpec],
        mesh: &TetMesh,
        rings: u32,
    ) -> Result<(Vec<Bone>, Vec<u32>), SceneError> {
        self.text.names("bone", specs.iter().map(|b| &b.name))?;
        let mut owner: Vec<Option<&str>> = vec![None; mesh.nodes.len()];
        let mut shared = vec![false; mesh.nodes.len()];
        let mut bones = Vec::new();
        for spec in specs {
            let wanted = spec.nodes.as_ref().unwrap_or(&spec.name);
            let nodes = match set_nodes(mesh, wanted.get_ref()) {
                Some(nodes) => self.within(spec, &nodes, mesh)?,
                None if wants_no_nodes(spec) => Vec::new(),
                None => return Err(self.no_set(wanted, mesh)),
            };
            for &a in &nodes {
                let Some(other) = owner[a as usize].replace(spec.name.get_ref()) else { continue };
                shared[a as usize] = true;
                if rings == 0 {
                    let message = format!(
                        "bones `{other}` and `{}` both claim node {a}; a node can stick to one bone only: name other \
                         sets, or let [attachment] free_rings = 1 set such nodes free",
                        spec.name.get_ref()
                    );
                    return Err(self.text.at(wanted.span().start, message));
                }
            }
            let drive = match self.text.choice("bone", "drive", &spec.drive)?.unwrap_or("pose") {
                "held" => Drive::Held,
                "force" => Drive::Force,
                "displacement" => Drive::Displacement,
                _ => Drive::Pose,
            };
            bones.push(Bone { name: spec.name.get_ref().clone(), nodes, drive });
        }
        bones.iter_mut().for_each(|b| b.nodes.retain(|a| !shared[*a as usize]));
        let shared = (0..mesh.nodes.len() as u32).filter(|&a| shared[a as usize]).collect();
        Ok((bones, shared))
    }

    /// A bone that a force drives has to be kept from turning by its nodes.
    pub(super) fn can_be_pushed(&self, specs: &[BoneSpec], bones: &[Bone], mesh: &TetMesh) -> Result<(), SceneError> {
        for (spec, bone) in specs.iter().zip(bones).filter(|(_, bone)| bone.drive == Drive::Force) {
            let X: Vec<Vec3> = bone.nodes.iter().map(|&a| mesh.nodes[a as usize]).collect();
            if !X.is_empty() && !spans_a_plane(&X) {
                let message = format!(
                    "bone `{}` is {} but its {} node(s) lie in a line: nothing holds its turn about that line, and its inertia tensor \
                     is singular; a bone that a force drives wants at least 3 nodes that are not in a line",
                    bone.name,
                    bone.drive,
                    X.len()
                );
                return Err(self.text.at(spec.name.span().start, message));
            }
        }
        Ok(())
    }

    /// Says which sets there are.
    fn no_set(&self, wanted: &Spanned<String>, mesh: &TetMesh) -> SceneError {
        let list = |kind: &str, names: Vec<&String>| match names.as_slice() {
            [] => format!("no {kind} set"),
            names => {
                format!("the {kind} sets {}", names.iter().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", "))
            }
        };
        let nodes = list("node", mesh.node_sets.iter().map(|s| &s.name).collect());
        let faces = list("face", mesh.face_sets.iter().map(|s| &s.name).collect());
        let message = format!(
            "unknown node set `{}`, nor is there a face set of that name: the mesh has {nodes} and {faces}; `{NO_NODES}` is for a \
             bone without tissue",
            wanted.get_ref()
        );
        self.text.at(wanted.span().start, message)
    }

    /// Those of `nodes` that lie in the bone's box.
    fn within(&self, spec: &BoneSpec, nodes: &[u32], mesh: &TetMesh) -> Result<Vec<u32>, SceneError> {
        let Some(corners) = &spec.within else {
            return Ok(nodes.to_vec());
        };
        let at = corners.span().start;
        let [low, high] = corners.get_ref().map(Vec3::from);
        if !(0..3).all(|c| low[c].is_finite() && high[c].is_finite() && low[c] <= high[c]) {
            let message = "`within` of [[bone]] wants the smallest corner of a box, then the largest".to_owned();
            return Err(self.text.at(at, message));
        }
        let slack = ROUND_OFF * (high - low).norm();
        let inside = |a: &&u32| {
            let x = mesh.nodes[**a as usize];
            (0..3).all(|c| (low[c] - slack..=high[c] + slack).contains(&x[c]))
        };
        let kept: Vec<u32> = nodes.iter().filter(inside).copied().collect();
        if kept.is_empty() {
            let message = format!("no node of bone `{}` lies `within` its box", spec.name.get_ref());
            return Err(self.text.at(at, message));
        }
        Ok(kept)
    }

    /// Start values of the bones' inputs; nodes from `first_of_contacts` on move shapes of contacts.
    pub(super) fn bone_starts(
        &self,
        specs: &[BoneSpec],
        bones: &[Bone],
        first_of_contacts: u32,
        mesh: &TetMesh,
        layout: &Layout,
        start: &mut [f64],
    ) -> Result<(), SceneError> {
        for (b, (spec, bone)) in specs.iter().zip(bones).enumerate() {
            let mut put = |slot: Slot, value: Option<[f64; 3]>| {
                if let (Some(first), Some(value)) = (layout.first(slot), value) {
                    start[first + 3 * b..first + 3 * b + 3].copy_from_slice(&value);
                }
            };
            let own = match bone.nodes.partition_point(|&a| a < first_of_contacts) {
                0 => &bone.nodes[..],
                n => &bone.nodes[..n],
            };
            let centroid = own.iter().map(|&a| mesh.nodes[a as usize]).sum::<Vec3>() / own.len().max(1) as f64;
            put(Slot::BonePivot, Some(self.text.triple("bone", "pivot", &spec.pivot)?.unwrap_or(centroid.into())));
            for (slot, key, value, drive) in [
                (Slot::BoneTranslation, "translation", &spec.translation, Drive::Pose),
                (Slot::BoneRotation, "rotation", &spec.rotation, Drive::Pose),
                (Slot::BoneForce, "force", &spec.force, Drive::Force),
                (Slot::BoneTorque, "torque", &spec.torque, Drive::Force),
            ] {
                if let Some(v) = value.as_ref().filter(|_| bone.drive != drive) {
                    return Err(self.text.at(
                        v.span().start,
                        format!("`{key}` is for a {drive} bone; `{}` is {}", bone.name, bone.drive),
                    ));
                }
                put(slot, self.text.triple("bone", key, value)?);
            }
        }
        Ok(())
    }
}

impl Builder<'_> {
    /// Where time starts at rest, bones do so, too.
    pub(super) fn bones_at_rest(&self, specs: &[BoneSpec]) -> Result<(), SceneError> {
        for spec in specs {
            for (key, value) in [("translation", &spec.translation), ("rotation", &spec.rotation)] {
                let Some(at) = value.as_ref().filter(|value| value.get_ref() != &[0.0; 3]) else { continue };
                let name = spec.name.get_ref();
                let message = format!(
                    "`{key}` moves bone `{name}` before time starts, but `start = \"rest\"` of [inertia] starts from rest: \
                     leave it out, or start in \"equilibrium\""
                );
                return Err(self.text.at(at.span().start, message));
            }
        }
        Ok(())
    }
}

/// The nodes of the node set of this name, else of the face set.
fn set_nodes(mesh: &TetMesh, name: &str) -> Option<Vec<u32>> {
    if let Some(set) = mesh.node_set(name) {
        return Some(set.nodes.clone());
    }
    let mut nodes = mesh.face_set(name)?.triangles.as_flattened().to_vec();
    nodes.sort_unstable();
    nodes.dedup();
    Some(nodes)
}

/// Whether a bone is to have no tissue.
pub(super) fn wants_no_nodes(spec: &BoneSpec) -> bool {
    spec.nodes.as_ref().is_some_and(|nodes| nodes.get_ref() == NO_NODES)
}

/// Takes bone nodes within `rings` edges of another bone off their bone. Edges are counted through tissue and bone alike, from
/// where the bones were before any was set free; nodes that two bones claim (`shared`) are another bone's to both.
pub(super) fn free_rings(mesh: &TetMesh, bones: &mut [Bone], shared: &[u32], rings: u32, warnings: &mut Vec<String>) {
    let neighbours = neighbours(mesh);
    let near = |own: usize| within_edges(&neighbours, bones, shared, own, rings);
    let near: Vec<Vec<bool>> = (0..bones.len()).map(near).collect();
    let mut freed = 0;
    for (b, bone) in bones.iter_mut().enumerate() {
        let had = bone.nodes.len();
        bone.nodes.retain(|&a| !near[b][a as usize]);
        freed += had - bone.nodes.len();
        if bone.nodes.is_empty() && had > 0 {
            warnings.push(format!(
                "all {had} nodes of bone `{}` lie within {rings} edge(s) of another bone and were set free: it holds nothing",
                bone.name
            ));
        }
    }
    if freed > 0 {
        warnings.push(format!("{freed} bone node(s) next to another bone were set free (free_rings = {rings})"));
    }
}

/// Nodes within `rings` edges of any bone but `own`, or of a node that two bones claim.
fn within_edges(neighbours: &[Vec<u32>], bones: &[Bone], shared: &[u32], own: usize, rings: u32) -> Vec<bool> {
    let mut reached = vec![false; neighbours.len()];
    let others = bones.iter().enumerate().filter(|(b, _)| *b != own);
    let mut front: Vec<u32> = others.flat_map(|(_, bone)| &bone.nodes).chain(shared).copied().collect();
    front.iter().for_each(|&a| reached[a as usize] = true);
    for _ in 0..rings {
        let mut next = Vec::new();
        for &b in front.iter().flat_map(|&a| &neighbours[a as usize]) {
            if !std::mem::replace(&mut reached[b as usize], true) {
                next.push(b);
            }
        }
        if next.is_empty() {
            break;
        }
        front = next;
    }
    reached
}

/// Nodes that share a tetrahedron with each node.
fn neighbours(mesh: &TetMesh) -> Vec<Vec<u32>> {
    let mut neighbours = vec![Vec::new(); mesh.nodes.len()];
    for tet in &mesh.tets {
        for &a in tet {
            neighbours[a as usize].extend(tet.iter().copied().filter(|b| *b != a));
        }
    }
    for list in &mut neighbours {
        list.sort_unstable();
        list.dedup();
    }
    neighbours
}
