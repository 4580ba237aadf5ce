//! Real heads: from the CT to named tetrahedra, with and without labels, and what bad volumes are told.
use cutis::geometry::{BakeOptions, Baked, MeshingError, Resolution, Volume, Warning, bake};
use cutis::io::{LabelMap, read_labels, read_volume, write_mesh};

use super::ct_files::data;

/// Bounds of the dihedral angles of coarsened meshes, degrees.
const DIHEDRAL: [f64; 2] = [11.0, 162.0];

/// Errors as an edge brings them, given, so that the lattice is no finer than they need.
fn at_edge(edge: f64) -> BakeOptions {
    let square = (edge / 4e-3).powi(2);
    let (skin_error, bone_error) = (Some(0.1e-3 * square), Some(0.25e-3 * square));
    BakeOptions {
        resolution: Resolution { edge, skin_error, bone_error, ..Resolution::default() },
        ..BakeOptions::default()
    }
}

fn run(volume: &Volume, labels: Option<&cutis::geometry::Labels>, options: &BakeOptions, name: &str) -> Baked {
    let start = std::time::Instant::now();
    let mut stages = Vec::new();
    let baked = bake(volume, labels, options, &mut |stage, share| {
        stages.push((stage.to_string(), share, start.elapsed().as_secs_f64()))
    })
    .unwrap();
    let finest = &baked.finest;
    println!("== {name}\n{}{} slit nodes, {} released", finest.report, finest.slit_nodes, finest.released_nodes);
    stages.iter().for_each(|(stage, _, t)| println!("{t:6.2} s {stage}"));
    baked.warnings.iter().for_each(|w| println!("warning: {w}"));
    for s in &baked.finest.mesh.node_sets {
        println!("node set {} {}", s.name, s.nodes.len());
    }
    for s in &baked.finest.mesh.face_sets {
        println!("face set {} {}", s.name, s.triangles.len());
    }
    assert!(stages.windows(2).all(|w| w[0].1 <= w[1].1));
    write_mesh(&super::mesh_files::scratch(&format!("{name}.cutis")), &baked.finest.mesh).unwrap();
    let r = &baked.finest.report;
    assert!(r.is_sound(), "{r}");
    assert!(r.dihedral[0] >= DIHEDRAL[0] && r.dihedral[1] <= DIHEDRAL[1], "{r}");
    let faces: usize = baked.finest.mesh.face_sets.iter().map(|s| s.triangles.len()).sum();
    assert_eq!(faces, baked.finest.mesh.boundary().len());
    baked
}

fn count(baked: &Baked, name: &str) -> usize {
    baked.finest.mesh.node_set(name).map_or(0, |s| s.nodes.len())
}

/// Whether tetrahedra that share a node lead from the lower lip's skin to the upper lip's inside the mouth's box.
fn lips_hang_together(baked: &Baked, mouth: [nalgebra::Vector3<f64>; 2], edge: f64) -> bool {
    let mesh = &baked.finest.mesh;
    let rim = nalgebra::Vector3::repeat(edge);
    let (low, high) = (mouth[0] + rim, mouth[1] - rim);
    let middle = |nodes: &[u32]| {
        nodes.iter().map(|&a| mesh.nodes[a as usize]).sum::<nalgebra::Vector3<_>>() / nodes.len() as f64
    };
    let inside = |p: &nalgebra::Vector3<f64>| (0..3).all(|a| (low[a]..high[a]).contains(&p[a]));
    let line = 0.5 * (low.z + high.z);
    let lip = |upper: bool| {
        let skin = &mesh.face_set("skin").unwrap().triangles;
        let chosen = skin.iter().filter(|t| {
            let p = middle(*t);
            inside(&p) && if upper { p.z > line + edge } else { p.z < line - edge }
        });
        chosen.flatten().copied().collect::<std::collections::BTreeSet<u32>>()
    };
    let (lower, upper) = (lip(false), lip(true));
    println!("skin of the lips: {} and {} nodes", lower.len(), upper.len());
    assert!(lower.len() > 10 && upper.len() > 10);
    let tets: Vec<&[u32; 4]> = mesh.tets.iter().filter(|t| inside(&middle(*t))).collect();
    let mut reached = lower;
    loop {
        let before = reached.len();
        for t in &tets {
            if t.iter().any(|a| reached.contains(a)) {
                reached.extend(*t);
            }
        }
        if reached.len() == before {
            return reached.intersection(&upper).next().is_some();
        }
    }
}

