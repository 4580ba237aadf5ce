//! Random calls of both FMI versions in any order, with any argument their contract allows. Nothing panics inside; a status
//! is one of those that the standard knows; Error is never silent while the log is on.

use std::ffi::{CString, c_char, c_void};
use std::path::PathBuf;
use std::ptr::{null, null_mut};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use cutis::ffi::{fmi2::*, fmi3::*};

use super::capi::noise;
use super::mesh::folder;
use super::scenes;
use super::taste::{Taste, edited};

/// Instances of a version, and states of each, at a time.
const INSTANCES: usize = 2;
const STATES: usize = 2;
/// Longest buffer handed in.
const ROOM: usize = 300;
const MOST_CALLS: usize = 60;

/// References that are there in some scene, and some that are not.
const REFERENCES: [u32; 24] =
    [0, 10, 11, 12, 13, 14, 15, 16, 50, 51, 100, 101, 110, 120, 121, 122, 130, 131, 200, 202, 210, 220, 301, 9999];

/// Messages so far, and whether one tells of a panic.
static MESSAGES: AtomicUsize = AtomicUsize::new(0);
static PANICS: AtomicUsize = AtomicUsize::new(0);

macro_rules! logger3 {
    () => {
        Some(std::mem::transmute::<unsafe extern "C" fn(*mut c_void, i32, *const c_char, *const c_char), _>(log3))
    };
}

unsafe extern "C" fn log3(_: *mut c_void, _: i32, _: *const c_char, message: *const c_char) {
    MESSAGES.fetch_add(1, Ordering::Relaxed);
    // SAFETY: a string for the length of this call.
    let text = unsafe { std::ffi::CStr::from_ptr(message) }.to_string_lossy();
    if text.contains("internal failure") {
        println!("{text}");
        PANICS.fetch_add(1, Ordering::Relaxed);
    }
}

/// Folder and token of each small scene, as an unpacked archive has them.
fn archives() -> &'static [(CString, CString, CString)] {
    static ARCHIVES: OnceLock<Vec<(CString, CString, CString)>> = OnceLock::new();
    ARCHIVES.get_or_init(|| {
        let make = |(k, text): (usize, &String)| {
            let resources: PathBuf = folder().join(format!("scene {k}"));
            std::fs::create_dir_all(&resources).expect("a folder");
            std::fs::write(resources.join("scene.toml"), text).expect("room for a file");
            let c = |text: String| CString::new(text).expect("no zero byte");
            let uri = format!("file://{}", resources.display()).replace(' ', "%20");
            (c(format!("{}/", resources.display())), c(uri), c(scenes::model(k).token().to_owned()))
        };
        scenes::texts().iter().enumerate().map(make).collect()
    })
}

struct Slot {
    instance: *mut c_void,
    states: [*mut c_void; STATES],
    logging: bool,
    t: f64,
}

impl Slot {
    const EMPTY: Slot = Slot { instance: null_mut(), states: [null_mut(); STATES], logging: false, t: 0.0 };
}

pub fn once(data: &[u8]) {
    let mut taste = Taste(data);
    let version3 = taste.byte().is_multiple_of(2);
    let mut slots = [Slot::EMPTY; INSTANCES];
    let mut bytes = Vec::new();
    for _ in 0..MOST_CALLS {
        if taste.is_empty() {
            break;
        }
        let slot = &mut slots[taste.below(INSTANCES)];
        let before = MESSAGES.load(Ordering::Relaxed);
        // SAFETY: instances are live or null, states belong to theirs, lengths are those of the buffers.
        let status =
            unsafe { if version3 { slot.call3(&mut taste, &mut bytes) } else { slot.call2(&mut taste, &mut bytes) } };
        assert!((0..=3).contains(&status), "status {status}");
        assert_eq!(PANICS.load(Ordering::Relaxed), 0, "a panic inside");
        let told = MESSAGES.load(Ordering::Relaxed) > before;
        assert!(status < 2 || slot.instance.is_null() || !slot.logging || !version3 || told, "a silent {status}");
    }
    for slot in slots {
        // SAFETY: as above; freed once. States left behind go with their instance.
        unsafe { if version3 { fmi3FreeInstance(slot.instance) } else { fmi2FreeInstance(slot.instance) } }
    }
}

