//! Region and face of a scan do not depend on how its voxels are stored; labels are taken as they are, or told.
use cutis::geometry::head::{mandible, skin, skull};
use cutis::geometry::{BakeOptions, Baked, Grid, Labels, MeshingError, Resolution, Volume, Warning, bake};
use cutis::io::{LabelMap, read_labels, read_volume, write_labels};
use cutis::math::{Mat3, Vec3};

use super::mesh_files::fresh;

/// Voxels of the analytic head, m.
const SPACING: [f64; 3] = [4e-3, 4e-3, 5e-3];

/// The synthetic head as a CT: its surfaces lie at -300 and 250 HU.
fn scan() -> Volume {
    let dims = [46, 58, 52];
    let spacing = Vec3::from(SPACING);
    let middle = Vec3::from_fn(|a, _| (dims[a] as f64 - 1.0) / 2.0).component_mul(&spacing);
    let grid = Grid { dims, spacing, origin: -middle + Vec3::new(0.0, 0.01, 0.0), direction: Mat3::identity() };
    let samples = points(&grid).map(|p| {
        let slope = 25e3;
        let tissue = (-300.0 - slope * skin(&p)).clamp(-1000.0, 40.0);
        let bone = (250.0 - slope * skull(&p).min(mandible(&p))).clamp(40.0, 1200.0);
        (if skin(&p) < 0.0 { tissue.max(bone) } else { tissue }).round() as f32
    });
    let samples = samples.collect();
    Volume { grid, samples }
}

fn points(grid: &Grid) -> impl Iterator<Item = Vec3> {
    let [nx, ny, nz] = grid.dims;
    let cells = (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])));
    cells.map(|c| grid.world(&Vec3::from(c.map(|n| n as f64))))
}

/// The same scan with axes in another order, some of them turned.
fn stored(volume: &Volume, order: [usize; 3], turned: [bool; 3]) -> Volume {
    let grid = &volume.grid;
    let last = Vec3::from_fn(|g, _| if turned[g] { grid.dims[g] as f64 - 1.0 } else { 0.0 });
    let axis = |a: usize| grid.direction.column(order[a]) * if turned[order[a]] { -1.0 } else { 1.0 };
    let other = Grid {
        dims: order.map(|g| grid.dims[g]),
        spacing: Vec3::from_fn(|a, _| grid.spacing[order[a]]),
        origin: grid.world(&last),
        direction: Mat3::from_columns(&[axis(0).into_owned(), axis(1).into_owned(), axis(2).into_owned()].map(|c| c)),
    };
    let samples = points(&other).map(|p| volume.samples[grid.index(grid.nearest(&p))]).collect();
    Volume { grid: other, samples }
}

/// As an NRRD file, in RAS or LPS.
pub fn write(volume: &Volume, name: &str, ras: bool) -> std::path::PathBuf {
    let sign = if ras { Vec3::new(-1.0, -1.0, 1.0) } else { Vec3::repeat(1.0) };
    let vector = |v: Vec3| {
        let v = v.component_mul(&sign) * 1e3;
        format!("({:.6},{:.6},{:.6})", v.x, v.y, v.z)
    };
    let grid = &volume.grid;
    let axes = [0, 1, 2].map(|a| vector(grid.direction.column(a) * grid.spacing[a])).join(" ");
    let [nx, ny, nz] = grid.dims;
    let head = format!(
        "NRRD0004\ntype: float\ndimension: 3\nspace: {}\nsizes: {nx} {ny} {nz}\nspace directions: {axes}\nendian: little\n\
         encoding: raw\nspace origin: {}\n\n",
        if ras { "RAS" } else { "LPS" },
        vector(grid.origin)
    );
    let path = fresh(name);
    std::fs::write(&path, [head.into_bytes(), volume.samples.iter().flat_map(|s| s.to_le_bytes()).collect()].concat())
        .unwrap();
    path
}

fn options() -> BakeOptions {
    let errors = [Some(0.4e-3), Some(1e-3)];
    let resolution = Resolution { edge: 8e-3, skin_error: errors[0], bone_error: errors[1], ..Resolution::default() };
    BakeOptions { resolution, ..BakeOptions::default() }
}

fn baked(volume: &Volume, labels: Option<&Labels>) -> Baked {
    bake(volume, labels, &options(), &mut |_, _| {}).unwrap()
}

