//! What stands on top of a law: fibres, damage, limits, grades, tension, averaged pressure, gravity of the scan, presets.

use cutis::effect::{Damaged, Elements, Fibre, Graded, LAWS, Limits, NodalPressure, Prestress, Softening, Volume, law};
use cutis::energy::{Lame, StrainLimit};
use cutis::fem::{At, Material};
use cutis::math::{Mat3, Vec3, exp_rotation, vec9};
use cutis::scene::presets;
use cutis::sim::Sim;

use crate::common::{Random, constants, get, largest, rows, set, sim};
use crate::derivatives::{REST, TETS, check_term, check_term_at};

const SEED: u64 = 77;

fn rest() -> Vec<Vec3> {
    REST.map(Vec3::from).to_vec()
}

fn fibre(dispersion: f64, slack: f64) -> Fibre {
    let direction = vec![Vec3::new(0.6, 0.8, 0.0), Vec3::new(0.0, 0.6, 0.8)];
    Fibre { direction, k1: 2.0, k2: 1.5, kappa: dispersion, slack }
}

#[test]
fn fibres_limits_and_tension_have_the_derivatives_they_claim() {
    let X = rest();
    let elements = Elements { X: &X, tets: &TETS, midsides: &[] };
    // Smooth where the fibres pull; the kink at E = 0 is tested by itself below.
    check_term(&*elements.of(fibre(0.2, 0.5)), &X, SEED);
    let factor = vec![0.5, 3.0];
    check_term(&*elements.of(Graded { material: fibre(0.0, 0.4), factor }), &X, SEED);
    let S0 = vec![Mat3::from_diagonal(&Vec3::new(2.0, 0.5, 0.0)); 2];
    check_term(&*elements.of(Prestress { S0 }), &X, SEED);
    for law in LAWS {
        let term = (law.material)(&constants(law, 1.0));
        check_term(&*elements.of(term), &X, SEED);
    }
    for volume in [Volume::Linear, Volume::Quadratic, Volume::Logarithmic, Volume::Polyconvex] {
        check_term(&NodalPressure::new(volume, elements, |e| 1.0 + e as f64), &X, SEED);
    }
}

/// Along a line through F, so that kinks of higher order do not hide the second derivative.
#[test]
fn strain_limits_have_the_derivatives_they_claim() {
    let limit = StrainLimit { longest: 1.3, shortest: 0.8, band: 0.1, stiffness: 2.0 };
    let law = Limits(vec![limit]);
    let at = At::NOWHERE;
    let mut random = Random(SEED);
    for k in 0..40 {
        let spread = if k % 2 == 0 { 0.4 } else { 1.2 };
        let F = Mat3::identity() + spread * random.matrix();
        let (D, E) = (random.matrix(), random.matrix());
        let P = |h: f64| law.psi_and_P(&at, 0, &(F + h * D)).1;
        let psi = |h: f64| law.psi(&at, 0, &(F + h * D));
        let h = 1e-6;
        let scale = P(0.0).norm().max(1e-3);
        assert!(((psi(h) - psi(-h)) / (2.0 * h) - P(0.0).dot(&D)).abs() < 1e-6 * scale, "P at {F}");
        let exact = vec9(&E).dot(&(law.dPdF(&at, 0, &F) * vec9(&D)));
        let scale = law.dPdF(&at, 0, &F).norm().max(1.0);
        assert!(((P(h) - P(-h)).dot(&E) / (2.0 * h) - exact).abs() < 1e-5 * scale, "dPdF at {F}");
    }
    assert_eq!(law.psi(&at, 0, &Mat3::from_diagonal(&Vec3::new(1.19, 1.0, 0.91))), 0.0, "silent inside the band");
}

