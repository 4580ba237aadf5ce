//! From a DICOM object to slices: where they lie, and their Hounsfield units.
//!
//! Source: DICOM PS3.3 2024, C.7.6.2 (image plane), C.7.6.16 (functional groups of multi-frame images), C.8.2.1 and
//! C.8.15 (CT image), C.11.1 (Hounsfield units), C.7.5.1.1.2 (pixel padding).

use std::path::{Path, PathBuf};

use super::data_set::{DataSet, Tag};
use super::file::{File, broken, tell};
use super::pixels::{FLOATS, PIXELS, Pixels};
use crate::io::IoError;
use crate::math::Vec3;

const IMAGE_TYPE: Tag = Tag(0x0008, 0x0008);
const CLASS: Tag = Tag(0x0008, 0x0016);
const INSTANCE: Tag = Tag(0x0008, 0x0018);
const MODALITY: Tag = Tag(0x0008, 0x0060);
const ANATOMY: Tag = Tag(0x0010, 0x2210);
const BETWEEN: Tag = Tag(0x0018, 0x0088);
const TILT: Tag = Tag(0x0018, 0x1120);
const SERIES: Tag = Tag(0x0020, 0x000E);
const POSITION: Tag = Tag(0x0020, 0x0032);
const ORIENTATION: Tag = Tag(0x0020, 0x0037);
const FRAME_OF_REFERENCE: Tag = Tag(0x0020, 0x0052);
const FRAMES: Tag = Tag(0x0028, 0x0008);
const SPACING: Tag = Tag(0x0028, 0x0030);
const ASPECT: Tag = Tag(0x0028, 0x0034);
const INTERCEPT: Tag = Tag(0x0028, 0x1052);
const SLOPE: Tag = Tag(0x0028, 0x1053);
const RESCALE_TYPE: Tag = Tag(0x0028, 0x1054);
const LOSSY: Tag = Tag(0x0028, 0x2110);
const LOOKUP: Tag = Tag(0x0028, 0x3000);
const SHARED: Tag = Tag(0x5200, 0x9229);
const PER_FRAME: Tag = Tag(0x5200, 0x9230);
/// Sequences of a frame's description.
const OF_POSITION: Tag = Tag(0x0020, 0x9113);
const OF_ORIENTATION: Tag = Tag(0x0020, 0x9116);
const OF_SPACING: Tag = Tag(0x0028, 0x9110);
const OF_VALUES: Tag = Tag(0x0028, 0x9145);

/// Secondary captures: screens and reports, which lie nowhere.
const CAPTURE: &str = "1.2.840.10008.5.1.4.1.1.7";
const CT_CLASSES: &str = "1.2.840.10008.5.1.4.1.1.2";
/// Cosines of one orientation are those of unit vectors at a right angle to this.
const UPRIGHT: f64 = 1e-3;
/// Difference of two statements of a ratio that passes as rounding.
const ROUNDING: f64 = 1e-2;
/// What padding stands for, HU: nothing but air.
const AIR: f32 = -1000.0;
/// Frames of a file at most: so many slices of a tenth of a millimetre are a whole body.
const MOST_FRAMES: usize = 20_000;

/// A slice of a CT.
pub(super) struct Slice {
    pub path: PathBuf,
    pub series: String,
    pub instance: String,
    pub frame_of_reference: String,
    pub origin: Vec3,
    pub row: Vec3,
    pub column: Vec3,
    pub spacing: [f64; 2],
    /// Columns, rows.
    pub size: [usize; 2],
    /// Distance of slices and tilt of the gantry as told, mm and degrees.
    pub between: Option<f64>,
    pub tilt: Option<f64>,
    pub samples: Vec<f32>,
}

/// What a file is.
pub(super) enum Object {
    Slices(Vec<Slice>),
    /// No image of the patient that could be stacked, and why.
    Beside(String),
    /// An image of another modality.
    Other(String),
}

/// Attributes of one frame: its own, those of all frames, those of the file.
struct Frame<'a> {
    set: &'a DataSet<'a>,
    own: Option<&'a DataSet<'a>>,
    shared: Option<&'a DataSet<'a>>,
}

