//! Manufactured solutions: a smooth motion is chosen, the body force that it needs follows from the strong form, and
//! refinement must approach the motion at the element's order.
//!
//! ```text
//! u_k = c sin(w_k . X + p_k),   b = -Div P(I + grad u),   (Div P)_i = dP_iJ/dF_kL d2u_k/dX_L dX_J
//! |u_h - u|_L2 ~ h^(p+1),   |grad u_h - grad u|_L2 ~ h^p,   p = 1 (tet4), 2 (tet10)
//! ```
//!
//! Source: Roache, "Code Verification by the Method of Manufactured Solutions", J. Fluids Eng. 124(1), 2002. Shape
//! functions and quadrature are written out here, apart from the library's.

use cutis::effect::Elements;
use cutis::energy::{Energy, Lame, Linear, NeoHookean, StableNeoHookean};
use cutis::fem::{At, Configuration, Curvature, Dofs, EDGES, Elastic, HessianSink, Term, add_midsides};
use cutis::geometry::{Block, Pattern, block};
use cutis::math::{Mat3, Vec3, vec9};
use cutis::mesh::TetMesh;
use cutis::solve::{LinearSystems, Minimiser, Precision, Problem, Strategy};

/// A measured rate may lie this far below the theory's on these meshes, which are not yet fine.
const SLACK: f64 = 0.1;
/// Amplitude of the motion of a unit block: strains of about 15 %.
const C: f64 = 0.05;
/// About the L2 norms of u and of its gradient.
const SIZE: [f64; 2] = [C, 3.0 * C];
const W: [[f64; 3]; 3] = [[2.0, 1.1, 0.7], [-0.9, 1.8, 1.3], [1.2, -0.8, 2.2]];
const PHASE: [f64; 3] = [0.3, 0.7, -0.4];

fn wave(k: usize, X: &Vec3) -> (Vec3, f64) {
    let w = Vec3::from(W[k]);
    (w, w.dot(X) + PHASE[k])
}

fn u(X: &Vec3) -> Vec3 {
    Vec3::from_fn(|k, _| C * wave(k, X).1.sin())
}

fn F(X: &Vec3) -> Mat3 {
    let row = |k| {
        let (w, phase) = wave(k, X);
        (C * phase.cos() * w).transpose()
    };
    Mat3::identity() + Mat3::from_rows(&[row(0), row(1), row(2)])
}

/// Body force per rest volume, N/m3.
fn body_force(law: &impl Energy, X: &Vec3) -> Vec3 {
    let A = law.dPdF(&F(X));
    let mut b = Vec3::zeros();
    for J in 0..3 {
        // dF/dX_J
        let row = |k| {
            let (w, phase) = wave(k, X);
            (-C * phase.sin() * w[J] * w).transpose()
        };
        let dP = A * vec9(&Mat3::from_rows(&[row(0), row(1), row(2)]));
        b -= Vec3::new(dP[3 * J], dP[3 * J + 1], dP[3 * J + 2]);
    }
    b
}

/// Barycentric points and shares of the volume, exact to degree 5: Gauss-Legendre on the collapsed cube.
fn quadrature() -> Vec<([f64; 4], f64)> {
    let (a, b): (f64, f64) = (0.339_981_043_584_856_3, 0.861_136_311_594_052_6);
    let (wa, wb) = (0.652_145_154_862_546_1, 0.347_854_845_137_453_9);
    let gauss = [(-b, wb), (-a, wa), (a, wa), (b, wb)].map(|(x, w)| (0.5 * (1.0 + x), 0.5 * w));
    let mut points = Vec::new();
    for (r, wr) in gauss {
        for (s, ws) in gauss {
            for (t, wt) in gauss {
                let L = [r, (1.0 - r) * s, (1.0 - r) * (1.0 - s) * t];
                let w = 6.0 * wr * ws * wt * (1.0 - r).powi(2) * (1.0 - s);
                points.push(([1.0 - L[0] - L[1] - L[2], L[0], L[1], L[2]], w));
            }
        }
    }
    points
}

/// Shape functions and their gradients, given the barycentric coordinates and their gradients.
fn shape(L: &[f64; 4], dL: &[Vec3; 4], order: u32) -> Vec<(f64, Vec3)> {
    if order == 1 {
        return (0..4).map(|i| (L[i], dL[i])).collect();
    }
    let corner = (0..4).map(|i| (L[i] * (2.0 * L[i] - 1.0), (4.0 * L[i] - 1.0) * dL[i]));
    corner.chain(EDGES.map(|[i, j]| (4.0 * L[i] * L[j], 4.0 * (L[i] * dL[j] + L[j] * dL[i])))).collect()
}

/// Calls back with nodes, shape functions, place and weight of every quadrature point of a mesh with straight edges.
fn each_point(mesh: &TetMesh, midsides: &[[u32; 6]], mut visit: impl FnMut(&[u32], &[(f64, Vec3)], &Vec3, f64)) {
    let points = quadrature();
    for (e, tet) in mesh.tets.iter().enumerate() {
        let x = tet.map(|a| mesh.nodes[a as usize]);
        let edges = Mat3::from_columns(&[x[1] - x[0], x[2] - x[0], x[3] - x[0]]);
        let inverse = edges.try_inverse().expect("a positive volume");
        let d = [0, 1, 2].map(|k| Vec3::from(inverse.row(k).transpose()));
        let dL = [-(d[0] + d[1] + d[2]), d[0], d[1], d[2]];
        let nodes: Vec<u32> = tet.iter().chain(midsides.get(e).into_iter().flatten()).copied().collect();
        for (L, w) in &points {
            let X: Vec3 = (0..4).map(|i| L[i] * x[i]).sum();
            let shape = shape(L, &dL, if midsides.is_empty() { 1 } else { 2 });
            visit(&nodes, &shape, &X, w * edges.determinant() / 6.0);
        }
    }
}