#[test]
fn damage_has_the_derivatives_it_claims_and_never_heals() {
    let X = rest();
    let elements = Elements { X: &X, tets: &TETS, midsides: &[] };
    let law = law("stable-neo-hookean").expect("a law");
    let softening = Softening { onset: 0.001, scale: 0.1, most: 0.9 };
    // Untouched (first loading) and far beyond what the test deforms it to (unloading): both are smooth.
    for xi in [0.0, 50.0] {
        let damaged = Damaged { intact: (law.material)(&constants(law, 1.0)), softening, first: 0 };
        check_term_at(&*elements.of(damaged), &X, SEED, &[xi, xi]);
    }
    let damaged = Damaged { intact: (law.material)(&constants(law, 1.0)), softening, first: 0 };
    let stretch = |l: f64| Mat3::from_diagonal(&Vec3::new(l, 1.0, 1.0));
    let mut history = vec![0.0];
    let mut work = 0.0;
    let mut last = (1.0, 0.0);
    let mut peak: f64 = 0.0;
    // Out and back: the loop takes energy, the way back is softer, the stored energy never grows by itself.
    for k in 0..=400 {
        let l = 1.0 + 0.8 * if k <= 200 { k as f64 / 200.0 } else { (400 - k) as f64 / 200.0 };
        let at = At { history: &history, ..At::NOWHERE };
        let P = damaged.psi_and_P(&at, 0, &stretch(l)).1[(0, 0)];
        work += 0.5 * (P + last.1) * (l - last.0);
        assert!(work > -1e-9, "energy was created: {work}");
        peak = peak.max(P);
        last = (l, P);
        let mut new = history.clone();
        damaged.commit(&at, 0, &stretch(l), &mut new);
        assert!(new[0] >= history[0]);
        history = new;
    }
    assert!(work > 0.01 * peak, "a loop beyond the onset dissipates: {work}");
}

#[test]
fn fibres_are_slack_below_the_crimp_and_objective() {
    let at = At::NOWHERE;
    let fibre = Fibre { direction: vec![Vec3::x()], k1: 2.0, k2: 1.5, kappa: 0.0, slack: 1.1 };
    let stretch = |l: f64| Mat3::from_diagonal(&Vec3::new(l, 1.0, 1.0));
    assert_eq!(fibre.psi(&at, 0, &stretch(1.0999)), 0.0);
    assert_eq!(fibre.psi(&at, 0, &stretch(0.5)), 0.0, "fibres do not push");
    let E: f64 = 1.2 * 1.2 - 1.1 * 1.1;
    let P = fibre.psi_and_P(&at, 0, &stretch(1.2)).1[(0, 0)];
    assert!((P - 2.0 * 1.2 * 2.0 * E * (1.5 * E * E).exp()).abs() < 1e-12, "the closed form: {P}");
    let every = Fibre { kappa: 1.0 / 3.0, direction: vec![Vec3::x()], ..fibre };
    let mut random = Random(SEED);
    for _ in 0..10 {
        let (F, R) = (Mat3::identity() + 0.3 * random.matrix(), exp_rotation(&random.vector()));
        let psi = every.psi(&at, 0, &F);
        assert!((every.psi(&at, 0, &(R * F)) - psi).abs() <= 1e-12 * psi.max(1.0), "objectivity");
        assert!((every.psi(&at, 0, &(F * R)) - psi).abs() <= 1e-12 * psi.max(1.0), "dispersion 1/3 is isotropic");
    }
}

fn displacement(sim: &Sim) -> Vec<Vec3> {
    let (X, x) = (rows(&get(sim, "skin.restPosition")), rows(&get(sim, "skin.position")));
    X.iter().zip(x).map(|(X, x)| x - X).collect()
}

fn furthest(sim: &Sim) -> f64 {
    largest(displacement(sim).iter().map(|u| u.norm()))
}

/// A strip pulled along x, free at its sides: force over rest area against the stretch of the bones.
fn load_curve(tissue: &str, most: f64, steps: usize) -> Vec<(f64, f64)> {
    let text = format!(
        "[mesh.block]\nsize = [0.02, 0.01, 0.01]\ncells = [2, 1, 1]\n{tissue}\n[[bone]]\nname = \"left\"\nnodes = \"x_min\"\n\
         drive = \"held\"\n[[bone]]\nname = \"right\"\nnodes = \"x_max\"\n"
    );
    let mut sim = sim(&text);
    (1..=steps)
        .map(|k| {
            let stretch = 1.0 + (most - 1.0) * k as f64 / steps as f64;
            set(&mut sim, "bone.translation", 3, &[0.02 * (stretch - 1.0), 0.0, 0.0]);
            sim.step(1.0).unwrap_or_else(|e| panic!("stretch {stretch}: {e}"));
            (stretch, -get(&sim, "bone.reactionForce")[3] / 1e-4)
        })
        .collect()
}