impl<'a> Frame<'a> {
    /// The part of the description that holds `tag`.
    fn holder(&self, sequence: Tag, tag: Tag) -> &'a DataSet<'a> {
        let inside =
            |part: Option<&'a DataSet<'a>>| part.and_then(|p| p.item(sequence)).filter(|i| i.get(tag).is_some());
        inside(self.own).or(inside(self.shared)).unwrap_or(self.set)
    }

    fn numbers<const N: usize>(&self, path: &Path, sequence: Tag, tag: Tag, what: &str) -> Result<[f64; N], IoError> {
        let found = self.holder(sequence, tag).decimals(tag).and_then(|v| v.try_into().ok());
        let place = format!("{what} {tag}");
        found.ok_or_else(|| IoError::format(path, place, "nothing usable", "a CT slice with this attribute"))
    }
}

pub(super) fn read(path: &Path, file: &File, told: &mut Vec<String>) -> Result<Object, IoError> {
    let set = DataSet::parse(&file.body, file.syntax).map_err(|f| broken(path, &f))?;
    let class = set.text(CLASS).unwrap_or_default();
    let is_ct_class = class == CT_CLASSES || class.strip_prefix(CT_CLASSES).is_some_and(|rest| rest.starts_with('.'));
    let modality = set.text(MODALITY).or_else(|| is_ct_class.then(|| "CT".into())).unwrap_or_else(|| "unknown".into());
    if let Some(tag) = FLOATS.into_iter().find(|t| set.get(*t).is_some()) {
        return Ok(Object::Beside(format!("{modality}: pixels in floating point {tag}")));
    }
    if set.get(PIXELS).is_none() {
        return Ok(Object::Beside(format!("{modality}: no pixels")));
    }
    if modality != "CT" {
        return Ok(Object::Other(modality));
    }
    let kinds = set.text(IMAGE_TYPE).unwrap_or_default();
    if kinds.split('\\').any(|k| k.trim().eq_ignore_ascii_case("LOCALIZER")) {
        return Ok(Object::Beside("CT localizer (scout)".into()));
    }
    if class.starts_with(CAPTURE) {
        return Ok(Object::Beside("secondary capture (a screen or a report)".into()));
    }
    if set.text(ANATOMY).is_some_and(|a| a != "BIPED") {
        let found = format!("an animal's axes (Anatomical Orientation Type {ANATOMY})");
        return Err(IoError::unsupported(path, found, "left, back and up are those of a human: reorient it first"));
    }
    if set.text(LOSSY).as_deref() == Some("01") {
        tell(told, format!("slices were once compressed with loss (Lossy Image Compression {LOSSY})"));
    }
    slices(path, file, &set, told).map(Object::Slices)
}

