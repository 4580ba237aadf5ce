//! NIfTI field by field: what changes a sample or a place is honoured, told, or the file is refused and the field named.
use cutis::geometry::Volume;
use cutis::io::{IoError, read_volume};
use nalgebra::Vector3;

use super::mesh_files::{fresh, scratch};

/// Where fields of the header lie: (offset, bytes) in NIfTI-1 and NIfTI-2.
const DIM: [(usize, usize); 2] = [(40, 2), (16, 8)];
const INTENT: [(usize, usize); 2] = [(68, 2), (504, 4)];
const DATATYPE: [(usize, usize); 2] = [(70, 2), (12, 2)];
const BITPIX: [(usize, usize); 2] = [(72, 2), (14, 2)];
const PIXDIM: [(usize, usize); 2] = [(76, 4), (104, 8)];
const OFFSET: [(usize, usize); 2] = [(108, 4), (168, 8)];
const SLOPE: [(usize, usize); 2] = [(112, 4), (176, 8)];
const INTER: [(usize, usize); 2] = [(116, 4), (184, 8)];
const UNITS: [(usize, usize); 2] = [(123, 1), (500, 4)];
const QFORM: [(usize, usize); 2] = [(252, 2), (344, 4)];
const SFORM: [(usize, usize); 2] = [(254, 2), (348, 4)];
const QUATERN: [(usize, usize); 2] = [(256, 4), (352, 8)];
const QOFFSET: [(usize, usize); 2] = [(268, 4), (376, 8)];
const SROW: [(usize, usize); 2] = [(280, 4), (400, 8)];
const DIMS: [usize; 3] = [40, 30, 20];

/// A volume of 40 x 30 x 20 voxels of 1 x 2 x 3 mm, int16, whose form is set both ways.
#[derive(Clone)]
struct File {
    header: Vec<u8>,
    data: Vec<u8>,
    /// 0 or 1: NIfTI-1 or NIfTI-2.
    version: usize,
    big: bool,
}

impl File {
    fn new(version: usize, big: bool) -> Self {
        let size = [348, 540][version];
        let mut file = Self { header: vec![0; size + 4], data: Vec::new(), version, big };
        file.int([(0, 4), (0, 4)], 0, size as i64);
        let mark: &[u8] = if version == 0 { b"n+1\0" } else { b"n+2\0\r\n\x1a\n" };
        let at = [344, 4][version];
        file.header[at..at + mark.len()].copy_from_slice(mark);
        for (k, n) in [3, 40, 30, 20, 1, 1, 1, 1].into_iter().enumerate() {
            file.int(DIM, k, n);
        }
        file.int(DATATYPE, 0, 4);
        file.int(BITPIX, 0, 16);
        for (k, n) in [-1.0, 1.0, 2.0, 3.0].into_iter().enumerate() {
            file.real(PIXDIM, k, n);
        }
        if version == 0 {
            file.real(OFFSET, 0, 352.0)
        } else {
            file.int(OFFSET, 0, 544)
        }
        file.int(UNITS, 0, 10);
        file.int(QFORM, 0, 1);
        file.int(SFORM, 0, 1);
        // Half a turn about z takes RAS to LPS; with a flip of z the stack runs downward.
        file.real(QUATERN, 2, 1.0);
        for (k, v) in [12.0, 13.0, 14.0].into_iter().enumerate() {
            file.real(QOFFSET, k, v);
        }
        let rows = [[-1.0, 0.0, 0.0, 12.0], [0.0, -2.0, 0.0, 13.0], [0.0, 0.0, -3.0, 14.0]];
        rows.as_flattened().iter().enumerate().for_each(|(k, v)| file.real(SROW, k, *v));
        let value = |k: usize| (k as i64 * 7 % 3000 - 1000) as i16;
        file.data =
            (0..24000).flat_map(|k| if big { value(k).to_be_bytes() } else { value(k).to_le_bytes() }).collect();
        file
    }
    fn put(&mut self, at: usize, mut bytes: Vec<u8>) {
        if self.big {
            bytes.reverse();
        }
        self.header[at..at + bytes.len()].copy_from_slice(&bytes);
    }
    fn int(&mut self, field: [(usize, usize); 2], k: usize, value: i64) {
        let (at, n) = field[self.version];
        self.put(at + n * k, value.to_le_bytes()[..n].to_vec());
    }
    fn real(&mut self, field: [(usize, usize); 2], k: usize, value: f64) {
        let (at, n) = field[self.version];
        self.put(at + n * k, if n == 8 { value.to_le_bytes().to_vec() } else { (value as f32).to_le_bytes().to_vec() });
    }
    fn bytes(&self) -> Vec<u8> {
        [&self.header[..], &self.data].concat()
    }
}