/// The four regions of the load-extension curve of skin: toe, rising, linear, failing.
#[test]
fn skin_shows_toe_rise_line_and_failure() {
    let curve = load_curve(
        "[[tissue]]\nE = 10e3\nnu = 0.4\n[tissue.fibre]\ndirection = [1, 0, 0]\nk1 = 150e3\nk2 = 0.1\nslack = 1.1\n\
         [tissue.fibre.damage]\nonset = 2e3\nscale = 160e3\nmost = 0.999\n",
        2.0,
        100,
    );
    let stress: Vec<f64> = curve.iter().map(|c| c.1).collect();
    let slope: Vec<f64> = stress.windows(2).map(|s| (s[1] - s[0]) / 0.01).collect();
    let top = (0..100).max_by(|&a, &b| stress[a].total_cmp(&stress[b])).expect("a curve");
    let of = |stretch: f64| ((stretch - 1.0) / 0.01) as usize;
    println!(
        "slopes (kPa): toe {:.1}, rising {:.0}..{:.0}, top at {:.2}, end {:.1} of {:.1} kPa",
        slope[of(1.04)] * 1e-3,
        slope[of(1.15)] * 1e-3,
        slope[of(1.3)] * 1e-3,
        curve[top].0,
        stress[99] * 1e-3,
        stress[top] * 1e-3
    );
    // Toe: the law alone carries, 10 kPa.
    assert!(slope[..of(1.06)].iter().all(|s| (5e3..20e3).contains(s)), "toe: {:?}", &slope[..8]);
    // Rising: slopes grow by more than an order.
    assert!(slope[of(1.09)..of(1.18)].windows(2).all(|s| s[1] > s[0]), "rising");
    assert!(slope[of(1.3)] > 20.0 * slope[of(1.04)], "the fibres carry");
    // Linear: for a tenth of stretch the slope stays within a tenth of its mean.
    let straight = (of(1.2)..top.saturating_sub(10)).any(|k| {
        let window = &slope[k..k + 10];
        let mean = window.iter().sum::<f64>() / 10.0;
        window.iter().all(|s| (s / mean - 1.0).abs() < 0.1)
    });
    assert!(straight, "no straight part: {:?}", &slope[of(1.2)..]);
    // Failing: past the top the load falls and keeps falling.
    assert!((of(1.3)..90).contains(&top), "top at {}", curve[top].0);
    assert!(stress[99] < 0.7 * stress[top], "failing: {} of {}", stress[99], stress[top]);
}

#[test]
fn limits_hold_what_a_soft_neighbour_would_take_alone() {
    let scene = |limit: &str| {
        format!(
            "[mesh.block]\nsize = [0.04, 0.01, 0.01]\ncells = [8, 2, 2]\n[[tissue]]\nE = 10e3\nnu = 0.3\n{limit}\
             [[bone]]\nname = \"left\"\nnodes = \"x_min\"\ndrive = \"held\"\n[[load]]\nname = \"pull\"\nat = [0.04, 0.005, 0.01]\n"
        )
    };
    let pulled = |limit: &str| {
        let mut sim = sim(&scene(limit));
        set(&mut sim, "load.force", 0, &[0.25, 0.0, 0.0]);
        sim.step(1.0).expect("pulled");
        sim.strain().max_stretch
    };
    let (free, limited) = (pulled(""), pulled("[tissue.limit]\n"));
    println!("largest stretch: free {free:.3}, limited {limited:.3}");
    assert!(free > 1.7, "the load is past the limit: {free}");
    assert!(limited < 1.5 + 3.0 * 0.02, "the limit is kept to a few bands: {limited}");
    let stiffer = pulled("[tissue.limit]\nstiffness = 1e7\n");
    assert!(stiffer < 1.5, "and below it with more stiffness: {stiffer}");
}

/// A block between a held bottom and a skin on top.
fn layer(tissue: &str, rest: &str) -> String {
    format!(
        "[mesh.block]\nsize = [0.02, 0.02, 0.02]\ncells = [4, 4, 8]\n[[tissue]]\nE = 10e3\nnu = 0.0\nenergy = \"linear\"\n{tissue}\
         [[bone]]\nname = \"bottom\"\nnodes = \"z_min\"\ndrive = \"held\"\n{rest}"
    )
}

