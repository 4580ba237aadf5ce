//! Archives: the same bytes each time, small, and the same token after the scene is packed.

use std::io::{Cursor, Read};

use cutis::ffi::capi;
use cutis::fmu::{Binary, FmiVersion, PackageError, Platform, description, package};

use super::util::{library, root, scratch};

/// Promised size of an archive.
const LARGEST: usize = 20_000_000;

/// The library for the machine that runs this test.
fn binary() -> Binary {
    Binary { platform: Platform::here().unwrap(), bytes: std::fs::read(library()).unwrap() }
}

/// The archive of the default scene, written where other tests find it.
pub fn archive(version: FmiVersion, folder: &str) -> std::path::PathBuf {
    let scene = root().join("fmu/scene.toml");
    let loaded = cutis::load::from_file(&scene).unwrap();
    let baked = cutis::load::baked(&scene).unwrap();
    let bytes = package(&loaded, &baked, &[binary()], version).unwrap();
    let path = scratch(folder).join(version.archive_name());
    std::fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn archives_are_reproducible_small_and_complete() {
    for version in [FmiVersion::V3, FmiVersion::V2, FmiVersion::V2Full] {
        let first = std::fs::read(archive(version, "archive_first")).unwrap();
        let second = std::fs::read(archive(version, "archive_second")).unwrap();
        assert!(first == second, "{version:?}: two archives of one scene differ");
        assert!(first.len() < LARGEST, "{version:?}: {} bytes", first.len());
        println!("{}: {:.2} MB", version.archive_name(), first.len() as f64 / 1e6);
        let mut zip = zip::ZipArchive::new(Cursor::new(first)).unwrap();
        let mut text = String::new();
        zip.by_name("modelDescription.xml").unwrap().read_to_string(&mut text).unwrap();
        assert_eq!(text, description(&cutis::load::embedded().unwrap(), version));
        let names: Vec<String> = zip.file_names().map(|n| n.unwrap().to_string()).collect();
        for wanted in [
            "documentation/index.html",
            "documentation/picture.png",
            "documentation/licenses/license.txt",
            "documentation/licenses/license.spdx",
            "documentation/licenses/third-party.txt",
            "documentation/licenses/third-party-notices.txt",
            "resources/scene.toml",
            "resources/model.cutis",
        ] {
            assert!(names.iter().any(|n| n == wanted), "{version:?} lacks {wanted}");
        }
        let of_version: &[&str] = match version {
            FmiVersion::V3 => &[
                "terminalsAndIcons/icon.png",
                "terminalsAndIcons/terminalsAndIcons.xml",
                "extra/org.fmi-standard.fmi-ls-ref/fmi-ls-manifest.xml",
                "extra/org.fmi-standard.fmi-ls-ref/cutis_in.csv",
                "extra/org.fmi-standard.fmi-ls-ref/cutis_out.csv",
            ],
            FmiVersion::V2 | FmiVersion::V2Full => &["model.png"],
        };
        for wanted in of_version {
            assert!(names.iter().any(|n| n == wanted), "{version:?} lacks {wanted}");
        }
        for i in 0..zip.len() {
            let entry = zip.by_index(i).unwrap();
            assert_eq!(entry.compression(), zip::CompressionMethod::Deflated, "{:?}", entry.name());
            assert!(!entry.name().unwrap().contains('\\') && entry.enclosed_name().is_some());
        }
        assert!(names.contains(&binary().platform.library(version)), "{version:?}: {names:?}");
    }
}

#[test]
fn the_packed_scene_has_the_token_of_the_original() {
    let scene = root().join("fmu/scene.toml");
    let baked = cutis::load::baked(&scene).unwrap();
    let folder = scratch("packed");
    std::fs::write(folder.join("scene.toml"), &baked.scene).unwrap();
    std::fs::write(folder.join("model.cutis"), &baked.mesh).unwrap();
    let packed = cutis::load::from_file(&folder.join("scene.toml")).unwrap();
    assert_eq!(packed.model.token(), cutis::load::from_file(&scene).unwrap().model.token());
}

fn entry(bytes: &[u8], name: &str) -> String {
    let mut text = String::new();
    let mut zip = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
    zip.by_name(name).unwrap().read_to_string(&mut text).unwrap();
    text
}

/// Rows of a table: time, then the elements of all columns one after another.
fn table(text: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut lines = text.lines();
    let names = lines.next().unwrap().split(',').map(|n| n.trim_matches('"').to_owned()).collect();
    let row = |line: &str| line.split([',', ' ']).map(|v| v.parse().unwrap()).collect();
    (names, lines.map(row).collect())
}

#[test]
fn the_reference_run_is_what_the_component_does() {
    let path = archive(FmiVersion::V3, "reference");
    let bytes = std::fs::read(&path).unwrap();
    let folder = "extra/org.fmi-standard.fmi-ls-ref";
    let manifest = entry(&bytes, &format!("{folder}/fmi-ls-manifest.xml"));
    for part in [
        "<fmiReferences",
        "fmi-ls:fmi-ls-name=\"org.fmi-standard.fmi-ls-ref\"",
        "fmi-ls:fmi-ls-version",
        "cutis_out.csv",
    ] {
        assert!(manifest.contains(part), "{part}");
    }
    let (inputs, set) = table(&entry(&bytes, &format!("{folder}/cutis_in.csv")));
    let (outputs, told) = table(&entry(&bytes, &format!("{folder}/cutis_out.csv")));
    assert!(set.len() == told.len() && set.len() > 4 && inputs.contains(&"material.fat.E".to_owned()), "{inputs:?}");
    let scene = cutis::load::embedded().unwrap();
    let mut host = cutis::ffi::host::Host::open(&path).unwrap();
    let (mut moved, mut before) = (0.0, 0.0);
    for (k, (set, told)) in set.iter().zip(&told).enumerate() {
        assert!(set[0] == told[0]);
        let mut first = 1;
        for name in &inputs[1..] {
            let n = host.variables().iter().find(|v| v.name == *name).unwrap().len();
            host.set_f64(name, &set[first..first + n]).unwrap();
            first += n;
        }
        if k == 0 {
            host.initialise(set[0]).unwrap();
        } else {
            // The component's own step, not the difference of two rounded times.
            before = host.step(before, scene.programme.dt).unwrap();
            assert_eq!(before, set[0]);
        }
        let mut first = 1;
        for name in &outputs[1..] {
            let found = host.get_f64(name).unwrap();
            assert_eq!(found, told[first..first + found.len()], "{name} at {}", set[0]);
            moved += found.iter().map(|v| v.abs()).sum::<f64>();
            first += found.len();
        }
    }
    assert!(moved > 0.0);
}

#[test]
fn the_full_archive_has_a_scalar_for_every_coordinate_of_the_skin() {
    let scene = cutis::load::embedded().unwrap();
    let count = |version| description(&scene, version).matches("<ScalarVariable").count();
    let skin = scene.model.ports().iter().find(|p| p.name == "skin.position").unwrap();
    let triangles = scene.model.skin_triangles().len();
    assert_eq!(count(FmiVersion::V2Full), count(FmiVersion::V2) + skin.len() + triangles);
    let full = description(&scene, FmiVersion::V2Full);
    let reference = (100_u32 << 20) + 5;
    assert!(full.contains(&format!("name=\"skin.position[2,3]\" valueReference=\"{reference}\"")));
}

#[test]
fn the_token_is_a_hash_of_scene_interface_and_mesh() {
    let scene = |mesh: &str, cells: &str, more: &str| {
        let text = format!(
            "{mesh}[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = {cells}\n[[tissue]]\nE = 15e3\nnu = 0.4\n{more}[[bone]]\nname = \"skull\"\n\
             nodes = \"x_min\"\n"
        );
        cutis::load::from_text(&text, None).unwrap().model.token().to_owned()
    };
    let tokens = [
        scene("", "[3, 2, 1]", ""),
        scene("", "[3, 2, 2]", ""),
        scene("", "[3, 2, 1]", "density = 1001\n"),
        scene("", "[3, 2, 1]", "tunable = \"a\"\n"),
        scene("[mesh]\norder = 2\n", "[3, 2, 1]", ""),
    ];
    for (k, a) in tokens.iter().enumerate() {
        assert!(tokens[..k].iter().all(|b| a != b), "{tokens:?}");
    }
    assert_eq!(tokens[0], scene("", "[3, 2, 1]", ""));
    // What is no part of model and interface.
    let aside = "# a comment\nname = \"other\"\nrun = { end = 2.5 }\n";
    assert_eq!(tokens[0], scene(aside, "[3, 2, 1]", ""));
}

#[test]
fn an_archive_takes_one_library_a_platform() {
    let scene = root().join("fmu/scene.toml");
    let (loaded, baked) = (cutis::load::from_file(&scene).unwrap(), cutis::load::baked(&scene).unwrap());
    let pack = |binaries: &[Binary]| package(&loaded, &baked, binaries, FmiVersion::V3);
    let other = |platform: &str, bytes: Vec<u8>| Binary { platform: platform.parse().unwrap(), bytes };
    let mut windows = vec![0; 72];
    windows[..2].copy_from_slice(b"MZ");
    (windows[60], windows[68], windows[69]) = (64, 0x64, 0x86);
    let both = pack(&[binary(), other("x86_64-windows", windows.clone())]).unwrap();
    let zip = zip::ZipArchive::new(Cursor::new(both)).unwrap();
    let names: Vec<String> = zip.file_names().map(|n| n.unwrap().to_string()).collect();
    assert_eq!(names.iter().filter(|n| n.starts_with("binaries/")).count(), 2, "{names:?}");
    assert!(names.iter().any(|n| n == "binaries/x86_64-windows/cutis.dll"), "{names:?}");

    assert!(matches!(pack(&[]), Err(PackageError::NoLibrary)));
    assert!(matches!(pack(&[binary(), binary()]), Err(PackageError::Twice(_))));
    let message = pack(&[other("aarch64-darwin", windows)]).unwrap_err().to_string();
    assert_eq!(message, "the library for aarch64-darwin is one for x86_64-windows");
    assert!(matches!(pack(&[other("x86_64-linux", b"text".to_vec())]), Err(PackageError::Foreign { found: None, .. })));
}

#[test]
fn a_baked_scene_is_a_simulation_without_files() {
    let baked = cutis::load::baked_default().unwrap();
    let scene = std::ffi::CString::new(baked.scene).unwrap();
    let mut why = [0; 256];
    // SAFETY: all pointers are of live buffers of the lengths beside them.
    let token = unsafe {
        let sim = capi::cutis_sim_new_from_baked(
            scene.as_ptr(),
            baked.mesh.as_ptr(),
            baked.mesh.len(),
            why.as_mut_ptr(),
            why.len(),
        );
        assert!(!sim.is_null());
        let mut token = [0; 64];
        capi::cutis_sim_token(sim, token.as_mut_ptr(), token.len());
        capi::cutis_sim_free(sim);
        std::ffi::CStr::from_ptr(token.as_ptr()).to_str().unwrap().to_owned()
    };
    assert_eq!(token, cutis::load::embedded().unwrap().model.token());
}
