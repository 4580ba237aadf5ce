//! The tables of a scene in modes: columns of the causes, shapes of the modes, and how they stand to each other.
//!
//! ```text
//! sigma = Phi^T M s(q) = sigma_0 + Sigma q      elastic, inertial: forces on bones by causes, modes and accelerations
//! kinetic energy = (|v|^2 + rate.(S^T M S - Sigma^T Sigma) rate + pace.M_b pace)/2
//! ```
//!
//! What they are for stands in `super::modal`.

use nalgebra::DMatrix;

use super::SimError;
use super::audit::Look;
use super::linear_map::{Builder, Cause, Column, LinearMap, Reaction, causes, largest_strain, rest_inverses};
use super::modal::{Coordinates, Last};
use super::model::{Drive, Model};
use super::scheme::Scheme;
use crate::fem::Configuration;
use crate::math::{Mat3, Pose, Vec3};
use crate::solve::{Minimiser, Modes, slowest_modes};

/// Most bytes of the table of inputs and modes.
const MOST_BYTES: usize = 1 << 28;
/// What is left of a mode after its search, in units of its largest motion.
const REMAINDER: f64 = 1e-10;

/// What the modes of a scene hold, and what they leave out.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// Frequencies of the modes, Hz, ascending.
    pub frequencies: Vec<f64>,
    /// Frequency of the slowest mode that is left out, Hz; none where all are there.
    pub left_out: Option<f64>,
    /// Share of the free mass that the modes move when all bones go along x, y and z.
    pub mass_share: [f64; 3],
}

impl Spectrum {
    /// Of the first `n` modes found, with the masses of the unknowns.
    fn new(found: &Modes, n: usize, m: &[f64]) -> Spectrum {
        let hertz = |lambda: &f64| lambda.sqrt() / std::f64::consts::TAU;
        let along = |phi: &[Vec3], i: usize| phi.iter().zip(m).map(|(p, m)| m * p[i]).sum::<f64>();
        let moved = |i: usize| found.phi[..n].iter().map(|phi| along(phi, i).powi(2)).sum::<f64>();
        let all: f64 = m.iter().sum();
        Spectrum {
            frequencies: found.lambda[..n].iter().map(hertz).collect(),
            left_out: found.lambda.get(n).map(hertz),
            mass_share: std::array::from_fn(|i| moved(i) / all),
        }
    }
}

/// A linear function of the causes in modal coordinates: one column a cause.
pub(super) struct Projection(Vec<Vec<Vec3>>);

impl Projection {
    /// Adds `weight` times its value at `q`.
    pub(super) fn add(&self, weight: f64, q: &[f64], to: &mut [Vec3]) {
        for (column, q) in self.0.iter().zip(q) {
            for (to, column) in to.iter_mut().zip(column) {
                *to += weight * q * column;
            }
        }
    }
}

/// The tables of one model under one set of parameters, and the scratch of a step.
pub(super) struct Modal {
    /// Columns of the causes, then of the modes.
    pub(super) map: LinearMap,
    pub(super) causes: Vec<Cause>,
    /// First cause of each bone.
    pub(super) first: Vec<usize>,
    pub(super) n_modes: usize,
    pub(super) lambda: Vec<Vec3>,
    /// sigma = sigma_0 + Sigma q.
    pub(super) sigma_0: Vec<Vec3>,
    pub(super) Sigma: Projection,
    /// The part of Sigma that bones make.
    pub(super) Sigma_b: Projection,
    /// Mass of what the modes leave of the causes' motions, and of the nodes of bones.
    pub(super) residual_mass: DMatrix<f64>,
    pub(super) bone_mass: DMatrix<f64>,
    /// Elastic force on each bone as a function of causes and modes; where damping follows the stiffness.
    pub(super) elastic: Vec<Reaction>,
    /// Inertial force of the nodes of each bone as a function of the causes' accelerations.
    pub(super) inertial: Vec<Reaction>,
    pub(super) spectrum: Spectrum,
    /// When the elements were looked at.
    pub(super) look: Look,
    /// Whether it was said that steps resolve more than the modes hold.
    pub(super) told: bool,
    pub(super) next: Coordinates,
    /// The last step, so that it can be taken again for its derivatives.
    pub(super) last: Last,
    /// The causes as the inputs ask for them.
    pub(super) asked: Vec<f64>,
    /// What elastic forces feel of causes and modes beside the table: damping, and loads not yet followed.
    pub(super) change: Vec<f64>,
    /// Rates of causes, then of modes.
    pub(super) w: Vec<f64>,
    pub(super) scratch: Vec<Vec3>,
    pub(super) accelerations: Vec<f64>,
    pub(super) config: Configuration,
    pub(super) pivots: Vec<Vec3>,
}

