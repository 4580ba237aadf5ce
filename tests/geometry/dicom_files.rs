//! DICOM field by field: what changes a sample or a place is honoured or named; what lies beside a series is told.
use std::path::{Path, PathBuf};

use cutis::geometry::Volume;
use cutis::io::{IoError, read_volume};

use super::mesh_files::fresh;

type Tag = (u16, u16);
const PIXELS: Tag = (0x7FE0, 0x0010);
const EXPLICIT: &str = "1.2.840.10008.1.2.1";
const IMPLICIT: &str = "1.2.840.10008.1.2";
const BIG: &str = "1.2.840.10008.1.2.2";
const CT_CLASS: &str = "1.2.840.10008.5.1.4.1.1.2";

/// A DICOM object as a list of elements.
#[derive(Clone)]
struct Object {
    elements: Vec<(Tag, [u8; 2], Vec<u8>)>,
    syntax: &'static str,
    preamble: bool,
    meta: bool,
    group_length: bool,
}

impl Object {
    /// Slice `k` of a series: 11 columns, 13 rows, stored values [`stored`], 1.5 mm apart.
    fn slice(k: usize) -> Self {
        let mut object =
            Self { elements: Vec::new(), syntax: EXPLICIT, preamble: true, meta: true, group_length: true };
        object.text((8, 0x16), b"UI", CT_CLASS);
        object.text((8, 0x18), b"UI", &format!("1.2.3.{k}"));
        object.text((8, 0x60), b"CS", "CT");
        object.text((0x20, 0x0E), b"UI", "1.2.9");
        object.text((0x20, 0x32), b"DS", &format!("-10\\5\\{}", 100.0 - 1.5 * k as f64));
        object.text((0x20, 0x37), b"DS", "1\\0\\0\\0\\1\\0");
        object.word((0x28, 0x02), 1);
        object.text((0x28, 0x04), b"CS", "MONOCHROME2");
        object.word((0x28, 0x10), 13);
        object.word((0x28, 0x11), 11);
        object.text((0x28, 0x30), b"DS", "2\\1");
        object.word((0x28, 0x100), 16);
        object.word((0x28, 0x101), 12);
        object.word((0x28, 0x102), 11);
        object.word((0x28, 0x103), 0);
        object.text((0x28, 0x1052), b"DS", "-1024");
        object.text((0x28, 0x1053), b"DS", "1");
        object.pixels(|v| v);
        object
    }

    fn put(&mut self, tag: Tag, vr: &[u8; 2], value: Vec<u8>) {
        self.elements.retain(|(t, ..)| *t != tag);
        self.elements.push((tag, *vr, value));
        self.elements.sort_by_key(|e| e.0);
    }
    fn text(&mut self, tag: Tag, vr: &[u8; 2], text: &str) {
        let mut bytes = text.as_bytes().to_vec();
        if bytes.len() % 2 == 1 {
            bytes.push(if vr == b"UI" { 0 } else { b' ' });
        }
        self.put(tag, vr, bytes);
    }
    fn word(&mut self, tag: Tag, value: u16) {
        let bytes = if self.syntax == BIG { value.to_be_bytes() } else { value.to_le_bytes() };
        self.put(tag, b"US", bytes.to_vec());
    }
    fn pixels(&mut self, change: impl Fn(u16) -> u16) {
        let bytes = (0..143).flat_map(|k| change(stored(k % 11, k / 11)).to_le_bytes()).collect();
        self.put(PIXELS, b"OW", bytes);
    }
    /// Pixels in fragments behind an offset table.
    fn fragments(&mut self, syntax: &'static str, table: &[u8], fragments: &[&[u8]]) {
        self.syntax = syntax;
        let mut bytes = Vec::new();
        for fragment in [table].iter().chain(fragments) {
            bytes.extend(b"\xfe\xff\x00\xe0");
            bytes.extend((fragment.len().next_multiple_of(2) as u32).to_le_bytes());
            bytes.extend(*fragment);
            bytes.resize(bytes.len().next_multiple_of(2), 0);
        }
        bytes.extend(b"\xfe\xff\xdd\xe0\0\0\0\0");
        self.put(PIXELS, b"OB", bytes);
    }

    fn data_set(&self) -> Vec<u8> {
        let mut out = Vec::new();
        for (tag, vr, value) in &self.elements {
            let undefined = *tag == PIXELS && vr == b"OB";
            element(&mut out, *tag, vr, value, self.syntax, undefined);
        }
        out
    }