/// Some references, and how many values they hold in the small scenes as a rule.
fn ask(taste: &mut Taste) -> (Vec<u32>, usize) {
    let n = taste.below(3);
    let references: Vec<u32> = (0..n).map(|_| REFERENCES[taste.below(REFERENCES.len())]).collect();
    let values = |&r: &u32| match r {
        10..=13 | 51 | 120..=122 => 6,
        15 | 50 | 110 => 3,
        100 | 101 => 36,
        301 => 36,
        _ => 1,
    };
    let sum: usize = references.iter().map(values).sum();
    (references, if taste.below(6) == 0 { usize::from(taste.byte()) } else { sum }.min(ROOM))
}

fn numbers(taste: &mut Taste) -> [f64; ROOM] {
    let mut values = [0.0; ROOM];
    for _ in 0..taste.below(4) {
        values[taste.below(6)] = taste.number();
    }
    values
}

/// The bytes as they were saved, or with a few changes and the old checksum.
fn damaged(bytes: &[u8], taste: &mut Taste) -> Vec<u8> {
    let few = [taste.byte(), taste.byte(), taste.byte(), taste.byte()];
    edited(bytes.to_vec(), &mut Taste(if few[0].is_multiple_of(2) { &[] } else { &few }))
}

impl Slot {
    #[expect(clippy::missing_transmute_annotations, reason = "the status of a log message has no public name")]
    unsafe fn call3(&mut self, taste: &mut Taste, bytes: &mut Vec<u8>) -> i32 {
        let i = self.instance;
        let k = taste.below(STATES);
        // SAFETY: the caller's promise.
        unsafe {
            match taste.below(32) {
                0 | 1 if i.is_null() => {
                    let (folder, _, token) = &archives()[taste.below(archives().len())];
                    self.logging = taste.below(2) == 0;
                    let token = if taste.below(16) == 15 { c"wrong" } else { token.as_c_str() };
                    let event = u8::from(taste.below(16) == 15);
                    #[rustfmt::skip]
                    let new = fmi3InstantiateCoSimulation(
                        c"fuzz".as_ptr(), token.as_ptr(), folder.as_ptr(), 0, u8::from(self.logging), event, 0, null(), 0,
                        null_mut(), logger3!(), None,
                    );
                    (self.instance, self.t, self.states) = (new, 0.0, [null_mut(); STATES]);
                    0
                }
                0 => {
                    fmi3FreeInstance(i);
                    *self = Slot::EMPTY;
                    0
                }
                1 | 2 => fmi3EnterInitializationMode(i, 0, 0.0, self.start(taste), 0, 0.0) as i32,
                3 | 4 => fmi3ExitInitializationMode(i) as i32,
                5..=9 => {
                    let (mut a, mut b, mut c, mut last) = (7, 7, 7, f64::NAN);
                    let from = if taste.below(8) == 0 { taste.number() } else { self.t };
                    let dt = taste.number();
                    let status = fmi3DoStep(i, from, dt, 1, &mut a, &mut b, &mut c, &mut last) as i32;
                    if status == 0 && !i.is_null() {
                        assert!(a == 0 && b == 0 && c == 0 && last.is_finite(), "{a} {b} {c} {last}");
                        self.t = last;
                    }
                    status
                }
                10..=13 => {
                    let (r, n) = ask(taste);
                    fmi3SetFloat64(i, r.as_ptr(), r.len(), numbers(taste).as_ptr(), n) as i32
                }
                14..=16 => {
                    let (r, n) = ask(taste);
                    fmi3GetFloat64(i, r.as_ptr(), r.len(), [0.0; ROOM].as_mut_ptr(), n) as i32
                }
                17 => {
                    let (r, n) = ask(taste);
                    fmi3GetInt32(i, r.as_ptr(), r.len(), [0; ROOM].as_mut_ptr(), n) as i32
                        | fmi3GetBoolean(i, r.as_ptr(), r.len(), [0; ROOM].as_mut_ptr(), n) as i32
                }
                18 => {
                    let (r, n) = ask(taste);
                    let status = fmi3GetFloat32(i, r.as_ptr(), r.len(), [0.0; ROOM].as_mut_ptr(), n) as i32;
                    status | fmi3SetFloat32(i, r.as_ptr(), r.len(), [0.1; ROOM].as_ptr(), n) as i32
                }
                19 | 20 => fmi3GetFMUState(i, &mut self.states[k]) as i32,
                21 | 22 => {
                    let status = fmi3SetFMUState(i, self.states[k]) as i32;
                    self.resume3();
                    status
                }
                23 => fmi3FreeFMUState(i, &mut self.states[k]) as i32,
                24 => {
                    let mut size = 0;
                    let status = fmi3SerializedFMUStateSize(i, self.states[k], &mut size) as i32;
                    let mut out = vec![0; size];
                    let status = status | fmi3SerializeFMUState(i, self.states[k], out.as_mut_ptr(), size) as i32;
                    if status == 0 && !out.is_empty() {
                        *bytes = out;
                    }
                    status
                }
                25 => {
                    let bytes = damaged(bytes, taste);
                    fmi3DeserializeFMUState(i, bytes.as_ptr(), bytes.len(), &mut self.states[k]) as i32
                }
                26 => {
                    let ((u, n_out), (v, n_in)) = (ask(taste), ask(taste));
                    let (seed, mut out) = (numbers(taste), [0.0; ROOM]);
                    fmi3GetDirectionalDerivative(
                        i,
                        u.as_ptr(),
                        u.len(),
                        v.as_ptr(),
                        v.len(),
                        seed.as_ptr(),
                        n_in,
                        out.as_mut_ptr(),
                        n_out,
                    ) as i32
                }
                27 => {
                    let ((u, n_out), (v, n_in)) = (ask(taste), ask(taste));
                    let (seed, mut out) = (numbers(taste), [0.0; ROOM]);
                    fmi3GetAdjointDerivative(
                        i,
                        u.as_ptr(),
                        u.len(),
                        v.as_ptr(),
                        v.len(),
                        seed.as_ptr(),
                        n_out,
                        out.as_mut_ptr(),
                        n_in,
                    ) as i32
                }
                28 => fmi3Terminate(i) as i32,
                29 => {
                    self.t = 0.0;
                    fmi3Reset(i) as i32
                }
                30 => {
                    self.logging = taste.below(2) == 0;
                    fmi3SetDebugLogging(i, u8::from(self.logging), 0, null()) as i32
                }
                _ => match taste.below(5) {
                    0 => fmi3EnterEventMode(i) as i32,
                    1 => fmi3EnterStepMode(i) as i32,
                    2 => fmi3EnterConfigurationMode(i) as i32,
                    3 => fmi3GetFloat64(i, null(), 3, null_mut(), 3) as i32,
                    _ => fmi3SetTime(i, taste.number()) as i32,
                },
            }
        }
    }

