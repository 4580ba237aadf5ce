//! NIfTI-1 and NIfTI-2 volumes: `.nii` or `.hdr` beside `.img`, packed by gzip or not.
//!
//! Source: R. W. Cox et al., "A (sort of) new image data format standard: NIfTI-1", 2004; `nifti1.h`, methods 2 and 3;
//! `nifti2.h`, 2011. What only says how to show or name a volume (`cal_min`, `descrip`, slice timing) changes no sample
//! and no place, so it is not read.

use std::path::{Path, PathBuf};

use super::IoError;
use super::ct::{self, Scalar};
use super::file::read_bytes;
use super::gzip::{gunzip, is_gzip};
use crate::geometry::Volume;
use crate::math::{Mat3, Vec3};

/// Header sizes of the two versions, which stand at their beginning.
const HEADER: [usize; 2] = [348, 540];
/// Bytes that say whether extensions follow.
const EXTENSION: usize = 4;
/// Difference of two statements of a place that is told, in voxels.
const APART: f64 = 0.1;
/// Excess of a quaternion's length over 1 that passes as rounding of its three numbers.
const UNIT: f64 = 1e-3;

pub(super) fn read(path: &Path, told: &mut Vec<String>) -> Result<Volume, IoError> {
    let (header_path, pair) = with_ending(path, ["img", "hdr"]).map_or((path.into(), false), |p| (p, true));
    let bytes = unpacked(&header_path, told)?;
    let header = Header::parse(&header_path, &bytes)?;
    let dims = header.dims(path)?;
    let scalar = header.scalar(path)?;
    header.intent(path)?;
    let (axes, origin) = orientation(path, &header, dims, told)?;
    let grid = ct::grid(path, dims, axes, origin)?;
    let (data, least) = if header.alone {
        (bytes, (header.size + EXTENSION) as f64)
    } else {
        let image = if pair { path.into() } else { image_beside(path) };
        (unpacked(&image, told)?, 0.0)
    };
    let offset = if header.offset == 0.0 { least } else { header.offset };
    if !(offset >= least && offset.fract() == 0.0) {
        let wanted = format!("a whole number of bytes, at least {least}");
        return Err(IoError::format(path, "field `vox_offset`", offset.to_string(), &wanted));
    }
    let wanted = (grid.len() as u64).saturating_mul(scalar.width() as u64).saturating_add(offset as u64);
    if (data.len() as u64) < wanted {
        return Err(IoError::truncated(path, "the samples", wanted, data.len() as u64));
    }
    if data.len() as u64 > wanted && data[wanted as usize..].iter().any(|&b| b != 0) {
        told.push(format!("{} bytes behind the samples were passed over", data.len() as u64 - wanted));
    }
    let [slope, shift] = match [header.slope, header.shift] {
        [0.0, _] => [1.0, 0.0],
        [slope, shift] if slope.is_finite() && shift.is_finite() => [slope, shift],
        // Some writers say so that there is no scaling.
        [slope, shift] if slope.is_nan() && (shift.is_nan() || shift == 0.0) => [1.0, 0.0],
        found => {
            let place = "fields `scl_slope` and `scl_inter`";
            return Err(IoError::format(path, place, format!("{found:?}"), "finite numbers"));
        }
    };
    ct::room(path, grid.len())?;
    let samples = scalar.scaled(&data[offset as usize..wanted as usize], header.little, slope, shift);
    ct::volume(path, grid, samples)
}

/// The same name with the second ending where it has the first, `.gz` kept; upper case stays upper case.
fn with_ending(path: &Path, [from, to]: [&str; 2]) -> Option<PathBuf> {
    let name = path.file_name()?.to_str()?;
    let lower = name.to_ascii_lowercase();
    let at = [format!(".{from}"), format!(".{from}.gz")]
        .iter()
        .find_map(|e| lower.ends_with(e).then(|| name.len() - e.len() + 1))?;
    let upper = name[at..at + from.len()].bytes().all(|b| b.is_ascii_uppercase());
    let to = if upper { to.to_ascii_uppercase() } else { to.into() };
    Some(path.with_file_name(format!("{}{to}{}", &name[..at], &name[at + from.len()..])))
}

