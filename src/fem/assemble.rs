//! From the Hessian cliques of terms to the matrices of the unknowns.

use super::{At, BlockMatrix, Configuration, CouplingMatrix, Curvature, Dofs, HessianSink, Pattern, Role, Term};
use crate::math::lane::BATCH;
use crate::math::{Mat3, Vec3};

/// Where one block of a clique goes; found once, then read off in the same order at every assembly.
#[derive(Debug, Clone, Copy)]
enum Place {
    /// Among the unknowns.
    Unknown(Stored),
    /// In the coupling to prescribed nodes.
    Coupling(Stored),
    /// Both nodes prescribed: nothing to store.
    Nowhere,
    /// At least one node rides on a rigid body.
    Rigid,
}

/// A stored block, and whether its row is the second node: then it takes the transpose.
#[derive(Debug, Clone, Copy)]
struct Stored {
    k: u32,
    turned: bool,
}

impl Stored {
    fn new(k: Option<usize>, turned: bool) -> Stored {
        Stored { k: k.expect("pattern holds every coupling") as u32, turned }
    }

    #[inline(always)]
    fn add(self, blocks: &mut [Mat3], H: &Mat3) {
        let to = &mut blocks[self.k as usize];
        if self.turned { *to += H.transpose() } else { *to += H }
    }
}

/// The Hessian of a sum of terms over the unknowns, and its coupling to the prescribed nodes.
pub struct Assembly {
    /// Unknown-unknown part.
    pub K: BlockMatrix,
    /// Unknown-prescribed part.
    pub K_p: CouplingMatrix,
    places: Vec<Place>,
}

impl Assembly {
    /// Finds the pattern of the terms' couplings and where each block goes.
    pub fn new(terms: &[Box<dyn Term>], dofs: &Dofs) -> Assembly {
        let (mut unknown, mut coupling) = (Vec::new(), Vec::new());
        let no_arm = |_: &super::RigidBody| Vec3::zeros();
        each_pair(terms, |a, b| {
            let ((ma, na), (mb, nb)) = (dofs.movers(a, no_arm), dofs.movers(b, no_arm));
            for (i, _) in &ma[..na] {
                unknown.extend(mb[..nb].iter().map(|(j, _)| (*i, *j)));
                if let Role::Prescribed(p) = dofs.role[b as usize] {
                    coupling.push((*i, p));
                }
            }
            if let Role::Prescribed(p) = dofs.role[a as usize] {
                coupling.extend(mb[..nb].iter().map(|(j, _)| (*j, p)));
            }
        });
        unknown.extend(dofs.bodies.iter().map(|b| (b.block + 1, b.block)));
        let K = BlockMatrix::zeros(Pattern::new(dofs.n_blocks(), unknown.into_iter()));
        let K_p = CouplingMatrix::new(dofs.n_blocks(), coupling.into_iter());
        let mut places = Vec::new();
        each_pair(terms, |a, b| {
            places.push(match (dofs.role[a as usize], dofs.role[b as usize]) {
                (Role::Free(i), Role::Free(j)) => {
                    Place::Unknown(Stored::new(K.pattern.find(i.max(j), i.min(j)), i < j))
                }
                (Role::Free(i), Role::Prescribed(p)) => Place::Coupling(Stored::new(K_p.find(i, p), false)),
                (Role::Prescribed(p), Role::Free(j)) => Place::Coupling(Stored::new(K_p.find(j, p), true)),
                (Role::Prescribed(_), Role::Prescribed(_)) => Place::Nowhere,
                _ => Place::Rigid,
            });
        });
        Assembly { K, K_p, places }
    }

    /// Bytes of the matrices and of the places in them.
    pub fn memory(&self) -> usize {
        let blocks = self.K.blocks.len() + self.K_p.blocks.len();
        blocks * (size_of::<Mat3>() + size_of::<u32>()) + size_of_val(&self.places[..])
    }

    /// Fills the matrices at `config`; `g` is the nodal gradient there (rigid bodies turn it into curvature).
    #[allow(clippy::too_many_arguments)] // each is one symbol of K(x; terms, dofs)
    pub fn fill(
        &mut self,
        terms: &[Box<dyn Term>],
        dofs: &Dofs,
        at: &At,
        config: &Configuration,
        pivots: &[Vec3],
        g: &[Vec3],
        curvature: Curvature,
    ) {
        self.K.blocks.fill(Mat3::zeros());
        self.K_p.blocks.fill(Mat3::zeros());
        let mut scatter = Scatter { assembly: self, cursor: 0, dofs, config, pivots };
        for term in terms {
            term.add_hessian(at, &config.x, curvature, &mut scatter);
        }
        if curvature == Curvature::Exact {
            self.add_turning(dofs, config, pivots, g);
        }
    }

