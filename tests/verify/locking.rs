//! Bending and near-incompressibility: what linear and quadratic tetrahedra give of the truth.

use cutis::mesh::TetMesh;
use cutis::scene::{SceneFile, build};
use cutis::sim::Sim;

use crate::common::{get, port};

/// Tip of a panel after Cook (tapered, held on the left, sheared towards the right end): a slice of one cell with free
/// faces, so it is compared with the same slice, finely resolved.
fn cook(n: usize, (order, pressure): (u32, &str), nu: f64) -> f64 {
    let scene = |mesh: &str| {
        format!(
            "[mesh]\n{mesh}[[tissue]]\nenergy = \"linear\"\nE = 1e3\nnu = {nu}\npressure = \"{pressure}\"\n[[bone]]\nname = \"left\"\nnodes = \"x_min\"\n\
             drive = \"held\"\n[[load]]\nname = \"shear\"\nregion = \"end\"\n[[marker]]\nname = \"tip\"\nat = [0.048, 0.060, 0.005]\n"
        )
    };
    let text = scene(&format!("order = {order}\n[mesh.block]\nsize = [0.048, 0.044, 0.005]\ncells = [{n}, {n}, 1]\n"));
    let block = cutis::load::from_text(
        &text.replace("region = \"end\"", "region = \"tissue\"").replace(&format!("order = {order}"), "order = 1"),
        None,
    )
    .expect("a block");
    let mut mesh: TetMesh = block.model.mesh().clone();
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
    let truth = cook(24, (2, "element"), nu);
    let [linear, nodal, quadratic] = [(1, "element"), (1, "nodal"), (2, "element")].map(|c| cook(16, c, nu) / truth);
    println!(
        "Cook at nu {nu}, n=16: linear {linear:.3}, nodal pressure {nodal:.3}, quadratic {quadratic:.3} of the truth"
    );
    assert!(quadratic > 0.97, "quadratic: {quadratic:.3} of the truth");
    assert!(nodal > 0.88, "averaged nodal pressure: {nodal:.3} of the truth");
    assert!(linear < 0.6, "linear tetrahedra lock, and the scene warns of it: {linear:.3}");
}

/// Tip of a cantilever under its weight against Timoshenko's beam, at Poisson's ratio 0, where the beam theory is exact
/// to a fraction of a percent.
fn cantilever(cells: [usize; 3], order: u32) -> f64 {
    let text = format!(
        "[mesh]\norder = {order}\n[mesh.block]\nsize = [0.1, 0.01, 0.01]\ncells = {cells:?}\n[[tissue]]\nenergy = \"linear\"\n\
         E = 1e6\nnu = 0.0\n[[bone]]\nname = \"left\"\nnodes = \"x_min\"\ndrive = \"held\"\n[gravity]\n\
         acceleration = [0, 0, -10]\n[[marker]]\nname = \"tip\"\nat = [0.1, 0.005, 0.01]\n"
    );
    let mut sim = crate::common::sim(&text);
    let rest = get(&sim, "marker.position");
    sim.initialise().expect("equilibrium");
    let (q, l, h): (f64, f64, f64) = (1000.0 * 10.0 * 1e-4, 0.1, 0.01);
    let inertia = h.powi(4) / 12.0;
    let beam = q * l.powi(4) / (8.0 * 1e6 * inertia) + q * l * l / (2.0 * 5.0 / 6.0 * 0.5e6 * h * h);
    (rest[2] - get(&sim, "marker.position")[2]) / beam
}

#[test]
fn quadratic_tetrahedra_bend() {
    let (linear, quadratic) = (cantilever([40, 4, 4], 1), cantilever([10, 1, 1], 2));
    println!("cantilever: linear 40x4x4 {linear:.3}, quadratic 10x1x1 {quadratic:.3} of the beam");
    assert!((quadratic - 1.0).abs() < 0.02, "quadratic: {quadratic:.3}");
    assert!(linear < 0.97 && linear > 0.8, "linear: {linear:.3}");
}
