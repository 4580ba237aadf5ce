//! What the docs say about files: that they are there, and which of them touch others.

use std::fs;
use std::path::{Path, PathBuf};

use super::util::root;

/// Files below `folder` that end in `suffix`.
fn files(folder: &Path, suffix: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.extend(files(&path, suffix));
        } else if path.to_str().is_some_and(|p| p.ends_with(suffix)) {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Rust files that a text names in backticks, with a folder.
fn named(text: &str) -> Vec<String> {
    let words = text.split('`').skip(1).step_by(2);
    words.filter(|w| w.ends_with(".rs") && w.contains('/') && !w.contains(' ')).map(str::to_owned).collect()
}

fn missing(text: &str) -> Vec<String> {
    let is_there = |name: &String| ["", "src", "tests"].iter().any(|folder| root().join(folder).join(name).is_file());
    named(text).into_iter().filter(|name| !is_there(name)).collect()
}

#[test]
fn every_file_that_the_docs_name_is_there() {
    let mut texts = files(&root().join("docs"), ".md");
    texts.extend(["README.md", "CHANGELOG.md", "fmu/README.md"].map(|name| root().join(name)));
    let mut n = 0;
    for path in texts {
        let text = fs::read_to_string(&path).unwrap();
        n += named(&text).len();
        assert_eq!(missing(&text), [] as [&str; 0], "{}", path.display());
    }
    assert!(n > 50, "only {n} files are named");
}

#[test]
fn a_file_that_is_gone_is_found() {
    assert_eq!(missing("see `sim/gone.rs` and `sim/step.rs`"), ["sim/gone.rs"]);
}

/// docs/architecture.md: `io` is the only room that touches files, but for `ffi/host.rs`.
#[test]
fn only_io_touches_files() {
    let src = root().join("src");
    let touching = files(&src, ".rs").into_iter().filter(|path| fs::read_to_string(path).unwrap().contains("std::fs"));
    let outside: Vec<PathBuf> = touching
        .map(|path| path.strip_prefix(&src).unwrap().to_owned())
        .filter(|path| !path.starts_with("io") && path != Path::new("ffi/host.rs"))
        .collect();
    assert_eq!(outside, [] as [PathBuf; 0]);
}