/// The samples of a header on its own, packed or not.
fn image_beside(header: &Path) -> PathBuf {
    let image = with_ending(header, ["hdr", "img"]).unwrap_or_else(|| header.with_extension("img"));
    let packed = PathBuf::from(format!("{}.gz", image.display()));
    if !image.exists() && packed.exists() { packed } else { image }
}

fn unpacked(path: &Path, told: &mut Vec<String>) -> Result<Vec<u8>, IoError> {
    let bytes = read_bytes(path)?;
    if is_gzip(&bytes) { gunzip(path, &bytes, u64::MAX, told) } else { Ok(bytes) }
}

/// Fields that say what and where the samples are, of either version.
struct Header {
    size: usize,
    little: bool,
    /// Whether the samples are in the same file.
    alone: bool,
    dim: [i64; 8],
    datatype: i64,
    bits: i64,
    intent: i64,
    pixdim: [f64; 8],
    offset: f64,
    slope: f64,
    shift: f64,
    units: i64,
    qform: i64,
    sform: i64,
    quaternion: [f64; 3],
    qoffset: [f64; 3],
    srow: [[f64; 4]; 3],
}

/// Numbers of the header by place.
struct Fields<'a> {
    bytes: &'a [u8],
    little: bool,
}

impl Fields<'_> {
    fn uint(&self, at: usize, n: usize) -> u64 {
        let step = |v: u64, b: &u8| v << 8 | u64::from(*b);
        let bytes = &self.bytes[at..at + n];
        if self.little { bytes.iter().rev().fold(0, step) } else { bytes.iter().fold(0, step) }
    }
    fn int(&self, at: usize, n: usize) -> i64 {
        let unused = 64 - 8 * n as u32;
        (self.uint(at, n) << unused) as i64 >> unused
    }
    fn real(&self, at: usize, n: usize) -> f64 {
        if n == 8 { f64::from_bits(self.uint(at, 8)) } else { f64::from(f32::from_bits(self.uint(at, 4) as u32)) }
    }
}

impl Header {
    fn parse(path: &Path, bytes: &[u8]) -> Result<Self, IoError> {
        let short = |n: usize| IoError::truncated(path, "the NIfTI header", n as u64, bytes.len() as u64);
        if bytes.len() < 4 {
            return Err(short(HEADER[0]));
        }
        let size_as = |little| Fields { bytes, little }.uint(0, 4);
        let known = |little| HEADER.iter().find(|&&h| h as u64 == size_as(little)).map(|&h| (h, little));
        let (size, little) = known(true).or(known(false)).ok_or_else(|| {
            let found = format!("a header of {} bytes", size_as(true));
            IoError::format(path, "the NIfTI header", found, "348 (NIfTI-1) or 540 (NIfTI-2)")
        })?;
        if bytes.len() < size {
            return Err(short(size));
        }
        let f = Fields { bytes, little };
        let two = size == HEADER[1];
        let mark = if two { &bytes[4..8] } else { &bytes[344..348] };
        let alone = match (two, mark) {
            (false, b"n+1\0") | (true, b"n+2\0") => true,
            (false, b"ni1\0") | (true, b"ni2\0") => false,
            (false, [0, 0, 0, 0]) => {
                let advice = "left and right cannot be told: save it as NIfTI with an sform";
                return Err(IoError::unsupported(path, "an Analyze 7.5 header, without the NIfTI mark", advice));
            }
            _ => {
                let found = format!("{:?}", String::from_utf8_lossy(mark));
                return Err(IoError::format(
                    path,
                    "field `magic`",
                    found,
                    "n+1 or ni1 (NIfTI-1), n+2 or ni2 (NIfTI-2)",
                ));
            }
        };
        let reals = |at: usize, n: usize, k: usize| f.real(at + n * k, n);
        let header = if two {
            Self {
                dim: std::array::from_fn(|k| f.int(16 + 8 * k, 8)),
                datatype: f.int(12, 2),
                bits: f.int(14, 2),
                intent: f.int(504, 4),
                pixdim: std::array::from_fn(|k| reals(104, 8, k)),
                offset: f.int(168, 8) as f64,
                slope: f.real(176, 8),
                shift: f.real(184, 8),
                units: f.int(500, 4),
                qform: f.int(344, 4),
                sform: f.int(348, 4),
                quaternion: std::array::from_fn(|k| reals(352, 8, k)),
                qoffset: std::array::from_fn(|k| reals(376, 8, k)),
                srow: std::array::from_fn(|r| std::array::from_fn(|k| reals(400 + 32 * r, 8, k))),
                size,
                little,
                alone,
            }
        } else {
            Self {
                dim: std::array::from_fn(|k| f.int(40 + 2 * k, 2)),
                datatype: f.int(70, 2),
                bits: f.int(72, 2),
                intent: f.int(68, 2),
                pixdim: std::array::from_fn(|k| reals(76, 4, k)),
                offset: f.real(108, 4),
                slope: f.real(112, 4),
                shift: f.real(116, 4),
                units: f.int(123, 1),
                qform: f.int(252, 2),
                sform: f.int(254, 2),
                quaternion: std::array::from_fn(|k| reals(256, 4, k)),
                qoffset: std::array::from_fn(|k| reals(268, 4, k)),
                srow: std::array::from_fn(|r| std::array::from_fn(|k| reals(280 + 16 * r, 4, k))),
                size,
                little,
                alone,
            }
        };
        Ok(header)
    }

