//! Where the samples of an NRRD stand: behind the header, in a file, or in a row of files, and behind what in each.

use std::path::{Path, PathBuf};

use super::IoError;
use super::file::read_bytes;

/// Files that a header may name.
const MOST_FILES: usize = 100_000;

/// Takes the bytes of a file.
type Take<'a> = dyn FnMut(&Path, &[u8]) -> Result<(), IoError> + 'a;
/// Makes samples' bytes of those of a file.
pub(super) type Unpack<'a> = dyn FnMut(&Path, &[u8]) -> Result<Vec<u8>, IoError> + 'a;

/// What to leave out at the beginning of each file.
pub(super) struct Skip {
    /// Lines, before anything is unpacked.
    pub lines: u64,
    /// Bytes, behind the lines and once unpacked; -1 where the samples end with the file.
    pub bytes: i64,
}

impl Skip {
    pub fn lines<'a>(&self, path: &Path, mut data: &'a [u8]) -> Result<&'a [u8], IoError> {
        for _ in 0..self.lines {
            let end = data.iter().position(|&b| b == b'\n').ok_or_else(|| {
                IoError::format(path, "field `line skip`", "fewer lines", &format!("{} lines to skip", self.lines))
            })?;
            data = &data[end + 1..];
        }
        Ok(data)
    }

    /// Text behind lines and bytes.
    pub fn text<'a>(&self, path: &Path, data: &'a [u8]) -> Result<&'a [u8], IoError> {
        let data = self.lines(path, data)?;
        match usize::try_from(self.bytes) {
            Ok(n) => data
                .get(n..)
                .ok_or_else(|| IoError::truncated(path, "what `byte skip` skips", n as u64, data.len() as u64)),
            Err(_) => Err(IoError::format(path, "field `byte skip`", "-1", "0 or more in an encoding as text")),
        }
    }

    /// Bytes to unpack until it is sure whether more follow than `wanted` ones.
    pub fn limit(&self, wanted: u64) -> u64 {
        u64::try_from(self.bytes).map_or(u64::MAX, |skip| wanted.saturating_add(skip).saturating_add(1))
    }

    /// `wanted` bytes of what is unpacked and behind the lines. Bytes behind them are told; in one of many files they
    /// may be samples.
    pub fn bytes(
        &self,
        path: &Path,
        data: &[u8],
        wanted: u64,
        files: &Files,
        told: &mut Vec<String>,
    ) -> Result<Vec<u8>, IoError> {
        let there = data.len() as u64;
        let begin = match u64::try_from(self.bytes) {
            Ok(n) => n,
            Err(_) => {
                there.checked_sub(wanted).ok_or_else(|| IoError::truncated(path, "the samples", wanted, there))?
            }
        };
        let end = begin.saturating_add(wanted);
        if end > there {
            return Err(IoError::truncated(path, "the samples", end, there));
        }
        // A line end behind the samples is how text editors and some writers close a file.
        if data[end as usize..].iter().any(|b| !matches!(b, 0 | b'\n' | b'\r')) {
            if files.count() > 1 {
                let wanted = format!("{wanted}, its share of {} files", files.count());
                return Err(IoError::format(path, "the samples", format!("{} bytes", there - begin), &wanted));
            }
            told.push(format!("bytes behind the samples in {} were passed over", path.display()));
        }
        Ok(data[begin as usize..end as usize].to_vec())
    }
}

/// The files with the samples, in order.
pub(super) enum Files<'a> {
    /// Behind the header.
    Here(&'a [u8]),
    /// Elsewhere.
    There(Vec<PathBuf>),
}

impl<'a> Files<'a> {
    /// What the field `data file` says; `behind` it stands a list.
    pub fn named(header: &Path, text: &str, behind: &[u8]) -> Result<Self, IoError> {
        let slip = |wanted: &str| IoError::format(header, "field `data file`", format!("`{text}`"), wanted);
        let beside = |name: &str| header.with_file_name(name);
        if text == "LIST" || text.starts_with("LIST ") {
            let list = String::from_utf8_lossy(behind);
            let files: Vec<PathBuf> = list.lines().map(str::trim).filter(|l| !l.is_empty()).map(beside).collect();
            return if files.is_empty() {
                Err(slip("file names behind it, one a line"))
            } else {
                Ok(Self::There(files))
            };
        }
        if !text.contains('%') {
            return Ok(Self::There(vec![beside(text)]));
        }
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        let wanted = "a pattern with one %d, then its first and last number and the step: CT%03d.raw 1 94 1";
        let [pattern, numbers @ ..] = words.as_slice() else { return Err(slip(wanted)) };
        let numbers: Option<Vec<i64>> = numbers.iter().map(|w| w.parse().ok()).collect();
        let (first, last, step) = match numbers.as_deref() {
            Some([first, last, step] | [first, last, step, _]) if *step != 0 => (*first, *last, *step),
            _ => return Err(slip(wanted)),
        };
        let mut files = Vec::new();
        let mut k = first;
        while if step > 0 { k <= last } else { k >= last } {
            files.push(beside(&fill(pattern, k).ok_or_else(|| slip(wanted))?));
            if files.len() > MOST_FILES {
                return Err(slip(&format!("at most {MOST_FILES} files")));
            }
            k = k.saturating_add(step);
        }
        if files.is_empty() { Err(slip(wanted)) } else { Ok(Self::There(files)) }
    }

    pub fn count(&self) -> u64 {
        if let Self::There(files) = self { files.len() as u64 } else { 1 }
    }

    /// Hands each file's bytes on, in order.
    pub fn each(&self, header: &Path, take: &mut Take) -> Result<(), IoError> {
        match self {
            Self::Here(data) => take(header, data),
            Self::There(files) => files.iter().try_for_each(|file| take(file, &read_bytes(file)?)),
        }
    }

    /// `wanted` bytes in all, the same number from each file as `read` makes it.
    pub fn gather(&self, header: &Path, wanted: u64, read: &mut Unpack) -> Result<Vec<u8>, IoError> {
        if !wanted.is_multiple_of(self.count()) {
            let found = format!("{} files", self.count());
            return Err(IoError::format(header, "field `data file`", found, "the same number of samples in each file"));
        }
        let mut all = Vec::new();
        self.each(header, &mut |file, data| {
            all.append(&mut read(file, data)?);
            Ok(())
        })?;
        if all.len() as u64 != wanted {
            return Err(IoError::truncated(header, "the samples", wanted, all.len() as u64));
        }
        Ok(all)
    }
}

/// A file's name: its number in place of `%d`, `%3d` or `%03d`.
fn fill(pattern: &str, number: i64) -> Option<String> {
    let (before, rest) = pattern.split_once('%')?;
    let (width, after) = rest.split_once('d')?;
    let zeros = width.starts_with('0');
    let width: usize = if width.is_empty() { 0 } else { width.parse().ok().filter(|w| *w < 100)? };
    let number = if zeros { format!("{number:0width$}") } else { format!("{number:width$}") };
    (!after.contains('%')).then(|| format!("{before}{number}{after}"))
}
