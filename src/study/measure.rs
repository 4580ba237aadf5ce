//! One variant's run: how the skin moves, what the bones feel, what a step costs.

use std::path::Path;
use std::sync::Arc;

use cpu_time::ThreadTime;

use super::Variant;
use crate::bytes::{Reader, Truncated, Writer};
use crate::error::Error;
use crate::fem::{Detached, Embedding};
use crate::load;
use crate::mesh::{FineSkin, TetMesh};
use crate::port::Slot;
use crate::scene::Setting;
use crate::sim::Sim;

/// Most instants at which answers are compared.
const INSTANTS: usize = 10;

/// Where answers are read: the vertices of one skin, bound to every mesh.
pub struct Probe {
    /// That skin.
    pub skin: FineSkin,
    /// Vertices of it that were left out, since no element of some mesh is near them.
    pub left_out: usize,
    /// Largest number of scalar unknowns that is tried.
    pub most_unknowns: usize,
}

impl Probe {
    /// The part of `skin` that every one of `meshes` has elements near to.
    pub fn new(mut skin: FineSkin, meshes: &[TetMesh], most_unknowns: usize) -> Probe {
        let all = skin.vertices.len();
        for mesh in meshes {
            while let Err(Detached { vertex, .. }) = Embedding::new(mesh, &[], &skin) {
                skin = without(&skin, vertex as u32);
            }
        }
        Probe { left_out: all - skin.vertices.len(), skin, most_unknowns }
    }
}

/// A surface without a vertex, its triangles, and what these alone held.
fn without(skin: &FineSkin, vertex: u32) -> FineSkin {
    let triangles: Vec<[u32; 3]> = skin.triangles.iter().filter(|t| !t.contains(&vertex)).copied().collect();
    let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let place = |a: u32| used.binary_search(&a).expect("every corner is used") as u32;
    FineSkin {
        vertices: used.iter().map(|&a| skin.vertices[a as usize]).collect(),
        triangles: triangles.iter().map(|t| t.map(place)).collect(),
    }
}

/// What a run found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Answer {
    /// Displacements of the probe's vertices (m), flattened, at each instant one after another.
    pub u: Vec<f64>,
    /// Reaction force of each bone (N), flattened, at each instant.
    pub reaction: Vec<f64>,
    /// Number of instants.
    pub instants: usize,
    /// Scalar unknowns.
    pub n_dofs: usize,
    /// CPU seconds of a step of the programme: the median.
    pub step: f64,
    /// CPU seconds before the first step.
    pub setup: f64,
    /// Linear solves of a step of the programme, on average.
    pub solves: f64,
    /// Bytes of matrices, factor and solver.
    pub memory: usize,
}

impl Answer {
    /// Its numbers, for a file of this `identity`.
    pub fn to_bytes(&self, identity: &str) -> Vec<u8> {
        let mut out = Writer::default();
        out.text(identity);
        out.f64s(self.u.iter().copied());
        out.f64s(self.reaction.iter().copied());
        [self.instants, self.n_dofs, self.memory].into_iter().for_each(|n| out.len(n));
        [self.step, self.setup, self.solves].into_iter().for_each(|v| out.f64(v));
        out.0
    }

    /// What [`Answer::to_bytes`] wrote; nothing of another identity or of a file that is cut off.
    pub fn from_bytes(identity: &str, bytes: &[u8]) -> Option<Answer> {
        let mut from = Reader::new(bytes);
        let read = |from: &mut Reader| -> Result<Option<Answer>, Truncated> {
            if from.text()? != identity {
                return Ok(None);
            }
            Ok(Some(Answer {
                u: from.f64s()?,
                reaction: from.f64s()?,
                instants: from.len(0)?,
                n_dofs: from.len(0)?,
                memory: from.len(0)?,
                step: from.f64()?,
                setup: from.f64()?,
                solves: from.f64()?,
            }))
        };
        read(&mut from).ok().flatten()
    }
}

/// Runs the text of a variant. The words of an error are for the table: a variant may have no answer.
///
/// # Errors
/// The scene or a step refused, or more unknowns than the probe allows.
pub fn measure(text: &str, folder: Option<&Path>, variant: &Variant, probe: &Probe) -> Result<Answer, String> {
    let start = ThreadTime::now();
    let words = |e: Error| e.to_string();
    let loaded = load::with_skin(text, folder, probe.skin.clone()).map_err(words)?;
    let model = Arc::new(loaded.model);
    let n_dofs = 3 * model.dofs().n_blocks();
    if n_dofs > probe.most_unknowns {
        return Err(format!("{n_dofs} unknowns, more than the {} that are tried", probe.most_unknowns));
    }
    let mut sim = Sim::new(model.clone()).map_err(|e| e.to_string())?;
    let programme = &loaded.programme;
    set(&mut sim, &programme.settings(0.0))?;
    sim.initialise().map_err(|e| e.to_string())?;
    let setup = start.elapsed().as_secs_f64();
    let at = |slot: Slot| model.ports().iter().position(|p| p.slot == slot);
    let rest: Vec<f64> = probe.skin.vertices.iter().flat_map(|x| x.iter().copied()).collect();
    let mut answer = Answer { n_dofs, setup, ..Answer::default() };
    let (mut times, mut solves) = (Vec::new(), 0);
    let (n, s) = (programme.steps(), variant.substeps);
    let mut skin = vec![0.0; rest.len()];
    for k in 1..=n {
        let start = ThreadTime::now();
        for j in 1..=s {
            let dt = programme.step(k) / s as f64;
            set(&mut sim, &programme.settings(programme.time(k) - (s - j) as f64 * dt))?;
            solves += sim.step(dt).map_err(|e| e.to_string())?.iterations;
        }
        read(&sim, at(Slot::SkinPosition), &mut skin)?;
        times.push(start.elapsed().as_secs_f64());
        if is_instant(k, n) {
            answer.u.extend(skin.iter().zip(&rest).map(|(x, X)| x - X));
            let mut force = vec![0.0; 3 * model.parts().bones.len()];
            read(&sim, at(Slot::BoneReactionForce), &mut force)?;
            answer.reaction.extend(force);
            answer.instants += 1;
        }
    }
    times.sort_by(f64::total_cmp);
    answer.step = times[times.len() / 2];
    answer.solves = f64::from(solves) / n as f64;
    answer.memory = sim.memory();
    Ok(answer)
}

/// Whether answers are compared after step `k` of `n`: at the end and at even distances before.
fn is_instant(k: usize, n: usize) -> bool {
    let stride = n.div_ceil(INSTANTS);
    (n - k).is_multiple_of(stride)
}

fn set(sim: &mut Sim, settings: &[Setting]) -> Result<(), String> {
    settings.iter().try_for_each(|s| sim.set_f64(s.port, s.offset, &s.values)).map_err(|e| e.to_string())
}

fn read(sim: &Sim, port: Option<usize>, to: &mut [f64]) -> Result<(), String> {
    port.map_or(Ok(()), |p| sim.get_f64(p, 0, to)).map_err(|e| e.to_string())
}
