//! `.vtu` as anyone writes it: ascii, inline base64 or appended, any integer width, plain or zlib-compressed.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::base64;
use super::grid::{Array, Grid, Values, text};
use crate::io::IoError;
use crate::math::Vec3;

/// Deflate's best compression ratio: what bounds a decompressed size from the file's own.
const MOST_INFLATION: usize = 1032;

type Attributes = BTreeMap<String, String>;

/// The grid in the bytes of a `.vtu` file.
pub(super) fn read_vtu(bytes: &[u8], path: &Path) -> Result<Grid, IoError> {
    if !bytes.trim_ascii_end().ends_with(b"</VTKFile>") {
        let place = format!("byte {}", bytes.len());
        return Err(IoError::format(path, place, "the end of the file", "</VTKFile>: not a .vtu file, or cut short"));
    }
    let (head, appended) = split_appended(bytes);
    let text = String::from_utf8_lossy(head);
    let xml_slip = |place: u64, why: String| IoError::format(path, format!("byte {place}"), why, "well-formed XML");
    let mut reader = Reader::from_str(text.trim_start_matches('\u{feff}'));
    let mut file = VtuFile { path, appended, little: true, wide: false, zlib: false, raw: true };
    let mut grid = Grid::default();
    let mut open = Open::default();
    let mut pieces = Vec::new();
    loop {
        let event = reader.read_event();
        let place = reader.buffer_position();
        match event {
            Err(e) => return Err(xml_slip(place, e.to_string())),
            Ok(Event::Eof) => break,
            Ok(Event::Start(tag)) => {
                let with = attributes(&tag).map_err(|e| xml_slip(place, e))?;
                let name = tag.name().as_ref().to_string();
                match name.as_str() {
                    "VTKFile" => file.header(&with)?,
                    "Piece" => pieces.push(with),
                    name if is_array(name) => open.array = Some((with, String::new())),
                    "AppendedData" => {
                        file.raw = with.get("encoding").is_none_or(|e| e == "raw");
                        break;
                    }
                    _ => {}
                }
                open.tags.push(name);
            }
            Ok(Event::Empty(tag)) => {
                let with = attributes(&tag).map_err(|e| xml_slip(place, e))?;
                match tag.name().as_ref() {
                    "Piece" => pieces.push(with),
                    name if is_array(name) => {
                        open.array = Some((with, String::new()));
                        open.close(&mut grid, &file, &pieces)?;
                    }
                    _ => {}
                }
            }
            Ok(Event::Text(t)) => {
                // What stands in an element inside of the array (a key and its values) is about the data, not data.
                if let Some((_, content)) =
                    open.array.as_mut().filter(|_| open.tags.last().is_some_and(|t| is_array(t)))
                {
                    content.push_str(&t.xml10_content());
                }
            }
            Ok(Event::End(tag)) => {
                open.tags.pop();
                if is_array(tag.name().as_ref()) {
                    open.close(&mut grid, &file, &pieces)?;
                }
            }
            Ok(_) => {}
        }
    }
    let full: Vec<&Attributes> = pieces.iter().filter(|p| !is_empty(p)).collect();
    let &[piece] = full.as_slice() else {
        let found = format!("{} pieces", full.len());
        return Err(IoError::unsupported(
            path,
            found,
            "merge them into one piece (ParaView: Merge Blocks, points merged)",
        ));
    };
    for (group, with) in std::mem::take(&mut grid.pending) {
        let array = file.array(&with, None)?;
        place_array(&mut grid, &group, array, path)?;
    }
    for (key, found) in [("NumberOfPoints", grid.points.len()), ("NumberOfCells", grid.types.len())] {
        if piece.get(key).is_some_and(|n| n.trim().parse() != Ok(found)) {
            let wanted = format!("{} as `{key}` says", piece[key]);
            return Err(IoError::format(path, "the piece", found.to_string(), &wanted));
        }
    }
    Ok(grid)
}