    fn start(&mut self, taste: &mut Taste) -> f64 {
        self.t = if taste.below(4) == 0 { taste.number() } else { 0.0 };
        self.t
    }

    /// After a state was set, the next step goes on from its time.
    unsafe fn resume3(&mut self) {
        // SAFETY: the caller's promise.
        unsafe { fmi3GetFloat64(self.instance, &0, 1, &mut self.t, 1) };
    }

    unsafe fn call2(&mut self, taste: &mut Taste, bytes: &mut Vec<u8>) -> i32 {
        let i = self.instance;
        let k = taste.below(STATES);
        // SAFETY: the caller's promise.
        unsafe {
            match taste.below(28) {
                0 | 1 if i.is_null() => {
                    let (_, uri, token) = &archives()[taste.below(archives().len())];
                    #[rustfmt::skip]
                    let functions = fmi2CallbackFunctions {
                        logger: None, allocateMemory: null(), freeMemory: null(), stepFinished: null(),
                        componentEnvironment: null_mut(),
                    };
                    let (name, kind) = (c"fuzz".as_ptr(), i32::from(taste.below(16) != 15));
                    let new = fmi2Instantiate(name, kind, token.as_ptr(), uri.as_ptr(), &functions, 0, 1);
                    *self = Slot { instance: new, ..Slot::EMPTY };
                    0
                }
                0 => {
                    fmi2FreeInstance(i);
                    *self = Slot::EMPTY;
                    0
                }
                1 | 2 => fmi2SetupExperiment(i, 0, 0.0, self.start(taste), 0, 0.0) as i32,
                3 => fmi2EnterInitializationMode(i) as i32,
                4 => fmi2ExitInitializationMode(i) as i32,
                5..=9 => {
                    let from = if taste.below(8) == 0 { taste.number() } else { self.t };
                    let dt = taste.number();
                    let status = fmi2DoStep(i, from, dt, 1) as i32;
                    if status == 0 {
                        self.t += dt;
                    }
                    status
                }
                10..=13 => {
                    let r = scalars(taste);
                    fmi2SetReal(i, r.as_ptr(), r.len(), numbers(taste).as_ptr()) as i32
                }
                14 | 15 => {
                    let r = scalars(taste);
                    fmi2GetReal(i, r.as_ptr(), r.len(), [0.0; ROOM].as_mut_ptr()) as i32
                }
                16 => {
                    let r = scalars(taste);
                    fmi2GetInteger(i, r.as_ptr(), r.len(), [0; ROOM].as_mut_ptr()) as i32
                        | fmi2GetBoolean(i, r.as_ptr(), r.len(), [0; ROOM].as_mut_ptr()) as i32
                }
                17 | 18 => fmi2GetFMUstate(i, &mut self.states[k]) as i32,
                19 => {
                    let status = fmi2SetFMUstate(i, self.states[k]) as i32;
                    fmi2GetReal(i, &0, 1, &mut self.t);
                    status
                }
                20 => fmi2FreeFMUstate(i, &mut self.states[k]) as i32,
                21 => {
                    let mut size = 0;
                    let status = fmi2SerializedFMUstateSize(i, self.states[k], &mut size) as i32;
                    let mut out = vec![0; size];
                    let status = status | fmi2SerializeFMUstate(i, self.states[k], out.as_mut_ptr(), size) as i32;
                    if status == 0 && !out.is_empty() {
                        *bytes = out;
                    }
                    status
                }
                22 => {
                    let bytes = damaged(bytes, taste);
                    fmi2DeSerializeFMUstate(i, bytes.as_ptr(), bytes.len(), &mut self.states[k]) as i32
                }
                23 => {
                    let (u, v) = (scalars(taste), scalars(taste));
                    let (seed, mut out) = (numbers(taste), [0.0; ROOM]);
                    fmi2GetDirectionalDerivative(
                        i,
                        u.as_ptr(),
                        u.len(),
                        v.as_ptr(),
                        v.len(),
                        seed.as_ptr(),
                        out.as_mut_ptr(),
                    ) as i32
                }
                24 => fmi2Terminate(i) as i32,
                25 => {
                    self.t = 0.0;
                    fmi2Reset(i) as i32
                }
                26 => fmi2GetRealStatus(i, taste.below(5) as i32, &mut 0.0) as i32,
                _ => fmi2CancelStep(i) as i32,
            }
        }
    }
}

