//! Which room may enter which: every `crate::` path in `src/` against the table in docs/architecture.md.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use super::util::root;

/// Rows of the table in docs/architecture.md: room, and the rooms it may name. The command line may name all.
struct Table(BTreeMap<String, BTreeSet<String>>);

impl Table {
    fn read() -> Self {
        let text = fs::read_to_string(root().join("docs/architecture.md")).unwrap();
        let rooms =
            text.split("## Rooms").nth(1).and_then(|rest| rest.split("\n## ").next()).expect("a section on rooms");
        let rows = rooms.lines().filter(|line| line.starts_with("| `")).map(|line| {
            let cells: Vec<&str> = line.split('|').map(str::trim).collect();
            let enters = cells[3].split(' ').filter(|&room| room != "-").map(str::to_owned).collect();
            (cells[1].trim_matches('`').to_owned(), enters)
        });
        Self(rows.collect())
    }

    fn has(&self, room: &str) -> bool {
        self.0.contains_key(room)
    }

    fn allows(&self, room: &str, entered: &str) -> bool {
        room == entered || self.0.get(room).is_some_and(|list| list.contains(entered) || list.contains("all"))
    }

    /// Breaches as "room uses room (file)"; names that are no rooms are macros and root items.
    fn breaches(&self, room: &str, file: &str, source: &str) -> Vec<String> {
        let entered = rooms_entered(source).into_iter().filter(|e| self.has(e) && !self.allows(room, e));
        entered.map(|e| format!("{room} uses {e} ({file})")).collect()
    }

    /// Whether following the table from `from` leads to `to`.
    fn reaches(&self, from: &str, to: &str, depth: usize) -> bool {
        assert!(depth < self.0.len(), "cycle through {from}");
        self.0.get(from).is_some_and(|list| list.iter().any(|r| r == to || self.reaches(r, to, depth + 1)))
    }
}

/// The room with `unsafe` in it.
const UNSAFE_ROOM: &str = "ffi";

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
    let table = Table::read();
    let mut wrong = Vec::new();
    for (room, path) in all_sources() {
        assert!(table.has(&room), "{} is in no room of docs/architecture.md", path.display());
        wrong.extend(table.breaches(&room, &path.display().to_string(), &fs::read_to_string(&path).unwrap()));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn planted_breaches_are_found() {
    let planted = "use crate::{\n    math::{Vec3, Mat3},\n    effect::Tissue,\n};\n// crate::scene is only talked about\nfn f() { crate::sim::g() }";
    let table = Table::read();
    assert_eq!(table.breaches("solve", "x.rs", planted), ["solve uses effect (x.rs)", "solve uses sim (x.rs)"]);
    assert!(table.breaches("cli", "x.rs", planted).is_empty());
}

#[test]
fn the_table_has_no_cycle() {
    let table = Table::read();
    assert!(table.0.len() > 10);
    for room in table.0.keys() {
        assert!(!table.reaches(room, room, 0), "{room} reaches itself");
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
