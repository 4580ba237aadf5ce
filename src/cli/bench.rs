//! `cutis bench`: the time of a step and of its parts, beside what this machine allows.

use cutis::bench::{SCENES, SIZES, Size, bandwidth, parts, second_core, second_thread, steps};

/// Bytes far beyond any cache.
const IN_MEMORY: usize = 256 << 20;
/// The factor of 10,000 tetrahedra.
const IN_CACHE: usize = 6 << 20;
/// Law of the parts.
const LAW: &str = "stable-neo-hookean";
/// How the scenes are called that are timed with a second thread.
const THREADED: &str = "advance";

#[derive(clap::Args)]
pub struct Bench {
    /// Scenes whose name holds this text; all if left out
    scene: Option<String>,
    /// Largest block: 1k, 10k, 50k or 200k tetrahedra
    #[arg(long, default_value = "50k", value_parser = SIZES.map(|s| s.name))]
    up_to: String,
    /// Parts of a step only
    #[arg(long, conflicts_with = "scene")]
    parts: bool,
    /// Do not compare with a solution to the last digits
    #[arg(long)]
    unchecked: bool,
}

impl Bench {
    pub fn run(self) -> super::Done {
        if let Some(wanted) = self.scene.as_ref().filter(|wanted| !SCENES.iter().any(|s| s.name.contains(*wanted))) {
            return Err(super::nothing_named("scene", wanted, SCENES.iter().map(|s| s.name)));
        }
        let largest = SIZES.iter().position(|s| s.name == self.up_to).unwrap_or(SIZES.len() - 1);
        let sizes = &SIZES[..=largest];
        say!(
            "CPU time of one thread, median. This core reads {:.1} GB/s from memory; \
             two cores read {:.2} times as much as one from memory, and {:.2} times from the cache.\n",
            1e-9 * bandwidth(IN_MEMORY),
            second_core(IN_MEMORY),
            second_core(IN_CACHE)
        );
        if self.scene.is_none() {
            table_of_parts(sizes)?;
        }
        if !self.parts {
            self.table_of_steps(sizes)?;
            self.table_of_threads(sizes)?;
        }
        Ok(())
    }

    fn table_of_steps(&self, sizes: &[Size]) -> super::Done {
        let wanted = self.scene.as_deref().unwrap_or_default();
        say!("| scene | tets | unknowns | set-up s | ms a step | solves | factorisations | skin off by mm |");
        say!("| --- | --- | --- | --- | --- | --- | --- | --- |");
        for scene in SCENES.iter().filter(|s| s.name.contains(wanted)) {
            for size in sizes {
                let s = steps(scene, size, !self.unchecked && size.name != "200k")?;
                let off = s.error.map_or("-".into(), |e| format!("{:.1e}", 1e3 * e));
                say!(
                    "| {} | {} | {} | {:.2} | {:.3} | {:.1} | {} | {off} |",
                    scene.name,
                    s.n_tets,
                    s.n_dofs,
                    s.setup,
                    1e3 * s.step,
                    s.solves,
                    s.factorisations
                );
            }
        }
        say!("");
        for scene in SCENES.iter().filter(|s| s.name.contains(wanted)) {
            say!("- `{}`: {}", scene.name, scene.what);
        }
        Ok(())
    }

    fn table_of_threads(&self, sizes: &[Size]) -> super::Done {
        let wanted = self.scene.as_deref().unwrap_or_default();
        say!("\nBy the clock, steps of two simulations in turn; medians, the last column that of the ratios.\n");
        say!("| scene | tets | one thread ms | two threads ms | one by two |");
        say!("| --- | --- | --- | --- | --- |");
        for scene in SCENES.iter().filter(|s| s.name.starts_with(THREADED) && s.name.contains(wanted)) {
            for size in sizes {
                let [one, two, ratio] = second_thread(scene, size)?;
                let n_tets = 6 * size.cells.iter().product::<usize>();
                say!("| {} | {n_tets} | {:.3} | {:.3} | {ratio:.2} |", scene.name, 1e3 * one, 1e3 * two);
            }
        }
        Ok(())
    }
}

fn table_of_parts(sizes: &[Size]) -> super::Done {
    say!(
        "| tets | unknowns | forces ns/tet | stiffness ns/tet | analysis ms | factor ms | entries | solve ms | of the bandwidth | in double ms |"
    );
    say!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for size in sizes {
        let p = parts(size, LAW)?;
        let ns = 1e9 / p.n_tets as f64;
        say!(
            "| {} | {} | {:.1} | {:.1} | {:.1} | {:.1} | {:.2e} | {:.3} | {:.0} % of {:.0} GB/s | {:.3} |",
            p.n_tets,
            p.n_dofs,
            ns * p.forces,
            ns * p.stiffness,
            1e3 * p.analysis,
            1e3 * p.factor,
            p.n_factor as f64,
            1e3 * p.solve,
            100.0 * p.solve_limit() / p.solve,
            1e-9 * p.bandwidth,
            1e3 * p.solve_double
        );
    }
    say!("");
    Ok(())
}
