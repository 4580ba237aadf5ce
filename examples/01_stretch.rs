//! A block of tissue between two bones is stretched by a tenth and tells the force.
//!
//! ```text
//!   skull |===========| mandible -->   5 mm
//!         0          5 cm
//! ```
//!
//! Run: `cargo run --release --example 01_stretch`. It prints a force of about 0.63 N.

use std::sync::Arc;

use cutis::sim::Sim;

const SCENE: &str = r#"
[mesh.block]
size = [0.05, 0.02, 0.02]
cells = [10, 4, 4]

[[tissue]]
energy = "polyconvex-neo-hookean"
E = 15e3
nu = 0.45

[[bone]]
name = "skull"
nodes = "x_min"
drive = "held"

[[bone]]
name = "mandible"
nodes = "x_max"
"#;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let loaded = cutis::load::from_text(SCENE, None)?;
    let mut sim = Sim::new(Arc::new(loaded.model))?;
    let port = |name: &str| sim.model().ports().iter().position(|p| p.name == name).expect("a port of this scene");
    let (translation, reaction) = (port("bone.translation"), port("bone.reactionForce"));

    sim.initialise()?;
    // Row 1 (0-based) is the mandible: three numbers a row.
    sim.set_f64(translation, 3, &[0.005, 0.0, 0.0])?;
    let report = sim.step(0.1)?;

    let mut force = [0.0; 3];
    sim.get_f64(reaction, 3, &mut force)?;
    println!("the tissue pulls the mandible back with {:.3} N ({} linear solves)", -force[0], report.iterations);
    assert!((-force[0] - 0.63).abs() < 0.05);
    Ok(())
}
