//! The scenes of `cutis bench` run, and are as accurate as its bars ask.

use cutis::bench::{SCENES, SIZES, steps};

/// Largest error of the skin that the bars allow, m; the second is what modes may leave out.
const ALLOWED: f64 = 1e-6;
const LEFT_OUT: f64 = 1e-5;

#[test]
fn bench_scenes_are_accurate_enough_for_their_bars() {
    for scene in &SCENES {
        let s = steps(scene, &SIZES[0], true).unwrap_or_else(|e| panic!("{}: {e}", scene.name));
        let error = s.error.expect("asked for");
        let allowed = if scene.modes.is_some() { LEFT_OUT } else { ALLOWED };
        assert!(error < allowed, "{} is off by {error:.1e} m", scene.name);
        assert!(error > 0.0, "{}: the reference is another computation", scene.name);
        assert!(s.n_tets == 1152 && s.step > 0.0 && s.setup > 0.0);
    }
}
