//! A thick sphere, blown up from inside: what elements, straight and curved, give of Lame's solution.
//!
//! ```text
//! u_r = A r + B/r^2,   (3 lambda + 2 mu) A = 4 mu B/b^3,   p = 4 mu B (1/a^3 - 1/b^3)
//! ```
//!
//! Source: Timoshenko & Goodier, "Theory of Elasticity", 3rd ed., 1970, section 136. The inner surface is moved as the
//! solution says; the pressure that this takes is read off the energy, `W = p/2 4 pi a^2 u_a`.

use std::collections::HashMap;

use cutis::energy::Lame;
use cutis::fem::{add_midsides, curve_midsides};
use cutis::geometry::{Head, head};
use cutis::math::{Mat3, Vec3};
use cutis::mesh::{FaceSet, NodeSet, TetMesh};
use cutis::scene::{SceneFile, build};
use cutis::sim::Sim;

use crate::common::{get, port, with_pressure};

const INNER: f64 = 0.5;
const OUTER: f64 = 1.0;
const E: f64 = 1.0;
const U: f64 = 1e-3;

/// Corners on the unit sphere and triangles of an icosahedron whose faces are cut in four, `times` times.
fn icosphere(times: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let g = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut x: Vec<Vec3> = Vec::new();
    for (p, q) in [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)] {
        x.extend([Vec3::new(0.0, p, q), Vec3::new(p, q, 0.0), Vec3::new(q, 0.0, p)].map(|v| v.normalize()));
    }
    let near = |a: usize, b: usize| (x[a] - x[b]).norm() < 1.1;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    let outward = (x[b] - x[a]).cross(&(x[c] - x[a])).dot(&x[a]) > 0.0;
                    faces.push(if outward { [a, b, c] } else { [a, c, b] }.map(|a| a as u32));
                }
            }
        }
    }
    for _ in 0..times {
        let mut middle: HashMap<(u32, u32), u32> = HashMap::new();
        let mut half = |a: u32, b: u32| {
            *middle.entry((a.min(b), a.max(b))).or_insert_with(|| {
                x.push((x[a as usize] + x[b as usize]).normalize());
                x.len() as u32 - 1
            })
        };
        let cut = |[a, b, c]: [u32; 3]| {
            let [p, q, r] = [half(a, b), half(b, c), half(c, a)];
            [[a, p, r], [b, q, p], [c, r, q], [p, q, r]]
        };
        faces = faces.into_iter().flat_map(cut).collect();
    }
    (x, faces)
}

/// Prisms over the icosphere, each cut in three tetrahedra along the diagonals from smaller to larger numbers.
pub fn shell(times: u32, layers: usize) -> TetMesh {
    let (x, faces) = icosphere(times);
    let n = x.len() as u32;
    let radius = |k: usize| INNER * (OUTER / INNER).powf(k as f64 / layers as f64);
    let nodes: Vec<Vec3> = (0..=layers).flat_map(|k| x.iter().map(move |x| radius(k) * x)).collect();
    let mut tets = Vec::new();
    for k in 0..layers as u32 {
        for face in &faces {
            let mut f = *face;
            f.sort_unstable();
            let [[a, b, c], [p, q, r]] = [k, k + 1].map(|k| f.map(|a| a + k * n));
            for tet in [[a, b, c, r], [a, b, q, r], [a, p, q, r]] {
                let positive = cutis::mesh::signed_volume(tet.map(|a| nodes[a as usize])) > 0.0;
                tets.push(if positive { tet } else { [tet[0], tet[2], tet[1], tet[3]] });
            }
        }
    }
    let last = layers as u32 * n;
    TetMesh {
        region: vec![0; tets.len()],
        region_names: vec!["tissue".into()],
        node_sets: vec![NodeSet { name: "inner".into(), nodes: (0..n).collect() }],
        face_sets: vec![
            FaceSet { name: "inside".into(), triangles: faces.iter().map(|&[a, b, c]| [a, c, b]).collect() },
            FaceSet { name: "skin".into(), triangles: faces.iter().map(|f| f.map(|a| a + last)).collect() },
        ],
        nodes,
        tets,
        fine_skin: None,
        elimination: None,
    }
    .checked()
    .expect("a shell")
}

