//! NRRD volumes: header and samples in one file, in two, or in many.
//!
//! Every field of the format is honoured, or changes neither samples nor places and is named in [`HARMLESS`], or the file
//! is refused.
//!
//! Source: G. Kindlmann, "Definition of NRRD File Format", teem.sourceforge.net/nrrd/format.html, version 5.

use std::collections::BTreeMap;
use std::path::Path;

use super::IoError;
use super::ct::{self, Scalar};
use super::file::read_bytes;
use super::gzip::gunzip;
use super::nrrd_files::{Files, Skip, Unpack};
use crate::geometry::Volume;
use crate::math::Vec3;

const MAGIC: &[u8] = b"NRRD000";
/// Versions of the format that are known.
const VERSIONS: std::ops::RangeInclusive<u8> = b'1'..=b'5';
/// Other spellings of fields.
const ALIASES: [(&str, &str); 9] = [
    ("datafile", "data file"),
    ("lineskip", "line skip"),
    ("byteskip", "byte skip"),
    ("blocksize", "block size"),
    ("oldmin", "old min"),
    ("oldmax", "old max"),
    ("sampleunits", "sample units"),
    ("axismins", "axis mins"),
    ("axismaxs", "axis maxs"),
];
/// Fields that are read.
const KNOWN: [&str; 20] = [
    "dimension",
    "sizes",
    "type",
    "encoding",
    "endian",
    "kinds",
    "space",
    "space dimension",
    "space units",
    "space origin",
    "space directions",
    "spacings",
    "units",
    "data file",
    "line skip",
    "byte skip",
    "old min",
    "old max",
    "sample units",
    "axis mins",
];
/// Fields that change neither samples nor their places: names, ranges, what a sample covers (its place is its centre by
/// `space origin`), and the frame of vectors, of which there are none.
const HARMLESS: [&str; 10] = [
    "content",
    "number",
    "min",
    "max",
    "thicknesses",
    "centers",
    "centerings",
    "labels",
    "measurement frame",
    "block size",
];
/// Difference of two statements of a length that passes as rounding of decimals.
const ROUNDING: f64 = 1e-3;

pub(super) fn read(path: &Path, told: &mut Vec<String>) -> Result<Volume, IoError> {
    let bytes = read_bytes(path)?;
    let (header, attached) = Header::parse(path, &bytes)?;
    let space = header.axes()?;
    let scalar = header.scalar()?;
    header.plain_samples()?;
    let dims = space.map(|(_, n)| n);
    let (axes, origin) = header.orientation(space.map(|(axis, _)| axis))?;
    header.tell_what_is_guessed(told);
    let grid = ct::grid(path, dims, axes, origin)?;
    let skip = header.skip()?;
    let encoding = header.get("encoding").to_ascii_lowercase();
    let wanted = grid.len() as u64 * scalar.width() as u64;
    let files = match header.fields.get("data file") {
        None => Files::Here(attached),
        Some(text) => Files::named(path, text, attached)?,
    };
    let one = wanted / files.count();
    let binary = |unpack: &mut Unpack| {
        let little = header.little(scalar)?;
        let bytes = files.gather(path, wanted, unpack)?;
        ct::room(path, grid.len())?;
        Ok::<_, IoError>(scalar.decode(&bytes, little))
    };
    let samples = match encoding.as_str() {
        "raw" => binary(&mut |file, data| skip.bytes(file, skip.lines(file, data)?, one, &files, told))?,
        "gzip" | "gz" => binary(&mut |file, data| {
            let unpacked = gunzip(file, skip.lines(file, data)?, skip.limit(one), told)?;
            skip.bytes(file, &unpacked, one, &files, told)
        })?,
        "hex" => binary(&mut |file, data| hex(file, skip.text(file, data)?))?,
        "ascii" | "text" | "txt" => {
            let mut samples = Vec::new();
            files.each(path, &mut |file, data| {
                let text = String::from_utf8_lossy(skip.text(file, data)?).into_owned();
                let slip = |w: &str| IoError::format(file, "the samples", format!("`{w}`"), "numbers");
                let words = text.split(|c: char| c.is_ascii_whitespace() || c == ',').filter(|w| !w.is_empty());
                for w in words {
                    samples.push(w.parse().map_err(|_| slip(w))?);
                }
                Ok(())
            })?;
            if samples.len() > grid.len() {
                let found = format!("{} numbers", samples.len());
                return Err(IoError::format(path, "the samples", found, &format!("{}, as `sizes` says", grid.len())));
            }
            samples
        }
        other => {
            return Err(IoError::unsupported(
                path,
                format!("NRRD encoding `{other}`"),
                "save it as raw or gzip (for example `unu save -e gzip -f nrrd`)",
            ));
        }
    };
    ct::volume(path, grid, samples)
}

