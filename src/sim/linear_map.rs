//! Scenes whose answer is linear in their inputs: a table instead of a solver.
//!
//! ```text
//! K d = -g_0 - sum_j q_j g_j   =>   x = X + d_0 + sum_j q_j d_j,   f = f_0 + sum_j q_j f_j
//! q: the nine entries of R - I and the three of t of each bone moved by pose; displacements of bone nodes; forces; gravity
//! ```
//!
//! The columns are solved once, each with one correction, so they are exact to round-off; a step is then a product over
//! the nodes that a host can see, and the others follow when somebody asks for them.
//!
//! Source: Bro-Nielsen & Cotin, "Real-time volumetric deformable models for surgery simulation using finite elements and
//! condensation", Computer Graphics Forum 15(3), 1996. Departure: a rigid bone takes twelve columns, whatever its nodes.

use pulp::{Arch, Simd, WithSimd};

use super::SolveError;
use super::model::{Drive, Model};
use super::targets::{read_pivots, target};
use crate::fem::{At, Configuration, Role};
use crate::math::lane::{BATCH, Lane, Real};
use crate::math::{Mat3, Pose, Vec3};
use crate::mesh::TetMesh;
use crate::port::Slot;
use crate::solve::{Minimiser, Problem};

/// A table takes no more bytes than matrices and factor, or than this.
const SMALL: usize = 8_000_000;

/// What a column is the answer to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Cause {
    /// An entry of R - I of a bone.
    Turn { bone: usize, i: usize, j: usize },
    /// A coordinate of the translation of a bone.
    Shift { bone: usize, i: usize },
    /// A coordinate of the displacement of the k-th node of a bone.
    Node { bone: usize, k: usize, i: usize },
    /// An input that terms are affine in.
    Input(usize),
}

/// Positions of some free nodes as a function of q, eight nodes side by side.
pub(super) struct Field {
    pub(super) nodes: Vec<u32>,
    /// Of each batch and coordinate: the offset, then the columns.
    values: Vec<[f64; BATCH]>,
}

/// Reaction on a bone as a function of q; the first entry is that of q = 0.
pub(super) struct Reaction {
    force: Vec<Vec3>,
    /// `sum_a r_a (x) f_a` over the nodes of the bone, arms as at rest.
    moment: Vec<Mat3>,
    /// Force of each node, node by node: only where nodes move one by one and the arms with them.
    nodal: Vec<Vec3>,
}

/// The table of one model under one set of parameters. Where it holds modes (`super::modal`), their columns follow those of
/// the causes, and their coordinates the causes in q.
pub(super) struct LinearMap {
    causes: Vec<Cause>,
    /// The inputs it was made for; those that are causes count for nothing.
    made_for: Vec<f64>,
    is_cause: Vec<bool>,
    pub(super) q: Vec<f64>,
    /// All free nodes.
    pub(super) whole: Field,
    /// Free nodes that ports read, and nodes of bones among those.
    pub(super) seen: Field,
    pub(super) seen_on_bones: Vec<(u32, u32, u32)>,
    reactions: Vec<Reaction>,
    /// Norm of the residual (N) and last correction (m) of each column; the first is that of q = 0.
    residuals: Vec<f64>,
    corrections: Vec<f64>,
    /// Largest norm of F - 1 of each column.
    strains: Vec<f64>,
}

/// Causes of a scene whose equilibrium may be read off a table; none where it is not linear in the inputs, is no
/// equilibrium, or where the scene asks for Newton's method.
fn tabulated(model: &Model) -> Option<Vec<Cause>> {
    let wanted = model.parts().strategy.memory > 0 && !model.remembers();
    wanted.then(|| causes(model)).flatten()
}

/// Causes of a scene whose forces are linear in its inputs; none of one where they are not.
pub(super) fn causes(model: &Model) -> Option<Vec<Cause>> {
    let parts = model.parts();
    if !model.is_quadratic() || !parts.muscles.is_empty() || !parts.pressures.is_empty() {
        return None;
    }
    let mut causes = Vec::new();
    for (bone, b) in parts.bones.iter().enumerate() {
        match b.drive {
            Drive::Held => {}
            Drive::Pose => {
                causes.extend((0..9).map(|k| Cause::Turn { bone, i: k % 3, j: k / 3 }));
                causes.extend((0..3).map(|i| Cause::Shift { bone, i }));
            }
            Drive::Displacement => {
                causes.extend((0..3 * b.nodes.len()).map(|k| Cause::Node { bone, k: k / 3, i: k % 3 }));
            }
            Drive::Force => return None,
        }
    }
    for (slot, len) in [(Slot::LoadForce, 3 * parts.loads.len()), (Slot::Gravity, 3)] {
        if let Some(first) = parts.layout.first(slot) {
            causes.extend((first..first + len).map(Cause::Input));
        }
    }
    Some(causes)
}

