//! The Prony series against its closed forms, on a single tetrahedron and in a scene.

use cutis::effect::{Branches, Elements, LAWS, law};
use cutis::fem::{At, Term};
use cutis::math::{Mat3, Vec3};

use crate::common::{Random, constants, get, set, sim};

const SERIES: [(f64, f64); 2] = [(0.6, 0.1), (0.3, 2.0)];
const CORNERS: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// One tetrahedron under a path of F, with its memory.
struct Probe {
    term: Box<dyn Term>,
    history: Vec<f64>,
    memory: usize,
}

impl Probe {
    fn new(name: &str) -> Probe {
        let law = law(name).expect("a law of the catalogue");
        let rest = CORNERS.map(Vec3::from);
        let elements = Elements { X: &rest, tets: &[[0, 1, 2, 3]], midsides: &[] };
        let branches = Branches { series: SERIES.to_vec(), first: 0 };
        let memory = branches.memory(&elements);
        let term = elements.of((law.viscous)(&constants(law, 1.0), branches));
        let mut probe = Probe { term, history: vec![0.0; memory], memory };
        probe.go(0.0, &Mat3::identity());
        probe
    }

    /// Goes to F within dt and returns the overstress P there.
    fn go(&mut self, dt: f64, F: &Mat3) -> Mat3 {
        let x = CORNERS.map(|x| F * Vec3::from(x));
        let at = At { dt, history: &self.history, ..At::NOWHERE };
        let mut g = [Vec3::zeros(); 4];
        self.term.add_gradient(&at, &x, &mut g);
        let mut after = vec![0.0; self.memory];
        self.term.commit(&at, &x, &mut after);
        self.history = after;
        // g_a = V P e_a for the corners along the axes, V = 1/6.
        Mat3::from_columns(&[6.0 * g[1], 6.0 * g[2], 6.0 * g[3]])
    }
}

fn shear(s: f64) -> Mat3 {
    let mut F = Mat3::identity();
    F[(0, 1)] = s;
    F
}

/// Slow-load stress of the volume-free law under small shear, from a very fast step with one unit branch.
fn slow(name: &str, F: &Mat3) -> f64 {
    let mut probe = Probe::new(name);
    probe.go(1e-12, F)[(0, 1)] / SERIES.iter().map(|(g, _)| g).sum::<f64>()
}

#[test]
fn stress_relaxes_as_the_series_says_whatever_the_step() {
    for (name, F) in [("linear", shear(0.1)), ("neo-hookean", shear(0.1)), ("fung", shear(0.3)), ("ogden", shear(0.3))]
    {
        let S = slow(name, &F);
        let ramp = 0.05;
        for cuts in [1, 7] {
            let mut probe = Probe::new(name);
            probe.go(ramp, &F);
            let mut P = Mat3::zeros();
            for _ in 0..cuts {
                P = probe.go(0.4 / f64::from(cuts), &F);
            }
            let decay = |(g, tau): &(f64, f64)| g * (1.0 - (-ramp / tau).exp()) / (ramp / tau) * (-0.4 / tau).exp();
            let wanted = S * SERIES.iter().map(decay).sum::<f64>();
            assert!((P[(0, 1)] - wanted).abs() < 1e-9 * S, "{name}, {cuts} cuts: {} against {wanted}", P[(0, 1)]);
        }
    }
}

#[test]
fn a_straight_path_may_be_cut_anywhere() {
    let (mut whole, mut cut) = (Probe::new("linear"), Probe::new("linear"));
    let P = whole.go(0.3, &shear(0.3));
    cut.go(0.1, &shear(0.1));
    cut.go(0.05, &shear(0.15));
    let Q = cut.go(0.15, &shear(0.3));
    assert!((P - Q).norm() < 1e-14, "{P} {Q}");
}

