//! NRRD field by field: what changes a sample or a place is honoured, told, or the file is refused and the field named.
use std::path::Path;

use cutis::geometry::Volume;
use cutis::io::{IoError, read_volume};

use super::mesh_files::{fresh, scratch};

const N: usize = 40 * 30 * 20;

fn raw() -> Vec<u8> {
    (0..N).flat_map(|k| ((k as i64 * 7 % 3000 - 1000) as i16).to_le_bytes()).collect()
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    std::io::Write::write_all(&mut packer, bytes).unwrap();
    packer.finish().unwrap()
}

/// Fields of a usual header, changed: a value replaces the field's, an empty one leaves it out.
fn header(changes: &[(&str, &str)]) -> String {
    let usual = [
        ("type", "short"),
        ("dimension", "3"),
        ("space", "left-posterior-superior"),
        ("sizes", "40 30 20"),
        ("space directions", "(1,0,0) (0,2,0) (0,0,3)"),
        ("endian", "little"),
        ("encoding", "raw"),
        ("space origin", "(12,13,14)"),
    ];
    let changed = |key: &str| changes.iter().find(|(k, _)| *k == key).map(|(_, v)| *v);
    let kept = usual.iter().map(|(key, value)| (*key, changed(key).unwrap_or(value)));
    let added = changes.iter().filter(|(key, _)| usual.iter().all(|(k, _)| k != key)).copied();
    let lines: String = kept.chain(added).filter(|(_, v)| !v.is_empty()).map(|(k, v)| format!("{k}: {v}\n")).collect();
    format!("NRRD0005\n# a comment\n{lines}key:=any: value\n")
}

fn read_at(path: &Path, bytes: &[u8]) -> (Result<Volume, IoError>, String) {
    std::fs::write(path, bytes).unwrap();
    let mut notes = Vec::new();
    let volume = read_volume(path, &mut notes);
    std::fs::remove_file(path).unwrap();
    (volume, notes.join("; "))
}

fn read(changes: &[(&str, &str)], data: &[u8]) -> (Result<Volume, IoError>, String) {
    read_at(&fresh("field.nrrd"), &[format!("{}\n", header(changes)).as_bytes(), data].concat())
}

fn usual() -> Volume {
    let (volume, notes) = read(&[], &raw());
    assert_eq!(notes, "");
    volume.unwrap()
}

fn same(note: &str, changes: &[(&str, &str)], data: &[u8]) {
    let (volume, notes) = read(changes, data);
    assert_eq!(volume.unwrap_or_else(|e| panic!("{changes:?}: {e}")), usual(), "{changes:?}");
    assert!(notes.contains(note) && note.is_empty() == notes.is_empty(), "{changes:?}: {notes}");
}

fn refused(word: &str, changes: &[(&str, &str)], data: &[u8]) {
    let (volume, notes) = read(changes, data);
    let message = volume.map(|_| format!("taken, with {notes:?}")).unwrap_or_else(|e| e.to_string());
    assert!(message.contains(word), "{changes:?}: {message}");
}

#[test]
fn encodings_skips_and_rests() {
    let data = raw();
    let big: Vec<u8> = data.as_chunks::<2>().0.iter().flat_map(|b| [b[1], b[0]]).collect();
    let hex: String = data.iter().map(|b| format!("{b:02x}")).collect::<Vec<_>>().concat();
    let text: String = data.as_chunks::<2>().0.iter().map(|b| format!("{} ", i16::from_le_bytes(*b))).collect();
    same("", &[("endian", "big")], &big);
    same("", &[("encoding", "GZIP")], &gzip(&data));
    same("", &[("encoding", "hex")], hex.as_bytes());
    same("", &[("encoding", "txt"), ("endian", "")], text.as_bytes());
    same("", &[("byte skip", "7")], &[b"seven..", &data[..]].concat());
    same("", &[("byteskip", "-1")], &[b"any number of bytes", &data[..]].concat());
    same("", &[("line skip", "2")], &[b"a line\nand\n", &data[..]].concat());
    same("", &[("line skip", "1"), ("byte skip", "3")], &[b"line\nabc", &data[..]].concat());
    // Lines before the packed data, bytes within them.
    let packed = gzip(&[b"abc", &data[..]].concat());
    same("", &[("encoding", "gz"), ("lineskip", "1"), ("byte skip", "3")], &[b"line\n", &packed[..]].concat());
    same("behind the samples", &[], &[&data[..], b"rest"].concat());
    same("behind the samples", &[("encoding", "gzip")], &gzip(&[&data[..], b"rest"].concat()));
    same("behind the gzip", &[("encoding", "gzip")], &[&gzip(&data)[..], b"rest"].concat());
    same("", &[], &[&data[..], b"\n"].concat());
    refused("ends early", &[("byte skip", "8")], &data);
    refused("line skip", &[("line skip", "-1")], &data);
    refused("line skip", &[("line skip", "1000000")], &data);
    refused("byte skip", &[("byte skip", "-2")], &data);
    refused("byte skip", &[("byte skip", "x")], &data);
    refused("`bzip2`", &[("encoding", "bzip2")], &data);
    refused("hexadecimal", &[("encoding", "hex")], b"0g");
    refused("sizes", &[("encoding", "txt")], format!("{text} 7").as_bytes());
    refused("ends early", &[("encoding", "gzip")], &gzip(&data[..1000]));
    refused("endian", &[("endian", "")], &data);
    refused("endian", &[("endian", "middle")], &data);
    let damaged = {
        let mut bytes = gzip(&data);
        let at = bytes.len() - 6;
        bytes[at] ^= 1;
        bytes
    };
    refused("gzip", &[("encoding", "gzip")], &damaged);
}

