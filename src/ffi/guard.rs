//! No panic leaves the library, and no handle is used twice at once.
//!
//! Every exported function that owns a handle runs inside [`with`]: it refuses null, foreign and busy handles, catches
//! a panic and poisons the handle with its message. It computes in the default floating-point environment, whatever the host's.

use std::any::Any;
use std::cell::UnsafeCell;
use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicUsize, Ordering};
use std::sync::{Arc, Once};

use super::floats;
use crate::sim::Allowance;

/// Guarded calls under way. While there is one, the panic hook keeps quiet: its message goes into a handle instead.
static UNDER_WAY: AtomicUsize = AtomicUsize::new(0);

/// What [`with`] can guard.
pub(super) trait Guarded {
    /// First word of every handle of this kind; tells an instance from a state, and FMI 2.0 from FMI 3.0.
    const TAG: u64;
    /// What its steps live on, for whoever may cancel them.
    fn allowance(&self) -> Arc<Allowance>;
    /// Called once after a panic: from now on only free, reset and message may answer.
    fn poison(&mut self, why: String);
}

/// A value behind an opaque pointer. Its tag comes first whatever the value is, so that a handle of another kind can be told by
/// it.
#[repr(C)]
pub struct Handle<T> {
    tag: u64,
    busy: AtomicBool,
    /// What the host's own callback may look at while a call is under way, and the thread that it runs on.
    offered: AtomicPtr<c_void>,
    thread: AtomicUsize,
    allowance: Arc<Allowance>,
    value: UnsafeCell<T>,
}

/// Why a guarded call did not run to its end.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Denied {
    /// The handle is null.
    Null,
    /// The pointer is not a handle of this kind.
    Foreign,
    /// Another call is inside this handle: a second thread, or the host's own callback.
    Busy,
    /// The body panicked; the handle is poisoned.
    Panicked,
}

impl<T: Guarded> Handle<T> {
    /// Moves `value` to the heap and gives away its address; [`Handle::free`] takes it back.
    pub(super) fn leak(value: T) -> *mut Handle<T> {
        Box::into_raw(Box::new(Handle {
            tag: T::TAG,
            busy: AtomicBool::new(false),
            offered: AtomicPtr::new(std::ptr::null_mut()),
            thread: AtomicUsize::new(0),
            allowance: value.allowance(),
            value: UnsafeCell::new(value),
        }))
    }

    /// Drops the value. Null, foreign and busy handles are left alone.
    ///
    /// # Safety
    /// `handle` is null or points to at least a tag; if the tag is ours it came from [`Handle::leak`] and is not used again.
    pub(super) unsafe fn free(handle: *mut Handle<T>) {
        // SAFETY: the caller's promise, word for word.
        if let Ok(this) = unsafe { enter(handle) } {
            // The tag goes first, so that a second free or a late call is refused as long as the memory is not reused.
            // SAFETY: `enter` made us the only user, and the pointer came from `Box::into_raw`.
            let mut owned = unsafe { Box::from_raw(handle) };
            // SAFETY: as above; volatile, or the compiler drops a store to memory that is freed next.
            unsafe { std::ptr::write_volatile(&mut owned.tag, 0) };
            let _ = this;
            let _ = caught(move || drop(owned));
        }
    }
}

/// Claims a handle for one call. The claim is released by storing `false` in `busy`.
///
/// # Safety
/// `handle` is null, or points to readable memory of the size of a tag that, if it holds our tag, is a live handle.
unsafe fn enter<'a, T: Guarded>(handle: *mut Handle<T>) -> Result<&'a Handle<T>, Denied> {
    if handle.is_null() {
        return Err(Denied::Null);
    }
    // SAFETY: not null, and by contract readable; nothing beyond the tag is touched before the tag is known to be ours.
    if !handle.is_aligned() || unsafe { (&raw const (*handle).tag).read() } != T::TAG {
        return Err(Denied::Foreign);
    }
    // SAFETY: the tag says that `Handle::leak` made it, so the whole handle is there.
    let this = unsafe { &*handle };
    if this.busy.swap(true, Ordering::Acquire) {
        return Err(Denied::Busy);
    }
    // What was cancelled was another call.
    this.allowance.uncancel();
    Ok(this)
}

/// Runs `body` on the value of `handle`.
///
/// # Safety
/// As for [`enter`].
pub(super) unsafe fn with<T: Guarded, R>(handle: *mut Handle<T>, body: impl FnOnce(&mut T) -> R) -> Result<R, Denied> {
    // SAFETY: the caller's promise.
    let this = unsafe { enter(handle)? };
    // SAFETY: `busy` was ours to set, so no other reference to the value exists until it is cleared below.
    let value = unsafe { &mut *this.value.get() };
    let outcome = caught(|| body(value)).map_err(|why| {
        // SAFETY: the body's borrow ended with its unwinding.
        let value = unsafe { &mut *this.value.get() };
        value.poison(why);
        Denied::Panicked
    });
    this.busy.store(false, Ordering::Release);
    outcome
}

/// Gives a handle back, also while a host's exception passes through.
struct Release<'a, T>(&'a Handle<T>);

impl<T> Drop for Release<'_, T> {
    fn drop(&mut self) {
        self.0.offered.store(std::ptr::null_mut(), Ordering::Release);
        self.0.busy.store(false, Ordering::Release);
    }
}