    /// A rigid body's own curvature: d2x/dw2 = (w x (w x r)) against the gradient on each of its nodes.
    fn add_turning(&mut self, dofs: &Dofs, config: &Configuration, pivots: &[Vec3], g: &[Vec3]) {
        for body in &dofs.bodies {
            let p = pivots[body.bone] + config.poses[body.bone].t;
            for &a in &body.nodes {
                let (r, g) = (config.x[a as usize] - p, g[a as usize]);
                let gr = g * r.transpose();
                *self.K.at_mut(body.block + 1, body.block + 1) +=
                    0.5 * (gr + gr.transpose()) - g.dot(&r) * Mat3::identity();
            }
        }
    }
}

fn each_pair(terms: &[Box<dyn Term>], mut pair: impl FnMut(u32, u32)) {
    for term in terms {
        term.couplings(&mut |nodes| {
            for (k, &a) in nodes.iter().enumerate() {
                for &b in &nodes[k..] {
                    pair(a, b);
                }
            }
        });
    }
}

struct Scatter<'a> {
    assembly: &'a mut Assembly,
    cursor: usize,
    dofs: &'a Dofs,
    config: &'a Configuration,
    pivots: &'a [Vec3],
}

impl HessianSink for Scatter<'_> {
    fn add(&mut self, nodes: &[u32], upper: &[Mat3]) {
        let mut blocks = upper.iter();
        for (k, &a) in nodes.iter().enumerate() {
            for (&b, H) in nodes[k..].iter().zip(&mut blocks) {
                self.add_block(a, b, H);
            }
        }
    }
    fn add_lane(&mut self, nodes: &[u32], upper: &[[[f64; BATCH]; 9]], lane: usize) {
        let mut blocks = upper.iter();
        let mut H = Mat3::zeros();
        for (k, &a) in nodes.iter().enumerate() {
            for (&b, entries) in nodes[k..].iter().zip(&mut blocks) {
                for (h, entry) in H.as_mut_slice().iter_mut().zip(entries) {
                    *h = entry[lane % BATCH];
                }
                self.add_block(a, b, &H);
            }
        }
    }
    fn add_outer(&mut self, nodes: &[u32], c: &[Vec3], scale: f64) {
        for (k, &a) in nodes.iter().enumerate() {
            for (&b, c_b) in nodes[k..].iter().zip(&c[k..]) {
                self.add_block(a, b, &(scale * c[k] * c_b.transpose()));
            }
        }
    }
}

impl Scatter<'_> {
    /// The next block of a clique.
    #[inline(always)]
    fn add_block(&mut self, a: u32, b: u32, H: &Mat3) {
        let Assembly { K, K_p, places } = &mut *self.assembly;
        let place = places[self.cursor];
        self.cursor += 1;
        match place {
            Place::Unknown(to) => to.add(&mut K.blocks, H),
            Place::Coupling(to) => to.add(&mut K_p.blocks, H),
            Place::Nowhere => {}
            Place::Rigid => self.add_rigid(a, b, H),
        }
    }

    /// J_a^T H J_b into the unknowns, and its transpose where a and b differ.
    fn add_rigid(&mut self, a: u32, b: u32, H: &Mat3) {
        let Assembly { K, K_p, .. } = &mut *self.assembly;
        let (dofs, config, pivots) = (self.dofs, self.config, self.pivots);
        let arm = |c: u32| {
            let x = config.x[c as usize];
            move |body: &super::RigidBody| x - pivots[body.bone] - config.poses[body.bone].t
        };
        let ((ma, na), (mb, nb)) = (dofs.movers(a, arm(a)), dofs.movers(b, arm(b)));
        for (i, Ja) in &ma[..na] {
            for (j, Jb) in &mb[..nb] {
                let B = Ja.tr_mul(&(H * Jb));
                if i >= j {
                    *K.at_mut(*i, *j) += B;
                }
                if a != b && j >= i {
                    *K.at_mut(*j, *i) += B.transpose();
                }
            }
        }
        if let Role::Prescribed(p) = dofs.role[b as usize] {
            for (i, Ja) in &ma[..na] {
                *K_p.at_mut(*i, p) += Ja.tr_mul(H);
            }
        }
        if let Role::Prescribed(p) = dofs.role[a as usize] {
            for (j, Jb) in &mb[..nb] {
                *K_p.at_mut(*j, p) += Jb.tr_mul(&H.transpose());
            }
        }
    }
}
