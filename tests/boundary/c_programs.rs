//! C99 and C++11 programs against the header and the shared library; under valgrind where it is installed.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use super::util::{library, root, scratch};

fn run(command: &mut Command) -> String {
    // Cargo's own path would lead a program to an older library.
    command.env_remove("LD_LIBRARY_PATH").env("RUST_BACKTRACE", "0");
    let output = command.output().unwrap_or_else(|why| panic!("{command:?}: {why}"));
    let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{command:?}\n{text}");
    text
}

fn available(tool: &str) -> bool {
    Command::new(tool).arg("--version").output().is_ok_and(|o| o.status.success())
}

/// A scene of a few hundred elements, alone in its folder as in an archive: valgrind is slow.
const SMALL: &str = r#"
name = "small"
[mesh.block]
size = [0.06, 0.04, 0.02]
cells = [6, 4, 2]
[[tissue]]
E = 15e3
nu = 0.45
[[bone]]
name = "fixed"
nodes = "x_min"
[[bone]]
name = "moved"
nodes = "x_max"
"#;

/// A folder with the library under the name that the linker looks for, and the one that the loader does.
fn linked() -> PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    let make = || {
        let folder = scratch("linked");
        for name in ["libcutis.so", concat!("libcutis.so.", env!("CARGO_PKG_VERSION_MAJOR"))] {
            let _ = std::fs::remove_file(folder.join(name));
            std::os::unix::fs::symlink(library(), folder.join(name)).unwrap();
        }
        folder
    };
    FOLDER.get_or_init(make).clone()
}

/// Compiles `source` strictly, runs it, returns what it says.
fn build_and_run(compiler: &str, standard: &str, source: &Path, valgrind: bool) -> String {
    let program = scratch("c").join(format!("{}_{compiler}", source.file_stem().unwrap().to_string_lossy()));
    let folder = linked();
    run(Command::new(compiler)
        .args([standard, "-O1", "-g", "-Wall", "-Wextra", "-pedantic", "-Werror", "-I"])
        .arg(root().join("include"))
        .arg(source)
        .arg("-o")
        .arg(&program)
        .arg("-L")
        .arg(&folder)
        .arg(format!("-Wl,-rpath,{}", folder.display()))
        .args(["-lcutis", "-lm", "-ldl", "-lpthread"]));
    let scene = scratch("small").join("scene.toml");
    std::fs::write(&scene, SMALL).unwrap();
    let names = root().join("tests/c/fmi_functions.txt");
    if valgrind && available("valgrind") {
        let mut checked = Command::new("valgrind");
        checked
            .args(["--error-exitcode=9", "--leak-check=full", "--errors-for-leak-kinds=definite", "-q"])
            .arg(&program);
        return run(checked.arg(&scene).arg(&names));
    }
    run(Command::new(&program).arg(&scene).arg(&names))
}

#[test]
fn c99_smoke() {
    let said = build_and_run("cc", "-std=c99", &root().join("tests/c/smoke.c"), true);
    assert!(said.contains("smoke: all is well"), "{said}");
}

#[test]
fn cpp11_smoke() {
    let said = build_and_run("c++", "-std=c++11", &root().join("tests/c/smoke.cpp"), false);
    assert!(said.contains("smoke: all is well"), "{said}");
}

#[test]
fn cpp17_wrapper() {
    let said = build_and_run("c++", "-std=c++17", &root().join("tests/c/wrapper.cpp"), false);
    assert!(said.contains("wrapper: all is well"), "{said}");
}

#[test]
fn a_hosts_floating_point_environment_changes_nothing() {
    let said = build_and_run("cc", "-std=c99", &root().join("tests/c/environment.c"), false);
    assert!(said.contains("environment: all is well"), "{said}");
}

#[test]
fn callbacks_may_throw() {
    let said = build_and_run("c++", "-std=c++17", &root().join("tests/c/throws.cpp"), false);
    assert!(said.contains("throws: all is well"), "{said}");
}

#[test]
fn doors_of_the_c_library_refuse_what_they_say() {
    let said = build_and_run("cc", "-std=c99", &root().join("tests/c/doors.c"), false);
    assert!(said.contains("doors: all is well"), "{said}");
}

/// Loads of the library from folders of their own.
const LOADS: &str = "200";

#[test]
#[cfg(target_os = "linux")]
fn the_library_can_be_unloaded_again_and_again() {
    let (program, folder) = (scratch("c").join("unload"), scratch("unload"));
    let source = root().join("tests/c/unload.c");
    run(Command::new("cc")
        .args(["-std=c99", "-O1", "-g", "-Wall", "-Wextra", "-pedantic", "-Werror"])
        .arg(source)
        .arg("-o")
        .arg(&program)
        .args(["-ldl", "-lpthread"]));
    let said = run(Command::new(&program).arg(library()).arg(&folder).arg(LOADS));
    println!("{said}");
    assert!(said.contains("unload: all is well"), "{said}");
}

#[test]
fn fmi_functions_survive_misuse() {
    let said = build_and_run("cc", "-std=c99", &root().join("tests/c/misuse.c"), true);
    assert!(said.contains("misuse: all is well"), "{said}");
}
