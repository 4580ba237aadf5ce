//! `cutis check`: what a scene holds.

use std::path::PathBuf;

use cutis::load;

#[derive(clap::Args)]
pub struct Check {
    /// Scene file (TOML)
    scene: PathBuf,
}

impl Check {
    pub fn run(self) -> super::Done {
        let loaded = load::from_file(&self.scene)?;
        let model = &loaded.model;
        let mesh = model.mesh();
        say!("{}: {} nodes, {} tets, token {}", model.name(), mesh.nodes.len(), mesh.tets.len(), model.token());
        let volume: f64 = (0..mesh.tets.len()).map(|e| mesh.volume(e)).sum();
        say!("volume {:.2} mL", 1e6 * volume);
        for (r, name) in mesh.region_names.iter().enumerate() {
            say!("  region {name}: {} tets", mesh.region.iter().filter(|&&x| x as usize == r).count());
        }
        for set in &mesh.face_sets {
            say!("  faces {}: {} triangles", set.name, set.triangles.len());
        }
        if let Some(skin) = model.skin().embedding() {
            say!("  fine skin: {} vertices, at most {:.2e} m outside the mesh", skin.len(), skin.farthest);
        }
        for bone in &model.parts().bones {
            say!("  bone {}: {} nodes, {}", bone.name, bone.nodes.len(), bone.drive);
        }
        say!("{:>6}  {:<28} {:<12} {:<6} direction", "ref", "variable", "shape", "unit");
        for p in model.ports() {
            say!("{:>6}  {:<28} {:<12} {:<6} {:?}", p.reference, p.name, format!("{:?}", p.shape), p.unit, p.causality);
        }
        for warning in model.warnings() {
            say!("warning: {warning}");
        }
        Ok(())
    }
}
