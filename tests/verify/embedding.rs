//! A fine skin on a coarser mesh: exact where the mesh is, near the fine mesh's own answer elsewhere.

use std::path::Path;

use cutis::fem::Locator;
use cutis::geometry::{Block, Head, Pattern, block};
use cutis::math::{Mat3, Vec3};
use cutis::mesh::{FineSkin, NodeSet, TetMesh};
use cutis::scene::{SceneFile, build};
use cutis::sim::Sim;

use crate::common::{Random, get, largest, port, rows, set, sim};

/// A block whose whole boundary is one bone, and points in and a little outside of it as fine skin.
fn caged(outside: f64) -> TetMesh {
    let spec = Block {
        origin: Vec3::zeros(),
        size: Vec3::new(1.0, 1.2, 0.9),
        cells: [2, 3, 2],
        pattern: Pattern::FortyEight,
        layers: vec![],
    };
    let mut mesh = block(&spec).expect("a block");
    let mut boundary: Vec<u32> = mesh.boundary().into_flattened();
    boundary.sort_unstable();
    boundary.dedup();
    mesh.node_sets.push(NodeSet { name: "boundary".into(), nodes: boundary });
    let mut random = Random(11);
    let inside = |v: Vec3| 0.5 * (v + Vec3::repeat(1.0)).component_mul(&spec.size);
    let mut vertices: Vec<Vec3> = (0..60).map(|_| inside(random.vector())).collect();
    // On nodes, on faces, and outside.
    vertices.extend(mesh.nodes.iter().step_by(7));
    vertices.extend(mesh.boundary().iter().step_by(9).map(|t| {
        let c = t.iter().map(|&a| mesh.nodes[a as usize]).sum::<Vec3>() / 3.0;
        c + outside * (c - 0.5 * spec.size)
    }));
    let n = vertices.len() as u32;
    mesh.fine_skin = Some(FineSkin { vertices, triangles: (0..n - 2).map(|a| [a, a + 1, a + 2]).collect() });
    mesh.checked().expect("a mesh")
}

fn model_of(mesh: TetMesh, keys: &str) -> Result<cutis::sim::Model, String> {
    let text = format!(
        "[mesh]\nfile = \"block\"\n{keys}[[tissue]]\nE = 1.0\nnu = 0.4\n[[bone]]\nname = \"boundary\"\ndrive = \
         \"displacement\"\n[solver]\ntolerance = 1e-14\n[inertia]\n[[marker]]\nname = \"m\"\nat = [0.5, 0.6, 1.0]\n"
    );
    build(&text, &SceneFile::parse(&text).expect("a scene"), mesh).map(|(m, _)| m).map_err(|e| e.to_string())
}

#[test]
fn an_affine_motion_takes_every_vertex_along_inside_and_outside() {
    let A = Mat3::new(0.05, 0.08, -0.03, 0.02, -0.06, 0.05, -0.06, 0.01, 0.1);
    for keys in ["order = 1\n", "order = 2\n"] {
        let mesh = caged(0.08);
        let skin = mesh.fine_skin.clone().expect("made above").vertices;
        let mut sim = Sim::new(std::sync::Arc::new(model_of(mesh, keys).expect("a model"))).expect("a simulation");
        let rest = rows(&get(&sim, "skin.restPosition"));
        assert!(
            largest(rest.iter().zip(&skin).map(|(x, X)| (x - X).norm())) < 1e-14,
            "at rest it is where it was given"
        );
        let marker = rows(&get(&sim, "marker.position"))[0];
        let X = &sim.model().mesh().nodes;
        let nodes = &sim.model().parts().bones[0].nodes;
        let u: Vec<f64> = nodes.iter().flat_map(|&a| <[f64; 3]>::from(A * X[a as usize])).collect();
        let p = port(&sim, "bone.boundary.displacement");
        sim.set_f64(p, 0, &u).expect("as many values as nodes");
        // With inertia, so long a step is an equilibrium to rounding.
        let dt = 1e8;
        sim.step(dt).expect("an affine step");
        let error = |x: &[Vec3], X: &[Vec3]| largest(x.iter().zip(X).map(|(x, X)| (x - X - A * X).norm()));
        assert!(error(&rows(&get(&sim, "skin.position")), &rest) < 1e-9, "{keys}");
        assert!(error(&rows(&get(&sim, "marker.position")), &[marker]) < 1e-9, "{keys}");
        let v = rows(&get(&sim, "skin.velocity"));
        assert!(largest(v.iter().zip(&rest).map(|(v, X)| (v - A * X / dt).norm())) < 1e-9 / dt, "{keys}");
        let mut one = [0.0];
        sim.get_f64(port(&sim, "skin.position"), 7, &mut one).expect("in range");
        assert_eq!(one[0], get(&sim, "skin.position")[7]);
    }
}

#[test]
fn a_skin_far_from_the_mesh_is_told_and_one_elsewhere_is_refused() {
    let warned = model_of(caged(0.3), "").expect("a model");
    assert!(warned.warnings().iter().any(|w| w.contains("outside the mesh")), "{:?}", warned.warnings());
    assert!(model_of(caged(0.0), "").expect("a model").warnings().iter().all(|w| !w.contains("outside the mesh")));
    let message = model_of(caged(500.0), "").err().expect("millimetres for metres are refused");
    assert!(message.contains("differ in unit"), "{message}");
}

