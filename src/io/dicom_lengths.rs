//! Whether a DICOM file can hold what its elements claim. The parser makes room for a claim before it reads, so a file of
//! a few hundred bytes could ask for gigabytes.
//!
//! Where files are not what the standard wants, it goes the parser's way: a value representation that is none is `UN`.
//!
//! Source: DICOM PS3.5 2024, 7.1 (data elements) and 7.5 (sequences, items, undefined lengths); PS3.10, 7.1 (file meta group).

use dicom_core::Tag;
use dicom_core::dictionary::{DataDictionary, DataDictionaryEntry};
use dicom_object::StandardDataDictionary;

/// Preamble and mark before the first element.
const START: usize = 132;
/// Length of a sequence or an item that ends with a delimiter.
const UNDEFINED: u32 = u32::MAX;
/// Group of items and delimiters, and the first bytes of an item.
const ITEMS: u16 = 0xFFFE;
/// Value representations whose length takes two bytes; that of all others takes four, behind two that are reserved.
const SHORT: [&[u8; 2]; 21] = [
    b"AE", b"AS", b"AT", b"CS", b"DA", b"DS", b"DT", b"FL", b"FD", b"IS", b"LO", b"LT", b"PN", b"SH", b"SL", b"SS",
    b"ST", b"TM", b"UI", b"UL", b"US",
];

/// An element whose length cannot be.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Claim {
    /// It claims more than is left.
    Beyond { tag: Tag, bytes: u32, left: usize },
    /// It is no whole number of values: the parser would go on in the middle of one.
    Ragged { tag: Tag, bytes: u32, unit: u32 },
}

/// Bytes of a value in this representation; 1 for text and for bytes.
fn unit(vr: &[u8]) -> u32 {
    match vr {
        b"OW" | b"SS" | b"US" => 2,
        b"AT" | b"FL" | b"OF" | b"OL" | b"SL" | b"UL" => 4,
        b"FD" | b"OD" | b"OV" | b"SV" | b"UV" => 8,
        _ => 1,
    }
}

/// The representation that the dictionary gives an element.
fn implied(tag: Tag) -> &'static str {
    StandardDataDictionary.by_tag(tag).map_or("UN", |entry| entry.vr().relaxed().to_string())
}

/// How the data set behind the file meta group (which is always explicit and little-endian) is written.
#[derive(Clone, Copy)]
struct Syntax {
    explicit: bool,
    little: bool,
}

/// Walks over headers; sequences and items are entered by going on behind theirs.
///
/// # Errors
/// The first [`Claim`] that the file cannot hold. What the walk does not understand it leaves to the parser.
pub(super) fn lengths_fit(file: &[u8]) -> Result<(), Claim> {
    const META: Syntax = Syntax { explicit: true, little: true };
    let after_meta = data_set(file);
    let end_of_meta = meta(file).map_or(START, |length| START + 12 + length as usize);
    let mut at = START;
    while let Some(head) = file.get(at..at + 8) {
        let syntax = if at < end_of_meta { META } else { after_meta };
        let word = |k: usize| {
            let bytes = [head[k], head[k + 1]];
            if syntax.little { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) }
        };
        let (group, element) = (word(0), word(2));
        let vr = &head[4..6];
        let (header, bytes) = if group == ITEMS || !syntax.explicit {
            (8, length(file, at + 4, syntax.little))
        } else if SHORT.iter().any(|v| v[..] == *vr) {
            (8, Some(u32::from(word(6))))
        } else {
            (12, length(file, at + 8, syntax.little))
        };
        let Some(bytes) = bytes else { return Ok(()) };
        at += header;
        if bytes == UNDEFINED {
            continue;
        }
        let left = file.len().saturating_sub(at);
        let tag = Tag(group, element);
        if bytes as usize > left {
            return Err(Claim::Beyond { tag, bytes, left });
        }
        let unit = if group == ITEMS { 1 } else { unit(if syntax.explicit { vr } else { implied(tag).as_bytes() }) };
        if at > end_of_meta && !bytes.is_multiple_of(unit) {
            return Err(Claim::Ragged { tag, bytes, unit });
        }
        let entered = group == ITEMS || vr == b"SQ" && syntax.explicit || !syntax.explicit && begins_item(&file[at..]);
        at += if entered { 0 } else { bytes as usize };
    }
    Ok(())
}

fn length(file: &[u8], at: usize, little: bool) -> Option<u32> {
    let bytes = file.get(at..at + 4)?.try_into().ok()?;
    Some(if little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) })
}

/// Bytes of the meta group behind the element that tells them, which comes first.
fn meta(file: &[u8]) -> Option<u32> {
    const FIRST: &[u8] = b"\x02\x00\x00\x00UL\x04\x00";
    if file.get(START..START + FIRST.len()) == Some(FIRST) { length(file, START + FIRST.len(), true) } else { None }
}

/// An implicit sequence shows only in what it holds.
fn begins_item(content: &[u8]) -> bool {
    content.starts_with(&[0xFE, 0xFF, 0x00, 0xE0])
}

