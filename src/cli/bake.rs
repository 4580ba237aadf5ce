//! `cutis bake`: from a head CT to a tissue mesh.

use std::path::{Path, PathBuf};

use cutis::geometry::anatomy::Hints;
use cutis::geometry::{BakeOptions, Warning, bake};
use cutis::io::{self, LabelMap};

use super::bake_file::{BakeFile, Seed, metres, pair};
use super::bake_report::{json, levels, tell};
use super::fineness::Fineness;
use super::{portrait, progress};

#[derive(clap::Args)]
pub struct Bake {
    /// CT of a head: NIfTI, NRRD, or a folder with a DICOM series
    volume: PathBuf,
    /// Labels of the same head: 2 skull, 3 mandible, 4 spine, 6 hyoid (NIfTI or NRRD); without them the bones are found
    #[arg(short, long)]
    labels: Option<PathBuf>,
    /// Numbers of the labels file that stand for bones, for example skull=5,mandible=1 (a bone may have several)
    #[arg(long, requires = "labels", value_name = "BONE=NUMBER,...")]
    labels_map: Option<LabelMap>,
    /// Mesh to write: .cutis, .msh, .vtu or .vtk
    #[arg(short, long, default_value = "face.cutis")]
    out: PathBuf,
    #[command(flatten)]
    fineness: Fineness,
    /// Threshold of the skin, HU [default: -300]
    #[arg(long, allow_negative_numbers = true)]
    skin: Option<f64>,
    /// Threshold of bone, HU [default: 250]
    #[arg(long, allow_negative_numbers = true)]
    bone: Option<f64>,
    /// Region of interest, two corners in mm (LPS): x0 y0 z0 x1 y1 z1; found from the nose tip if left out
    #[arg(long, num_args = 6, allow_negative_numbers = true, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"])]
    roi: Option<Vec<f64>>,
    /// Box in which the closed mouth may be cut, two corners in mm (LPS); found from the teeth if left out
    #[arg(long, num_args = 6, allow_negative_numbers = true, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"])]
    mouth: Option<Vec<f64>>,
    /// Right and left condyle in mm (LPS), where they are not found
    #[arg(long, num_args = 6, allow_negative_numbers = true, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"])]
    hinge: Option<Vec<f64>>,
    /// Right and left corner of the mouth in mm (LPS), where they are not found
    #[arg(long, num_args = 6, allow_negative_numbers = true, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"])]
    commissures: Option<Vec<f64>>,
    /// Plane where the teeth meet, where it is not found: a point in mm (LPS) and the normal
    #[arg(long, num_args = 6, allow_negative_numbers = true, value_names = ["X", "Y", "Z", "NX", "NY", "NZ"])]
    occlusal: Option<Vec<f64>>,
    /// A place of a bone in mm (LPS), where the bones are not told apart: mandible=-22,-82,-80 (several times)
    #[arg(long, value_name = "BONE=X,Y,Z")]
    seed: Vec<Seed>,
    /// Settings of this scan (docs/ct.md); bake.toml beside the scan if left out and there
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Write the labels of the bones, to be mended and given back: .nii, .nii.gz
    #[arg(long, value_name = "FILE")]
    write_labels: Option<PathBuf>,
    /// Refuse bones and a hinge that fail a check
    #[arg(long)]
    strict: bool,
    /// Leave the lips closed
    #[arg(long)]
    no_slit: bool,
    /// Also write what the mesh is worth as JSON
    #[arg(long)]
    report: Option<PathBuf>,
    /// Draw no picture beside the mesh
    #[arg(long)]
    no_picture: bool,
}