fn read_bytes(name: &str, bytes: &[u8]) -> (Result<Volume, IoError>, String) {
    let path = if name.starts_with("pair") { scratch(name) } else { fresh(name) };
    std::fs::write(&path, bytes).unwrap();
    let mut notes = Vec::new();
    let volume = read_volume(&path, &mut notes);
    if !name.starts_with("pair") {
        std::fs::remove_file(&path).unwrap();
    }
    (volume, notes.join("; "))
}

fn usual() -> Volume {
    let (volume, notes) = read_bytes("usual.nii", &File::new(0, false).bytes());
    let volume = volume.unwrap();
    assert_eq!(notes, "");
    assert_eq!(volume.grid.dims, DIMS);
    assert!((volume.grid.origin * 1e3 - Vector3::new(-12.0, -13.0, 14.0)).norm() < 1e-12);
    assert_eq!(volume.grid.direction.diagonal(), Vector3::new(1.0, 1.0, -1.0));
    volume
}

fn same(what: &str, note: &str, change: impl Fn(&mut File)) {
    let mut file = File::new(0, false);
    change(&mut file);
    let (volume, notes) = read_bytes("same.nii", &file.bytes());
    assert_eq!(volume.unwrap_or_else(|e| panic!("{what}: {e}")), usual(), "{what}");
    assert!(notes.contains(note) && note.is_empty() == notes.is_empty(), "{what}: {notes}");
}

fn refused(field: &str, change: impl Fn(&mut File)) {
    let mut file = File::new(0, false);
    change(&mut file);
    let (volume, notes) = read_bytes("refused.nii", &file.bytes());
    let message = volume.map(|_| format!("taken, with {notes:?}")).unwrap_or_else(|e| e.to_string());
    assert!(message.contains(field), "{field}: {message}");
}

#[test]
fn both_versions_and_byte_orders_give_the_same() {
    for version in [0, 1] {
        for big in [false, true] {
            let (volume, notes) = read_bytes("order.nii", &File::new(version, big).bytes());
            assert_eq!((volume.unwrap(), notes.as_str()), (usual(), ""), "version {version}, big-endian {big}");
        }
    }
}

#[test]
fn samples_are_scaled_and_of_every_type() {
    let values = |slope: f64, inter: f64| {
        let mut file = File::new(0, false);
        file.real(SLOPE, 0, slope);
        file.real(INTER, 0, inter);
        read_bytes("scaled.nii", &file.bytes()).0.unwrap().samples[..2].to_vec()
    };
    assert_eq!(values(2.0, 10.0), [-1990.0, -1976.0]);
    assert_eq!(values(0.0, 10.0), [-1000.0, -993.0]);
    assert_eq!(values(f64::NAN, 0.0), [-1000.0, -993.0]);
    refused("scl_slope", |f| f.real(SLOPE, 0, f64::INFINITY));
    refused("scl_inter", |f| {
        f.real(SLOPE, 0, 1.0);
        f.real(INTER, 0, f64::NAN);
    });
    for (code, width) in [(2, 1), (4, 2), (8, 4), (16, 4), (64, 8), (256, 1), (512, 2), (768, 4), (1024, 8), (1280, 8)]
    {
        let mut file = File::new(0, false);
        file.int(DATATYPE, 0, code);
        file.int(BITPIX, 0, 8 * width as i64);
        let value = |k: usize| match code {
            16 => (k as f32).to_le_bytes().to_vec(),
            64 => (k as f64).to_le_bytes().to_vec(),
            _ => k.to_le_bytes()[..width].to_vec(),
        };
        file.data = (0..24000).flat_map(|k| value(k % 100)).collect();
        let (volume, _) = read_bytes("types.nii", &file.bytes());
        let samples = volume.unwrap().samples;
        assert!(samples.iter().enumerate().all(|(k, s)| *s == (k % 100) as f32), "data type {code}");
    }
    for code in [0, 1, 32, 128, 1536, 2304] {
        refused("datatype", move |f| f.int(DATATYPE, 0, code));
    }
    refused("bitpix", |f| f.int(BITPIX, 0, 32));
    refused("intent_code", |f| f.int(INTENT, 0, 5));
    same("labels", "", |f| f.int(INTENT, 0, 1002));
}