/// References of FMI 2.0: an array and an element in it.
fn scalars(taste: &mut Taste) -> Vec<u32> {
    let n = taste.below(8);
    (0..n).map(|_| (REFERENCES[taste.below(REFERENCES.len())] << 20) + taste.below(8) as u32).collect()
}

pub fn seeds() -> Vec<Vec<u8>> {
    // A life in FMI 3.0: instantiate, initialise, save, set, step, serialize, deserialize, set state, step, derivative.
    let life = |scene: u8| {
        let new = [0, 0, 0, 0, scene, 0, 0, 0];
        let begin = [0, 0, 2, 1, 0, 0, 3, 0, 0, 19, 0, 0, 10, 1, 1, 1, 2, 1, 30, 2, 60];
        let go = [0, 0, 5, 1, 2, 0, 0, 24, 0, 1, 25, 0, 0, 0, 0, 0, 1, 21, 0, 0, 5, 1, 4, 0, 0, 14, 1, 10, 1];
        [&new[..], &begin, &go, &[0, 0, 26, 1, 10, 1, 1, 1, 1, 1, 1, 50, 0, 0, 28]].concat()
    };
    let mut all: Vec<_> = (0..scenes::texts().len() as u8).map(life).collect();
    all.extend((20..50u64).map(|k| noise(k, 240)));
    all
}
