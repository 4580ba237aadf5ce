//! The C library: `include/cutis.h` is generated from this file.
//!
//! One opaque handle, one status, buffers that belong to the caller. Bodies translate and call.
#![allow(non_camel_case_types)]

use std::ffi::c_char;
use std::path::Path;
use std::sync::Arc;

use super::guard::{self, Denied, Guarded, Handle};
use super::instance::{Refusal, chain};
use super::pointer::{self, place};
use crate::error::Error;
use crate::load::{self, Loaded};
use crate::math::Vec3;
use crate::port::{Causality, Port, Type};
use crate::sim::{Allowance, Sim, SimError, SolveError, State};

/// Moves on a break of the binary interface only; names are added, their meaning never changes.
const ABI: u32 = 1;
/// Most steps of one cutis_sim_run_until.
const MOST_STEPS: f64 = 1e6;

/// What a call came to. Numbers are fixed for ever.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CutisStatus {
    /// Done.
    CUTIS_OK = 0,
    /// A handle or a required pointer is NULL, or the pointer is no handle of this kind.
    CUTIS_NULL = 1,
    /// A port index, length, type or value is not legal; nothing was changed.
    CUTIS_ARGUMENT = 2,
    /// The step or the equilibrium failed; the simulation stands where it stood before the call.
    CUTIS_STEP = 3,
    /// A saved state is damaged, or belongs to another scene or version; nothing was changed.
    CUTIS_STATE = 4,
    /// Another thread, or a callback, is inside this handle.
    CUTIS_BUSY = 5,
    /// A defect of the library was caught; only cutis_sim_message and cutis_sim_free still answer.
    CUTIS_PANIC = 6,
    /// cutis_sim_cancel ended the call; the simulation stands at its last accepted step.
    CUTIS_CANCELLED = 7,
}

/// Number type of a port. Numbers are fixed for ever.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CutisType {
    /// double
    CUTIS_FLOAT64 = 0,
    /// int32_t
    CUTIS_INT32 = 1,
    /// uint8_t, 0 or 1
    CUTIS_BOOLEAN = 2,
    /// There is no such port.
    CUTIS_NO_TYPE = -1,
}

/// Who writes a port. Numbers are fixed for ever.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CutisCausality {
    /// Simulation time, s.
    CUTIS_INDEPENDENT = 0,
    /// Set by the host before any step.
    CUTIS_INPUT = 1,
    /// Computed by each step.
    CUTIS_OUTPUT = 2,
    /// Set by the host before cutis_sim_initialise.
    CUTIS_PARAMETER = 3,
    /// Computed once from the scene.
    CUTIS_CALCULATED_PARAMETER = 4,
    /// A parameter that the host may set before any step, too.
    CUTIS_TUNABLE_PARAMETER = 5,
    /// There is no such port.
    CUTIS_NO_CAUSALITY = -1,
}

/// A face that moves: the scene, where it stands, and the solver's memory.
///
/// Every call computes in the default floating-point environment and gives the caller's back: traps and rounding modes of the
/// caller change no bit. What would not fit into memory at all is refused where the simulation is made; where the system runs out
/// of memory within a call, the process is aborted (allocation failure), as in most C++ libraries: make sure that
/// cutis_sim_memory bytes are there for each simulation.
///
/// Every function may be called from any thread, on one handle by one thread at a time; handles are independent. A handle
/// starts a thread only where its scene asks for one (`[solver] threads`, `background`), and ends it when it is freed.
pub struct CutisSim {
    // A `Handle<Inner>`, which callers and tools that compare interfaces need not see.
    _opaque: [u8; 0],
}

/// A saved state of a simulation; it is never changed, so any number of threads may restore from it.
pub struct CutisState {
    // A `Saved`.
    _opaque: [u8; 0],
}

struct Saved {
    tag: u64,
    state: State,
}

struct Inner {
    sim: Sim,
    message: String,
    warning: String,
    poisoned: bool,
    stage: Stage,
}

/// How far a simulation has come.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// At rest: parameters and time can be set.
    New,
    /// A state was restored or a start was set, which cutis_sim_initialise would drop.
    Set,
    /// Initialised, or stepped.
    Running,
}

impl Inner {
    /// Fixed parameters and the time are set before the start.
    fn before_start(&self, what: &str) -> Result<(), Failure> {
        match self.stage {
            Stage::New => Ok(()),
            Stage::Set | Stage::Running => Err(argument(format!(
                "{what} can be set before cutis_sim_initialise only; cutis_sim_reset goes back to there"
            ))),
        }
    }
}

impl Guarded for Inner {
    const TAG: u64 = u64::from_le_bytes(*b"cutisSIM");
    fn allowance(&self) -> Arc<Allowance> {
        self.sim.allowance().clone()
    }
    fn poison(&mut self, why: String) {
        self.message = format!("internal failure: {why}");
        self.poisoned = true;
    }
}

const STATE_TAG: u64 = u64::from_le_bytes(*b"cutisSTA");

/// Status and message of a call that failed.
struct Failure(CutisStatus, String);

impl From<Refusal> for Failure {
    fn from(refusal: Refusal) -> Self {
        Self(CutisStatus::CUTIS_NULL, refusal.message)
    }
}

fn argument(message: impl Into<String>) -> Failure {
    Failure(CutisStatus::CUTIS_ARGUMENT, message.into())
}

/// Runs `body` on a simulation; its failure becomes status and message.
///
/// # Safety
/// `sim` is null or came from a `cutis_sim_new_*` and was not freed.
unsafe fn with(sim: *mut CutisSim, body: impl FnOnce(&mut Inner) -> Result<(), Failure>) -> CutisStatus {
    let guarded = |inner: &mut Inner| {
        if inner.poisoned {
            return CutisStatus::CUTIS_PANIC;
        }
        match body(inner) {
            Ok(()) => CutisStatus::CUTIS_OK,
            Err(Failure(status, message)) => {
                inner.message = message;
                status
            }
        }
    };
    // SAFETY: behind a CutisSim pointer is a handle; the rest is the caller's promise.
    match unsafe { guard::with(sim.cast::<Handle<Inner>>(), guarded) } {
        Ok(status) => status,
        Err(Denied::Null | Denied::Foreign) => CutisStatus::CUTIS_NULL,
        Err(Denied::Busy) => CutisStatus::CUTIS_BUSY,
        Err(Denied::Panicked) => CutisStatus::CUTIS_PANIC,
    }
}

