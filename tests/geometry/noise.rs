//! Random tissue, thin and torn, still becomes one sound piece.
use cutis::geometry::{
    Cuboid, Distance, Isosurface, MeshReport, MeshingError, Side, Uniform, Volume, Wall, tetrahedralise,
};
use cutis::math::Random;
use cutis::mesh::TetMesh;

use super::marching_cubes::grid;

#[test]
fn random_volumes_are_sound() {
    let mut random = Random(23);
    let mut made = 0;
    for trial in 0..60 {
        let g = grid([14; 3], 1e-3);
        let mut samples: Vec<f32> = (0..g.len()).map(|_| (2.0 * random.number() - 0.9) as f32).collect();
        // Some volumes are smoothed once, some twice, some not at all.
        for _ in 0..trial % 3 {
            let old = samples.clone();
            for k in 1..13 {
                for j in 1..13 {
                    for i in 1..13 {
                        let at = g.index([i, j, k]);
                        samples[at] = (old[at] * 2.0
                            + old[at - 1]
                            + old[at + 1]
                            + old[at - 14]
                            + old[at + 14]
                            + old[at - 196]
                            + old[at + 196])
                            / 8.0;
                    }
                }
            }
        }
        let volume = Volume { grid: g, samples };
        let distance = Distance::to_isosurface(&volume, 0.0);
        let field = Isosurface { volume: &volume, iso: 0.0, distance: &distance };
        let [low, high] = volume.grid.bounds();
        let region = Cuboid { low, high };
        let walls = [
            Wall { name: "skin", field: &field, side: Side::Inside },
            Wall { name: "cut", field: &region, side: Side::Inside },
        ];
        let stuffing = match tetrahedralise(&walls, &region, &Uniform(1.1e-3)) {
            Ok(stuffing) => stuffing,
            Err(MeshingError::NoTissue { .. }) => continue,
            Err(other) => panic!("trial {trial} of seed 23: {other}"),
        };
        made += 1;
        let tets = stuffing.mesh.tets.clone();
        let mesh = TetMesh {
            region: vec![0; tets.len()],
            region_names: vec!["tissue".into()],
            nodes: stuffing.mesh.nodes.clone(),
            tets,
            ..TetMesh::default()
        };
        let report = MeshReport::of(&mesh.checked().unwrap(), 0);
        assert!(report.is_sound(), "trial {trial} of seed 23\n{report}{:?}", stuffing.repair);
        // A parted node moves a little into its own piece: a degree below the bound of the paper.
        assert!(report.dihedral[0] > 9.7 && report.dihedral[1] < 165.8, "trial {trial} of seed 23\n{report}");
    }
    assert!(made > 50, "{made}");
}
