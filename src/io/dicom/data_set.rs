//! DICOM data sets as trees of elements that borrow the file's bytes.
//!
//! Nothing is allocated by what a length claims, only by what is there. Sequences are entered as the standard says: by
//! their representation, by an undefined length (also within `UN`, whose content is implicit), or by their tag.
//!
//! Source: DICOM PS3.5 2024, 7.1 (data elements), 7.5 (sequences, items, undefined lengths), 6.2.2 note 6 (`UN`), A.4
//! (fragments); PS3.10, 7.1 (preamble and file meta group).

use std::fmt;

/// Group and element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Tag(pub u16, pub u16);

impl fmt::Display for Tag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "({:04X},{:04X})", self.0, self.1)
    }
}

/// Length of a sequence, an item or fragments that end with a delimiter.
const UNDEFINED: u32 = u32::MAX;
const ITEM: Tag = Tag(0xFFFE, 0xE000);
const ITEM_END: Tag = Tag(0xFFFE, 0xE00D);
const SEQUENCE_END: Tag = Tag(0xFFFE, 0xE0DD);
/// Items in items that are entered: files of scanners hold three or four.
const DEEPEST: usize = 32;
/// Value representations whose length takes two bytes.
const SHORT: [&[u8; 2]; 21] = [
    b"AE", b"AS", b"AT", b"CS", b"DA", b"DS", b"DT", b"FL", b"FD", b"IS", b"LO", b"LT", b"PN", b"SH", b"SL", b"SS",
    b"ST", b"TM", b"UI", b"UL", b"US",
];
/// Sequences that images are described in: implicit data sets do not say what is one.
const SEQUENCES: [Tag; 7] = [
    Tag(0x5200, 0x9229),
    Tag(0x5200, 0x9230),
    Tag(0x0020, 0x9113),
    Tag(0x0020, 0x9116),
    Tag(0x0028, 0x9110),
    Tag(0x0028, 0x9145),
    Tag(0x0028, 0x3000),
];

/// How a data set is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Syntax {
    pub explicit: bool,
    pub little: bool,
}

pub(super) const EXPLICIT: Syntax = Syntax { explicit: true, little: true };
pub(super) const IMPLICIT: Syntax = Syntax { explicit: false, little: true };
pub(super) const BIG: Syntax = Syntax { explicit: true, little: false };

/// Why bytes are no data set.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Fault {
    /// An element claims more than is left.
    Beyond { tag: Tag, bytes: u32, left: usize },
    /// An element, an item or a delimiter is cut off.
    Cut { at: usize },
    /// Two letters that are no value representation.
    Representation { tag: Tag, found: [u8; 2] },
    /// An undefined length where there can be none, or what stands in a sequence is no item.
    Structure { tag: Tag },
    /// Items nested deeper than anything real.
    Deep { tag: Tag },
    /// An element twice, with different values.
    Twice { tag: Tag },
}

