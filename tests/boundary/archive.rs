//! Archives: the same bytes each time, small, and the same token after the scene is packed.

use std::io::{Cursor, Read};

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
    for version in [FmiVersion::V3, FmiVersion::V2] {
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
            "documentation/licenses/license.txt",
            "resources/scene.toml",
            "resources/model.cutis",
        ] {
            assert!(names.iter().any(|n| n == wanted), "{version:?} lacks {wanted}");
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
