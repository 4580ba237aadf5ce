//! A stiff skin over soft fat: how far the skin follows a bone that moves under it, for four skins.
//!
//! ```text
//!   ~~~~~~~~~~~~~~~~ skin, 2 mm, E = 5 .. 500 kPa
//!   ................ fat, 8 mm, E = 5 kPa
//!   ====  ---->  === a bone patch that slides 3 mm between held ones
//! ```
//!
//! Run: `cargo run --release --example 02_two_layers`. The stiffer the skin, the flatter its peak.

use std::sync::Arc;

use cutis::mesh::NodeSet;
use cutis::scene::{SceneFile, build};
use cutis::sim::Sim;

fn peak(skin: f64) -> Result<f64, Box<dyn std::error::Error>> {
    let scene = format!(
        r#"
[mesh.block]
size = [0.08, 0.04, 0.01]
cells = [24, 12, 5]
layers = [["skin", 0.2], ["fat", 0.8]]

[[tissue]]
regions = ["skin"]
E = {skin}
nu = 0.45

[[tissue]]
regions = ["fat"]
E = 5e3
nu = 0.45

[[bone]]
name = "held"
drive = "held"

[[bone]]
name = "patch"
"#
    );
    // Bones of our own: the bottom of the block, cut in a sliding middle and held ends with a gap between.
    let block =
        cutis::load::from_text(&scene[..scene.find("[[bone]]").expect("above")].to_owned().add_bone("z_min"), None)?;
    let mut mesh = block.model.mesh().clone();
    let bottom = mesh.node_set("z_min").expect("a block has it").nodes.clone();
    let distance = |a: &u32| (mesh.nodes[*a as usize].x - 0.04).abs();
    let held = bottom.iter().copied().filter(|a| distance(a) > 0.02).collect();
    let patch = bottom.iter().copied().filter(|a| distance(a) < 0.01).collect();
    mesh.node_sets.push(NodeSet { name: "held".into(), nodes: held });
    mesh.node_sets.push(NodeSet { name: "patch".into(), nodes: patch });

    let (model, _) = build(&scene, &SceneFile::parse(&scene)?, mesh)?;
    let mut sim = Sim::new(Arc::new(model))?;
    let port = |name: &str| sim.model().ports().iter().position(|p| p.name == name).expect("a port of this scene");
    let (translation, skin) = (port("bone.translation"), port("skin.position"));
    let n = sim.model().ports()[skin].len();
    let (mut rest, mut now) = (vec![0.0; n], vec![0.0; n]);
    sim.initialise()?;
    sim.get_f64(skin, 0, &mut rest)?;
    sim.set_f64(translation, 3, &[0.003, 0.0, 0.0])?;
    sim.step(0.1)?;
    sim.get_f64(skin, 0, &mut now)?;
    Ok(rest.iter().zip(&now).map(|(a, b)| b - a).fold(0.0, f64::max))
}

trait AddBone {
    fn add_bone(self, nodes: &str) -> String;
}

impl AddBone for String {
    fn add_bone(self, nodes: &str) -> String {
        format!("{self}[[bone]]\nname = \"all\"\nnodes = \"{nodes}\"\n")
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut last = f64::INFINITY;
    for skin in [5e3, 50e3, 150e3, 500e3] {
        let moved = peak(skin)?;
        println!("skin of {:>4.0} kPa: the skin follows by up to {:.2} mm of 3", 1e-3 * skin, 1e3 * moved);
        assert!(moved < last, "a stiffer skin flattens the peak");
        last = moved;
    }
    Ok(())
}
