//! Steps of a scene: their time, and how far the skin is from where a solution to the last digits puts it.

use std::sync::Arc;
use std::time::Instant;

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
    let mut sim = begin(&scene.text(size, &format!("tolerance = {:e}\n", scene.tolerance), false))?;
    let setup = start.elapsed().as_secs_f64();
    let skin = port(&sim, Slot::SkinPosition);
    let mut seen = vec![vec![0.0; sim.model().ports()[skin].len()]; scene.steps];
    let (mut times, mut solves, mut factorisations) = (Vec::new(), 0, 0);
    for (k, seen) in (1..).zip(&mut seen) {
        let start = ThreadTime::now();
        pose(&mut sim, scene, k)?;
        let report = sim.step(scene.dt)?;
        sim.get_f64(skin, 0, seen)?;
        if scene.whole {
            std::hint::black_box(sim.positions());
        }
        times.push(start.elapsed().as_secs_f64());
        solves += report.iterations;
        factorisations += report.factorisations;
    }
    let error = if checked { Some(worst(scene, size, &seen)?) } else { None };
    Ok(Steps {
        n_tets: sim.model().mesh().tets.len(),
        n_dofs: 3 * sim.model().dofs().n_blocks(),
        setup,
        step: median(&mut times),
        solves: f64::from(solves) / scene.steps as f64,
        factorisations,
        error,
    })
}

/// Seconds by the clock that a step takes with one thread and with two, their medians, and the median of their ratios. Both
/// simulations take each step in turn, once there and once back, so that what else the machine does meets both.
///
/// # Errors
/// [`Error`] of a step that is refused; none as a rule.
pub fn second_thread(scene: &Scene, size: &Size) -> Result<[f64; 3], Error> {
    let text = |threads| scene.text(size, &format!("tolerance = {:e}\nthreads = {threads}\n", scene.tolerance), false);
    let mut sims = [begin(&text(1))?, begin(&text(2))?];
    let mut times = [Vec::new(), Vec::new()];
    for k in (1..=scene.steps).chain((0..scene.steps).rev()) {
        for (sim, times) in sims.iter_mut().zip(&mut times) {
            pose(sim, scene, k)?;
            let start = Instant::now();
            sim.step(scene.dt)?;
            times.push(start.elapsed().as_secs_f64());
        }
    }
    let [one, two] = &mut times;
    let mut ratios: Vec<f64> = one.iter().zip(&*two).map(|(one, two)| one / two).collect();
    Ok([median(one), median(two), median(&mut ratios)])
}

/// Largest distance (m) of a vertex of the skin, seen after each step, from Newton's method to the last digits.
fn worst(scene: &Scene, size: &Size, seen: &[Vec<f64>]) -> Result<f64, Error> {
    let mut sim = begin(&scene.text(size, "method = \"newton\"\ntolerance = 1e-10\n", true))?;
    let skin = port(&sim, Slot::SkinPosition);
    let mut truth = vec![0.0; sim.model().ports()[skin].len()];
    let mut error = 0.0_f64;
    for (k, seen) in (1..).zip(seen) {
        pose(&mut sim, scene, k)?;
        sim.step(scene.dt)?;
        sim.get_f64(skin, 0, &mut truth)?;
        let off = seen.as_chunks::<3>().0.iter().zip(truth.as_chunks::<3>().0);
        let off = off.map(|(x, y)| x.iter().zip(y).map(|(x, y)| (x - y).powi(2)).sum::<f64>());
        error = error.max(off.fold(0.0, f64::max));
    }
    Ok(error.sqrt())
}

fn begin(text: &str) -> Result<Sim, Error> {
    let mut sim = Sim::new(Arc::new(load::from_text(text, None)?.model))?;
    sim.initialise()?;
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
