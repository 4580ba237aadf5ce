//! `cutis check`: what a scene holds.

use std::path::PathBuf;
use std::sync::Arc;

use cutis::load;
use cutis::sim::{Contact, Model, Sim};

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
        for (b, bone) in model.parts().bones.iter().enumerate() {
            let contacts: Vec<&Contact> = model.parts().contacts.iter().filter(|c| c.bone == b).collect();
            let nodes = bone.nodes.len() - contacts.iter().map(|c| c.frame.len()).sum::<usize>();
            let carries: String = contacts.iter().map(|c| format!(", carries contact {}", c.name)).collect();
            say!("  bone {}: {nodes} nodes, {}{carries}", bone.name, bone.drive);
        }
        for marker in &model.parts().markers {
            say!("  marker {}: {:.2} mm from the place asked for", marker.name, 1e3 * marker.off);
        }
        say!("{:>6}  {:<28} {:<12} {:<6} direction", "ref", "variable", "shape", "unit");
        for p in model.ports() {
            say!("{:>6}  {:<28} {:<12} {:<6} {:?}", p.reference, p.name, format!("{:?}", p.shape), p.unit, p.causality);
        }
        let warnings = model.warnings().to_vec();
        if model.is_reduced() {
            tell_modes(loaded.model)?;
        }
        for warning in warnings {
            say!("warning: {warning}");
        }
        Ok(())
    }
}

/// What the modes of a scene hold, and what they leave out.
fn tell_modes(model: Model) -> super::Done {
    let Some(spectrum) = Sim::new(Arc::new(model))?.spectrum()? else { return Ok(()) };
    let f = &spectrum.frequencies;
    let (first, last) = (f.first().copied().unwrap_or(0.0), f.last().copied().unwrap_or(0.0));
    let left_out = spectrum.left_out.map_or("none is left out".into(), |f| format!("the next one has {f:.2} Hz"));
    let [x, y, z] = spectrum.mass_share.map(|s| 100.0 * s);
    say!("{} modes from {first:.2} to {last:.2} Hz, {left_out}", f.len());
    say!("  they move {x:.1}, {y:.1} and {z:.1} % of the free mass with bones along x, y and z");
    Ok(())
}