fn sim_of(mesh: &TetMesh, keys: &str, nu: f64) -> Sim {
    let text = format!(
        "[mesh]\nfile = \"shell\"\n{keys}[[tissue]]\nenergy = \"linear\"\nE = {E:?}\nnu = {nu}\n[[bone]]\nname = \"inner\"\n\
         drive = \"displacement\"\n[solver]\ntolerance = 1e-12\n"
    );
    let text = with_pressure(&text);
    let (model, _) = build(&text, &SceneFile::parse(&text).expect("a scene"), mesh.clone()).expect("a model");
    Sim::new(std::sync::Arc::new(model)).expect("a simulation")
}

fn move_inner(sim: &mut Sim, u: impl Fn(&Vec3) -> Vec3) {
    let nodes = sim.model().parts().bones[0].nodes.clone();
    let X = &sim.model().mesh().nodes;
    let values: Vec<f64> = nodes.iter().flat_map(|&a| <[f64; 3]>::from(u(&X[a as usize]))).collect();
    let p = port(sim, "bone.inner.displacement");
    sim.set_f64(p, 0, &values).expect("as many values as nodes");
    sim.step(1.0).expect("a linear step");
}

/// Pressure over the exact one, and number of nodes, with these keys of `[mesh]`.
pub fn pressure(keys: &str, nu: f64, times: u32, layers: usize) -> (f64, usize) {
    let Lame { mu, lambda } = Lame::new(E, nu);
    let a_over_b = 4.0 * mu / ((3.0 * lambda + 2.0 * mu) * OUTER.powi(3));
    let B = U / (a_over_b * INNER + INNER.powi(-2));
    let p = 4.0 * mu * B * (INNER.powi(-3) - OUTER.powi(-3));
    let mut sim = sim_of(&shell(times, layers), keys, nu);
    move_inner(&mut sim, |X| (a_over_b * B + B / X.norm().powi(3)) * X);
    let W = get(&sim, "energy.elastic")[0];
    (W / (0.5 * p * 4.0 * std::f64::consts::PI * INNER * INNER * U), sim.model().mesh().nodes.len())
}

#[test]
fn curved_edges_bring_the_thick_sphere_to_one_percent() {
    let nu = 0.49;
    for (times, layers) in [(1, 2), (2, 3)] {
        let [(linear, n), (straight, n2), (curved, _)] =
            ["", "order = 2\n", "order = 2\ncurved = true\n"].map(|keys| pressure(keys, nu, times, layers));
        println!(
            "thick sphere, nu {nu}: tet4 {linear:.3} ({n} nodes), tet10 {straight:.4}, curved {curved:.4} ({n2} nodes)"
        );
    }
    let [(straight, _), (curved, _)] = ["order = 2\n", "order = 2\ncurved = true\n"].map(|k| pressure(k, nu, 2, 3));
    assert!((curved - 1.0).abs() < 0.01, "curved: {curved:.4}");
    assert!((straight - 1.0).abs() > 2.0 * (curved - 1.0).abs(), "straight: {straight:.4}");
}

/// Largest error of a node, relative to the largest displacement, where both surfaces move affinely.
fn patch(keys: &str, times: u32, layers: usize) -> f64 {
    let mut mesh = shell(times, layers);
    let (n, surface) = (mesh.nodes.len() as u32, mesh.node_sets[0].nodes.len() as u32);
    mesh.node_sets[0].nodes.extend(n - surface..n);
    let mut sim = sim_of(&mesh, keys, 0.3);
    let A = Mat3::new(0.01, 0.02, -0.03, 0.0, -0.02, 0.01, 0.03, 0.01, 0.02);
    move_inner(&mut sim, |X| A * X);
    let rows = || sim.model().mesh().nodes.iter().zip(sim.positions());
    let largest = |value: fn(&Mat3, &Vec3, &Vec3) -> f64| rows().map(|(X, x)| value(&A, X, x)).fold(0.0, f64::max);
    largest(|A, X, x| (x - X - A * X).norm()) / largest(|A, X, _| (A * X).norm())
}

