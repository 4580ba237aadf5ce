//! The synthetic head opens its jaw by eight degrees; where do the landmarks go, and what does it take?
//!
//! ```text
//!        o  nose tip      stays
//!      =====  mouth       opens
//!       \_/  chin         down and back
//! ```
//!
//! Run: `cargo run --release --example 03_jaw`. The chin (pogonion) goes about 16 mm.

use std::sync::Arc;

use cutis::sim::Sim;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let loaded = cutis::load::embedded()?;
    let mut sim = Sim::new(Arc::new(loaded.model))?;
    let port = |name: &str| sim.model().ports().iter().position(|p| p.name == name).expect("a port of this scene");
    let (rotation, marker, reaction) = (port("bone.rotation"), port("marker.position"), port("bone.reactionTorque"));
    let names = sim.model().ports()[marker].rows.clone();
    let (mut rest, mut now) = (vec![0.0; 3 * names.len()], vec![0.0; 3 * names.len()]);

    sim.initialise()?;
    sim.get_f64(marker, 0, &mut rest)?;
    for degrees in 1..=8 {
        sim.set_f64(rotation, 3, &[f64::from(degrees).to_radians(), 0.0, 0.0])?;
        sim.step(0.1)?;
    }
    sim.get_f64(marker, 0, &mut now)?;

    for (k, name) in names.iter().enumerate() {
        let [x, y, z] = [0, 1, 2].map(|c| 1e3 * (now[3 * k + c] - rest[3 * k + c]));
        println!("{name:<18} left {x:>6.2}  back {y:>6.2}  up {z:>6.2} mm");
    }
    let mut torque = [0.0; 3];
    sim.get_f64(reaction, 3, &mut torque)?;
    println!("the tissue closes the jaw with {:.3} N m", -torque[0]);
    let chin = names.iter().position(|n| n == "pogonion").expect("the head has a chin");
    assert!(now[3 * chin + 2] - rest[3 * chin + 2] < -0.008, "the chin goes down");
    Ok(())
}
