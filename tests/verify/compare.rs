//! What finite elements are compared with: springs, a force passed on from vertex to vertex, an implicit surface.

use std::time::Instant;

use cutis::compare::{Control, Implicit, Rules, displacement, pass_on};
use cutis::effect::springs;
use cutis::geometry::{Block, Grid, Pattern, block};
use cutis::math::{Mat3, Vec3};
use cutis::mesh::TetMesh;

use crate::common::{get, rows, set, sim};

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

/// The block of examples/block.toml: the jaw goes by 10 mm to the side and 5 mm up, in ten steps.
const JAW: [f64; 3] = [0.0, 0.01, 0.005];
const BLOCK: [f64; 3] = [0.1, 0.1, 0.04];

fn jaw(keys: &str, tissue: &str) -> cutis::sim::Sim {
    sim(&format!(
        "[mesh]\n{keys}[mesh.block]\nsize = {BLOCK:?}\ncells = [12, 12, 5]\n[[tissue]]\nE = {E:?}\n{tissue}[[bone]]\n\
         name = \"skull\"\nnodes = \"z_min\"\nwithin = [[-1, -1, -1], [0.0334, 1, 1]]\ndrive = \"held\"\n[[bone]]\n\
         name = \"mandible\"\nnodes = \"z_min\"\nwithin = [[0.0666, -1, -1], [1, 1, 1]]\n"
    ))
}

fn milliseconds(body: impl FnOnce()) -> f64 {
    let start = Instant::now();
    body();
    1e3 * start.elapsed().as_secs_f64()
}

/// Motion of the skin's corners (m), and milliseconds of a step, of making the solver anew and of reading the skin.
fn advanced(keys: &str, tissue: &str) -> (Vec<Vec3>, [f64; 3]) {
    let mut sim = jaw(keys, tissue);
    sim.initialise().expect("a start");
    let mut steps: Vec<f64> = (1..=10)
        .map(|k| {
            set(&mut sim, "bone.translation", 3, &JAW.map(|c| 0.1 * f64::from(k) * c));
            milliseconds(|| drop(sim.step(0.1).expect("a step")))
        })
        .collect();
    steps.sort_by(f64::total_cmp);
    let mut skin = Vec::new();
    let reading = milliseconds(|| skin = rows(&get(&sim, "skin.position")));
    let model = sim.model().clone();
    let anew = milliseconds(|| {
        let mut sim = cutis::sim::Sim::new(model).expect("a new solver");
        sim.initialise().expect("a start");
    });
    // Quadratic meshes have mid-edge nodes, too: keep the corners, which come first.
    let rest = rows(&get(&sim, "skin.restPosition"));
    let u = skin.iter().zip(&rest).map(|(x, X)| x - X).take(13 * 13).collect();
    (u, [steps[5], anew, reading])
}

#[test]
fn the_table_of_the_source_in_numbers() {
    let rest = {
        let mut sim = jaw("", "nu = 0.45\n");
        sim.initialise().expect("a start");
        rows(&get(&sim, "skin.restPosition"))
    };
    let (truth, _) = advanced("order = 2\n", "nu = 0.45\n");
    let off = |u: &[Vec3]| {
        (u.iter().zip(&truth).map(|(u, v)| (u - v).norm_squared()).sum::<f64>() / truth.len() as f64).sqrt()
    };
    println!(
        "| model | skin off by mm | ms a step | ms to take a cut | ms to show the skin |\n| --- | --- | --- | --- | --- |"
    );
    let mut line = |name: &str, u: &[Vec3], [step, cut, show]: [f64; 3]| {
        println!("| {name} | {:.2} | {step:.2} | {cut:.1} | {show:.3} |", 1e3 * off(u));
        off(u)
    };
    let elements = [
        ("finite elements, linear", "energy = \"linear\"\nnu = 0.45\n"),
        ("finite elements, stable neo-Hookean", "nu = 0.45\n"),
        ("springs", "energy = \"mass-spring\"\n"),
    ]
    .map(|(name, tissue)| {
        let (u, times) = advanced("", tissue);
        line(name, &u, times)
    });
    // The implicit surface: a box, moved by the nodes of the two bones; samples as far apart as the cells.
    let h = BLOCK[0] / 12.0;
    let grid = Grid {
        dims: BLOCK.map(|l| (l / h).ceil() as usize + 9),
        spacing: Vec3::repeat(h),
        origin: Vec3::repeat(-4.0 * h),
        direction: Mat3::identity(),
    };
    let inside = |x: &Vec3| {
        let half = Vec3::from(BLOCK) / 2.0;
        let d = (x - half).abs() - half;
        -d.max()
    };
    let body = Implicit::new(grid, inside);
    let side = [(0.0, 0.0334, Vec3::zeros()), (0.0666, 0.1001, Vec3::from(JAW))];
    let controls: Vec<Control> = (0..=12)
        .flat_map(|i| (0..=12).map(move |j| Vec3::new(f64::from(i), f64::from(j), 0.0) * h))
        .filter_map(|X| side.iter().find(|(a, b, _)| (*a..*b).contains(&X.x)).map(|(.., u)| (X, *u)))
        .collect();
    let u: Vec<Vec3> = rest.iter().map(|X| displacement(&controls, X)).collect();
    let (mut moved, mut cut, mut shown) = (None, None, None);
    let step = milliseconds(|| moved = Some(body.moved(&controls)));
    let moved = moved.expect("moved");
    let cutting = milliseconds(|| cut = Some(moved.cut(|x| x.x - 0.05)));
    let showing = milliseconds(|| shown = Some(moved.surface()));
    let implicit = line("implicit surface", &u, [step, cutting, showing]);
    let [linear, neo_hookean, springs] = elements;
    assert!(neo_hookean < linear && linear < springs && neo_hookean < 0.3e-3, "{elements:?}");
    assert!(implicit > 2.0 * linear, "it knows no mechanics: {implicit}");
    let shown = shown.expect("shown");
    assert_eq!(shown.open_edges(), 0);
    let volume = BLOCK.iter().product::<f64>();
    assert!((shown.volume() / volume - 1.0).abs() < 0.1, "{} of {volume}", shown.volume());
    let left = cut.expect("cut").surface();
    assert!((left.volume() / shown.volume() - 0.5).abs() < 0.1, "half of it is cut away");
}