    /// Samples along the three axes; further axes have one.
    fn dims(&self, path: &Path) -> Result<[usize; 3], IoError> {
        let rank = usize::try_from(self.dim[0]).unwrap_or(0);
        if !(3..=7).contains(&rank) || (4..=rank).any(|a| self.dim[a] != 1) || (1..=3).any(|a| self.dim[a] < 1) {
            let found = format!("a NIfTI array of {:?} samples (`dim`)", &self.dim[1..=rank.clamp(1, 7)]);
            return Err(IoError::unsupported(path, found, "one three-dimensional volume is needed: split the series"));
        }
        Ok([1, 2, 3].map(|a| self.dim[a] as usize))
    }

    fn scalar(&self, path: &Path) -> Result<Scalar, IoError> {
        let scalar = match self.datatype {
            2 => Scalar::U8,
            4 => Scalar::I16,
            8 => Scalar::I32,
            16 => Scalar::F32,
            64 => Scalar::F64,
            256 => Scalar::I8,
            512 => Scalar::U16,
            768 => Scalar::U32,
            1024 => Scalar::I64,
            1280 => Scalar::U64,
            other => {
                let found = format!("NIfTI data type {other} (`datatype`)");
                return Err(IoError::unsupported(path, found, "save it as int16 Hounsfield units"));
            }
        };
        if self.bits != 8 * scalar.width() as i64 {
            let found = format!("{} bits a voxel", self.bits);
            let wanted = format!("{} for data type {}", 8 * scalar.width(), self.datatype);
            return Err(IoError::format(path, "field `bitpix`", found, &wanted));
        }
        Ok(scalar)
    }

    /// Nothing, an estimate, label numbers or a pure number: what samples of a CT or of labels may be.
    fn intent(&self, path: &Path) -> Result<(), IoError> {
        match self.intent {
            0 | 1001 | 1002 | 1003 | 1011 => Ok(()),
            other => {
                let found = format!("samples that are a statistic, a vector or the like (`intent_code` {other})");
                Err(IoError::unsupported(path, found, "save the CT itself, in Hounsfield units"))
            }
        }
    }

    /// Millimetres in the unit of length.
    fn unit(&self, path: &Path, told: &mut Vec<String>) -> Result<f64, IoError> {
        match self.units & 7 {
            1 => Ok(1e3),
            2 => Ok(1.0),
            3 => Ok(1e-3),
            0 => {
                told.push("no unit of length is named (`xyzt_units`): taken as millimetres".into());
                Ok(1.0)
            }
            other => {
                let place = "field `xyzt_units`";
                Err(IoError::format(path, place, format!("unit of length {other}"), "1 (m), 2 (mm) or 3 (um)"))
            }
        }
    }
}

/// Steps of the axes and position of the first voxel, in the file's axes and unit.
type Frame = ([Vec3; 3], Vec3);