#[test]
fn the_locator_finds_what_a_search_of_all_finds() {
    let mesh = caged(0.0);
    let locator = Locator::new(&mesh);
    let mut random = Random(3);
    for _ in 0..200 {
        let p = 1.5 * random.vector();
        let found = locator.find(&p, &p).expect("something is nearest");
        let at: Vec3 = mesh.tets[found.e].iter().zip(found.L).map(|(&a, l)| l * mesh.nodes[a as usize]).sum();
        assert!(((at - p).norm() - found.distance).abs() < 1e-12);
        // The block is convex: the nearest point is the clamped one.
        let clamped = p.sup(&Vec3::zeros()).inf(&Vec3::new(1.0, 1.2, 0.9));
        assert!(((clamped - p).norm() - found.distance).abs() < 1e-12, "{p}: {found:?}");
    }
}

/// The skin of the head under an opening jaw and a push at the cheek.
fn head(mesh: &str) -> (Vec<Vec3>, Vec<Vec3>) {
    let mut sim = sim(&format!(
        "{mesh}[[tissue]]\nE = 15e3\nnu = 0.45\n[[bone]]\nname = \"skull\"\ndrive = \"held\"\n[[bone]]\nname = \"mandible\"\n\
         pivot = [0.0, 0.0, 0.044]\n[[load]]\nname = \"cheek\"\nat = [0.048, -0.075, 0.012]\nradius = 0.012\n"
    ));
    let rest = rows(&get(&sim, "skin.restPosition"));
    for k in 1..=4 {
        set(&mut sim, "bone.rotation", 3, &[f64::from(k) * 2.0_f64.to_radians()]);
        set(&mut sim, "load.force", 0, &[0.0, 0.1 * f64::from(k), 0.0]);
        sim.step(0.1).expect("a step");
    }
    (rest, rows(&get(&sim, "skin.position")))
}

/// Rms and largest distance between two answers for the same vertices, and the rms of the motion, m.
fn compare(a: &(Vec<Vec3>, Vec<Vec3>), b: &(Vec<Vec3>, Vec<Vec3>)) -> [f64; 3] {
    assert!(largest(a.0.iter().zip(&b.0).map(|(a, b)| (a - b).norm())) < 1e-12, "the same vertices");
    let rms = |d: &dyn Fn(usize) -> f64| ((0..a.0.len()).map(|k| d(k).powi(2)).sum::<f64>() / a.0.len() as f64).sqrt();
    let gap = |k: usize| (a.1[k] - b.1[k]).norm();
    [rms(&gap), (0..a.0.len()).map(gap).fold(0.0, f64::max), rms(&|k| (b.1[k] - b.0[k]).norm())]
}

/// The table of docs/verification.md at its coarse end; `CUTIS_FINE=0.004` measures the fine end.
#[test]
fn a_fine_skin_on_a_coarse_head_is_near_the_fine_head() {
    let fine: f64 = std::env::var("CUTIS_FINE").map_or(0.0078, |edge| edge.parse().expect("metres"));
    let coarse = if fine < 0.0078 { 0.0078 } else { 0.0119 };
    let truth = head(&format!("[mesh.head]\nedge = {fine}\n"));
    for (name, keys) in
        [("tet4", ""), ("tet10", "[mesh]\norder = 2\n"), ("curved", "[mesh]\norder = 2\ncurved = true\n")]
    {
        let caged = head(&format!("{keys}[mesh.head]\nedge = {coarse}\n[skin]\nedge = {fine}\n"));
        let [rms, most, motion] = compare(&caged, &truth).map(|x| 1e3 * x);
        println!(
            "skin of {fine} m on {name} of {coarse} m: rms {rms:.2} mm, at most {most:.2} mm, of a motion of {motion:.2} mm rms"
        );
        assert!(rms < 0.07 * motion, "{name}: {rms:.2} of {motion:.2} mm");
        // A vertex bound to the other lip would be off by the opening of the mouth, 10 mm.
        assert!(most < 3.5, "{name}: {most:.2} mm");
    }
    let mesh = Head { edge: fine, ..Head::default() }.mesh().expect("a head").0;
    assert_eq!(FineSkin::of(&mesh).vertices, truth.0);
}

#[test]
fn slips_of_the_skin_table_are_answered() {
    let block = "[mesh.block]\nsize = [1, 1, 1]\ncells = [1, 1, 1]\n[skin]\nWHAT\n[[tissue]]\nE = 1.0\nnu = 0.3\n[[bone]]\nname = \"z_min\"\n";
    for (what, wanted) in [
        ("", "exactly one of"),
        ("edge = 0.004", "[mesh.head]"),
        ("subdivisions = 9", "1 <= . < 6"),
        ("file = \"no.vtk\"", "no.vtk"),
        ("file = \"a.stl\"", ".vtu, .vtk and .msh"),
    ] {
        let message = match cutis::load::from_text(&block.replace("WHAT", what), Some(Path::new("."))) {
            Ok(_) => panic!("accepted: {what}"),
            Err(e) => e.to_string(),
        };
        assert!(message.contains(wanted), "`{wanted}` is missing from: {message}");
    }
}
