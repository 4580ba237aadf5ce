//! CT volumes by file kind. Here millimetres become metres and stored numbers Hounsfield units.

use std::path::Path;

use super::{IoError, LabelMap, dicom, nifti, nrrd};
use crate::geometry::{Grid, Labels, Volume, rounded};
use crate::math::{Mat3, Vec3};

/// Metres in a millimetre.
pub(super) const MILLI: f64 = 1e-3;
/// Largest deviation of the axes' scalar products from 0 that passes as rounding.
const SHEAR: f64 = 1e-3;
/// Longest edge of a box about a head or a part of it, m; beyond these a unit of length is doubtful.
const HEAD: [f64; 2] = [0.03, 1.5];
const CHOICES: &str = ".nii, .nii.gz, .hdr, .img, .nrrd, .nhdr, or a folder with a DICOM series";

/// Reads a CT: a NIfTI or NRRD file, or a folder that holds one DICOM series. What was passed over, assumed or is
/// doubtful is added to `notes`, a sentence each.
///
/// # Errors
/// [`IoError`] by what is wrong: unreadable, truncated or malformed files, fields that change samples or places and are
/// not understood, another modality, gantry tilt, missing or unevenly spaced slices, mixed series.
pub fn read_volume(path: &Path, notes: &mut Vec<String>) -> Result<Volume, IoError> {
    let mut told = Vec::new();
    let volume = by_kind(path, &mut told)?;
    let [low, high] = volume.grid.bounds();
    let size = high - low;
    if !(HEAD[0]..=HEAD[1]).contains(&size.max()) {
        let mm = size / MILLI;
        told.push(format!(
            "the volume measures {:.4} x {:.4} x {:.4} mm, which is no head: check the unit of its spacing",
            mm.x, mm.y, mm.z
        ));
    }
    notes.extend(told.into_iter().map(|note| format!("{}: {note}", path.display())));
    Ok(volume)
}

fn by_kind(path: &Path, told: &mut Vec<String>) -> Result<Volume, IoError> {
    if path.is_dir() {
        return dicom::read_series(path, told);
    }
    let name = path.file_name().and_then(|n| n.to_str()).unwrap_or("").to_ascii_lowercase();
    let named = |endings: &[&str]| endings.iter().any(|e| name.ends_with(e));
    if named(&[".nii", ".nii.gz", ".hdr", ".img", ".hdr.gz", ".img.gz"]) {
        nifti::read(path, told)
    } else if named(&[".nrrd", ".nhdr"]) {
        nrrd::read(path, told)
    } else if named(&[".dcm", ".ima"]) {
        dicom::read_frames(path, told)
    } else {
        std::fs::metadata(path).map_err(IoError::file(path))?;
        Err(IoError::Extension { path: path.into(), choices: CHOICES })
    }
}

/// Reads tissue numbers from a NIfTI or NRRD file: 2 skull, 3 mandible, 4 spine, 6 hyoid, or what `map` makes such.
///
/// # Errors
/// As [`read_volume`]; [`IoError::Format`] where a number is not a whole one in 0..255 or one of `map` is not there.
pub fn read_labels(path: &Path, map: &LabelMap, notes: &mut Vec<String>) -> Result<Labels, IoError> {
    let Volume { grid, samples } = read_volume(path, notes)?;
    map.labels(path, grid, &samples)
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
    I64,
    U64,
    F32,
    F64,
}

impl Scalar {
    pub fn width(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Samples of a byte string.
    pub fn decode(self, bytes: &[u8], little: bool) -> Vec<f32> {
        self.scaled(bytes, little, 1.0, 0.0)
    }

    /// Samples of a byte string, `slope` times as much and `shift` added.
    pub fn scaled(self, bytes: &[u8], little: bool, slope: f64, shift: f64) -> Vec<f32> {
        let each = Each { bytes, little, slope, shift };
        match self {
            Self::I8 => each.read(|b| f64::from(i8::from_le_bytes(b))),
            Self::U8 => each.read(|b| f64::from(u8::from_le_bytes(b))),
            Self::I16 => each.read(|b| f64::from(i16::from_le_bytes(b))),
            Self::U16 => each.read(|b| f64::from(u16::from_le_bytes(b))),
            Self::I32 => each.read(|b| f64::from(i32::from_le_bytes(b))),
            Self::U32 => each.read(|b| f64::from(u32::from_le_bytes(b))),
            Self::I64 => each.read(|b| i64::from_le_bytes(b) as f64),
            Self::U64 => each.read(|b| u64::from_le_bytes(b) as f64),
            Self::F32 => each.read(|b| f64::from(f32::from_le_bytes(b))),
            Self::F64 => each.read(f64::from_le_bytes),
        }
    }
}

struct Each<'a> {
    bytes: &'a [u8],
    little: bool,
    slope: f64,
    shift: f64,
}

/// Whether the machine gives the memory for `n` samples; asked for at once and let go, since vectors that do not fit end the process.
pub(super) fn room(path: &Path, n: usize) -> Result<(), IoError> {
    let bytes = n.saturating_mul(size_of::<f32>());
    Vec::<u8>::new().try_reserve_exact(bytes).map_err(|_| {
        let advice =
            format!("they want {bytes} bytes of memory, which the machine does not give; crop or resample the volume");
        IoError::unsupported(path, format!("{n} samples"), advice)
    })
}

impl Each<'_> {
    fn read<const N: usize>(&self, value: impl Fn([u8; N]) -> f64) -> Vec<f32> {
        let turn = |mut b: [u8; N]| {
            if !self.little {
                b.reverse();
            }
            (value(b) * self.slope + self.shift) as f32
        };
        self.bytes.as_chunks::<N>().0.iter().map(|b| turn(*b)).collect()
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
    if dims.iter().try_fold(1usize, |n, &d| n.checked_mul(d)).is_none_or(|n| n > isize::MAX as usize / 8) {
        return Err(IoError::unsupported(path, format!("a grid of {dims:?} samples"), "no memory holds as many"));
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
        origin: rounded(&(origin * MILLI)),
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
