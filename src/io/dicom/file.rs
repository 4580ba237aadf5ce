//! A DICOM file taken apart: preamble, meta group, transfer syntax, and the bytes of its data set.
//!
//! Source: DICOM PS3.10 2024, 7.1; PS3.5, annexes A and E (transfer syntaxes), A.5 (deflated); PS3.6, table A-1.

use std::borrow::Cow;
use std::io::Read;
use std::path::Path;

use super::data_set::{BIG, DataSet, EXPLICIT, Fault, IMPLICIT, Syntax, Tag};
use crate::io::IoError;

const MARK: &[u8] = b"DICM";
const PREAMBLE: usize = 128;
const TRANSFER_SYNTAX: Tag = Tag(0x0002, 0x0010);
/// Deflate's best ratio: what bounds an unpacked size from the packed one.
const MOST_INFLATION: u64 = 1032;

/// How pixels are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Coding {
    Native,
    /// Native pixels in fragments.
    Fragments,
    RunLength,
    LosslessJpeg,
    JpegLs,
    Jpeg2000,
    /// Not read; the tool that converts it.
    Unread {
        name: &'static str,
        tool: &'static str,
    },
}

/// A file that is DICOM.
pub(super) struct File<'a> {
    pub body: Cow<'a, [u8]>,
    pub syntax: Syntax,
    pub coding: Coding,
}

const GDCM: &str = "gdcmconv --raw in.dcm out.dcm";
const DCMTK: &str = "dcmdjpeg in.dcm out.dcm";

/// Coding and syntax of a transfer syntax.
fn known(name: &str) -> Option<(Syntax, Coding)> {
    let coding = match name {
        "1.2.840.10008.1.2" => return Some((IMPLICIT, Coding::Native)),
        "1.2.840.10008.1.2.2" => return Some((BIG, Coding::Native)),
        "1.2.840.10008.1.2.1" | "1.2.840.10008.1.2.1.99" => Coding::Native,
        "1.2.840.10008.1.2.1.98" => Coding::Fragments,
        "1.2.840.10008.1.2.5" => Coding::RunLength,
        "1.2.840.10008.1.2.4.57" | "1.2.840.10008.1.2.4.70" => Coding::LosslessJpeg,
        "1.2.840.10008.1.2.4.80" | "1.2.840.10008.1.2.4.81" => Coding::JpegLs,
        "1.2.840.10008.1.2.4.90" | "1.2.840.10008.1.2.4.91" => Coding::Jpeg2000,
        "1.2.840.10008.1.2.4.50" => Coding::Unread { name: "JPEG baseline, 8 bits and lossy", tool: DCMTK },
        "1.2.840.10008.1.2.4.51" => Coding::Unread { name: "JPEG extended, lossy", tool: DCMTK },
        "1.2.840.10008.1.2.4.201" | "1.2.840.10008.1.2.4.202" | "1.2.840.10008.1.2.4.203" => Coding::Unread {
            name: "high-throughput JPEG 2000",
            tool: "dcm2dcm -t 1.2.840.10008.1.2.1 in.dcm out.dcm (dcm4che)",
        },
        "1.2.840.10008.1.2.4.110" | "1.2.840.10008.1.2.4.111" | "1.2.840.10008.1.2.4.112" => {
            Coding::Unread { name: "JPEG XL", tool: "dcmdjpxl or a PACS export without compression" }
        }
        "1.2.840.10008.1.2.8.1" => {
            Coding::Unread { name: "deflated frames", tool: "a PACS export without compression" }
        }
        _ => return None,
    };
    Some((EXPLICIT, coding))
}

/// The file's parts; `None` where nothing says that it is DICOM.
pub(super) fn open<'a>(path: &Path, bytes: &'a [u8], told: &mut Vec<String>) -> Result<Option<File<'a>>, IoError> {
    let marked = bytes.get(PREAMBLE..PREAMBLE + MARK.len()) == Some(MARK);
    let begin = if marked { PREAMBLE + MARK.len() } else { 0 };
    let rest = &bytes[begin..];
    // Without the mark: the first group is the meta group or the identifying one, its element a low one.
    if !marked && !matches!(rest, [0x02 | 0x08, 0, _, 0, _, _, _, _, ..]) {
        return Ok(None);
    }
    let (meta, length) = DataSet::group(rest, 0x0002, EXPLICIT).map_err(|f| broken(path, &f))?;
    let body = &rest[length..];
    if !marked && body.is_empty() {
        return Ok(None);
    }
    let Some(name) = meta.text(TRANSFER_SYNTAX) else {
        // Explicit where two letters stand behind the first tag.
        let syntax =
            if body.get(4..6).is_some_and(|vr| vr.iter().all(u8::is_ascii_uppercase)) { EXPLICIT } else { IMPLICIT };
        let kind = if syntax.explicit { "explicit" } else { "implicit" };
        tell(told, format!("files without a Transfer Syntax (0002,0010): taken as {kind} little-endian"));
        return Ok(Some(File { body: body.into(), syntax, coding: Coding::Native }));
    };
    let (syntax, coding) = known(&name).ok_or_else(|| {
        let advice = format!("convert it first (for example `{GDCM}`)");
        IoError::unsupported(path, format!("transfer syntax {name}"), advice)
    })?;
    let body = if name.ends_with(".1.99") { inflated(path, body)?.into() } else { body.into() };
    Ok(Some(File { body, syntax, coding }))
}

fn inflated(path: &Path, packed: &[u8]) -> Result<Vec<u8>, IoError> {
    let mut out = Vec::new();
    let limit = (packed.len() as u64).saturating_mul(MOST_INFLATION);
    let read = flate2::read::DeflateDecoder::new(packed).take(limit).read_to_end(&mut out);
    read.map_err(|e| {
        IoError::format(path, "the deflated data set", e.to_string(), "deflate data: copy the file again")
    })?;
    Ok(out)
}

/// Says what is wrong with a data set.
pub(super) fn broken(path: &Path, fault: &Fault) -> IoError {
    let structure = |place: String, found: &str, wanted: &str| IoError::format(path, place, found, wanted);
    match fault {
        Fault::Beyond { tag, bytes, left } => {
            IoError::truncated(path, format!("element {tag}"), (*bytes).into(), *left as u64)
        }
        Fault::Cut { at } => {
            let place = format!("byte {at} of the data set");
            structure(place, "an element that is cut off", "a whole DICOM file: copy it again")
        }
        Fault::Representation { tag, found } => {
            let found = format!("value representation {:?}", String::from_utf8_lossy(found));
            structure(format!("element {tag}"), &found, "two capital letters, as in an explicit data set")
        }
        Fault::Structure { tag } => {
            structure(format!("element {tag}"), "no item where items are listed", "items and their delimiter")
        }
        Fault::Deep { tag } => structure(format!("element {tag}"), "items nested without end", "32 levels at most"),
        Fault::Twice { tag } => structure(format!("element {tag}"), "two values", "each element once"),
    }
}

/// Adds a note once, whatever the number of files that it is true of.
pub(super) fn tell(told: &mut Vec<String>, note: String) {
    if !told.contains(&note) {
        told.push(note);
    }
}
