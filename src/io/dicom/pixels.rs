//! Pixels of a frame: decoded, the bits that are stored cut out, signs extended.
//!
//! Source: DICOM PS3.5 2024, 8.1 and 8.2, annex A.4 (fragments of frames); PS3.3, C.7.6.3.

use std::path::Path;

use super::data_set::{DataSet, Tag, Value};
use super::file::{Coding, tell};
use super::{jpeg, jpeg_ls, rle};
use crate::io::IoError;

const SAMPLES: Tag = Tag(0x0028, 0x0002);
const PHOTOMETRIC: Tag = Tag(0x0028, 0x0004);
const ROWS: Tag = Tag(0x0028, 0x0010);
const COLUMNS: Tag = Tag(0x0028, 0x0011);
const ALLOCATED: Tag = Tag(0x0028, 0x0100);
const STORED: Tag = Tag(0x0028, 0x0101);
const HIGH: Tag = Tag(0x0028, 0x0102);
const SIGNED: Tag = Tag(0x0028, 0x0103);
const PADDING: Tag = Tag(0x0028, 0x0120);
const PADDING_LIMIT: Tag = Tag(0x0028, 0x0121);
pub(super) const PIXELS: Tag = Tag(0x7FE0, 0x0010);
const OFFSETS: Tag = Tag(0x7FE0, 0x0001);
pub(super) const FLOATS: [Tag; 2] = [Tag(0x7FE0, 0x0008), Tag(0x7FE0, 0x0009)];

/// Pixels of a compressed frame at most: its few bytes must not ask for all memory.
const MOST_PIXELS: usize = 1 << 26;

/// How the pixels of an image are stored.
pub(super) struct Pixels {
    /// Columns, rows.
    pub size: [usize; 2],
    allocated: u32,
    stored: u32,
    high: u32,
    signed: bool,
    /// Values that stand for nothing.
    padding: Option<[i32; 2]>,
}

impl Pixels {
    /// What the image's description says.
    ///
    /// # Errors
    /// [`IoError`] for what is missing, contradicts itself, or is no grey image of 8, 16 or 32 bits.
    pub fn of(path: &Path, set: &DataSet) -> Result<Self, IoError> {
        let missing = |what: &str| IoError::format(path, what, "nothing usable", "a CT image with this attribute");
        let word = |tag: Tag, what: &str| set.word(tag).ok_or_else(|| missing(&format!("{what} {tag}")));
        let samples = set.word(SAMPLES).unwrap_or(1);
        let photometric = set.text(PHOTOMETRIC).unwrap_or_else(|| "MONOCHROME2".into());
        // Which end is shown white says nothing about Hounsfield units.
        if samples != 1 || !matches!(photometric.as_str(), "MONOCHROME1" | "MONOCHROME2") {
            let found = format!("{samples} sample(s) a pixel in {photometric} {SAMPLES} {PHOTOMETRIC}");
            return Err(IoError::unsupported(path, found, "a grey image is needed: export the CT itself"));
        }
        let size = [word(COLUMNS, "Columns")?, word(ROWS, "Rows")?].map(usize::from);
        if size.contains(&0) {
            return Err(IoError::format(
                path,
                "Rows and Columns",
                format!("{} x {}", size[1], size[0]),
                "positive numbers",
            ));
        }
        let allocated = u32::from(word(ALLOCATED, "Bits Allocated")?);
        if !matches!(allocated, 8 | 16 | 32) || !set.little && allocated != 16 {
            let found = format!("{allocated} bits a pixel {ALLOCATED}");
            return Err(IoError::unsupported(path, found, "pixels of 8, 16 or 32 bits are read (big-endian: 16)"));
        }
        let stored = set.word(STORED).map_or(allocated, u32::from);
        let high = set.word(HIGH).map_or(stored.wrapping_sub(1), u32::from);
        if stored == 0 || high >= allocated || high + 1 < stored {
            let found = format!("{stored} bits up to bit {high} of {allocated}");
            return Err(IoError::format(
                path,
                format!("Bits Stored {STORED} and High Bit {HIGH}"),
                found,
                "bits within a pixel",
            ));
        }
        let signed = match word(SIGNED, "Pixel Representation")? {
            0 => false,
            1 => true,
            other => {
                let place = format!("Pixel Representation {SIGNED}");
                return Err(IoError::format(path, place, other.to_string(), "0 (unsigned) or 1 (signed)"));
            }
        };
        let mut pixels = Self { size, allocated, stored, high, signed, padding: None };
        // Padding is a value, not a place in the word, so it has no high bit.
        let value = |tag: Tag| set.word(tag).map(|v| pixels.extended(v.into()));
        pixels.padding = value(PADDING).map(|from| {
            let to = value(PADDING_LIMIT).unwrap_or(from);
            [from.min(to), from.max(to)]
        });
        Ok(pixels)
    }

