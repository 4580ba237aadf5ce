//! A saved state: is refused or restored; a restored simulation steps or refuses to, and is saved again.
//!
//! First byte: which scene. Odd second byte: the bytes are the state; else edits to a sound one, with the right checksum.

use std::cell::RefCell;

use cutis::sim::{Sim, State};
use sha2::{Digest, Sha256};

use super::scenes;
use super::taste::{Taste, edited};

/// Magic, format, then the checksum.
const CHECKSUM: usize = 12;
const HEADER: usize = CHECKSUM + 32;

thread_local! {
    static SOUND: RefCell<Vec<Vec<u8>>> = const { RefCell::new(Vec::new()) };
}

/// A state of scene `k` after one step.
fn sound(k: usize) -> Vec<u8> {
    SOUND.with_borrow_mut(|all| {
        if all.is_empty() {
            all.extend((0..scenes::texts().len()).map(|k| {
                let mut sim = Sim::new(scenes::model(k)).expect("a valid model");
                scenes::exercise(&mut sim, 0.01);
                sim.save().to_bytes(sim.model())
            }));
        }
        all[k % all.len()].clone()
    })
}

pub fn once(data: &[u8]) {
    let mut taste = Taste(data);
    let k = usize::from(taste.byte());
    let model = scenes::model(k);
    let bytes = if taste.byte().is_multiple_of(2) {
        let mut bytes = edited(sound(k), &mut taste);
        if bytes.len() >= HEADER {
            let checksum = Sha256::digest(&bytes[HEADER..]);
            bytes[CHECKSUM..HEADER].copy_from_slice(&checksum);
        }
        bytes
    } else {
        taste.0.to_vec()
    };
    let Ok(state) = State::from_bytes(&bytes, &model) else { return };
    let mut sim = Sim::new(model.clone()).expect("a valid model");
    if sim.restore(&state).is_err() {
        return;
    }
    let again = State::from_bytes(&sim.save().to_bytes(&model), &model).expect("what was written can be read");
    sim.restore(&again).expect("what was saved can be restored");
    let taken = sim.step(0.01).is_ok();
    let finite = sim.positions().iter().all(|x| x.iter().all(|c| c.is_finite()));
    assert!(finite || !taken, "a step was accepted with positions that are not finite");
}

pub fn seeds() -> Vec<Vec<u8>> {
    let n = scenes::texts().len() as u8;
    let whole = (0..n).map(|k| [&[k, 1][..], &sound(usize::from(k))].concat());
    whole.chain((0..n).map(|k| vec![k, 0])).chain((0..n).map(|k| vec![k, 0, 3, 100, k, 7])).collect()
}
