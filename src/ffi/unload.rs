//! Destructors of thread-locals that let the library go.
//!
//! The C library keeps an image loaded while a thread-local of it waits for its destructor on any thread. Dependencies have such
//! thread-locals (scratch of matrix products), and they come to life on the host's thread; so a host that loads the component
//! from a new folder each time would keep every copy until that thread ends. Here a destructor runs when its thread ends or when
//! the image goes, whichever comes first, and holds nothing.
//!
//! `std` registers through this name if it is there; hidden, it is this library's own affair.

use std::cell::Cell;
use std::ffi::{c_int, c_void};
use std::sync::{Mutex, PoisonError};

type Destructor = unsafe extern "C" fn(*mut c_void);

#[cfg(target_arch = "x86_64")]
macro_rules! jump {
    () => {
        "jmp {register}"
    };
}
#[cfg(target_arch = "aarch64")]
macro_rules! jump {
    () => {
        "b {register}"
    };
}

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
std::arch::global_asm!(
    ".pushsection .text.cutis_thread_atexit,\"ax\",@progbits",
    ".globl __cxa_thread_atexit_impl",
    ".hidden __cxa_thread_atexit_impl",
    ".type __cxa_thread_atexit_impl,@function",
    "__cxa_thread_atexit_impl:",
    jump!(),
    ".popsection",
    register = sym register,
);

/// One thread-local that waits.
struct Waiting {
    thread: usize,
    destructor: Destructor,
    object: usize,
}

/// All of them, oldest first, and the key whose value tells that a thread ends.
struct Registry {
    waiting: Vec<Waiting>,
    key: Option<libc::pthread_key_t>,
}

static REGISTRY: Mutex<Registry> = Mutex::new(Registry { waiting: Vec::new(), key: None });

/// Tells this thread from all others that live, without a destructor of its own.
fn this_thread() -> usize {
    thread_local!(static HERE: Cell<u8> = const { Cell::new(0) });
    HERE.with(|here| std::ptr::from_ref(here) as usize)
}

unsafe extern "C" fn register(destructor: Destructor, object: *mut c_void, _image: *mut c_void) -> c_int {
    let thread = this_thread();
    let mut registry = REGISTRY.lock().unwrap_or_else(PoisonError::into_inner);
    if registry.key.is_none() {
        let mut key = 0;
        // SAFETY: a place for the key; `thread_ends` lives as long as the image, and `image_goes` deletes the key before.
        if unsafe { libc::pthread_key_create(&raw mut key, Some(thread_ends)) } == 0 {
            registry.key = Some(key);
        }
    }
    if let Some(key) = registry.key {
        // SAFETY: a key of ours; its value is never followed.
        unsafe { libc::pthread_setspecific(key, std::ptr::without_provenance(thread)) };
    }
    registry.waiting.push(Waiting { thread, destructor, object: object as usize });
    0
}

/// Destroys what waits on a thread, the youngest first; destructors may register more.
fn destroy(thread: usize) {
    loop {
        let next = {
            let mut registry = REGISTRY.lock().unwrap_or_else(PoisonError::into_inner);
            let found = registry.waiting.iter().rposition(|waiting| waiting.thread == thread);
            found.map(|k| registry.waiting.remove(k))
        };
        let Some(Waiting { destructor, object, .. }) = next else { return };
        // SAFETY: `std` registered this destructor for this object of this thread, which is the one that runs.
        unsafe { destructor(std::ptr::with_exposed_provenance_mut(object)) };
    }
}

unsafe extern "C" fn thread_ends(thread: *mut c_void) {
    destroy(thread.addr());
}

/// The image goes: with it goes what waits on this thread. What waits on others is memory that they no longer find, and a key
/// that would call into an image that is gone is deleted.
extern "C" fn image_goes() {
    destroy(this_thread());
    let mut registry = REGISTRY.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(key) = registry.key.take() {
        // SAFETY: a key of ours that nobody uses any more.
        unsafe { libc::pthread_key_delete(key) };
    }
    registry.waiting = Vec::new();
}

#[used]
#[unsafe(link_section = ".fini_array")]
static IMAGE_GOES: extern "C" fn() = image_goes;
