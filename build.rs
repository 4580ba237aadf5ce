//! Tells the loader the name under which programs look for the shared library: `libcutis.so.0`, by the major version.
//!
//! Within a major version the binary interface only grows (tests/abi), so that is the number that counts.

use std::env::var;

/// Systems whose linkers know `-soname`.
const ELF: [&str; 6] = ["linux", "android", "freebsd", "netbsd", "openbsd", "dragonfly"];

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let os = var("CARGO_CFG_TARGET_OS").unwrap_or_default();
    if let (true, Ok(major)) = (ELF.contains(&os.as_str()), var("CARGO_PKG_VERSION_MAJOR")) {
        println!("cargo:rustc-cdylib-link-arg=-Wl,-soname,libcutis.so.{major}");
    }
}
