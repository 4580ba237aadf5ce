//! What is written is read back to the same bits; what is broken is refused with its reason, never a crash.
use std::path::{Path, PathBuf};

use cutis::geometry::{Block, Pattern, block};
use cutis::io::{Data, IoError, decode, encode, read_mesh, read_surface, write_mesh, write_pvd, write_vtp, write_vtu};
use cutis::math::Vec3;
use cutis::mesh::{FaceSet, FineSkin, NodeSet, TetMesh};

pub fn scratch(name: &str) -> PathBuf {
    let dir = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("geometry");
    std::fs::create_dir_all(&dir).unwrap();
    dir.join(name)
}

/// A name that no other test takes, for files that are written again and again.
pub fn fresh(name: &str) -> PathBuf {
    static NEXT: std::sync::atomic::AtomicU32 = std::sync::atomic::AtomicU32::new(0);
    scratch(&format!("{}_{name}", NEXT.fetch_add(1, std::sync::atomic::Ordering::Relaxed)))
}

fn sample() -> TetMesh {
    let mut mesh = block(&Block {
        origin: Vec3::new(1.0 / 3.0, -0.1, 1e-7),
        size: Vec3::new(0.1, 0.07, 0.05),
        cells: [3, 2, 4],
        pattern: Pattern::Six,
        layers: vec![("dermis upper".into(), 0.25), ("fat".into(), 0.5)],
    })
    .unwrap();
    mesh.nodes.iter_mut().enumerate().for_each(|(a, x)| x.x += 1e-9 * (a as f64).sin());
    mesh.nodes[0].y = -0.1 - 1e-13;
    mesh.node_sets.push(NodeSet { name: "lip left".into(), nodes: vec![3, 5] });
    mesh.node_sets.push(NodeSet { name: "empty".into(), nodes: vec![] });
    mesh.face_sets.push(FaceSet { name: "none".into(), triangles: vec![] });
    mesh.region_names.push("unused".into());
    mesh
}

#[test]
fn every_format_returns_the_same_bits() {
    let mesh = sample();
    for extension in ["vtu", "vtk", "msh", "cutis"] {
        let path = scratch(&format!("round.{extension}"));
        write_mesh(&path, &mesh).unwrap();
        assert_eq!(read_mesh(&path, &mut Vec::new()).unwrap(), mesh, "{extension}");
        let first = std::fs::read(&path).unwrap();
        write_mesh(&path, &read_mesh(&path, &mut Vec::new()).unwrap()).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), first, "{extension}");
    }
}

#[test]
fn truncated_and_scrambled_files_are_errors() {
    let mesh = sample();
    for extension in ["vtu", "vtk", "msh", "cutis"] {
        let path = scratch(&format!("whole.{extension}"));
        write_mesh(&path, &mesh).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let cut = scratch(&format!("cut.{extension}"));
        for k in 0..60 {
            let end = bytes.len() * k / 60;
            std::fs::write(&cut, &bytes[..end]).unwrap();
            assert!(
                read_mesh(&cut, &mut Vec::new()).is_err() || end > bytes.len() * 9 / 10,
                "{extension} cut at {end}"
            );
        }
        for k in 0..200usize {
            let mut bad = bytes.clone();
            let at = k.wrapping_mul(7919) % bad.len().min(4000);
            bad[at] = bad[at].wrapping_add(1 + (k % 250) as u8);
            std::fs::write(&cut, &bad).unwrap();
            let _ = read_mesh(&cut, &mut Vec::new());
        }
    }
}

#[test]
fn baked_errors_are_distinct() {
    let path = Path::new("a.cutis");
    let bytes = encode(&sample());
    assert_eq!(decode(&bytes, path).unwrap(), sample());
    assert!(matches!(decode(&bytes[..bytes.len() - 1], path), Err(IoError::Truncated { .. })));
    assert!(matches!(decode(&bytes[..20], path), Err(IoError::Truncated { .. })));
    assert!(matches!(decode(b"PK\x03\x04 something", path), Err(IoError::NotBaked { .. })));
    let change = |at: usize, value: u8| {
        let mut b = bytes.clone();
        b[at] = value;
        b
    };
    assert!(matches!(decode(&change(8, 9), path), Err(IoError::TooNew { found: 9, .. })));
    assert!(matches!(decode(&change(200, bytes[200] ^ 1), path), Err(IoError::Corrupt { .. })));
    assert!(matches!(decode(&change(23, 255), path), Err(IoError::Truncated { .. })));
}

