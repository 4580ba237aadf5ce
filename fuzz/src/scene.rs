//! Scene text: loads or is refused; what loads takes a step or refuses it.

use std::path::Path;
use std::sync::Arc;

use cutis::load;
use cutis::scene::{MeshSource, SceneFile, SkinSource};
use cutis::sim::Sim;

use super::scenes;

/// Larger blocks are left out: they are slow, not wrong.
const MOST_CELLS: f64 = 60.0;

pub fn once(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    if !is_small(text) {
        return;
    }
    // No file is found in a folder that is not there.
    let Ok(loaded) = load::from_text(text, Some(Path::new("/nowhere"))) else { return };
    if let Ok(mut sim) = Sim::new(Arc::new(loaded.model)) {
        scenes::exercise(&mut sim, 0.01);
    }
}

fn is_small(text: &str) -> bool {
    let Ok(file) = SceneFile::parse(text) else { return true };
    let mesh = match file.mesh_source(text) {
        Ok(MeshSource::Block { cells, .. }) => cells.iter().map(|&c| c as f64).product::<f64>() <= MOST_CELLS,
        Ok(MeshSource::File(name)) => !Path::new(&name).is_absolute(),
        Ok(_) => false,
        Err(_) => true,
    };
    let skin = match file.skin_source(text) {
        Ok(Some(SkinSource::File(name))) => !Path::new(&name).is_absolute(),
        Ok(Some(SkinSource::Subdivided(times))) => times < 3,
        Ok(Some(_)) => false,
        Ok(None) | Err(_) => true,
    };
    mesh && skin
}

pub fn seeds() -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenes");
    let mut files: Vec<_> = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path()).collect();
    files.retain(|p| p.extension().is_some_and(|e| e == "toml"));
    files.sort();
    let smaller =
        |text: String| text.replace("cells = [6, 4, 2]", "cells = [3, 2, 1]").replace("[12, 8, 4]", "[3, 2, 1]");
    let shipped = files.iter().filter_map(|p| std::fs::read_to_string(p).ok()).map(smaller);
    shipped.chain(scenes::texts()).map(String::into_bytes).collect()
}
