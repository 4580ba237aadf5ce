//! NRRD volumes, attached or detached, raw, gzip or text.
//!
//! Source: G. Kindlmann, "Definition of NRRD File Format", teem.sourceforge.net/nrrd/format.html, version 5.

use std::collections::BTreeMap;
use std::path::Path;

use super::IoError;
use super::ct::{self, Scalar};
use crate::geometry::Volume;
use crate::math::Vec3;

type Fields = BTreeMap<String, String>;

pub(super) fn read(path: &Path) -> Result<Volume, IoError> {
    let bytes = std::fs::read(path).map_err(IoError::file(path))?;
    let (fields, attached) = header(path, &bytes)?;
    let get = |key: &str| fields.get(key).map_or("", String::as_str);
    if get("dimension") != "3" {
        let found = format!("an NRRD of dimension `{}`", get("dimension"));
        return Err(IoError::unsupported(path, found, "one three-dimensional scalar volume is needed"));
    }
    let dims = numbers::<usize>(path, &fields, "sizes")?;
    let scalar = scalar(path, get("type"))?;
    let (axes, origin) = orientation(path, &fields)?;
    let grid = ct::grid(path, dims, axes, origin)?;
    let wanted = dims.iter().fold(scalar.width() as u64, |n, &d| n.saturating_mul(d as u64));
    let outside;
    let data = match fields.get("data file").or(fields.get("datafile")) {
        None => attached,
        Some(name) if name.starts_with("LIST") || name.contains('%') => {
            return Err(IoError::unsupported(path, "samples spread over several files", "save it as one .nrrd"));
        }
        Some(name) => {
            let file = path.with_file_name(name);
            // A header may name anything, also a device that never ends.
            if !std::fs::metadata(&file).map_err(IoError::file(&file))?.is_file() {
                let found = format!("a `data file` that is no file: {}", file.display());
                return Err(IoError::unsupported(path, found, "name the file that holds the samples"));
            }
            outside = std::fs::read(&file).map_err(IoError::file(&file))?;
            &outside[..]
        }
    };
    let samples = match get("encoding") {
        "raw" => decode(path, scalar, data, wanted, get("endian"))?,
        "gzip" | "gz" => decode(path, scalar, &ct::gunzip(path, data, wanted)?, wanted, get("endian"))?,
        "ascii" | "text" | "txt" => {
            let text = String::from_utf8_lossy(data);
            let slip = |w: &str| IoError::format(path, "the samples", format!("`{w}`"), "numbers");
            let words = text.split(|c: char| c.is_ascii_whitespace() || c == ',').filter(|w| !w.is_empty());
            words.map(|w| w.parse().map_err(|_| slip(w))).collect::<Result<_, _>>()?
        }
        other => {
            return Err(IoError::unsupported(path, format!("NRRD encoding `{other}`"), "save it as raw or gzip"));
        }
    };
    ct::volume(path, grid, samples)
}

fn decode(path: &Path, scalar: Scalar, data: &[u8], wanted: u64, endian: &str) -> Result<Vec<f32>, IoError> {
    match data.get(..usize::try_from(wanted).unwrap_or(usize::MAX)) {
        Some(data) => Ok(scalar.decode(data, endian != "big")),
        None => Err(IoError::truncated(path, "the samples", wanted, data.len() as u64)),
    }
}

/// The fields, and what follows the blank line that ends them.
fn header<'a>(path: &Path, bytes: &'a [u8]) -> Result<(Fields, &'a [u8]), IoError> {
    if !bytes.starts_with(b"NRRD000") {
        let found = String::from_utf8_lossy(&bytes[..bytes.len().min(8)]).into_owned();
        return Err(IoError::format(path, "line 1", format!("{found:?}"), "NRRD0001 .. NRRD0005"));
    }
    let mut fields = Fields::new();
    let mut rest = bytes;
    while let Some(end) = rest.iter().position(|&b| b == b'\n') {
        let line = String::from_utf8_lossy(&rest[..end]).trim_end().to_string();
        rest = &rest[end + 1..];
        if line.is_empty() {
            return Ok((fields, rest));
        }
        if let Some((key, value)) = line.split_once(": ").filter(|_| !line.starts_with('#')) {
            fields.insert(key.trim().to_ascii_lowercase(), value.trim().to_string());
        }
    }
    if fields.contains_key("data file") || fields.contains_key("datafile") {
        return Ok((fields, &[]));
    }
    Err(IoError::truncated(path, "the NRRD header", bytes.len() as u64 + 1, bytes.len() as u64))
}

fn scalar(path: &Path, name: &str) -> Result<Scalar, IoError> {
    Ok(match name {
        "signed char" | "int8" | "int8_t" => Scalar::I8,
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => Scalar::U8,
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => Scalar::I16,
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => Scalar::U16,
        "int" | "signed int" | "int32" | "int32_t" => Scalar::I32,
        "uint" | "unsigned int" | "uint32" | "uint32_t" => Scalar::U32,
        "float" => Scalar::F32,
        "double" => Scalar::F64,
        other => {
            return Err(IoError::unsupported(
                path,
                format!("NRRD type `{other}`"),
                "save it as int16 Hounsfield units",
            ));
        }
    })
}

fn numbers<T: std::str::FromStr>(path: &Path, fields: &Fields, key: &str) -> Result<[T; 3], IoError> {
    let text = fields.get(key).map_or("", String::as_str);
    let words = text.trim_matches(['(', ')']).split(|c: char| c == ',' || c.is_ascii_whitespace());
    let parsed: Option<Vec<T>> = words.filter(|w| !w.is_empty()).map(|w| w.parse().ok()).collect();
    let parsed = parsed.and_then(|v| <[T; 3]>::try_from(v).ok());
    parsed.ok_or_else(|| IoError::format(path, format!("field `{key}`"), format!("`{text}`"), "three numbers"))
}

/// Steps of the axes and position of the first voxel in LPS millimetres.
fn orientation(path: &Path, fields: &Fields) -> Result<([Vec3; 3], Vec3), IoError> {
    let sign = match fields.get("space").map(|s| s.to_ascii_lowercase()).as_deref() {
        Some("left-posterior-superior" | "lps") => Vec3::new(1.0, 1.0, 1.0),
        Some("right-anterior-superior" | "ras") => Vec3::new(-1.0, -1.0, 1.0),
        Some("left-anterior-superior" | "las") => Vec3::new(1.0, -1.0, 1.0),
        found => {
            let found = format!("NRRD space `{}`", found.unwrap_or("none"));
            return Err(IoError::unsupported(path, found, "left and right cannot be told: save it in LPS, RAS or LAS"));
        }
    };
    let directions = fields.get("space directions").map_or("", String::as_str);
    let mut axes = [Vec3::zeros(); 3];
    let mut vectors = directions.split(')').map(|v| v.trim().to_string() + ")");
    for axis in &mut axes {
        let one = Fields::from([("space directions".to_string(), vectors.next().unwrap_or_default())]);
        *axis = sign.component_mul(&Vec3::from(numbers::<f64>(path, &one, "space directions")?));
    }
    let origin = match fields.contains_key("space origin") {
        true => Vec3::from(numbers::<f64>(path, fields, "space origin")?),
        false => Vec3::zeros(),
    };
    Ok((axes, sign.component_mul(&origin)))
}