/// The same mesh, its nodes to round-off.
fn alike(found: &Baked, wanted: &Baked, what: &str) {
    let (a, b) = (&found.finest.mesh, &wanted.finest.mesh);
    assert!(a.tets == b.tets && a.region == b.region, "{what}: {} and {} tetrahedra", a.tets.len(), b.tets.len());
    assert!(a.node_sets == b.node_sets && a.face_sets == b.face_sets, "{what}");
    let apart = a.nodes.iter().zip(&b.nodes).map(|(x, y)| (x - y).norm()).fold(0.0, f64::max);
    assert!(apart < 1e-9, "{what}: {apart} m apart");
    assert_eq!(found.labels.as_ref().map(|l| &l.ids), wanted.labels.as_ref().map(|l| &l.ids), "{what}");
    for (c, d) in found.condyles.iter().flatten().zip(wanted.condyles.iter().flatten()) {
        assert!((c - d).norm() < 1e-9, "{what}: {c:?} {d:?}");
    }
}

#[test]
fn region_and_face_are_the_same_however_voxels_are_stored() {
    let scan = scan();
    let wanted = baked(&read_volume(&write(&scan, "stored.nrrd", false), &mut Vec::new()).unwrap(), None);
    // Its jaw is a sketch, a solid arch: that is told, and nothing is moved that is no jaw.
    assert!(wanted.warnings.contains(&Warning::JawNotFound) && wanted.condyles.is_none());
    assert!(wanted.finest.mesh.node_set("mandible").is_none());
    let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    for (k, order) in orders.into_iter().enumerate() {
        for turned in [[k % 2 == 0, k % 3 != 1, k > 2], [true, false, true]] {
            let other = stored(&scan, order, turned);
            let read = read_volume(&write(&other, "stored.nrrd", turned[0]), &mut Vec::new()).unwrap();
            alike(&baked(&read, None), &wanted, &format!("axes {order:?}, turned {turned:?}"));
        }
    }
    // The head is symmetric, and so is the region found in it, but for where edges were collapsed: the foremost voxels lie on
    // both sides of the median plane.
    let x = wanted.finest.mesh.nodes.iter().map(|p| p.x);
    let (right, left) = (x.clone().fold(f64::INFINITY, f64::min), x.fold(f64::NEG_INFINITY, f64::max));
    assert!((right + left).abs() < 0.5e-3, "{right} {left}");
}

/// Round-off of an orientation in single precision turns the volume by 1e-7: that must not choose a nose tip, which would
/// move the region by millimetres. It may choose which edges collapse.
#[test]
fn round_off_of_the_orientation_moves_nothing() {
    let scan = scan();
    let wanted = baked(&scan, None);
    for angle in [1e-7f64, -1e-7] {
        let turn = nalgebra::Rotation3::from_axis_angle(&Vec3::z_axis(), angle).into_inner();
        let grid = Grid { direction: turn, ..scan.grid.clone() };
        let found = baked(&Volume { grid, samples: scan.samples.clone() }, None);
        let x = |b: &Baked| b.finest.mesh.nodes.iter().map(|p| p.x).fold(f64::INFINITY, f64::min);
        assert!((x(&found) - x(&wanted)).abs() < 1e-3, "{} {}", x(&found), x(&wanted));
    }
}

/// Labels by the formulas, within `rows` of the third axis.
fn labels(volume: &Volume, numbers: [u8; 2]) -> Labels {
    let of = |p: Vec3| {
        let (s, m) = (skull(&p), mandible(&p));
        if s.min(m) > 2e-3 { 0 } else { numbers[usize::from(m < s)] }
    };
    Labels { grid: volume.grid.clone(), ids: points(&volume.grid).map(of).collect() }
}

fn nodes(baked: &Baked, name: &str) -> usize {
    baked.finest.mesh.node_set(name).map_or(0, |s| s.nodes.len())
}

