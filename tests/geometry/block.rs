//! Blocks fill their box exactly with the promised tetrahedra.
use cutis::geometry::{Block, MeshingError, Pattern, block};
use cutis::math::Vec3;
use cutis::mesh::SKIN;

fn spec(pattern: Pattern) -> Block {
    Block {
        origin: Vec3::new(0.1, -0.2, 0.3),
        size: Vec3::new(0.2, 0.3, 0.4),
        cells: [2, 3, 4],
        pattern,
        layers: vec![("dermis".into(), 0.25), ("fat".into(), 0.25)],
    }
}

#[test]
fn block_volume_counts_and_sides() {
    for (pattern, per_cell, per_side) in [(Pattern::Six, 6, 2), (Pattern::FortyEight, 48, 8)] {
        let mesh = block(&spec(pattern)).unwrap();
        assert_eq!(mesh.tets.len(), 24 * per_cell);
        let wanted = 0.001 / per_cell as f64;
        for e in 0..mesh.tets.len() {
            assert!((mesh.volume(e) - wanted).abs() < 1e-12 * wanted + 1e-17, "tet {e}: {}", mesh.volume(e));
        }
        let faces: usize = mesh.face_sets.iter().map(|s| s.triangles.len()).sum();
        assert_eq!(faces, mesh.boundary().len());
        assert_eq!(faces, per_side * 2 * (2 * 3 + 3 * 4 + 2 * 4));
        for t in &mesh.face_set(SKIN).unwrap().triangles {
            let [a, b, c] = t.map(|i| mesh.nodes[i as usize]);
            assert!((b - a).cross(&(c - a)).z > 0.0);
            assert!((a.z - 0.7).abs() < 1e-15);
        }
        assert_eq!(mesh.region_names, ["dermis", "fat", "tissue"]);
        let share = |r: u32| mesh.region.iter().filter(|&&x| x == r).count() as f64 / mesh.tets.len() as f64;
        assert_eq!([share(0), share(1), share(2)], [0.25, 0.25, 0.5]);
    }
}

#[test]
fn mirrored_unit_has_at_most_48_tets_a_node_and_mirrors() {
    let mesh = block(&spec(Pattern::FortyEight)).unwrap();
    let mut valence = vec![0; mesh.nodes.len()];
    mesh.tets.iter().flatten().for_each(|&a| valence[a as usize] += 1);
    assert_eq!(valence.iter().max(), Some(&48));
}

#[test]
fn block_refuses_nonsense() {
    let refused = |change: fn(&mut Block)| {
        let mut b = spec(Pattern::Six);
        change(&mut b);
        block(&b).unwrap_err()
    };
    assert!(matches!(refused(|b| b.cells[1] = 0), MeshingError::NotPositive { .. }));
    assert!(matches!(refused(|b| b.size.z = f64::NAN), MeshingError::NotPositive { .. }));
    assert!(matches!(refused(|b| b.layers[0].1 = 0.9), MeshingError::Layers { .. }));
    assert!(matches!(refused(|b| b.cells = [usize::MAX; 3]), MeshingError::TooLarge { .. }));
}
