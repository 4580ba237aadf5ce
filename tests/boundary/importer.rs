//! The FMI 3.0 archive through our own importer: what a host sees is what the library does, bit for bit.

use std::sync::Arc;
use std::time::Instant;

use cutis::ffi::host::{Host, HostError};
use cutis::fmu::FmiVersion;
use cutis::sim::Sim;

use super::archive::archive;

const DT: f64 = 1.0 / 64.0;

/// Promised time from archive to instance, unpacking included, s.
const LONGEST_START: f64 = 2.0;

/// A small motion of the last bone: forward and down, m.
fn programme(step: usize, n: usize) -> Vec<f64> {
    let mut d = vec![0.0; n];
    d[n - 2] = -5e-4 * step as f64;
    d[n - 1] = -2.5e-4 * step as f64;
    d
}

#[test]
fn importer_and_library_agree_to_the_last_bit() {
    let path = archive(FmiVersion::V3, "importer");
    let start = Instant::now();
    let mut host = Host::open(&path).unwrap();
    let seconds = start.elapsed().as_secs_f64();
    println!("archive to instance: {seconds:.3} s");
    assert!(seconds < LONGEST_START, "{seconds} s");

    let mut sim = Sim::new(Arc::new(cutis::load::embedded().unwrap().model)).unwrap();
    let find = |name: &str| sim.model().ports().iter().position(|p| p.name == name).unwrap();
    let (bones, skin) = (find("bone.translation"), find("skin.position"));
    let n = sim.model().ports()[bones].len();
    let mut here = vec![0.0; sim.model().ports()[skin].len()];
    host.initialise(0.0).unwrap();
    sim.initialise().unwrap();
    for step in 1..=4 {
        let d = programme(step, n);
        host.set_f64("bone.translation", &d).unwrap();
        sim.set_f64(bones, 0, &d).unwrap();
        let reached = host.step((step - 1) as f64 * DT, DT).unwrap();
        sim.step(DT).unwrap();
        assert_eq!(reached, sim.time());
        sim.get_f64(skin, 0, &mut here).unwrap();
        assert_eq!(host.get_f64("skin.position").unwrap(), here, "step {step}");
    }
    host.terminate().unwrap();
    assert_eq!(host.get_f64("skin.position").unwrap(), here);
    let triangles = host.get_i32("skin.triangles").unwrap();
    assert!(triangles.iter().all(|&i| i >= 0 && (i as usize) < here.len() / 3));
}

#[test]
fn refusals_tell_why_and_reset_brings_back() {
    let mut host = Host::open(&archive(FmiVersion::V3, "refusals")).unwrap();
    assert!(matches!(host.set_f64("no.such", &[]), Err(HostError::NoVariable { .. })));
    let too_early = host.step(0.0, DT).unwrap_err().to_string();
    assert!(too_early.contains("fmi3DoStep") && too_early.contains("not legal in Instantiated"), "{too_early}");
    host.reset().unwrap();
    host.initialise(0.0).unwrap();
    for wrong in [f64::NAN, f64::INFINITY, 0.0, -DT] {
        assert!(host.step(0.0, wrong).is_err(), "{wrong}");
        host.reset().unwrap();
        host.initialise(0.0).unwrap();
    }
    let nan = host
        .set_f64("gravity", &[f64::NAN; 3])
        .err()
        .or_else(|| host.set_f64("bone.translation", &[f64::NAN; 3]).err());
    assert!(nan.is_some());
    host.reset().unwrap();
    host.initialise(0.0).unwrap();
    let short = host.set_f64("bone.translation", &[0.0]).unwrap_err().to_string();
    assert!(short.contains("nValues"), "{short}");
    assert!(host.log().iter().all(|line| !line.ends_with('\n')));
}

#[test]
fn no_archive_is_an_error_and_no_more() {
    assert!(matches!(Host::open(std::path::Path::new("/no/such.fmu")), Err(HostError::File { .. })));
    assert!(matches!(Host::open(&super::util::root().join("Cargo.toml")), Err(HostError::Archive { .. })));
}
