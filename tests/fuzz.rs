//! Seeds and old findings of the fuzzers, each also with a few hundred random changes, through the fuzzers' own functions.
//!
//! `fuzz/run` looks for new ones, with coverage and AddressSanitizer; what it finds is kept in fuzz/findings.
//! Like the C library's callers, the fuzzers hand over raw pointers, hence their `unsafe`.

#[path = "../fuzz/src/lib.rs"]
#[allow(dead_code)]
mod fuzz;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use fuzz::TARGETS;

/// Changed inputs a target, as far as they fit into the time. `CUTIS_FUZZ_SECONDS=600` goes on for ten minutes instead.
const CHANGES: u64 = 400;
const TIME: Duration = Duration::from_secs(4);

fn replay(name: &str) {
    let (_, once, seeds) = TARGETS.iter().find(|(n, ..)| *n == name).expect("a target");
    let seeds = seeds();
    seeds.iter().for_each(|seed| once(seed));
    let findings = findings(name);
    for path in &findings {
        println!("{}", path.display());
        once(&std::fs::read(path).unwrap());
    }
    let asked = std::env::var("CUTIS_FUZZ_SECONDS").ok().and_then(|s| s.parse().ok());
    let (time, most) = asked.map_or((TIME, CHANGES), |s| (Duration::from_secs(s), u64::MAX));
    let begin = Instant::now();
    let mut n = 0;
    for k in 0..most {
        if begin.elapsed() > time {
            break;
        }
        let seed = seeds[k as usize % seeds.len()].clone();
        let changes = fuzz::capi::noise(k + 1, 12);
        once(&fuzz::taste::edited(seed, &mut fuzz::taste::Taste(&changes)));
        n += 1;
    }
    let _ = std::fs::remove_dir_all(fuzz::mesh::folder());
    println!("{name}: {} seeds, {} findings, {n} changed inputs", seeds.len(), findings.len());
}

fn findings(name: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/findings").join(name);
    let mut files: Vec<_> = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path()).collect();
    files.sort();
    files
}

#[test]
fn scene_text() {
    replay("scene");
}

#[test]
fn baked_model() {
    replay("baked");
}

#[test]
fn saved_state() {
    replay("state");
}

#[test]
fn foreign_meshes() {
    replay("mesh");
}

#[test]
fn volumes() {
    fuzz::volume::seeds_are_read();
    replay("volume");
}

#[test]
fn calls_of_the_c_library() {
    replay("capi");
}

#[test]
fn calls_of_fmi() {
    replay("fmi");
}

/// The folders that `fuzz/run` starts from: `CUTIS_CORPUS=fuzz/corpus cargo test --release --test fuzz -- --ignored`.
#[test]
#[ignore = "writes files; fuzz/run calls it"]
fn seeds_are_written() {
    let base = PathBuf::from(std::env::var_os("CUTIS_CORPUS").expect("CUTIS_CORPUS names a folder"));
    for (name, _, seeds) in TARGETS {
        std::fs::create_dir_all(base.join(name)).unwrap();
        for (k, seed) in seeds().iter().enumerate() {
            std::fs::write(base.join(name).join(format!("seed_{k:02}")), seed).unwrap();
        }
    }
}