/// The transfer syntax, looked up in the meta group by its identifier.
fn data_set(file: &[u8]) -> Syntax {
    const KEY: &[u8] = b"\x02\x00\x10\x00UI";
    let found = file.windows(KEY.len()).skip(START).position(|w| w == KEY).map(|k| START + k + KEY.len());
    let uid = found.and_then(|at| {
        let n = u16::from_le_bytes(file.get(at..at + 2)?.try_into().ok()?);
        file.get(at + 2..at + 2 + usize::from(n))
    });
    match uid.map(|u| u.strip_suffix(b"\0").unwrap_or(u)) {
        Some(b"1.2.840.10008.1.2") => Syntax { explicit: false, little: true },
        Some(b"1.2.840.10008.1.2.2") => Syntax { explicit: true, little: false },
        _ => Syntax { explicit: true, little: true },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file with this transfer syntax and these bytes as data set.
    fn file(uid: &[u8], data: &[u8]) -> Vec<u8> {
        let mut out = vec![0; 128];
        out.extend(b"DICM\x02\x00\x00\x00UL\x04\x00");
        out.extend((8 + uid.len() as u32).to_le_bytes());
        out.extend(b"\x02\x00\x10\x00UI");
        out.extend((uid.len() as u16).to_le_bytes());
        out.extend(uid);
        out.extend(data);
        out
    }

    #[test]
    fn claims_are_held_against_the_file() {
        let explicit = b"1.2.840.10008.1.2.1\0";
        let sound = file(explicit, b"\x08\x00\x60\x00CS\x02\x00CT\xe0\x7f\x10\x00OW\x00\x00\x04\x00\x00\x00abcd");
        assert_eq!(lengths_fit(&sound), Ok(()));
        let huge = file(explicit, b"\x08\x00\x60\x00CS\x02\x00CT\xe0\x7f\x10\x00OW\x00\x00\x00\x00\x00\x7fabcd");
        let claim = Claim::Beyond { tag: Tag(0x7fe0, 0x0010), bytes: 0x7f00_0000, left: 4 };
        assert_eq!(lengths_fit(&huge), Err(claim));
    }

    #[test]
    fn what_is_no_representation_has_a_long_length() {
        let huge = file(b"1.2.840.10008.1.2.1\0", b"\x28\x00\x00\x20TS\x00\x00\xdf\xff\xfc\xfeab");
        let claim = Claim::Beyond { tag: Tag(0x0028, 0x2000), bytes: 0xfefc_ffdf, left: 2 };
        assert_eq!(lengths_fit(&huge), Err(claim));
        let within =
            b"\x09\x00\x10\x00UN\0\0\xff\xff\xff\xff\xfe\xff\x00\xe0\xff\xff\xff\xff\x08\x00\x01\x00OB\0\0\0\0\0\x70";
        let claim = lengths_fit(&file(b"1.2.840.10008.1.2.1\0", within)).unwrap_err();
        assert!(matches!(claim, Claim::Beyond { bytes: 0x7000_0000, .. }), "{claim:?}");
    }

    #[test]
    fn values_are_whole() {
        let explicit = file(b"1.2.840.10008.1.2.1\0", b"\x11\x00\x60\x00AT\x02\x00CT");
        let claim = Claim::Ragged { tag: Tag(0x0011, 0x0060), bytes: 2, unit: 4 };
        assert_eq!(lengths_fit(&explicit), Err(claim));
        // Rows are US in the dictionary.
        let implicit = file(b"1.2.840.10008.1.2\0", b"\x28\x00\x10\x00\x03\x00\x00\x00abc");
        let claim = Claim::Ragged { tag: Tag(0x0028, 0x0010), bytes: 3, unit: 2 };
        assert_eq!(lengths_fit(&implicit), Err(claim));
    }

    #[test]
    fn sequences_are_entered() {
        let inside = b"\xfe\xff\x00\xe0\xff\xff\xff\xff\x08\x00\x01\x00OB\x00\x00\x00\x00\x00\x70";
        let mut data = b"\x08\x00\x40\x11SQ\x00\x00\xff\xff\xff\xff".to_vec();
        data.extend(inside);
        assert!(lengths_fit(&file(b"1.2.840.10008.1.2.1\0", &data)).is_err());
        let mut implicit = b"\x08\x00\x40\x11\x10\x00\x00\x00".to_vec();
        implicit.extend(b"\xfe\xff\x00\xe0\xff\xff\xff\xff\x08\x00\x01\x00\x00\x00\x00\x70");
        assert!(lengths_fit(&file(b"1.2.840.10008.1.2\0", &implicit)).is_err());
        let big = b"\x7f\xe0\x00\x10OW\x00\x00\x7f\x00\x00\x00ab";
        assert!(lengths_fit(&file(b"1.2.840.10008.1.2.2\0", big)).is_err());
        assert_eq!(
            lengths_fit(&file(b"1.2.840.10008.1.2.2\0", b"\x7f\xe0\x00\x10OW\x00\x00\x00\x00\x00\x02ab")),
            Ok(())
        );
    }
}