/// Asks something of a port; `otherwise` where there is no such port or handle.
///
/// # Safety
/// As for [`with`].
unsafe fn ask<R: Copy>(sim: *const CutisSim, port: usize, otherwise: R, answer: impl FnOnce(&Port) -> R) -> R {
    let mut told = otherwise;
    let body = |inner: &mut Inner| {
        told = answer(port_at(inner, port)?);
        Ok(())
    };
    // SAFETY: the caller's promise; nothing is written through the pointer but what the guard itself keeps.
    let _ = unsafe { with(sim.cast_mut(), body) };
    told
}

fn port_at(inner: &Inner, port: usize) -> Result<&Port, Failure> {
    let ports = inner.sim.model().ports();
    ports.get(port).ok_or_else(|| {
        argument(format!("there is no port {port}; ports are numbered from 0 to {}", ports.len().saturating_sub(1)))
    })
}

/// The port, if it has this type and `len` values.
fn exact(inner: &Inner, port: usize, ty: Type, len: usize) -> Result<&Port, Failure> {
    let found = port_at(inner, port)?;
    if found.ty != ty {
        return Err(argument(format!("`{}` is {:?}, not {ty:?}", found.name, found.ty)));
    }
    if found.len() != len {
        return Err(argument(format!("`{}` holds {} values, not {len}", found.name, found.len())));
    }
    Ok(found)
}

/// Copies `text` with its closing zero into `buffer` as far as it fits and returns the room the whole needs.
///
/// # Safety
/// `buffer` is null or holds `len` bytes.
unsafe fn copy_text(text: &str, buffer: *mut c_char, len: usize) -> usize {
    // SAFETY: the caller's promise.
    if let Ok(out) = unsafe { pointer::slice_mut(buffer.cast::<u8>(), len, "buffer") }
        && let Some(room) = out.len().checked_sub(1)
    {
        let mut n = text.len().min(room);
        while !text.is_char_boundary(n) {
            n -= 1;
        }
        out[..n].copy_from_slice(&text.as_bytes()[..n]);
        out[n] = 0;
    }
    text.len() + 1
}

/// The new simulation, or null and the reason in `why`.
///
/// # Safety
/// `why` is null or holds `why_len` bytes.
unsafe fn new_sim(why: *mut c_char, why_len: usize, load: impl FnOnce() -> Result<Loaded, String>) -> *mut CutisSim {
    let made = guard::caught(|| Sim::new(Arc::new(load()?.model)).map_err(|why| chain(&why)));
    match made.unwrap_or_else(|why| Err(format!("internal failure: {why}"))) {
        Ok(sim) => {
            let warning = sim.model().warnings().join("\n");
            Handle::leak(Inner { sim, message: String::new(), warning, poisoned: false, stage: Stage::New }).cast()
        }
        Err(reason) => {
            // SAFETY: the caller's promise.
            unsafe { copy_text(&reason, why, why_len) };
            std::ptr::null_mut()
        }
    }
}

fn in_words(why: Error) -> String {
    chain(&why)
}

/// Version of the library, for example "0.1.0"; the string lives as long as the library.
#[unsafe(no_mangle)]
pub extern "C" fn cutis_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    VERSION.as_ptr().cast()
}

/// Number of the binary interface; equal to CUTIS_ABI of the header a program was compiled with, or it must not go on.
#[unsafe(no_mangle)]
pub extern "C" fn cutis_abi() -> u32 {
    ABI
}

/// A simulation of the scene file at `path` (UTF-8), at rest at t = 0 s; the mesh it names lies relative to it.
///
/// Returns NULL on failure; the reason is then in `why`, cut to `why_len` bytes with its closing zero. `why` may be NULL.
/// A factor or a volume that the machine has no memory for is such a failure, with the bytes wanted; what else runs out of memory
/// aborts the process (see CutisSim). Free with cutis_sim_free.
///
/// # Safety
/// `path` is NULL or a zero-terminated string; `why` is NULL or holds `why_len` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_new_from_file(
    path: *const c_char,
    why: *mut c_char,
    why_len: usize,
) -> *mut CutisSim {
    // SAFETY: the caller's promise about `path` and `why`.
    unsafe {
        let path = pointer::text(path);
        new_sim(why, why_len, || {
            load::from_file(Path::new(path.ok_or("`path` is NULL or not UTF-8")?)).map_err(in_words)
        })
    }
}

/// A simulation of a scene given as text (UTF-8 TOML), at rest at t = 0 s. A mesh file it names lies relative to
/// `folder`, or to the working folder where `folder` is NULL.
///
/// Returns NULL on failure; the reason is then in `why`, cut to `why_len` bytes with its closing zero. `why` may be NULL.
/// A factor or a volume that the machine has no memory for is such a failure, with the bytes wanted; what else runs out of memory
/// aborts the process (see CutisSim). Free with cutis_sim_free.
///
/// # Safety
/// `scene` and `folder` are NULL or zero-terminated strings; `why` is NULL or holds `why_len` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_new_from_text(
    scene: *const c_char,
    folder: *const c_char,
    why: *mut c_char,
    why_len: usize,
) -> *mut CutisSim {
    // SAFETY: the caller's promise about `scene`, `folder` and `why`.
    unsafe {
        let (scene, named) = (pointer::text(scene), pointer::text(folder));
        new_sim(why, why_len, || {
            let scene = scene.ok_or("`scene` is NULL or not UTF-8")?;
            if !folder.is_null() && named.is_none() {
                return Err("`folder` is not UTF-8".to_owned());
            }
            load::from_text(scene, named.map(Path::new)).map_err(in_words)
        })
    }
}