/// What an element holds.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value<'a> {
    Bytes(&'a [u8]),
    Items(Vec<DataSet<'a>>),
    /// Each with its place behind the first fragment's beginning.
    Fragments(Vec<(usize, &'a [u8])>),
}

#[derive(Debug, Clone, PartialEq)]
struct Element<'a> {
    tag: Tag,
    value: Value<'a>,
}

/// Elements by ascending tag.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct DataSet<'a> {
    elements: Vec<Element<'a>>,
    pub little: bool,
}

impl<'a> DataSet<'a> {
    /// All of `bytes`.
    ///
    /// # Errors
    /// [`Fault`].
    pub fn parse(bytes: &'a [u8], syntax: Syntax) -> Result<Self, Fault> {
        Walk { bytes, at: 0 }.data_set(Some(bytes.len()), syntax, 0)
    }

    /// The elements of one group at the beginning, and their length.
    ///
    /// # Errors
    /// [`Fault`].
    pub fn group(bytes: &'a [u8], group: u16, syntax: Syntax) -> Result<(Self, usize), Fault> {
        let mut walk = Walk { bytes, at: 0 };
        let mut elements = Vec::new();
        let next = |at: usize| bytes.get(at..at + 2).map(|b| u16::from_le_bytes([b[0], b[1]]));
        while next(walk.at) == Some(group) {
            let tag = walk.tag(syntax, bytes.len())?;
            let value = walk.value(tag, syntax, bytes.len(), 0)?;
            elements.push(Element { tag, value });
        }
        elements.sort_by_key(|e| e.tag);
        Ok((Self { elements, little: syntax.little }, walk.at))
    }

    pub fn get(&self, tag: Tag) -> Option<&Value<'a>> {
        let k = self.elements.binary_search_by_key(&tag, |e| e.tag).ok()?;
        Some(&self.elements[k].value)
    }

    pub fn bytes(&self, tag: Tag) -> Option<&'a [u8]> {
        if let Value::Bytes(bytes) = self.get(tag)? { Some(bytes) } else { None }
    }

    /// The first item of a sequence.
    pub fn item(&self, tag: Tag) -> Option<&DataSet<'a>> {
        self.items(tag).first()
    }

    pub fn items(&self, tag: Tag) -> &[DataSet<'a>] {
        if let Some(Value::Items(items)) = self.get(tag) { items } else { &[] }
    }

    /// Text without its padding; `None` where there is none.
    pub fn text(&self, tag: Tag) -> Option<String> {
        let text = String::from_utf8_lossy(self.bytes(tag)?).trim_matches(['\0', ' ']).to_string();
        (!text.is_empty()).then_some(text)
    }

    /// Decimal numbers in text, all of them finite.
    pub fn decimals(&self, tag: Tag) -> Option<Vec<f64>> {
        let numbers: Option<Vec<f64>> = self.text(tag)?.split('\\').map(|w| w.trim().parse().ok()).collect();
        numbers.filter(|v| v.iter().all(|x| x.is_finite()))
    }

    /// A two-byte number, as bits.
    pub fn word(&self, tag: Tag) -> Option<u16> {
        let bytes = <[u8; 2]>::try_from(self.bytes(tag)?).ok()?;
        Some(if self.little { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) })
    }
}