/// Motion of a node of a bone at rest position `X` with one unit of a cause of that bone; `k` is its place in the bone.
fn motion(cause: Cause, k: usize, X: &Vec3, pivot: &Vec3) -> Vec3 {
    match cause {
        Cause::Turn { i, j, .. } => (X - pivot)[j] * Vec3::ith(i, 1.0),
        Cause::Shift { i, .. } => Vec3::ith(i, 1.0),
        Cause::Node { k: node, i, .. } if node == k => Vec3::ith(i, 1.0),
        Cause::Node { .. } | Cause::Input(_) => Vec3::zeros(),
    }
}

pub(super) fn bone_of(cause: Cause) -> Option<usize> {
    match cause {
        Cause::Turn { bone, .. } | Cause::Shift { bone, .. } | Cause::Node { bone, .. } => Some(bone),
        Cause::Input(_) => None,
    }
}

/// `Phi^T M d`, three by three.
fn project(phi: &[Vec<Vec3>], m: &[f64], d: &[Vec3]) -> Vec<Vec3> {
    let mut out = vec![Vec3::zeros(); phi.len().div_ceil(3)];
    for (k, phi) in phi.iter().enumerate() {
        out[k / 3][k % 3] = phi.iter().zip(d).zip(m).map(|((phi, d), m)| m * phi.dot(d)).sum();
    }
    out
}

impl Modal {
    /// The tables of a scene in modes, and the linear solves that they took.
    pub(super) fn new(model: &Model, minimiser: &mut Minimiser, inputs: &[f64]) -> Result<(Modal, u32), SimError> {
        let parts = model.parts();
        let inertia = parts.inertia.as_ref().expect("a scene in modes has inertia");
        let reduction = inertia.reduction.expect("a scene in modes says how many");
        let causes = causes(model).expect("the scene of modes was found to be linear");
        let (dofs, X, n_modes) = (model.dofs(), &parts.mesh.nodes, reduction.modes);
        let columns = causes.len() + n_modes;
        let bytes = 3 * X.len() * (columns + 1) * size_of::<f64>();
        if bytes > MOST_BYTES || Vec::<u8>::new().try_reserve_exact(bytes).is_err() {
            return Err(SimError::TooManyModes { columns, bytes, limit: MOST_BYTES });
        }
        let m: Vec<f64> = dofs.free.iter().map(|&a| inertia.m[a as usize]).collect();
        let mut builder = Builder::new(model, minimiser, inputs)?;
        let mut columns = builder.columns(&causes);
        let found = slowest_modes(|d| builder.minimiser.apply_inverse(d), &m, n_modes + 1)?;
        let solves = builder.solves + found.solves;
        let phi = &found.phi[..n_modes];
        columns.extend(shapes(&mut builder, phi, &found.lambda, &m));
        let elastic = match reduction.damping_stiffness {
            0.0 => Vec::new(),
            _ => elastic(model, &mut builder, &causes, &columns),
        };
        let pivots = builder.pivots.clone();
        let (inertial, bone_mass) = bones_inertia(model, &causes, &pivots, &inertia.m);
        let sigma: Vec<Vec<Vec3>> = columns[..=causes.len()].iter().map(|c| project(phi, &m, &c.d)).collect();
        let residual_mass = residual_mass(&columns[1..=causes.len()], &m, &sigma[1..]);
        let zero = || vec![Vec3::zeros(); n_modes.div_ceil(3)];
        let of_bones = |(cause, sigma): (&Cause, &Vec<Vec3>)| bone_of(*cause).map_or(zero(), |_| sigma.clone());
        let Sigma_b = Projection(causes.iter().zip(&sigma[1..]).map(of_bones).collect());
        let mut sigma = sigma.into_iter();
        // What pads the last three modes is a mode that nothing moves.
        let mut lambda = vec![Vec3::repeat(1.0); n_modes.div_ceil(3)];
        found.lambda[..n_modes].iter().enumerate().for_each(|(k, l)| lambda[k / 3][k % 3] = *l);
        let first = |bone| causes.iter().position(|c| bone_of(*c) == Some(bone)).unwrap_or(0);
        let modal = Modal {
            first: (0..parts.bones.len()).map(first).collect(),
            n_modes,
            lambda,
            sigma_0: sigma.next().expect("the column of no cause"),
            Sigma: Projection(sigma.collect()),
            Sigma_b,
            residual_mass,
            bone_mass,
            elastic,
            inertial,
            spectrum: Spectrum::new(&found, n_modes, &m),
            look: Look::none(),
            told: false,
            next: Coordinates::still(model),
            last: Last::none(model),
            asked: vec![0.0; causes.len()],
            change: vec![0.0; causes.len() + n_modes],
            w: vec![0.0; causes.len() + n_modes],
            scratch: zero(),
            accelerations: vec![0.0; causes.len()],
            config: Configuration { x: parts.mesh.nodes.clone(), poses: vec![Pose::REST; parts.bones.len()] },
            map: builder.tabulate(causes.clone(), &columns),
            causes,
            pivots,
        };
        Ok((modal, solves))
    }