/// Four points are exact to degree 2, the shape gradients of a curved element are of degree 3: its patch test holds to
/// an error of higher order than the element's.
#[test]
fn curved_elements_pass_the_patch_test_in_the_limit() {
    let curved = "order = 2\ncurved = true\n";
    let [coarse, fine] = [(1, 2), (2, 4)].map(|(times, layers)| patch(curved, times, layers));
    println!("patch test: {:.1e} straight; {coarse:.1e} and {fine:.1e} curved", patch("order = 2\n", 1, 2));
    assert!(patch("order = 2\n", 1, 2) < 1e-12);
    assert!(coarse < 1e-4 && fine < coarse / 8.0, "{coarse:.1e} and {fine:.1e}");
}

/// The head's corners lie as far from its skin as the stuffing puts them; bent edges come nearer than these, straight ones
/// do not.
#[test]
fn curved_edges_of_the_head_lie_nearer_to_its_skin() {
    let mut mesh = Head::default().mesh().expect("a head").0;
    let n_corners = mesh.nodes.len() as u32;
    let midsides = add_midsides(&mut mesh);
    let (corners, middles): (Vec<u32>, Vec<u32>) = mesh.skin_nodes().into_iter().partition(|&a| a < n_corners);
    let distance = |mesh: &TetMesh, nodes: &[u32]| {
        nodes.iter().map(|&a| head::skin(&mesh.nodes[a as usize]).abs()).sum::<f64>() / nodes.len() as f64
    };
    let (corner, straight) = (distance(&mesh, &corners), distance(&mesh, &middles));
    let curving = curve_midsides(&mut mesh, &midsides);
    let curved = distance(&mesh, &middles);
    println!("from the true skin: corners {corner:.2e} m, mid-edge nodes {straight:.2e} m, curved {curved:.2e} m");
    println!("{curving:?}");
    assert!(curved < 0.7 * straight && curved < 0.7 * corner, "{curved:.2e} of {straight:.2e} and {corner:.2e} m");
    assert!(curving.straightened * 100 < curving.curved, "{curving:?}");
}

/// The inner surface of a thin shell bulges through the flat outer one: such edges go back to their chords.
#[test]
fn edges_that_would_fold_an_element_stay_straight() {
    let mut mesh = shell(0, 1);
    let inner = mesh.node_sets[0].nodes.len();
    mesh.nodes[..inner].iter_mut().for_each(|x| *x *= 0.97 * OUTER / INNER);
    mesh.face_sets.retain(|set| set.name == "inside");
    let midsides = add_midsides(&mut mesh);
    let flat = mesh.nodes.clone();
    let curving = curve_midsides(&mut mesh, &midsides);
    assert_eq!((curving.curved, curving.straightened), (0, 30));
    assert_eq!(mesh.nodes, flat, "to the bit");
}

/// A face that lies in two sets is curved as in the larger one, whichever comes first; a rim of different surfaces stays.
#[test]
fn a_second_set_of_the_same_faces_changes_no_curve() {
    let places = |change: &dyn Fn(&mut TetMesh)| {
        let mut mesh = shell(1, 2);
        change(&mut mesh);
        let midsides = add_midsides(&mut mesh);
        let curving = curve_midsides(&mut mesh, &midsides);
        (mesh.nodes, curving.curved)
    };
    let (alone, curved) = places(&|_| {});
    assert!(curved > 0);
    for part in [1, 2, 3] {
        for first in [true, false] {
            let twice = places(&|mesh| {
                let all = &mesh.face_sets[0].triangles;
                let set = FaceSet { name: "again".into(), triangles: all[..all.len() / part].to_vec() };
                mesh.face_sets.insert(if first { 0 } else { mesh.face_sets.len() }, set);
            });
            assert_eq!(twice.1, curved, "1/{part} of the faces again");
            assert_eq!(twice.0, alone);
        }
    }
}