/// The consistent nodal forces of the body force.
struct BodyForce(Vec<Vec3>);

impl Term for BodyForce {
    fn name(&self) -> &'static str {
        "body force"
    }
    fn energy(&self, _at: &At, x: &[Vec3]) -> f64 {
        -self.0.iter().zip(x).map(|(f, x)| f.dot(x)).sum::<f64>()
    }
    fn add_gradient(&self, at: &At, x: &[Vec3], g: &mut [Vec3]) -> f64 {
        g.iter_mut().zip(&self.0).for_each(|(g, f)| *g -= f);
        self.energy(at, x)
    }
    fn couplings(&self, _clique: &mut dyn FnMut(&[u32])) {}
    fn add_hessian(&self, _at: &At, _x: &[Vec3], _curvature: Curvature, _sink: &mut dyn HessianSink) {}
    fn is_quadratic(&self) -> bool {
        true
    }
}

/// Errors of u in L2 and of grad u in L2 on a unit block of n cells a side whose boundary follows the motion.
fn errors<M: Energy + 'static>(law: fn() -> M, force: f64, order: u32, n: usize) -> [f64; 2] {
    let spec = Block {
        origin: Vec3::zeros(),
        size: Vec3::repeat(1.0),
        cells: [n; 3],
        pattern: Pattern::Six,
        layers: Vec::new(),
    };
    let mut mesh = block(&spec).expect("a block");
    let midsides = if order == 2 { add_midsides(&mut mesh) } else { Vec::new() };
    let on_boundary = |X: &Vec3| X.iter().any(|c| *c == 0.0 || *c == 1.0);
    let n_nodes = mesh.nodes.len();
    let prescribed = (0..n_nodes as u32).filter(|&a| on_boundary(&mesh.nodes[a as usize])).collect();
    let dofs = Dofs::new(n_nodes, prescribed, Vec::new());
    let mut f = vec![Vec3::zeros(); n_nodes];
    each_point(&mesh, &midsides, |nodes, shape, X, w| {
        let b = force * body_force(&law(), X);
        nodes.iter().zip(shape).for_each(|(&a, (N, _))| f[a as usize] += w * N * b);
    });
    let elements = Elements { X: &mesh.nodes, tets: &mesh.tets, midsides: &midsides };
    let terms: Vec<Box<dyn Term>> = vec![elements.of(Elastic(law())), Box::new(BodyForce(f))];
    let at = At::NOWHERE;
    let problem = Problem { terms: &terms, dofs: &dofs, X: &mesh.nodes, pivots: &[], wrenches: &[], at };
    let newton = Strategy {
        memory: 0,
        refresh_after: 1,
        tolerance: 1e-10,
        max_iterations: 50,
        linear: LinearSystems::Direct,
        precision: Precision::Double,
        threads: 1,
        without: None,
    };
    // The start is the motion at the nodes, where every law is defined; the equilibrium is near it and elsewhere.
    let x = mesh.nodes.iter().map(|X| X + u(X)).collect();
    let mut config = Configuration { x, poses: Vec::new() };
    Minimiser::new(&problem, newton).and_then(|mut m| m.minimise(&problem, &mut config)).expect("an equilibrium");
    let mut sums = [0.0, 0.0];
    each_point(&mesh, &midsides, |nodes, shape, X, w| {
        let moved = |a: u32| config.x[a as usize] - mesh.nodes[a as usize];
        let u_h: Vec3 = nodes.iter().zip(shape).map(|(&a, (N, _))| *N * moved(a)).sum();
        let grad: Mat3 = nodes.iter().zip(shape).map(|(&a, (_, dN))| moved(a) * dN.transpose()).sum();
        sums[0] += w * (u_h - u(X)).norm_squared();
        sums[1] += w * (grad + Mat3::identity() - F(X)).norm_squared();
    });
    sums.map(f64::sqrt)
}

fn check<M: Energy + 'static>(law: fn() -> M, force: f64) {
    for (order, cells) in [(1, [4, 8, 16]), (2, [2, 4, 8])] {
        let e = cells.map(|n| errors(law, force, order, n));
        for (norm, name) in ["L2", "H1"].into_iter().enumerate() {
            let wanted = f64::from(order + 1) - norm as f64;
            let rates = [0, 1].map(|k| (e[k][norm] / e[k + 1][norm]).log2());
            println!(
                "{} of order {order}, {name}: {:.2e}, {:.2e}, {:.2e} on {cells:?} cells, rates {:.2}, {:.2} (theory {wanted})",
                M::NAME,
                e[0][norm],
                e[1][norm],
                e[2][norm],
                rates[0],
                rates[1]
            );
            assert!(rates[1] > wanted - SLACK, "{} order {order}, {name}: rate {:.2}", M::NAME, rates[1]);
            assert!(e[2][norm] < 0.1 * SIZE[norm], "{} order {order}, {name}: {:.2e}", M::NAME, e[2][norm]);
        }
    }
}

fn lame() -> Lame {
    Lame::new(1.0, 0.4)
}

#[test]
fn manufactured_motion_is_approached_at_the_order_of_the_element() {
    check(|| Linear(lame()), 1.0);
    check(|| NeoHookean(lame()), 1.0);
    check(|| StableNeoHookean(lame()), 1.0);
}

#[test]
#[should_panic]
fn a_planted_error_in_the_body_force_spoils_the_order() {
    check(|| StableNeoHookean(lame()), 1.02);
}
