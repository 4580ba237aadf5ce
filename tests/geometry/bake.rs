//! Real heads: from the CT to named tetrahedra, with and without labels, and what bad volumes are told.
use cutis::geometry::{BakeOptions, Baked, MeshingError, Volume, Warning, bake};
use cutis::io::{LabelMap, read_labels, read_volume, write_mesh};

use super::ct_files::data;
use super::stuffing::DIHEDRAL;

fn run(volume: &Volume, labels: Option<&cutis::geometry::Labels>, options: &BakeOptions, name: &str) -> Baked {
    let start = std::time::Instant::now();
    let mut stages = Vec::new();
    let baked = bake(volume, labels, options, &mut |stage, share| {
        stages.push((stage.to_string(), share, start.elapsed().as_secs_f64()))
    })
    .unwrap();
    println!("== {name}\n{}{} slit nodes, {} released", baked.report, baked.slit_nodes, baked.released_nodes);
    stages.iter().for_each(|(stage, _, t)| println!("{t:6.2} s {stage}"));
    baked.warnings.iter().for_each(|w| println!("warning: {w}"));
    for s in &baked.mesh.node_sets {
        println!("node set {} {}", s.name, s.nodes.len());
    }
    for s in &baked.mesh.face_sets {
        println!("face set {} {}", s.name, s.triangles.len());
    }
    assert!(stages.windows(2).all(|w| w[0].1 <= w[1].1));
    write_mesh(&super::mesh_files::scratch(&format!("{name}.cutis")), &baked.mesh).unwrap();
    let r = &baked.report;
    assert!(r.is_sound(), "{r}");
    assert!(r.dihedral[0] >= DIHEDRAL[0] && r.dihedral[1] <= DIHEDRAL[1], "{r}");
    let faces: usize = baked.mesh.face_sets.iter().map(|s| s.triangles.len()).sum();
    assert_eq!(faces, baked.mesh.boundary().len());
    baked
}

fn count(baked: &Baked, name: &str) -> usize {
    baked.mesh.node_set(name).map_or(0, |s| s.nodes.len())
}

/// Whether tetrahedra that share a node lead from the lower lip's skin to the upper lip's inside the mouth's box.
fn lips_hang_together(baked: &Baked, mouth: [nalgebra::Vector3<f64>; 2], edge: f64) -> bool {
    let mesh = &baked.mesh;
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
    let options = BakeOptions { edge: 6e-3, ..BakeOptions::default() };
    let parted = run(&volume, Some(&labels), &options, "parted");
    let closed = run(&volume, Some(&labels), &BakeOptions { slit: false, ..options.clone() }, "closed");
    let mouth = parted.mouth.unwrap();
    assert!(closed.mouth.is_none() && closed.slit_nodes == 0);
    assert!(!lips_hang_together(&parted, mouth, options.edge));
    assert!(lips_hang_together(&closed, mouth, options.edge));
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
    assert!(baked.slit_nodes > 100);
    assert!(!lips_hang_together(&baked, baked.mouth.unwrap(), 4e-3));
    // By index near (51, 111, 49) and (157, 116, 51).
    let at = |i: f64, j: f64, k: f64| volume.grid.world(&nalgebra::Vector3::new(i, j, k));
    let [right, left] = baked.condyles.unwrap();
    println!("condyles {:.1?} {:.1?} mm", (right * 1e3).as_slice(), (left * 1e3).as_slice());
    assert!((right - at(51.0, 111.0, 49.0)).norm() < 0.006 && (left - at(157.0, 116.0, 51.0)).norm() < 0.006);
    assert!(!baked.warnings.contains(&Warning::JawNotFound));
}

#[test]
fn clean_head_without_labels_in_release() {
    let Some(head) = data("cthead_unc_clean.nii.gz") else { return };
    let volume = read_volume(&head, &mut Vec::new()).unwrap();
    let options = BakeOptions { edge: 5e-3, ..BakeOptions::default() };
    let baked = run(&volume, None, &options, "clean_bare");
    assert!(count(&baked, "skull") > 500 && count(&baked, "mandible") > 300);
    assert!(baked.warnings.iter().any(|w| matches!(w, Warning::Thin { .. })));
    if let Some(labels) = data("cthead_unc_labels.nii.gz") {
        let labels = read_labels(&labels, &LabelMap::default(), &mut Vec::new()).unwrap();
        // A bone node lies on the bone's surface: the labels round it name the bone, 2 skull, 3 mandible, 4 spine.
        let share = |name: &str, wanted: [u8; 2]| {
            let nodes = &baked.mesh.node_set(name).unwrap().nodes;
            let around = |a: &&u32| {
                let x = baked.mesh.nodes[**a as usize];
                (0..27).any(|k| {
                    let step = nalgebra::Vector3::new(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1).map(|c| 2e-3 * f64::from(c));
                    wanted.contains(&labels.at(&(x + step)))
                })
            };
            nodes.iter().filter(around).count() as f64 / nodes.len() as f64
        };
        let (skull, mandible, spine) = (share("skull", [2, 2]), share("mandible", [3, 3]), share("spine", [4, 4]));
        println!("labels agree: skull {skull:.3}, mandible {mandible:.3}, spine {spine:.3}");
        assert!(skull > 0.97 && mandible > 0.97 && spine > 0.9);
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
    let options = BakeOptions { roi: Some([low, high]), depth: 1.0, ..BakeOptions::default() };
    let baked = run(&volume, Some(&labels), &options, "crop");
    assert!((130_000..165_000).contains(&baked.report.tets));
    assert!(count(&baked, "mandible") > 1000);
}

#[test]
fn coarse_head_of_two_millimetres() {
    let Some(head) = data("cthead_unc_2mm.nrrd") else { return };
    let volume = read_volume(&head, &mut Vec::new()).unwrap();
    let options = BakeOptions { edge: 6e-3, ..BakeOptions::default() };
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
    let plain = BakeOptions { edge: 6e-3, ..BakeOptions::default() };
    let offset = refused(&|s| *s += 1024.0, &plain);
    assert!(matches!(offset, MeshingError::EmptyIsosurface { name: "skin", .. }), "{offset}");
    let soft = refused(&|s| *s = s.min(200.0), &plain);
    assert!(matches!(soft, MeshingError::EmptyIsosurface { name: "bone", .. }), "{soft}");
    let far =
        BakeOptions { roi: Some([nalgebra::Vector3::repeat(5.0), nalgebra::Vector3::repeat(5.1)]), ..plain.clone() };
    assert!(matches!(refused(&|_| {}, &far), MeshingError::Region { .. }));
}
