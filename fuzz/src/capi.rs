//! Random calls of the C library: any order, any argument that its contract allows. Nothing panics inside, failures have
//! a message and change nothing, accepted steps leave numbers.

use std::ffi::{CString, c_char};
use std::ptr::{null, null_mut};

use cutis::ffi::capi::*;

use super::scenes;
use super::taste::{Taste, edited};

/// Handles at a time.
const SIMS: usize = 2;
const STATES: usize = 2;
/// Longest buffer handed in; no port of the small scenes is larger.
const ROOM: usize = 256;
/// Calls an input, so that none takes long.
const MOST_CALLS: usize = 60;

struct Host {
    sims: [*mut CutisSim; SIMS],
    states: [*mut CutisState; STATES],
    bytes: Vec<u8>,
}

pub fn once(data: &[u8]) {
    let mut taste = Taste(data);
    let mut host = Host { sims: [null_mut(); SIMS], states: [null_mut(); STATES], bytes: Vec::new() };
    for _ in 0..MOST_CALLS {
        if taste.is_empty() {
            break;
        }
        // SAFETY: handles are live or null, lengths are those of the buffers.
        unsafe { host.call(&mut taste) };
    }
    // SAFETY: as above; freed once.
    unsafe {
        host.states.iter().for_each(|&state| cutis_state_free(state));
        host.sims.iter().for_each(|&sim| cutis_sim_free(sim));
    }
}

impl Host {
    unsafe fn call(&mut self, taste: &mut Taste) {
        let (which, other) = (taste.below(SIMS), taste.below(STATES));
        let (sim, state) = (self.sims[which], self.states[other]);
        // SAFETY: the caller's promise.
        unsafe {
            match taste.below(24) {
                0 | 1 if sim.is_null() => self.sims[which] = new_sim(taste),
                0 => {
                    cutis_sim_free(sim);
                    self.sims[which] = null_mut();
                }
                1 | 2 => self.check(sim, cutis_sim_initialise(sim)),
                3..=6 => {
                    let status = cutis_sim_step(sim, taste.number());
                    self.check(sim, status);
                    if status == CutisStatus::CUTIS_OK {
                        finite(sim);
                    }
                }
                7..=9 => set(sim, taste, self),
                10 | 11 => get(sim, taste, self),
                12 => {
                    cutis_state_free(state);
                    self.states[other] = cutis_sim_save(sim);
                }
                13 => {
                    cutis_state_free(state);
                    self.states[other] = null_mut();
                }
                14 | 15 => self.check(sim, cutis_sim_restore(sim, state)),
                16 => self.check(sim, cutis_sim_reset(sim)),
                17 => self.check(sim, cutis_sim_set_time(sim, taste.number())),
                18 | 19 => {
                    let mut bytes = vec![0; cutis_state_size(sim, state)];
                    let less = taste.below(2);
                    let len = bytes.len().saturating_sub(less);
                    let status = cutis_state_serialize(sim, state, bytes.as_mut_ptr(), len);
                    self.check(sim, status);
                    if status == CutisStatus::CUTIS_OK {
                        self.bytes = bytes;
                    }
                }
                20 | 21 => {
                    let mut few = [taste.byte(), taste.byte(), taste.byte(), taste.byte(), taste.byte(), 3, 40, 7];
                    few[0] %= 2;
                    let bytes = edited(self.bytes.clone(), &mut Taste(if few[0] == 0 { &[] } else { &few }));
                    let mut new = null_mut();
                    let status = cutis_state_deserialize(sim, bytes.as_ptr(), bytes.len(), &mut new);
                    self.check(sim, status);
                    assert_eq!(new.is_null(), status != CutisStatus::CUTIS_OK);
                    if !new.is_null() {
                        cutis_state_free(self.states[other]);
                        self.states[other] = new;
                    }
                }
                22 => texts(sim, taste),
                _ => questions(sim, taste),
            }
        }
    }

    /// No call ends in a panic, and one that failed on a live handle says why.
    unsafe fn check(&self, sim: *const CutisSim, status: CutisStatus) {
        let mut why = [0; ROOM];
        // SAFETY: a live handle or null, and a buffer of its length.
        let needs = unsafe { cutis_sim_message(sim, why.as_mut_ptr(), why.len()) };
        // SAFETY: closed by the call above, or all zero.
        let why = unsafe { std::ffi::CStr::from_ptr(why.as_ptr()) };
        assert!(status != CutisStatus::CUTIS_PANIC, "{why:?}");
        assert!(sim.is_null() || status == CutisStatus::CUTIS_OK || needs > 1, "{status:?} without a message");
    }
}

unsafe fn new_sim(taste: &mut Taste) -> *mut CutisSim {
    let texts = scenes::texts();
    let mut text = texts[taste.below(texts.len())].clone().into_bytes();
    if taste.below(8) == 0 {
        text.truncate(usize::from(taste.word()) % text.len());
    }
    let text = CString::new(text).expect("scenes hold no zero byte");
    let mut why = [0 as c_char; 64];
    // SAFETY: strings and buffers of this function.
    unsafe {
        let sim = match taste.below(6) {
            0 => cutis_sim_new_from_text(null(), null(), why.as_mut_ptr(), why.len()),
            1 => cutis_sim_new_from_file(c"/nowhere/scene.toml".as_ptr(), null_mut(), 0),
            2 => cutis_sim_new_from_text(text.as_ptr(), c"/nowhere".as_ptr(), null_mut(), 7),
            _ => cutis_sim_new_from_text(text.as_ptr(), null(), why.as_mut_ptr(), why.len()),
        };
        assert!(!std::ffi::CStr::from_ptr(why.as_ptr()).to_string_lossy().contains("internal failure"));
        sim
    }
}

