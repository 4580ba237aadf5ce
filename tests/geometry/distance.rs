//! Sampled distances agree with exact ones.
use cutis::geometry::{Distance, Field, Isosurface, Nearest, Volume, marching_cubes};
use cutis::math::{Random, Vec3};

use super::marching_cubes::grid;

fn ball() -> Volume {
    let mut g = grid([40, 40, 20], 1e-3);
    g.spacing.z = 2e-3;
    let samples = (0..g.len()).map(|k| {
        let c = [k % 40, k / 40 % 40, k / 1600].map(|c| c as f64);
        let d = 0.012 - (g.world(&Vec3::from(c)) - Vec3::repeat(0.0195)).norm();
        (d * 1e5) as f32
    });
    let samples = samples.collect();
    Volume { grid: g, samples }
}

#[test]
fn distance_to_a_ball_is_a_distance() {
    let volume = ball();
    let distance = Distance::to_isosurface(&volume, 0.0);
    let field = Isosurface { volume: &volume, iso: 0.0, distance: &distance };
    let mut random = Random(3);
    let (mut near, mut far) = (0.0f64, 0.0f64);
    for _ in 0..20_000 {
        let p = Vec3::from_fn(|_, _| 0.001 + 0.037 * random.number());
        let exact = (p - Vec3::repeat(0.0195)).norm() - 0.012;
        let error = (field.at(&p) - exact).abs();
        if exact.abs() < 1.5e-3 {
            near = near.max(error)
        } else {
            far = far.max(error)
        }
        assert_eq!(field.at(&p) > 0.0, field.level(&p) > 0.0);
    }
    // Trilinear sampling of a bent surface near it, first-order sweeps beyond; the ball's centre is the worst place.
    assert!(near < 0.25e-3 && far < 1.2e-3, "near {near:e} far {far:e}");
}

#[test]
fn nearest_agrees_with_brute_force() {
    let volume = ball();
    let surface = marching_cubes(&volume.grid, &volume.samples, 0.0);
    let bins = Nearest::new(&surface, 2e-3);
    let mut random = Random(5);
    for _ in 0..200 {
        let p = Vec3::from_fn(|_, _| -0.01 + 0.06 * random.number());
        let each = (0..surface.triangles.len())
            .map(|t| (cutis::geometry::nearest_on_triangle(&p, surface.corners(t)) - p).norm());
        let brute = each.fold(f64::INFINITY, f64::min);
        let (found, _) = bins.distance(&p, f64::INFINITY).unwrap();
        assert!((found - brute).abs() < 1e-12, "{found} {brute}");
    }
}