/// What the columns are solved with.
pub(super) struct Builder<'a> {
    pub(super) model: &'a Model,
    pub(super) minimiser: &'a mut Minimiser,
    made_for: Vec<f64>,
    is_cause: Vec<bool>,
    pub(super) inputs: Vec<f64>,
    pub(super) pivots: Vec<Vec3>,
    pub(super) config: Configuration,
    pub(super) nodal: Vec<Vec3>,
    pub(super) g: Vec<Vec3>,
    /// Linear solves so far.
    pub(super) solves: u32,
}

/// A solved column.
pub(super) struct Column {
    /// Motion of the unknowns, m for each unit of the cause.
    pub(super) d: Vec<Vec3>,
    /// Gradient at the nodes, N.
    pub(super) nodal: Vec<Vec3>,
    pub(super) residual: f64,
    pub(super) correction: f64,
    /// Largest norm of F - 1.
    pub(super) strain: f64,
}

impl<'a> Builder<'a> {
    /// With the stiffness of these inputs factored.
    pub(super) fn new(
        model: &'a Model,
        minimiser: &'a mut Minimiser,
        inputs: &[f64],
    ) -> Result<Builder<'a>, SolveError> {
        let parts = model.parts();
        let X = &parts.mesh.nodes;
        let mut is_cause = vec![false; inputs.len()];
        let mut mark = |slot: Slot, len: usize| {
            if let Some(first) = parts.layout.first(slot) {
                is_cause[first..first + len].fill(true);
            }
        };
        let n_bones = parts.bones.len();
        mark(Slot::BoneTranslation, 3 * n_bones);
        mark(Slot::BoneRotation, 3 * n_bones);
        mark(Slot::LoadForce, 3 * parts.loads.len());
        mark(Slot::Gravity, 3);
        for (b, bone) in parts.bones.iter().enumerate() {
            mark(Slot::BoneNodal(b as u32), 3 * bone.nodes.len());
        }
        let still = |(&value, &cause): (&f64, &bool)| if cause { 0.0 } else { value };
        let mut builder = Builder {
            model,
            minimiser,
            inputs: inputs.iter().zip(&is_cause).map(still).collect(),
            made_for: inputs.to_vec(),
            is_cause,
            pivots: vec![Vec3::zeros(); n_bones],
            config: Configuration { x: X.clone(), poses: vec![Pose::REST; n_bones] },
            nodal: vec![Vec3::zeros(); X.len()],
            g: vec![Vec3::zeros(); model.dofs().n_blocks()],
            solves: 0,
        };
        read_pivots(model, inputs, &mut builder.pivots);
        let problem = Problem {
            terms: &parts.terms,
            dofs: model.dofs(),
            X,
            pivots: &builder.pivots,
            wrenches: &[],
            at: At { inputs: &builder.inputs, ..At::NOWHERE },
        };
        builder.minimiser.linearise(&problem, &builder.config)?;
        Ok(builder)
    }

    /// The answer to nothing, then to each cause; what is at rest is where the builder stays.
    pub(super) fn columns(&mut self, causes: &[Cause]) -> Vec<Column> {
        let mesh = self.model.mesh();
        let inverse = rest_inverses(mesh);
        let mut columns = vec![self.column(None, None)];
        columns[0].strain = largest_strain(mesh, &inverse, &self.config.x, &mesh.nodes);
        let (rest, g) = (self.config.clone(), self.g.clone());
        for &cause in causes {
            self.set(cause, 1.0);
            let mut column = self.column(Some(&g), Some(&columns[0].nodal));
            column.strain = largest_strain(mesh, &inverse, &self.config.x, &rest.x);
            columns.push(column);
            self.set(cause, 0.0);
            self.config.copy_from(&rest);
        }
        columns
    }

    /// The table of these columns.
    pub(super) fn tabulate(self, causes: Vec<Cause>, columns: &[Column]) -> LinearMap {
        let model = self.model;
        let (seen, seen_on_bones) = seen(model);
        let nodal: Vec<&[Vec3]> = columns.iter().map(|c| &c.nodal[..]).collect();
        let n_bones = model.parts().bones.len();
        LinearMap {
            q: vec![0.0; columns.len() - 1],
            whole: Field::new(model, model.dofs().free.clone(), columns),
            seen: Field::new(model, seen, columns),
            seen_on_bones,
            reactions: (0..n_bones).map(|b| Reaction::new(model, &self.pivots, b, &nodal)).collect(),
            residuals: columns.iter().map(|c| c.residual).collect(),
            corrections: columns.iter().map(|c| c.correction).collect(),
            strains: columns.iter().map(|c| c.strain).collect(),
            causes,
            made_for: self.made_for,
            is_cause: self.is_cause,
        }
    }

    pub(super) fn gradient(&mut self) {
        let parts = self.model.parts();
        let problem = Problem {
            terms: &parts.terms,
            dofs: self.model.dofs(),
            X: &parts.mesh.nodes,
            pivots: &self.pivots,
            wrenches: &[],
            at: At { inputs: &self.inputs, ..At::NOWHERE },
        };
        problem.gradient(&self.config, &self.config, &mut self.nodal, &mut self.g);
    }

    /// Moves the free nodes into equilibrium; what `base` holds already is left out of the column.
    fn column(&mut self, base: Option<&[Vec3]>, nodal_base: Option<&[Vec3]>) -> Column {
        let free = &self.model.dofs().free;
        let mut d = vec![Vec3::zeros(); self.g.len()];
        let mut correction = 0.0;
        for _ in 0..2 {
            self.gradient();
            let mut c = self.g.clone();
            for (c, base) in c.iter_mut().zip(base.unwrap_or_default()) {
                *c -= base;
            }
            self.minimiser.apply_inverse(&mut c);
            self.solves += 1;
            correction = c.iter().map(Vec3::norm).fold(0.0, f64::max);
            for ((c, d), &a) in c.iter().zip(&mut d).zip(free) {
                *d -= c;
                self.config.x[a as usize] -= c;
            }
        }
        self.gradient();
        let nodal = match nodal_base {
            Some(base) => self.nodal.iter().zip(base).map(|(g, base)| g - base).collect(),
            None => self.nodal.clone(),
        };
        let difference = |(g, base): (&Vec3, &Vec3)| (g - base).norm_squared();
        let residual = match base {
            Some(base) => self.g.iter().zip(base).map(difference).sum::<f64>().sqrt(),
            None => self.g.iter().map(Vec3::norm_squared).sum::<f64>().sqrt(),
        };
        Column { d, nodal, residual, correction, strain: 0.0 }
    }

    /// Moves the free nodes by `d`.
    pub(super) fn move_free(&mut self, d: &[Vec3]) {
        self.model.dofs().free.iter().zip(d).for_each(|(&a, d)| self.config.x[a as usize] += d);
    }

    /// Sets one cause to one, or back to nothing.
    pub(super) fn set(&mut self, cause: Cause, value: f64) {
        let parts = self.model.parts();
        let X = &parts.mesh.nodes;
        match cause {
            Cause::Input(k) => self.inputs[k] = value,
            Cause::Node { bone, k, i } => {
                let a = parts.bones[bone].nodes[k] as usize;
                self.config.x[a] = X[a] + value * Vec3::ith(i, 1.0);
            }
            Cause::Shift { bone, i } => {
                for &a in &parts.bones[bone].nodes {
                    self.config.x[a as usize] = X[a as usize] + value * Vec3::ith(i, 1.0);
                }
            }
            Cause::Turn { bone, i, j } => {
                for &a in &parts.bones[bone].nodes {
                    let X = X[a as usize];
                    self.config.x[a as usize] = X + value * (X - self.pivots[bone])[j] * Vec3::ith(i, 1.0);
                }
            }
        }
    }
}