#[test]
fn places_are_told_where_they_are_doubtful() {
    same("sform alone", "", |f| f.int(QFORM, 0, 0));
    same("qform alone", "", |f| f.int(SFORM, 0, 0));
    same("qform to the scanner, sform to an atlas", "atlas", |f| {
        f.int(SFORM, 0, 4);
        f.int(QFORM, 0, 0);
    });
    same("qform beside an atlas", "qform was taken", |f| {
        f.int(SFORM, 0, 4);
        f.real(SROW, 0, -1.4);
    });
    same("left and right", "disagree", |f| f.real(QOFFSET, 0, -12.0));
    same("a flip", "disagree", |f| f.real(PIXDIM, 0, 1.0));
    same("edges", "pixdim", |f| {
        f.int(QFORM, 0, 0);
        f.real(PIXDIM, 3, 2.5);
    });
    same("no unit", "xyzt_units", |f| f.int(UNITS, 0, 0));
    let unit = |code: i64| {
        let mut file = File::new(0, false);
        file.int(UNITS, 0, code);
        read_bytes("unit.nii", &file.bytes())
    };
    let (metres, notes) = unit(1);
    assert!((metres.unwrap().grid.spacing.z - 3.0).abs() < 1e-12 && notes.contains("no head"), "{notes}");
    let (microns, notes) = unit(3);
    assert!((microns.unwrap().grid.spacing.z - 3e-6).abs() < 1e-12 && notes.contains("no head"), "{notes}");
    assert!(unit(5).0.unwrap_err().to_string().contains("xyzt_units"));
    refused("sform and qform", |f| {
        f.int(SFORM, 0, 0);
        f.int(QFORM, 0, 0);
    });
    refused("quatern", |f| f.real(QUATERN, 0, 0.9));
    refused("pixdim", |f| {
        f.int(SFORM, 0, 0);
        f.real(PIXDIM, 2, 0.0);
    });
    refused("sheared", |f| f.real(SROW, 1, 0.5));
}

#[test]
fn dimensions_offsets_and_rests_are_checked() {
    same("one time", "", |f| f.int(DIM, 0, 4));
    refused("dim", |f| {
        f.int(DIM, 0, 4);
        f.int(DIM, 4, 2);
    });
    refused("dim", |f| f.int(DIM, 0, 2));
    refused("dim", |f| f.int(DIM, 2, -30));
    same("offset of old writers", "", |f| f.real(OFFSET, 0, 0.0));
    same("an extension", "", |f| {
        f.real(OFFSET, 0, 384.0);
        f.header[348] = 1;
        f.header.extend([[32, 0, 0, 0].to_vec(), vec![6; 28]].concat());
    });
    refused("vox_offset", |f| f.real(OFFSET, 0, 100.0));
    refused("vox_offset", |f| f.real(OFFSET, 0, 352.5));
    refused("vox_offset", |f| f.real(OFFSET, 0, f64::NAN));
    refused("ends early", |f| f.real(OFFSET, 0, 1e30));
    same("zeros behind", "", |f| f.data.extend([0; 100]));
    same("a rest", "behind the samples", |f| f.data.extend([1; 100]));
    refused("ends early", |f| f.data.truncate(24000));
    refused("348", |f| f.header[0] = 7);
    refused("Analyze", |f| f.header[344..348].fill(0));
    refused("magic", |f| f.header[344] = b'x');
}

#[test]
fn pairs_and_packed_files_are_read() {
    let file = File::new(0, false);
    let pack = |bytes: &[u8]| {
        let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        std::io::Write::write_all(&mut packer, bytes).unwrap();
        packer.finish().unwrap()
    };
    let whole = pack(&file.bytes());
    let bytes = file.bytes();
    let (first, second) = bytes.split_at(5000);
    for (what, bytes, note) in [
        ("plain", whole.clone(), ""),
        ("two members", [pack(first), pack(second)].concat(), ""),
        ("zeros behind", [&whole[..], &[0; 512]].concat(), ""),
        ("bytes behind", [&whole[..], b"stray"].concat(), "5 bytes behind the gzip stream"),
    ] {
        let (volume, notes) = read_bytes("packed.nii.gz", &bytes);
        assert_eq!(volume.unwrap(), usual(), "{what}");
        assert!(notes.contains(note) && note.is_empty() == notes.is_empty(), "{what}: {notes}");
    }
    let (upper, _) = read_bytes("UPPER.NII", &file.bytes());
    assert_eq!(upper.unwrap(), usual());
    assert!(read_bytes("cut.nii.gz", &whole[..whole.len() / 2]).0.is_err());
    assert!(read_bytes("cut.nii.gz", &whole[..whole.len() - 3]).0.is_err());
    let mut damaged = whole.clone();
    let at = damaged.len() - 6;
    damaged[at] ^= 1;
    assert!(read_bytes("damaged.nii.gz", &damaged).0.unwrap_err().to_string().contains("gzip"));
    // Header and samples apart: the samples begin with their file.
    let mut pair = file.clone();
    pair.header[344..348].copy_from_slice(b"ni1\0");
    pair.real(OFFSET, 0, 0.0);
    let image = scratch("pair.img");
    std::fs::write(&image, &file.data).unwrap();
    assert_eq!(read_bytes("pair.hdr", &pair.header).0.unwrap(), usual());
    assert_eq!(read_volume(&image, &mut Vec::new()).unwrap(), usual());
    std::fs::remove_file(&image).unwrap();
    let packed = scratch("pair.img.gz");
    std::fs::write(&packed, pack(&file.data)).unwrap();
    assert_eq!(read_bytes("pair.hdr", &pair.header).0.unwrap(), usual());
    std::fs::remove_file(&packed).unwrap();
    assert!(read_bytes("pair.hdr", &pair.header).0.unwrap_err().to_string().contains("pair.img"));
}
