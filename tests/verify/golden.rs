//! One minimal scene an effect keeps its numbers; moving them is a changelog line (`BLESS=1` rewrites).

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cutis::port::Type;
use cutis::sim::Sim;

/// Relative to the largest value of a port, and far above what another processor's rounding does to a solution that is
/// converged to 1e-7 m of centimetres.
const TOLERANCE: f64 = 2e-5;

fn scenes() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenes");
    let files = std::fs::read_dir(folder).expect("the scenes are there").map(|f| f.expect("readable").path());
    let mut scenes: Vec<PathBuf> = files.filter(|p| p.extension().is_some_and(|e| e == "toml")).collect();
    scenes.sort();
    scenes
}

/// Port name and values at the end of the programme; the skin by its mean and extremes.
fn run(scene: &Path) -> Vec<(String, Vec<f64>)> {
    let loaded = cutis::load::from_file(scene).unwrap_or_else(|e| panic!("{e}"));
    let mut sim = Sim::new(Arc::new(loaded.model)).expect("a simulation");
    sim.initialise().unwrap_or_else(|e| panic!("{}: {e}", scene.display()));
    for k in 1..=loaded.programme.steps() {
        for s in loaded.programme.settings(k as f64 * loaded.programme.dt) {
            sim.set_f64(s.port, s.offset, &s.values).expect("keyframes fit their ports");
        }
        sim.step(loaded.programme.dt).unwrap_or_else(|e| panic!("{}: {e}", scene.display()));
    }
    let ports = sim.model().ports().iter().enumerate();
    let outputs = ports.filter(|(_, p)| p.is_computed() && p.ty == Type::Float64);
    outputs
        .filter(|(_, p)| p.name != "solver.residual")
        .map(|(k, p)| {
            let mut values = vec![0.0; p.len()];
            sim.get_f64(k, 0, &mut values).expect("an output");
            if p.name.starts_with("skin.") {
                let n = values.len() as f64;
                let rms = (values.iter().map(|v| v * v).sum::<f64>() / n).sqrt();
                let extreme = |f: fn(f64, f64) -> f64| values.iter().copied().reduce(f).expect("a skin");
                values = vec![values.iter().sum::<f64>() / n, rms, extreme(f64::min), extreme(f64::max)];
            }
            (p.name.clone(), values)
        })
        .collect()
}

#[test]
fn scenes_keep_their_numbers() {
    let mut drift = String::new();
    for scene in scenes() {
        let answer = run(&scene);
        let golden = scene
            .parent()
            .expect("in a folder")
            .join("golden")
            .join(scene.file_stem().expect("named"))
            .with_extension("csv");
        if std::env::var_os("BLESS").is_some() {
            let lines = answer.iter().map(|(name, v)| {
                format!("{name},{}\n", v.iter().map(|v| format!("{v:.9e}")).collect::<Vec<_>>().join(","))
            });
            std::fs::create_dir_all(golden.parent().expect("in a folder")).expect("writable");
            std::fs::write(&golden, lines.collect::<String>()).expect("writable");
        }
        let text =
            std::fs::read_to_string(&golden).unwrap_or_else(|e| panic!("{}: {e}; BLESS=1 makes it", golden.display()));
        let wanted: Vec<(String, Vec<f64>)> = text
            .lines()
            .map(|l| {
                let mut parts = l.split(',');
                (parts.next().unwrap_or("").to_owned(), parts.map(|v| v.parse().expect("a number")).collect())
            })
            .collect();
        let names = |list: &[(String, Vec<f64>)]| list.iter().map(|(n, v)| (n.clone(), v.len())).collect::<Vec<_>>();
        assert_eq!(names(&answer), names(&wanted), "{}", scene.display());
        for ((name, now), (_, then)) in answer.iter().zip(&wanted) {
            let scale = then.iter().fold(1e-6_f64, |s, v| s.max(v.abs()));
            let error = now.iter().zip(then).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if error > TOLERANCE * scale {
                writeln!(drift, "{} {name}: moved by {error:.2e} of {scale:.2e}", scene.display()).expect("memory");
            }
        }
    }
    assert!(drift.is_empty(), "{drift}");
}
