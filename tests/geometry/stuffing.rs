//! Isosurface stuffing keeps its promises between analytic surfaces and on the lower-face crop.
use std::time::Instant;

use cutis::geometry::{
    Ball, Cuboid, Distance, Isosurface, MeshReport, MeshingError, Side, Stuffing, Uniform, Wall, tetrahedralise,
};
use cutis::io::read_volume;
use cutis::math::Vec3;
use cutis::mesh::{FaceSet, TetMesh};

use super::ct_files::data;

/// Bounds of the dihedral angles, degrees: Labelle & Shewchuk 2007, the row of the alphas used.
pub const DIHEDRAL: [f64; 2] = [10.7, 164.8];

fn mesh_of(stuffing: &Stuffing, walls: &[Wall]) -> TetMesh {
    let set = |w: usize, name: &str| FaceSet {
        name: name.into(),
        triangles: stuffing.boundary.iter().filter(|b| usize::from(b.1) == w).map(|b| b.0).collect(),
    };
    TetMesh {
        nodes: stuffing.mesh.nodes.clone(),
        tets: stuffing.mesh.tets.clone(),
        region: vec![0; stuffing.mesh.tets.len()],
        region_names: vec!["tissue".into()],
        node_sets: vec![],
        face_sets: walls.iter().enumerate().map(|(w, wall)| set(w, wall.name)).collect(),
        ..TetMesh::default()
    }
    .checked()
    .unwrap()
}

pub fn assert_sound(report: &MeshReport) {
    assert!(report.is_sound(), "{report}");
    assert!(report.dihedral[0] >= DIHEDRAL[0] && report.dihedral[1] <= DIHEDRAL[1], "{report}");
}

#[test]
fn shell_between_balls() {
    let outer = Ball { centre: Vec3::new(1e-3, 2e-3, 0.5e-3), radius: 0.05 };
    let inner = Ball { centre: Vec3::new(4e-3, -2e-3, 1.5e-3), radius: 0.025 };
    let walls = [
        Wall { name: "skin", field: &outer, side: Side::Inside },
        Wall { name: "skull", field: &inner, side: Side::Outside },
    ];
    let region = Cuboid { low: Vec3::repeat(-0.06), high: Vec3::repeat(0.06) };
    let mut errors = Vec::new();
    for edge in [8e-3, 4e-3] {
        let stuffing = tetrahedralise(&walls, &region, &Uniform(edge)).unwrap();
        let mesh = mesh_of(&stuffing, &walls);
        let mut report = MeshReport::of(&mesh, 0);
        let third = 4.0 / 3.0 * std::f64::consts::PI;
        report.wanted_volume = Some(third * (0.05f64.powi(3) - 0.025f64.powi(3)));
        report.measure_field(&mesh, "skin", &outer);
        report.measure_field(&mesh, "skull", &inner);
        println!("{report}");
        assert_sound(&report);
        assert_eq!(mesh.face_sets.iter().map(|s| s.triangles.len()).sum::<usize>(), mesh.boundary().len());
        errors.push((report.volume / report.wanted_volume.unwrap() - 1.0).abs());
        errors.push(report.surfaces[0].mean);
    }
    // Halving the edge quarters the errors.
    assert!((errors[0] / errors[2]).log2() > 1.5 && (errors[1] / errors[3]).log2() > 1.7, "{errors:?}");
}

#[test]
fn random_balls_stay_in_bounds() {
    let mut random = cutis::math::Random(11);
    for trial in 0..30 {
        let mut ball = |r: f64| Ball { centre: Vec3::from_fn(|_, _| 0.02 * random.number() - 0.01), radius: r };
        let (a, b, c) = (ball(0.03), ball(0.012), ball(0.01));
        let walls = [
            Wall { name: "skin", field: &a, side: Side::Inside },
            Wall { name: "skull", field: &b, side: Side::Outside },
            Wall { name: "mandible", field: &c, side: Side::Outside },
        ];
        let region = Cuboid { low: Vec3::repeat(-0.05), high: Vec3::repeat(0.05) };
        let stuffing = tetrahedralise(&walls, &region, &Uniform(3e-3)).unwrap();
        let report = MeshReport::of(&mesh_of(&stuffing, &walls), 0);
        assert!(report.is_sound(), "trial {trial} of seed 11\n{report}");
        assert!(
            report.dihedral[0] >= DIHEDRAL[0] && report.dihedral[1] <= DIHEDRAL[1],
            "trial {trial} of seed 11\n{report}"
        );
    }
}

#[test]
fn nothing_between_the_walls_is_told() {
    let ball = Ball { centre: Vec3::repeat(9.0), radius: 0.01 };
    let walls = [Wall { name: "skin", field: &ball, side: Side::Inside }];
    let region = Cuboid { low: Vec3::zeros(), high: Vec3::repeat(0.05) };
    assert!(matches!(tetrahedralise(&walls, &region, &Uniform(4e-3)), Err(MeshingError::NoTissue { .. })));
    assert!(matches!(tetrahedralise(&walls, &region, &Uniform(0.0)), Err(MeshingError::NotPositive { .. })));
    assert!(matches!(tetrahedralise(&walls, &region, &Uniform(1e-7)), Err(MeshingError::TooLarge { .. })));
}

#[test]
fn lower_face_crop_reaches_the_stuffing_row_in_release() {
    let Some(path) = data("cthead_face_bench.nii.gz") else { return };
    let volume = read_volume(&path, &mut Vec::new()).unwrap();
    let start = Instant::now();
    let (skin, bone) = (Distance::to_isosurface(&volume, -300.0), Distance::to_isosurface(&volume, 250.0));
    let fields_s = start.elapsed().as_secs_f64();
    let skin_field = Isosurface { volume: &volume, iso: -300.0, distance: &skin };
    let bone_field = Isosurface { volume: &volume, iso: 250.0, distance: &bone };
    let [low, high] = volume.grid.bounds();
    let region = Cuboid { low, high };
    let walls = [
        Wall { name: "skin", field: &skin_field, side: Side::Inside },
        Wall { name: "bone", field: &bone_field, side: Side::Outside },
        Wall { name: "cut", field: &region, side: Side::Inside },
    ];
    let start = Instant::now();
    let stuffing = tetrahedralise(&walls, &region, &Uniform(4e-3)).unwrap();
    let stuffing_s = start.elapsed().as_secs_f64();
    let mesh = mesh_of(&stuffing, &walls);
    let mut report = MeshReport::of(&mesh, 0);
    report.wanted_volume = Some(695.6e-6);
    let margin = Cuboid { low: low + Vec3::repeat(5e-3), high: high - Vec3::repeat(5e-3) };
    report.measure_surface(&mesh, "skin", &skin.surface, &margin);
    report.measure_surface(&mesh, "bone", &bone.surface, &margin);
    println!("{report}{:?}\nfields {fields_s:.2} s, stuffing {stuffing_s:.2} s", stuffing.repair);
    assert_sound(&report);
    assert!((130_000..165_000).contains(&report.tets), "{report}");
    assert!(report.radius_ratio[1] >= 0.20, "{report}");
    assert!((report.volume / 695.6e-6 - 1.0).abs() < 0.0075, "{report}");
    assert!(stuffing_s < 2.0, "{stuffing_s} s");
}
