//! CT volumes: NIfTI, NRRD, DICOM. What is read has a sample for each voxel, and can be asked anywhere.
//!
//! First byte: the format; even second byte: edits to a sound file, else the rest is the file. DICOM needs two slices: the
//! other one is sound.

use cutis::geometry::Volume;
use cutis::io::{read_labels, read_volume};
use cutis::math::Vec3;

use super::mesh::folder;
use super::taste::{Taste, edited};

pub fn once(data: &[u8]) {
    let mut taste = Taste(data);
    let kind = taste.below(4);
    let file = match (taste.byte().is_multiple_of(2), kind) {
        (true, 1) => gzip(&edited(sound(kind), &mut taste)),
        (true, _) => edited(sound(kind), &mut taste),
        _ => taste.0.to_vec(),
    };
    let name = ["ct.nii", "ct.nii.gz", "ct.nrrd", "series"][kind];
    let path = folder().join(name);
    if kind == 3 {
        std::fs::create_dir_all(&path).expect("a folder");
        std::fs::write(path.join("1.dcm"), file).expect("room for a file");
        std::fs::write(path.join("2.dcm"), slice(2.0)).expect("room for a file");
    } else {
        std::fs::write(&path, file).expect("room for a file");
        let _ = read_labels(&path, &cutis::io::LabelMap::default(), &mut Vec::new());
    }
    if let Ok(volume) = read_volume(&path, &mut Vec::new()) {
        check(&volume);
    }
}

fn check(volume: &Volume) {
    let n: usize = volume.grid.dims.iter().product();
    assert_eq!(n, volume.samples.len(), "samples and voxels differ");
    let centre = volume.grid.world(&Vec3::new(0.5, 0.5, 0.5));
    assert!(centre.iter().all(|c| c.is_finite()), "a voxel at {centre:?}");
    volume.sample(&centre);
    volume.sample(&Vec3::new(f64::NAN, 1e300, -1.0));
}

fn sound(kind: usize) -> Vec<u8> {
    match kind {
        0 | 1 => nifti(),
        2 => nrrd("raw"),
        _ => slice(0.0),
    }
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut writer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    writer.write_all(bytes).expect("a Vec takes everything");
    writer.finish().expect("a Vec takes everything")
}

/// A NIfTI-1 file of 3 x 2 x 2 int16 voxels with an sform.
fn nifti() -> Vec<u8> {
    let mut header = vec![0u8; 352];
    let mut put = |at: usize, bytes: &[u8]| header[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, &348i32.to_le_bytes());
    for (k, n) in [3i16, 3, 2, 2, 1, 1, 1, 1].iter().enumerate() {
        put(40 + 2 * k, &n.to_le_bytes());
    }
    put(70, &4i16.to_le_bytes());
    put(72, &16i16.to_le_bytes());
    for k in 0..8 {
        put(76 + 4 * k, &1f32.to_le_bytes());
    }
    put(108, &352f32.to_le_bytes());
    put(112, &1f32.to_le_bytes());
    put(123, &[2]);
    put(252, &[1, 0, 1, 0]);
    for (k, at) in [280, 280 + 20, 280 + 40].into_iter().enumerate() {
        put(at, &(1.0 + k as f32).to_le_bytes());
    }
    put(344, b"n+1\0");
    header.extend((0..12i16).flat_map(|v| (100 * v).to_le_bytes()));
    header
}

fn nrrd(encoding: &str) -> Vec<u8> {
    let mut file = format!(
        "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 3 2 2\nspace directions: (1,0,0) \
         (0,1,0) (0,0,1)\nendian: little\nencoding: {encoding}\nspace origin: (0,0,0)\n\n"
    )
    .into_bytes();
    match encoding {
        "raw" => file.extend((0..12i16).flat_map(|v| (100 * v).to_le_bytes())),
        _ => file.extend(b"0 1 2 3 4 5 6 7 8 9 10 11"),
    }
    file
}

/// An explicit little-endian CT slice of 3 x 2 pixels at height `z`, mm.
fn slice(z: f64) -> Vec<u8> {
    let mut meta = Vec::new();
    let uid: &[u8] = b"1.2.840.10008.1.2.1";
    for (number, value) in [(2, &b"1.2.840.10008.5.1.4.1.1.2"[..]), (3, b"1.2.3"), (0x10, uid), (0x12, b"1.2.3.4")] {
        element(&mut meta, 2, number, b"UI", value);
    }
    let mut out = vec![0; 128];
    out.extend(b"DICM");
    element(&mut out, 2, 0, b"UL", &(meta.len() as u32).to_le_bytes());
    out.extend(meta);
    element(&mut out, 0x0008, 0x0060, b"CS", b"CT");
    element(&mut out, 0x0020, 0x000E, b"UI", b"1.2.9");
    element(&mut out, 0x0020, 0x0032, b"DS", format!("0\\0\\{z}").as_bytes());
    element(&mut out, 0x0020, 0x0037, b"DS", b"1\\0\\0\\0\\1\\0");
    element(&mut out, 0x0028, 0x0010, b"US", &2u16.to_le_bytes());
    element(&mut out, 0x0028, 0x0011, b"US", &3u16.to_le_bytes());
    element(&mut out, 0x0028, 0x0030, b"DS", b"2\\1");
    element(&mut out, 0x0028, 0x0100, b"US", &16u16.to_le_bytes());
    element(&mut out, 0x0028, 0x0103, b"US", &0u16.to_le_bytes());
    element(&mut out, 0x0028, 0x1052, b"DS", b"-1024");
    element(&mut out, 0x0028, 0x1053, b"DS", b"1");
    out.extend([0xE0, 0x7F, 0x10, 0x00]);
    out.extend(b"OW\0\0");
    out.extend(12u32.to_le_bytes());
    out.extend((0..6u16).flat_map(|k| (1000 + k).to_le_bytes()));
    out
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

pub fn seeds() -> Vec<Vec<u8>> {
    let whole = |kind: u8, file: Vec<u8>| [&[kind, 1][..], &file].concat();
    let mut all = vec![
        whole(0, nifti()),
        whole(1, gzip(&nifti())),
        whole(2, nrrd("raw")),
        whole(2, nrrd("ascii")),
        whole(3, slice(0.0)),
    ];
    all.extend((0..4).map(|kind| vec![kind, 0]));
    all
}

/// The sound files are sound; else the fuzzer would only ever see refusals.
pub fn seeds_are_read() {
    for kind in [0, 2, 3] {
        let path = folder().join(["ct.nii", "", "ct.nrrd", "series"][kind]);
        if kind == 3 {
            std::fs::create_dir_all(&path).expect("a folder");
            std::fs::write(path.join("1.dcm"), slice(0.0)).expect("room");
            std::fs::write(path.join("2.dcm"), slice(2.0)).expect("room");
        } else {
            std::fs::write(&path, sound(kind)).expect("room");
        }
        check(&read_volume(&path, &mut Vec::new()).unwrap_or_else(|why| panic!("{}: {why}", path.display())));
    }
}
