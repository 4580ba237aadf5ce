//! Isosurfaces are closed manifolds, whatever the values, and converge at second order.
use cutis::geometry::{Grid, marching_cubes};
use cutis::math::{Mat3, Random, Vec3};

pub fn grid(dims: [usize; 3], h: f64) -> Grid {
    Grid { dims, spacing: Vec3::repeat(h), origin: Vec3::zeros(), direction: Mat3::identity() }
}

#[test]
fn ten_thousand_random_volumes_are_closed_manifolds() {
    let mut random = Random(7);
    let n = 6;
    let g = grid([n; 3], 1.0);
    for trial in 0..10_000 {
        let coarse = trial % 3 == 0;
        let mut values = vec![-1.0f32; n * n * n];
        for k in 1..n - 1 {
            for j in 1..n - 1 {
                for i in 1..n - 1 {
                    let v = 2.0 * random.number() - 1.0;
                    // Every third volume has few distinct values, zeros and ties among them.
                    values[g.index([i, j, k])] = if coarse { (v * 2.0).round() as f32 } else { v as f32 };
                }
            }
        }
        let s = marching_cubes(&g, &values, 0.0);
        assert_eq!((s.open_edges(), s.pinched_vertices()), (0, 0), "volume {trial} of seed 7");
    }
}

fn sphere_errors(n: usize) -> (f64, f64) {
    let h = 2.0 / n as f64;
    let g = grid([n + 1; 3], h);
    let r = 0.7;
    let mut values = vec![0.0f32; g.len()];
    for k in 0..=n {
        for j in 0..=n {
            for i in 0..=n {
                let p = Vec3::new(i as f64, j as f64, k as f64) * h - Vec3::new(1.01, 0.98, 1.0);
                values[g.index([i, j, k])] = (r - p.norm()) as f32;
            }
        }
    }
    let s = marching_cubes(&g, &values, 0.0);
    assert_eq!(s.euler(), 2);
    assert_eq!(s.open_edges(), 0);
    let pi = std::f64::consts::PI;
    ((s.area() / (4.0 * pi * r * r) - 1.0).abs(), (s.volume() / (4.0 / 3.0 * pi * r * r * r) - 1.0).abs())
}

#[test]
fn sphere_converges_at_order_two() {
    let (coarse, fine) = (sphere_errors(20), sphere_errors(80));
    assert!(fine.0 < 1e-3 && fine.1 < 1e-3);
    let order = |a: f64, b: f64| (a / b).log2() / 2.0;
    let (area, volume) = (order(coarse.0, fine.0), order(coarse.1, fine.1));
    assert!((area - 2.0).abs() < 0.2 && (volume - 2.0).abs() < 0.2, "orders {area} {volume}");
}

#[test]
fn mirrored_grids_keep_outward_normals() {
    let mut g = grid([4; 3], 1.0);
    let mut values = vec![-1.0f32; 64];
    values[g.index([1, 1, 1])] = 1.0;
    assert!(marching_cubes(&g, &values, 0.0).volume() > 0.0);
    g.direction[(0, 0)] = -1.0;
    assert!(marching_cubes(&g, &values, 0.0).volume() > 0.0);
}

#[test]
#[should_panic(expected = "open")]
fn the_checker_sees_a_hole() {
    let g = grid([4; 3], 1.0);
    let mut values = vec![-1.0f32; 64];
    values[g.index([1, 1, 1])] = 1.0;
    let mut s = marching_cubes(&g, &values, 0.0);
    s.triangles.pop();
    assert_eq!(s.open_edges(), 0, "open");
}
