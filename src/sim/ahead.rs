//! The next factor, made on a thread of its own while steps go on.
//!
//! Which linearisation comes next, and at which step, is decided by counts of solves and lies in the state; the thread only
//! has its factor ready by then. Where it has not been asked for one (another process, a restored state), the factor is made
//! on the spot, so the bits are the same.

use std::sync::Arc;
use std::thread::{Builder, JoinHandle};

use super::SolveError;
use super::model::Model;
use super::state::Linearisation;
use super::step::{read_pivots, read_wrenches};
use crate::math::Vec3;
use crate::solve::{Minimiser, Problem};

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
    /// Begins with the factor of `wanted`, unless that is under way or the thread is still busy.
    pub fn begin(&mut self, model: &Arc<Model>, wanted: &Arc<Linearisation>) {
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
    pub fn finish(&mut self, model: &Model, wanted: &Arc<Linearisation>) -> Made {
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

    /// Takes a minimiser back for the next factor.
    pub fn keep(&mut self, spare: Box<Minimiser>) {
        self.spare = Some(spare);
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
    l.with_problem(model, |problem| {
        let mut minimiser = match spare {
            Some(spare) => spare,
            None => Box::new(Minimiser::new(problem, model.parts().strategy)?),
        };
        minimiser.linearise(problem, &l.config)?;
        Ok(minimiser)
    })
}

impl Linearisation {
    /// What was minimised when it was made.
    pub(super) fn with_problem<R>(&self, model: &Model, body: impl FnOnce(&Problem) -> R) -> R {
        let parts = model.parts();
        let mut pivots = vec![Vec3::zeros(); parts.bones.len()];
        read_pivots(model, &self.inputs, &mut pivots);
        let mut wrenches = vec![(Vec3::zeros(), Vec3::zeros()); model.dofs().bodies.len()];
        read_wrenches(model, &self.inputs, &mut wrenches);
        body(&Problem {
            terms: &parts.terms,
            dofs: model.dofs(),
            X: &parts.mesh.nodes,
            pivots: &pivots,
            wrenches: &wrenches,
            at: self.at(model),
        })
    }
}