/// Bytes of pairs of hexadecimal digits.
fn hex(path: &Path, text: &[u8]) -> Result<Vec<u8>, IoError> {
    let digits = text.iter().filter(|c| !c.is_ascii_whitespace());
    let values: Option<Vec<u8>> = digits.map(|&c| char::from(c).to_digit(16).map(|d| d as u8)).collect();
    let values = values.filter(|v| v.len() % 2 == 0);
    let values = values
        .ok_or_else(|| IoError::format(path, "the samples", "other characters", "pairs of hexadecimal digits"))?;
    Ok(values.as_chunks::<2>().0.iter().map(|[high, low]| high << 4 | low).collect())
}

struct Header<'a> {
    path: &'a Path,
    fields: BTreeMap<String, String>,
}

impl<'a> Header<'a> {
    /// The fields, and what follows the blank line that ends them.
    fn parse(path: &'a Path, bytes: &'a [u8]) -> Result<(Self, &'a [u8]), IoError> {
        if !(bytes.starts_with(MAGIC) && bytes.get(MAGIC.len()).is_some_and(|v| VERSIONS.contains(v))) {
            let found = String::from_utf8_lossy(&bytes[..bytes.len().min(8)]).into_owned();
            return Err(IoError::format(path, "line 1", format!("{found:?}"), "NRRD0001 .. NRRD0005"));
        }
        let mut header = Self { path, fields: BTreeMap::new() };
        let mut rest = bytes;
        let mut number = 0;
        while let Some(end) = rest.iter().position(|&b| b == b'\n') {
            let line = String::from_utf8_lossy(&rest[..end]).trim_end().to_string();
            rest = &rest[end + 1..];
            number += 1;
            if line.is_empty() {
                return Ok((header, rest));
            }
            let data_file = number > 1 && header.line(&line, number)?;
            // A list of files follows its field up to the end.
            if data_file && header.get("data file").starts_with("LIST") {
                return Ok((header, rest));
            }
        }
        if number > 0 && !rest.is_empty() && header.line(String::from_utf8_lossy(rest).trim_end(), number + 1)? {
            rest = &[];
        }
        if header.fields.contains_key("data file") && rest.is_empty() {
            return Ok((header, &[]));
        }
        Err(IoError::truncated(path, "the NRRD header", bytes.len() as u64 + 1, bytes.len() as u64))
    }

    /// Takes a line in; whether it names the data file.
    fn line(&mut self, line: &str, number: usize) -> Result<bool, IoError> {
        // A pair of key and value is the user's own.
        let pair = line.find(":=").is_some_and(|at| line.find(": ").is_none_or(|field| at < field));
        if line.starts_with('#') || pair {
            return Ok(false);
        }
        let place = format!("line {number}");
        let slip = |found: String, wanted: &str| Err(IoError::format(self.path, &place, found, wanted));
        let Some((key, value)) = line.split_once(": ") else {
            return slip(format!("`{line:.40}`"), "`field: value`, `key:=value` or a comment");
        };
        let key = key.trim().to_ascii_lowercase();
        let key = ALIASES.iter().find(|(alias, _)| *alias == key).map_or(key, |(_, name)| (*name).into());
        if !KNOWN.contains(&key.as_str()) && !HARMLESS.contains(&key.as_str()) && key != "axis maxs" {
            return slip(format!("field `{key}`"), "a field of the format, for others may change what the samples are");
        }
        if self.fields.insert(key.clone(), value.trim().to_string()).is_some() {
            return slip(format!("field `{key}` a second time"), "each field once");
        }
        Ok(key == "data file")
    }

    fn get(&self, key: &str) -> &str {
        self.fields.get(key).map_or("", String::as_str)
    }

    fn slip(&self, key: &str, found: &str, wanted: &str) -> IoError {
        IoError::format(self.path, format!("field `{key}`"), format!("`{found}`"), wanted)
    }

    /// Words of a field, quoted ones without their quotes.
    fn words(&self, key: &str) -> Vec<String> {
        let text = self.get(key);
        if text.contains('"') {
            return text.split('"').skip(1).step_by(2).map(str::to_owned).collect();
        }
        text.split_ascii_whitespace().map(str::to_owned).collect()
    }

