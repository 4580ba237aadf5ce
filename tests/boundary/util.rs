//! Where things are, and how generated files are compared.

use std::path::{Path, PathBuf};

/// The package's folder.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The shared library that cargo built beside this test.
pub fn library() -> PathBuf {
    let folder = Path::new(env!("CARGO_BIN_EXE_cutis")).parent().expect("an executable lies in a folder");
    let name = format!("{}cutis{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let places = [folder.join("deps").join(&name), folder.join(&name)];
    let newest = places.iter().filter_map(|p| Some((p.metadata().ok()?.modified().ok()?, p))).max();
    newest.unwrap_or_else(|| panic!("no {name} in {}", folder.display())).1.clone()
}

/// A folder for this test's files, emptied of nothing.
pub fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// A generated file must be what is checked in; `BLESS=1` writes it instead.
pub fn compare(path: &str, generated: &str) {
    let path = root().join(path);
    if std::env::var_os("BLESS").is_some() {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, generated).unwrap();
        return;
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    if found != generated {
        let line = found.lines().zip(generated.lines()).position(|(a, b)| a != b);
        let line = line.unwrap_or_else(|| found.lines().count().min(generated.lines().count()));
        panic!(
            "{} is out of date from line {}:\n  checked in: {}\n  generated:  {}\n`BLESS=1 cargo test --release --test boundary` rewrites it",
            path.display(),
            line + 1,
            found.lines().nth(line).unwrap_or("(nothing)"),
            generated.lines().nth(line).unwrap_or("(nothing)"),
        );
    }
}
