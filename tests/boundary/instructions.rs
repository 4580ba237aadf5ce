//! Instructions of a step, counted: a slow-down fails here, whatever else the machine does.
//!
//! Counted by valgrind's callgrind as the difference between runs of twice as many and as many steps, so that meshing,
//! analysis and factorisation drop out. Another compiler counts a little otherwise, hence the slack.

use std::fmt::Write as _;
use std::process::Command;

use super::util::{compare, root, scratch};

/// Part of the count by which a step may become slower.
const SLACK: f64 = 0.1;
/// Steps of the shorter run.
const STEPS: usize = 5;
const COUNTS: &str = "tests/boundary/instructions.txt";

const BLOCK: &str = "[mesh.block]\nsize = [0.1, 0.1, 0.04]\ncells = [8, 8, 3]\n[[bone]]\nname = \"skull\"\nnodes = \"z_min\"\n\
    within = [[-1, -1, -1], [0.0401, 1, 1]]\ndrive = \"held\"\n[[bone]]\nname = \"mandible\"\nnodes = \"z_min\"\n\
    within = [[0.0599, -1, -1], [1, 1, 1]]\n[[keyframe]]\nt = 10.0\nport = \"bone.translation\"\nrow = \"mandible\"\n\
    value = [0.0, 0.05, 0.02]\n";

/// Name and tables of each scene.
const SCENES: [(&str, &str); 5] = [
    ("stable neo-Hookean", "[[tissue]]\nE = 15e3\nnu = 0.45\n"),
    ("corotational", "[[tissue]]\nenergy = \"corotational\"\nE = 15e3\nnu = 0.45\n"),
    ("fung", "[[tissue]]\nenergy = \"fung\"\nmu = 5e3\nb = 1.0\nkappa = 5e4\n"),
    ("linear", "[[tissue]]\nenergy = \"linear\"\nE = 15e3\nnu = 0.45\n"),
    ("backward Euler", "[[tissue]]\nE = 15e3\nnu = 0.45\n[inertia]\n"),
];

/// Instructions of a run of this many steps.
fn count(name: &str, tables: &str, steps: usize) -> f64 {
    let folder = scratch("instructions");
    let file = folder.join(format!("{}_{steps}.toml", name.replace(' ', "_")));
    let end = 0.1 * steps as f64;
    std::fs::write(&file, format!("{BLOCK}{tables}[run]\ndt = 0.1\nend = {end:?}\n")).unwrap();
    let out = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null", env!("CARGO_BIN_EXE_cutis"), "run"])
        .arg(&file)
        .arg("-o")
        .arg(&folder)
        .arg("--table-only")
        .output()
        .expect("valgrind runs");
    let said = String::from_utf8_lossy(&out.stderr);
    let line = said.lines().find(|l| l.contains("Collected :")).unwrap_or_else(|| panic!("no count in {said}"));
    line.rsplit(':').next().unwrap().trim().parse().unwrap()
}

fn limits(text: &str) -> Vec<(String, f64)> {
    let parse = |line: &str| {
        let (name, n) = line.rsplit_once(": ")?;
        Some((name.to_owned(), n.trim_end_matches(" instructions a step").parse().ok()?))
    };
    text.lines().filter_map(parse).collect()
}

#[test]
fn a_step_takes_no_more_instructions_than_before() {
    if Command::new("valgrind").arg("--version").output().is_err() {
        println!("skipped: valgrind is not installed");
        return;
    }
    let mut text = String::new();
    let mut slow = Vec::new();
    let limits = limits(&std::fs::read_to_string(root().join(COUNTS)).unwrap_or_default());
    for (name, tables) in SCENES {
        let per_step = (count(name, tables, 2 * STEPS) - count(name, tables, STEPS)) / STEPS as f64;
        writeln!(text, "{name}: {per_step:.0} instructions a step").unwrap();
        let limit = limits.iter().find(|(n, _)| n == name).map_or(0.0, |(_, n)| *n);
        if per_step > (1.0 + SLACK) * limit {
            slow.push(format!("{name}: {per_step:.0} instructions a step, {limit:.0} before"));
        }
    }
    if std::env::var_os("BLESS").is_some() {
        return compare(COUNTS, &text);
    }
    assert!(slow.is_empty(), "slower than before (BLESS=1 if it must be):\n{}", slow.join("\n"));
}

#[test]
fn limits_are_read_as_they_are_written() {
    let read = limits("a b: 120 instructions a step\nnonsense\n");
    assert_eq!(read, [("a b".to_owned(), 120.0)]);
}