#[test]
fn the_slit_parts_the_lips_in_release() {
    let (Some(crop), Some(labels)) = (data("cthead_face_bench.nii.gz"), data("cthead_face_bench_labels.nii.gz")) else {
        return;
    };
    let (volume, labels) = (
        read_volume(&crop, &mut Vec::new()).unwrap(),
        read_labels(&labels, &LabelMap::default(), &mut Vec::new()).unwrap(),
    );
    let options = at_edge(6e-3);
    let parted = run(&volume, Some(&labels), &options, "parted");
    let closed = run(&volume, Some(&labels), &BakeOptions { slit: false, ..options.clone() }, "closed");
    let mouth = parted.mouth.unwrap();
    assert!(closed.mouth.is_none() && closed.finest.slit_nodes == 0);
    assert!(!lips_hang_together(&parted, mouth, options.resolution.edge));
    assert!(lips_hang_together(&closed, mouth, options.resolution.edge));
}

#[test]
fn clean_head_with_labels_in_release() {
    let (Some(head), Some(labels)) = (data("cthead_unc_clean.nii.gz"), data("cthead_unc_labels.nii.gz")) else {
        return;
    };
    let (volume, labels) = (
        read_volume(&head, &mut Vec::new()).unwrap(),
        read_labels(&labels, &LabelMap::default(), &mut Vec::new()).unwrap(),
    );
    let baked = run(&volume, Some(&labels), &BakeOptions::default(), "clean_labels");
    assert!(count(&baked, "skull") > 1000 && count(&baked, "mandible") > 500);
    assert!(baked.finest.slit_nodes > 100);
    assert!(!lips_hang_together(&baked, baked.mouth.unwrap(), 4e-3));
    // By index near (51, 111, 49) and (157, 116, 51).
    let at = |i: f64, j: f64, k: f64| volume.grid.world(&nalgebra::Vector3::new(i, j, k));
    let [right, left] = baked.condyles.unwrap();
    println!("condyles {:.1?} {:.1?} mm", (right * 1e3).as_slice(), (left * 1e3).as_slice());
    assert!((right - at(51.0, 111.0, 49.0)).norm() < 0.006 && (left - at(157.0, 116.0, 51.0)).norm() < 0.006);
    assert!(!baked.warnings.contains(&Warning::JawNotFound));
    let skin = &baked.finest.report.surfaces[0];
    assert!(baked.finest.report.tets < 130_000, "{}", baked.finest.report);
    assert!(skin.mean < 0.10e-3 && skin.cover.unwrap() > 0.995, "{}", baked.finest.report);
}

#[test]
fn clean_head_without_labels_in_release() {
    let Some(head) = data("cthead_unc_clean.nii.gz") else { return };
    let volume = read_volume(&head, &mut Vec::new()).unwrap();
    let options = at_edge(5e-3);
    let baked = run(&volume, None, &options, "clean_bare");
    assert!(count(&baked, "skull") > 500 && count(&baked, "mandible") > 300);
    if let Some(labels) = data("cthead_unc_labels.nii.gz") {
        let labels = read_labels(&labels, &LabelMap::default(), &mut Vec::new()).unwrap();
        // A bone node lies on the bone's surface: the labels round it name the bone, 2 skull, 3 mandible, 4 spine.
        let share = |name: &str, wanted: [u8; 2]| {
            let nodes = &baked.finest.mesh.node_set(name).unwrap().nodes;
            let around = |a: &&u32| {
                let x = baked.finest.mesh.nodes[**a as usize];
                (0..27).any(|k| {
                    let step = nalgebra::Vector3::new(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1).map(|c| 2e-3 * f64::from(c));
                    wanted.contains(&labels.at(&(x + step)))
                })
            };
            nodes.iter().filter(around).count() as f64 / nodes.len() as f64
        };
        let (skull, mandible, spine) = (share("skull", [2, 2]), share("mandible", [3, 3]), share("spine", [4, 4]));
        println!("labels agree: skull {skull:.3}, mandible {mandible:.3}, spine {spine:.3}");
        assert!(skull > 0.95 && mandible > 0.97 && spine > 0.9);
    }
}

