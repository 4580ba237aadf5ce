//! `cutis run`: the programme of a scene.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use cutis::io::{Data, write_vtu};
use cutis::load;
use cutis::math::Vec3;
use cutis::mesh::TetMesh;
use cutis::sim::{Sim, SimError, worst_tets};

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
    /// Where a step is refused, write the worst elements there as worst.vtu
    #[arg(long)]
    worst: bool,
}

/// Steps that a run takes at most; more is a slip in `dt` or `end`.
const MOST_STEPS: usize = 1_000_000;
/// Elements that `--worst` writes.
const WORST: usize = 50;

impl Run {
    pub fn run(self) -> super::Done {
        let loaded = load::from_file(&self.scene)?;
        for warning in loaded.model.warnings() {
            eprintln!("warning: {warning}");
        }
        let programme = loaded.programme;
        let n = programme.steps();
        if n > MOST_STEPS {
            return Err(format!(
                "[run] of {} asks for {:.2e} steps of {} s to {} s; a run takes {MOST_STEPS} at most: make `dt` longer or `end` \
                 earlier",
                self.scene.display(),
                programme.end / programme.dt,
                programme.dt,
                programme.end
            )
            .into());
        }
        let mut sim = Sim::new(Arc::new(loaded.model))?;
        let model = sim.model().clone();
        cutis::io::create_folder(&self.out)?;
        let path = self.out.join("ports.csv");
        let mut table = Table::new(&path, &sim)?;
        let mut series = if self.table_only { None } else { Some(Series::new(&self.out)?) };
        let mut keep = |t: f64, sim: &Sim| -> super::Done {
            table.row(t, sim)?;
            if let Some(series) = &mut series {
                series.add(t, model.mesh(), &model.parts().contacts, sim.positions())?;
            }
            Ok(())
        };
        for s in programme.settings(0.0) {
            sim.set_f64(s.port, s.offset, &s.values)?;
        }
        sim.initialise().map_err(|error| self.refused(&sim, error))?;
        let start = sim.positions().to_vec();
        keep(0.0, &sim)?;
        let bar = progress::bar(n, "steps");
        let (mut iterations, mut spent, mut longest) = (0, Duration::ZERO, Duration::ZERO);
        for k in 1..=n {
            let t = programme.time(k);
            for s in programme.settings(t) {
                sim.set_f64(s.port, s.offset, &s.values)?;
            }
            let before = Instant::now();
            let report = match sim.step(programme.step(k)) {
                Ok(report) => report,
                Err(error) => {
                    bar.finish_and_clear();
                    say!(
                        "{} of {n} steps were taken, to t = {} s; they are in {}",
                        k - 1,
                        programme.time(k) - programme.step(k),
                        path.display()
                    );
                    return Err(self.refused(&sim, error).into());
                }
            };
            let taken = before.elapsed();
            spent += taken;
            longest = longest.max(taken);
            iterations += report.iterations;
            for warning in &report.warnings {
                bar.suspend(|| eprintln!("warning: t = {t} s: {warning}"));
            }
            keep(t, &sim)?;
            bar.inc(1);
        }
        bar.finish_and_clear();
        say!(
            "{}: {} nodes, {} tets, {n} steps of {} s{}; {:.1} ms and {:.1} linear solves a step, the longest {:.1} ms",
            model.name(),
            model.mesh().nodes.len(),
            model.mesh().tets.len(),
            programme.dt,
            if programme.step(n) == programme.dt {
                String::new()
            } else {
                format!(", the last of {:.6} s", programme.step(n))
            },
            1e3 * spent.as_secs_f64() / n as f64,
            f64::from(iterations) / n as f64,
            1e3 * longest.as_secs_f64()
        );
        say!("wrote {}", path.display());
        if let Some(series) = &series {
            say!("wrote {}", series.index().display());
            let (mesh, [start, end]) = shown(&model, [&start, sim.positions()]);
            let image = picture(&mesh, &[("start", &start), ("end", &end)]);
            cutis::io::write_bytes(&self.out.join("picture.png"), &image.to_png())?;
            say!("wrote {}", self.out.join("picture.png").display());
        }
        Ok(())
    }

    /// Writes the worst elements of a step that had no answer, where that was asked for.
    fn refused(&self, sim: &Sim, error: SimError) -> SimError {
        let Some(x) = sim.refused().filter(|_| self.worst) else { return error };
        let worst = worst_tets(sim.model(), x, WORST);
        let mesh = sim.model().mesh();
        let part = TetMesh {
            nodes: mesh.nodes.clone(),
            tets: worst.iter().map(|(e, _)| mesh.tets[*e]).collect(),
            region: worst.iter().map(|(e, _)| mesh.region[*e]).collect(),
            region_names: mesh.region_names.clone(),
            ..TetMesh::default()
        };
        let det_f: Vec<f64> = worst.iter().map(|(_, det_f)| *det_f).collect();
        let path = self.out.join("worst.vtu");
        let (part, x) = without_idle_nodes(part, x);
        let written = write_vtu(&path, &part, &x, &[], &[Data { name: "det F", components: 1, values: &det_f }]);
        match written {
            Ok(()) => say!("wrote {}: the {} worst elements where the solver gave up", path.display(), worst.len()),
            Err(e) => eprintln!("warning: {e}"),
        }
        error
    }
}

/// The mesh without nodes that no tetrahedron has, and the positions of the others.
fn without_idle_nodes(mut mesh: TetMesh, x: &[Vec3]) -> (TetMesh, Vec<Vec3>) {
    let mut used: Vec<u32> = mesh.tets.as_flattened().to_vec();
    used.sort_unstable();
    used.dedup();
    for a in mesh.tets.as_flattened_mut() {
        *a = used.binary_search(a).expect("listed above") as u32;
    }
    let of = |list: &[Vec3]| used.iter().map(|&a| list[a as usize]).collect();
    mesh.nodes = of(&mesh.nodes);
    (mesh, of(x))
}