#[test]
fn places_given_twice_agree() {
    let data = raw();
    same("", &[("spacings", "1 2 3")], &data);
    refused("spacings", &[("spacings", "1 2 2.5")], &data);
    refused("axis mins", &[("axis mins", "0 0 0")], &data);
    refused("axis maxs", &[("axismaxs", "9 9 9")], &data);
    same("", &[("axis mins", "NaN NaN NaN"), ("spacings", "nan nan nan")], &data);
    same("", &[("space units", "\"mm\" \"mm\" \"mm\""), ("units", "\"mm\" \"mm\" \"mm\"")], &data);
    let tenth = [("space directions", "(0.1,0,0) (0,0.2,0) (0,0,0.3)"), ("space origin", "(1.2,1.3,1.4)")];
    let (cm, _) = read(&[&tenth[..], &[("space units", "\"cm\" \"cm\" \"cm\"")]].concat(), &data);
    let apart =
        |a: &Volume, b: &Volume| (a.grid.spacing - b.grid.spacing).norm() + (a.grid.origin - b.grid.origin).norm();
    assert!(apart(&cm.unwrap(), &usual()) < 1e-12);
    refused("units", &[("units", "\"cm\" \"cm\" \"cm\"")], &data);
    refused("space units", &[("space units", "\"furlong\" \"mm\" \"mm\"")], &data);
    refused("one unit", &[("space units", "\"cm\" \"mm\" \"mm\"")], &data);
    refused("space dimension", &[("space dimension", "4")], &data);
    for space in ["", "scanner-xyz", "left-posterior-superior-time", "3D-right-handed"] {
        refused("space", &[("space", space)], &data);
    }
    let (ras, _) = read(&[("space", "RAS")], &data);
    assert!((ras.unwrap().grid.origin * 1e3 - nalgebra::Vector3::new(-12.0, -13.0, 14.0)).norm() < 1e-12);
    for bad in ["", "(1,0,0) (0,2,0)", "(1,0,0) (0,2,0) none", "(1,0) (0,2,0) (0,0,3)", "(1,0,0) (0,x,0) (0,0,3)"] {
        refused("space directions", &[("space directions", bad)], &data);
    }
    refused("sheared", &[("space directions", "(1,0,0) (1,2,0) (0,0,3)")], &data);
    same("", &[("centers", "cell node cell"), ("thicknesses", "1 1 1"), ("labels", "\"a\" \"b\" \"c d\"")], &data);
    same("", &[("measurement frame", "(0,1,0) (1,0,0) (0,0,1)"), ("content", "a head"), ("number", "24000")], &data);
}

