//! A baked model in a scene: loads or is refused; what loads survives writing and reading, and takes a step.
//!
//! Even first byte: edits to a sound file, whose checksum is then put right. Odd: the bytes are the file.

use std::path::Path;
use std::sync::Arc;

use cutis::geometry::{Block, Pattern, block};
use cutis::io;
use cutis::load::Baked;
use cutis::math::Vec3;
use cutis::mesh::{FineSkin, TetMesh};
use cutis::sim::Sim;
use sha2::{Digest, Sha256};

use super::scenes;
use super::taste::{Taste, edited};

/// Bytes before the payload, and where in them its length and checksum stand.
const HEADER: usize = 56;
const LENGTH: usize = 16;
const CHECKSUM: usize = 24;

pub fn once(data: &[u8]) {
    let mut taste = Taste(data);
    let file = if taste.byte().is_multiple_of(2) { sealed(edited(payload(), &mut taste)) } else { taste.0.to_vec() };
    let Ok(mesh) = io::decode(&file, Path::new("model.cutis")) else { return };
    assert!(io::decode(&io::encode(&mesh), Path::new("again.cutis")).unwrap() == mesh, "a mesh changes on its way");
    if mesh.tets.len() > 200 {
        return;
    }
    let scene = "[mesh]\nfile = \"model.cutis\"\n[[tissue]]\nE = 15e3\nnu = 0.4\n[[bone]]\nname = \"skull\"\n\
                 nodes = \"x_min\"\n[[bone]]\nname = \"jaw\"\nnodes = \"x_max\"\n";
    let Ok(loaded) = (Baked { scene: scene.to_owned(), mesh: file, notes: Vec::new() }).load() else { return };
    if let Ok(mut sim) = Sim::new(Arc::new(loaded.model)) {
        scenes::exercise(&mut sim, 0.01);
    }
}

pub fn mesh() -> TetMesh {
    let size = Vec3::new(0.03, 0.02, 0.01);
    let mut mesh =
        block(&Block { origin: Vec3::zeros(), size, cells: [3, 2, 1], pattern: Pattern::Six, layers: Vec::new() })
            .expect("a block");
    mesh.fine_skin = Some(FineSkin::of(&mesh).subdivided());
    mesh
}

fn payload() -> Vec<u8> {
    io::encode(&mesh())[HEADER..].to_vec()
}

/// A file with the checksum that its payload wants.
fn sealed(payload: Vec<u8>) -> Vec<u8> {
    let mut file = io::encode(&TetMesh::default())[..HEADER].to_vec();
    file[LENGTH..CHECKSUM].copy_from_slice(&(payload.len() as u64).to_le_bytes());
    file[CHECKSUM..].copy_from_slice(&Sha256::digest(&payload));
    file.extend(payload);
    file
}

pub fn seeds() -> Vec<Vec<u8>> {
    let whole = [&[1][..], &io::encode(&mesh())].concat();
    vec![whole, vec![0], vec![0, 4, 4, 0, 0, 2], vec![0, 3, 12, 0, 7], vec![0, 6, 200, 0]]
}
