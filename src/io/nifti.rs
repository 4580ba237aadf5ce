//! NIfTI-1 volumes, `.nii` and `.nii.gz`.
//!
//! Source: R. W. Cox et al., "A (sort of) new image data format standard: NIfTI-1", 2004; `nifti1.h`, methods 2 and 3.

use std::path::Path;

use ::nifti::{Endianness, NiftiHeader};

use super::IoError;
use super::ct::{self, Scalar};
use crate::geometry::Volume;
use crate::math::{Mat3, Vec3};

/// Bytes of the header before the samples.
const HEADER: usize = 348;

pub(super) fn read(path: &Path) -> Result<Volume, IoError> {
    let mut bytes = std::fs::read(path).map_err(IoError::file(path))?;
    if bytes.starts_with(&[0x1f, 0x8b]) {
        bytes = ct::gunzip(path, &bytes, u64::MAX)?;
    }
    if bytes.len() < HEADER {
        return Err(IoError::truncated(path, "the NIfTI header", HEADER as u64, bytes.len() as u64));
    }
    let header = NiftiHeader::from_reader(&bytes[..])
        .map_err(|e| IoError::format(path, "the NIfTI header", e.to_string(), "a NIfTI-1 file"))?;
    let extent = |a: usize| header.dim[a].max(1);
    let rank = usize::from(header.dim[0]);
    if !(3..=7).contains(&rank) || (4..=rank).any(|a| extent(a) != 1) {
        let found = format!("a NIfTI array of {:?}", &header.dim[..=rank.min(7)]);
        return Err(IoError::unsupported(path, found, "one three-dimensional volume is needed: split the series"));
    }
    let dims = [1, 2, 3].map(|a| usize::from(header.dim[a]));
    let scalar = match header.datatype {
        2 => Scalar::U8,
        4 => Scalar::I16,
        8 => Scalar::I32,
        16 => Scalar::F32,
        64 => Scalar::F64,
        256 => Scalar::I8,
        512 => Scalar::U16,
        768 => Scalar::U32,
        other => {
            return Err(IoError::unsupported(
                path,
                format!("NIfTI data type {other}"),
                "save it as int16 Hounsfield units",
            ));
        }
    };
    let (axes, origin) = orientation(path, &header)?;
    let grid = ct::grid(path, dims, axes, origin)?;
    let begin = header.vox_offset.max(352.0) as usize;
    let wanted = (grid.len() as u64).saturating_mul(scalar.width() as u64).saturating_add(begin as u64);
    if (bytes.len() as u64) < wanted {
        return Err(IoError::truncated(path, "the samples", wanted, bytes.len() as u64));
    }
    let mut samples = scalar.decode(&bytes[begin..wanted as usize], header.endianness == Endianness::Little);
    let (slope, shift) = (header.scl_slope, header.scl_inter);
    if slope != 0.0 && slope.is_finite() && (slope, shift) != (1.0, 0.0) {
        samples.iter_mut().for_each(|s| *s = *s * slope + shift);
    }
    ct::volume(path, grid, samples)
}

/// Steps of the axes and position of the first voxel in LPS millimetres: sform first, then qform.
fn orientation(path: &Path, header: &NiftiHeader) -> Result<([Vec3; 3], Vec3), IoError> {
    let row = |r: [f32; 4]| r.map(f64::from);
    let mm = match header.xyzt_units & 7 {
        1 => 1e3,
        3 => 1e-3,
        _ => 1.0,
    };
    let (columns, origin) = if header.sform_code > 0 {
        let rows = [row(header.srow_x), row(header.srow_y), row(header.srow_z)];
        (
            [0, 1, 2].map(|a| Vec3::new(rows[0][a], rows[1][a], rows[2][a])),
            Vec3::new(rows[0][3], rows[1][3], rows[2][3]),
        )
    } else if header.qform_code > 0 {
        let [b, c, d] = [header.quatern_b, header.quatern_c, header.quatern_d].map(f64::from);
        let a = (1.0 - b * b - c * c - d * d).max(0.0).sqrt();
        let rotation = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(a, b, c, d));
        let rotation: Mat3 = rotation.to_rotation_matrix().into_inner();
        let flip = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
        let step = |a: usize| f64::from(header.pixdim[a + 1]) * if a == 2 { flip } else { 1.0 };
        let origin = [header.quatern_x, header.quatern_y, header.quatern_z].map(f64::from);
        ([0, 1, 2].map(|a| rotation.column(a) * step(a)), Vec3::from(origin))
    } else {
        let advice = "left and right cannot be told: set the sform (for example with the scanner's export)";
        return Err(IoError::unsupported(path, "a NIfTI file without sform and qform", advice));
    };
    let lps = |v: Vec3| Vec3::new(-v.x, -v.y, v.z) * mm;
    Ok((columns.map(lps), lps(origin)))
}