fn is_array(tag: &str) -> bool {
    matches!(tag, "DataArray" | "Array")
}

fn is_empty(piece: &Attributes) -> bool {
    piece.get("NumberOfPoints").is_some_and(|n| n.trim() == "0")
}

/// Where the reader stands.
#[derive(Default)]
struct Open {
    /// Elements that are open, outermost first.
    tags: Vec<String>,
    /// The array that is open, and its text.
    array: Option<(Attributes, String)>,
}

impl Open {
    /// Takes in the array that ends here; the innermost open element is its group.
    fn close(&mut self, grid: &mut Grid, file: &VtuFile, pieces: &[Attributes]) -> Result<(), IoError> {
        let Some((with, content)) = self.array.take() else { return Ok(()) };
        let group = self.tags.last().map_or("", String::as_str);
        let in_piece = self.tags.iter().any(|t| t == "Piece");
        if in_piece && pieces.last().is_some_and(is_empty) {
            return Ok(());
        }
        if with.get("format").is_some_and(|f| f == "appended") {
            // The encoding stands at the end of the head: appended arrays are decoded once it is known.
            grid.pending.push((group.into(), with));
            return Ok(());
        }
        let array = file.array(&with, Some(&content))?;
        place_array(grid, group, array, file.path)
    }
}

/// Head with the opening `AppendedData` tag, and the bytes after its underscore.
fn split_appended(bytes: &[u8]) -> (&[u8], &[u8]) {
    const TAG: &[u8] = b"<AppendedData";
    let Some(tag) = bytes.windows(TAG.len()).position(|w| w == TAG) else { return (bytes, &[]) };
    let Some(close) = bytes[tag..].iter().position(|&b| b == b'>').map(|p| tag + p + 1) else { return (bytes, &[]) };
    let data = bytes[close..].iter().position(|&b| b == b'_').map_or(bytes.len(), |p| close + p + 1);
    (&bytes[..close], &bytes[data..])
}

fn attributes(tag: &BytesStart) -> Result<Attributes, String> {
    let mut out = Attributes::new();
    for attribute in tag.attributes() {
        let attribute = attribute.map_err(|e| e.to_string())?;
        let value = attribute.normalized_value(quick_xml::XmlVersion::Implicit1_0).map_err(|e| e.to_string())?;
        out.insert(attribute.key.as_ref().to_string(), value.into_owned());
    }
    Ok(out)
}

fn place_array(grid: &mut Grid, group: &str, array: Array, path: &Path) -> Result<(), IoError> {
    let whole = |array: &Array| {
        array.integers().ok_or_else(|| IoError::format(path, &array.name, "text or fractions", "integers"))
    };
    match (group, array.name.as_str()) {
        ("FieldData", _) => grid.field_data.push(array),
        ("PointData", _) => grid.point_data.push(array),
        ("CellData", _) => grid.cell_data.push(array),
        ("Points", _) => {
            if array.components != 3 {
                let found = format!("{} components", array.components);
                return Err(IoError::format(path, "the points", found, "3"));
            }
            let values: Vec<f64> = match array.values {
                Values::F64(v) => v,
                _ => whole(&array)?.into_iter().map(|x| x as f64).collect(),
            };
            grid.points = values.chunks_exact(3).map(Vec3::from_column_slice).collect();
        }
        ("Cells", "connectivity") => grid.connectivity = whole(&array)?,
        ("Cells", "offsets") => grid.offsets = whole(&array)?,
        ("Cells", "types") => grid.types = whole(&array)?,
        _ => {}
    }
    Ok(())
}

/// Where encoded bytes come from.
enum Source<'a> {
    Raw(&'a [u8]),
    Base64(&'a [u8]),
}

impl Source<'_> {
    fn prefix(&self, n: usize) -> Option<Vec<u8>> {
        match self {
            Self::Raw(bytes) => Some(bytes[..n.min(bytes.len())].to_vec()),
            Self::Base64(text) => base64::prefix(text, n),
        }
    }
}

