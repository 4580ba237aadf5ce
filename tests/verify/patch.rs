//! The patch test: under an affine motion of its whole boundary a distorted mesh moves affinely, for every energy.

use std::fmt::Write as _;

use cutis::effect::LAWS;
use cutis::math::{Mat3, Vec3};
use cutis::mesh::TetMesh;
use cutis::scene::SceneFile;
use cutis::sim::Sim;

use crate::common::{Random, get, port, tissue};

/// Relative to the size of the block; the tolerance of the solver is far below.
const EXACT: f64 = 1e-10;

/// A block of 3 x 3 x 3 cells with moved inner nodes and one node set that holds the whole boundary.
fn distorted(pattern: &str) -> (String, TetMesh) {
    let text = format!(
        "[mesh.block]\nsize = [1, 1.2, 0.9]\ncells = [3, 3, 3]\npattern = \"{pattern}\"\n\
         [[tissue]]\nLAW\
         [[bone]]\nname = \"boundary\"\ndrive = \"displacement\"\n[solver]\ntolerance = 1e-14\n"
    );
    let block = format!("{}[[bone]]\nname = \"z_min\"\n", &text[..text.find("[[bone]]").unwrap()]);
    let block = cutis::load::from_text(&block.replace("LAW", "E = 1.0\nnu = 0.4\n"), None).expect("a block");
    let mut mesh = block.model.mesh().clone();
    let mut boundary: Vec<u32> = mesh.boundary().into_iter().flatten().collect();
    boundary.sort_unstable();
    boundary.dedup();
    let mut random = Random(5);
    for a in 0..mesh.nodes.len() as u32 {
        if boundary.binary_search(&a).is_err() {
            mesh.nodes[a as usize] += 0.03 * random.vector();
        }
    }
    mesh.node_sets.push(cutis::mesh::NodeSet { name: "boundary".into(), nodes: boundary });
    (text, mesh.checked().expect("still positive volumes"))
}

#[test]
fn affine_motion_is_exact_on_a_distorted_mesh() {
    let A = Mat3::new(1.05, 0.08, -0.03, 0.02, 0.94, 0.05, -0.06, 0.01, 1.1);
    let mut failures = String::new();
    for (pattern, order) in [("six", 1), ("forty-eight", 1), ("six", 2)] {
        let (text, mesh) = distorted(pattern);
        let text = text.replace("[mesh.block]", &format!("[mesh]\norder = {order}\n[mesh.block]"));
        for law in LAWS {
            let (text, energy) = (text.replace("LAW", &tissue(law, 1e3)), law.name);
            let file = SceneFile::parse(&text).expect("a scene");
            let (model, _) = cutis::scene::build(&text, &file, mesh.clone()).expect("a model");
            let mut sim = Sim::new(std::sync::Arc::new(model)).expect("a simulation");
            let mesh = sim.model().mesh().clone();
            let nodes = sim.model().parts().bones[0].nodes.clone();
            let wanted = |X: &Vec3| A * X + Vec3::new(0.1, -0.2, 0.3);
            let u: Vec<f64> = nodes
                .iter()
                .flat_map(|&a| <[f64; 3]>::from(wanted(&mesh.nodes[a as usize]) - mesh.nodes[a as usize]))
                .collect();
            let p = port(&sim, "bone.boundary.displacement");
            sim.set_f64(p, 0, &u).expect("as many values as nodes");
            sim.step(1.0).expect("an affine step");
            let error = mesh.nodes.iter().zip(sim.positions()).map(|(X, x)| (wanted(X) - x).norm()).fold(0.0, f64::max);
            if error > EXACT {
                writeln!(failures, "{energy}, order {order} on {pattern}: off by {error:.1e} m").unwrap();
            }
            assert!((get(&sim, "quality.minDetF")[0] - A.determinant()).abs() < 1e-9);
        }
    }
    assert!(failures.is_empty(), "{failures}");
}
