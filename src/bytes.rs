//! Little-endian bytes out and in, for the baked model and the saved state.
#![forbid(unsafe_code)]

/// The bytes ended, or a count is larger than what is left.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the data end at byte {at}: {wanted} more bytes were wanted, {left} are left")]
pub struct Truncated {
    /// Where the read began.
    pub at: usize,
    /// Bytes wanted.
    pub wanted: usize,
    /// Bytes left.
    pub left: usize,
}

/// Appends numbers and lists to a byte vector.
#[derive(Debug, Default)]
pub struct Writer(pub Vec<u8>);

impl Writer {
    /// Appends raw bytes.
    pub fn raw(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }
    /// Appends an unsigned 32-bit number.
    pub fn u32(&mut self, value: u32) {
        self.raw(&value.to_le_bytes());
    }
    /// Appends a count or size as 64 bits.
    pub fn len(&mut self, value: usize) {
        self.raw(&(value as u64).to_le_bytes());
    }
    /// Appends a 64-bit float.
    pub fn f64(&mut self, value: f64) {
        self.raw(&value.to_le_bytes());
    }
    /// Appends a text with its length.
    pub fn text(&mut self, text: &str) {
        self.len(text.len());
        self.raw(text.as_bytes());
    }
    /// Appends unsigned 32-bit numbers with their count.
    pub fn u32s(&mut self, values: &[u32]) {
        self.len(values.len());
        values.iter().for_each(|v| self.u32(*v));
    }
    /// Appends 64-bit floats with their count.
    pub fn f64s(&mut self, values: impl ExactSizeIterator<Item = f64>) {
        self.len(values.len());
        values.for_each(|v| self.f64(v));
    }
}

/// Takes numbers and lists off a byte slice; a lying count is refused before anything is allocated.
#[derive(Debug)]
pub struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    /// Reads from the first byte on.
    pub fn new(bytes: &'a [u8]) -> Self {
        Reader { bytes, at: 0 }
    }
    /// Bytes not read yet.
    pub fn left(&self) -> usize {
        self.bytes.len() - self.at
    }
    /// The next `n` bytes.
    ///
    /// # Errors
    /// [`Truncated`], as for every method here.
    pub fn raw(&mut self, n: usize) -> Result<&'a [u8], Truncated> {
        if n > self.left() {
            return Err(Truncated { at: self.at, wanted: n, left: self.left() });
        }
        self.at += n;
        Ok(&self.bytes[self.at - n..self.at])
    }
    fn array<const N: usize>(&mut self) -> Result<[u8; N], Truncated> {
        Ok(self.raw(N)?.try_into().expect("raw returns as many bytes as asked"))
    }
    /// An unsigned 32-bit number.
    pub fn u32(&mut self) -> Result<u32, Truncated> {
        Ok(u32::from_le_bytes(self.array()?))
    }
    /// A 64-bit float.
    pub fn f64(&mut self) -> Result<f64, Truncated> {
        Ok(f64::from_le_bytes(self.array()?))
    }
    /// A count of items of `size` bytes each, of which that many must follow.
    pub fn len(&mut self, size: usize) -> Result<usize, Truncated> {
        let n = u64::from_le_bytes(self.array()?);
        let wanted = usize::try_from(n).ok().and_then(|n| n.checked_mul(size)).unwrap_or(usize::MAX);
        if wanted > self.left() {
            return Err(Truncated { at: self.at, wanted, left: self.left() });
        }
        Ok(n as usize)
    }
    /// A text; bytes that are not UTF-8 are replaced.
    pub fn text(&mut self) -> Result<String, Truncated> {
        let n = self.len(1)?;
        Ok(String::from_utf8_lossy(self.raw(n)?).into_owned())
    }
    /// Unsigned 32-bit numbers with their count.
    pub fn u32s(&mut self) -> Result<Vec<u32>, Truncated> {
        (0..self.len(4)?).map(|_| self.u32()).collect()
    }
    /// 64-bit floats with their count.
    pub fn f64s(&mut self) -> Result<Vec<f64>, Truncated> {
        (0..self.len(8)?).map(|_| self.f64()).collect()
    }
}