#[test]
fn lying_counts_do_not_allocate() {
    let path = scratch("liar.vtk");
    let text = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 99999999999999 double\n0 0 0\n";
    std::fs::write(&path, text).unwrap();
    assert!(matches!(read_mesh(&path, &mut Vec::new()), Err(IoError::Truncated { .. })));
    let path = scratch("liar.msh");
    std::fs::write(&path, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n18446744073709551615\n1 0 0 0\n").unwrap();
    assert!(matches!(read_mesh(&path, &mut Vec::new()), Err(IoError::Truncated { .. })));
}

const FOREIGN_MSH2: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 7 \"skin\"\n3 9 \"my tissue\"\n$EndPhysicalNames\n\
$Nodes\n5\n10 0 0 0\n20 1 0 0\n30 0 1 0\n40 0 0 1\n50 9 9 9\n$EndNodes\n$Elements\n3\n1 15 2 0 1 50\n2 2 2 7 1 10 30 20\n3 4 2 9 1 10 20 30 40\n$EndElements\n";

const FOREIGN_VTK: &str = "# vtk DataFile Version 5.1\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\n\
METADATA\nINFORMATION 0\n\nCELLS 3 7\nOFFSETS vtktypeint64\n0 3 7\nCONNECTIVITY vtktypeint64\n0 1 2 0 1 2 3\nCELL_TYPES 2\n5\n10\n\
CELL_DATA 2\nSCALARS region int 1\nLOOKUP_TABLE default\n3\n8\n";

#[test]
fn foreign_files_are_read() {
    let path = scratch("foreign.msh");
    std::fs::write(&path, FOREIGN_MSH2).unwrap();
    let mesh = read_mesh(&path, &mut Vec::new()).unwrap();
    assert_eq!((mesh.nodes.len(), mesh.tets.len()), (4, 1));
    assert_eq!(mesh.region_names, ["my tissue"]);
    assert_eq!(mesh.face_sets[0].triangles, [[0, 2, 1]]);
    let path = scratch("foreign.vtk");
    std::fs::write(&path, FOREIGN_VTK).unwrap();
    let mesh = read_mesh(&path, &mut Vec::new()).unwrap();
    assert_eq!((mesh.tets.len(), mesh.region_names[0].as_str()), (1, "region_8"));
    assert!(mesh.face_sets.is_empty());
}

#[test]
fn surfaces_are_read_and_baked() {
    let wanted = FineSkin {
        vertices: [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5], [1.0, 1.0, 0.0]].map(Vec3::from).to_vec(),
        triangles: vec![[0, 1, 2], [1, 3, 2]],
    };
    // A point that no triangle uses, and a line that is none.
    let vtk = "# vtk DataFile Version 3.0\nface\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n9 9 9\n0 0 0\n1 0 0\n\
               0 1 0.5\n1 1 0\nCELLS 3 11\n3 1 2 3\n2 1 2\n3 2 4 3\nCELL_TYPES 3\n5\n3\n5\n";
    let msh = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 1 \"skin\"\n2 2 \"other\"\n$EndPhysicalNames\n\
               $Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0.5\n4 1 1 0\n5 3 3 3\n$EndNodes\n$Elements\n3\n1 2 2 1 1 1 2 3\n\
               2 2 2 1 1 2 4 3\n3 2 2 2 2 1 2 5\n$EndElements\n";
    for (name, text) in [("surface.vtk", vtk), ("surface.msh", msh)] {
        let path = scratch(name);
        std::fs::write(&path, text).unwrap();
        assert_eq!(read_surface(&path, &mut Vec::new()).unwrap(), wanted, "{name}");
    }
    let mesh = TetMesh { fine_skin: Some(wanted.clone()), ..sample() };
    assert_eq!(decode(&encode(&mesh), Path::new("baked")).unwrap(), mesh);
    let path = scratch("no_surface.vtk");
    std::fs::write(&path, vtk.replace("\n5\n3\n5\n", "\n3\n3\n3\n").replace("3 1 2 3", "2 1 2")).unwrap();
    assert!(read_surface(&path, &mut Vec::new()).unwrap_err().to_string().contains("triangles"));
    let torn = TetMesh { fine_skin: Some(FineSkin { triangles: vec![[0, 1, 9]], ..wanted }), ..sample() };
    assert!(torn.checked().is_err());
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::new();
    for chunk in bytes.chunks(3) {
        let word = chunk.iter().enumerate().fold(0u32, |w, (k, &b)| w | u32::from(b) << (16 - 8 * k));
        for k in 0..4 {
            out.push(if k > chunk.len() { '=' } else { DIGITS[(word >> (18 - 6 * k) & 63) as usize] as char });
        }
    }
    out
}