#[test]
fn graded_stiffness_follows_depth() {
    // E rises linearly from 1 at the skin to 3 at the bone: under a uniform pull du/dz = p/E(z).
    let grade = "[tissue.grade]\ndepth = [0, 1]\nfactor = [1, 3]\n";
    let mut sim = sim(&layer(grade, "[[pressure]]\nname = \"p\"\n"));
    set(&mut sim, "load.pressure", 0, &[10.0]);
    sim.step(1.0).expect("pressed");
    let (H, p, E) = (0.02, 10.0, 10e3);
    let wanted = -p / E * H / 2.0 * 3f64.ln();
    let top = displacement(&sim);
    let mean = top.iter().map(|u| u.z).sum::<f64>() / top.len() as f64;
    // Element centres sample 1/E(z): second order, 8 layers.
    assert!((mean / wanted - 1.0).abs() < 5e-3, "{mean:.4e}, wanted {wanted:.4e}");
    // Strain falls with depth.
    let column: Vec<f64> = {
        let mesh = sim.model().mesh();
        let mut z: Vec<(f64, f64)> = mesh
            .nodes
            .iter()
            .zip(sim.positions())
            .filter(|(X, _)| (X.x - 0.01).abs() < 1e-9 && (X.y - 0.01).abs() < 1e-9)
            .map(|(X, x)| (X.z, x.z))
            .collect();
        z.sort_by(|a, b| a.0.total_cmp(&b.0));
        z.windows(2).map(|w| 1.0 - (w[1].1 - w[0].1) / (w[1].0 - w[0].0)).collect()
    };
    assert!(column.windows(2).all(|s| s[1] > s[0]), "compression grows towards the skin: {column:?}");
}

#[test]
fn tension_keeps_the_shape_and_stiffens_the_skin_across() {
    let pushed = |tension: &str| {
        let mut sim = sim(&layer(tension, "[[load]]\nname = \"push\"\nat = [0.01, 0.01, 0.02]\n")
            .replace("linear", "stable-neo-hookean"));
        sim.initialise().expect("at rest");
        let moved = furthest(&sim);
        assert!(moved < 1e-9, "the scanned shape is in equilibrium: {moved:.1e} m");
        set(&mut sim, "load.force", 0, &[0.0, 0.0, -0.01]);
        sim.step(1.0).expect("pushed");
        furthest(&sim)
    };
    let (slack, tense) = (pushed(""), pushed("[tissue.tension]\nalong = 5e3\n"));
    println!("indentation: {:.3} mm slack, {:.3} mm tense", slack * 1e3, tense * 1e3);
    assert!(tense < 0.9 * slack, "a tense skin gives less: {tense} of {slack}");
}

#[test]
fn gravity_of_the_scan_is_taken_out() {
    let soft =
        |gravity: &str| layer("", gravity).replace("linear", "stable-neo-hookean").replace("E = 10e3", "E = 3e3");
    let scan = "[gravity]\nacceleration = [0, 0, -9.81]\nscan = [0, 0, -9.81]\n";
    let free = "[gravity]\nacceleration = [0, 0, -9.81]\n";
    let mut sagging = sim(&soft(free));
    sagging.initialise().expect("sags");
    let sag = furthest(&sagging);
    assert!(sag > 3e-4, "there is something to take out: {sag}");
    // Differential: the mesh itself is in equilibrium under the scan's gravity.
    let mut differential = sim(&soft(scan));
    differential.initialise().expect("equilibrium");
    assert!(furthest(&differential) < 1e-9);
    // Inverse: another rest shape, whose sag is the mesh.
    let mesh = sagging.model().mesh().nodes.clone();
    let mut inverse = sim(&soft(&format!("{scan}rest = \"inverse\"\n")));
    inverse.initialise().expect("equilibrium");
    let off = mesh.iter().zip(inverse.positions()).map(|(X, x)| (X - x).norm()).fold(0.0, f64::max);
    assert!(off < 2e-6, "sags into the scan but for {off:.1e} m");
    assert!(furthest(&inverse) > 3e-4);
    // Turned over, the two differ: the stress of the scan stiffens or softens.
    let turned = |sim: &mut Sim| {
        set(sim, "gravity", 0, &[0.0, 0.0, 9.81]);
        sim.step(1.0).expect("upside down");
        rows(&get(sim, "skin.position")).iter().map(|x| x.z).fold(f64::MIN, f64::max)
    };
    let (a, b) = (turned(&mut differential), turned(&mut inverse));
    assert!((a - b).abs() > 1e-6 && (a - b).abs() < 0.3 * sag, "differential {a}, inverse {b}");
}