impl Bake {
    pub fn run(self) -> super::Done {
        // Before the work, not after it.
        io::check_mesh_target(&self.out)?;
        self.write_labels.as_deref().map_or(Ok(()), io::check_labels_target)?;
        let file = BakeFile::of(&self.volume, self.settings.as_deref())?;
        let mut notes = Vec::new();
        let volume = io::read_volume(&self.volume, &mut notes)?;
        let map = self.labels_map.clone().unwrap_or_default();
        let labels = self
            .labels
            .as_deref()
            .or(file.labels.as_deref())
            .map(|path| io::read_labels(path, &map, &mut notes))
            .transpose()?;
        for note in &notes {
            eprintln!("warning: {note}");
        }
        let options = self.options(file)?;
        let bar = progress::stages();
        let baked = bake(&volume, labels.as_ref(), &options, &mut |stage, share| {
            bar.set_message(stage.to_owned());
            bar.set_position((100.0 * share) as u64);
        })?;
        bar.finish_and_clear();
        for warning in &baked.warnings {
            eprintln!("warning: {warning}");
        }
        for (k, level) in levels(&baked).enumerate() {
            if k > 0 {
                say!();
            }
            tell(level);
        }
        if let Some([right, left]) = baked.condyles {
            let p = 0.5 * (right + left);
            println!("jaw: the line for [[bone]] mandible, between the condyles:");
            println!("pivot = [{:.4}, {:.4}, {:.4}]", p.x, p.y, p.z);
        }
        for (k, level) in levels(&baked).enumerate() {
            let path = numbered(&self.out, k);
            io::write_mesh(&path, &level.mesh)?;
            say!("wrote {}", path.display());
        }
        if let Some(path) = &self.report {
            io::write_bytes(path, json(&baked).as_bytes())?;
            say!("wrote {}", path.display());
        }
        if !self.no_picture {
            let path = self.out.with_extension("png");
            io::write_bytes(&path, &portrait::of(&baked.finest.mesh).to_png())?;
            say!("wrote {}", path.display());
        }
        if let Some(path) = &self.write_labels {
            let Some(labels) = &baked.labels else {
                return Err(format!("{}: no labels were found that could be written", path.display()).into());
            };
            io::write_labels(path, labels)?;
            say!("wrote {}", path.display());
            if baked.warnings.contains(&Warning::JawNotFound) {
                eprintln!("warning: {}: these labels are not trusted and were not used", path.display());
            }
        }
        Ok(())
    }

    /// What the command line says, else the file, else what is usual.
    fn options(&self, file: BakeFile) -> Result<BakeOptions, Box<dyn std::error::Error>> {
        let usual = BakeOptions::default();
        self.fineness.checked()?;
        let places = |option: &str, line: &Option<Vec<f64>>, file: Option<[[f64; 3]; 2]>| {
            let pair = line.as_deref().and_then(pair).or(file);
            match pair.filter(|p| p.as_flattened().iter().any(|v| !v.is_finite())) {
                Some(found) => {
                    Err(format!("{option} takes six finite numbers in mm; found {:?}", found.as_flattened()))
                }
                None => Ok(pair.map(|p| p.map(metres))),
            }
        };
        let occlusal = places("--occlusal", &self.occlusal, file.occlusal.map(|o| [o.point, o.normal]))?;
        if occlusal.is_some_and(|[_, normal]| normal.norm() == 0.0) {
            return Err("--occlusal takes a point and a normal; the normal is 0".into());
        }
        let of_file = file.seeds.into_iter().flat_map(|(bone, at)| at.into_iter().map(move |p| Seed(bone.clone(), p)));
        let seeds: Vec<_> = of_file.chain(self.seed.iter().cloned()).map(|Seed(bone, p)| (bone, metres(p))).collect();
        if let Some((bone, _)) = seeds.iter().find(|(_, p)| p.iter().any(|v| !v.is_finite())) {
            return Err(format!("--seed {bone} takes three finite numbers in mm").into());
        }
        for (option, hu) in [("skin", self.skin.or(file.skin)), ("bone", self.bone.or(file.bone))] {
            if let Some(hu) = hu.filter(|hu| !hu.is_finite()) {
                return Err(format!("the threshold {option} takes a finite number in HU; found {hu}").into());
            }
        }
        Ok(BakeOptions {
            skin_hu: self.skin.or(file.skin).unwrap_or(usual.skin_hu),
            bone_hu: self.bone.or(file.bone).unwrap_or(usual.bone_hu),
            roi: places("--roi", &self.roi, file.region)?,
            resolution: self.fineness.resolution(file.edge),
            depth: 1e-3 * self.fineness.depth,
            layers: self.fineness.layers(),
            fat_by_hu: self.fineness.fat.is_none(),
            slit: !self.no_slit,
            mouth: places("--mouth", &self.mouth, file.mouth)?,
            hints: Hints {
                hinge: places("--hinge", &self.hinge, file.hinge)?,
                commissures: places("--commissures", &self.commissures, file.commissures)?,
                occlusal: occlusal.map(|[point, normal]| [point, normal.normalize()]),
                seeds,
            },
            strict: self.strict,
        })
    }
}

/// The file of a level: the name asked for, and with a number for the coarser ones.
fn numbered(path: &Path, level: usize) -> PathBuf {
    match (level, path.extension()) {
        (0, _) => path.into(),
        (_, Some(ending)) => path.with_extension(format!("{level}.{}", ending.to_string_lossy())),
        (_, None) => path.with_extension(level.to_string()),
    }
}
