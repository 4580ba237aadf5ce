//! Running programs, and the places they run in.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The package's folder.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Where cargo put the libraries of this build.
pub fn built() -> PathBuf {
    let folder = Path::new(env!("CARGO_BIN_EXE_cutis")).parent().expect("an executable lies in a folder");
    let places = [folder.join("deps"), folder.to_owned()];
    let age = |p: &PathBuf| Some((p.join("libcutis.so").metadata().ok()?.modified().ok()?, p.clone()));
    places.iter().filter_map(age).max().unwrap_or_else(|| panic!("no libcutis.so in {}", folder.display())).1
}

/// An empty folder for this test's files.
pub fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Whether `tool` can be run; says so if not.
pub fn available(tool: &str) -> bool {
    let there = Command::new(tool).arg("--version").output().is_ok();
    if !there {
        println!("SKIPPED: {tool} is not installed");
    }
    there
}

/// Whether the command ended well, and what it said.
pub fn attempt(command: &mut Command) -> (bool, String) {
    // Cargo's own path would lead a program to another library.
    command.env_remove("LD_LIBRARY_PATH").env("RUST_BACKTRACE", "0");
    let output = command.output().unwrap_or_else(|why| panic!("{command:?}: {why}"));
    let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    (output.status.success(), text)
}

/// What the command said; it must end well.
pub fn run(command: &mut Command) -> String {
    let (well, text) = attempt(command);
    assert!(well, "{command:?}\n{text}");
    text
}
