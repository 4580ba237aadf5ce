//! Which room may enter which: every `crate::` path in `src/` against one table.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use super::util::root;

/// Rows: room, and the rooms it may name. `main` may name all.
const TABLE: &[(&str, &str)] = &[
    ("math", ""),
    ("port", ""),
    ("bytes", ""),
    ("mesh", "math"),
    ("energy", "math"),
    ("geometry", "math mesh"),
    ("fem", "math mesh energy"),
    ("effect", "math mesh fem energy port"),
    ("solve", "math fem"),
    ("sim", "math mesh fem solve port bytes"),
    ("scene", "math mesh energy effect sim port fem solve"),
    ("io", "math mesh geometry bytes"),
    ("load", "scene sim io geometry mesh error fmu"),
    ("fmu", "port sim load mesh"),
    ("view", "math mesh"),
    ("ffi", "error port sim load fmu io"),
    ("error", "energy geometry fem effect solve sim scene io load fmu ffi mesh"),
];

/// The room with `unsafe` in it.
const UNSAFE_ROOM: &str = "ffi";

fn allowed(room: &str, entered: &str) -> bool {
    room == entered || TABLE.iter().any(|(r, list)| *r == room && list.split(' ').any(|x| x == entered))
}

/// First path segments after `crate::` in code, comments left out, groups opened.
fn rooms_entered(source: &str) -> BTreeSet<String> {
    let code: String = source.lines().map(|line| line.split("//").next().unwrap_or("").to_owned() + "\n").collect();
    let mut found = BTreeSet::new();
    for part in code.split("crate::").skip(1) {
        let word =
            |text: &str| text.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
        match part.strip_prefix('{') {
            None => drop(found.insert(word(part))),
            Some(group) => {
                let mut depth = 0;
                let mut first = String::new();
                for c in group.chars() {
                    match c {
                        '{' => depth += 1,
                        '}' if depth == 0 => break,
                        '}' => depth -= 1,
                        ',' if depth == 0 => drop(found.insert(word(&std::mem::take(&mut first)))),
                        _ if depth == 0 => first.push(c),
                        _ => {}
                    }
                }
                found.insert(word(&first));
            }
        }
    }
    found.remove("");
    found
}

/// Breaches of the table, as "room uses room (file)"; names that are no rooms are macros and root items.
fn breaches(room: &str, file: &str, source: &str) -> Vec<String> {
    let is_room = |name: &str| TABLE.iter().any(|(r, _)| *r == name);
    let entered = rooms_entered(source).into_iter().filter(|e| is_room(e) && !allowed(room, e));
    entered.map(|e| format!("{room} uses {e} ({file})")).collect()
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

fn all_sources() -> Vec<(String, PathBuf)> {
    let src = root().join("src");
    let mut found = Vec::new();
    sources(&src, &mut found);
    let room = |path: &Path| {
        let inside = path.strip_prefix(&src).unwrap();
        let first = inside.components().next().unwrap().as_os_str().to_string_lossy().into_owned();
        first.trim_end_matches(".rs").to_owned()
    };
    found.into_iter().map(|p| (room(&p), p)).filter(|(r, _)| !matches!(r.as_str(), "main" | "cli" | "lib")).collect()
}

#[test]
fn every_room_enters_only_the_rooms_it_may() {
    let mut wrong = Vec::new();
    for (room, path) in all_sources() {
        assert!(TABLE.iter().any(|(r, _)| *r == room), "{} is in no room of the table", path.display());
        wrong.extend(breaches(&room, &path.display().to_string(), &fs::read_to_string(&path).unwrap()));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn planted_breaches_are_found() {
    let planted = "use crate::{\n    math::{Vec3, Mat3},\n    effect::Tissue,\n};\n// crate::scene is only talked about\nfn f() { crate::sim::g() }";
    assert_eq!(breaches("solve", "x.rs", planted), ["solve uses effect (x.rs)", "solve uses sim (x.rs)"]);
    assert!(breaches("main", "x.rs", "").is_empty());
}

#[test]
fn the_table_has_no_cycle() {
    fn reaches(from: &str, to: &str, depth: usize) -> bool {
        let list = TABLE.iter().find(|(r, _)| *r == from).map_or("", |(_, l)| l);
        assert!(depth < TABLE.len(), "cycle through {from}");
        list.split(' ').filter(|r| !r.is_empty()).any(|r| r == to || reaches(r, to, depth + 1))
    }
    // `error` names the rooms that fail and the doors name `error`: the one knot, and a harmless one.
    for (room, _) in TABLE.iter().filter(|(r, _)| !matches!(*r, "error" | "load" | "ffi" | "fmu")) {
        assert!(!reaches(room, room, 0), "{room} reaches itself");
    }
}

#[test]
fn one_room_only_may_be_unsafe() {
    for (room, path) in all_sources() {
        let source = fs::read_to_string(&path).unwrap();
        let top = path.parent().unwrap().ends_with("src")
            || path.file_name().unwrap() == "mod.rs" && path.parent().unwrap().parent().unwrap().ends_with("src");
        if room == UNSAFE_ROOM {
            continue;
        }
        if top {
            assert!(source.contains("#![forbid(unsafe_code)]"), "{} does not forbid unsafe code", path.display());
        }
        assert!(!source.contains("allow(unsafe_code)"), "{} lets unsafe code in", path.display());
    }
}

#[test]
fn every_unsafe_block_says_why_it_is_sound() {
    for (_, path) in all_sources().into_iter().filter(|(r, _)| r == UNSAFE_ROOM) {
        let source = fs::read_to_string(&path).unwrap();
        let lines: Vec<&str> = source.lines().collect();
        for (i, line) in lines.iter().enumerate() {
            let code = line.split("//").next().unwrap();
            if !code.contains("unsafe {") {
                continue;
            }
            let above = lines[..i].iter().rev().take(12).take_while(|l| !l.trim().is_empty());
            let said = above.into_iter().any(|l| l.contains("// SAFETY:")) || line.contains("// SAFETY:");
            assert!(said, "{}:{}: an unsafe block without `// SAFETY:`", path.display(), i + 1);
        }
    }
}