    fn bytes(&self) -> Vec<u8> {
        let mut out = if self.preamble { [vec![0; 128], b"DICM".to_vec()].concat() } else { Vec::new() };
        if self.meta {
            let mut meta = Vec::new();
            let uid = |text: &str| [text.as_bytes(), &[0][..text.len() % 2]].concat();
            element(&mut meta, (2, 2), b"UI", &uid(CT_CLASS), EXPLICIT, false);
            element(&mut meta, (2, 0x10), b"UI", &uid(self.syntax), EXPLICIT, false);
            if self.group_length {
                element(&mut out, (2, 0), b"UL", &(meta.len() as u32).to_le_bytes(), EXPLICIT, false);
            }
            out.extend(meta);
        }
        let data = self.data_set();
        if self.syntax.ends_with(".1.99") {
            let mut packer = flate2::write::DeflateEncoder::new(out, flate2::Compression::default());
            std::io::Write::write_all(&mut packer, &data).unwrap();
            return packer.finish().unwrap();
        }
        out.extend(data);
        out
    }
}

fn element(out: &mut Vec<u8>, tag: Tag, vr: &[u8; 2], value: &[u8], syntax: &str, undefined: bool) {
    let big = syntax == BIG;
    let short = |v: u16| if big { v.to_be_bytes() } else { v.to_le_bytes() };
    let long = |v: u32| if big { v.to_be_bytes() } else { v.to_le_bytes() };
    let length = if undefined { u32::MAX } else { value.len() as u32 };
    out.extend([short(tag.0), short(tag.1)].concat());
    if syntax == IMPLICIT {
        out.extend(long(length));
    } else {
        out.extend(vr);
        if matches!(vr, b"OB" | b"OW" | b"OF" | b"SQ" | b"UN") {
            out.extend([0, 0]);
            out.extend(long(length));
        } else {
            out.extend(short(length as u16));
        }
    }
    out.extend(value);
}

/// Stored value at a column and a row, the same as in the streams of `codecs/`.
fn stored(x: usize, y: usize) -> u16 {
    let bump = if x.abs_diff(4).pow(2) + y.abs_diff(6).pow(2) < 16 { 2400 } else { 0 };
    if x > 7 { 1000 } else { (200 + 37 * x + 5 * y + (x * 31 + y * 17) % 7 + bump) as u16 }
}