    /// A stored value from its lowest bits.
    fn extended(&self, bits: u32) -> i32 {
        let unused = 32 - self.stored;
        if self.signed { (bits << unused) as i32 >> unused } else { (bits << unused >> unused) as i32 }
    }

    /// Stored values of each of `n` frames, `None` for padding, handed on frame by frame.
    pub fn frames(
        &self,
        path: &Path,
        set: &DataSet,
        coding: Coding,
        n: usize,
        told: &mut Vec<String>,
        take: &mut dyn FnMut(usize, Vec<Option<i32>>) -> Result<(), IoError>,
    ) -> Result<(), IoError> {
        let value = set.get(PIXELS);
        let low = self.high + 1 - self.stored;
        let mut hand = |k: usize, words: Vec<u32>, low: u32| {
            let of = |w: u32| {
                let value = self.extended(w >> low);
                self.padding.is_none_or(|[from, to]| !(from..=to).contains(&value)).then_some(value)
            };
            take(k, words.into_iter().map(of).collect())
        };
        if self.stored == 32 && !self.signed {
            let found = format!("32 unsigned bits stored {STORED}");
            return Err(IoError::unsupported(path, found, "up to 31 are read, or 32 with sign"));
        }
        match (coding, value) {
            (Coding::Native, Some(Value::Bytes(bytes))) => {
                let frame = self.frame_bytes();
                let wanted = frame.saturating_mul(n);
                if bytes.len() < wanted {
                    return Err(IoError::truncated(path, "the pixels", wanted as u64, bytes.len() as u64));
                }
                // One byte more makes the length even.
                if bytes.len() > wanted + 1 {
                    tell(told, format!("pixel data hold {} bytes more than the image", bytes.len() - wanted));
                }
                (0..n).try_for_each(|k| hand(k, self.words(&bytes[k * frame..(k + 1) * frame], set.little), low))
            }
            (Coding::Unread { name, tool }, _) => {
                let found = format!("compressed pixels ({name})");
                Err(IoError::unsupported(path, found, format!("decompress it first (for example `{tool}`)")))
            }
            (coding, Some(Value::Fragments(fragments))) if coding != Coding::Native => {
                let streams = streams(path, set, fragments, n)?;
                streams.into_iter().enumerate().try_for_each(|(k, stream)| {
                    let words = self.decoded(coding, &stream).map_err(|why| {
                        let place = format!("the compressed pixels of frame {}", k + 1);
                        IoError::format(path, place, why, "a sound stream, or decompress it first (`gdcmconv --raw`)")
                    })?;
                    hand(k, words, low)
                })
            }
            _ => {
                let found = "pixels stored in another way than the transfer syntax says";
                Err(IoError::unsupported(path, found, "convert it first (for example `gdcmconv --raw`)"))
            }
        }
    }

    fn frame_bytes(&self) -> usize {
        self.size[0] * self.size[1] * (self.allocated / 8) as usize
    }