#[test]
fn lower_face_crop_bakes_too_in_release() {
    let (Some(crop), Some(labels)) = (data("cthead_face_bench.nii.gz"), data("cthead_face_bench_labels.nii.gz")) else {
        return;
    };
    let (volume, labels) = (
        read_volume(&crop, &mut Vec::new()).unwrap(),
        read_labels(&labels, &LabelMap::default(), &mut Vec::new()).unwrap(),
    );
    let [low, high] = volume.grid.bounds();
    // The same errors everywhere, a number of tetrahedra, and two levels of one domain.
    let resolution = Resolution { tets: Some(160_000), growth: 1.0, levels: 2, ..Resolution::default() };
    let options = BakeOptions { roi: Some([low, high]), depth: 1.0, resolution, ..BakeOptions::default() };
    let baked = run(&volume, Some(&labels), &options, "crop");
    let report = &baked.finest.report;
    assert!((120_000..=161_000).contains(&report.tets), "{}", report.tets);
    assert!(count(&baked, "mandible") > 1000);
    let skin = &report.surfaces[0];
    assert!(skin.mean < 0.10e-3 && skin.cover.unwrap() > 0.997, "{report}");
    assert!((report.volume / report.wanted_volume.unwrap() - 1.0).abs() < 0.012, "{report}");
    let coarse = &baked.coarser[0].report;
    assert!(coarse.is_sound() && coarse.tets < report.tets / 2, "{coarse}");
    assert!((coarse.volume / report.volume - 1.0).abs() < 5e-3, "{coarse}");
}

#[test]
fn coarse_head_of_two_millimetres() {
    let Some(head) = data("cthead_unc_2mm.nrrd") else { return };
    let volume = read_volume(&head, &mut Vec::new()).unwrap();
    let options = at_edge(6e-3);
    let baked = run(&volume, None, &options, "coarse");
    assert!(count(&baked, "skull") > 300);
    let again = bake(&volume, None, &options, &mut |_, _| {}).unwrap();
    assert_eq!(again, baked);
}

#[test]
fn bad_volumes_are_told() {
    let Some(head) = data("vtk_headsq_quarter.nrrd") else { return };
    let volume = read_volume(&head, &mut Vec::new()).unwrap();
    let refused = |change: &dyn Fn(&mut f32), options: &BakeOptions| {
        let mut v = volume.clone();
        v.samples.iter_mut().for_each(change);
        bake(&v, None, options, &mut |_, _| {}).unwrap_err()
    };
    let plain = at_edge(6e-3);
    let offset = refused(&|s| *s += 1024.0, &plain);
    assert!(matches!(offset, MeshingError::EmptyIsosurface { name: "skin", .. }), "{offset}");
    let soft = refused(&|s| *s = s.min(200.0), &plain);
    assert!(matches!(soft, MeshingError::EmptyIsosurface { name: "bone", .. }), "{soft}");
    let far =
        BakeOptions { roi: Some([nalgebra::Vector3::repeat(5.0), nalgebra::Vector3::repeat(5.1)]), ..plain.clone() };
    assert!(matches!(refused(&|_| {}, &far), MeshingError::Region { .. }));
}