/// What the file's head says about its arrays.
struct VtuFile<'a> {
    path: &'a Path,
    appended: &'a [u8],
    little: bool,
    wide: bool,
    zlib: bool,
    raw: bool,
}

impl VtuFile<'_> {
    fn header(&mut self, with: &Attributes) -> Result<(), IoError> {
        let is = |key: &str| with.get(key).map_or("", String::as_str);
        if is("type") != "UnstructuredGrid" {
            let found = format!("a VTK file of type `{}`", is("type"));
            return Err(IoError::unsupported(self.path, found, "an UnstructuredGrid of tetrahedra is needed"));
        }
        let slip = |key: &str, wanted: &str| {
            IoError::format(self.path, format!("attribute `{key}` of VTKFile"), format!("`{}`", is(key)), wanted)
        };
        self.little = match is("byte_order") {
            "BigEndian" => false,
            "LittleEndian" | "" => true,
            _ => return Err(slip("byte_order", "LittleEndian or BigEndian")),
        };
        self.wide = match is("header_type") {
            "UInt64" => true,
            "UInt32" | "" => false,
            _ => return Err(slip("header_type", "UInt32 or UInt64")),
        };
        self.zlib = match is("compressor") {
            "" => false,
            "vtkZLibDataCompressor" => true,
            other => {
                return Err(IoError::unsupported(
                    self.path,
                    format!("data compressed by {other}"),
                    "save it with zlib or none (meshio: compression=\"zlib\", ParaView: Compressor Type ZLib)",
                ));
            }
        };
        Ok(())
    }

    fn array(&self, with: &Attributes, content: Option<&str>) -> Result<Array, IoError> {
        let get = |key: &str| with.get(key).map_or("", String::as_str);
        let name = get("Name");
        let kind = get("type");
        let slip = |found: String, wanted: &str| IoError::format(self.path, format!("array `{name}`"), found, wanted);
        let components = match get("NumberOfComponents") {
            "" => 1,
            n => n.trim().parse().map_err(|_| slip(format!("`{n}` components"), "a number"))?,
        };
        let values = match (get("format"), content) {
            ("ascii" | "", Some(text)) => {
                let words = text.split_ascii_whitespace();
                if kind.starts_with("Float") {
                    let v: Result<_, _> =
                        words.map(|w| w.parse().map_err(|_| slip(format!("`{w}`"), "a number"))).collect();
                    Values::F64(v?)
                } else {
                    let v: Result<_, _> =
                        words.map(|w| w.parse().map_err(|_| slip(format!("`{w}`"), "an integer"))).collect();
                    Values::I64(v?)
                }
            }
            ("binary", Some(text)) if text.trim_ascii().is_empty() => self.values(kind, &[], name)?,
            ("binary", Some(text)) => self.values(kind, &self.bytes(name, &Source::Base64(text.as_bytes()))?, name)?,
            ("appended", _) => {
                let offset: usize = get("offset")
                    .parse()
                    .map_err(|_| slip(format!("offset `{}`", get("offset")), "a count of bytes"))?;
                let data = self.appended.get(offset..).ok_or_else(|| {
                    IoError::truncated(self.path, format!("array `{name}`"), offset as u64, self.appended.len() as u64)
                })?;
                let source = if self.raw { Source::Raw(data) } else { Source::Base64(data) };
                self.values(kind, &self.bytes(name, &source)?, name)?
            }
            (other, _) => return Err(slip(format!("format `{other}`"), "ascii, binary or appended")),
        };
        Ok(Array::new(name, components, if kind == "String" { text(&values) } else { values }))
    }

    fn uint(&self, bytes: &[u8]) -> u64 {
        let step = |v: u64, b: &u8| v << 8 | u64::from(*b);
        if self.little { bytes.iter().rev().fold(0, step) } else { bytes.iter().fold(0, step) }
    }

    /// The decoded, decompressed bytes of an array.
    fn bytes(&self, name: &str, source: &Source) -> Result<Vec<u8>, IoError> {
        let word = if self.wide { 8 } else { 4 };
        let take = |n: u64| {
            let n = usize::try_from(n).unwrap_or(usize::MAX);
            let bytes = source
                .prefix(n)
                .ok_or_else(|| IoError::format(self.path, format!("array `{name}`"), "a stray character", "base64"))?;
            if bytes.len() < n {
                return Err(IoError::truncated(self.path, format!("array `{name}`"), n as u64, bytes.len() as u64));
            }
            Ok(bytes)
        };
        let first = self.uint(&take(word)?);
        if !self.zlib {
            return Ok(take(word.saturating_add(first))?.split_off(word as usize));
        }
        if first == 0 {
            return Ok(Vec::new());
        }
        let head_size = first.saturating_add(3).saturating_mul(word);
        let head: Vec<u64> = take(head_size)?.chunks_exact(word as usize).map(|w| self.uint(w)).collect();
        let packed = head[3..].iter().fold(head_size, |sum, &n| sum.saturating_add(n));
        let all = take(packed)?;
        let mut out = Vec::new();
        let mut at = head_size as usize;
        for &n in &head[3..] {
            let n = n as usize;
            let limit = (head[1].max(head[2])).min((n as u64 + 1).saturating_mul(MOST_INFLATION as u64));
            let read = flate2::read::ZlibDecoder::new(&all[at..at + n]).take(limit).read_to_end(&mut out);
            read.map_err(|e| IoError::format(self.path, format!("array `{name}`"), e.to_string(), "zlib data"))?;
            at += n;
        }
        // Blocks are whole but for the last, whose size is the third number, 0 where it is whole, too.
        let last = if head[2] == 0 { head[1] } else { head[2] };
        let wanted = (first - 1).saturating_mul(head[1]).saturating_add(last);
        if out.len() as u64 != wanted {
            return Err(IoError::truncated(self.path, format!("array `{name}`"), wanted, out.len() as u64));
        }
        Ok(out)
    }

    fn values(&self, kind: &str, bytes: &[u8], name: &str) -> Result<Values, IoError> {
        let width = match kind.trim_start_matches(|c: char| !c.is_ascii_digit()) {
            "64" => 8,
            "32" => 4,
            "16" => 2,
            _ => 1,
        };
        if !bytes.len().is_multiple_of(width) {
            let found = format!("{} bytes", bytes.len());
            return Err(IoError::format(
                self.path,
                format!("array `{name}`"),
                found,
                &format!("whole values of type {kind}"),
            ));
        }
        let ints = |width: usize, signed: bool| {
            let extend = |v: u64| if signed { (v << (64 - 8 * width)) as i64 >> (64 - 8 * width) } else { v as i64 };
            Values::I64(bytes.chunks_exact(width).map(|b| extend(self.uint(b))).collect())
        };
        Ok(match kind {
            "Float64" => Values::F64(bytes.chunks_exact(8).map(|b| f64::from_bits(self.uint(b))).collect()),
            "Float32" => {
                Values::F64(bytes.chunks_exact(4).map(|b| f64::from(f32::from_bits(self.uint(b) as u32))).collect())
            }
            "Int8" | "String" => ints(1, kind == "Int8"),
            "UInt8" => ints(1, false),
            "Int16" => ints(2, true),
            "UInt16" => ints(2, false),
            "Int32" => ints(4, true),
            "UInt32" => ints(4, false),
            "Int64" | "UInt64" => ints(8, true),
            other => {
                let place = format!("array `{name}`");
                return Err(IoError::format(
                    self.path,
                    place,
                    format!("type `{other}`"),
                    "Float32/64, (U)Int8..64 or String",
                ));
            }
        })
    }
}
