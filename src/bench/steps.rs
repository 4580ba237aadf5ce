//! Steps of a scene: their time, and how far the skin is from where a solution to the last digits puts it.

use std::sync::Arc;

use cpu_time::ThreadTime;

use super::{Scene, Size, median};
use crate::error::Error;
use crate::load;
use crate::port::Slot;
use crate::sim::Sim;

/// What the steps of a scene took.
#[derive(Debug, Clone, PartialEq)]
pub struct Steps {
    /// Tetrahedra.
    pub n_tets: usize,
    /// Scalar unknowns.
    pub n_dofs: usize,
    /// CPU seconds to load, mesh, analyse and find the start.
    pub setup: f64,
    /// CPU seconds of a step, inputs and reading included: their median.
    pub step: f64,
    /// Linear solves of a step, on average.
    pub solves: f64,
    /// Factorisations after the start, in all.
    pub factorisations: u32,
    /// Largest distance of a skin vertex from the solution to the last digits, m; `None` if none was made.
    pub error: Option<f64>,
}

/// Runs a scene; `checked` also against Newton's method at a tolerance of 1e-10 m.
///
/// # Errors
/// [`Error`] of a step that is refused; none as a rule.
pub fn steps(scene: &Scene, size: &Size, checked: bool) -> Result<Steps, Error> {
    let start = ThreadTime::now();
    let mut sim = begin(&scene.text(size, &format!("tolerance = {:e}\n", scene.tolerance)))?;
    let setup = start.elapsed().as_secs_f64();
    let mut reference =
        if checked { Some(begin(&scene.text(size, "method = \"newton\"\ntolerance = 1e-10\n"))?) } else { None };
    let skin = port(&sim, Slot::SkinPosition);
    let n = sim.model().ports()[skin].len();
    let (mut seen, mut true_skin) = (vec![0.0; n], vec![0.0; n]);
    let (mut times, mut solves, mut factorisations, mut error) = (Vec::new(), 0, 0, 0.0_f64);
    for k in 1..=scene.steps {
        let start = ThreadTime::now();
        pose(&mut sim, scene, k)?;
        let report = sim.step(scene.dt)?;
        sim.get_f64(skin, 0, &mut seen)?;
        if scene.whole {
            std::hint::black_box(sim.positions());
        }
        times.push(start.elapsed().as_secs_f64());
        solves += report.iterations;
        factorisations += report.factorisations;
        if let Some(reference) = &mut reference {
            pose(reference, scene, k)?;
            reference.step(scene.dt)?;
            reference.get_f64(skin, 0, &mut true_skin)?;
            let off = seen.as_chunks::<3>().0.iter().zip(true_skin.as_chunks::<3>().0);
            let off = off.map(|(x, y)| x.iter().zip(y).map(|(x, y)| (x - y).powi(2)).sum::<f64>());
            error = error.max(off.fold(0.0, f64::max).sqrt());
        }
    }
    Ok(Steps {
        n_tets: sim.model().mesh().tets.len(),
        n_dofs: 3 * sim.model().dofs().n_blocks(),
        setup,
        step: median(&mut times),
        solves: f64::from(solves) / scene.steps as f64,
        factorisations,
        error: checked.then_some(error),
    })
}

fn begin(text: &str) -> Result<Sim, Error> {
    let mut sim = Sim::new(Arc::new(load::from_text(text, None)?.model))?;
    sim.initialise()?;
    // The first step makes tables and factors; it moves nothing.
    Ok(sim)
}

fn pose(sim: &mut Sim, scene: &Scene, k: usize) -> Result<(), Error> {
    let last = 3 * (sim.model().parts().bones.len() - 1);
    let (t, w) = (scene.pose)(k);
    sim.set_f64(port(sim, Slot::BoneTranslation), last, &t)?;
    sim.set_f64(port(sim, Slot::BoneRotation), last, &w)?;
    Ok(())
}

fn port(sim: &Sim, slot: Slot) -> usize {
    sim.model().ports().iter().position(|p| p.slot == slot).expect("every scene here has it")
}