impl LinearMap {
    /// The table of a scene under the given inputs, with the linear solves it took; `None` for scenes that are not linear
    /// in their inputs, or where a table would be larger than matrices and factor.
    ///
    /// # Errors
    /// As for [`Minimiser::linearise`].
    pub fn new(
        model: &Model,
        minimiser: &mut Minimiser,
        inputs: &[f64],
    ) -> Result<Option<(LinearMap, u32)>, SolveError> {
        let Some(causes) = tabulated(model) else {
            return Ok(None);
        };
        let table = 3 * model.mesh().nodes.len() * (causes.len() + 1) * size_of::<f64>();
        if table > minimiser.memory().max(SMALL) || Vec::<u8>::new().try_reserve_exact(table).is_err() {
            return Ok(None);
        }
        let mut builder = Builder::new(model, minimiser, inputs)?;
        let columns = builder.columns(&causes);
        let solves = builder.solves;
        Ok(Some((builder.tabulate(causes, &columns), solves)))
    }

    /// Whether it holds under these inputs.
    pub fn serves(&self, inputs: &[f64]) -> bool {
        self.made_for.iter().zip(inputs).zip(&self.is_cause).all(|((made, now), cause)| *cause || made == now)
    }

    /// Reads the causes off the inputs and the poses they ask for.
    pub fn set(&mut self, model: &Model, inputs: &[f64], poses: &[Pose]) {
        for (q, cause) in self.q.iter_mut().zip(&self.causes) {
            *q = match *cause {
                Cause::Turn { bone, i, j } => poses[bone].R[(i, j)] - if i == j { 1.0 } else { 0.0 },
                Cause::Shift { bone, i } => poses[bone].t[i],
                Cause::Node { bone, k, i } => {
                    let first = model.parts().layout.first(Slot::BoneNodal(bone as u32));
                    inputs[first.expect("the bone is moved node by node") + 3 * k + i]
                }
                Cause::Input(k) => inputs[k],
            };
        }
    }