fn folder(name: &str) -> PathBuf {
    let folder = fresh(&format!("dicom_{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn read(path: &Path) -> (Result<Volume, IoError>, String) {
    let mut notes = Vec::new();
    let volume = read_volume(path, &mut notes);
    // The little volume is no head; that is told, too, and of no interest here.
    notes.retain(|n| !n.contains("no head"));
    (volume, notes.join("; "))
}

/// A series of six slices, each changed.
fn series(name: &str, change: impl Fn(usize, &mut Object)) -> (Result<Volume, IoError>, String) {
    let folder = folder(name);
    for k in 0..6 {
        let mut object = Object::slice(k);
        change(k, &mut object);
        std::fs::write(folder.join(format!("IM{k}.dcm")), object.bytes()).unwrap();
    }
    let found = read(&folder);
    std::fs::remove_dir_all(&folder).unwrap();
    found
}

fn usual() -> Volume {
    let (volume, notes) = series("usual", |_, _| {});
    assert_eq!(notes, "");
    let volume = volume.unwrap();
    assert_eq!(volume.grid.dims, [11, 13, 6]);
    assert_eq!(volume.samples[11 * 6 + 4], f32::from(stored(4, 6)) - 1024.0);
    volume
}

/// The series reads as the usual one, with this in its notes.
fn same(name: &str, note: &str, change: impl Fn(usize, &mut Object)) {
    let (volume, notes) = series(name, change);
    assert_eq!(volume.unwrap(), usual(), "{name}");
    assert!(notes.contains(note) && note.is_empty() == notes.is_empty(), "{name}: {notes}");
}

/// The series is refused with a message that holds these words.
fn refused(name: &str, words: &[&str], change: impl Fn(usize, &mut Object)) {
    let (volume, notes) = series(name, change);
    let message = volume.map(|_| format!("taken, with {notes:?}")).unwrap_or_else(|e| e.to_string());
    assert!(words.iter().all(|w| message.contains(w)), "{name}: {message}");
}

#[test]
fn bits_are_cut_out_and_signs_extended() {
    same("overlay", "", |_, o| o.pixels(|v| v | 0x5000));
    same("high_bit", "", |_, o| {
        o.word((0x28, 0x102), 15);
        o.pixels(|v| v << 4 | 0x3);
    });
    same("signed", "", |_, o| {
        o.word((0x28, 0x103), 1);
        o.text((0x28, 0x1052), b"DS", "0");
        // The sign stands in bit 11 and is not repeated above.
        o.pixels(|v| (v as i16 - 1024) as u16 & 0x0FFF);
    });
    let halved = |o: &mut Object| {
        o.word((0x28, 0x100), 8);
        o.word((0x28, 0x101), 8);
        o.word((0x28, 0x102), 7);
        o.put(PIXELS, b"OW", (0..144).map(|k| k as u8).collect());
    };
    let (eight, _) = series("eight", |_, o| halved(o));
    assert_eq!(eight.unwrap().samples[200], 57.0 - 1024.0);
    let (wide, _) = series("thirty_two", |_, o| {
        o.word((0x28, 0x100), 32);
        o.put(
            PIXELS,
            b"OW",
            (0..143u32)
                .flat_map(|k| (u32::from(stored(k as usize % 11, k as usize / 11)) | 0xFFF0_0000).to_le_bytes())
                .collect(),
        );
    });
    assert_eq!(wide.unwrap(), usual());
    refused("beyond", &["Bits Stored", "(0028,0101)"], |_, o| o.word((0x28, 0x102), 16));
    refused("twelve", &["12 bits a pixel"], |_, o| o.word((0x28, 0x100), 12));
    refused("neither", &["Pixel Representation"], |_, o| o.word((0x28, 0x103), 2));
    same("monochrome1", "", |_, o| o.text((0x28, 4), b"CS", "MONOCHROME1"));
    refused("colour", &["3 sample(s)", "RGB"], |_, o| {
        o.word((0x28, 2), 3);
        o.text((0x28, 4), b"CS", "RGB");
    });
}

#[test]
fn values_are_hounsfield_units_slice_by_slice() {
    same("slope", "", |k, o| {
        if k % 2 == 1 {
            o.text((0x28, 0x1053), b"DS", "0.5");
            o.pixels(|v| 2 * v);
            o.word((0x28, 0x101), 16);
            o.word((0x28, 0x102), 15);
        }
    });
    let (padded, _) = series("padding", |_, o| {
        o.word((0x28, 0x120), 1000);
        o.word((0x28, 0x121), 1001);
    });
    let padded = padded.unwrap();
    assert_eq!((padded.samples[9], padded.samples[3]), (-1000.0, usual().samples[3]));
    refused("density", &["Rescale Type", "EDW"], |_, o| o.text((0x28, 0x1054), b"LO", "EDW"));
    same("open_unit", "Rescale Type", |_, o| o.text((0x28, 0x1054), b"LO", "US"));
    refused("lookup", &["Modality LUT", "(0028,3000)"], |_, o| o.put((0x28, 0x3000), b"SQ", Vec::new()));
    refused("flat", &["Rescale Slope"], |_, o| o.text((0x28, 0x1053), b"DS", "0"));
    refused("no_slope", &["Rescale Slope (0028,1053)"], |_, o| o.elements.retain(|e| e.0 != (0x28, 0x1053)));
}

#[test]
fn places_given_twice_agree_or_are_told() {
    refused("aspect", &["Pixel Aspect Ratio"], |_, o| o.text((0x28, 0x34), b"IS", "1\\1"));
    same("aspect_right", "", |_, o| o.text((0x28, 0x34), b"IS", "2\\1"));
    same("between", "Spacing Between Slices", |_, o| o.text((0x18, 0x88), b"DS", "3"));
    same("between_right", "", |_, o| o.text((0x18, 0x88), b"DS", "1.5"));
    same("tilted", "gantry", |_, o| o.text((0x18, 0x1120), b"DS", "12"));
    refused("oblong", &["Image Orientation"], |_, o| o.text((0x20, 0x37), b"DS", "1\\0\\0\\0\\2\\0"));
    refused("animal", &["animal"], |_, o| o.text((0x10, 0x2210), b"CS", "QUADRUPED"));
    refused("frame", &["IM4.dcm", "frame of reference"], |k, o| {
        o.text((0x20, 0x52), b"UI", if k == 4 { "1.2.8" } else { "1.2.7" });
    });
    refused("doubled", &["IM2.dcm", "IM3.dcm", "two slices at"], |k, o| {
        if k == 3 {
            o.text((0x20, 0x32), b"DS", "-10\\5\\97");
        }
    });
    refused("twice", &["(0028,0010)", "two values"], |_, o| o.elements.push(((0x28, 0x10), *b"US", vec![1, 0])));
}

#[test]
fn files_beside_the_series_are_passed_over_and_told() {
    let beside = |name: &str, file: &str, bytes: &[u8], words: &[&str]| {
        let folder = folder(name);
        for k in 0..6 {
            std::fs::write(folder.join(format!("IM{k}.dcm")), Object::slice(k).bytes()).unwrap();
        }
        std::fs::write(folder.join(file), bytes).unwrap();
        let (volume, notes) = read(&folder);
        assert_eq!(volume.unwrap_or_else(|e| panic!("{name}: {e}")), usual(), "{name}");
        assert!(words.iter().chain([&file]).all(|w| notes.contains(w)), "{name}: {notes}");
    };
    let object = |change: &dyn Fn(&mut Object)| {
        let mut object = Object::slice(9);
        change(&mut object);
        object.bytes()
    };
    let no_pixels = |modality: &'static str| {
        object(&move |o| {
            o.text((8, 0x60), b"CS", modality);
            o.elements.retain(|e| e.0.0 < 0x28);
        })
    };
    beside("index", "DICOMDIR", &no_pixels("OT"), &["index"]);
    beside("fork", "._IM3.dcm", &[0, 5, 22, 7], &["macOS"]);
    for modality in ["RTSTRUCT", "SR", "PR", "KO", "REG"] {
        beside(modality, "RS.dcm", &no_pixels(modality), &[modality, "no pixels"]);
    }
    beside("pet", "PT1", &object(&|o| o.text((8, 0x60), b"CS", "PT")), &["PT image"]);
    beside("scout", "AA.dcm", &object(&|o| o.text((8, 8), b"CS", "ORIGINAL\\PRIMARY\\LOCALIZER")), &["scout"]);
    let capture = object(&|o| o.text((8, 0x16), b"UI", "1.2.840.10008.5.1.4.1.1.7"));
    beside("capture", "dose", &capture, &["secondary capture"]);
    beside("notes", "README.txt", b"not a slice", &["no DICOM"]);
    beside("copy", "IM9.dcm", &Object::slice(0).bytes(), &["twice"]);
}

#[test]
fn the_odd_one_among_many_is_blamed() {
    refused("odd_first", &["1 of 6", "IM0.dcm", "12 rows"], |k, o| {
        if k == 0 {
            o.word((0x28, 0x10), 12);
        }
    });
    refused("odd_turned", &["IM0.dcm", "orientation"], |k, o| {
        if k == 0 {
            o.text((0x20, 0x37), b"DS", "0\\1\\0\\0\\0\\-1");
        }
    });
    refused("mixed", &["2 series", "1 of 1.2.10: IM2.dcm"], |k, o| {
        if k == 2 {
            o.text((0x20, 0x0E), b"UI", "1.2.10");
        }
    });
    let below = folder("below");
    std::fs::create_dir(below.join("SER1")).unwrap();
    assert!(read(&below).0.unwrap_err().to_string().contains("SER1"));
    let unmarked = folder("unmarked");
    std::fs::write(unmarked.join("a.dcm"), [7; 500]).unwrap();
    assert!(read(&unmarked).0.unwrap_err().to_string().contains("without the DICOM mark"));
}

#[test]
fn every_syntax_gives_the_same_bits() {
    let implicit = |o: &mut Object| o.syntax = IMPLICIT;
    same("implicit", "", |_, o| implicit(o));
    same("no_preamble", "implicit little-endian", |_, o| {
        implicit(o);
        (o.preamble, o.meta) = (false, false);
    });
    same("no_preamble_explicit", "explicit little-endian", |_, o| (o.preamble, o.meta) = (false, false));
    same("meta_alone", "", |_, o| o.preamble = false);
    same("no_group_length", "", |_, o| o.group_length = false);
    same("deflated", "", |_, o| o.syntax = "1.2.840.10008.1.2.1.99");
    same("padded", "", |k, o| {
        if k == 1 {
            o.put((0xFFFC, 0xFFFC), b"OB", vec![0; 10]);
        }
    });
    same("big", "", |_, o| {
        o.syntax = BIG;
        for (tag, vr, value) in &mut o.elements {
            if vr == b"US" || *tag == PIXELS {
                value.as_chunks_mut::<2>().0.iter_mut().for_each(|w| w.reverse());
            }
        }
    });
    // A private sequence of unknown representation and length, with an item that holds other rows.
    same("unknown", "", |_, o| {
        let mut bytes = b"\xfe\xff\x00\xe0\xff\xff\xff\xff\x28\x00\x10\x00\x02\0\0\0\x63\x00".to_vec();
        bytes.extend(b"\xfe\xff\x0d\xe0\0\0\0\0\xfe\xff\xdd\xe0\0\0\0\0");
        o.put((0x0009, 0x1001), b"UN", bytes);
    });
    refused("unknown_syntax", &["transfer syntax 1.2.3.4", "gdcmconv"], |_, o| o.syntax = "1.2.3.4");
}

#[test]
fn compressed_pixels_are_read_or_their_syntax_and_tool_are_named() {
    let codec = |name: &str| {
        std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/geometry/codecs").join(name)).unwrap()
    };
    let coded = |name: &str, syntax: &'static str, file: &str, table: &[u8]| {
        let stream = codec(file);
        let (one, two) = stream.split_at(stream.len() / 4 * 2);
        let parts = if name.ends_with('2') { vec![one, two] } else { vec![&stream[..]] };
        let (volume, notes) = series(name, |_, o| o.fragments(syntax, table, &parts));
        assert_eq!(notes, "");
        volume.unwrap_or_else(|e| panic!("{name}: {e}"))
    };
    for (syntax, ending) in
        [("1.2.840.10008.1.2.4.70", "jpg"), ("1.2.840.10008.1.2.4.80", "jls"), ("1.2.840.10008.1.2.4.90", "j2k")]
    {
        let file = format!("lossless12.{ending}");
        assert_eq!(coded(ending, syntax, &file, b""), usual(), "{ending}");
        assert_eq!(coded(&format!("{ending}_2"), syntax, &file, &[0; 4]), usual(), "{ending} in two fragments");
        let stream = codec(&format!("lossless16.{ending}"));
        let (sixteen, _) = series(&format!("{ending}16"), |_, o| {
            o.word((0x28, 0x101), 16);
            o.word((0x28, 0x102), 15);
            o.text((0x28, 0x1053), b"DS", "0.0625");
            o.fragments(syntax, b"", &[&stream]);
        });
        assert_eq!(sixteen.unwrap(), usual(), "{ending} of 16 bits");
        // Cut or damaged streams are errors, never a crash and never taken.
        let stream = codec(&file);
        for end in (0..stream.len() - 2).step_by(7) {
            let (cut, _) = series("cut", |_, o| o.fragments(syntax, b"", &[&stream[..end]]));
            assert!(cut.is_err() || end > stream.len() - 16, "{ending} cut at {end} of {}", stream.len());
        }
        for k in 0..stream.len() {
            let mut bad = stream.clone();
            bad[k] ^= 0x55;
            let _ = series("damaged", |k, o| {
                if k == 0 {
                    o.fragments(syntax, b"", &[&bad])
                }
            });
        }
    }
    let near = coded("near", "1.2.840.10008.1.2.4.81", "near12.jls", b"");
    let far = near.samples.iter().zip(&usual().samples).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!((1.0..=3.0).contains(&far), "{far}");
    same("rle", "", |_, o| o.fragments("1.2.840.10008.1.2.5", b"", &[&rle()]));
    refused("rle_cut", &["run-length"], |_, o| o.fragments("1.2.840.10008.1.2.5", b"", &[&rle()[..90]]));
    let raw: Vec<u8> = (0..143).flat_map(|k| stored(k % 11, k / 11).to_le_bytes()).collect();
    same("encapsulated", "", |_, o| o.fragments("1.2.840.10008.1.2.1.98", b"", &[&raw]));
    refused("baseline", &["JPEG baseline", "dcmdjpeg"], |_, o| o.fragments("1.2.840.10008.1.2.4.50", b"", &[&raw]));
    refused("high_throughput", &["high-throughput JPEG 2000", "dcm2dcm"], |_, o| {
        o.fragments("1.2.840.10008.1.2.4.201", b"", &[&raw]);
    });
    refused("size", &["11 x 13", "instead of 11 x 12"], |_, o| {
        o.word((0x28, 0x10), 12);
        o.fragments("1.2.840.10008.1.2.4.70", b"", &[&codec("lossless12.jpg")]);
    });
    refused("greedy", &["more than any CT"], |_, o| {
        o.word((0x28, 0x10), 65535);
        o.word((0x28, 0x11), 65535);
        o.fragments("1.2.840.10008.1.2.5", b"", &[&rle()]);
    });
    refused("native", &["another way"], |_, o| o.syntax = "1.2.840.10008.1.2.4.70");
}