/// The same in LPS millimetres: by the sform, unless it leads to an atlas and the qform to the scanner.
fn orientation(path: &Path, header: &Header, dims: [usize; 3], told: &mut Vec<String>) -> Result<Frame, IoError> {
    let mm = header.unit(path, told)?;
    let sform = (header.sform > 0).then(|| sform(header));
    let qform = if header.qform > 0 { Some(qform(path, header)?) } else { None };
    let atlas = |code: i64| code > 2;
    let (axes, origin) = match (sform, qform) {
        (Some(s), Some(q)) => {
            let of_q = atlas(header.sform) && !atlas(header.qform);
            let far = apart(&s, &q, dims);
            if far > APART {
                let (taken, other) = if of_q { ("qform", "sform") } else { ("sform", "qform") };
                told.push(format!(
                    "sform (code {}) and qform (code {}) disagree by up to {far:.1} voxels: the {taken} was taken, not the \
                     {other}; check left and right",
                    header.sform, header.qform
                ));
            }
            if of_q { q } else { s }
        }
        (Some(frame), None) | (None, Some(frame)) => frame,
        (None, None) => {
            let advice = "left and right cannot be told: set the sform (for example with the scanner's export)";
            return Err(IoError::unsupported(path, "a NIfTI file without sform and qform", advice));
        }
    };
    if atlas(header.sform.max(0)) && (header.qform <= 0 || atlas(header.qform)) {
        let code = header.sform;
        told.push(format!("the volume lies in the space of an atlas (code {code}): sizes may be the atlas's"));
    }
    let uneven = |a: usize| {
        let (edge, given) = (axes[a].norm(), header.pixdim[a + 1].abs());
        given > 0.0 && (edge - given).abs() > 1e-3 * given
    };
    if let Some(a) = (0..3).find(|&a| uneven(a)) {
        told.push(format!(
            "voxels measure {} along axis {} by the orientation and {} by `pixdim`: the orientation was taken",
            axes[a].norm(),
            a + 1,
            header.pixdim[a + 1]
        ));
    }
    let lps = |v: Vec3| Vec3::new(-v.x, -v.y, v.z) * mm;
    Ok((axes.map(lps), lps(origin)))
}

fn sform(header: &Header) -> Frame {
    let column = |k: usize| Vec3::from_fn(|r, _| header.srow[r][k]);
    ([column(0), column(1), column(2)], column(3))
}

fn qform(path: &Path, header: &Header) -> Result<Frame, IoError> {
    let [b, c, d] = header.quaternion;
    let norm = b * b + c * c + d * d;
    // Also where it is no number.
    if norm.is_nan() || norm > 1.0 + UNIT {
        let found = format!("{:?}", header.quaternion);
        return Err(IoError::format(
            path,
            "fields `quatern_b, _c, _d`",
            found,
            "a rotation: squares that add up to 1 at most",
        ));
    }
    let sizes = [1, 2, 3].map(|a| header.pixdim[a]);
    if !sizes.iter().all(|s| s.is_finite() && *s > 0.0) {
        return Err(IoError::format(path, "field `pixdim`", format!("{sizes:?}"), "positive edges of a voxel"));
    }
    let a = (1.0 - norm).max(0.0).sqrt();
    let rotation = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(a, b, c, d));
    let rotation: Mat3 = rotation.to_rotation_matrix().into_inner();
    let flip = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
    let step = |a: usize| rotation.column(a) * sizes[a] * if a == 2 { flip } else { 1.0 };
    Ok(([step(0), step(1), step(2)], Vec3::from(header.qoffset)))
}

/// Largest distance of a corner of the volume between two frames, in the second's shortest voxel edges.
fn apart(s: &Frame, q: &Frame, dims: [usize; 3]) -> f64 {
    let edge = q.0.iter().map(|a| a.norm()).fold(f64::INFINITY, f64::min);
    let corner = |frame: &Frame, k: usize| {
        (0..3).filter(|a| k >> a & 1 == 1).map(|a| frame.0[a] * (dims[a] as f64 - 1.0)).sum::<Vec3>() + frame.1
    };
    (0..8).map(|k| (corner(s, k) - corner(q, k)).norm() / edge).fold(0.0, f64::max)
}
