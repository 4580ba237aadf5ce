//! CT volumes: every reader agrees, and every kind of bad input is told apart.
use std::path::{Path, PathBuf};

use cutis::io::{IoError, LabelMap, read_labels, read_volume};

use super::mesh_files::scratch;

/// The shared head CT data, if it is here.
pub fn data(name: &str) -> Option<PathBuf> {
    let base = std::env::var_os("CUTIS_DATA")
        .map_or(Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    let path = base.join(name);
    if !path.exists() {
        println!("SKIPPED: {} is not here; set CUTIS_DATA to the folder of the head CT data", path.display());
        return None;
    }
    Some(path)
}

#[test]
fn nrrd_and_dicom_hold_the_same_volume() {
    let (Some(nrrd), Some(dicom)) = (data("cthead_unc_2mm.nrrd"), data("dicom_2mm")) else { return };
    let (a, b) = (read_volume(&nrrd, &mut Vec::new()).unwrap(), read_volume(&dicom, &mut Vec::new()).unwrap());
    assert_eq!(a.grid.dims, [128, 128, 113]);
    assert!((a.grid.origin - b.grid.origin).norm() < 1e-9, "{} {}", a.grid.origin, b.grid.origin);
    assert!((a.grid.spacing - b.grid.spacing).norm() < 1e-9);
    assert_eq!(a.samples, b.samples);
}

#[test]
fn nifti_head_and_labels() {
    let (Some(head), Some(labels)) = (data("cthead_unc_clean.nii.gz"), data("cthead_unc_labels.nii.gz")) else {
        return;
    };
    let volume = read_volume(&head, &mut Vec::new()).unwrap();
    assert_eq!(volume.grid.dims, [256, 256, 113]);
    assert!((volume.grid.origin.x + 0.1275).abs() < 1e-12 && (volume.grid.spacing.z - 0.002).abs() < 1e-12);
    let labels = read_labels(&labels, &LabelMap::default(), &mut Vec::new()).unwrap();
    assert_eq!(labels.grid, volume.grid);
    // The mandible's chin, by index (106, 45, 16).
    let chin = labels.grid.world(&nalgebra::Vector3::new(106.0, 45.0, 16.0));
    assert_eq!(labels.at(&chin), 3);
    assert!(volume.sample(&chin) > 250.0);
}

/// One explicit little-endian CT slice.
struct Dcm {
    modality: &'static str,
    series: &'static str,
    position: [f64; 3],
    syntax: &'static str,
    rows: u16,
}

impl Dcm {
    fn bytes(&self) -> Vec<u8> {
        let mut meta = Vec::new();
        element(&mut meta, 0x0002, 0x0002, b"UI", b"1.2.840.10008.5.1.4.1.1.2");
        element(&mut meta, 0x0002, 0x0003, b"UI", b"1.2.3");
        element(&mut meta, 0x0002, 0x0010, b"UI", self.syntax.as_bytes());
        element(&mut meta, 0x0002, 0x0012, b"UI", b"1.2.3.4");
        let mut out = vec![0; 128];
        out.extend(b"DICM");
        element(&mut out, 0x0002, 0x0000, b"UL", &(meta.len() as u32).to_le_bytes());
        out.extend(meta);
        let [x, y, z] = self.position;
        element(&mut out, 0x0008, 0x0060, b"CS", self.modality.as_bytes());
        element(&mut out, 0x0020, 0x000E, b"UI", self.series.as_bytes());
        element(&mut out, 0x0020, 0x0032, b"DS", format!("{x}\\{y}\\{z}").as_bytes());
        element(&mut out, 0x0020, 0x0037, b"DS", b"1\\0\\0\\0\\1\\0");
        element(&mut out, 0x0028, 0x0010, b"US", &self.rows.to_le_bytes());
        element(&mut out, 0x0028, 0x0011, b"US", &3u16.to_le_bytes());
        element(&mut out, 0x0028, 0x0030, b"DS", b"2\\1");
        element(&mut out, 0x0028, 0x0100, b"US", &16u16.to_le_bytes());
        element(&mut out, 0x0028, 0x0103, b"US", &0u16.to_le_bytes());
        element(&mut out, 0x0028, 0x1052, b"DS", b"-1024");
        element(&mut out, 0x0028, 0x1053, b"DS", b"1");
        let pixels: Vec<u8> = (0..3 * self.rows).flat_map(|k| (1000 + k).to_le_bytes()).collect();
        out.extend([0xE0, 0x7F, 0x10, 0x00]);
        out.extend(b"OW\0\0");
        out.extend((pixels.len() as u32).to_le_bytes());
        out.extend(pixels);
        out
    }
}

fn element(out: &mut Vec<u8>, group: u16, number: u16, vr: &[u8; 2], value: &[u8]) {
    out.extend(group.to_le_bytes());
    out.extend(number.to_le_bytes());
    out.extend(vr);
    out.extend(((value.len() + value.len() % 2) as u16).to_le_bytes());
    out.extend(value);
    if value.len() % 2 == 1 {
        out.push(if vr == b"UI" { 0 } else { b' ' });
    }
}

fn series(name: &str, change: impl Fn(usize, &mut Dcm) -> bool) -> Result<cutis::geometry::Volume, IoError> {
    let folder = scratch(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    for k in 0..8usize {
        let position = [-10.0, 5.0, 100.0 - 1.5 * k as f64];
        let mut slice = Dcm { modality: "CT", series: "1.2.9", position, syntax: "1.2.840.10008.1.2.1", rows: 4 };
        if change(k, &mut slice) {
            std::fs::write(folder.join(format!("IM{k}.dcm")), slice.bytes()).unwrap();
        }
    }
    std::fs::write(folder.join("README"), "not a slice").unwrap();
    read_volume(&folder, &mut Vec::new())
}

#[test]
fn dicom_series_are_checked() {
    let good = series("good", |_, _| true).unwrap();
    assert_eq!(good.grid.dims, [3, 4, 8]);
    assert_eq!(good.samples[1], 1001.0 - 1024.0);
    assert!((good.grid.spacing - nalgebra::Vector3::new(1e-3, 2e-3, 1.5e-3)).norm() < 1e-12);
    assert!((good.grid.origin.z - 0.0895).abs() < 1e-12);
    let error = |name: &str, change: &dyn Fn(usize, &mut Dcm) -> bool| series(name, change).unwrap_err();
    let missing = error("missing", &|k, _| k != 3);
    assert!(matches!(missing, IoError::MissingSlices { missing: 1, .. }), "{missing}");
    let uneven = error("uneven", &|k, s| {
        s.position[2] += if k == 5 { 0.4 } else { 0.0 };
        true
    });
    assert!(matches!(uneven, IoError::Spacing { .. }), "{uneven}");
    let tilt = error("tilt", &|k, s| {
        s.position[1] += 0.3 * k as f64;
        true
    });
    assert!(matches!(tilt, IoError::GantryTilt { degrees, .. } if (degrees - 11.3).abs() < 0.1), "{tilt}");
    let mixed = error("mixed", &|k, s| {
        s.series = if k == 2 { "1.2.10" } else { "1.2.9" };
        true
    });
    assert!(matches!(mixed, IoError::MixedSeries { found: 2, .. }), "{mixed}");
    let mr = error("mr", &|_, s| {
        s.modality = "MR";
        true
    });
    assert!(matches!(mr, IoError::Modality { .. }), "{mr}");
    let jpeg = error("jpeg", &|_, s| {
        s.syntax = "1.2.840.10008.1.2.4.70";
        true
    });
    assert!(matches!(jpeg, IoError::Unsupported { .. }) && jpeg.to_string().contains("another way"), "{jpeg}");
    let shape = error("shape", &|k, s| {
        s.rows = if k == 2 { 5 } else { 4 };
        true
    });
    assert!(matches!(shape, IoError::Unsupported { .. }), "{shape}");
    let cut = scratch("good").join("IM4.dcm");
    let bytes = std::fs::read(&cut).unwrap();
    for end in [10, 140, 300, bytes.len() - 5] {
        std::fs::write(&cut, &bytes[..end]).unwrap();
        assert!(read_volume(&scratch("good"), &mut Vec::new()).is_err(), "cut at {end}");
    }
}

fn nrrd(name: &str, head: &str, data: &[u8]) -> Result<cutis::geometry::Volume, IoError> {
    let path = scratch(name);
    std::fs::write(&path, [head.as_bytes(), data].concat()).unwrap();
    read_volume(&path, &mut Vec::new())
}

#[test]
fn nrrd_is_checked() {
    let head = |sizes: &str, directions: &str, encoding: &str| {
        format!(
            "NRRD0005\n# c\ntype: short\ndimension: 3\nspace: right-anterior-superior\nsizes: {sizes}\nspace directions: {directions}\nendian: little\nencoding: {encoding}\nspace origin: (1,2,3)\n\n"
        )
    };
    let straight = "(1,0,0) (0,2,0) (0,0,3)";
    let data: Vec<u8> = (0..8i16).flat_map(|v| v.to_le_bytes()).collect();
    let volume = nrrd("a.nrrd", &head("2 2 2", straight, "raw"), &data).unwrap();
    assert_eq!(volume.samples[7], 7.0);
    assert!((volume.grid.origin * 1e3 - nalgebra::Vector3::new(-1.0, -2.0, 3.0)).norm() < 1e-12);
    assert_eq!(volume.grid.direction[(0, 0)], -1.0);
    let text = nrrd("t.nrrd", &head("2 2 2", straight, "ascii"), b"0 1 2 3 4 5 6 7").unwrap();
    assert_eq!(text, volume);
    let cut = nrrd("b.nrrd", &head("2 2 2", straight, "raw"), &data[..15]).unwrap_err();
    assert!(matches!(cut, IoError::Truncated { .. }), "{cut}");
    let lie = nrrd("c.nrrd", &head("999999 999999 999999", straight, "gzip"), &data).unwrap_err();
    assert!(matches!(lie, IoError::Format { .. } | IoError::Truncated { .. }), "{lie}");
    let tilt = nrrd("d.nrrd", &head("2 2 2", "(1,0,0) (0,2,0) (0,1,3)", "raw"), &data).unwrap_err();
    assert!(matches!(tilt, IoError::GantryTilt { .. }), "{tilt}");
    let foreign = nrrd("e.nrrd", "hello\n\n", &data).unwrap_err();
    assert!(matches!(foreign, IoError::Format { .. }), "{foreign}");
}

#[test]
fn cut_nifti_is_told() {
    let Some(path) = data("cthead_face_bench.nii.gz") else { return };
    let bytes = std::fs::read(path).unwrap();
    let cut = scratch("cut.nii.gz");
    for share in [0, 1, 5, 9] {
        std::fs::write(&cut, &bytes[..bytes.len() * share / 10]).unwrap();
        let error = read_volume(&cut, &mut Vec::new()).unwrap_err();
        assert!(matches!(error, IoError::Truncated { .. }), "{error}");
    }
    assert!(matches!(read_volume(Path::new("nowhere.nii"), &mut Vec::new()).unwrap_err(), IoError::File { .. }));
}

#[test]
fn samples_are_not_read_from_a_device() {
    let path = scratch("endless").with_extension("nhdr");
    let header = "NRRD0004\ntype: short\ndimension: 3\nspace: lps\nsizes: 3 2 2\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n\
                  encoding: raw\nendian: little\ndata file: /dev/zero\n";
    std::fs::write(&path, header).unwrap();
    let message = read_volume(&path, &mut Vec::new()).unwrap_err().to_string();
    assert!(cfg!(not(unix)) || message.contains("/dev/zero: this is a pipe, a socket or a device"), "{message}");
}
