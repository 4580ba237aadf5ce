//! The synthetic head: sound, symmetric to the bit, near its formulas, with bones, a slit and markers on the skin.
use std::collections::BTreeMap;

use cutis::geometry::Head;
use cutis::geometry::head::{mandible, markers, skin, skull};
use cutis::math::Vec3;
use cutis::mesh::TetMesh;

use super::stuffing::assert_sound;

fn key(x: &Vec3) -> [u64; 3] {
    [x.x, x.y, x.z].map(|c| (c + 0.0).to_bits())
}

#[test]
fn default_head_is_sound_and_of_size() {
    let start = std::time::Instant::now();
    let (mesh, report) = Head::default().mesh().unwrap();
    println!("{report}{:.2} s", start.elapsed().as_secs_f64());
    for s in &mesh.node_sets {
        println!("node set {} {}", s.name, s.nodes.len());
    }
    for s in &mesh.face_sets {
        println!("face set {} {}", s.name, s.triangles.len());
    }
    for (r, n) in mesh.region_names.iter().enumerate() {
        println!("region {n} {}", mesh.region.iter().filter(|&&x| x as usize == r).count());
    }
    cutis::io::write_mesh(&super::mesh_files::scratch("head.vtu"), &mesh).unwrap();
    assert_sound(&report);
    assert!((18_000..=22_000).contains(&report.tets), "{report}");
    let n = |name: &str| mesh.node_set(name).unwrap().nodes.len();
    assert!(n("skull") > 200 && n("mandible") > 200);
    assert!(mesh.face_sets.iter().all(|s| !s.triangles.is_empty()));
    let faces: usize = mesh.face_sets.iter().map(|s| s.triangles.len()).sum();
    assert_eq!(faces, mesh.boundary().len());
    assert!(report.surfaces[0].mean < 0.6e-3, "{report}");
}

#[test]
fn head_mirrors_to_the_bit() {
    let (mesh, _) = Head::default().mesh().unwrap();
    let mut places: BTreeMap<[u64; 3], Vec<u32>> = BTreeMap::new();
    mesh.nodes.iter().zip(0..).for_each(|(x, a)| places.entry(key(x)).or_default().push(a));
    let image = |a: u32| {
        let x = mesh.nodes[a as usize];
        places.get(&key(&Vec3::new(-x.x, x.y, x.z))).expect("every node has an image")[0]
    };
    // Doubled nodes share a place, so tetrahedra are compared by places.
    let place = |a: u32| places[&key(&mesh.nodes[a as usize])][0];
    let sorted = |t: [u32; 4], f: &dyn Fn(u32) -> u32| {
        let mut t = t.map(f);
        t.sort_unstable();
        t
    };
    let by = |mesh: &TetMesh, f: &dyn Fn(u32) -> u32| {
        let mut all: Vec<_> = mesh.tets.iter().zip(&mesh.region).map(|(t, r)| (sorted(*t, f), *r)).collect();
        all.sort_unstable();
        all
    };
    assert_eq!(by(&mesh, &place), by(&mesh, &image));
    for set in &mesh.node_sets {
        let mut nodes: Vec<u32> = set.nodes.iter().map(|&a| place(a)).collect();
        let mut images: Vec<u32> = set.nodes.iter().map(|&a| image(a)).collect();
        nodes.sort_unstable();
        images.sort_unstable();
        assert_eq!(nodes, images, "{}", set.name);
    }
}

#[test]
fn mouth_is_cut_and_markers_lie_on_the_skin() {
    let (mesh, _) = Head::default().mesh().unwrap();
    let mut places: BTreeMap<[u64; 3], usize> = BTreeMap::new();
    mesh.nodes.iter().for_each(|x| *places.entry(key(x)).or_default() += 1);
    let doubled: Vec<[u64; 3]> = places.into_iter().filter(|(_, n)| *n > 1).map(|(k, _)| k).collect();
    assert!(doubled.len() > 10, "{} doubled nodes", doubled.len());
    let xs: Vec<f64> = doubled.iter().map(|k| f64::from_bits(k[0])).collect();
    let width = xs.iter().fold(0.0f64, |w, x| w.max(x.abs())) * 2.0;
    assert!((0.035..0.060).contains(&width), "slit {width} m wide");
    for (name, x) in markers() {
        assert!(skin(&x).abs() < 1e-9, "{name}");
        assert!(skull(&x) > 0.005 && mandible(&x) > 0.005, "{name}");
    }
}

#[test]
fn finer_heads_come_nearer() {
    let errors = [8e-3, 4e-3].map(|edge| {
        let (_, report) = Head { edge, ..Head::default() }.mesh().unwrap();
        println!("{report}");
        assert!(report.is_sound(), "{report}");
        report.surfaces[0].mean
    });
    assert!(errors[0] / errors[1] > 2.0, "{errors:?}");
    assert!(Head { edge: -1.0, ..Head::default() }.mesh().is_err());
    assert!(Head { edge: 5.0, ..Head::default() }.mesh().is_err());
    assert!(Head { edge: 1e-9, ..Head::default() }.mesh().is_err());
}

#[test]
fn heads_of_every_edge_are_sound() {
    for edge in [5.5e-3, 6.2e-3, 7.3e-3, 9.1e-3, 12e-3] {
        let (mesh, report) = Head { edge, ..Head::default() }.mesh().unwrap();
        assert_sound(&report);
        let mut places: Vec<_> = mesh.nodes.iter().map(key).collect();
        places.sort_unstable();
        assert!(places.windows(2).any(|w| w[0] == w[1]), "no slit at edge {edge}");
        let (skull, mandible) = (mesh.node_set("skull").unwrap(), mesh.node_set("mandible").unwrap());
        assert!(skull.nodes.iter().all(|a| mandible.nodes.binary_search(a).is_err()));
    }
}