/// A simulation of a baked scene, at rest at t = 0 s: `scene` is the text (UTF-8 TOML) whose `[mesh] file` is
/// "model.cutis", and the `len` bytes at `mesh` are what that file would hold. `cutis fmu` packs both under resources/. No
/// file is read.
///
/// Returns NULL on failure; the reason is then in `why`, cut to `why_len` bytes with its closing zero. `why` may be NULL.
/// A factor or a volume that the machine has no memory for is such a failure, with the bytes wanted; what else runs out of memory
/// aborts the process (see CutisSim). Free with cutis_sim_free.
///
/// # Safety
/// `scene` is NULL or a zero-terminated string; `mesh` is NULL or holds `len` bytes; `why` is NULL or holds `why_len` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_new_from_baked(
    scene: *const c_char,
    mesh: *const u8,
    len: usize,
    why: *mut c_char,
    why_len: usize,
) -> *mut CutisSim {
    // SAFETY: the caller's promise about `scene`, `mesh` and `why`.
    unsafe {
        let (scene, mesh) = (pointer::text(scene), pointer::slice(mesh, len, "mesh"));
        new_sim(why, why_len, || {
            let scene = scene.ok_or("`scene` is NULL or not UTF-8")?.to_owned();
            let mesh = mesh.map_err(|refusal| refusal.message)?.to_vec();
            load::Baked { scene, mesh, notes: Vec::new() }.load().map_err(in_words)
        })
    }
}

/// A simulation of the scene inside the library, a synthetic head, at rest at t = 0 s. No file is read.
///
/// Returns NULL on failure; the reason is then in `why`, cut to `why_len` bytes with its closing zero. `why` may be NULL.
/// A factor or a volume that the machine has no memory for is such a failure, with the bytes wanted; what else runs out of memory
/// aborts the process (see CutisSim). Free with cutis_sim_free.
///
/// # Safety
/// `why` is NULL or holds `why_len` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_new_default(why: *mut c_char, why_len: usize) -> *mut CutisSim {
    // SAFETY: the caller's promise about `why`.
    unsafe { new_sim(why, why_len, || load::embedded().map_err(in_words)) }
}

/// Ends a simulation. NULL is no error. Saved states live on until cutis_state_free.
///
/// # Safety
/// `sim` is NULL or came from a cutis_sim_new function, was not freed, and no other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_free(sim: *mut CutisSim) {
    // SAFETY: the caller's promise.
    unsafe { Handle::free(sim.cast::<Handle<Inner>>()) }
}

/// Why the last call on `sim` that failed did so, in words.
///
/// Copies into `buffer` as far as `len` bytes hold it, always with a closing zero, and returns the bytes the whole
/// needs, closing zero included; 0 for NULL or busy handles. Ask with `len` 0 first.
///
/// # Safety
/// `sim` is NULL or a live handle; `buffer` is NULL or holds `len` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_message(sim: *const CutisSim, buffer: *mut c_char, len: usize) -> usize {
    // SAFETY: the caller's promise.
    unsafe { guard::with(sim.cast_mut().cast::<Handle<Inner>>(), |inner| copy_text(&inner.message, buffer, len)) }
        .unwrap_or(0)
}

/// What to know about the last cutis_sim_step, cutis_sim_run_until or cutis_sim_initialise that was done, or about the scene before the
/// first: one line each, empty as a rule. Inverted elements and jumps between bones are told here.
///
/// Copies as cutis_sim_message does.
///
/// # Safety
/// `sim` is NULL or a live handle; `buffer` is NULL or holds `len` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_warning(sim: *const CutisSim, buffer: *mut c_char, len: usize) -> usize {
    // SAFETY: the caller's promise.
    unsafe { guard::with(sim.cast_mut().cast::<Handle<Inner>>(), |inner| copy_text(&inner.warning, buffer, len)) }
        .unwrap_or(0)
}

/// Number of ports: everything a host can set or get. They keep their order for the life of the handle.
///
/// # Safety
/// `sim` is NULL or a live handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_port_count(sim: *const CutisSim) -> usize {
    let mut n = 0;
    let body = |inner: &mut Inner| {
        n = inner.sim.model().ports().len();
        Ok(())
    };
    // SAFETY: the caller's promise.
    let _ = unsafe { with(sim.cast_mut(), body) };
    n
}

/// Index of the port of this name, for example "bone.translation"; SIZE_MAX where there is none.
///
/// # Safety
/// `sim` is NULL or a live handle; `name` is NULL or a zero-terminated string.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_port_find(sim: *const CutisSim, name: *const c_char) -> usize {
    let mut found = usize::MAX;
    let body = |inner: &mut Inner| {
        // SAFETY: the caller's promise.
        let name = unsafe { pointer::text(name) }
            .ok_or_else(|| Failure(CutisStatus::CUTIS_NULL, "`name` is NULL or not UTF-8".to_owned()))?;
        let ports = inner.sim.model().ports();
        found = ports.iter().position(|p| p.name == name).ok_or_else(|| {
            let names: Vec<&str> = ports.iter().map(|p| p.name.as_str()).collect();
            argument(format!("no port is named `{name}`; there are {}", names.join(", ")))
        })?;
        Ok(())
    };
    // SAFETY: the caller's promise.
    let _ = unsafe { with(sim.cast_mut(), body) };
    found
}

/// Name of a port. Copies as cutis_sim_message does; 0 where there is no such port.
///
/// # Safety
/// `sim` is NULL or a live handle; `buffer` is NULL or holds `len` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_port_name(sim: *const CutisSim, port: usize, buffer: *mut c_char, len: usize) -> usize {
    // SAFETY: the caller's promise.
    unsafe { ask(sim, port, 0, |p| copy_text(&p.name, buffer, len)) }
}

