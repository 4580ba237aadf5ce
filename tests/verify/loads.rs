//! Loads: they balance the reactions, and they agree with closed forms.

use cutis::math::Vec3;

use crate::common::{get, largest, rows, set, sim};

const BLOCK: &str = "[mesh.block]\nsize = [0.05, 0.05, 0.02]\ncells = [5, 5, 2]\n\
                     [[tissue]]\nenergy = \"stable-neo-hookean\"\nE = 15e3\nnu = 0.4\ndensity = 1000\n\
                     [[bone]]\nname = \"bottom\"\nnodes = \"z_min\"\ndrive = \"held\"\n[solver]\ntolerance = 1e-11\n";

fn balance(sim: &cutis::sim::Sim, wanted: Vec3) {
    let f = rows(&get(sim, "bone.reactionForce"));
    let total: Vec3 = f.iter().sum();
    assert!((total - wanted).norm() < 1e-6 * wanted.norm().max(1e-3), "reactions {total} do not carry {wanted}");
}

#[test]
fn point_patch_and_body_forces_reach_the_bone() {
    for (load, f) in [
        ("at = [0.025, 0.025, 0.02]", [0.02, 0.0, -0.05]),
        ("at = [0.025, 0.025, 0.02]\nradius = 0.015", [0.1, 0.05, -0.3]),
        ("region = \"tissue\"", [0.2, 0.0, 0.4]),
    ] {
        let mut sim = sim(&format!("{BLOCK}[[load]]\nname = \"push\"\n{load}\n"));
        set(&mut sim, "load.force", 0, &f);
        sim.step(0.1).unwrap_or_else(|e| panic!("{load}: {e}"));
        balance(&sim, Vec3::from(f));
    }
}

#[test]
fn gravity_weighs_what_the_tissue_weighs() {
    let mut sim = sim(&format!("{BLOCK}[gravity]\n"));
    sim.initialise().expect("equilibrium under gravity");
    balance(&sim, Vec3::new(0.0, 0.0, -9.80665 * 1000.0 * 0.05 * 0.05 * 0.02));
}

#[test]
fn pressure_follows_the_surface() {
    // Sides on rollers cannot be had from node sets, so compare force and direction instead: on a flat top that is
    // pressed evenly the resultant is p times the area that the top has now, along the normal that it has now.
    let mut sim = sim(&format!("{BLOCK}[[pressure]]\nname = \"cuff\"\n"));
    set(&mut sim, "load.pressure", 0, &[2000.0]);
    let report = sim.step(0.1).expect("a pressed block");
    assert!(report.converged && report.iterations < 60, "{report:?}");
    let x = rows(&get(&sim, "skin.position"));
    let area: Vec3 = sim
        .model()
        .skin_triangles()
        .chunks_exact(3)
        .map(|t| {
            let [a, b, c] = [t[0], t[1], t[2]].map(|a| x[a as usize]);
            0.5 * (b - a).cross(&(c - a))
        })
        .sum();
    assert!((area.z - 0.0025).abs() > 1e-5, "the top widens, so a dead load would differ: {area}");
    balance(&sim, -2000.0 * area);
}

#[test]
fn a_bar_stretches_by_its_closed_form() {
    // Uniform confined stretch: both ends held in their plane, all sides prescribed by an affine motion of the end
    // nodes only is not confined, so take nu = 0, where a bar does not thin: sigma = E (lambda - 1) for linear tissue.
    let mut sim = sim(
        "[mesh.block]\nsize = [0.1, 0.02, 0.02]\ncells = [10, 2, 2]\n[[tissue]]\nenergy = \"linear\"\nE = 2e4\nnu = 0.0\n\
         [[bone]]\nname = \"left\"\nnodes = \"x_min\"\n[[bone]]\nname = \"right\"\nnodes = \"x_max\"\n",
    );
    set(&mut sim, "bone.translation", 3, &[0.01, 0.0, 0.0]);
    sim.step(0.1).expect("a stretched bar");
    let f = get(&sim, "bone.reactionForce");
    assert!((f[0] - 2e4 * 0.1 * 4e-4).abs() < 1e-9 && (f[3] + 2e4 * 0.1 * 4e-4).abs() < 1e-9, "{f:?}");
    assert!((get(&sim, "energy.elastic")[0] - 0.5 * 0.8 * 0.01).abs() < 1e-9);
}

