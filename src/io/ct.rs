//! CT volumes by file kind. Here millimetres become metres and stored numbers Hounsfield units.

use std::io::Read;
use std::path::Path;

use super::{IoError, dicom, nifti, nrrd};
use crate::geometry::{Grid, Labels, Volume};
use crate::math::{Mat3, Vec3};

/// Metres in a millimetre.
pub(super) const MILLI: f64 = 1e-3;
/// Largest deviation of the axes' scalar products from 0 that passes as rounding.
const SHEAR: f64 = 1e-3;
/// Deflate's best ratio: what bounds an unpacked size from the packed one.
const MOST_INFLATION: u64 = 1032;
const CHOICES: &str = ".nii, .nii.gz, .nrrd, .nhdr, or a folder with a DICOM series";

/// Reads a CT: a NIfTI or NRRD file, or a folder that holds one DICOM series.
///
/// # Errors
/// [`IoError`] by what is wrong: unreadable, truncated or malformed files, another modality, gantry tilt, missing or
/// unevenly spaced slices, mixed series, compressed pixels.
pub fn read_volume(path: &Path) -> Result<Volume, IoError> {
    if path.is_dir() {
        return dicom::read_series(path);
    }
    let name = path.file_name().and_then(|n| n.to_str()).unwrap_or("").to_ascii_lowercase();
    if name.ends_with(".nii") || name.ends_with(".nii.gz") {
        nifti::read(path)
    } else if name.ends_with(".nrrd") || name.ends_with(".nhdr") {
        nrrd::read(path)
    } else if name.ends_with(".dcm") || name.ends_with(".ima") {
        Err(IoError::unsupported(path, "one DICOM slice", "give the folder that holds the series"))
    } else {
        std::fs::metadata(path).map_err(IoError::file(path))?;
        Err(IoError::Extension { path: path.into(), choices: CHOICES })
    }
}

/// Reads tissue numbers 0..255 from a NIfTI or NRRD file.
///
/// # Errors
/// As [`read_volume`]; [`IoError::Format`] where a number is not a whole one in 0..255.
pub fn read_labels(path: &Path) -> Result<Labels, IoError> {
    let Volume { grid, samples } = read_volume(path)?;
    let whole = |s: &f32| s.fract() == 0.0 && (0.0..=255.0).contains(s);
    if let Some(k) = samples.iter().position(|s| !whole(s)) {
        let place = format!("voxel {k}");
        return Err(IoError::format(path, place, samples[k].to_string(), "label numbers 0..255"));
    }
    Ok(Labels { grid, ids: samples.into_iter().map(|s| s as u8).collect() })
}

/// Number type of stored samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    pub fn width(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Samples of a byte string.
    pub fn decode(self, bytes: &[u8], little: bool) -> Vec<f32> {
        fn each<const N: usize>(bytes: &[u8], little: bool, f: impl Fn([u8; N]) -> f32) -> Vec<f32> {
            let turn = |mut b: [u8; N]| {
                if !little {
                    b.reverse();
                }
                f(b)
            };
            bytes.as_chunks::<N>().0.iter().map(|b| turn(*b)).collect()
        }
        match self {
            Self::I8 => each(bytes, little, |b| f32::from(i8::from_le_bytes(b))),
            Self::U8 => each(bytes, little, |b| f32::from(u8::from_le_bytes(b))),
            Self::I16 => each(bytes, little, |b| f32::from(i16::from_le_bytes(b))),
            Self::U16 => each(bytes, little, |b| f32::from(u16::from_le_bytes(b))),
            Self::I32 => each(bytes, little, |b| i32::from_le_bytes(b) as f32),
            Self::U32 => each(bytes, little, |b| u32::from_le_bytes(b) as f32),
            Self::F32 => each(bytes, little, f32::from_le_bytes),
            Self::F64 => each(bytes, little, |b| f64::from_le_bytes(b) as f32),
        }
    }
}

/// Unpacks gzip, but never more than `limit` bytes nor more than the packed bytes can hold.
pub(super) fn gunzip(path: &Path, packed: &[u8], limit: u64) -> Result<Vec<u8>, IoError> {
    let mut out = Vec::new();
    let limit = limit.min((packed.len() as u64).saturating_mul(MOST_INFLATION));
    match flate2::read::MultiGzDecoder::new(packed).take(limit).read_to_end(&mut out) {
        Ok(_) => Ok(out),
        Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
            Err(IoError::truncated(path, "the gzip stream", packed.len() as u64 + 1, packed.len() as u64))
        }
        Err(e) => Err(IoError::format(path, "the gzip stream", e.to_string(), "gzip data")),
    }
}

/// A grid from the world steps (mm, LPS) of its axes.
pub(super) fn grid(path: &Path, dims: [usize; 3], axes: [Vec3; 3], origin: Vec3) -> Result<Grid, IoError> {
    if dims.iter().any(|&n| n < 2) {
        return Err(IoError::unsupported(
            path,
            format!("a grid of {dims:?} samples"),
            "a volume of at least 2 x 2 x 2 is needed",
        ));
    }
    let lengths = axes.map(|a| a.norm());
    if !lengths.iter().all(|l| l.is_finite() && *l > 0.0) || !origin.iter().all(|c| c.is_finite()) {
        return Err(IoError::format(
            path,
            "the header",
            format!("voxel edges of {lengths:?} mm"),
            "positive, finite edges",
        ));
    }
    let unit = [0, 1, 2].map(|a| axes[a] / lengths[a]);
    let shear = unit[0].dot(&unit[1]).abs().max(unit[1].dot(&unit[2]).abs()).max(unit[2].dot(&unit[0]).abs());
    if shear > SHEAR {
        return Err(IoError::GantryTilt { path: path.into(), degrees: shear.asin().to_degrees() });
    }
    Ok(Grid {
        dims,
        spacing: Vec3::from(lengths) * MILLI,
        origin: origin * MILLI,
        direction: Mat3::from_columns(&unit),
    })
}

/// A volume, once its samples are known to be numbers and as many as the grid asks.
pub(super) fn volume(path: &Path, grid: Grid, samples: Vec<f32>) -> Result<Volume, IoError> {
    if samples.len() != grid.len() {
        return Err(IoError::truncated(path, "the samples", grid.len() as u64, samples.len() as u64));
    }
    if let Some(k) = samples.iter().position(|s| !s.is_finite()) {
        return Err(IoError::format(path, format!("sample {k}"), samples[k].to_string(), "finite numbers"));
    }
    Ok(Volume { grid, samples })
}