/// SI unit of a port, "1" for none. Copies as cutis_sim_message does; 0 where there is no such port.
///
/// # Safety
/// `sim` is NULL or a live handle; `buffer` is NULL or holds `len` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_port_unit(sim: *const CutisSim, port: usize, buffer: *mut c_char, len: usize) -> usize {
    // SAFETY: the caller's promise.
    unsafe { ask(sim, port, 0, |p| copy_text(p.unit, buffer, len)) }
}

/// One sentence about a port. Copies as cutis_sim_message does; 0 where there is no such port.
///
/// # Safety
/// `sim` is NULL or a live handle; `buffer` is NULL or holds `len` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_port_description(
    sim: *const CutisSim,
    port: usize,
    buffer: *mut c_char,
    len: usize,
) -> usize {
    // SAFETY: the caller's promise.
    unsafe { ask(sim, port, 0, |p| copy_text(&p.description, buffer, len)) }
}

/// Name of a row of a port: of the bone, load or marker that row `row` of its first dimension belongs to. Copies as
/// cutis_sim_message does; 0 where there is no such port or its rows have no names.
///
/// # Safety
/// `sim` is NULL or a live handle; `buffer` is NULL or holds `len` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_port_row(
    sim: *const CutisSim,
    port: usize,
    row: usize,
    buffer: *mut c_char,
    len: usize,
) -> usize {
    // SAFETY: the caller's promise.
    unsafe { ask(sim, port, 0, |p| p.rows.get(row).map_or(0, |name| copy_text(name, buffer, len))) }
}

/// Number of dimensions of a port, 0 for a scalar; also 0 where there is no such port.
///
/// # Safety
/// `sim` is NULL or a live handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_port_rank(sim: *const CutisSim, port: usize) -> usize {
    // SAFETY: the caller's promise.
    unsafe { ask(sim, port, 0, |p| p.shape.len()) }
}

/// Extent of one dimension of a port, counted from 0, slowest first; 0 where there is none.
///
/// # Safety
/// `sim` is NULL or a live handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_port_dim(sim: *const CutisSim, port: usize, dimension: usize) -> usize {
    // SAFETY: the caller's promise.
    unsafe { ask(sim, port, 0, |p| p.shape.get(dimension).copied().unwrap_or(0)) }
}

/// Number of values of a port: the product of its dimensions, 1 for a scalar; 0 where there is no such port.
///
/// # Safety
/// `sim` is NULL or a live handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_port_len(sim: *const CutisSim, port: usize) -> usize {
    // SAFETY: the caller's promise.
    unsafe { ask(sim, port, 0, Port::len) }
}

/// Number type of a port; CUTIS_NO_TYPE where there is no such port.
///
/// # Safety
/// `sim` is NULL or a live handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_port_type(sim: *const CutisSim, port: usize) -> CutisType {
    let answer = |p: &Port| match p.ty {
        Type::Float64 => CutisType::CUTIS_FLOAT64,
        Type::Int32 => CutisType::CUTIS_INT32,
        Type::Boolean => CutisType::CUTIS_BOOLEAN,
    };
    // SAFETY: the caller's promise.
    unsafe { ask(sim, port, CutisType::CUTIS_NO_TYPE, answer) }
}

/// Who writes a port; CUTIS_NO_CAUSALITY where there is no such port.
///
/// # Safety
/// `sim` is NULL or a live handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_port_causality(sim: *const CutisSim, port: usize) -> CutisCausality {
    let answer = |p: &Port| match p.causality {
        Causality::Independent => CutisCausality::CUTIS_INDEPENDENT,
        Causality::Input => CutisCausality::CUTIS_INPUT,
        Causality::Output | Causality::Local => CutisCausality::CUTIS_OUTPUT,
        Causality::Parameter => CutisCausality::CUTIS_PARAMETER,
        Causality::TunableParameter => CutisCausality::CUTIS_TUNABLE_PARAMETER,
        Causality::CalculatedParameter => CutisCausality::CUTIS_CALCULATED_PARAMETER,
    };
    // SAFETY: the caller's promise.
    unsafe { ask(sim, port, CutisCausality::CUTIS_NO_CAUSALITY, answer) }
}

/// Smallest and largest legal value of each element of a port, in its SI unit; minus and plus infinity where there is no
/// such bound.
///
/// CUTIS_ARGUMENT: no such port; nothing is written then.
///
/// # Safety
/// `sim` is NULL or a live handle; `smallest` and `largest` are NULL or the place of a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_port_range(
    sim: *const CutisSim,
    port: usize,
    smallest: *mut f64,
    largest: *mut f64,
) -> CutisStatus {
    let body = |inner: &mut Inner| {
        let port = port_at(inner, port)?;
        // SAFETY: the caller's promise.
        let (smallest, largest) = unsafe { (place(smallest, "smallest")?, place(largest, "largest")?) };
        *smallest = port.min.unwrap_or(f64::NEG_INFINITY);
        *largest = port.max.unwrap_or(f64::INFINITY);
        Ok(())
    };
    // SAFETY: the caller's promise; nothing is written through the pointer but what the guard itself keeps.
    unsafe { with(sim.cast_mut(), body) }
}

/// Sets all values of an input or parameter, row-major, in the port's SI unit. Nothing is computed or allocated.
///
/// CUTIS_ARGUMENT: no such port, it cannot be set (a CUTIS_PARAMETER after cutis_sim_initialise), `len` is not its length, a
/// value is not finite or out of the range that cutis_port_range tells, or it moves or pushes a bone that is not driven that way;
/// nothing was set then.
///
/// # Safety
/// `sim` is NULL or a live handle; `values` is NULL or holds `len` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_set_f64(
    sim: *mut CutisSim,
    port: usize,
    values: *const f64,
    len: usize,
) -> CutisStatus {
    let body = |inner: &mut Inner| {
        let found = exact(inner, port, Type::Float64, len)?;
        if !found.is_settable() {
            return Err(argument(format!("`{}` cannot be set: it is {:?}", found.name, found.causality)));
        }
        if found.causality == Causality::Parameter {
            inner.before_start(&format!("`{}`", found.name))?;
        }
        // SAFETY: the caller's promise.
        let values = unsafe { pointer::slice(values, len, "values")? };
        let legal =
            |v: &f64| v.is_finite() && found.min.is_none_or(|min| *v >= min) && found.max.is_none_or(|max| *v <= max);
        if let Some(k) = values.iter().position(|v| !legal(v)) {
            return Err(argument(format!(
                "element {k} of `{}` was set to {} {}, wanted a finite value from {} to {}",
                found.name,
                values[k],
                found.unit,
                found.min.unwrap_or(f64::NEG_INFINITY),
                found.max.unwrap_or(f64::INFINITY)
            )));
        }
        inner.sim.set_f64(port, 0, values).map_err(|why| argument(chain(&why)))
    };
    // SAFETY: the caller's promise.
    unsafe { with(sim, body) }
}

