//! Bending, near-incompressibility, twist: what each kind of element gives of the truth. The table of docs/verification.md:
//!
//! ```sh
//! cargo test --release --test verify locking -- --nocapture
//! ```

use cutis::mesh::TetMesh;
use cutis::scene::{SceneFile, build};
use cutis::sim::Sim;

use crate::common::{NODAL, get, port, set, sim, with_pressure};
use crate::sphere;

/// The kinds of element: name, lines of `[mesh]`, and how many times finer than quadratic ones they are cut to have the
/// same nodes.
const ELEMENTS: [(&str, &str, usize); 3] =
    [("tet4", "order = 1\n", 2), ("tet4 with nodal pressure", NODAL, 2), ("tet10", "order = 2\n", 1)];
/// What stands for the truth where there is no formula.
const FINE: &str = "order = 2\n";

/// One line of the table: each element's ratio to the truth.
fn row(case: &str, ratio: impl Fn(&str, usize) -> f64) -> Vec<f64> {
    let ratios: Vec<f64> = ELEMENTS.iter().map(|(_, keys, finer)| ratio(keys, *finer)).collect();
    let cells = ELEMENTS.iter().zip(&ratios).map(|((name, ..), r)| format!("{name} {r:.3}"));
    println!("{case}: {}", cells.collect::<Vec<_>>().join(", "));
    ratios
}

/// Tip of a panel after Cook (tapered, held on the left, sheared towards the right end): a slice of one cell with free
/// faces, so it is compared with the same slice, finely resolved.
fn cook(n: usize, element: &str, nu: f64) -> f64 {
    let scene = |mesh: &str| {
        format!(
            "[mesh]\n{mesh}[[tissue]]\nenergy = \"linear\"\nE = 1e3\nnu = {nu}\n[[bone]]\nname = \"left\"\nnodes = \"x_min\"\n\
             drive = \"held\"\n[[load]]\nname = \"shear\"\nregion = \"end\"\n[[marker]]\nname = \"tip\"\nat = [0.048, 0.060, 0.005]\n"
        )
    };
    let block = format!("[mesh.block]\nsize = [0.048, 0.044, 0.005]\ncells = [{n}, {n}, 1]\n");
    let plain = scene(&block).replace("region = \"end\"", "region = \"tissue\"");
    let mut mesh: TetMesh = cutis::load::from_text(&plain, None).expect("a block").model.mesh().clone();
    for x in &mut mesh.nodes {
        let s = x.x / 0.048;
        let (low, high) = (0.044 * s, 0.044 + 0.016 * s);
        x.y = low + x.y / 0.044 * (high - low);
    }
    // The last quarter takes the shear as a body force.
    let last = 0.048 * 0.75;
    mesh.region_names.push("end".into());
    for e in 0..mesh.tets.len() {
        if mesh.tets[e].iter().all(|&a| mesh.nodes[a as usize].x > last - 1e-9) {
            mesh.region[e] = 1;
        }
    }
    let text = with_pressure(&scene(&format!("{element}{block}")));
    let (model, _) = build(&text, &SceneFile::parse(&text).expect("a scene"), mesh).expect("a model");
    let mut sim = Sim::new(std::sync::Arc::new(model)).expect("a simulation");
    let p = port(&sim, "load.force");
    sim.set_f64(p, 0, &[0.0, 1e-3, 0.0]).expect("a force");
    let rest = get(&sim, "marker.position");
    sim.step(1.0).expect("a linear step");
    get(&sim, "marker.position")[1] - rest[1]
}

#[test]
fn quadratic_tetrahedra_do_not_lock_where_linear_ones_do() {
    let nu = 0.4999;
    let truth = cook(24, FINE, nu);
    let [.., last] =
        [4, 8, 16].map(|n| row(&format!("Cook, nu {nu}, {n} x {n} x 1 cells"), |e, _| cook(n, e, nu) / truth));
    assert!(last[2] > 0.97, "quadratic: {:.3} of the truth", last[2]);
    assert!(last[1] > 0.88, "averaged nodal pressure: {:.3} of the truth", last[1]);
    assert!(last[0] < 0.6, "linear tetrahedra lock, and the scene warns of it: {:.3}", last[0]);
}