/// As [`with`], for a body that calls the host in between: it catches what it does itself in [`caught`] and answers with the message
/// of a panic. So the host's callbacks stand outside of all that catches, and an exception of theirs goes on to the host.
///
/// # Safety
/// As for [`enter`].
pub(super) unsafe fn with_callbacks<T: Guarded, R>(
    handle: *mut Handle<T>,
    body: impl FnOnce(&mut T) -> Result<R, String>,
) -> Result<R, Denied> {
    // SAFETY: the caller's promise.
    let this = unsafe { enter(handle)? };
    let _release = Release(this);
    // SAFETY: `busy` was ours to set, so no other reference to the value exists until it is cleared by `_release`.
    let outcome = body(unsafe { &mut *this.value.get() });
    outcome.map_err(|why| {
        // SAFETY: the body's borrow ended with it.
        unsafe { &mut *this.value.get() }.poison(why);
        Denied::Panicked
    })
}

/// Ends the call that is under way in a handle before its next linear solve; nothing where there is none. From any thread.
/// Returns whether there was one.
///
/// # Safety
/// As for [`with`].
pub(super) unsafe fn cancel<T: Guarded>(handle: *mut Handle<T>) -> Result<bool, Denied> {
    if handle.is_null() {
        return Err(Denied::Null);
    }
    // SAFETY: the caller's promise, as in `enter`: nothing beyond the tag is touched before the tag is known to be ours.
    if !handle.is_aligned() || unsafe { (&raw const (*handle).tag).read() } != T::TAG {
        return Err(Denied::Foreign);
    }
    // SAFETY: the tag says that `Handle::leak` made it; only what is shared between threads is touched.
    let this = unsafe { &*handle };
    let busy = this.busy.load(Ordering::Acquire);
    if busy {
        this.allowance.cancel();
    }
    Ok(busy)
}

/// Tells this thread from all others that live.
fn this_thread() -> usize {
    thread_local!(static HERE: u8 = const { 0 });
    HERE.with(|here| std::ptr::from_ref(here) as usize)
}

/// Runs `callback`, inside which this thread gets `view` from [`offered`]; if it throws, [`with_callbacks`] takes that back.
///
/// # Safety
/// `handle` is live, and a call on it is under way on this thread, in [`with_callbacks`] and outside of [`caught`].
pub(super) unsafe fn offering<T: Guarded>(handle: *mut Handle<T>, view: *const c_void, callback: impl FnOnce()) {
    // SAFETY: the caller's promise; only atomics are touched.
    let this = unsafe { &*handle };
    this.thread.store(this_thread(), Ordering::Relaxed);
    this.offered.store(view.cast_mut(), Ordering::Release);
    callback();
    this.offered.store(std::ptr::null_mut(), Ordering::Release);
}

/// What [`offering`] lays open to a callback on this thread; null at any other time and place.
///
/// # Safety
/// As for [`with`].
pub(super) unsafe fn offered<T: Guarded>(handle: *mut Handle<T>) -> *const c_void {
    // SAFETY: the caller's promise, as in `enter`: nothing beyond the tag is touched before the tag is known to be ours.
    if handle.is_null() || !handle.is_aligned() || unsafe { (&raw const (*handle).tag).read() } != T::TAG {
        return std::ptr::null();
    }
    // SAFETY: the tag says that `Handle::leak` made it; only atomics are touched.
    let this = unsafe { &*handle };
    let view = this.offered.load(Ordering::Acquire);
    if !view.is_null() && this.thread.load(Ordering::Relaxed) == this_thread() { view } else { std::ptr::null() }
}

/// Runs `body`; a panic becomes its message, and prints nothing.
///
/// # Errors
/// The message of the panic.
pub(super) fn caught<R>(body: impl FnOnce() -> R) -> Result<R, String> {
    let _ours = floats::Ours::begin();
    hush();
    UNDER_WAY.fetch_add(1, Ordering::Relaxed);
    let outcome = catch_unwind(AssertUnwindSafe(body));
    UNDER_WAY.fetch_sub(1, Ordering::Relaxed);
    outcome.map_err(|payload| message_of(payload.as_ref()))
}

/// Puts a hook before the present one that stays silent while a guarded call is under way. Inside the shared library
/// `std` is private, so the host's own hook is another one and never sees this.
fn hush() {
    static ONCE: Once = Once::new();
    if ONCE.is_completed() || std::thread::panicking() {
        return;
    }
    ONCE.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if UNDER_WAY.load(Ordering::Relaxed) == 0 {
                before(info);
            }
        }));
    });
}

fn message_of(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|s| (*s).to_owned());
    text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_else(|| "panic without a message".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Counter {
        n: u32,
        why: Option<String>,
    }

    impl Guarded for Counter {
        const TAG: u64 = 0x1234_5678;
        fn allowance(&self) -> Arc<Allowance> {
            Arc::default()
        }
        fn poison(&mut self, why: String) {
            self.why = Some(why);
        }
    }

    struct Other;
    impl Guarded for Other {
        const TAG: u64 = 0x8765_4321;
        fn allowance(&self) -> Arc<Allowance> {
            Arc::default()
        }
        fn poison(&mut self, _: String) {}
    }

    #[test]
    fn refuses_null_foreign_busy_and_survives_a_panic() {
        let handle = Handle::leak(Counter { n: 0, why: None });
        // SAFETY: handles of this test, one thread.
        unsafe {
            assert_eq!(with::<Counter, _>(std::ptr::null_mut(), |c| c.n).unwrap_err(), Denied::Null);
            assert_eq!(with::<Other, _>(handle.cast(), |_| ()).unwrap_err(), Denied::Foreign);
            let inner = with(handle, |c| {
                c.n += 1;
                with(handle, |c| c.n).unwrap_err()
            });
            assert_eq!(inner, Ok(Denied::Busy));
            assert_eq!(with(handle, |_| -> u32 { panic!("planted {}", 7) }).unwrap_err(), Denied::Panicked);
            assert_eq!(with(handle, |c| (c.n, c.why.clone())), Ok((1, Some("planted 7".to_owned()))));
            Handle::free(handle);
            Handle::<Counter>::free(std::ptr::null_mut());
        }
    }
}