/// Copies all values of a Float64 port, row-major, in its SI unit. Nothing is computed or allocated.
///
/// CUTIS_ARGUMENT: no such port, another type, or `len` is not its length; `values` is untouched then.
///
/// # Safety
/// `sim` is NULL or a live handle; `values` is NULL or holds `len` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_get_f64(
    sim: *const CutisSim,
    port: usize,
    values: *mut f64,
    len: usize,
) -> CutisStatus {
    let body = |inner: &mut Inner| {
        exact(inner, port, Type::Float64, len)?;
        // SAFETY: the caller's promise.
        let out = unsafe { pointer::slice_mut(values, len, "values")? };
        inner.sim.get_f64(port, 0, out).map_err(|why| argument(chain(&why)))
    };
    // SAFETY: the caller's promise.
    unsafe { with(sim.cast_mut(), body) }
}

/// Sets all values of an Int32 parameter: of "solver.mostSolves", the linear solves that a step may take at most. Nothing is
/// computed or allocated.
///
/// CUTIS_ARGUMENT: no such port, it cannot be set, `len` is not its length, or a value is out of range; nothing was set then.
///
/// # Safety
/// `sim` is NULL or a live handle; `values` is NULL or holds `len` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_set_i32(
    sim: *mut CutisSim,
    port: usize,
    values: *const i32,
    len: usize,
) -> CutisStatus {
    let body = |inner: &mut Inner| {
        exact(inner, port, Type::Int32, len)?;
        // SAFETY: the caller's promise.
        let values = unsafe { pointer::slice(values, len, "values")? };
        inner.sim.set_i32(port, 0, values).map_err(|why| argument(chain(&why)))
    };
    // SAFETY: the caller's promise.
    unsafe { with(sim, body) }
}

/// Copies all values of an Int32 port, row-major. Nothing is computed or allocated.
///
/// CUTIS_ARGUMENT: no such port, another type, or `len` is not its length; `values` is untouched then.
///
/// # Safety
/// `sim` is NULL or a live handle; `values` is NULL or holds `len` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_get_i32(
    sim: *const CutisSim,
    port: usize,
    values: *mut i32,
    len: usize,
) -> CutisStatus {
    let body = |inner: &mut Inner| {
        exact(inner, port, Type::Int32, len)?;
        // SAFETY: the caller's promise.
        let out = unsafe { pointer::slice_mut(values, len, "values")? };
        inner.sim.get_i32(port, 0, out).map_err(|why| argument(chain(&why)))
    };
    // SAFETY: the caller's promise.
    unsafe { with(sim.cast_mut(), body) }
}

