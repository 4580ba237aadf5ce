//! A second thread changes the time of a step and not one bit of what comes out.

use cutis::bench::{SCENES, SIZES};
use cutis::sim::Sim;

use crate::common::{refused, set, sim};

/// A scene of the bench on 10,000 tetrahedra, whose factor has halves.
struct Case {
    scene: &'static str,
    /// Poses of the scene's programme, one after the other.
    poses: &'static [usize],
}

const EASY: Case = Case { scene: "advance", poses: &[1, 2, 3] };
/// Far enough for a new factor.
const JUMP: Case = Case { scene: "advance-0.49", poses: &[5, 20] };
const IN_TIME: Case = Case { scene: "shake", poses: &[1, 2, 3, 4] };

impl Case {
    fn begin(&self, solver: &str) -> Sim {
        let scene = SCENES.iter().find(|s| s.name == self.scene).expect("a scene of the bench");
        sim(&scene.text(&SIZES[1], solver, false))
    }

    /// Step to a pose; returns the number of factorisations.
    fn step(&self, sim: &mut Sim, pose: usize) -> u32 {
        let scene = SCENES.iter().find(|s| s.name == self.scene).expect("a scene of the bench");
        let last = 3 * (sim.model().parts().bones.len() - 1);
        set(sim, "bone.translation", last, &(scene.pose)(pose).0);
        sim.step(scene.dt).expect("a step").factorisations
    }

    /// Bits of all positions after each step, and the factorisations after the first step.
    fn run(&self, solver: &str) -> (Vec<u64>, u32) {
        let mut sim = self.begin(solver);
        let (mut bits, mut factorisations) = (Vec::new(), 0);
        for (k, &pose) in self.poses.iter().enumerate() {
            let made = self.step(&mut sim, pose);
            factorisations += if k > 0 { made } else { 0 };
            bits.extend(sim.positions().iter().flat_map(|x| x.iter().map(|x| x.to_bits())));
        }
        (bits, factorisations)
    }

    fn same_bits(&self, one: &str, two: &str) {
        let (one, two) = (self.run(one), self.run(two));
        assert!(one == two, "{}: other bits", self.scene);
    }
}

const ONE: &str = "threads = 1\n";
const TWO: &str = "threads = 2\n";

#[test]
fn two_threads_find_the_bits_of_one() {
    for case in [&EASY, &JUMP, &IN_TIME] {
        case.same_bits(ONE, TWO);
    }
    assert!(JUMP.run(TWO).1 > 0, "a new factor on the way");
}

#[test]
fn one_thread_is_the_default() {
    EASY.same_bits("", ONE);
}

#[test]
#[should_panic(expected = "other bits")]
fn other_precision_is_seen_in_the_bits() {
    EASY.same_bits(ONE, "threads = 2\nprecision = \"double\"\n");
}

#[test]
fn simulations_with_two_threads_run_side_by_side() {
    let wanted = EASY.run(ONE);
    std::thread::scope(|scope| {
        let runs: Vec<_> = (0..4).map(|_| scope.spawn(|| EASY.run(TWO))).collect();
        for run in runs {
            assert!(run.join().expect("no panic") == wanted);
        }
    });
}

#[test]
fn other_numbers_of_threads_are_refused() {
    let text = |threads: &str| {
        format!(
            "[mesh.block]\nsize = [1, 1, 1]\ncells = [1, 1, 1]\n[[tissue]]\nE = 1e4\nnu = 0.3\n[[bone]]\nname = \"b\"\nnodes = \"x_min\"\n[solver]\nthreads = {threads}\n"
        )
    };
    for wrong in ["0", "3"] {
        let message = refused(&text(wrong));
        let wanted = format!("`threads` of [solver] is {wrong}; wanted 1 or 2");
        assert!(message.contains(&wanted) && message.contains("line 11"), "{message}");
    }
    for wrong in ["-1", "1.5", "\"two\""] {
        let message = refused(&text(wrong));
        assert!(message.contains("line 11") && message.contains("threads"), "{message}");
    }
}