    /// Coefficients of the table's columns, causes first, for `first` times what no cause does, the causes `q` and the modal
    /// coordinates `p`.
    pub(super) fn coefficients(&self, first: f64, q: &[f64], p: &[Vec3], scratch: &mut [Vec3], out: &mut [f64]) {
        scratch.copy_from_slice(p);
        self.Sigma.add(-1.0, q, scratch);
        let (causes, modes) = out.split_at_mut(q.len());
        causes.copy_from_slice(q);
        for (k, out) in modes.iter_mut().enumerate() {
            *out = scratch[k / 3][k % 3] - first * self.sigma_0[k / 3][k % 3];
        }
    }

    /// Velocity of the `k`-th node of a bone whose causes change by `pace`.
    pub(super) fn velocity_on_bone(&self, model: &Model, pace: &[f64], pivots: &[Vec3], bone: usize, k: usize) -> Vec3 {
        let parts = model.parts();
        let first = self.first[bone];
        match parts.bones[bone].drive {
            Drive::Pose => {
                let X = parts.mesh.nodes[parts.bones[bone].nodes[k] as usize];
                let turn = Mat3::from_column_slice(&pace[first..first + 9]);
                turn * (X - pivots[bone]) + Vec3::from_column_slice(&pace[first + 9..first + 12])
            }
            Drive::Displacement => Vec3::from_column_slice(&pace[first + 3 * k..first + 3 * k + 3]),
            Drive::Held | Drive::Force => Vec3::zeros(),
        }
    }

    /// A nodal field of `first` times what no cause does, the causes `q` and the modal coordinates `p`; free nodes only.
    pub(super) fn spread(&self, first: f64, q: &[f64], p: &[Vec3], x: &mut [Vec3]) {
        let mut scratch = vec![Vec3::zeros(); p.len()];
        let mut coefficients = vec![0.0; self.map.q.len()];
        self.coefficients(first, q, p, &mut scratch, &mut coefficients);
        self.map.whole.place(first, &coefficients, x);
    }

    /// `Phi^T M u` of the free nodes.
    pub(super) fn gather(&self, model: &Model, u: impl Fn(usize) -> Vec3) -> Vec<Vec3> {
        let m = &model.parts().inertia.as_ref().expect("a scene in modes has inertia").m;
        let mut p = vec![Vec3::zeros(); self.sigma_0.len()];
        for k in 0..self.n_modes {
            p[k / 3][k % 3] = self.map.whole.product(self.causes.len() + 1 + k, |a| m[a] * u(a));
        }
        p
    }

    /// The coordinates of `from`, which are those of other tables, in these.
    pub(super) fn carry(&self, model: &Model, other: &Modal, from: &Coordinates) -> Coordinates {
        let X = &model.mesh().nodes;
        let mut x = X.clone();
        let mut again = |first: f64, q: &[f64], p: &[Vec3]| {
            other.spread(first, q, p, &mut x);
            self.gather(model, |a| x[a] - first * X[a])
        };
        let none = vec![0.0; from.q.len()];
        let p_before = again(1.0, &from.q_before, &from.p_before);
        let remembered = |k: usize| from.memory.iter().map(|m| m[k]).collect::<Vec<_>>();
        let scheme = model.parts().inertia.as_ref().map(|i| i.scheme);
        let memory = match scheme {
            Some(Scheme::GeneralisedAlpha { .. }) => again(0.0, &none, &remembered(0)),
            _ => p_before.clone(),
        };
        let mut to = Coordinates {
            p: again(1.0, &from.q, &from.p),
            v: again(0.0, &from.rate, &from.v),
            memory: memory.into_iter().zip(again(0.0, &none, &remembered(1))).map(|(a, b)| [a, b]).collect(),
            p_before,
            ..from.clone()
        };
        // The same motions about other pivots.
        for (bone, first) in self.first.iter().enumerate() {
            let shift = self.pivots[bone] - other.pivots[bone];
            if model.parts().bones[bone].drive == Drive::Pose && shift != Vec3::zeros() {
                for q in [&mut to.q, &mut to.q_before, &mut to.rate, &mut to.pace] {
                    let moved = Mat3::from_column_slice(&q[*first..first + 9]) * shift;
                    q[first + 9..first + 12].iter_mut().zip(&moved).for_each(|(q, moved)| *q += moved);
                }
            }
        }
        to
    }
}