    /// Bounds of the residual (N), of what a further correction would move (m) and of |F - 1| at the causes as set.
    pub fn bounds(&self) -> [f64; 3] {
        [&self.residuals, &self.corrections, &self.strains]
            .map(|of| of[0] + of[1..].iter().zip(&self.q).map(|(column, q)| column * q.abs()).sum::<f64>())
    }

    /// Puts the nodes that ports read where the causes as set want them.
    pub fn place_seen(&self, model: &Model, inputs: &[f64], pivots: &[Vec3], config: &mut Configuration) {
        self.seen.place(1.0, &self.q, &mut config.x);
        for &(bone, k, a) in &self.seen_on_bones {
            config.x[a as usize] = target(model, inputs, pivots, &config.poses, bone as usize, k as usize);
        }
    }

    /// Puts all nodes there.
    pub fn place_whole(&self, model: &Model, inputs: &[f64], pivots: &[Vec3], config: &mut Configuration) {
        self.whole.place(1.0, &self.q, &mut config.x);
        for (b, bone) in model.parts().bones.iter().enumerate() {
            for (k, &a) in bone.nodes.iter().enumerate() {
                config.x[a as usize] = target(model, inputs, pivots, &config.poses, b, k);
            }
        }
    }

    /// Force (N) and torque (N m, about the moved pivot) that the tissue exerts on a bone.
    pub fn reaction(&self, model: &Model, inputs: &[f64], bone: usize, pose: &Pose) -> (Vec3, Vec3) {
        self.reactions[bone].of(model, inputs, bone, pose, 1.0, &self.q)
    }
}

impl Reaction {
    /// From the gradients at the nodes of each column, N.
    pub(super) fn new(model: &Model, pivots: &[Vec3], bone: usize, columns: &[&[Vec3]]) -> Reaction {
        let nodes = &model.parts().bones[bone].nodes;
        let X = &model.parts().mesh.nodes;
        let arm = |a: u32| X[a as usize] - pivots[bone];
        let force = |nodal: &&[Vec3]| nodes.iter().map(|&a| -nodal[a as usize]).sum();
        let moment = |nodal: &&[Vec3]| nodes.iter().map(|&a| -arm(a) * nodal[a as usize].transpose()).sum();
        let by_node = model.parts().bones[bone].drive == Drive::Displacement;
        let of_node = |&a: &u32| columns.iter().map(move |nodal| -nodal[a as usize]);
        Reaction {
            force: columns.iter().map(force).collect(),
            moment: columns.iter().map(moment).collect(),
            nodal: nodes.iter().filter(|_| by_node).flat_map(of_node).collect(),
        }
    }

    /// Force (N) and torque (N m, about the moved pivot) of `first` times the first column and `q` times the others.
    pub(super) fn of(
        &self,
        model: &Model,
        inputs: &[f64],
        bone: usize,
        pose: &Pose,
        first: f64,
        q: &[f64],
    ) -> (Vec3, Vec3) {
        let Reaction { force, moment, nodal } = self;
        let (mut f, mut m) = (first * force[0], first * moment[0]);
        for ((force, moment), &q) in force[1..].iter().zip(&moment[1..]).zip(q) {
            f += q * force;
            m += q * moment;
        }
        let port = model.parts().layout.first(Slot::BoneNodal(bone as u32)).unwrap_or(0);
        for (k, forces) in nodal.chunks_exact(q.len() + 1).enumerate() {
            let u = Vec3::from_column_slice(&inputs[port + 3 * k..port + 3 * k + 3]);
            let f = forces[1..].iter().zip(q).fold(first * forces[0], |f, (column, &q)| f + q * column);
            m += u * f.transpose();
        }
        let m = pose.R * m;
        (f, Vec3::new(m[(1, 2)] - m[(2, 1)], m[(2, 0)] - m[(0, 2)], m[(0, 1)] - m[(1, 0)]))
    }
}