    /// The three axes with more than one sample or a direction, and their sizes; others hold one sample.
    fn axes(&self) -> Result<[(usize, usize); 3], IoError> {
        let rank: usize = self.get("dimension").parse().unwrap_or(0);
        let sizes: Option<Vec<usize>> = self.words("sizes").iter().map(|w| w.parse().ok()).collect();
        let sizes = sizes.filter(|s| s.len() == rank && !s.contains(&0)).ok_or_else(|| {
            let wanted = format!("as many positive numbers as `dimension` says (`{}`)", self.get("dimension"));
            self.slip("sizes", self.get("sizes"), &wanted)
        })?;
        let mut axes: Vec<(usize, usize)> = sizes.iter().copied().enumerate().collect();
        while axes.len() > 3
            && let Some(single) = axes.iter().rposition(|(_, n)| *n == 1)
        {
            axes.remove(single);
        }
        let axes: [_; 3] = axes.try_into().map_err(|_| {
            let found = format!("an NRRD of {sizes:?} samples (dimension {rank})");
            IoError::unsupported(self.path, found, "one three-dimensional scalar volume is needed")
        })?;
        let kinds = self.words("kinds");
        if !kinds.is_empty() && kinds.len() != rank {
            return Err(self.slip("kinds", self.get("kinds"), "one kind an axis"));
        }
        let of_space = |kind: &str| matches!(kind.to_ascii_lowercase().as_str(), "domain" | "space" | "none" | "???");
        match axes.iter().filter_map(|(axis, _)| kinds.get(*axis)).find(|kind| !of_space(kind)) {
            Some(kind) => Err(self.slip("kinds", kind, "`space` or `domain` for an axis of a volume")),
            None => Ok(axes),
        }
    }

    fn scalar(&self) -> Result<Scalar, IoError> {
        Ok(match self.get("type").to_ascii_lowercase().as_str() {
            "signed char" | "int8" | "int8_t" => Scalar::I8,
            "uchar" | "unsigned char" | "uint8" | "uint8_t" => Scalar::U8,
            "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => Scalar::I16,
            "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => Scalar::U16,
            "int" | "signed int" | "int32" | "int32_t" => Scalar::I32,
            "uint" | "unsigned int" | "uint32" | "uint32_t" => Scalar::U32,
            "longlong"
            | "long long"
            | "long long int"
            | "signed long long"
            | "signed long long int"
            | "int64"
            | "int64_t" => Scalar::I64,
            "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => Scalar::U64,
            "float" => Scalar::F32,
            "double" => Scalar::F64,
            other => {
                let found = format!("NRRD type `{other}`");
                return Err(IoError::unsupported(self.path, found, "save it as int16 Hounsfield units"));
            }
        })
    }

    /// Byte order, which samples of more than one byte need.
    fn little(&self, scalar: Scalar) -> Result<bool, IoError> {
        match self.get("endian").to_ascii_lowercase().as_str() {
            "little" => Ok(true),
            "big" => Ok(false),
            "" if scalar.width() == 1 => Ok(true),
            found => Err(self.slip("endian", found, "`little` or `big`")),
        }
    }

    /// Samples are values themselves, in no unit but Hounsfield's.
    fn plain_samples(&self) -> Result<(), IoError> {
        for key in ["old min", "old max"] {
            if self.fields.contains_key(key) && !self.get(key).eq_ignore_ascii_case("nan") {
                let found = format!("field `{key}`: the samples were quantised from other values");
                return Err(IoError::unsupported(self.path, found, "save the values themselves (`unu unquantize`)"));
            }
        }
        match self.get("sample units").trim_matches('"').to_ascii_lowercase().as_str() {
            "" | "hu" | "hounsfield" | "hounsfield unit" | "hounsfield units" | "???" => Ok(()),
            found => Err(self.slip("sample units", found, "Hounsfield units (`HU`) or none")),
        }
    }

    fn skip(&self) -> Result<Skip, IoError> {
        let number = |key: &str| match self.get(key) {
            "" => Ok(0),
            text => text.parse::<i64>().map_err(|_| self.slip(key, text, "a whole number")),
        };
        let (lines, bytes) = (number("line skip")?, number("byte skip")?);
        let lines = u64::try_from(lines).map_err(|_| self.slip("line skip", self.get("line skip"), "0 or more"))?;
        if bytes < -1 {
            return Err(self.slip("byte skip", self.get("byte skip"), "-1 (samples at the end), 0 or more"));
        }
        Ok(Skip { lines, bytes })
    }

    /// The numbers of a vector such as `(1,0,0)`.
    fn vector(&self, key: &str, text: &str) -> Result<Vec3, IoError> {
        let inner = text.trim().strip_prefix('(').and_then(|t| t.strip_suffix(')'));
        let parsed = inner.map(|t| t.split(',').map(|w| w.trim().parse().ok()).collect::<Option<Vec<f64>>>());
        let three = parsed.flatten().and_then(|v| <[f64; 3]>::try_from(v).ok());
        three.map(Vec3::from).ok_or_else(|| self.slip(key, text, "three numbers a vector, such as (1,0,0)"))
    }