#[test]
fn a_cycle_dissipates_and_speed_stiffens() {
    for law in LAWS {
        let mut peak = Vec::new();
        for rate in [0.01, 1.0, 100.0] {
            let mut probe = Probe::new(law.name);
            let n = 40;
            let (mut loss, mut last, mut before) = (0.0, 0.0, 0.0);
            let mut highest: f64 = 0.0;
            for k in 1..=4 * n {
                let s = 0.2 * (std::f64::consts::TAU * f64::from(k) / f64::from(2 * n)).sin();
                let P = probe.go(1.0 / (rate * f64::from(n)), &shear(s))[(0, 1)];
                // Trapezoids over the second cycle, when the first has died away.
                if k > 2 * n {
                    loss += 0.5 * (P + before) * (s - last);
                }
                highest = highest.max(P);
                (last, before) = (s, P);
            }
            assert!(loss > 0.0, "{} at rate {rate}: the loop gives back more than it took: {loss:.3e}", law.name);
            peak.push(highest);
        }
        assert!(peak[0] < peak[1] && peak[1] < peak[2], "{}: {peak:?}", law.name);
    }
}

#[test]
fn overstress_has_the_derivatives_it_claims() {
    let mut random = Random(3);
    for law in LAWS {
        let mut probe = Probe::new(law.name);
        for _ in 0..3 {
            probe.go(0.07, &(Mat3::identity() + 0.2 * random.matrix()));
        }
        let at = At { dt: 0.05, history: &probe.history, ..At::NOWHERE };
        let x: Vec<Vec3> = CORNERS.iter().map(|x| Vec3::from(*x) + 0.1 * random.vector()).collect();
        let d: Vec<Vec3> = CORNERS.iter().map(|_| random.vector()).collect();
        let moved = |h: f64| x.iter().zip(&d).map(|(x, d)| x + h * d).collect::<Vec<_>>();
        let slope = |x: &[Vec3]| {
            let mut g = vec![Vec3::zeros(); 4];
            probe.term.add_gradient(&at, x, &mut g);
            g.iter().zip(&d).map(|(g, d)| g.dot(d)).sum::<f64>()
        };
        let error = |h: f64| {
            ((probe.term.energy(&at, &moved(h)) - probe.term.energy(&at, &moved(-h))) / (2.0 * h) - slope(&x)).abs()
        };
        let (coarse, fine) = (error(4e-3), error(1e-3));
        let order = 0.5 * (coarse / fine).log2();
        assert!(coarse < 1e-10 || (1.9..2.1).contains(&order), "{}: order {order}, {coarse:.2e} {fine:.2e}", law.name);
    }
}

#[test]
fn a_loaded_block_creeps_to_its_slow_answer_and_repeats_its_bits() {
    let scene = |viscous: &str| {
        format!(
            "[mesh.block]\nsize = [0.04, 0.02, 0.02]\ncells = [4, 2, 2]\n[[tissue]]\nenergy = \"stable-neo-hookean\"\nE = 15e3\nnu = 0.4\n\
             {viscous}[[bone]]\nname = \"root\"\nnodes = \"x_min\"\n[[load]]\nname = \"pull\"\nregion = \"tissue\"\n"
        )
    };
    let push = |sim: &mut cutis::sim::Sim| set(sim, "load.force", 0, &[0.3, 0.0, 0.2]);
    let mut slow = sim(&scene(""));
    push(&mut slow);
    slow.step(0.1).expect("an elastic step");
    let mut creeping = sim(&scene("[tissue.viscous]\ng = [0.6, 0.3]\ntau = [0.1, 2.0]\n"));
    creeping.initialise().expect("rest");
    push(&mut creeping);
    let mut last = 0.0;
    let mut saved = creeping.save();
    for k in 0..60 {
        creeping.step(0.5).expect("a creeping step");
        let moved = get(&creeping, "skin.position")[0..3].iter().sum::<f64>();
        assert!(k == 0 || moved >= last - 1e-9, "creep goes one way");
        last = moved;
        if k == 3 {
            saved = creeping.save();
        }
    }
    let error = get(&slow, "skin.position")
        .iter()
        .zip(get(&creeping, "skin.position"))
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    assert!(error < 1e-6, "off by {error:.1e} m from the slow answer");
    let end = get(&creeping, "skin.position");
    let bytes = saved.to_bytes(creeping.model());
    let state = cutis::sim::State::from_bytes(&bytes, creeping.model()).expect("its own bytes");
    creeping.restore(&state).expect("its own state");
    (4..60).for_each(|_| drop(creeping.step(0.5).expect("a creeping step")));
    assert_eq!(get(&creeping, "skin.position"), end);
}
