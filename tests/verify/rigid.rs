//! Bones: rigid motion, force-driven bodies, reactions.

use cutis::effect::{LAWS, law};
use cutis::math::{Vec3, exp_rotation};

use crate::common::{get, largest, rows, set, sim, tissue};

fn jaw(energy: &str, mandible: &str) -> String {
    format!(
        "[mesh.block]\nsize = [0.06, 0.04, 0.03]\ncells = [6, 4, 3]\n\
         [[tissue]]\n{}\
         [[bone]]\nname = \"skull\"\nnodes = \"x_min\"\npivot = [0, 0, 0]\n\
         [[bone]]\nname = \"mandible\"\nnodes = \"x_max\"\npivot = [0.06, 0.02, 0.01]\n{mandible}\n[solver]\ntolerance = 1e-10\n",
        tissue(law(energy).expect("a law of the catalogue"), 15e3)
    )
}

#[test]
fn rigid_motion_of_all_bones_moves_everything_rigidly() {
    // A right angle in one step, and a turn beyond half a turn.
    for w in [Vec3::new(0.0, 0.0, 1.6), Vec3::new(2.0, -2.0, 1.5)] {
        for energy in LAWS.iter().map(|l| l.name).filter(|name| *name != "linear") {
            let mut sim = sim(&jaw(energy, "drive = \"pose\"").replace("[0.06, 0.02, 0.01]", "[0, 0, 0]"));
            let t = Vec3::new(0.3, -0.1, 0.2);
            set(&mut sim, "bone.translation", 0, &[t.x, t.y, t.z, t.x, t.y, t.z]);
            set(&mut sim, "bone.rotation", 0, &[w.x, w.y, w.z, w.x, w.y, w.z]);
            let report = sim.step(0.1).unwrap_or_else(|e| panic!("{energy}: {e}"));
            let rest = rows(&get(&sim, "skin.restPosition"));
            let now = rows(&get(&sim, "skin.position"));
            let R = exp_rotation(&w);
            let error = largest(rest.iter().zip(&now).map(|(X, x)| (t + R * X - x).norm()));
            assert!(error < 1e-9, "{energy}: skin off by {error:.1e} m after {report:?}");
            assert!(largest(get(&sim, "bone.reactionForce")) < 1e-6, "{energy}: a rigid motion needs no force");
        }
    }
}

#[test]
fn a_force_driven_bone_finds_the_pose_that_a_pose_driven_one_gets_by_its_reaction() {
    for energy in LAWS.iter().map(|l| l.name) {
        let mut driven = sim(&jaw(energy, "drive = \"pose\""));
        let (t, w) = ([0.002, -0.001, 0.003], [0.05, 0.08, -0.04]);
        set(&mut driven, "bone.translation", 3, &t);
        set(&mut driven, "bone.rotation", 3, &w);
        driven.step(0.1).expect("a pose");
        let force = get(&driven, "bone.reactionForce")[3..].iter().map(|f| -f).collect::<Vec<_>>();
        let torque = get(&driven, "bone.reactionTorque")[3..].iter().map(|f| -f).collect::<Vec<_>>();
        let mut free = sim(&jaw(energy, "drive = \"force\""));
        set(&mut free, "bone.force", 3, &force);
        set(&mut free, "bone.torque", 3, &torque);
        let report = free.step(0.1).unwrap_or_else(|e| panic!("{energy}: {e}"));
        let (reached_t, reached_w) = (get(&free, "bone.poseTranslation"), get(&free, "bone.poseRotation"));
        let error = largest((0..3).flat_map(|k| [reached_t[3 + k] - t[k], 0.03 * (reached_w[3 + k] - w[k])]));
        assert!(error < 1e-8, "{energy}: pose off by {error:.1e} m after {report:?}: {reached_t:?} {reached_w:?}");
        let skins = get(&driven, "skin.position").into_iter().zip(get(&free, "skin.position"));
        assert!(largest(skins.map(|(a, b)| a - b)) < 1e-8, "{energy}: same pose, same skin");
    }
}

#[test]
fn small_motion_scales_linearly_and_reactions_cancel() {
    let mut answers = Vec::new();
    for scale in [1.0, 0.5] {
        let mut sim = sim(&jaw("stable-neo-hookean", "drive = \"pose\""));
        set(&mut sim, "bone.translation", 3, &[0.0, 1e-6 * scale, 2e-6 * scale]);
        sim.step(0.1).expect("a small step");
        let f = get(&sim, "bone.reactionForce");
        assert!(largest((0..3).map(|k| f[k] + f[3 + k])) < 1e-6 * largest(f.clone()), "reactions cancel");
        let rest = get(&sim, "skin.restPosition");
        answers.push(get(&sim, "skin.position").iter().zip(rest).map(|(x, X)| x - X).collect::<Vec<_>>());
    }
    let error = largest(answers[0].iter().zip(&answers[1]).map(|(a, b)| a - 2.0 * b));
    assert!(error < 1e-3 * largest(answers[0].clone()), "half the motion, half the answer: off by {error:.1e} m");
}

#[test]
fn newton_and_quasi_newton_find_the_same_equilibrium() {
    let run = |method: &str| {
        let mut sim = sim(&format!("{}method = \"{method}\"\n", jaw("neo-hookean", "drive = \"pose\"")));
        set(&mut sim, "bone.translation", 3, &[-0.008, 0.004, 0.01]);
        set(&mut sim, "bone.rotation", 3, &[0.3, 0.0, -0.2]);
        let report = sim.step(0.1).expect("a large step");
        (get(&sim, "skin.position"), report)
    };
    let ((a, newton), (b, quasi)) = (run("newton"), run("quasi-newton"));
    assert!(newton.factorisations > quasi.factorisations);
    assert!(largest(a.iter().zip(&b).map(|(a, b)| a - b)) < 1e-8);
}