/// Inverses of the edges at rest of each tetrahedron's corners.
pub(super) fn rest_inverses(mesh: &TetMesh) -> Vec<Mat3> {
    mesh.tets.iter().map(|tet| edges(tet, &mesh.nodes).try_inverse().unwrap_or_else(Mat3::zeros)).collect()
}

fn edges(tet: &[u32; 4], x: &[Vec3]) -> Mat3 {
    let [a, b, c, d] = tet.map(|a| x[a as usize]);
    Mat3::from_columns(&[b - a, c - a, d - a])
}

/// Largest norm of the displacement gradient of the tetrahedra's corners from `from` to `to`.
pub(super) fn largest_strain(mesh: &TetMesh, inverse: &[Mat3], to: &[Vec3], from: &[Vec3]) -> f64 {
    let of = |(tet, inverse): (&[u32; 4], &Mat3)| ((edges(tet, to) - edges(tet, from)) * inverse).norm();
    mesh.tets.iter().zip(inverse).map(of).fold(0.0, f64::max)
}

/// Free nodes that ports read (the skin's and those beside an osteotomy line), and those of bones: `(bone, which, node)`.
fn seen(model: &Model) -> (Vec<u32>, Vec<(u32, u32, u32)>) {
    let mut seen = vec![false; model.mesh().nodes.len()];
    model.skin().each_node(|a| seen[a as usize] = true);
    model.osteotomy().iter().for_each(|&(a, b)| [a, b].into_iter().for_each(|a| seen[a as usize] = true));
    let free = model.dofs().free.iter().copied().filter(|&a| seen[a as usize]).collect();
    let mut on_bones = Vec::new();
    for (b, bone) in model.parts().bones.iter().enumerate() {
        for (k, &a) in bone.nodes.iter().enumerate() {
            if seen[a as usize] {
                on_bones.push((b as u32, k as u32, a));
            }
        }
    }
    (free, on_bones)
}

impl Field {
    fn new(model: &Model, nodes: Vec<u32>, columns: &[Column]) -> Field {
        let X = &model.mesh().nodes;
        let mut values = vec![[0.0; BATCH]; nodes.len().div_ceil(BATCH) * 3 * columns.len()];
        for (n, &a) in nodes.iter().enumerate() {
            let Role::Free(block) = model.dofs().role[a as usize] else {
                unreachable!("fields are of free nodes");
            };
            for (c, X) in X[a as usize].iter().enumerate() {
                let first = (n / BATCH * 3 + c) * columns.len();
                for (to, column) in values[first..].iter_mut().zip(columns) {
                    to[n % BATCH] = column.d[block as usize][c];
                }
                values[first][n % BATCH] += X;
            }
        }
        Field { nodes, values }
    }

    /// The sum of a column times the field `f` of nodes.
    pub(super) fn product(&self, column: usize, f: impl Fn(usize) -> Vec3) -> f64 {
        let columns = self.values.len() / (3 * self.nodes.len().div_ceil(BATCH)).max(1);
        let of = |(n, &a): (usize, &u32)| {
            let f = f(a as usize);
            (0..3).map(|c| self.values[(n / BATCH * 3 + c) * columns + column][n % BATCH] * f[c]).sum::<f64>()
        };
        self.nodes.iter().enumerate().map(of).sum()
    }

    /// Overwrites its nodes of `x` with `first` times the first column and `q` times the others.
    pub(super) fn place(&self, first: f64, q: &[f64], x: &mut [Vec3]) {
        Arch::new().dispatch(Place { field: self, first, q, x });
    }
}

/// The product, compiled for each width of vectors.
struct Place<'a> {
    field: &'a Field,
    first: f64,
    q: &'a [f64],
    x: &'a mut [Vec3],
}

impl WithSimd for Place<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Place { field, first, q, x } = self;
        let mut places = [[0.0; BATCH]; 3];
        let columns = q.len() + 1;
        for (nodes, values) in field.nodes.chunks(BATCH).zip(field.values.chunks_exact(3 * columns)) {
            for (place, values) in places.iter_mut().zip(values.chunks_exact(columns)) {
                for k in 0..BATCH / S::F64_LANES {
                    let mut sum = Lane::load(simd, &values[0], k) * first;
                    for (q, column) in q.iter().zip(&values[1..]) {
                        sum = Lane::splat(simd, *q).mul_add(Lane::load(simd, column, k), sum);
                    }
                    sum.store(place, k);
                }
            }
            for (lane, &a) in nodes.iter().enumerate() {
                x[a as usize] = Vec3::new(places[0][lane], places[1][lane], places[2][lane]);
            }
        }
    }
}