#[test]
fn labels_cropped_to_the_bones_are_taken_and_others_told() {
    let scan = scan();
    let whole = baked(&scan, Some(&labels(&scan, [2, 3])));
    assert!(!whole.warnings.iter().any(|w| matches!(w, Warning::LabelsCropped { .. } | Warning::NoLabel { .. })));
    // The box about the face's bones: the region reaches beyond it on all sides.
    let mut cropped = labels(&scan, [2, 3]);
    let [low, high] = [[8, 10, 8], [38, 40, 44]];
    let dims = [0, 1, 2].map(|a| high[a] - low[a]);
    let origin = cropped.grid.world(&Vec3::from(low.map(|n| n as f64)));
    let inside = |k: usize| [low[0] + k % dims[0], low[1] + k / dims[0] % dims[1], low[2] + k / (dims[0] * dims[1])];
    cropped.ids = (0..dims.iter().product()).map(|k| cropped.ids[cropped.grid.index(inside(k))]).collect();
    cropped.grid = Grid { dims, origin, ..cropped.grid };
    let found = baked(&scan, Some(&cropped));
    assert!(found.warnings.iter().any(|w| matches!(w, Warning::LabelsCropped { .. })), "{:?}", found.warnings);
    assert!(nodes(&found, "mandible") as f64 > 0.9 * nodes(&whole, "mandible") as f64);
    let told = |labels: &Labels| bake(&scan, Some(labels), &options(), &mut |_, _| {});
    let none = told(&labels(&scan, [7, 9])).unwrap_err();
    assert!(matches!(&none, MeshingError::LabelNumbers { found } if found == "0, 7, 9"), "{none}");
    assert!(none.to_string().contains("--labels-map"));
    let half = told(&labels(&scan, [2, 9])).unwrap().warnings;
    let wanted = Warning::NoLabel { bone: "mandible", wanted: 3, found: "0, 2, 9".into() };
    assert!(half.contains(&wanted) && half.contains(&Warning::JawNotFound), "{half:?}");
    let mut moved = labels(&scan, [2, 3]);
    moved.grid.origin.x += 0.5;
    assert!(matches!(told(&moved).unwrap_err(), MeshingError::Labels { .. }));
    moved.grid.origin += Vec3::new(-0.5, -0.12, 0.0);
    assert!(told(&moved).unwrap().warnings.iter().any(|w| matches!(w, Warning::LabelsOffBone { .. })));
}

#[test]
fn labels_are_written_as_they_are_read() {
    let scan = scan();
    let mut wanted = labels(&scan, [2, 3]);
    let turn = cutis::math::exp_rotation(&Vec3::new(0.1, -0.2, 0.3));
    wanted.grid.direction = turn;
    for name in ["written.nii", "written.nii.gz"] {
        let path = fresh(name);
        write_labels(&path, &wanted).unwrap();
        let mut notes = Vec::new();
        let found = read_labels(&path, &LabelMap::default(), &mut notes).unwrap();
        assert!(notes.is_empty(), "{notes:?}");
        assert_eq!((found.grid.dims, &found.ids), (wanted.grid.dims, &wanted.ids));
        let apart = |a: Vec3, b: Vec3| (a - b).norm();
        assert!(
            apart(found.grid.origin, wanted.grid.origin) < 1e-7
                && apart(found.grid.spacing, wanted.grid.spacing) < 1e-8
        );
        assert!((found.grid.direction - turn).norm() < 1e-6);
    }
    let e = write_labels(&fresh("written.nrrd"), &wanted).unwrap_err();
    assert!(e.to_string().contains(".nii.gz"), "{e}");
}

#[test]
fn numbers_of_a_labels_file_are_mapped() {
    let scan = scan();
    let own = labels(&scan, [2, 3]);
    let other = Volume {
        grid: own.grid.clone(),
        samples: own.ids.iter().map(|&id| [0.0, 0.0, 500.0, 1.0][usize::from(id)]).collect(),
    };
    let path = write(&other, "labels.nrrd", false);
    let read = |map: &str| read_labels(&path, &map.parse::<LabelMap>().unwrap(), &mut Vec::new());
    assert_eq!(read("skull=500,mandible=1").unwrap().ids, own.ids);
    assert_eq!(read("mandible=1, skull=500").unwrap().ids, own.ids);
    let missing = read("skull=5,mandible=1").unwrap_err().to_string();
    assert!(missing.contains("0, 1, 500") && missing.contains("5, which stands for skull"), "{missing}");
    let plain = read_labels(&path, &LabelMap::default(), &mut Vec::new()).unwrap_err().to_string();
    assert!(plain.contains("500") && plain.contains("--labels-map"), "{plain}");
    for (text, word) in
        [("skull", "skull=5"), ("jaw=1", "`mandible`"), ("skull=x", "`x`"), ("skull=1,spine=1", "twice")]
    {
        assert!(text.parse::<LabelMap>().unwrap_err().contains(word), "{text}");
    }
}