#[test]
fn vtu_of_other_writers_is_read() {
    let points: Vec<u8> =
        [0f32, 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.].iter().flat_map(|x| x.to_le_bytes()).collect();
    let plain = |bytes: &[u8]| base64(&[&(bytes.len() as u32).to_le_bytes(), bytes].concat());
    let zlib = |bytes: &[u8]| {
        let mut packer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
        std::io::Write::write_all(&mut packer, bytes).unwrap();
        let packed = packer.finish().unwrap();
        let head = [1, bytes.len() as u32, 0, packed.len() as u32].map(u32::to_le_bytes).concat();
        base64(&head) + &base64(&packed)
    };
    let corners: Vec<u8> = [0i32, 1, 2, 3].iter().flat_map(|x| x.to_le_bytes()).collect();
    let offsets: Vec<u8> = 4i32.to_le_bytes().to_vec();
    let file = |compressor: &str, format: &str, arrays: [String; 4]| {
        let [points, corners, offsets, types] = arrays;
        format!(
            "<?xml version=\"1.0\"?><VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\"{compressor}><UnstructuredGrid>\
             <Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><PointData/><Points><DataArray type=\"Float32\" Name=\"Points\" NumberOfComponents=\"3\" format=\"{format}\">{points}</DataArray></Points>\
             <Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"{format}\">{corners}</DataArray><DataArray type=\"Int32\" Name=\"offsets\" format=\"{format}\">{offsets}</DataArray>\
             <DataArray type=\"UInt8\" Name=\"types\" format=\"{format}\">{types}</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>\n"
        )
    };
    let ascii = ["0 0 0 1 0 0 0 1 0 0 0 1", "0 1 2 3", "4", "10"].map(String::from);
    let packer = " compressor=\"vtkZLibDataCompressor\"";
    let texts = [
        file("", "ascii", ascii),
        file("", "binary", [plain(&points), plain(&corners), plain(&offsets), plain(&[10])]),
        file(packer, "binary", [zlib(&points), zlib(&corners), zlib(&offsets), zlib(&[10])]),
    ];
    for (k, text) in texts.iter().enumerate() {
        let path = scratch(&format!("other{k}.vtu"));
        std::fs::write(&path, text).unwrap();
        let mesh = read_mesh(&path, &mut Vec::new()).unwrap();
        assert_eq!(mesh.tets, [[0, 1, 2, 3]]);
        assert_eq!(mesh.nodes[3], Vec3::new(0.0, 0.0, 1.0));
        assert_eq!(mesh.region_names, ["tissue"]);
    }
}

#[test]
fn results_carry_their_fields() {
    let mesh = sample();
    let u: Vec<f64> = (0..3 * mesh.nodes.len()).map(|k| k as f64).collect();
    let path = scratch("result.vtu");
    write_vtu(&path, &mesh, &mesh.nodes, &[Data { name: "u", components: 3, values: &u }], &[]).unwrap();
    assert_eq!(read_mesh(&path, &mut Vec::new()).unwrap(), mesh);
    write_pvd(&scratch("result.pvd"), &[(0.0, 0, "result.vtu".into()), (0.0, 1, "tool.vtp".into())]).unwrap();
    let index = std::fs::read_to_string(scratch("result.pvd")).unwrap();
    assert!(index.contains("timestep=\"0\" group=\"\" part=\"1\" file=\"tool.vtp\""), "{index}");
    write_vtp(&scratch("tool.vtp"), &mesh.nodes[..4], &[[0, 1, 2], [0, 2, 3]], &[]).unwrap();
    let tool = std::fs::read_to_string(scratch("tool.vtp")).unwrap();
    let numbers: Vec<f64> = tool.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let points: Vec<f64> = mesh.nodes[..4].iter().flat_map(|x| [x.x, x.y, x.z]).collect();
    assert_eq!(numbers, [&points[..], &[0.0, 1.0, 2.0, 0.0, 2.0, 3.0, 3.0, 6.0]].concat());
}

#[test]
fn baked_model_of_50k_tets_reads_fast() {
    let spec = Block {
        origin: Vec3::zeros(),
        size: Vec3::repeat(0.1),
        cells: [20, 20, 21],
        pattern: Pattern::Six,
        layers: vec![],
    };
    let mesh = block(&spec).unwrap();
    assert!(mesh.tets.len() > 50_000);
    let bytes = encode(&mesh);
    let start = std::time::Instant::now();
    decode(&bytes, Path::new("a.cutis")).unwrap();
    let ms = start.elapsed().as_secs_f64() * 1e3;
    assert!(ms < 50.0, "{ms} ms");
}

/// Found by the fuzzer: volumes that are positive on paper, but no element has an inverse with them.
#[test]
fn elements_that_are_flat_to_rounding_or_beyond_all_numbers_are_refused() {
    for (scale, height) in [(1.0, 1e-17), (1e-110, 1e-110), (1e120, 1e120)] {
        let nodes = [[0.0; 3], [scale, 0.0, 0.0], [0.0, scale, 0.0], [0.0, 0.0, height]].map(Vec3::from).to_vec();
        let tissue = vec!["tissue".to_string()];
        let mesh =
            TetMesh { nodes, tets: vec![[0, 1, 2, 3]], region: vec![0], region_names: tissue, ..TetMesh::default() };
        let told = mesh.checked().unwrap_err().to_string();
        assert!(told.contains("must be positive"), "{scale} {height}: {told}");
    }
}