/// Copies all values of a Boolean port, row-major, as 0 and 1. Nothing is computed or allocated.
///
/// CUTIS_ARGUMENT: no such port, another type, or `len` is not its length; `values` is untouched then.
///
/// # Safety
/// `sim` is NULL or a live handle; `values` is NULL or holds `len` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_get_bool(
    sim: *const CutisSim,
    port: usize,
    values: *mut u8,
    len: usize,
) -> CutisStatus {
    let body = |inner: &mut Inner| {
        exact(inner, port, Type::Boolean, len)?;
        // SAFETY: the caller's promise.
        let out = unsafe { pointer::slice_mut(values, len, "values")? };
        for (offset, place) in out.iter_mut().enumerate() {
            let mut one = [false];
            inner.sim.get_bool(port, offset, &mut one).map_err(|why| argument(chain(&why)))?;
            *place = u8::from(one[0]);
        }
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { with(sim.cast_mut(), body) }
}

/// Sets the start time, s; before cutis_sim_initialise.
///
/// CUTIS_ARGUMENT: `time` is not finite, or the simulation was initialised, stepped or restored and not reset since.
///
/// # Safety
/// `sim` is NULL or a live handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_set_time(sim: *mut CutisSim, time: f64) -> CutisStatus {
    let body = |inner: &mut Inner| {
        if !time.is_finite() {
            return Err(argument(format!("time {time} is not finite")));
        }
        inner.before_start("the time")?;
        inner.sim.set_time(time);
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { with(sim, body) }
}

/// Finds the equilibrium at the start values of inputs and parameters, from rest; no time passes. Call it once, before stepping.
///
/// CUTIS_STEP: there is none within the solver's means; nothing has changed. CUTIS_ARGUMENT: a state was restored or positions
/// were set and no step made since, which would be dropped: step on, or call cutis_sim_reset first.
///
/// # Safety
/// `sim` is NULL or a live handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_initialise(sim: *mut CutisSim) -> CutisStatus {
    let body = |inner: &mut Inner| {
        if inner.stage == Stage::Set {
            let why = "a state was restored or positions were set, which initialising would drop: step on from there, or \
                       call cutis_sim_reset first";
            return Err(argument(why));
        }
        let report = inner.sim.initialise().map_err(failed)?;
        inner.stage = Stage::Running;
        inner.warning = report.warnings.join("\n");
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { with(sim, body) }
}

/// Advances by `dt` seconds with the inputs as they stand now.
///
/// CUTIS_ARGUMENT: `dt` is not positive and finite. CUTIS_STEP: the step failed, or would have taken more linear solves than
/// solver.mostSolves. CUTIS_CANCELLED: cutis_sim_cancel was called meanwhile. In all cases the simulation stands at its last
/// accepted step.
///
/// # Safety
/// `sim` is NULL or a live handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_step(sim: *mut CutisSim, dt: f64) -> CutisStatus {
    let body = |inner: &mut Inner| {
        if !(dt.is_finite() && dt > 0.0) {
            return Err(argument(format!("step size {dt} is not positive and finite")));
        }
        let report = inner.sim.step(dt).map_err(failed)?;
        inner.stage = Stage::Running;
        inner.warning = report.warnings.join("\n");
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { with(sim, body) }
}

/// Advances to time `t` (s) in equal steps of at most `dt` seconds, with the inputs as they stand now; nothing is done where
/// `t` is the time already.
///
/// CUTIS_ARGUMENT: `t` lies before the time or is not finite, `dt` is not positive and finite, or it would take more than a
/// million steps. CUTIS_STEP, CUTIS_CANCELLED: as for cutis_sim_step; the simulation then stands at its last accepted step, and cutis_sim_time tells
/// how far it came.
///
/// # Safety
/// `sim` is NULL or a live handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_run_until(sim: *mut CutisSim, t: f64, dt: f64) -> CutisStatus {
    let body = |inner: &mut Inner| {
        let left = t - inner.sim.time();
        if !(left.is_finite() && left >= 0.0) {
            return Err(argument(format!("time {t} s does not lie ahead of {} s", inner.sim.time())));
        }
        if !(dt.is_finite() && dt > 0.0) {
            return Err(argument(format!("step size {dt} is not positive and finite")));
        }
        // What rounding leaves over is no further step.
        let steps = (left / dt * (1.0 - 1e-12)).ceil();
        if steps > MOST_STEPS {
            return Err(argument(format!("{left} s in steps of {dt} s are more than {MOST_STEPS} steps")));
        }
        let mut warnings = Vec::new();
        for to_go in (1..=steps as u32).rev() {
            let step = (t - inner.sim.time()) / f64::from(to_go);
            let report = inner.sim.step(step).map_err(failed)?;
            inner.stage = Stage::Running;
            warnings.extend(report.warnings);
            inner.warning = warnings.join("\n");
        }
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { with(sim, body) }
}

/// Ends the cutis_sim_initialise, cutis_sim_step or cutis_sim_run_until that is under way on another thread before its next linear
/// solve: that call then answers CUTIS_CANCELLED, and the simulation stands at its last accepted step. Nothing where no call is
/// under way. The one function that may be called while another thread is inside the handle.
///
/// # Safety
/// `sim` is NULL or a live handle that is not freed meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_cancel(sim: *mut CutisSim) -> CutisStatus {
    // SAFETY: behind a CutisSim pointer is a handle; the rest is the caller's promise.
    match unsafe { guard::cancel(sim.cast::<Handle<Inner>>()) } {
        Ok(_) => CutisStatus::CUTIS_OK,
        Err(_) => CutisStatus::CUTIS_NULL,
    }
}

/// Number of nodes of the solver's mesh; 0 for NULL, busy and failed handles. The skin is part of them, or rides on them.
///
/// # Safety
/// `sim` is NULL or a live handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_node_count(sim: *const CutisSim) -> usize {
    let mut n = 0;
    let body = |inner: &mut Inner| {
        n = inner.sim.model().mesh().nodes.len();
        Ok(())
    };
    // SAFETY: the caller's promise.
    let _ = unsafe { with(sim.cast_mut(), body) };
    n
}

/// Copies the current positions of all nodes, m: three numbers a node.
///
/// CUTIS_ARGUMENT: `len` is not three times cutis_node_count; `positions` is untouched then.
///
/// # Safety
/// `sim` is NULL or a live handle; `positions` is NULL or holds `len` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_nodes(sim: *const CutisSim, positions: *mut f64, len: usize) -> CutisStatus {
    let body = |inner: &mut Inner| {
        // SAFETY: the caller's promise.
        let out = unsafe { pointer::slice_mut(positions, len, "positions")? };
        let x = inner.sim.positions();
        if out.len() != 3 * x.len() {
            return Err(argument(format!("{} nodes have {} coordinates, not {len}", x.len(), 3 * x.len())));
        }
        out.chunks_exact_mut(3).zip(x).for_each(|(out, x)| out.copy_from_slice(x.as_slice()));
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { with(sim.cast_mut(), body) }
}

/// Puts the nodes that no bone holds at `positions` (m, three numbers for each node of cutis_sim_nodes): the next step seeks the
/// equilibrium from there. Nodes of bones, time, velocities and outputs stay as they are until then.
///
/// CUTIS_ARGUMENT: `len` is not three times cutis_node_count, or a position is not finite; nothing has changed then.
///
/// # Safety
/// `sim` is NULL or a live handle; `positions` is NULL or holds `len` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_start_from(sim: *mut CutisSim, positions: *const f64, len: usize) -> CutisStatus {
    let body = |inner: &mut Inner| {
        // SAFETY: the caller's promise.
        let positions = unsafe { pointer::slice(positions, len, "positions")? };
        let wanted = 3 * inner.sim.model().mesh().nodes.len();
        if len != wanted {
            return Err(argument(format!("{} nodes have {wanted} coordinates, not {len}", wanted / 3)));
        }
        let x: Vec<Vec3> = positions.chunks_exact(3).map(Vec3::from_column_slice).collect();
        inner.sim.start_from(&x).map_err(|why| match why {
            SimError::StartLength { .. } | SimError::StartNotFinite { .. } => argument(chain(&why)),
            _ => failed(why),
        })?;
        inner.stage = Stage::Set;
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { with(sim, body) }
}

