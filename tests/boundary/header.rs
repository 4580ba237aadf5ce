//! `include/cutis.h` is what cbindgen makes of `src/ffi/capi.rs`.

use super::util::{compare, root};

#[test]
fn header_is_up_to_date() {
    let config = cbindgen::Config::from_file(root().join("include/cbindgen.toml")).unwrap();
    let capi = root().join("src/ffi/capi.rs");
    let bindings = cbindgen::Builder::new().with_config(config).with_src(capi).generate().unwrap();
    let mut bytes = Vec::new();
    bindings.write(&mut bytes);
    let generated = String::from_utf8(bytes).unwrap();
    let [major, minor, patch] = ["MAJOR", "MINOR", "PATCH"].map(|part| match part {
        "MAJOR" => env!("CARGO_PKG_VERSION_MAJOR"),
        "MINOR" => env!("CARGO_PKG_VERSION_MINOR"),
        _ => env!("CARGO_PKG_VERSION_PATCH"),
    });
    let source = std::fs::read_to_string(root().join("src/ffi/capi.rs")).unwrap();
    let abi =
        source.split("const ABI: u32 = ").nth(1).and_then(|s| s.split(';').next()).expect("capi.rs states the ABI");
    let preface = "/* cutis: soft tissue of the human face. C99 and C++11.\n\
         \x20*\n\
         \x20*   char why[256];\n\
         \x20*   CutisSim *sim = cutis_sim_new_default(why, sizeof why);\n\
         \x20*   size_t bones = cutis_port_find(sim, \"bone.translation\"), skin = cutis_port_find(sim, \"skin.position\");\n\
         \x20*   cutis_sim_initialise(sim);\n\
         \x20*   cutis_sim_set_f64(sim, bones, d, cutis_port_len(sim, bones));\n\
         \x20*   cutis_sim_step(sim, 0.01);\n\
         \x20*   cutis_sim_get_f64(sim, skin, x, cutis_port_len(sim, skin));\n\
         \x20*   cutis_sim_free(sim);\n\
         \x20*\n\
         \x20* All values are in SI units. Every call returns; none prints, exits or throws. A call that fails changes\n\
         \x20* nothing, and cutis_sim_message tells why. Generated from src/ffi/capi.rs; do not edit.\n\
         \x20*/\n";
    let macros = format!(
        "#define CUTIS_VERSION_MAJOR {major}\n#define CUTIS_VERSION_MINOR {minor}\n#define CUTIS_VERSION_PATCH {patch}\n#define CUTIS_ABI {abi}\n"
    );
    let (guard, rest) = generated.split_once("#include <stddef.h>").expect("the header includes stddef.h");
    compare(
        "include/cutis.h",
        &format!(
            "{preface}{guard}#include <stddef.h>{}",
            rest.replacen("#include <stdint.h>\n", &format!("#include <stdint.h>\n\n{macros}"), 1)
        ),
    );
}
