//! Words of a text file, with the line they stand on.

use std::path::Path;
use std::str::FromStr;

use super::IoError;

/// A cursor over the words of a text file.
pub(crate) struct Words<'a> {
    path: &'a Path,
    rest: &'a str,
    line: usize,
}

impl<'a> Words<'a> {
    /// At the beginning, behind a byte-order mark.
    pub fn new(path: &'a Path, text: &'a str) -> Self {
        Self { path, rest: text.trim_start_matches('\u{feff}'), line: 1 }
    }

    fn skip_blank(&mut self) {
        let trimmed = self.rest.trim_ascii_start();
        let skipped = &self.rest[..self.rest.len() - trimmed.len()];
        self.line += skipped.bytes().filter(|&b| b == b'\n').count();
        self.rest = trimmed;
    }

    /// The next word, if there is one.
    pub fn word(&mut self) -> Option<&'a str> {
        self.skip_blank();
        let end = self.rest.find(|c: char| c.is_ascii_whitespace()).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        (!word.is_empty()).then_some(word)
    }

    /// The next word without passing it.
    pub fn peek(&mut self) -> Option<&'a str> {
        let (rest, line) = (self.rest, self.line);
        let word = self.word();
        (self.rest, self.line) = (rest, line);
        word
    }

    /// What is left of the current line; passes its end.
    pub fn line(&mut self) -> Option<&'a str> {
        if self.rest.is_empty() {
            return None;
        }
        let (line, rest) = self.rest.split_once('\n').unwrap_or((self.rest, ""));
        self.rest = rest;
        self.line += 1;
        Some(line.trim_ascii())
    }

    /// The next word, which must be there.
    pub fn need(&mut self, wanted: &str) -> Result<&'a str, IoError> {
        self.word().ok_or_else(|| self.slip("the end of the file", wanted))
    }

    /// The next word as a number.
    pub fn parse<T: FromStr>(&mut self, wanted: &str) -> Result<T, IoError> {
        let word = self.need(wanted)?;
        word.parse().map_err(|_| self.slip(&format!("`{word}`"), wanted))
    }

    /// A count of things that each take at least one character and a blank: never more than the file can hold.
    pub fn count(&mut self, wanted: &str) -> Result<usize, IoError> {
        let count: usize = self.parse(wanted)?;
        if count > self.rest.len() {
            return Err(IoError::truncated(self.path, wanted, count as u64, self.rest.len() as u64));
        }
        Ok(count)
    }

    /// A slip at the current line.
    pub fn slip(&self, found: &str, wanted: &str) -> IoError {
        IoError::format(self.path, format!("line {}", self.line), found, wanted)
    }
}

/// Shortest text that reads back to the same bits.
pub(crate) fn exact(value: f64) -> String {
    if value == 0.0 || (1e-5..1e17).contains(&value.abs()) { format!("{value}") } else { format!("{value:e}") }
}