struct Walk<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Walk<'a> {
    /// Elements up to `end`, or to the item's delimiter.
    fn data_set(&mut self, end: Option<usize>, syntax: Syntax, depth: usize) -> Result<DataSet<'a>, Fault> {
        let mut elements: Vec<Element> = Vec::new();
        loop {
            if end.is_some_and(|end| self.at >= end) {
                break;
            }
            let limit = end.unwrap_or(self.bytes.len());
            // Zeros up to the end are padding of media.
            if depth == 0 && self.bytes[self.at..limit].iter().all(|&b| b == 0) {
                self.at = limit;
                break;
            }
            let tag = self.tag(syntax, limit)?;
            if tag == ITEM_END && end.is_none() {
                self.length(syntax, limit)?;
                break;
            }
            let value = self.value(tag, syntax, limit, depth)?;
            elements.push(Element { tag, value });
        }
        if !elements.is_sorted_by(|a, b| a.tag < b.tag) {
            elements.sort_by_key(|e| e.tag);
            elements.dedup();
            if let Some(pair) = elements.windows(2).find(|w| w[0].tag == w[1].tag) {
                return Err(Fault::Twice { tag: pair[0].tag });
            }
        }
        Ok(DataSet { elements, little: syntax.little })
    }

    fn take(&mut self, n: usize, limit: usize) -> Result<&'a [u8], Fault> {
        let end = self.at.checked_add(n).filter(|&e| e <= limit).ok_or(Fault::Cut { at: self.at })?;
        let bytes = &self.bytes[self.at..end];
        self.at = end;
        Ok(bytes)
    }

    fn short(&mut self, syntax: Syntax, limit: usize) -> Result<u16, Fault> {
        let b = self.take(2, limit)?;
        Ok(if syntax.little { u16::from_le_bytes([b[0], b[1]]) } else { u16::from_be_bytes([b[0], b[1]]) })
    }

    fn length(&mut self, syntax: Syntax, limit: usize) -> Result<u32, Fault> {
        let (first, second) = (self.short(syntax, limit)?, self.short(syntax, limit)?);
        let [high, low] = if syntax.little { [second, first] } else { [first, second] };
        Ok(u32::from(high) << 16 | u32::from(low))
    }

    fn tag(&mut self, syntax: Syntax, limit: usize) -> Result<Tag, Fault> {
        Ok(Tag(self.short(syntax, limit)?, self.short(syntax, limit)?))
    }

    fn value(&mut self, tag: Tag, syntax: Syntax, limit: usize, depth: usize) -> Result<Value<'a>, Fault> {
        if tag.0 == ITEM.0 {
            return Err(Fault::Structure { tag });
        }
        if depth > DEEPEST {
            return Err(Fault::Deep { tag });
        }
        let mut vr = *b"UN";
        let bytes = if !syntax.explicit {
            self.length(syntax, limit)?
        } else {
            let letters = self.take(2, limit)?;
            vr = [letters[0], letters[1]];
            if SHORT.contains(&&vr) {
                u32::from(self.short(syntax, limit)?)
            } else if vr.iter().all(u8::is_ascii_uppercase) {
                // Representations of later editions have long lengths, as the standard says.
                self.take(2, limit)?;
                self.length(syntax, limit)?
            } else {
                return Err(Fault::Representation { tag, found: vr });
            }
        };
        let unknown = vr == *b"UN";
        let inside = if unknown { IMPLICIT } else { syntax };
        // Content of an implicit data set keeps its byte order, which is little-endian anyway.
        if bytes == UNDEFINED {
            return match &vr {
                b"SQ" | b"UN" => Ok(Value::Items(self.items(None, inside, limit, depth)?)),
                b"OB" | b"OW" => Ok(Value::Fragments(self.fragments(syntax, limit)?)),
                _ => Err(Fault::Structure { tag }),
            };
        }
        let left = limit - self.at;
        if bytes as usize > left {
            return Err(Fault::Beyond { tag, bytes, left });
        }
        let end = self.at + bytes as usize;
        if vr == *b"SQ" || unknown && SEQUENCES.contains(&tag) {
            return Ok(Value::Items(self.items(Some(end), inside, end, depth)?));
        }
        Ok(Value::Bytes(self.take(bytes as usize, end)?))
    }

    /// Items up to `end`, or to the sequence's delimiter.
    fn items(
        &mut self,
        end: Option<usize>,
        syntax: Syntax,
        limit: usize,
        depth: usize,
    ) -> Result<Vec<DataSet<'a>>, Fault> {
        let mut items = Vec::new();
        while end.is_none_or(|end| self.at < end) {
            let tag = self.tag(syntax, limit)?;
            let bytes = self.length(syntax, limit)?;
            match tag {
                SEQUENCE_END if end.is_none() => break,
                ITEM if bytes == UNDEFINED => items.push(self.data_set(None, syntax, depth + 1)?),
                ITEM => {
                    let left = limit - self.at;
                    if bytes as usize > left {
                        return Err(Fault::Beyond { tag, bytes, left });
                    }
                    items.push(self.data_set(Some(self.at + bytes as usize), syntax, depth + 1)?);
                }
                _ => return Err(Fault::Structure { tag }),
            }
        }
        Ok(items)
    }

    /// Fragments behind the offset table, whose own fragment is the first of the list.
    fn fragments(&mut self, syntax: Syntax, limit: usize) -> Result<Vec<(usize, &'a [u8])>, Fault> {
        let mut fragments = Vec::new();
        let mut first = self.at;
        loop {
            let begin = self.at;
            let tag = self.tag(syntax, limit)?;
            let bytes = self.length(syntax, limit)?;
            match tag {
                SEQUENCE_END => return Ok(fragments),
                ITEM => {
                    let left = limit - self.at;
                    if bytes as usize > left {
                        return Err(Fault::Beyond { tag, bytes, left });
                    }
                    fragments.push((begin.saturating_sub(first), self.take(bytes as usize, limit)?));
                    if fragments.len() == 1 {
                        first = self.at;
                    }
                }
                _ => return Err(Fault::Structure { tag }),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROWS: Tag = Tag(0x0028, 0x0010);

    #[test]
    fn claims_are_held_against_what_is_there() {
        let sound = b"\x08\x00\x60\x00CS\x02\x00CT\xe0\x7f\x10\x00OW\x00\x00\x04\x00\x00\x00abcd";
        let set = DataSet::parse(sound, EXPLICIT).unwrap();
        assert_eq!(set.bytes(Tag(0x7fe0, 0x0010)), Some(&b"abcd"[..]));
        let huge = b"\x08\x00\x60\x00CS\x02\x00CT\xe0\x7f\x10\x00OW\x00\x00\x00\x00\x00\x7fabcd";
        let fault = Fault::Beyond { tag: Tag(0x7fe0, 0x0010), bytes: 0x7f00_0000, left: 4 };
        assert_eq!(DataSet::parse(huge, EXPLICIT), Err(fault));
        let big = b"\x7f\xe0\x00\x10OW\x00\x00\x7f\x00\x00\x00ab";
        assert!(matches!(DataSet::parse(big, BIG), Err(Fault::Beyond { bytes: 0x7f00_0000, left: 2, .. })));
    }

    #[test]
    fn what_is_no_representation_is_told_and_later_ones_have_long_lengths() {
        let none = b"\x28\x00\x00\x20\x01\x02\x00\x00\xdf\xff\xfc\xfeab";
        let fault = Fault::Representation { tag: Tag(0x0028, 0x2000), found: [1, 2] };
        assert_eq!(DataSet::parse(none, EXPLICIT), Err(fault));
        let later = b"\x28\x00\x00\x20ZZ\x00\x00\x02\x00\x00\x00ab";
        assert_eq!(DataSet::parse(later, EXPLICIT).unwrap().bytes(Tag(0x0028, 0x2000)), Some(&b"ab"[..]));
    }

    /// A private `UN` of undefined length holds an implicit sequence with a nested one; the element behind it is found.
    #[test]
    fn undefined_lengths_within_unknown_representations_are_entered() {
        let mut bytes = b"\x09\x00\x10\x00UN\0\0\xff\xff\xff\xff".to_vec();
        bytes.extend(b"\xfe\xff\x00\xe0\xff\xff\xff\xff");
        bytes.extend(b"\x09\x00\x11\x10\xff\xff\xff\xff\xfe\xff\x00\xe0\x0a\0\0\0\x28\x00\x10\x00\x02\0\0\0\x05\x00");
        bytes.extend(b"\xfe\xff\xdd\xe0\0\0\0\0\xfe\xff\x0d\xe0\0\0\0\0\xfe\xff\xdd\xe0\0\0\0\0");
        bytes.extend(b"\x28\x00\x10\x00US\x02\x00\x07\x00");
        let set = DataSet::parse(&bytes, EXPLICIT).unwrap();
        assert_eq!(set.word(ROWS), Some(7));
        let inner = set.item(Tag(0x0009, 0x0010)).unwrap().item(Tag(0x0009, 0x1011)).unwrap();
        assert_eq!(inner.word(ROWS), Some(5));
        for end in 1..bytes.len() - 10 {
            let cut = DataSet::parse(&bytes[..end], EXPLICIT);
            assert!(cut.is_err(), "cut at {end}");
        }
    }

    #[test]
    fn fragments_know_their_places_and_nesting_ends() {
        let mut bytes = b"\xe0\x7f\x10\x00OB\0\0\xff\xff\xff\xff\xfe\xff\x00\xe0\0\0\0\0".to_vec();
        bytes.extend(b"\xfe\xff\x00\xe0\x02\0\0\0ab\xfe\xff\x00\xe0\x04\0\0\0cdef\xfe\xff\xdd\xe0\0\0\0\0");
        let set = DataSet::parse(&bytes, EXPLICIT).unwrap();
        let Some(Value::Fragments(found)) = set.get(Tag(0x7fe0, 0x0010)) else { panic!("{set:?}") };
        assert_eq!(found[1..], [(0, &b"ab"[..]), (10, &b"cdef"[..])]);
        let deep = b"\x08\x00\x40\x11\xff\xff\xff\xff\xfe\xff\x00\xe0\xff\xff\xff\xff".repeat(40);
        assert!(matches!(DataSet::parse(&deep, IMPLICIT), Err(Fault::Deep { .. })));
        let twice = b"\x28\x00\x10\x00US\x02\x00\x07\x00\x28\x00\x10\x00US\x02\x00\x08\x00";
        assert_eq!(DataSet::parse(twice, EXPLICIT), Err(Fault::Twice { tag: ROWS }));
    }
}
