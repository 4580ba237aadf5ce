//! `cutis study`: what accuracy costs in time, for one scene.

use std::path::{Path, PathBuf};

use cutis::mesh::FineSkin;
use cutis::study::{Answer, Plan, Probe, Row, Variant, advice, chart, measure, page, read_rows, write_rows};
use cutis::{io, load};

use super::progress;

#[derive(clap::Args)]
pub struct Study {
    /// Scene file (TOML)
    scene: PathBuf,
    /// Folder for table, chart and page; a study that was cut off goes on from what lies there
    #[arg(short, long, default_value = "out/study")]
    out: PathBuf,
    /// Further meshes of the same head, for scenes whose mesh is a file; relative to the scene
    #[arg(long)]
    mesh: Vec<String>,
    /// Budgets to advise on, CPU milliseconds a step
    #[arg(long, value_delimiter = ',', default_values_t = [1.0, 4.0, 16.0, 33.0, 100.0, 1000.0])]
    budget: Vec<f64>,
    /// Two meshes, no ladders of solver and time
    #[arg(long)]
    quick: bool,
    /// Variants with more scalar unknowns are left out
    #[arg(long, default_value_t = 150_000)]
    most_unknowns: usize,
}

impl Study {
    pub fn run(self) -> super::Done {
        let text = io::read_text(&self.scene)?;
        let folder = self.scene.parent();
        let mut plan = Plan::new(&text, folder, &self.mesh, self.quick)?;
        io::create_folder(&self.out)?;
        // The reference takes the finest mesh whose quadratic elements are not too many.
        let (finest, programme) = loop {
            let load::Loaded { model, programme } = load::from_text(&plan.text(&plan.reference), folder)?;
            if 3 * model.dofs().n_blocks() <= self.most_unknowns || plan.reference.level == 0 {
                break (model, programme);
            }
            plan.reference.level -= 1;
        };
        let identity =
            format!("{} {programme:?} {:?} {} {}", finest.token(), self.mesh, self.quick, self.most_unknowns);
        let mut meshes = Vec::new();
        for level in 0..plan.levels.len() {
            meshes.push(load::mesh(&plan.text(&Variant { level, ..plan.reference.clone() }), folder)?);
        }
        let probe = Probe::new(FineSkin::of(finest.mesh()), &meshes, self.most_unknowns);
        drop(meshes);
        let reference = self.reference(&plan, folder, &identity, &probe)?;
        let csv = self.out.join("study.csv");
        let mut rows = read_rows(&identity, &io::read_text(&csv).unwrap_or_default());
        let bar = progress::bar(plan.variants.len(), "variants");
        for v in &plan.variants {
            let name = v.name(&plan.levels);
            if !rows.iter().any(|row| row.name == name) {
                let answer = measure(&plan.text(v), folder, v, &probe);
                rows.push(Row::new(name, answer, &reference));
                io::write_bytes(&csv, write_rows(&identity, &rows).as_bytes())?;
            }
            bar.inc(1);
        }
        bar.finish_and_clear();
        self.report(&plan, &rows, &reference, probe.left_out)
    }

    /// The reference's answer, from the folder if it lies there.
    fn reference(
        &self,
        plan: &Plan,
        folder: Option<&Path>,
        identity: &str,
        probe: &Probe,
    ) -> Result<Answer, Box<dyn std::error::Error>> {
        let path = self.out.join("reference.bin");
        if let Some(answer) = io::read_bytes(&path).ok().and_then(|bytes| Answer::from_bytes(identity, &bytes)) {
            return Ok(answer);
        }
        let bar = progress::bar(1, "reference");
        let answer = measure(&plan.text(&plan.reference), folder, &plan.reference, probe)?;
        bar.finish_and_clear();
        io::write_bytes(&path, &answer.to_bytes(identity))?;
        Ok(answer)
    }

    fn report(&self, plan: &Plan, rows: &[Row], reference: &Answer, left_out: usize) -> super::Done {
        let title = format!("What accuracy costs: {}", plan.name());
        let floor = own_error(plan, rows, reference);
        let mut about = vec![format!(
            "Reference: {}, {} unknowns. Its skin moves by {:.2} mm at most.",
            plan.reference.name(&plan.levels),
            reference.n_dofs,
            1e3 * reference
                .u
                .as_chunks::<3>()
                .0
                .iter()
                .map(|u| u.iter().map(|u| u * u).sum::<f64>())
                .fold(0.0, f64::max)
                .sqrt()
        )];
        about.push(match floor {
            Some(e) if plan.is_of_one_shape() => format!("The reference itself is off by about {:.1e} mm (rms), from the same method on the next coarser mesh; rows below that cannot be told apart.", 1e3 * e),
            Some(e) => format!("Meshes from files may differ in shape: the reference's method on the next coarser one is {:.1e} mm (rms) away, so below that only rows on the same mesh can be told apart.", 1e3 * e),
            None => "There is no coarser mesh to tell the reference's own error from.".into(),
        });
        about.push("Errors are those of displacements at the vertices of the reference's skin, the largest over the compared instants; force is the largest difference of a bone's reaction in units of the largest reaction. Times are CPU time of one thread, the median step.".into());
        if left_out > 0 {
            about.push(format!("{left_out} vertices of that skin lie outside of some mesh by more than an element and are not compared."));
        }
        let budgets: Vec<f64> = self.budget.iter().map(|b| 1e-3 * b).collect();
        let drawn = chart(&title, rows, floor);
        io::write_bytes(&self.out.join("study.png"), &drawn.to_image().to_png())?;
        io::write_bytes(&self.out.join("study.svg"), drawn.to_svg().as_bytes())?;
        io::write_bytes(&self.out.join("study.html"), page(&title, &about, rows, &budgets, floor).as_bytes())?;
        about.iter().for_each(|line| say!("{line}"));
        say!("");
        advice(rows, &budgets, floor.unwrap_or(0.0)).iter().for_each(|line| say!("{line}"));
        for row in rows {
            if let Err(why) = &row.outcome {
                say!("no answer: {}: {why}", row.name);
            }
        }
        for name in ["study.csv", "study.png", "study.svg", "study.html"] {
            say!("wrote {}", self.out.join(name).display());
        }
        Ok(())
    }
}

/// Estimated error of the reference, m: the same method on the next coarser mesh is off by `e`; at order one, the least
/// that jumps at the ends of bones leave, the reference is off by `e / (r - 1)`, r the ratio of edges. Meshes of different
/// shapes have no order: `e` is what they can be told apart by.
fn own_error(plan: &Plan, rows: &[Row], reference: &Answer) -> Option<f64> {
    let below = plan.below_reference()?.name(&plan.levels);
    let m = rows.iter().find(|row| row.name == below)?.outcome.as_ref().ok()?;
    if !plan.is_of_one_shape() {
        return Some(m.errors.rms);
    }
    let ratio = (reference.n_dofs as f64 / m.n_dofs as f64).cbrt();
    (ratio > 1.1).then(|| m.errors.rms / (ratio - 1.0))
}
