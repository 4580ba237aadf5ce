//! The shared library exports the names in `include/symbols.txt`, and every function of both FMI headers.

use std::collections::BTreeSet;
use std::process::Command;

use super::util::{compare, library, root};

fn exported() -> BTreeSet<String> {
    let output = Command::new("nm")
        .args(["-D", "--defined-only", "--format=posix"])
        .arg(library())
        .output()
        .expect("nm comes with the linker");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().filter_map(|line| line.split(' ').next()).map(str::to_owned).collect()
}

#[test]
#[cfg(target_os = "linux")]
fn exported_names_are_the_listed_ones() {
    let list: Vec<String> = exported().into_iter().collect();
    assert!(
        list.iter().all(|name| ["cutis_", "fmi2", "fmi3"].iter().any(|p| name.starts_with(p))),
        "a foreign name leaked: {list:?}"
    );
    compare("include/symbols.txt", &(list.join("\n") + "\n"));
}

#[test]
#[cfg(target_os = "linux")]
fn every_function_of_the_standard_is_there() {
    let names = std::fs::read_to_string(root().join("tests/c/fmi_functions.txt")).unwrap();
    let exported = exported();
    let missing: Vec<&str> = names.lines().filter(|n| n.starts_with("fmi") && !exported.contains(*n)).collect();
    assert!(missing.is_empty(), "{missing:?}");
    assert!(
        names.lines().filter(|n| n.starts_with("fmi3")).count() == 75
            && names.lines().filter(|n| n.starts_with("fmi2")).count() == 44
    );
}
