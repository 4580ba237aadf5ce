//! A second thread that does one of two jobs, if it is awake in time.
//!
//! What is worked on changes hands: it is moved into a slot, taken out by the thread, and moved back, so nothing is shared
//! and nothing is allocated. A job that the thread has not begun when the caller is through with its own is taken back:
//! on a busy machine, or in a process where the thread is gone, two jobs take the time of two. What comes out is the same.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle, yield_now};

/// Looks at the slot before a thread sleeps, with pauses between them: half a millisecond or so, what the rest of a small
/// step takes. After each look whoever else wants the core gets it, be it the other thread.
const LOOKS: u32 = 1000;
const PAUSES: u32 = 16;

/// What goes wrong in a job.
type Panic = Box<dyn Any + Send>;

enum Slot<T> {
    Empty,
    Wanted(T, fn(&mut T)),
    Begun,
    Done(T, Result<(), Panic>),
    Closed,
}

impl<T> Slot<T> {
    fn phase(&self) -> u8 {
        match self {
            Slot::Empty => EMPTY,
            Slot::Wanted(..) => WANTED,
            Slot::Begun => BEGUN,
            Slot::Done(..) => DONE,
            Slot::Closed => CLOSED,
        }
    }
}

const EMPTY: u8 = 1;
const WANTED: u8 = 2;
const BEGUN: u8 = 4;
const DONE: u8 = 8;
const CLOSED: u8 = 16;

/// What the lock guards.
struct Desk<T> {
    slot: Slot<T>,
    /// Whether a thread sleeps until the slot changes.
    asleep: bool,
}

struct Shared<T> {
    desk: Mutex<Desk<T>>,
    /// Phase of the slot, to look at without the lock.
    phase: AtomicU8,
    changed: Condvar,
}

impl<T> Shared<T> {
    fn lock(&self) -> MutexGuard<'_, Desk<T>> {
        // Jobs run outside of the lock, so a panic leaves the slot whole.
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Lays something new into the slot and returns what was there.
    fn put(&self, mut desk: MutexGuard<Desk<T>>, new: Slot<T>) -> Slot<T> {
        self.phase.store(new.phase(), Ordering::Release);
        let old = std::mem::replace(&mut desk.slot, new);
        if std::mem::take(&mut desk.asleep) {
            self.changed.notify_all();
        }
        old
    }

    /// The desk once its slot is in one of these phases.
    fn wait(&self, phases: u8) -> MutexGuard<'_, Desk<T>> {
        for _ in 0..LOOKS {
            if self.phase.load(Ordering::Acquire) & phases != 0 {
                break;
            }
            for _ in 0..PAUSES {
                std::hint::spin_loop();
            }
            yield_now();
        }
        let mut desk = self.lock();
        while desk.slot.phase() & phases == 0 {
            desk.asleep = true;
            desk = self.changed.wait(desk).unwrap_or_else(PoisonError::into_inner);
        }
        desk
    }

    fn work(&self) {
        while let Slot::Wanted(mut of, job) = self.put(self.wait(WANTED | CLOSED), Slot::Begun) {
            let end = catch_unwind(AssertUnwindSafe(|| job(&mut of)));
            let desk = self.lock();
            if desk.slot.phase() == CLOSED {
                return;
            }
            self.put(desk, Slot::Done(of, end));
        }
    }
}

/// The thread; it sleeps where there is nothing to do, and ends with its owner.
pub struct Worker<T: Send + 'static> {
    shared: Arc<Shared<T>>,
    thread: Option<JoinHandle<()>>,
}

impl<T: Default + Send + 'static> Worker<T> {
    /// A new thread; `None` where the system gives none.
    pub fn new() -> Option<Worker<T>> {
        let shared = Arc::new(Shared {
            desk: Mutex::new(Desk { slot: Slot::Empty, asleep: false }),
            phase: AtomicU8::new(EMPTY),
            changed: Condvar::new(),
        });
        let its = shared.clone();
        let thread = Builder::new().name("cutis".into()).spawn(move || its.work()).ok()?;
        Some(Worker { shared, thread: Some(thread) })
    }

    /// Does `job` with both, at the same time if the thread is free.
    ///
    /// # Panics
    /// Where `job` does, on whichever thread; both are back in place then.
    pub fn both(&self, [mine, other]: &mut [T; 2], job: fn(&mut T)) {
        self.shared.put(self.shared.lock(), Slot::Wanted(std::mem::take(other), job));
        let end = catch_unwind(AssertUnwindSafe(|| job(mine)));
        let mut desk = self.shared.lock();
        if desk.slot.phase() == BEGUN {
            drop(desk);
            desk = self.shared.wait(DONE);
        }
        let found = self.shared.put(desk, Slot::Empty);
        let its_end = match found {
            Slot::Wanted(of, job) => {
                *other = of;
                catch_unwind(AssertUnwindSafe(|| job(other)))
            }
            Slot::Done(of, end) => {
                *other = of;
                end
            }
            Slot::Empty | Slot::Begun | Slot::Closed => unreachable!("the slot is the caller's until the job is done"),
        };
        if let Err(panic) = end.and(its_end) {
            resume_unwind(panic);
        }
    }
}

impl<T: Send + 'static> Drop for Worker<T> {
    fn drop(&mut self) {
        self.shared.put(self.shared.lock(), Slot::Closed);
        if let Some(thread) = self.thread.take() {
            // Its panics were handed over with the job.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;
    use std::time::Duration;

    use super::*;

    /// Fails instead of hanging.
    fn in_time(body: impl FnOnce() + Send + 'static) {
        let (done, wait) = mpsc::channel();
        let thread = std::thread::spawn(move || {
            body();
            let _ = done.send(());
        });
        let end = wait.recv_timeout(Duration::from_secs(60));
        assert!(end != Err(mpsc::RecvTimeoutError::Timeout), "hangs");
        if let Err(panic) = thread.join() {
            resume_unwind(panic);
        }
    }

    #[test]
    fn both_jobs_are_done_again_and_again() {
        in_time(|| {
            let worker = Worker::new().expect("a thread");
            let mut of = [1_u64, 2];
            for k in 0..10_000 {
                worker.both(&mut of, |n| *n += 1);
                if k % 1000 == 0 {
                    std::thread::sleep(Duration::from_millis(2));
                }
            }
            assert_eq!(of, [10_001, 10_002]);
        });
    }

    #[test]
    fn a_panic_in_either_job_reaches_the_caller_and_nothing_is_lost() {
        in_time(|| {
            let worker = Worker::new().expect("a thread");
            let mut of = [1, 2];
            for planted in [1, 2] {
                of.rotate_left(planted - 1);
                let job = |n: &mut i32| assert!(*n != 1, "planted");
                let end = catch_unwind(AssertUnwindSafe(|| worker.both(&mut of, job)));
                assert!(end.is_err_and(|panic| *panic.downcast_ref::<&str>().expect("a message") == "planted"));
            }
            worker.both(&mut of, |n| *n *= 10);
            assert_eq!(of, [20, 10]);
        });
    }

    #[test]
    fn an_idle_worker_ends_with_its_owner() {
        in_time(|| {
            for pause in [0, 0, 0, 5] {
                let worker = Worker::<u8>::new().expect("a thread");
                std::thread::sleep(Duration::from_millis(pause));
                drop(worker);
            }
        });
    }
}
