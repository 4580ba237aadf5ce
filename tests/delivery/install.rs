//! `./install` makes a tree that C programs find through pkg-config and CMake, wherever it is moved to.
#![cfg(target_os = "linux")]

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use super::util::{attempt, available, built, root, run, scratch};

const VERSION: &str = env!("CARGO_PKG_VERSION");
const MAJOR: &str = env!("CARGO_PKG_VERSION_MAJOR");

/// A folder of two levels, as on Debian.
fn libdir() -> String {
    format!("lib/{}-linux-gnu", std::env::consts::ARCH)
}

/// The installed tree; it was moved after it was installed.
fn tree() -> &'static Path {
    static TREE: OnceLock<PathBuf> = OnceLock::new();
    TREE.get_or_init(|| {
        let folder = scratch("install");
        let mut install = Command::new(root().join("install"));
        install.args(["--prefix", "/first", "--libdir", &libdir(), "--from"]).arg(built());
        run(install.env("DESTDIR", &folder));
        let moved = folder.join("moved");
        std::fs::rename(folder.join("first"), &moved).unwrap();
        moved
    })
}

fn lib() -> PathBuf {
    tree().join(libdir())
}

fn pkg_config(arguments: &[&str]) -> String {
    let mut command = Command::new("pkg-config");
    run(command.env("PKG_CONFIG_PATH", lib().join("pkgconfig")).args(arguments)).trim().to_owned()
}

#[test]
fn the_shared_library_is_found_by_its_soname() {
    let says = run(Command::new("readelf").arg("-d").arg(lib().join("libcutis.so")));
    assert!(says.contains(&format!("[libcutis.so.{MAJOR}]")), "{says}");
    let link = |name: &str| std::fs::read_link(lib().join(name)).unwrap();
    assert_eq!(link("libcutis.so"), PathBuf::from(format!("libcutis.so.{MAJOR}")));
    assert_eq!(link(&format!("libcutis.so.{MAJOR}")), PathBuf::from(format!("libcutis.so.{VERSION}")));
}

#[test]
fn pkg_config_builds_the_example() {
    if !available("pkg-config") {
        return;
    }
    assert_eq!(pkg_config(&["--modversion", "cutis"]), VERSION);
    let program = scratch("install_pkg_config").join("drive_from_c");
    let flags = pkg_config(&["--cflags", "--libs", "cutis"]);
    let mut compile = Command::new("cc");
    compile.arg("-std=c99").arg(root().join("examples/drive_from_c.c")).arg("-o").arg(&program);
    compile.args(flags.split_whitespace()).arg("-lm");
    run(compile.arg(format!("-Wl,-rpath,{}", pkg_config(&["--variable=libdir", "cutis"]))));
    println!("{}", run(&mut Command::new(&program)));
}

#[test]
fn cmake_builds_the_examples_shared_and_static() {
    if !available("cmake") {
        return;
    }
    let folder = scratch("install_cmake");
    let prefix = format!("-DCMAKE_PREFIX_PATH={}", tree().display());
    run(Command::new("cmake").arg("-S").arg(root().join("examples")).arg("-B").arg(&folder).arg(prefix));
    run(Command::new("cmake").arg("--build").arg(&folder));
    for program in ["drive_from_c", "drive_from_c_static", "drive_from_cpp"] {
        println!("{}", run(&mut Command::new(folder.join(program))));
    }
    let needs = |program: &str| run(Command::new("readelf").arg("-d").arg(folder.join(program)));
    assert!(needs("drive_from_c").contains(&format!("[libcutis.so.{MAJOR}]")));
    assert!(!needs("drive_from_c_static").contains("libcutis"));
}

#[test]
fn cmake_refuses_another_major_version_and_a_broken_tree() {
    if !available("cmake") {
        return;
    }
    let configure = |version: &str, prefix: &Path| {
        let folder = scratch("install_cmake_refuses");
        let text = format!(
            "cmake_minimum_required(VERSION 3.13)\nproject(p C)\nfind_package(cutis {version} REQUIRED CONFIG)\n"
        );
        std::fs::write(folder.join("CMakeLists.txt"), text).unwrap();
        let prefix = format!("-DCMAKE_PREFIX_PATH={}", prefix.display());
        attempt(Command::new("cmake").arg("-S").arg(&folder).arg("-B").arg(folder.join("b")).arg(prefix))
    };
    assert!(configure(VERSION, tree()).0);
    let next: u32 = MAJOR.parse::<u32>().unwrap() + 1;
    assert!(!configure(&format!("{next}.0"), tree()).0, "another major version passes");
    assert!(!configure("0.999", tree()).0, "a later version passes");

    let broken = scratch("install_broken");
    run(Command::new("cp").arg("-a").arg(tree().join("lib")).arg(&broken));
    run(Command::new("cp").arg("-a").arg(tree().join("include")).arg(&broken));
    std::fs::remove_file(broken.join(libdir()).join("libcutis.a")).unwrap();
    let (well, says) = configure(VERSION, &broken);
    // CMake breaks lines where it likes.
    let says = says.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(!well && says.contains("libcutis.a is gone"), "{says}");
}

#[test]
fn slips_are_told() {
    let install = |arguments: &[&str]| attempt(Command::new(root().join("install")).args(arguments));
    for (arguments, told) in [
        (&["--prefx", "/x"][..], "unknown option --prefx"),
        (&["--prefix"], "--prefix wants a value"),
        (&["--libdir", "../lib"], "--libdir is a folder below the prefix"),
        (&["--from", "docs"], "no libcutis.so in docs"),
    ] {
        let (well, says) = install(arguments);
        assert!(!well && says.contains(told), "{arguments:?}: {says}");
    }
}