    /// Says where the volume lies by no word of its own.
    fn tell_what_is_guessed(&self, told: &mut Vec<String>) {
        if self.get("space origin").is_empty() {
            told.push("no `space origin`: the first voxel is taken to lie at (0, 0, 0)".into());
        }
    }

    /// Steps of these axes and position of the first voxel in LPS millimetres.
    fn orientation(&self, space: [usize; 3]) -> Result<([Vec3; 3], Vec3), IoError> {
        let sign = match self.get("space").to_ascii_lowercase().as_str() {
            "left-posterior-superior" | "lps" => Vec3::new(1.0, 1.0, 1.0),
            "right-anterior-superior" | "ras" => Vec3::new(-1.0, -1.0, 1.0),
            "left-anterior-superior" | "las" => Vec3::new(1.0, -1.0, 1.0),
            found => {
                let found = format!("NRRD space `{}`", if found.is_empty() { "none" } else { found });
                let advice = "left and right cannot be told: save it in LPS, RAS or LAS";
                return Err(IoError::unsupported(self.path, found, advice));
            }
        };
        let text = self.get("space directions");
        let mut rest = text;
        let mut axes = Vec::new();
        while !rest.trim().is_empty() {
            rest = rest.trim_start();
            if let Some(after) = rest.strip_prefix("none") {
                axes.push(None);
                rest = after;
            } else {
                let end = rest.find(')').map_or(rest.len(), |p| p + 1);
                axes.push(Some(self.vector("space directions", &rest[..end])?));
                rest = &rest[end..];
            }
        }
        let mut steps = [Vec3::zeros(); 3];
        for (step, axis) in steps.iter_mut().zip(space) {
            let found = axes.get(axis).copied().flatten();
            *step = found.ok_or_else(|| self.slip("space directions", text, "a vector for each axis of the volume"))?;
        }
        if axes.len().to_string() != self.get("dimension") {
            return Err(self.slip("space directions", text, "as many vectors as `dimension` says"));
        }
        if !matches!(self.get("space dimension"), "" | "3") {
            return Err(self.slip("space dimension", self.get("space dimension"), "3"));
        }
        self.given_once(space, &steps)?;
        let origin = match self.get("space origin") {
            "" => Vec3::zeros(),
            text => self.vector("space origin", text)?,
        };
        let mm = self.unit("space units")?.unwrap_or(1.0);
        let lps = |v: Vec3| sign.component_mul(&v) * mm;
        Ok((steps.map(lps), lps(origin)))
    }

    /// Lengths and places that are given beside the directions, which say all, agree with them.
    fn given_once(&self, space: [usize; 3], steps: &[Vec3; 3]) -> Result<(), IoError> {
        let numbers = |key: &str| {
            let parsed: Option<Vec<f64>> = self.words(key).iter().map(|w| w.parse().ok()).collect();
            parsed.ok_or_else(|| self.slip(key, self.get(key), "one number an axis"))
        };
        let given = numbers("spacings")?;
        for (axis, step) in space.into_iter().zip(steps) {
            let Some(&spacing) = given.get(axis).filter(|s| !s.is_nan()) else { continue };
            if (spacing.abs() - step.norm()).abs() > ROUNDING * step.norm() {
                let wanted = format!("{} as `space directions` say of axis {}", step.norm(), axis + 1);
                return Err(self.slip("spacings", &spacing.to_string(), &wanted));
            }
        }
        for key in ["axis mins", "axis maxs"] {
            if numbers(key)?.iter().any(|v| !v.is_nan()) {
                return Err(self.slip(key, self.get(key), "none beside `space directions` and `space origin`"));
            }
        }
        let (axes, of_space) = (self.unit("units")?, self.unit("space units")?);
        if axes.is_some_and(|mm| mm != of_space.unwrap_or(1.0)) {
            return Err(self.slip("units", self.get("units"), "the same as `space units` (without them, mm)"));
        }
        Ok(())
    }

    /// Millimetres in the unit of length of a field, if it names one.
    fn unit(&self, key: &str) -> Result<Option<f64>, IoError> {
        let mut found = None;
        for word in self.words(key).iter().filter(|w| !matches!(w.trim(), "" | "???" | "none")) {
            let mm = match word.trim() {
                "mm" | "millimeter" | "millimetre" | "millimeters" | "millimetres" => 1.0,
                "cm" => 10.0,
                "m" | "meter" | "metre" => 1e3,
                "um" | "µm" | "micron" => 1e-3,
                "in" | "inch" => 25.4,
                _ => return Err(self.slip(key, word, "mm, cm, m or um")),
            };
            if found.is_some_and(|other| other != mm) {
                return Err(self.slip(key, self.get(key), "one unit for all axes"));
            }
            found = Some(mm);
        }
        Ok(found)
    }
}