fn difference(a: &[Vec3], b: &[Vec3]) -> Vec<Vec3> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// What strain alone does to each bone: the columns' gradients without the dead loads in them.
fn elastic(model: &Model, builder: &mut Builder, causes: &[Cause], columns: &[Column]) -> Vec<Reaction> {
    builder.gradient();
    let rest = builder.nodal.clone();
    let mut forces: Vec<Vec<Vec3>> = columns.iter().map(|c| c.nodal.clone()).collect();
    // Rates feel nothing of what is there always.
    forces[0].fill(Vec3::zeros());
    for (force, &cause) in forces[1..].iter_mut().zip(causes).filter(|(_, cause)| bone_of(**cause).is_none()) {
        builder.set(cause, 1.0);
        builder.gradient();
        builder.set(cause, 0.0);
        *force = difference(force, &difference(&builder.nodal, &rest));
    }
    let forces: Vec<&[Vec3]> = forces.iter().map(|f| &f[..]).collect();
    (0..model.parts().bones.len()).map(|b| Reaction::new(model, &builder.pivots, b, &forces)).collect()
}

/// The columns of modes: shapes, the gradient that holds them, and what is left of `K phi = lambda M phi`.
fn shapes(builder: &mut Builder, phi: &[Vec<Vec3>], lambda: &[f64], m: &[f64]) -> Vec<Column> {
    builder.gradient();
    let (rest, nodal, g) = (builder.config.clone(), builder.nodal.clone(), builder.g.clone());
    let inverse = rest_inverses(builder.model.mesh());
    let mut of = |(phi, lambda): (&Vec<Vec3>, &f64)| {
        builder.move_free(phi);
        builder.gradient();
        let strain = largest_strain(builder.model.mesh(), &inverse, &builder.config.x, &rest.x);
        builder.config.copy_from(&rest);
        let left = builder.g.iter().zip(&g).zip(phi).zip(m).map(|(((g, rest), phi), m)| g - rest - *lambda * *m * phi);
        let residual = left.map(|r| r.norm_squared()).sum::<f64>().sqrt();
        let correction = REMAINDER * phi.iter().map(Vec3::norm).fold(0.0, f64::max);
        Column { d: phi.clone(), nodal: difference(&builder.nodal, &nodal), residual, correction, strain }
    };
    phi.iter().zip(lambda).map(&mut of).collect()
}

/// Inertia of the nodes of bones: forces on each bone by accelerations of causes, and the mass of all of them.
fn bones_inertia(model: &Model, causes: &[Cause], pivots: &[Vec3], m: &[f64]) -> (Vec<Reaction>, DMatrix<f64>) {
    let parts = model.parts();
    let mut mass = DMatrix::zeros(causes.len(), causes.len());
    let mut columns = vec![vec![Vec3::zeros(); m.len()]; causes.len() + 1];
    for (b, bone) in parts.bones.iter().enumerate() {
        let of_bone = || (0..causes.len()).filter(|&j| bone_of(causes[j]) == Some(b));
        for (k, &a) in bone.nodes.iter().enumerate() {
            let mine = |&j: &usize| !matches!(causes[j], Cause::Node { k: node, .. } if node != k);
            let moved = |j: usize| motion(causes[j], k, &parts.mesh.nodes[a as usize], &pivots[b]);
            for i in of_bone().filter(mine) {
                columns[i + 1][a as usize] = m[a as usize] * moved(i);
                of_bone().filter(mine).for_each(|j| mass[(i, j)] += m[a as usize] * moved(i).dot(&moved(j)));
            }
        }
    }
    let columns: Vec<&[Vec3]> = columns.iter().map(|c| &c[..]).collect();
    ((0..parts.bones.len()).map(|b| Reaction::new(model, pivots, b, &columns)).collect(), mass)
}

/// `S^T M S - Sigma^T Sigma`.
fn residual_mass(columns: &[Column], m: &[f64], sigma: &[Vec<Vec3>]) -> DMatrix<f64> {
    let matrix = |n: usize, column: &dyn Fn(usize, usize) -> Vec3| {
        DMatrix::from_fn(3 * n, columns.len(), |row, j| column(row / 3, j)[row % 3])
    };
    let S = matrix(m.len(), &|a, j| m[a].sqrt() * columns[j].d[a]);
    let Sigma = matrix(sigma.first().map_or(0, Vec::len), &|k, j| sigma[j][k]);
    S.tr_mul(&S) - Sigma.tr_mul(&Sigma)
}
