//! What finite elements are compared with: springs, and a force passed on from vertex to vertex; on a pushed block.

use cutis::compare::{Rules, pass_on};
use cutis::effect::springs;
use cutis::geometry::{Block, Pattern, block};
use cutis::math::Vec3;
use cutis::mesh::TetMesh;

use crate::common::{get, set, sim};

const SIZE: [f64; 3] = [0.06, 0.06, 0.02];
const CELLS: [usize; 3] = [12, 12, 4];
const E: f64 = 15e3;
/// The middle of the top and its eight neighbours.
const REACH: f64 = 0.0075;

fn mesh() -> TetMesh {
    let spec = Block { origin: Vec3::zeros(), size: SIZE.into(), cells: CELLS, pattern: Pattern::Six, layers: vec![] };
    block(&spec).expect("a block")
}

fn pushed(mesh: &TetMesh) -> Vec<u32> {
    let top = Vec3::new(0.5 * SIZE[0], 0.5 * SIZE[1], SIZE[2]);
    mesh.skin_nodes().into_iter().filter(|&a| (mesh.nodes[a as usize] - top).norm() < REACH).collect()
}

/// Places of the corners at equilibrium under `force`, shared by the pushed vertices.
fn equilibrium(mesh: &TetMesh, keys: &str, tissue: &str, force: Vec3) -> Vec<Vec3> {
    let nodes = pushed(mesh);
    let load = |a: &u32| {
        let at: [f64; 3] = mesh.nodes[*a as usize].into();
        format!("[[load]]\nname = \"n{a}\"\nat = {at:?}\n")
    };
    let mut sim = sim(&format!(
        "[mesh]\n{keys}[mesh.block]\nsize = {SIZE:?}\ncells = {CELLS:?}\n[[tissue]]\nE = {E:?}\n{tissue}[[bone]]\n\
         name = \"floor\"\nnodes = \"z_min\"\ndrive = \"held\"\n{}",
        nodes.iter().map(load).collect::<String>()
    ));
    for k in 1..=4 {
        let share = force * f64::from(k) / 4.0 / nodes.len() as f64;
        for row in 0..nodes.len() {
            set(&mut sim, "load.force", 3 * row, share.as_slice());
        }
        sim.step(0.1).unwrap_or_else(|e| panic!("{tissue}: {e}"));
    }
    assert!(get(&sim, "quality.minDetF")[0] > 0.0);
    sim.positions()[..mesh.nodes.len()].to_vec()
}

fn passed(mesh: &TetMesh, force: Vec3) -> cutis::compare::Passed {
    let nodes = pushed(mesh);
    let loads: Vec<(u32, Vec3)> = nodes.iter().map(|&a| (a, force / nodes.len() as f64)).collect();
    pass_on(mesh, &mesh.node_set("z_min").expect("a side").nodes, &loads, &Rules::new(E))
}

/// Mean depth of the pushed vertices, and rms distance from `truth` over the top, m.
fn figures(mesh: &TetMesh, x: &[Vec3], truth: &[Vec3]) -> [f64; 2] {
    let nodes = pushed(mesh);
    let depth = nodes.iter().map(|&a| mesh.nodes[a as usize].z - x[a as usize].z).sum::<f64>() / nodes.len() as f64;
    let top = mesh.skin_nodes();
    let sum: f64 = top.iter().map(|&a| (x[a as usize] - truth[a as usize]).norm_squared()).sum();
    [depth, (sum / top.len() as f64).sqrt()]
}

#[test]
fn other_methods_on_the_pushed_block() {
    let mesh = mesh();
    for newton in [0.1, 0.4] {
        let force = Vec3::new(0.0, 0.0, -newton);
        let fem = "energy = \"stable-neo-hookean\"\nnu = 0.45\n";
        let truth = equilibrium(&mesh, "order = 2\n", fem, force);
        let print = |name: &str, x: &[Vec3]| {
            let [depth, rms] = figures(&mesh, x, &truth).map(|v| 1e3 * v);
            println!("{newton} N, {name}: depth {depth:.2} mm, top off by {rms:.3} mm rms");
            [depth, rms]
        };
        let [depth, _] = print("tet10, nu 0.45", &truth);
        print("no motion at all", &mesh.nodes);
        let [_, linear] = print("tet4, nu 0.45", &equilibrium(&mesh, "", fem, force));
        let springs = "energy = \"mass-spring\"\n";
        let [sunk, springs] = print("springs", &equilibrium(&mesh, "", springs, force));
        let [passed_depth, rms] = print("force passed on", &passed(&mesh, force).x);
        assert!(linear < springs && linear < rms, "finite elements are nearest to themselves");
        assert!(sunk > 0.5 * depth && sunk < 3.0 * depth, "springs: {sunk} against {depth} mm");
        assert!(passed_depth > 0.0);
    }
}

#[test]
fn a_force_passed_on_keeps_its_limits_and_its_sum() {
    let mesh = mesh();
    let floor = &mesh.node_set("z_min").expect("a side").nodes;
    let edges = springs(E, &mesh.nodes, &mesh.tets);
    for newton in [0.01, 0.4, 4.0] {
        let force = Vec3::new(0.3 * newton, 0.0, -newton);
        let out = passed(&mesh, force);
        let moved = out.x.iter().zip(&mesh.nodes).filter(|(x, X)| x != X).count();
        println!(
            "{newton} N: {moved} vertices moved in {} visits, held {:.2} N, left {:.2} N",
            out.visits,
            out.held.norm(),
            out.left.norm()
        );
        for s in &edges {
            let [a, b] = s.ends.map(|a| out.x[a as usize]);
            assert!((0.75 - 1e-9..1.5 + 1e-9).contains(&((b - a).norm() / s.L)), "{s:?}");
        }
        assert!((out.taken + out.held + out.left - force).norm() < 1e-9 * force.norm());
        assert!(out.visits < 100_000, "the force has gone somewhere");
        assert!(floor.iter().all(|&a| out.x[a as usize] == mesh.nodes[a as usize]));
        assert_eq!(out, passed(&mesh, force), "to the bit");
        // A small force moves the vertices that it acts on, and none else.
        assert!(newton > 0.01 || moved == pushed(&mesh).len());
        assert!(newton < 4.0 || moved > 3 * pushed(&mesh).len());
    }
    let rules = Rules { budget: 50, ..Rules::new(E) };
    let loads = [(pushed(&mesh)[4], Vec3::new(0.0, 0.0, -4.0))];
    let stopped = pass_on(&mesh, floor, &loads, &rules);
    assert!(stopped.visits == 50 && stopped.left.norm() > 0.1, "the budget ends it, and what is left is told");
}

#[test]
#[should_panic]
fn a_planted_excess_is_found() {
    let mesh = mesh();
    let out = passed(&mesh, Vec3::new(0.0, 0.0, -4.0));
    let limits = springs(E, &mesh.nodes, &mesh.tets).iter().all(|s| {
        let [a, b] = s.ends.map(|a| out.x[a as usize]);
        (0.9..1.1).contains(&((b - a).norm() / s.L))
    });
    assert!(limits, "narrower limits than the rules'");
}