fn slices(path: &Path, file: &File, set: &DataSet, told: &mut Vec<String>) -> Result<Vec<Slice>, IoError> {
    let n = match set.text(FRAMES) {
        None => 1,
        Some(text) => text.parse().ok().filter(|n| (1..=MOST_FRAMES).contains(n)).ok_or_else(|| {
            let place = format!("Number of Frames {FRAMES}");
            IoError::format(path, place, format!("`{text}`"), &format!("1 to {MOST_FRAMES}"))
        })?,
    };
    let own = set.items(PER_FRAME);
    if n > 1 && own.len() != n {
        let found = format!("{n} frames with {} descriptions (Per-Frame Functional Groups {PER_FRAME})", own.len());
        return Err(IoError::unsupported(path, found, "frames without places cannot be stacked: export single slices"));
    }
    let pixels = Pixels::of(path, set)?;
    let text = |tag: Tag| set.text(tag).unwrap_or_default();
    let mut slices = Vec::new();
    let read = &mut |k: usize, stored: Vec<Option<i32>>| {
        let frame = Frame { set, own: own.get(k), shared: set.item(SHARED) };
        let (row, column) = orientation(path, &frame)?;
        let spacing = frame.numbers(path, OF_SPACING, SPACING, "Pixel Spacing")?;
        aspect(path, set, spacing)?;
        let [slope, intercept] = values(path, &frame, told)?;
        let hu = |v: Option<i32>| v.map_or(AIR, |v| (f64::from(v) * slope + intercept) as f32);
        slices.push(Slice {
            path: path.into(),
            series: text(SERIES),
            instance: if n == 1 { text(INSTANCE) } else { format!("{}, frame {}", text(INSTANCE), k + 1) },
            frame_of_reference: text(FRAME_OF_REFERENCE),
            origin: Vec3::from(frame.numbers::<3>(path, OF_POSITION, POSITION, "Image Position")?),
            row,
            column,
            spacing,
            size: pixels.size,
            between: frame.holder(OF_SPACING, BETWEEN).decimals(BETWEEN).and_then(|v| v.first().copied()),
            tilt: set.decimals(TILT).and_then(|v| v.first().copied()),
            samples: stored.into_iter().map(hu).collect(),
        });
        Ok(())
    };
    let mut notes = Vec::new();
    pixels.frames(path, set, file.coding, n, &mut notes, read)?;
    notes.into_iter().for_each(|note| tell(told, note));
    Ok(slices)
}

fn orientation(path: &Path, frame: &Frame) -> Result<(Vec3, Vec3), IoError> {
    let cosines = frame.numbers::<6>(path, OF_ORIENTATION, ORIENTATION, "Image Orientation")?;
    let [row, column] = [0, 3].map(|k| Vec3::from_column_slice(&cosines[k..k + 3]));
    let off = (row.norm() - 1.0).abs().max((column.norm() - 1.0).abs()).max(row.dot(&column).abs());
    if off > UPRIGHT {
        let place = format!("Image Orientation {ORIENTATION}");
        return Err(IoError::format(path, place, format!("{cosines:?}"), "two unit vectors at a right angle"));
    }
    Ok((row, column))
}

/// The ratio of a pixel's edges, where it is given beside them.
fn aspect(path: &Path, set: &DataSet, [down, across]: [f64; 2]) -> Result<(), IoError> {
    match set.decimals(ASPECT).as_deref() {
        Some(&[vertical, horizontal])
            if (vertical * across - horizontal * down).abs() > ROUNDING * horizontal.abs() * down =>
        {
            let place = format!("Pixel Aspect Ratio {ASPECT}");
            let found = format!("{vertical} : {horizontal}");
            Err(IoError::format(path, place, found, &format!("{down} : {across}, as Pixel Spacing {SPACING} says")))
        }
        _ => Ok(()),
    }
}

/// Slope and intercept of stored values.
fn values(path: &Path, frame: &Frame, told: &mut Vec<String>) -> Result<[f64; 2], IoError> {
    if frame.set.get(LOOKUP).is_some() {
        let found = format!("a table from pixels to values (Modality LUT {LOOKUP})");
        return Err(IoError::unsupported(path, found, "Hounsfield units by slope and intercept are needed"));
    }
    match frame.holder(OF_VALUES, RESCALE_TYPE).text(RESCALE_TYPE).as_deref() {
        None | Some("HU" | "HU_MOD") => {}
        Some("US") => {
            tell(told, format!("the unit of values is left open (Rescale Type {RESCALE_TYPE} US): taken as HU"))
        }
        Some(other) => {
            let found = format!("values in {other} (Rescale Type {RESCALE_TYPE})");
            return Err(IoError::unsupported(path, found, "Hounsfield units are needed"));
        }
    }
    let [slope] = frame.numbers(path, OF_VALUES, SLOPE, "Rescale Slope")?;
    let [intercept] = frame.numbers(path, OF_VALUES, INTERCEPT, "Rescale Intercept")?;
    if slope == 0.0 {
        return Err(IoError::format(
            path,
            format!("Rescale Slope {SLOPE}"),
            "0",
            "another number: with it all values are one",
        ));
    }
    Ok([slope, intercept])
}
