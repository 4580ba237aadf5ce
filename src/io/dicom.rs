//! One DICOM CT series from a folder of single-frame slices.
//!
//! Source: DICOM PS3.3 2024, C.7.6.2 (image plane) and C.8.2.1 (CT image). Slices are ordered by their position
//! along the slice normal, never by number or file name.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use dicom_object::{DefaultDicomObject, Tag};

use super::IoError;
use super::ct;
use super::dicom_lengths::{Claim, lengths_fit};
use crate::geometry::Volume;
use crate::math::Vec3;

const MODALITY: Tag = Tag(0x0008, 0x0060);
const SERIES: Tag = Tag(0x0020, 0x000E);
const POSITION: Tag = Tag(0x0020, 0x0032);
const ORIENTATION: Tag = Tag(0x0020, 0x0037);
const FRAMES: Tag = Tag(0x0028, 0x0008);
const ROWS: Tag = Tag(0x0028, 0x0010);
const COLUMNS: Tag = Tag(0x0028, 0x0011);
const PIXEL_SPACING: Tag = Tag(0x0028, 0x0030);
const BITS: Tag = Tag(0x0028, 0x0100);
const SIGNED: Tag = Tag(0x0028, 0x0103);
const INTERCEPT: Tag = Tag(0x0028, 0x1052);
const SLOPE: Tag = Tag(0x0028, 0x1053);
const PIXELS: Tag = Tag(0x7FE0, 0x0010);

/// Slice distances may differ by this share of the usual one (rounding of the header's decimals).
const UNEVEN: f64 = 0.02;
/// Sideways drift of the slices, as share of their distance, that counts as tilt (0.3 degrees).
const TILT: f64 = 5e-3;
/// Orientation cosines of one series agree to this.
const SAME: f64 = 1e-4;

/// What one file says.
struct Slice {
    path: PathBuf,
    series: String,
    origin: Vec3,
    row: Vec3,
    column: Vec3,
    spacing: [f64; 2],
    size: [usize; 2],
    samples: Vec<f32>,
}

pub(super) fn read_series(folder: &Path) -> Result<Volume, IoError> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .and_then(|entries| entries.map(|e| e.map(|e| e.path())).collect())
        .map_err(IoError::file(folder))?;
    files.sort();
    let mut slices = Vec::new();
    for file in files.into_iter().filter(|f| f.is_file()) {
        if is_dicom(&file)? {
            slices.push(read_slice(&file)?);
        }
    }
    if slices.len() < 2 {
        let found = format!("{} DICOM slice(s) in the folder", slices.len());
        return Err(IoError::unsupported(folder, found, "a CT series of at least 2 slices is needed"));
    }
    one_series(folder, &slices)?;
    let normal = slices[0].row.cross(&slices[0].column);
    slices.sort_by(|a, b| a.origin.dot(&normal).total_cmp(&b.origin.dot(&normal)));
    let step = stacking(folder, &slices, &normal)?;
    let first = &slices[0];
    let dims = [first.size[0], first.size[1], slices.len()];
    // Pixel spacing names the distance of rows first: that is the step down a column.
    let axes = [first.row * first.spacing[1], first.column * first.spacing[0], step];
    let grid = ct::grid(folder, dims, axes, first.origin)?;
    let samples = slices.into_iter().flat_map(|s| s.samples).collect();
    ct::volume(folder, grid, samples)
}

/// Whether a file carries the DICOM mark behind its preamble.
fn is_dicom(path: &Path) -> Result<bool, IoError> {
    use std::io::Read;
    let mut head = Vec::new();
    std::fs::File::open(path).and_then(|f| f.take(132).read_to_end(&mut head)).map_err(IoError::file(path))?;
    let named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("dcm"));
    if named && head.len() < 132 {
        return Err(IoError::truncated(path, "the DICOM preamble", 132, head.len() as u64));
    }
    Ok(head.get(128..) == Some(b"DICM"))
}

