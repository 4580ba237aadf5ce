//! What is checked in for the archives is what would be generated: descriptions of the default scene, licenses.

use std::collections::BTreeSet;
use std::process::Command;

use cutis::fmu::{FmiVersion, description};

use super::util::{compare, root};

#[test]
fn model_descriptions_are_up_to_date() {
    let scene = cutis::load::embedded().unwrap();
    compare("modelDescription.xml", &description(&scene, FmiVersion::V3));
    compare("fmu/fmi2.xml", &description(&scene, FmiVersion::V2));
}

#[test]
fn the_default_scene_has_one_token() {
    let scene = root().join("fmu/scene.toml");
    let (here, there) = (cutis::load::embedded().unwrap(), cutis::load::from_file(&scene).unwrap());
    assert_eq!(here.model.token(), there.model.token());
}

/// The crates inside the library with their SPDX licenses; one platform's list, so that it is the same everywhere.
#[test]
fn the_list_of_libraries_is_up_to_date() {
    let arguments =
        "tree --offline --locked -e normal --target x86_64-unknown-linux-gnu --prefix none --format {p}|{l}";
    let output = Command::new(env!("CARGO")).args(arguments.split(' ')).current_dir(root()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let lines: BTreeSet<String> = text
        .lines()
        .filter_map(|line| line.trim_end_matches(" (*)").split_once('|'))
        .filter(|(package, _)| !package.starts_with("cutis "))
        .map(|(package, license)| {
            // A procedural macro runs in the compiler and is not inside, but listing it does no harm.
            let package = package.trim_end_matches(" (proc-macro)");
            format!("{package}: {}", if license.is_empty() { "see its source" } else { license })
        })
        .collect();
    compare("fmu/third-party.txt", &(lines.into_iter().collect::<Vec<_>>().join("\n") + "\n"));
}
