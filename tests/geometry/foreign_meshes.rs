//! Meshes as other programs write them: read as they are meant, mended and told, or refused and the reason named.
//!
//! The files of `vtk/` hold one little mesh, written by VTK 9.7 (in all its encodings), pyvista 0.49 and meshio 5.3.
use std::path::Path;

use cutis::geometry::{Block, Pattern, block};
use cutis::io::{IoError, read_mesh, write_mesh};
use cutis::load;
use cutis::math::Vec3;
use cutis::mesh::TetMesh;

use super::mesh_files::scratch;

fn read_at(path: &Path) -> (Result<TetMesh, IoError>, String) {
    let mut notes = Vec::new();
    let mesh = read_mesh(path, &mut notes);
    (mesh, notes.join("; "))
}

fn read(name: &str, text: impl AsRef<[u8]>) -> (Result<TetMesh, IoError>, String) {
    let path = scratch(name);
    std::fs::write(&path, text).unwrap();
    read_at(&path)
}

#[test]
fn vtk_files_of_today_are_read_in_every_encoding() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/geometry/vtk");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    assert_eq!(files.len(), 11);
    for path in files {
        let (mesh, notes) = read_at(&path);
        let mesh = mesh.unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(mesh.nodes[4], Vec3::repeat(0.1), "{}", path.display());
        assert_eq!(mesh.tets, [[0, 1, 2, 3], [1, 4, 2, 3]], "{}", path.display());
        assert_eq!((&mesh.region[..], mesh.region_names.join(" ")), (&[0, 1][..], "region_4 region_7".into()));
        assert_eq!(mesh.node_set("skull").unwrap().nodes, [0, 2]);
        assert_eq!(mesh.face_set("skin").unwrap().triangles, [[0, 2, 1], [1, 2, 4]], "{}", path.display());
        assert_eq!(notes, "", "{}", path.display());
        let bytes = std::fs::read(&path).unwrap();
        for end in (0..bytes.len() - 30).step_by(97) {
            let cut = read(&format!("cut.{}", path.extension().unwrap().display()), &bytes[..end]);
            assert!(cut.0.is_err() || path.extension().is_some_and(|e| e == "vtk"), "{} cut at {end}", path.display());
        }
    }
}

/// A `.vtu` of one tetrahedron in text, changed.
fn vtu(changes: &[(&str, &str)]) -> (Result<TetMesh, IoError>, String) {
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n\
         <FieldData>\n</FieldData>\n<Piece NumberOfPoints=\"4\" NumberOfCells=\"2\">\n<PointData>\n</PointData>\n<CellData>\n\
         <DataArray type=\"Int32\" Name=\"region\" format=\"ascii\">5 5</DataArray>\n</CellData>\n<Points>\n\
         <DataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 .1 0 0 0 .1 0 0 0 .1</DataArray>\n\
         </Points>\n<Cells>\n<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3 0 1 2</DataArray>\n\
         <DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4 7</DataArray>\n\
         <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10 5</DataArray>\n</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
    );
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    read("changed.vtu", text)
}

