//! Scenes with mistakes in them load or are refused; those that load take a step or refuse it. Nothing panics.

use std::panic::catch_unwind;
use std::path::Path;
use std::sync::Arc;

use cutis::load;
use cutis::scene::{MeshSource, SceneFile};
use cutis::sim::Sim;

use crate::common::Random;

/// Mutated scenes.
const TRIES: usize = 4000;
/// Every so many scenes that load, one takes a step.
const STEP_EVERY: usize = 8;
/// Larger blocks are left out: they are slow, not wrong.
const MOST_CELLS: f64 = 200.0;
/// What a number may turn into.
const NUMBERS: [&str; 14] = [
    "0", "-1", "1", "1e308", "-1e308", "1e-320", "nan", "inf", "-inf", "\"x\"", "[]", "[1.0]", "true",
    "9223372036854775807",
];

/// Uniform below `n`.
fn below(random: &mut Random, n: usize) -> usize {
    ((0.5 * (random.number() + 1.0) * n as f64) as usize).min(n.saturating_sub(1))
}

/// Replaces the first number at or after a random place.
fn another_number(text: &str, random: &mut Random) -> String {
    let from = below(random, text.len());
    let number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | 'e');
    let Some(start) = text.char_indices().position(|(k, c)| k >= from && c.is_ascii_digit()) else {
        return text.to_owned();
    };
    let len = text[start..].find(|c| !number(c)).unwrap_or(text.len() - start);
    format!("{}{}{}", &text[..start], NUMBERS[below(random, NUMBERS.len())], &text[start + len..])
}

fn mutate(text: &str, random: &mut Random) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    let (k, l) = (below(random, lines.len()), below(random, lines.len()));
    match below(random, 8) {
        0 => drop(lines.remove(k)),
        1 => lines.insert(k, lines[l]),
        2 => lines.swap(k, l),
        3 => lines.truncate(k),
        4 => {
            let at = below(random, text.len());
            let mut bytes = text.as_bytes().to_vec();
            bytes[at] = b' ' + below(random, 95) as u8;
            return String::from_utf8(bytes).expect("the scenes are ASCII");
        }
        _ => return another_number(text, random),
    }
    lines.join("\n")
}

fn is_small(text: &str) -> bool {
    match SceneFile::parse(text).and_then(|file| file.mesh_source(text)) {
        Ok(MeshSource::Block { cells, .. }) => cells.iter().map(|&c| c as f64).product::<f64>() <= MOST_CELLS,
        Ok(_) => false,
        Err(_) => true,
    }
}

#[test]
fn mutated_scenes_load_or_are_refused() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenes");
    let mut scenes: Vec<_> = std::fs::read_dir(folder).expect("scenes").map(|e| e.expect("an entry").path()).collect();
    scenes.retain(|p| p.extension().is_some_and(|e| e == "toml"));
    scenes.sort();
    let scenes: Vec<String> = scenes.iter().map(|p| std::fs::read_to_string(p).expect("a scene")).collect();
    let mut random = Random(20);
    let (mut loaded, mut refused) = (0, 0);
    for k in 0..TRIES {
        let mut text = scenes[k % scenes.len()].clone();
        for _ in 0..=below(&mut random, 3) {
            if !text.is_empty() {
                text = mutate(&text, &mut random);
            }
        }
        if !is_small(&text) {
            continue;
        }
        let steps = loaded % STEP_EVERY == 0;
        let end = catch_unwind(|| {
            let Ok(model) = load::from_text(&text, None).map(|l| l.model) else { return false };
            if let (true, Ok(mut sim)) = (steps, Sim::new(Arc::new(model))) {
                let taken = sim.initialise().and_then(|_| sim.step(0.01));
                let finite = sim.positions().iter().all(|x| x.iter().all(|c| c.is_finite()));
                assert!(finite, "positions that are not finite after {taken:?}");
            }
            true
        });
        match end {
            Ok(true) => loaded += 1,
            Ok(false) => refused += 1,
            Err(_) => panic!("mutation {k} panics:\n{text}"),
        }
    }
    println!("{loaded} loaded, {refused} refused");
    assert!(loaded > TRIES / 10 && refused > TRIES / 10, "{loaded} loaded, {refused} refused of {TRIES}");
}
