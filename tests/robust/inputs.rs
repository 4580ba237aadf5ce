//! Inputs that cannot be simulated are refused with their name; the state stays at the last accepted step.

use cutis::effect::law;

use crate::common::{get, port, set, sim, tissue};

/// A block between two bones with a load on its top.
pub fn block(energy: &str) -> String {
    format!(
        "[mesh.block]\nsize = [0.06, 0.04, 0.03]\ncells = [6, 4, 3]\n[[tissue]]\n{}\
         [[bone]]\nname = \"skull\"\nnodes = \"x_min\"\n[[bone]]\nname = \"mandible\"\nnodes = \"x_max\"\n\
         [[load]]\nname = \"push\"\nat = [0.03, 0.02, 0.03]\nradius = 0.01\n",
        tissue(law(energy).expect("a law of the catalogue"), 15e3)
    )
}

#[test]
fn nan_and_infinite_inputs_are_named_and_change_nothing() {
    let mut sim = sim(&block("stable-neo-hookean"));
    set(&mut sim, "bone.translation", 3, &[0.002, 0.0, 0.0]);
    sim.step(0.1).expect("a step");
    let (before, t) = (get(&sim, "skin.position"), sim.time());
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        set(&mut sim, "bone.rotation", 5, &[bad]);
        let message = sim.step(0.1).unwrap_err().to_string();
        assert!(message.contains("bone.rotation[2,3]"), "{message}");
        assert_eq!((get(&sim, "skin.position"), sim.time()), (before.clone(), t));
    }
    set(&mut sim, "bone.rotation", 5, &[f64::MIN_POSITIVE / 2.0]);
    sim.step(0.1).expect("a denormal input is a number");
}

#[test]
fn steps_of_no_length_are_refused() {
    let mut sim = sim(&block("linear"));
    for dt in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(sim.step(dt).unwrap_err().to_string().contains("positive, finite"));
    }
    assert_eq!(sim.time(), 0.0);
}

#[test]
fn wrong_ports_and_ranges_are_refused() {
    let mut sim = sim(&block("linear"));
    let skin = port(&sim, "skin.position");
    assert!(sim.set_f64(skin, 0, &[0.0]).unwrap_err().to_string().contains("settable"));
    let translation = port(&sim, "bone.translation");
    let message = sim.set_f64(translation, 4, &[0.0; 3]).unwrap_err().to_string();
    assert!(message.contains("`bone.translation` has 6 values; 4 to 7"), "{message}");
    assert!(sim.get_f64(translation, usize::MAX, &mut [0.0]).is_err());
    assert!(sim.get_i32(translation, 0, &mut [0]).is_err());
    assert!(sim.get_f64(999, 0, &mut [0.0]).unwrap_err().to_string().contains("999 of"));
}