#[test]
fn axes_types_and_units_of_samples() {
    let data = raw();
    same("", &[("kinds", "domain space domain")], &data);
    refused("kinds", &[("kinds", "domain domain time")], &data);
    refused("kinds", &[("kinds", "RGB-color domain domain")], &data);
    refused("kinds", &[("kinds", "domain domain")], &data);
    let four = [
        ("dimension", "4"),
        ("sizes", "1 40 30 20"),
        ("kinds", "list domain domain domain"),
        ("space directions", "none (1,0,0) (0,2,0) (0,0,3)"),
        ("spacings", "nan 1 2 3"),
    ];
    same("", &four, &data);
    refused("three-dimensional", &[("dimension", "4"), ("sizes", "2 40 30 10")], &data);
    refused("three-dimensional", &[("dimension", "2"), ("sizes", "40 600")], &data);
    refused("sizes", &[("sizes", "40 30")], &data);
    refused("sizes", &[("sizes", "40 30 0")], &data);
    refused("sizes", &[("dimension", "")], &data);
    refused("no memory", &[("sizes", "4000000000 4000000000 4000000000")], &data);
    same("", &[("type", "Signed Short Int")], &data);
    refused("block", &[("type", "block"), ("block size", "2")], &data);
    refused("float16", &[("type", "float16")], &data);
    let wide: Vec<u8> =
        data.as_chunks::<2>().0.iter().flat_map(|b| i64::from(i16::from_le_bytes(*b)).to_le_bytes()).collect();
    same("", &[("type", "long long")], &wide);
    refused("old min", &[("old min", "-1000"), ("old max", "3000")], &data);
    same("", &[("old min", "NaN"), ("min", "-1000"), ("max", "2000")], &data);
    refused("sample units", &[("sample units", "\"1/cm\"")], &data);
    same("", &[("sample units", "HU")], &data);
}

#[test]
fn headers_are_whole_and_each_field_stands_once() {
    let data = raw();
    refused("field `flavour`", &[("flavour", "sweet")], &data);
    let text = header(&[]);
    let with = |text: String| read_at(&fresh("header.nrrd"), &[text.as_bytes(), b"\n", &data].concat());
    assert!(with(text.clone() + "encoding: gzip\n").0.unwrap_err().to_string().contains("second time"));
    assert!(with(text.clone() + "byteskip: 0\nbyte skip: 0\n").0.unwrap_err().to_string().contains("second time"));
    assert!(with(text.clone() + "just words\n").0.unwrap_err().to_string().contains("just words"));
    assert!(with(text.replace("0005", "0009")).0.unwrap_err().to_string().contains("NRRD0005"));
    assert_eq!(with(text.replace('\n', "\r\n") + "\r").0.unwrap(), usual());
    let (upper, _) = read_at(&scratch("UPPER.NRRD"), &[text.as_bytes(), b"\n", &data].concat());
    assert_eq!(upper.unwrap(), usual());
    for end in 0..text.len() {
        assert!(read_at(&fresh("header.nrrd"), &text.as_bytes()[..end]).0.is_err(), "cut at {end}");
    }
}

#[test]
fn samples_may_stand_in_other_files() {
    let data = raw();
    let folder = scratch("apart");
    std::fs::create_dir_all(&folder).unwrap();
    let half = data.len() / 2;
    for (name, bytes) in [("all.raw", &data[..]), ("part_1.raw", &data[..half]), ("part_3.raw", &data[half..])] {
        std::fs::write(folder.join(name), bytes).unwrap();
    }
    std::fs::write(folder.join("all.raw.gz"), gzip(&data)).unwrap();
    let apart = |changes: &[(&str, &str)], behind: &str| {
        // A list must be the last field.
        let text = header(&[]).replace("key:=any: value\n", "");
        let added: String = changes.iter().map(|(k, v)| format!("{k}: {v}\n")).collect();
        read_at(&folder.join("head.nhdr"), format!("{text}{added}{behind}").as_bytes())
    };
    for name in ["data file", "datafile"] {
        assert_eq!(apart(&[(name, "all.raw")], "").0.unwrap(), usual());
        assert_eq!(apart(&[(name, "LIST")], "part_1.raw\npart_3.raw\n").0.unwrap(), usual());
        assert_eq!(apart(&[(name, "part_%d.raw 1 3 2")], "").0.unwrap(), usual());
    }
    assert_eq!(apart(&[("data file", "./all.raw")], "\n").0.unwrap(), usual());
    let refused = |changes: &[(&str, &str)], behind: &str, word: &str| {
        let message = apart(changes, behind).0.unwrap_err().to_string();
        assert!(message.contains(word), "{changes:?}: {message}");
    };
    refused(&[("data file", "LIST")], "", "file names");
    refused(&[("data file", "LIST")], "part_1.raw\n", "ends early");
    refused(&[("data file", "LIST")], "part_1.raw\npart_3.raw\npart_1.raw\npart_3.raw\nall.raw\n", "bytes");
    refused(&[("data file", "part_%d.raw 1 2 1")], "", "part_2.raw");
    refused(&[("data file", "part_%s.raw 1 3 2")], "", "pattern");
    refused(&[("data file", "part_%d.raw 1 3 0")], "", "pattern");
    refused(&[("data file", "part_%d.raw 1 99999999999 1")], "", "at most");
    refused(&[("data file", "nowhere.raw")], "", "nowhere.raw");
    refused(&[("data file", ".")], "", "a folder");
}
