//! `cutis run`: the programme of a scene.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use cutis::load;
use cutis::sim::Sim;

use super::output::{Series, Table, picture, shown};
use super::progress;

#[derive(clap::Args)]
pub struct Run {
    /// Scene file (TOML)
    scene: PathBuf,
    /// Folder for what the run leaves behind
    #[arg(short, long, default_value = "out")]
    out: PathBuf,
    /// Write the table of ports only
    #[arg(long)]
    table_only: bool,
}

impl Run {
    pub fn run(self) -> super::Done {
        let loaded = load::from_file(&self.scene)?;
        for warning in loaded.model.warnings() {
            eprintln!("warning: {warning}");
        }
        let mut sim = Sim::new(Arc::new(loaded.model))?;
        let model = sim.model().clone();
        let programme = loaded.programme;
        cutis::io::create_folder(&self.out)?;
        let mut table = Table::new(&sim);
        let mut series = Series::new(&self.out);
        for s in programme.settings(0.0) {
            sim.set_f64(s.port, s.offset, &s.values)?;
        }
        sim.initialise()?;
        let start = sim.positions().to_vec();
        table.row(&sim);
        if !self.table_only {
            series.add(0.0, model.mesh(), &model.parts().contacts, sim.positions())?;
        }
        let bar = progress::bar(programme.steps(), "steps");
        let (mut iterations, mut spent, mut longest) = (0, Duration::ZERO, Duration::ZERO);
        for k in 1..=programme.steps() {
            let t = k as f64 * programme.dt;
            for s in programme.settings(t) {
                sim.set_f64(s.port, s.offset, &s.values)?;
            }
            let before = Instant::now();
            let report = sim.step(programme.dt)?;
            let taken = before.elapsed();
            spent += taken;
            longest = longest.max(taken);
            iterations += report.iterations;
            for warning in &report.warnings {
                bar.suspend(|| eprintln!("warning: t = {t} s: {warning}"));
            }
            table.row(&sim);
            if !self.table_only {
                series.add(t, model.mesh(), &model.parts().contacts, sim.positions())?;
            }
            bar.inc(1);
        }
        bar.finish_and_clear();
        table.save(&self.out.join("ports.csv"))?;
        say!(
            "{}: {} nodes, {} tets, {} steps of {} s; {:.1} ms and {:.1} linear solves a step, the longest {:.1} ms",
            model.name(),
            model.mesh().nodes.len(),
            model.mesh().tets.len(),
            programme.steps(),
            programme.dt,
            1e3 * spent.as_secs_f64() / programme.steps() as f64,
            f64::from(iterations) / programme.steps() as f64,
            1e3 * longest.as_secs_f64()
        );
        say!("wrote {}", self.out.join("ports.csv").display());
        if !self.table_only {
            say!("wrote {}", series.save()?.display());
            let (mesh, [start, end]) = shown(&model, [&start, sim.positions()]);
            let image = picture(&mesh, &[("start", &start), ("end", &end)]);
            cutis::io::write_bytes(&self.out.join("picture.png"), &image.to_png())?;
            say!("wrote {}", self.out.join("picture.png").display());
        }
        Ok(())
    }
}