    fn words(&self, bytes: &[u8], little: bool) -> Vec<u32> {
        match self.allocated {
            8 => bytes.iter().map(|&b| b.into()).collect(),
            16 if little => bytes.as_chunks().0.iter().map(|b| u16::from_le_bytes(*b).into()).collect(),
            16 => bytes.as_chunks().0.iter().map(|b| u16::from_be_bytes(*b).into()).collect(),
            _ => bytes.as_chunks().0.iter().map(|b| u32::from_le_bytes(*b)).collect(),
        }
    }

    fn decoded(&self, coding: Coding, stream: &[u8]) -> Result<Vec<u32>, String> {
        let n = self.size[0] * self.size[1];
        if n > MOST_PIXELS {
            return Err(format!("{} x {} pixels, more than any CT has", self.size[0], self.size[1]));
        }
        match coding {
            Coding::RunLength => rle::decode(stream, n, (self.allocated / 8) as usize),
            Coding::LosslessJpeg => jpeg::decode(stream, self.size),
            Coding::JpegLs => jpeg_ls::decode(stream, self.size),
            Coding::Jpeg2000 => self.jpeg_2000(stream),
            Coding::Fragments | Coding::Native | Coding::Unread { .. } => match stream.get(..self.frame_bytes()) {
                Some(bytes) => Ok(self.words(bytes, true)),
                None => Err(format!("{} bytes instead of {}", stream.len(), self.frame_bytes())),
            },
        }
    }

    fn jpeg_2000(&self, stream: &[u8]) -> Result<Vec<u32>, String> {
        use hayro_jpeg2000::{DecodeSettings, DecoderContext, Image};
        let settings = DecodeSettings { strict: true, ..DecodeSettings::default() };
        let image = Image::new(stream, &settings).map_err(|e| e.to_string())?;
        let size = [image.width(), image.height()].map(|n| n as usize);
        if size != self.size {
            return Err(format!(
                "a picture of {} x {} samples instead of {} x {}",
                size[0], size[1], self.size[0], self.size[1]
            ));
        }
        let mut context = DecoderContext::default();
        let decoded = image.decode(&mut context).map_err(|e| e.to_string())?;
        match decoded.components() {
            [one] => Ok(one.samples().iter().map(|&v| v.round() as i64 as u32).collect()),
            more => Err(format!("{} components instead of one", more.len())),
        }
    }
}

/// The stream of each frame: all fragments of a single one, a fragment each, or by the table of offsets.
fn streams(path: &Path, set: &DataSet, fragments: &[(usize, &[u8])], n: usize) -> Result<Vec<Vec<u8>>, IoError> {
    let [(_, basic), fragments @ ..] = fragments else {
        return Err(IoError::format(path, "the compressed pixels", "no fragment", "an offset table and fragments"));
    };
    let joined =
        |part: &[(usize, &[u8])]| part.iter().flat_map(|(_, bytes)| bytes.iter().copied()).collect::<Vec<u8>>();
    if n == 1 {
        return Ok(vec![joined(fragments)]);
    }
    if fragments.len() == n {
        return Ok(fragments.iter().map(|(_, bytes)| bytes.to_vec()).collect());
    }
    let offsets: Vec<usize> = match set.bytes(OFFSETS) {
        Some(extended) => extended.as_chunks::<8>().0.iter().map(|b| u64::from_le_bytes(*b) as usize).collect(),
        None => basic.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b) as usize).collect(),
    };
    let begins: Option<Vec<usize>> =
        offsets.iter().map(|at| fragments.binary_search_by_key(at, |(place, _)| *place).ok()).collect();
    let begins = begins.filter(|b| b.len() == n && b.is_sorted()).ok_or_else(|| {
        let found = format!("{} fragments and {} offsets", fragments.len(), offsets.len());
        IoError::format(
            path,
            "the compressed pixels",
            found,
            &format!("a fragment or an offset for each of {n} frames"),
        )
    })?;
    let ends = begins.iter().skip(1).copied().chain([fragments.len()]);
    Ok(begins.iter().zip(ends).map(|(&from, to)| joined(&fragments[from..to])).collect())
}
