//! The synthetic head as a whole: its mirror symmetry, its smile.

use std::path::Path;
use std::sync::Arc;

use cutis::sim::Sim;

use crate::common::{get, largest, rows};

#[test]
fn a_smile_lifts_and_widens_the_corners_of_the_mouth_alike() {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/smile.toml");
    let loaded = cutis::load::from_file(&scene).expect("the example");
    let mut sim = Sim::new(Arc::new(loaded.model)).expect("a simulation");
    sim.initialise().expect("rest");
    let rest = rows(&get(&sim, "marker.position"));
    for k in 1..=loaded.programme.steps() {
        for s in loaded.programme.settings(k as f64 * loaded.programme.dt) {
            sim.set_f64(s.port, s.offset, &s.values).expect("keyframes fit their ports");
        }
        let report = sim.step(loaded.programme.dt).expect("a muscle step");
        assert!(report.min_det_f > 0.0, "{report:?}");
    }
    let moved: Vec<_> = rows(&get(&sim, "marker.position")).iter().zip(&rest).map(|(x, X)| x - X).collect();
    let (left, right) = (moved[0], moved[1]);
    assert!(left.x > 0.004 && left.z > 0.004, "the left corner goes out and up: {left}");
    assert!(largest([left.x + right.x, left.y - right.y, left.z - right.z]) < 1e-6, "both alike: {left} {right}");
}