/// Bytes of matrices, factor and solver of a simulation, its model and state left out; 0 for NULL, busy and failed handles.
///
/// # Safety
/// `sim` is NULL or a live handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_memory(sim: *const CutisSim) -> usize {
    let mut bytes = 0;
    let body = |inner: &mut Inner| {
        bytes = inner.sim.memory();
        Ok(())
    };
    // SAFETY: the caller's promise.
    let _ = unsafe { with(sim.cast_mut(), body) };
    bytes
}

/// Change of `unknowns` with `knowns` along `seed`: the Jacobian of the last accepted equilibrium times a vector; in scenes with
/// inertia or memory that of the last step (of its last piece, where it was cut), the state before it held.
///
/// `unknowns` are Float64 outputs (of skin, markers, bones, contacts and energies; not those of solver and quality) or inputs,
/// `knowns` are inputs and parameters; arrays hold the values of their ports one after another,
/// row-major, in SI units. The simulation does not change; one linear solve, and a factorisation where the state is new.
///
/// CUTIS_ARGUMENT: no such ports, the seed is not finite, or `seed_len` or `sensitivity_len` are not the values of `knowns` and `unknowns`. CUTIS_STEP:
/// there is no equilibrium yet, or in scenes with inertia or memory positions were set since the last step. `sensitivity` is then of
/// no use.
///
/// # Safety
/// `sim` is NULL or a live handle; each pointer is NULL or holds as many elements as the length after it says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_directional_derivative(
    sim: *mut CutisSim,
    unknowns: *const usize,
    n_unknowns: usize,
    knowns: *const usize,
    n_knowns: usize,
    seed: *const f64,
    seed_len: usize,
    sensitivity: *mut f64,
    sensitivity_len: usize,
) -> CutisStatus {
    let body = |inner: &mut Inner| {
        // SAFETY: the caller's promise.
        let (unknowns, knowns, seed, out) = unsafe {
            (
                pointer::slice(unknowns, n_unknowns, "unknowns")?,
                pointer::slice(knowns, n_knowns, "knowns")?,
                pointer::slice(seed, seed_len, "seed")?,
                pointer::slice_mut(sensitivity, sensitivity_len, "sensitivity")?,
            )
        };
        inner.sim.directional_derivative(knowns, seed, unknowns, out).map_err(no_derivative)
    };
    // SAFETY: the caller's promise.
    unsafe { with(sim, body) }
}

/// Gradient of the `unknowns` weighted by `seed` by all `knowns` at once: the transposed Jacobian times a vector.
///
/// `unknowns` are Float64 outputs (of skin, markers, bones, contacts and energies; not those of solver and quality) or inputs,
/// `knowns` are inputs and parameters; arrays hold the values of their ports one after another,
/// row-major, in SI units. The simulation does not change; one linear solve, and a factorisation where the state is new.
///
/// CUTIS_ARGUMENT: no such ports, the seed is not finite, or `seed_len` or `sensitivity_len` are not the values of `unknowns` and `knowns`. CUTIS_STEP:
/// there is no equilibrium yet, or in scenes with inertia or memory positions were set since the last step. `sensitivity` is then of
/// no use.
///
/// # Safety
/// `sim` is NULL or a live handle; each pointer is NULL or holds as many elements as the length after it says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_adjoint_derivative(
    sim: *mut CutisSim,
    unknowns: *const usize,
    n_unknowns: usize,
    knowns: *const usize,
    n_knowns: usize,
    seed: *const f64,
    seed_len: usize,
    sensitivity: *mut f64,
    sensitivity_len: usize,
) -> CutisStatus {
    let body = |inner: &mut Inner| {
        // SAFETY: the caller's promise.
        let (unknowns, knowns, seed, out) = unsafe {
            (
                pointer::slice(unknowns, n_unknowns, "unknowns")?,
                pointer::slice(knowns, n_knowns, "knowns")?,
                pointer::slice(seed, seed_len, "seed")?,
                pointer::slice_mut(sensitivity, sensitivity_len, "sensitivity")?,
            )
        };
        inner.sim.adjoint_derivative(unknowns, seed, knowns, out).map_err(no_derivative)
    };
    // SAFETY: the caller's promise.
    unsafe { with(sim, body) }
}

/// A derivative that the scene or the moment does not have is no slip of the caller.
fn no_derivative(why: SimError) -> Failure {
    match why {
        SimError::Port { .. } | SimError::Range { .. } | SimError::SeedNotFinite(_) => argument(chain(&why)),
        _ => failed(why),
    }
}

/// A step, an equilibrium or a derivative that was not found, or is wanted no more.
fn failed(why: SimError) -> Failure {
    let status = match &why {
        SimError::Solve { source: SolveError::Cancelled, .. } | SimError::Setup(SolveError::Cancelled) => {
            CutisStatus::CUTIS_CANCELLED
        }
        _ => CutisStatus::CUTIS_STEP,
    };
    Failure(status, chain(&why))
}

/// Simulation time, s; NaN for NULL, busy and failed handles.
///
/// # Safety
/// `sim` is NULL or a live handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_time(sim: *const CutisSim) -> f64 {
    let mut time = f64::NAN;
    let body = |inner: &mut Inner| {
        time = inner.sim.time();
        Ok(())
    };
    // SAFETY: the caller's promise.
    let _ = unsafe { with(sim.cast_mut(), body) };
    time
}

/// Back to rest, t = 0 s and the start values of the scene, as if new.
///
/// # Safety
/// `sim` is NULL or a live handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_reset(sim: *mut CutisSim) -> CutisStatus {
    let body = |inner: &mut Inner| {
        inner.sim.reset();
        inner.stage = Stage::New;
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { with(sim, body) }
}

/// A copy of all that moves: time, positions, inputs, history. NULL on failure. Free with cutis_state_free.
///
/// # Safety
/// `sim` is NULL or a live handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_save(sim: *const CutisSim) -> *mut CutisState {
    let mut saved = std::ptr::null_mut();
    let body = |inner: &mut Inner| {
        saved = leak(inner.sim.save());
        Ok(())
    };
    // SAFETY: the caller's promise.
    let _ = unsafe { with(sim.cast_mut(), body) };
    saved
}

