//! Labels as a NIfTI-1 file, packed by gzip where the name ends in `.gz`: to be mended in a voxel editor and read again.

use std::io::Write as _;
use std::path::Path;

use super::IoError;
use super::file::write_bytes;
use crate::geometry::Labels;

const CHOICES: &str = ".nii, .nii.gz";
/// Size of the header, and where the samples begin.
const HEADER: usize = 348;
const OFFSET: usize = 352;
const MILLI: f64 = 1e-3;

/// Whether [`write_labels`] knows this kind of file.
///
/// # Errors
/// [`IoError::Extension`].
pub fn check_labels_target(path: &Path) -> Result<(), IoError> {
    packed(path).map(drop)
}

fn packed(path: &Path) -> Result<bool, IoError> {
    let name = path.file_name().and_then(|n| n.to_str()).unwrap_or("").to_ascii_lowercase();
    match (name.ends_with(".nii"), name.ends_with(".nii.gz")) {
        (false, false) => Err(IoError::Extension { path: path.into(), choices: CHOICES }),
        (_, packed) => Ok(packed),
    }
}

/// Writes labels as unsigned bytes, in millimetres and RAS as NIfTI has it.
///
/// # Errors
/// [`IoError::Extension`], [`IoError::File`]; [`IoError::Unsupported`] for more samples along an axis than 32767.
pub fn write_labels(path: &Path, labels: &Labels) -> Result<(), IoError> {
    let packed = packed(path)?;
    let grid = &labels.grid;
    let mut bytes = vec![0u8; OFFSET];
    let mut put = |at: usize, field: &[u8]| bytes[at..at + field.len()].copy_from_slice(field);
    put(0, &(HEADER as i32).to_le_bytes());
    put(40, &3i16.to_le_bytes());
    for a in 0..7 {
        let n = i16::try_from(grid.dims.get(a).copied().unwrap_or(1)).map_err(|_| IoError::Unsupported {
            path: path.into(),
            found: format!("{} samples along axis {a}", grid.dims[a]),
            advice: "NIfTI-1 holds 32767; bake a part of the scan".into(),
        })?;
        put(42 + 2 * a, &n.to_le_bytes());
    }
    // Unsigned bytes, 8 bits.
    put(70, &2i16.to_le_bytes());
    put(72, &8i16.to_le_bytes());
    put(76, &1f32.to_le_bytes());
    for a in 0..3 {
        put(80 + 4 * a, &((grid.spacing[a] / MILLI) as f32).to_le_bytes());
    }
    put(108, &(OFFSET as f32).to_le_bytes());
    put(112, &1f32.to_le_bytes());
    // Millimetres; places by the affine alone, in the scanner's frame.
    put(123, &[2]);
    put(254, &1i16.to_le_bytes());
    for (row, sign) in [-1.0, -1.0, 1.0].into_iter().enumerate() {
        for a in 0..3 {
            let step = sign * grid.direction[(row, a)] * grid.spacing[a] / MILLI;
            put(280 + 16 * row + 4 * a, &(step as f32).to_le_bytes());
        }
        put(280 + 16 * row + 12, &((sign * grid.origin[row] / MILLI) as f32).to_le_bytes());
    }
    put(344, b"n+1\0");
    bytes.extend_from_slice(&labels.ids);
    if packed {
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        gzip.write_all(&bytes).map_err(IoError::file(path))?;
        bytes = gzip.finish().map_err(IoError::file(path))?;
    }
    write_bytes(path, &bytes)
}
