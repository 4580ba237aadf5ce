//! Foreign meshes and surfaces: Gmsh, VTK legacy, VTU. What is read can be written in every format and read again.
//!
//! First byte: the format; the rest is the file.

use std::path::PathBuf;

use cutis::io::{read_mesh, read_surface, write_mesh};

use super::baked;

const EXTENSIONS: [&str; 3] = ["msh", "vtk", "vtu"];

/// A folder of this process, in memory where the system has such a place.
pub fn folder() -> PathBuf {
    let memory = PathBuf::from("/dev/shm");
    let base = if memory.is_dir() { memory } else { std::env::temp_dir() };
    let folder = base.join(format!("cutis-fuzz-{}-{:?}", std::process::id(), std::thread::current().id()));
    std::fs::create_dir_all(&folder).expect("a folder for files");
    folder
}

pub fn once(data: &[u8]) {
    let Some((&kind, file)) = data.split_first() else { return };
    let extension = EXTENSIONS[usize::from(kind) % EXTENSIONS.len()];
    let path = folder().join("in").with_extension(extension);
    std::fs::write(&path, file).expect("room for a file");
    let _ = read_surface(&path, &mut Vec::new());
    let Ok(mesh) = read_mesh(&path, &mut Vec::new()) else { return };
    for extension in ["cutis", "vtk", "vtu", "msh"] {
        let path = folder().join("out").with_extension(extension);
        // A name may be more than a format can hold.
        if write_mesh(&path, &mesh).is_err() {
            continue;
        }
        let again = read_mesh(&path, &mut Vec::new())
            .unwrap_or_else(|why| panic!("what was written as .{extension} is refused: {why}"));
        assert_eq!(again.tets, mesh.tets, "tetrahedra change on their way through .{extension}");
        let bits = |m: &cutis::mesh::TetMesh| -> Vec<u64> {
            m.nodes.iter().flat_map(|x| x.iter().map(|c| c.to_bits()).collect::<Vec<_>>()).collect()
        };
        assert_eq!(bits(&again), bits(&mesh), "nodes change on their way through .{extension}");
    }
}

pub fn seeds() -> Vec<Vec<u8>> {
    let mesh = cutis::mesh::TetMesh { fine_skin: None, ..baked::mesh() };
    let mut all = Vec::new();
    for (kind, extension) in EXTENSIONS.iter().enumerate() {
        let path = folder().join("seed").with_extension(extension);
        write_mesh(&path, &mesh).expect("a sound mesh");
        all.push([&[kind as u8][..], &std::fs::read(&path).expect("just written")].concat());
    }
    let old = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"fat\"\n$EndPhysicalNames\n$Nodes\n4\n1 0 0 0\n\
               2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n2\n1 2 2 1 1 1 2 3\n2 4 2 1 1 1 2 3 4\n$EndElements\n";
    let new = "# vtk DataFile Version 5.1\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0 1 0 0 0 1 0 0 0 1\n\
               CELLS 2 4\nOFFSETS vtktypeint64\n0 4\nCONNECTIVITY vtktypeint64\n0 1 2 3\nCELL_TYPES 1\n10\n";
    let text = "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\
                <UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><Points><DataArray type=\"Float64\" \
                NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells><DataArray \
                type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray><DataArray type=\"Int64\" \
                Name=\"offsets\" format=\"ascii\">4</DataArray><DataArray type=\"UInt8\" Name=\"types\" \
                format=\"ascii\">10</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>";
    all.extend([(0u8, old), (1, new), (2, text)].map(|(kind, text)| [&[kind][..], text.as_bytes()].concat()));
    all
}
