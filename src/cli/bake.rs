//! `cutis bake`: from a head CT to a tissue mesh.

use std::path::PathBuf;

use cutis::geometry::{BakeOptions, bake};
use cutis::io::{self, LabelMap};
use cutis::math::Vec3;

use super::progress;

#[derive(clap::Args)]
pub struct Bake {
    /// CT of a head: NIfTI, NRRD, or a folder with a DICOM series
    volume: PathBuf,
    /// Labels of the same head: 2 skull, 3 mandible, 4 spine (NIfTI or NRRD)
    #[arg(short, long)]
    labels: Option<PathBuf>,
    /// Numbers of the labels file that stand for bones, for example skull=5,mandible=1 (a bone may have several)
    #[arg(long, requires = "labels", value_name = "BONE=NUMBER,...")]
    labels_map: Option<LabelMap>,
    /// Mesh to write: .cutis, .msh, .vtu or .vtk
    #[arg(short, long, default_value = "face.cutis")]
    out: PathBuf,
    /// Edge of the lattice cell, mm
    #[arg(long, default_value_t = 4.0, allow_negative_numbers = true)]
    edge: f64,
    /// Threshold of the skin, HU
    #[arg(long, default_value_t = -300.0, allow_negative_numbers = true)]
    skin: f64,
    /// Threshold of bone, HU
    #[arg(long, default_value_t = 250.0, allow_negative_numbers = true)]
    bone: f64,
    /// Region of interest, two corners in mm (LPS): x0 y0 z0 x1 y1 z1; found from the nose tip if left out
    #[arg(long, num_args = 6, allow_negative_numbers = true, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"])]
    roi: Option<Vec<f64>>,
    /// Box in which the closed mouth may be cut, two corners in mm (LPS); found from the teeth if left out
    #[arg(long, num_args = 6, allow_negative_numbers = true, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"])]
    mouth: Option<Vec<f64>>,
    /// Leave the lips closed
    #[arg(long)]
    no_slit: bool,
}

impl Bake {
    pub fn run(self) -> super::Done {
        // Before the work, not after it.
        io::check_mesh_target(&self.out)?;
        let mut notes = Vec::new();
        let volume = io::read_volume(&self.volume, &mut notes)?;
        let map = self.labels_map.unwrap_or_default();
        let labels = self.labels.as_deref().map(|path| io::read_labels(path, &map, &mut notes)).transpose()?;
        for note in &notes {
            eprintln!("warning: {note}");
        }
        for (option, mm) in [("--roi", &self.roi), ("--mouth", &self.mouth)] {
            if mm.iter().flatten().any(|v| !v.is_finite()) {
                return Err(format!(
                    "{option} takes six finite numbers in mm; found {:?}",
                    mm.as_deref().unwrap_or_default()
                )
                .into());
            }
        }
        if !(self.edge.is_finite() && self.edge > 0.0) {
            return Err(format!("--edge takes a length above 0 in mm; found {} mm", self.edge).into());
        }
        let corners = |mm: &Option<Vec<f64>>| {
            mm.as_ref().map(|c| [Vec3::new(c[0], c[1], c[2]) * 1e-3, Vec3::new(c[3], c[4], c[5]) * 1e-3])
        };
        let options = BakeOptions {
            skin_hu: self.skin,
            bone_hu: self.bone,
            roi: corners(&self.roi),
            edge: 1e-3 * self.edge,
            slit: !self.no_slit,
            mouth: corners(&self.mouth),
            ..BakeOptions::default()
        };
        let bar = progress::stages();
        let baked = bake(&volume, labels.as_ref(), &options, &mut |stage, share| {
            bar.set_message(stage.to_owned());
            bar.set_position((100.0 * share) as u64);
        })?;
        bar.finish_and_clear();
        for warning in &baked.warnings {
            eprintln!("warning: {warning}");
        }
        say!("{}", baked.report);
        for set in &baked.mesh.node_sets {
            say!("bone {:<12} {} nodes", set.name, set.nodes.len());
        }
        for layer in &baked.layers {
            say!("layer {:<11} {:.1} % of the volume", layer.name, 100.0 * layer.reached);
        }
        say!(
            "slit: {} nodes doubled; {} bone nodes released between two bones",
            baked.slit_nodes,
            baked.released_nodes
        );
        if let Some([right, left]) = baked.condyles {
            let p = 0.5 * (right + left);
            println!("jaw: the line for [[bone]] mandible, between the condyles:");
            println!("pivot = [{:.4}, {:.4}, {:.4}]", p.x, p.y, p.z);
        }
        io::write_mesh(&self.out, &baked.mesh)?;
        say!("wrote {}", self.out.display());
        Ok(())
    }
}