/// The slice in run-length code: literal runs, and a repeated one where a row ends in the same bytes.
fn rle() -> Vec<u8> {
    let mut segments: [Vec<u8>; 2] = Default::default();
    for (k, segment) in segments.iter_mut().enumerate() {
        let bytes: Vec<u8> = (0..143).map(|p| stored(p % 11, p / 11).to_be_bytes()[k]).collect();
        for row in bytes.chunks(11) {
            segment.push(7);
            segment.extend(&row[..8]);
            segment.extend([(1 - 3i8) as u8, row[8]]);
            segment.push(0x80);
        }
    }
    let mut out = [2u32, 64, 64 + segments[0].len() as u32].map(u32::to_le_bytes).concat();
    out.resize(64, 0);
    out.extend(segments.concat());
    out
}

/// One file with many frames, whose places stand in functional groups.
#[test]
fn frames_of_one_file_are_stacked() {
    let folder = folder("enhanced");
    let item = |elements: &[(Tag, &[u8; 2], &[u8])]| {
        let mut inside = Vec::new();
        elements.iter().for_each(|(tag, vr, value)| element(&mut inside, *tag, vr, value, EXPLICIT, false));
        [b"\xfe\xff\x00\xe0".to_vec(), (inside.len() as u32).to_le_bytes().to_vec(), inside].concat()
    };
    let file = |frames: usize, described: usize| {
        let mut object = Object::slice(0);
        object
            .elements
            .retain(|e| ![(0x20, 0x32), (0x20, 0x37), (0x28, 0x30), (0x28, 0x1052), (0x28, 0x1053)].contains(&e.0));
        object.text((0x28, 8), b"IS", &frames.to_string());
        let shared = [
            ((0x20, 0x9116), item(&[((0x20, 0x37), b"DS", b"1\\0\\0\\0\\1\\0 ")])),
            ((0x28, 0x9110), item(&[((0x28, 0x30), b"DS", b"2\\1 ")])),
            ((0x28, 0x9145), item(&[((0x28, 0x1052), b"DS", b"-1024 "), ((0x28, 0x1053), b"DS", b"1 ")])),
        ];
        object.put((0x5200, 0x9229), b"SQ", item(&shared.each_ref().map(|(tag, i)| (*tag, b"SQ", &i[..]))));
        let places = (0..described).map(|k| {
            let place = format!("{:<12}", format!("-10\\5\\{}", 92.5 + 1.5 * k as f64));
            item(&[((0x20, 0x9113), b"SQ", &item(&[((0x20, 0x32), b"DS", place.as_bytes())]))])
        });
        object.put((0x5200, 0x9230), b"SQ", places.collect::<Vec<_>>().concat());
        let one = object.elements.iter().find(|e| e.0 == PIXELS).unwrap().2.clone();
        object.put(PIXELS, b"OW", one.repeat(frames));
        object
    };
    let path = folder.join("all.dcm");
    std::fs::write(&path, file(6, 6).bytes()).unwrap();
    for place in [&folder, &path] {
        let (volume, notes) = read(place);
        assert_eq!((volume.unwrap(), notes.as_str()), (usual(), ""));
    }
    std::fs::write(&path, file(6, 0).bytes()).unwrap();
    assert!(read(&folder).0.unwrap_err().to_string().contains("6 frames with 0 descriptions"));
    let stream =
        std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/geometry/codecs/lossless12.jpg")).unwrap();
    let mut packed = file(2, 2);
    let (one, two) = stream.split_at(stream.len() / 4 * 2);
    let second = 16 + one.len() as u32 + two.len().next_multiple_of(2) as u32;
    packed.fragments("1.2.840.10008.1.2.4.70", &[0u32, second].map(u32::to_le_bytes).concat(), &[one, two, one, two]);
    std::fs::write(&path, packed.bytes()).unwrap();
    assert_eq!(read(&folder).0.unwrap().samples, usual().samples[..286]);
}