fn read_slice(path: &Path) -> Result<Slice, IoError> {
    let broken = |e: &dyn std::error::Error| {
        let why = std::iter::successors(Some(e), |e| e.source()).last().map_or(String::new(), ToString::to_string);
        IoError::format(path, "the DICOM data set", why, "a whole DICOM file: copy it again")
    };
    let bytes = std::fs::read(path).map_err(IoError::file(path))?;
    lengths_fit(&bytes).map_err(|claim| match claim {
        Claim::Beyond { tag, bytes, left } => {
            IoError::truncated(path, format!("element {tag}"), bytes.into(), left as u64)
        }
        Claim::Ragged { tag, bytes, unit } => IoError::format(
            path,
            format!("the length of element {tag}"),
            format!("{bytes} bytes"),
            &format!("a multiple of {unit}: copy the file again"),
        ),
    })?;
    let object = dicom_object::open_file(path).map_err(|e| broken(&e))?;
    let modality = text(&object, MODALITY).unwrap_or_else(|| "unknown".into());
    if modality != "CT" {
        return Err(IoError::Modality { path: path.into(), found: modality });
    }
    let syntax = object.meta().transfer_syntax().trim_end_matches(['\0', ' ']).to_string();
    if !matches!(syntax.as_str(), "1.2.840.10008.1.2" | "1.2.840.10008.1.2.1" | "1.2.840.10008.1.2.2") {
        let advice = "decompress it first (for example `gdcmconv --raw` or `dcmdjpeg`)";
        return Err(IoError::unsupported(path, format!("compressed pixels (transfer syntax {syntax})"), advice));
    }
    let missing = |what: &str| IoError::format(path, what, "nothing usable", "an axial CT slice with this attribute");
    let several = |tag: Tag, n: usize, what: &str| {
        let values = object.element_opt(tag).ok().flatten().and_then(|e| e.to_multi_float64().ok());
        values.filter(|v| v.len() == n && v.iter().all(|x| x.is_finite())).ok_or_else(|| missing(what))
    };
    let count = |tag: Tag| object.element_opt(tag).ok().flatten().and_then(|e| e.to_int::<u32>().ok());
    if let Some(frames) = count(FRAMES).filter(|&n| n > 1) {
        return Err(IoError::unsupported(path, format!("{frames} frames in one file"), "export single-frame slices"));
    }
    let rows = count(ROWS).ok_or_else(|| missing("Rows (0028,0010)"))? as usize;
    let columns = count(COLUMNS).ok_or_else(|| missing("Columns (0028,0011)"))? as usize;
    let position = several(POSITION, 3, "Image Position (0020,0032)")?;
    let orientation = several(ORIENTATION, 6, "Image Orientation (0020,0037)")?;
    let spacing = several(PIXEL_SPACING, 2, "Pixel Spacing (0028,0030)")?;
    if count(BITS) != Some(16) {
        let found = format!("{:?} bits a pixel", count(BITS));
        return Err(IoError::unsupported(path, found, "CT slices of 16 bits are read"));
    }
    let slope = several(SLOPE, 1, "Rescale Slope (0028,1053)")?[0];
    let intercept = several(INTERCEPT, 1, "Rescale Intercept (0028,1052)")?[0];
    let signed = count(SIGNED) == Some(1);
    let pixels = object.element_opt(PIXELS).ok().flatten().ok_or_else(|| missing("Pixel Data (7FE0,0010)"))?;
    let stored: Vec<i32> = pixels.to_multi_int().map_err(|e| broken(&e))?;
    if stored.len() < rows * columns {
        return Err(IoError::truncated(path, "the pixels", 2 * (rows * columns) as u64, 2 * stored.len() as u64));
    }
    let value = |v: i32| f64::from(if signed { i32::from(v as i16) } else { v & 0xffff }) * slope + intercept;
    Ok(Slice {
        path: path.into(),
        series: text(&object, SERIES).unwrap_or_default(),
        origin: Vec3::from_column_slice(&position),
        row: Vec3::from_column_slice(&orientation[..3]),
        column: Vec3::from_column_slice(&orientation[3..]),
        spacing: [spacing[0], spacing[1]],
        size: [columns, rows],
        samples: stored[..rows * columns].iter().map(|&v| value(v) as f32).collect(),
    })
}

fn text(object: &DefaultDicomObject, tag: Tag) -> Option<String> {
    let element = object.element_opt(tag).ok().flatten()?;
    Some(element.to_str().ok()?.trim_end_matches(['\0', ' ']).to_string())
}

/// All slices are of one series and one shape.
fn one_series(folder: &Path, slices: &[Slice]) -> Result<(), IoError> {
    let mut series: BTreeMap<&str, usize> = BTreeMap::new();
    slices.iter().for_each(|s| *series.entry(&s.series).or_default() += 1);
    if series.len() > 1 {
        let list = series.iter().map(|(uid, n)| format!("{n} of {uid}")).collect::<Vec<_>>().join(", ");
        return Err(IoError::MixedSeries { path: folder.into(), found: series.len(), list });
    }
    let first = &slices[0];
    let same = |s: &&Slice| {
        s.size == first.size
            && (s.row - first.row).norm() < SAME
            && (s.column - first.column).norm() < SAME
            && (0..2).all(|a| (s.spacing[a] - first.spacing[a]).abs() < SAME * first.spacing[a])
    };
    match slices.iter().find(|s| !same(s)) {
        Some(other) => {
            let found = format!("a slice unlike the others ({})", other.path.display());
            Err(IoError::unsupported(folder, found, "leave scouts and reformatted slices out of the folder"))
        }
        None => Ok(()),
    }
}

/// The step from slice to slice, mm; the slices are sorted along the normal.
fn stacking(folder: &Path, slices: &[Slice], normal: &Vec3) -> Result<Vec3, IoError> {
    let at = |k: usize| slices[k].origin.dot(normal);
    let gaps: Vec<f64> = (1..slices.len()).map(|k| at(k) - at(k - 1)).collect();
    let mut sorted = gaps.clone();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted[sorted.len() / 2];
    let (least, most) = (sorted[0], sorted[sorted.len() - 1]);
    let uneven = |g: f64| (g - usual).abs() > UNEVEN * usual;
    if usual <= 0.0 || least < (1.0 - UNEVEN) * usual {
        return Err(IoError::Spacing { path: folder.into(), least_mm: least, most_mm: most });
    }
    if let Some(hole) = gaps.iter().position(|&g| uneven(g)) {
        let times = gaps.iter().map(|g| g / usual);
        if times.clone().any(|t| (t - t.round()).abs() > UNEVEN * t.round()) {
            return Err(IoError::Spacing { path: folder.into(), least_mm: least, most_mm: most });
        }
        let missing = times.map(|t| t.round() as usize - 1).sum();
        let (after_mm, before_mm) = (at(hole), at(hole + 1));
        return Err(IoError::MissingSlices { path: folder.into(), missing, after_mm, before_mm, spacing_mm: usual });
    }
    let step = (slices[slices.len() - 1].origin - slices[0].origin) / gaps.len() as f64;
    let along = step.dot(normal);
    let sideways = (step - normal * along).norm();
    if sideways > TILT * along {
        return Err(IoError::GantryTilt { path: folder.into(), degrees: (sideways / along).atan().to_degrees() });
    }
    Ok(normal * along)
}