#[test]
fn presets_are_tissues_with_sources() {
    for (name, preset) in presets() {
        assert!(!preset.source.is_empty() && !preset.doc.is_empty(), "{name}");
        let levels = ["low", "typical", "high"];
        for level in levels.iter().filter(|l| match **l {
            "low" => preset.low.is_some(),
            "high" => preset.high.is_some(),
            _ => true,
        }) {
            let text = layer("", "").replace(
                "E = 10e3\nnu = 0.0\nenergy = \"linear\"\n",
                &format!("preset = \"{name}\"\nlevel = \"{level}\"\n"),
            );
            let mut sim = sim(&format!("{text}[[pressure]]\nname = \"p\"\npressure = 20.0\n"));
            sim.initialise().unwrap_or_else(|e| panic!("{name}, {level}: {e}"));
        }
    }
    let moved = |tissue: &str| {
        let text = layer("", "").replace("E = 10e3\nnu = 0.0\nenergy = \"linear\"\n", tissue);
        let mut sim = sim(&format!("{text}[[pressure]]\nname = \"p\"\npressure = 20.0\n"));
        sim.initialise().expect("pressed");
        furthest(&sim)
    };
    let by_hand = moved("E = 0.5e3\nnu = 0.48\npressure = \"nodal\"\n");
    assert!((moved("preset = \"fat\"\nlevel = \"low\"\n") / by_hand - 1.0).abs() < 1e-6, "low fat is 0.5 kPa");
    let over = moved("preset = \"fat\"\nE = 0.5e3\n");
    assert!((over / by_hand - 1.0).abs() < 1e-6, "a key beside the preset wins");
}

#[test]
fn stiffness_from_the_softest_to_the_stiffest_row_changes_no_digit() {
    let shape = |E: f64| {
        let tissue = format!("E = {E:e}\nnu = 0.45\n");
        let text = layer("", "").replace("E = 10e3\nnu = 0.0\nenergy = \"linear\"\n", &tissue);
        let mut sim = sim(&format!("{text}[[pressure]]\nname = \"p\"\npressure = {:e}\n", 0.05 * E));
        sim.initialise().unwrap_or_else(|e| panic!("{E:e} Pa: {e}"));
        displacement(&sim)
    };
    let [soft, middle, stiff] = [0.21e6, 20.7e9, 1.17e12].map(shape);
    let size = soft.iter().map(|u| u.norm()).fold(0.0, f64::max);
    for other in [middle, stiff] {
        let off = soft.iter().zip(&other).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(off < 1e-6 * size, "{off:e} of {size:e} m");
    }
}

#[test]
fn slips_in_tissue_tables_are_answered() {
    let refused = |tissue: &str| match cutis::load::from_text(&layer(tissue, ""), None) {
        Ok(_) => panic!("accepted: {tissue}"),
        Err(e) => e.to_string(),
    };
    for (tissue, wanted) in [
        ("preset = \"fatt\"\n", "unknown `preset` `fatt`"),
        ("level = \"low\"\n", "needs a `preset`"),
        ("[tissue.fibre]\nk1 = 1.0\nk2 = 1.0\n", "exactly one of `direction` and `path`"),
        ("[tissue.fibre]\nk1 = 1.0\nk2 = 1.0\ndirection = [0, 0, 0]\n", "must not be zero"),
        ("[tissue.fibre]\nk1 = 1.0\nk2 = 1.0\ndirection = [1, 0, 0]\ndispersion = 0.5\n", "`dispersion`"),
        ("[tissue.grade]\ndepth = [0, 1]\nfactor = [1]\n", "found 1 and 2"),
        ("[tissue.grade]\ndepth = [1, 0]\nfactor = [1, 2]\n", "rising"),
        ("[tissue.limit]\nlongest = 1.01\n", "reaches the rest length"),
        ("[tissue.tension]\nalong = 1e3\nacross = 2e3\n", "takes a `direction`"),
        ("[tissue.damage]\nonset = -1.0\nscale = 1.0\n", "`onset`"),
    ] {
        let message = refused(tissue);
        assert!(message.contains(wanted), "`{wanted}` is missing from:\n{message}");
    }
    let nodal = layer("pressure = \"nodal\"\n", "").replace("[mesh.block]", "[mesh]\norder = 2\n[mesh.block]");
    let message = cutis::load::from_text(&nodal, None).err().expect("refused").to_string();
    assert!(message.contains("linear tetrahedra"), "{message}");
}

#[test]
fn the_constants_of_a_law_take_another_lambda() {
    for law in LAWS {
        let c = constants(law, 15e3);
        let Lame { mu, .. } = (law.moduli)(&c);
        let changed = (law.moduli)(&law.with_lambda(&c, 0.7 * mu));
        assert!(
            (changed.mu / mu - 1.0).abs() < 1e-12 && (changed.lambda / (0.7 * mu) - 1.0).abs() < 1e-9,
            "{}",
            law.name
        );
    }
}