/// Moves `state` to the heap and gives away its address; cutis_state_free takes it back.
fn leak(state: State) -> *mut CutisState {
    Box::into_raw(Box::new(Saved { tag: STATE_TAG, state })).cast()
}

/// The state behind a pointer.
///
/// # Safety
/// `state` is null or came from `cutis_sim_save` or `cutis_state_deserialize` and was not freed.
unsafe fn state_at<'a>(state: *const CutisState) -> Result<&'a Saved, Failure> {
    // SAFETY: the caller's promise; the tag is read before anything else.
    match unsafe { state.cast::<Saved>().as_ref() } {
        Some(state) if state.tag == STATE_TAG => Ok(state),
        _ => Err(Failure(CutisStatus::CUTIS_NULL, "the state is NULL, or no state".to_owned())),
    }
}

/// The same, if it is one of this simulation's model.
///
/// # Safety
/// As for [`state_at`].
unsafe fn own_state<'a>(inner: &Inner, state: *const CutisState) -> Result<&'a State, Failure> {
    // SAFETY: the caller's promise.
    let state = unsafe { &state_at(state)?.state };
    state.belongs_to(inner.sim.model()).map_err(|why| Failure(CutisStatus::CUTIS_STATE, chain(&why)))?;
    Ok(state)
}

/// Goes back to a saved state: from then on every step has the same bits as after the save. A simulation that is new goes on from
/// there, too: it is not to be initialised then.
///
/// CUTIS_STATE: it belongs to another scene, be it one of the same mesh with another material; nothing was changed.
///
/// # Safety
/// `sim` is NULL or a live handle; `state` is NULL or a live state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_restore(sim: *mut CutisSim, state: *const CutisState) -> CutisStatus {
    let body = |inner: &mut Inner| {
        // SAFETY: the caller's promise.
        let state = unsafe { state_at(state)? };
        inner.sim.restore(&state.state).map_err(|why| Failure(CutisStatus::CUTIS_STATE, chain(&why)))?;
        inner.stage = if inner.sim.is_settled() { Stage::Set } else { Stage::New };
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { with(sim, body) }
}

/// Frees a saved state. NULL is no error.
///
/// # Safety
/// `state` is NULL or a live state that no other thread uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_state_free(state: *mut CutisState) {
    // SAFETY: the caller's promise.
    if unsafe { state_at(state) }.is_ok() {
        // SAFETY: not null and ours, so it came from `Box::into_raw`.
        let mut owned = unsafe { Box::from_raw(state.cast::<Saved>()) };
        owned.tag = 0;
        let _ = guard::caught(move || drop(owned));
    }
}

/// Bytes that cutis_state_serialize needs for `state`; 0 on failure, and for a state of another scene.
///
/// # Safety
/// `sim` is NULL or a live handle; `state` is NULL or a live state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_state_size(sim: *const CutisSim, state: *const CutisState) -> usize {
    let mut size = 0;
    let body = |inner: &mut Inner| {
        // SAFETY: the caller's promise.
        size = unsafe { own_state(inner, state)? }.to_bytes(inner.sim.model()).len();
        Ok(())
    };
    // SAFETY: the caller's promise.
    let _ = unsafe { with(sim.cast_mut(), body) };
    size
}

/// Writes `state` as bytes that another process can read: little-endian, with format number, scene and checksum.
///
/// CUTIS_ARGUMENT: `len` is less than cutis_state_size. CUTIS_STATE: it belongs to another scene.
///
/// # Safety
/// `sim` is NULL or a live handle; `state` is NULL or a live state; `bytes` is NULL or holds `len`
/// bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_state_serialize(
    sim: *const CutisSim,
    state: *const CutisState,
    bytes: *mut u8,
    len: usize,
) -> CutisStatus {
    let body = |inner: &mut Inner| {
        // SAFETY: the caller's promise.
        let written = unsafe { own_state(inner, state)? }.to_bytes(inner.sim.model());
        // SAFETY: the caller's promise.
        let out = unsafe { pointer::slice_mut(bytes, len, "bytes")? };
        let out = out
            .get_mut(..written.len())
            .ok_or_else(|| argument(format!("{len} bytes cannot hold a state of {}", written.len())))?;
        out.copy_from_slice(&written);
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { with(sim.cast_mut(), body) }
}

/// Reads bytes of cutis_state_serialize into a new state at `*state`. Free with cutis_state_free.
///
/// CUTIS_STATE: the bytes are damaged or belong to another scene or version; `*state` is untouched then.
///
/// # Safety
/// `sim` is NULL or a live handle; `bytes` is NULL or holds `len` bytes; `state` is NULL or the place of a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_state_deserialize(
    sim: *const CutisSim,
    bytes: *const u8,
    len: usize,
    state: *mut *mut CutisState,
) -> CutisStatus {
    let body = |inner: &mut Inner| {
        // SAFETY: the caller's promise.
        let (bytes, state) = unsafe { (pointer::slice(bytes, len, "bytes")?, place(state, "state")?) };
        let read = State::from_bytes(bytes, inner.sim.model())
            .map_err(|why| Failure(CutisStatus::CUTIS_STATE, chain(&why)))?;
        *state = leak(read);
        Ok(())
    };
    // SAFETY: the caller's promise.
    unsafe { with(sim.cast_mut(), body) }
}

/// Tells instantiations apart in logs: the token of the scene, as in the FMI model description. Copies as
/// cutis_sim_message does; 0 on failure.
///
/// # Safety
/// `sim` is NULL or a live handle; `buffer` is NULL or holds `len` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cutis_sim_token(sim: *const CutisSim, buffer: *mut c_char, len: usize) -> usize {
    let mut needed = 0;
    let body = |inner: &mut Inner| {
        // SAFETY: the caller's promise.
        needed = unsafe { copy_text(inner.sim.model().token(), buffer, len) };
        Ok(())
    };
    // SAFETY: the caller's promise.
    let _ = unsafe { with(sim.cast_mut(), body) };
    needed
}