/// Tip of a cantilever under its weight against Timoshenko's beam, at Poisson's ratio 0, where the beam theory is exact
/// to a fraction of a percent.
fn cantilever(cells: [usize; 3], element: &str) -> f64 {
    let text = format!(
        "[mesh]\n{element}[mesh.block]\nsize = [0.1, 0.01, 0.01]\ncells = {cells:?}\n[[tissue]]\nenergy = \"linear\"\n\
         E = 1e6\nnu = 0.0\n[[bone]]\nname = \"left\"\nnodes = \"x_min\"\ndrive = \"held\"\n[gravity]\n\
         acceleration = [0, 0, -10]\n[[marker]]\nname = \"tip\"\nat = [0.1, 0.005, 0.01]\n"
    );
    let mut sim = sim(&with_pressure(&text));
    let rest = get(&sim, "marker.position");
    sim.initialise().expect("equilibrium");
    let (q, l, h): (f64, f64, f64) = (1000.0 * 10.0 * 1e-4, 0.1, 0.01);
    let inertia = h.powi(4) / 12.0;
    let beam = q * l.powi(4) / (8.0 * 1e6 * inertia) + q * l * l / (2.0 * 5.0 / 6.0 * 0.5e6 * h * h);
    (rest[2] - get(&sim, "marker.position")[2]) / beam
}

#[test]
fn quadratic_tetrahedra_bend() {
    for n in [1, 2] {
        let [nodes_x, nodes] = [20 * n + 1, 2 * n + 1];
        let case = format!("cantilever, nu 0, {} nodes", nodes_x * nodes * nodes);
        let ratio = row(&case, |e, finer| cantilever([10 * n, n, n].map(|c| c * finer), e));
        assert!((ratio[2] - 1.0).abs() < 0.02, "quadratic: {:.3}", ratio[2]);
        assert!(ratio[0] < 0.9, "linear: {:.3}", ratio[0]);
    }
}

#[test]
fn a_thick_sphere_takes_too_much_pressure() {
    let nu = 0.49;
    let sphere = |keys: &str, finer: usize| sphere::pressure(keys, nu, finer as u32, 2 * finer);
    let n = sphere(FINE, 1).1;
    let ratio = row(&format!("thick sphere, nu {nu}, {n} nodes, pressure"), |e, finer| sphere(e, finer).0);
    assert!(ratio[2] < ratio[0] && ratio[0] > 1.3, "{ratio:?}");
}

/// Torque of a bar whose ends are turned against each other by a right angle.
fn twist(cells: [usize; 3], element: &str, nu: f64) -> f64 {
    let mut sim = sim(&with_pressure(&format!(
        "[mesh]\n{element}[mesh.block]\norigin = [-0.005, -0.005, 0]\nsize = [0.01, 0.01, 0.04]\ncells = {cells:?}\n[[tissue]]\n\
         energy = \"stable-neo-hookean\"\nE = 1e4\nnu = {nu}\n[[bone]]\nname = \"floor\"\nnodes = \"z_min\"\ndrive = \"held\"\n\
         [[bone]]\nname = \"top\"\nnodes = \"z_max\"\n[solver]\nmethod = \"newton\"\n"
    )));
    for k in 1..=4 {
        set(&mut sim, "bone.rotation", 5, &[f64::from(k) * std::f64::consts::FRAC_PI_8]);
        sim.step(1.0).expect("a quarter of the turn");
    }
    -get(&sim, "bone.reactionTorque")[5]
}

#[test]
fn a_twisted_bar_is_too_stiff() {
    let nu = 0.49;
    let truth = twist([5, 5, 20], FINE, nu);
    let ratio = row(&format!("bar twisted by 90 degrees, nu {nu}, {} nodes, torque", 5 * 5 * 17), |e, finer| {
        twist([2, 2, 8].map(|c| c * finer), e, nu) / truth
    });
    assert!((ratio[2] - 1.0).abs() < 0.08 && ratio[0] > 1.1, "{ratio:?}");
}
