//! The next factor, made on a thread of its own while steps go on.
//!
//! Which linearisation comes next, and at which step, is decided by counts of solves and lies in the state; the thread only
//! has its factor ready by then. Where it has not been asked for one (another process, a restored state), the factor is made
//! on the spot, so the bits are the same.

use std::sync::Arc;
use std::thread::{Builder, JoinHandle};

use super::linearisation::{Linearisation, with_problem};
use super::model::Model;
use super::report::StepReport;
use super::state::Upcoming;
use super::{SolveError, State};
use crate::solve::Minimiser;

/// Linear solves of a piece from which on a factor is due.
const STALE: u32 = 6;

/// A second minimiser and the thread that has it at times.
#[derive(Default)]
pub(super) struct Ahead {
    spare: Option<Box<Minimiser>>,
    job: Option<Job>,
}

struct Job {
    of: Arc<Linearisation>,
    thread: JoinHandle<Made>,
}

type Made = Result<Box<Minimiser>, SolveError>;

impl Ahead {
    /// Exchanges the minimiser for the one of the upcoming linearisation once its time has come, and says which that is.
    pub fn take_up(
        &mut self,
        model: &Arc<Model>,
        state: &State,
        minimiser: &mut Box<Minimiser>,
        factored: &mut Option<Arc<Linearisation>>,
    ) -> Option<Arc<Linearisation>> {
        let Upcoming { linearisation, solves } = state.upcoming.as_ref()?;
        if *solves > 0 {
            self.begin(model, linearisation);
            return None;
        }
        if !factored.as_ref().is_some_and(|factored| Arc::ptr_eq(factored, linearisation)) {
            let made = self.finish(model, linearisation).ok()?;
            self.spare = Some(std::mem::replace(minimiser, made));
            *factored = Some(linearisation.clone());
        }
        Some(linearisation.clone())
    }

    /// What is to come after a step that ended at `end`; begun where that step has taken many solves.
    pub fn look(
        &mut self,
        model: &Arc<Model>,
        upcoming: Option<Upcoming>,
        report: &StepReport,
        minimiser: &Minimiser,
        end: impl FnOnce() -> Linearisation,
    ) -> Option<Upcoming> {
        if !model.parts().background || model.is_quadratic() || minimiser.factor_len() == 0 {
            return None;
        }
        let upcoming = match upcoming {
            // One that was made within the step is newer, and one that was taken up is no longer to come.
            Some(_) if report.factorisations > 0 => None,
            Some(Upcoming { linearisation, solves }) => {
                Some(Upcoming { linearisation, solves: solves.saturating_sub(report.iterations) })
            }
            None if report.iterations >= STALE * report.substeps => {
                Some(Upcoming { linearisation: Arc::new(end()), solves: solves_of_a_factor(minimiser) })
            }
            None => None,
        };
        if let Some(upcoming) = &upcoming {
            self.begin(model, &upcoming.linearisation);
        }
        upcoming
    }

    /// Begins with the factor of `wanted`, unless that is under way or the thread is still busy.
    fn begin(&mut self, model: &Arc<Model>, wanted: &Arc<Linearisation>) {
        match &self.job {
            Some(job) if Arc::ptr_eq(&job.of, wanted) || !job.thread.is_finished() => return,
            Some(_) => self.wait(),
            None => {}
        }
        let (of, model, linearisation, spare) = (wanted.clone(), model.clone(), wanted.clone(), self.spare.take());
        let thread = Builder::new().name("cutis factor".into()).spawn(move || make(&model, &linearisation, spare));
        // Without a thread the factor is made when it is wanted.
        self.job = thread.ok().map(|thread| Job { of, thread });
    }

    /// The minimiser with the factor of `wanted`.
    ///
    /// # Errors
    /// As for [`Minimiser::linearise`].
    fn finish(&mut self, model: &Model, wanted: &Arc<Linearisation>) -> Made {
        match self.job.take() {
            Some(job) if Arc::ptr_eq(&job.of, wanted) => {
                if let Ok(made) = job.thread.join() {
                    return made;
                }
            }
            other => {
                self.job = other;
                self.wait();
            }
        }
        make(model, wanted, self.spare.take())
    }

    /// Waits for the thread and takes its minimiser back.
    fn wait(&mut self) {
        if let Some(Ok(Ok(spare))) = self.job.take().map(|job| job.thread.join()) {
            self.spare = Some(spare);
        }
    }
}

impl Drop for Ahead {
    /// The library may be unloaded after its last simulation, so no thread outlives it.
    fn drop(&mut self) {
        self.wait();
    }
}

/// Factors the stiffness of `l`, in `spare` if there is one.
fn make(model: &Model, l: &Linearisation, spare: Option<Box<Minimiser>>) -> Made {
    with_problem(model, l.at(model), |problem| {
        let mut minimiser = match spare {
            Some(spare) => spare,
            None => Box::new(Minimiser::new(problem, model.parts().strategy)?),
        };
        minimiser.linearise(problem, &l.config)?;
        Ok(minimiser)
    })
}

/// Solves, forces included, that take twice as long as a factorisation, as measured from 1k to 200k tetrahedra: no step is to
/// wait for one on a machine that has other work, too.
fn solves_of_a_factor(minimiser: &Minimiser) -> u32 {
    (0.3 * minimiser.factor_len() as f64 / minimiser.n_unknowns() as f64).ceil() as u32
}