#[test]
fn vtu_fields_are_honoured_or_named() {
    let told = |changes: &[(&str, &str)], words: &[&str]| {
        let (mesh, notes) = vtu(changes);
        let mesh = mesh.unwrap_or_else(|e| panic!("{changes:?}: {e}"));
        assert!(words.iter().all(|w| notes.contains(w)), "{changes:?}: {notes}");
        mesh
    };
    let refused = |changes: &[(&str, &str)], word: &str| {
        let (mesh, notes) = vtu(changes);
        let message = mesh.map(|_| format!("taken with {notes}")).unwrap_or_else(|e| e.to_string());
        assert!(message.contains(word), "{changes:?}: {message}");
    };
    assert_eq!(told(&[], &["1 triangles belong to no face set"]).region_names, ["region_5"]);
    // Regions of another name are told, meshio's are taken.
    assert_eq!(
        told(&[("\"region\"", "\"MaterialIds\"")], &["one region `tissue`", "`MaterialIds`"]).region_names,
        ["tissue"]
    );
    assert_eq!(told(&[("\"region\"", "\"gmsh:physical\"")], &["gmsh:physical"]).region_names, ["region_5"]);
    refused(&[(">5 5<", ">5.5 5<"), ("Int32\" Name=\"region", "Float32\" Name=\"region")], "cell data `region`");
    refused(&[(">5 5<", "><")], "too few values");
    refused(&[("\"region\"", "\"vtkGhostType\""), (">5 5<", ">1 0<")], "vtkGhostType");
    told(&[("\"region\"", "\"vtkGhostType\""), (">5 5<", ">0 0<")], &[]);
    // Faces in cell data, and field data that are none.
    let faces = told(&[("\"region\"", "\"faces:skin\""), (">5 5<", ">0 1<")], &["turned"]);
    assert_eq!(faces.face_set("skin").unwrap().triangles, [[0, 2, 1]]);
    let field = |values: &str| {
        format!("<FieldData>\n<DataArray type=\"Int32\" Name=\"faces:a\" format=\"ascii\">{values}</DataArray>")
    };
    refused(&[("<FieldData>", &field("0 1"))], "faces:a");
    refused(&[("<FieldData>", &field("0 1 9"))], "face set `a`");
    // What other versions and writers put there.
    told(&[("<?xml", "\u{feff}<?xml"), ("\n", "\r\n")], &[]);
    told(&[("<FieldData>\n</FieldData>", "<Empty/>"), ("<PointData>", "<PointData><!-- no data -->")], &[]);
    told(
        &[(
            "10 5<",
            "10 5<InformationKey name=\"R\" location=\"L\" length=\"1\"><Value index=\"0\">7 7</Value></InformationKey><",
        )],
        &[],
    );
    told(
        &[(
            "<Piece",
            "<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\"/></Points></Piece><Piece",
        )],
        &[],
    );
    refused(&[("</Piece>", "</Piece><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"></Piece>")], "2 pieces");
    refused(&[("NumberOfPoints=\"4\"", "NumberOfPoints=\"5\"")], "NumberOfPoints");
    refused(&[("NumberOfCells=\"2\"", "NumberOfCells=\"1\"")], "NumberOfCells");
    refused(&[("LittleEndian", "MiddleEndian")], "byte_order");
    refused(&[("version=\"1.0\" byte", "header_type=\"UInt16\" byte")], "header_type");
    refused(&[("version=\"1.0\" byte", "compressor=\"vtkLZ4DataCompressor\" byte")], "vtkLZ4DataCompressor");
    refused(&[("UnstructuredGrid\" v", "PolyData\" v")], "PolyData");
    refused(&[("NumberOfComponents=\"3\"", "NumberOfComponents=\"2\"")], "components");
    refused(&[("10 5<", "24 5<")], "order = 2");
    refused(&[("10 5<", "12 5<")], "type 12");
    assert!(
        told(&[("10 5<", "10 9<"), ("4 7<", "4 8<"), ("2 3 0 1 2", "2 3 0 1 2 3")], &["VTK type 9"])
            .face_sets
            .is_empty()
    );
    refused(&[("0 1 2 3 0 1 2", "0 1 2 3 0 1 8")], "cell 1");
    refused(
        &[
            ("Int64\" Name=\"off", "Bit\" Name=\"off"),
            ("\"offsets\" format=\"ascii\">4 7", "\"offsets\" format=\"binary\">AQAAAAQ="),
        ],
        "Bit",
    );
}

fn sample() -> TetMesh {
    let spec = Block {
        origin: Vec3::zeros(),
        size: Vec3::new(0.06, 0.04, 0.02),
        cells: [3, 2, 2],
        pattern: Pattern::Six,
        layers: vec![("dermis".into(), 0.5)],
    };
    block(&spec).unwrap()
}

/// A mesh in the 2.2 format, where an element of two groups stands there twice.
fn msh2(mesh: &TetMesh, groups: &dyn Fn(usize) -> Vec<usize>, triangles: &[(usize, [u32; 3])]) -> String {
    let mut out = format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n4\n3 1 \"fat\"\n3 2 \"all\"\n2 3 \"skin\"\n2 4 \"skull\"\n$EndPhysicalNames\n\
         $Nodes\n{}\n",
        mesh.nodes.len()
    );
    mesh.nodes.iter().enumerate().for_each(|(a, x)| out += &format!("{} {} {} {}\n", a + 1, x.x, x.y, x.z));
    let mut rows: Vec<String> = Vec::new();
    for (e, t) in mesh.tets.iter().enumerate() {
        groups(e).iter().for_each(|g| rows.push(format!("4 2 {g} {g} {}", t.map(|a| (a + 1).to_string()).join(" "))));
    }
    triangles.iter().for_each(|(g, t)| rows.push(format!("2 2 {g} {g} {}", t.map(|a| (a + 1).to_string()).join(" "))));
    out += &format!("$EndNodes\n$Elements\n{}\n", rows.len());
    rows.iter().enumerate().for_each(|(k, row)| out += &format!("{} {row}\n", k + 1));
    out + "$EndElements\n"
}

#[test]
fn what_is_listed_twice_counts_once() {
    let mesh = sample();
    let n = mesh.tets.len();
    let skin = &mesh.face_set("skin").unwrap().triangles;
    let faces: Vec<_> = skin.iter().map(|t| (3, *t)).collect();
    let (plain, notes) = read("plain.msh", msh2(&mesh, &|_| vec![1], &faces));
    let plain = plain.unwrap();
    assert_eq!((plain.tets.len(), notes.as_str()), (n, ""));
    for (groups, note) in [(vec![1, 2], "regions `fat` and `all`: the first counts"), (vec![1, 1], "in region `fat`")] {
        let (twice, notes) = read("twice.msh", msh2(&mesh, &|_| groups.clone(), &faces));
        let twice = twice.unwrap();
        assert_eq!(
            (&twice.tets, &twice.region, &twice.face_sets[0]),
            (&plain.tets, &plain.region, &plain.face_sets[0])
        );
        assert!(notes.contains(&format!("{n} tetrahedra are listed twice")) && notes.contains(note), "{notes}");
    }
    let doubled = [&faces[..], &faces].concat();
    let (twice, notes) = read("twice.msh", msh2(&mesh, &|_| vec![1], &doubled));
    assert_eq!(twice.unwrap().face_sets, plain.face_sets);
    assert!(notes.contains(&format!("{} triangle(s) of the face set `skin` are listed twice", skin.len())), "{notes}");
}

#[test]
fn faces_are_wound_by_the_tissue_behind_them() {
    let mesh = sample();
    let skin = &mesh.face_set("skin").unwrap().triangles;
    let inward: Vec<_> = skin.iter().map(|&[a, b, c]| (3, [b, a, c])).collect();
    let (turned, notes) = read("inward.msh", msh2(&mesh, &|_| vec![1], &inward));
    let normal = |mesh: &TetMesh, t: &[u32; 3]| {
        let x = t.map(|a| mesh.nodes[a as usize]);
        (x[1] - x[0]).cross(&(x[2] - x[0])).z
    };
    let turned = turned.unwrap();
    assert!(turned.face_set("skin").unwrap().triangles.iter().all(|t| normal(&turned, t) > 0.0));
    assert!(notes.contains(&format!("{} triangle(s) of the face set `skin` were wound inward", skin.len())), "{notes}");
    // A face between two tetrahedra, and three nodes that are no face.
    let inside = mesh.tets.iter().flat_map(|t| [[t[0], t[1], t[2]], [t[1], t[2], t[3]]]);
    let boundary: std::collections::BTreeSet<_> = mesh
        .boundary()
        .into_iter()
        .map(|mut t| {
            t.sort_unstable();
            t
        })
        .collect();
    let inside = inside
        .map(|mut t| {
            t.sort_unstable();
            t
        })
        .find(|t| !boundary.contains(t))
        .unwrap();
    let stray = [0, 1, mesh.nodes.len() as u32 - 1];
    let (mixed, notes) = read("mixed.msh", msh2(&mesh, &|_| vec![1], &[(3, inside), (3, stray), (3, skin[0])]));
    assert_eq!(mixed.unwrap().face_set("skin").unwrap().triangles.len(), 2);
    assert!(notes.contains("1 triangle(s) of the face set `skin` lie inside the tissue"), "{notes}");
    assert!(notes.contains("1 triangle(s) of the face set `skin` are no face of any tetrahedron"), "{notes}");
}

#[test]
fn torn_meshes_and_other_units_are_told() {
    let notes = |mesh: &TetMesh| {
        let path = scratch("doubtful.msh");
        write_mesh(&path, mesh).unwrap();
        read_at(&path).1
    };
    let plain = TetMesh { node_sets: Vec::new(), face_sets: Vec::new(), ..sample() };
    assert_eq!(notes(&plain), "");
    // One of the tetrahedra at an inner edge is cut in two at its middle; the others are not.
    let mut torn = plain.clone();
    let inner = |x: &Vec3| x.x > 0.001 && x.x < 0.059 && x.y > 0.001 && x.y < 0.039;
    let e =
        torn.tets.iter().position(|t| inner(&torn.nodes[t[0] as usize]) && inner(&torn.nodes[t[1] as usize])).unwrap();
    let [a, b, c, d] = torn.tets[e];
    let middle = torn.nodes.len() as u32;
    torn.nodes.push(0.5 * (torn.nodes[a as usize] + torn.nodes[b as usize]));
    torn.tets[e] = [a, middle, c, d];
    torn.tets.push([middle, b, c, d]);
    torn.region.push(torn.region[e]);
    assert!(notes(&torn).contains("1 node(s) hang on an edge or a face"), "{}", notes(&torn));
    // Nodes of the upper half doubled: two pieces that only touch.
    let mut parted = plain.clone();
    let n = parted.nodes.len();
    parted.nodes.extend(plain.nodes.clone());
    for (e, t) in parted.tets.iter_mut().enumerate() {
        if plain.region[e] == 0 {
            *t = t.map(|a| a + n as u32);
        }
    }
    assert!(notes(&parted).contains("2 pieces that share no node"), "{}", notes(&parted));
    for (scale, told) in [(1000.0, true), (10.0, false), (1e-3, true)] {
        let scaled = TetMesh { nodes: plain.nodes.iter().map(|x| x * scale).collect(), ..plain.clone() };
        assert_eq!(notes(&scaled).contains("no head"), told, "{scale}");
    }
}

#[test]
fn gmsh_sections_are_honoured_or_named() {
    let mesh = sample();
    let text = msh2(&mesh, &|e| vec![1 + e % 2], &[]);
    let told = |text: String, word: &str| {
        let (mesh, notes) = read("section.msh", text);
        assert!(
            mesh.is_ok() && notes.contains(word) && word.is_empty() == notes.is_empty(),
            "{word}: {notes}, {mesh:?}"
        );
    };
    let refused = |text: String, word: &str| {
        let (mesh, notes) = read("section.msh", text);
        let message = mesh.map(|_| format!("taken with {notes}")).unwrap_or_else(|e| e.to_string());
        assert!(message.contains(word), "{word}: {message}");
    };
    told(text.replace('\n', "\r\n"), "");
    told(format!("\u{feff}{text}"), "");
    told(text.clone() + "$Comments\nany words\n$EndComments\n", "");
    told(text.clone() + "$Strange\n1 2 3\n$EndStrange\n", "$Strange");
    told(text.replacen("4 2 1 1", "4 2 0 1", 3), "3 tetrahedra are in no physical volume");
    told(text.replace("4 2 1 1", "4 2 -1 1"), "");
    let element = |row: &str| {
        let (n, k) = (mesh.tets.len(), mesh.tets.len() + 1);
        text.replace(&format!("$Elements\n{n}\n"), &format!("$Elements\n{k}\n"))
            .replace("$EndElements", &format!("{k} {row}\n$EndElements"))
    };
    told(element("2 2 0 1 1 2 4"), "1 triangles are in no physical surface");
    told(element("3 2 3 1 1 2 3 4"), "1 quadrangles");
    told(element("1 2 3 1 1 2"), "1 lines");
    refused(element("11 2 1 1 1 2 3 4 5 6 7 8 9 10"), "order = 2");
    refused(text.replace("$Nodes", "$ParametricNodes").replace("$EndNodes", "$EndParametricNodes"), "ParametricNodes");
    let second = |number: usize| format!("\n{number} {} {} {}\n", mesh.nodes[1].x, mesh.nodes[1].y, mesh.nodes[1].z);
    refused(text.replace(&second(2), &second(1)), "node 1 twice");
    refused(text.replace("2.2 0 8", "2.2 1 8"), "Mesh.Binary = 0");
    refused(text.replace("2.2 0 8", "2.2 0 4"), "numbers of 4 bytes");
    refused(text.replace("2.2 0 8", "4.0 0 8"), "4.1 and 2.2");
    refused(text.replace("3 2 \"all\"", "3 1 \"all\""), "second name");
    refused(text.replace("\"all\"", "\"fat\""), "region sets are named `fat`");
}

const PARTS: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 7 \"fat\"\n$EndPhysicalNames\n$Entities\n0 0 0 1\n\
1 0 0 0 1 1 1 1 7 0\n$EndEntities\n$PartitionedEntities\n2\n0\n0 0 0 1\n2 3 1 1 2 0 0 0 1 1 1 1 -7 0\n$EndPartitionedEntities\n\
$Nodes\n1 4 1 4\n3 2 1 4\n1\n2\n3\n4\n0 0 0 .1 .2 .3\n.1 0 0 .1 .2 .3\n0 .1 0 .1 .2 .3\n0 0 .1 .1 .2 .3\n$EndNodes\n\
$Elements\n1 1 1 1\n3 2 4 1\n1 1 2 3 4\n$EndElements\n";

#[test]
fn parametric_nodes_and_partitions_are_read() {
    let (mesh, notes) = read("parts.msh", PARTS);
    let mesh = mesh.unwrap();
    assert_eq!(
        (mesh.nodes[3], mesh.region_names.join(" "), notes.as_str()),
        (Vec3::new(0.0, 0.0, 0.1), "fat".into(), "")
    );
}

#[test]
fn a_bone_takes_the_nodes_of_a_face_set() {
    let mesh = sample();
    let low: Vec<_> = mesh
        .boundary()
        .into_iter()
        .filter(|t| t.iter().all(|&a| mesh.nodes[a as usize].z == 0.0))
        .map(|t| (4, t))
        .collect();
    let skin = mesh.face_set("skin").unwrap().triangles.iter().map(|t| (3, *t));
    let faces: Vec<_> = low.iter().copied().chain(skin).collect();
    let (_, notes) = read("bones.msh", msh2(&mesh, &|_| vec![1], &faces));
    assert_eq!(notes, "");
    let scene = |bone: &str| {
        let text = format!(
            "name = \"b\"\n[mesh]\nfile = \"bones.msh\"\n[[tissue]]\nE = 15e3\nnu = 0.4\n[[bone]]\nname = \"base\"\nnodes = \"{bone}\"\n"
        );
        load::from_text(&text, Some(&scratch("")))
    };
    let held = scene("skull").unwrap_or_else(|e| panic!("{e}")).model;
    let wanted = mesh.nodes.iter().filter(|x| x.z == 0.0).count();
    assert_eq!(held.parts().bones[0].nodes.len(), wanted);
    let message = scene("jaw").err().unwrap().to_string();
    assert!(
        message.contains("no node set") && message.contains("face sets `skin`, `skull`") && message.contains("`none`"),
        "{message}"
    );
}

/// What was noticed of a file reaches the one who loads the scene, packs it, and loads the pack.
#[test]
fn notes_reach_the_model() {
    let mesh = sample();
    let skin: Vec<_> = mesh.face_set("skin").unwrap().triangles.iter().map(|t| (4, *t)).collect();
    std::fs::write(scratch("noted.msh"), msh2(&mesh, &|_| vec![1, 2], &skin)).unwrap();
    let text =
        "name = \"b\"\n[mesh]\nfile = \"noted.msh\"\n[[tissue]]\nE = 15e3\nnu = 0.4\n[[bone]]\nname = \"skull\"\n";
    let scene = scratch("noted.toml");
    std::fs::write(&scene, text).unwrap();
    let loaded = load::from_file(&scene).unwrap();
    assert!(loaded.model.warnings().iter().any(|w| w.contains("noted.msh") && w.contains("listed twice")));
    let baked = load::baked(&scene).unwrap();
    assert_eq!(baked.notes.len(), 1);
    assert!(baked.load().unwrap().model.warnings().iter().any(|w| w.contains("listed twice")));
    let pipe = scratch("folder.msh");
    std::fs::create_dir_all(&pipe).unwrap();
    assert!(read_at(&pipe).0.unwrap_err().to_string().contains("this is a folder"));
}
