//! Marker segments of JPEG and JPEG-LS streams.
//!
//! Source: ITU-T T.81, 1992, annex B.

/// A segment: its marker's second byte, what it holds, and all that stands behind it.
pub(super) struct Segment<'a> {
    pub marker: u8,
    pub content: &'a [u8],
    pub behind: &'a [u8],
}

/// The segments between the start of an image and its end.
pub(super) struct Segments<'a>(&'a [u8]);

impl<'a> Segments<'a> {
    pub fn new(data: &'a [u8]) -> Result<Self, String> {
        data.strip_prefix(&[0xFF, 0xD8])
            .map(Self)
            .ok_or_else(|| format!("{:02x?} instead of a JPEG stream", &data[..data.len().min(2)]))
    }
}

impl<'a> Iterator for Segments<'a> {
    type Item = Result<Segment<'a>, String>;

    fn next(&mut self) -> Option<Self::Item> {
        // Bytes of ones may fill the place before a marker.
        while self.0.starts_with(&[0xFF, 0xFF]) {
            self.0 = &self.0[1..];
        }
        let &[0xFF, marker, high, low, ref rest @ ..] = self.0 else { return None };
        if marker == 0xD9 {
            return None;
        }
        let length = usize::from(u16::from_be_bytes([high, low]));
        match length.checked_sub(2).and_then(|n| rest.split_at_checked(n)) {
            Some((content, behind)) => {
                self.0 = behind;
                Some(Ok(Segment { marker, content, behind }))
            }
            None => {
                self.0 = &[];
                Some(Err(format!("segment {marker:#04x} is cut off")))
            }
        }
    }
}