/// A port that is there as a rule, and a length that is its own as a rule.
unsafe fn port(sim: *const CutisSim, taste: &mut Taste) -> (usize, usize) {
    // SAFETY: a live handle or null.
    unsafe {
        let port = taste.below(cutis_port_count(sim) + 1);
        let len = cutis_port_len(sim, port);
        (port, if taste.below(8) == 0 { usize::from(taste.byte()) } else { len.min(ROOM) })
    }
}

unsafe fn set(sim: *mut CutisSim, taste: &mut Taste, host: &Host) {
    // SAFETY: a live handle or null; the length is at most that of the buffer.
    unsafe {
        let (port, len) = port(sim, taste);
        let mut values = [0.0; ROOM];
        for _ in 0..taste.below(4) {
            values[taste.below(len.max(1))] = taste.number();
        }
        let values = if taste.below(16) == 0 { null() } else { values.as_ptr() };
        host.check(sim, cutis_sim_set_f64(sim, port, values, len));
    }
}

unsafe fn get(sim: *const CutisSim, taste: &mut Taste, host: &Host) {
    // SAFETY: a live handle or null; the length is at most that of the buffers.
    unsafe {
        let (port, len) = port(sim, taste);
        let null = taste.below(16) == 0;
        let (mut a, mut b, mut c) = ([0.0; ROOM], [0; ROOM], [0; ROOM]);
        let f64s = if null { null_mut() } else { a.as_mut_ptr() };
        host.check(sim, cutis_sim_get_f64(sim, port, f64s, len));
        host.check(sim, cutis_sim_get_i32(sim, port, b.as_mut_ptr(), len));
        host.check(sim, cutis_sim_get_bool(sim, port, c.as_mut_ptr(), len));
    }
}

unsafe fn finite(sim: *const CutisSim) {
    // SAFETY: a live handle; the buffer has the length of the port.
    unsafe {
        let skin = cutis_port_find(sim, c"skin.position".as_ptr());
        let mut x = vec![0.0; cutis_port_len(sim, skin)];
        assert_eq!(cutis_sim_get_f64(sim, skin, x.as_mut_ptr(), x.len()), CutisStatus::CUTIS_OK);
        assert!(x.iter().all(|v| v.is_finite()), "an accepted step with skin that is not finite");
        assert!(cutis_sim_time(sim).is_finite());
    }
}

unsafe fn texts(sim: *const CutisSim, taste: &mut Taste) {
    let mut buffer = [1 as c_char; ROOM];
    let (port, len) = (usize::from(taste.byte()) / 8, usize::from(taste.byte()).min(ROOM));
    let at = buffer.as_mut_ptr();
    // SAFETY: a live handle or null; the length is at most that of the buffer.
    unsafe {
        match taste.below(7) {
            0 => cutis_sim_message(sim, at, len),
            1 => cutis_sim_warning(sim, at, len),
            2 => cutis_port_name(sim, port, at, len),
            3 => cutis_port_unit(sim, port, at, len),
            4 => cutis_port_description(sim, port, null_mut(), len),
            5 => cutis_port_row(sim, port, taste.below(4), at, len),
            _ => cutis_sim_token(sim, at, len),
        };
    }
    assert!(buffer[len..].iter().all(|&c| c == 1), "written past the end");
}

unsafe fn questions(sim: *const CutisSim, taste: &mut Taste) {
    let port = match taste.byte() {
        255 => usize::MAX,
        other => usize::from(other) / 8,
    };
    // SAFETY: a live handle or null, strings of this function.
    unsafe {
        cutis_port_rank(sim, port);
        cutis_port_dim(sim, port, taste.below(4));
        cutis_port_type(sim, port);
        cutis_port_causality(sim, port);
        cutis_port_find(sim, c"no.such.port".as_ptr());
        cutis_port_find(sim, null());
        cutis_sim_time(sim);
    }
}

pub fn seeds() -> Vec<Vec<u8>> {
    // A life: new, initialise, set, step, save, step, serialize, deserialize, restore, step, free.
    let life = |scene: u8| {
        let new = [0, 0, 0, scene, 1, 3];
        let tail = [0, 0, 1, 0, 0, 7, 2, 1, 1, 1, 20, 1, 0, 0, 3, 2, 0, 0, 12, 0, 0, 3, 4, 0, 0, 18, 0, 0, 0, 20, 0, 0];
        [&new[..], &tail, &[0, 0, 0, 0, 14, 0, 0, 3, 1, 0, 0, 10, 1, 1, 0, 0, 0]].concat()
    };
    let mut all: Vec<_> = (0..scenes::texts().len() as u8).map(life).collect();
    all.extend((1..16u64).map(|k| noise(k, 160)));
    all
}

/// Bytes without a plan.
pub fn noise(seed: u64, n: usize) -> Vec<u8> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 32) as u8
    };
    std::iter::repeat_with(next).take(n).collect()
}