#[test]
fn neo_hookean_bar_meets_its_closed_form() {
    // nu = 0: lambda = 0, mu = E/2; psi = mu/2 (s^2 + 2 q^2 - 3) - mu ln(s q^2), and dpsi/dq = 0 gives q = 1.
    let mut sim = sim(
        "[mesh.block]\nsize = [0.1, 0.02, 0.02]\ncells = [10, 2, 2]\n[[tissue]]\nenergy = \"neo-hookean\"\nE = 2e4\nnu = 0.0\n\
         [[bone]]\nname = \"left\"\nnodes = \"x_min\"\n[[bone]]\nname = \"right\"\nnodes = \"x_max\"\n[solver]\ntolerance = 1e-12\n",
    );
    set(&mut sim, "bone.translation", 3, &[0.05, 0.0, 0.0]);
    sim.step(0.1).expect("a stretched bar");
    let s: f64 = 1.5;
    let wanted = 1e4 * (s - 1.0 / s) * 4e-4;
    let f = get(&sim, "bone.reactionForce")[0];
    assert!((f - wanted).abs() < 1e-8 * wanted, "{f} against {wanted}");
}

#[test]
fn half_the_load_gives_half_the_answer_where_the_tissue_is_linear() {
    let mut sim = sim(&format!(
        "{}[[load]]\nname = \"push\"\nregion = \"tissue\"\n",
        BLOCK.replace("stable-neo-hookean", "linear")
    ));
    set(&mut sim, "load.force", 0, &[0.1, 0.2, 0.3]);
    let first = sim.step(0.1).expect("a load");
    let full = get(&sim, "skin.position");
    set(&mut sim, "load.force", 0, &[0.05, 0.1, 0.15]);
    let second = sim.step(0.1).expect("half the load");
    let half = get(&sim, "skin.position");
    let rest = get(&sim, "skin.restPosition");
    let error = largest((0..rest.len()).map(|k| (full[k] - rest[k]) - 2.0 * (half[k] - rest[k])));
    assert!(error < 1e-12 && second.iterations == 0, "off by {error:.1e}, {first:?}, {second:?}");
}

#[test]
fn a_muscle_pulls_with_its_stress_and_its_sides_with_nothing() {
    // Both ends held: the active nominal stress reaches the bones whole, and nu = 0 keeps the sides still.
    let mut sim = sim(
        "[mesh.block]\nsize = [0.1, 0.02, 0.02]\ncells = [10, 2, 2]\n[[tissue]]\nenergy = \"linear\"\nE = 2e4\nnu = 0.0\n\
         [[bone]]\nname = \"left\"\nnodes = \"x_min\"\n[[bone]]\nname = \"right\"\nnodes = \"x_max\"\n\
         [[muscle]]\nname = \"whole\"\npath = [[0, 0.01, 0.01], [0.1, 0.01, 0.01]]\nradius = 0.1\nstress = 5e3\n",
    );
    set(&mut sim, "muscle.activation", 0, &[0.5]);
    sim.step(0.1).expect("an activated bar");
    let f = get(&sim, "bone.reactionForce");
    assert!((f[0] - 0.5 * 5e3 * 4e-4).abs() < 1e-9 && (f[3] + f[0]).abs() < 1e-9, "{f:?}");
    let error = largest(get(&sim, "skin.position").iter().zip(get(&sim, "skin.restPosition")).map(|(x, X)| x - X));
    assert!(error < 1e-12, "a uniform pull between held ends moves nothing: {error:.1e}");
}
