//! DICOM's run-length coding: bytes of a sample in segments, the most significant first, each packed by runs.
//!
//! Source: DICOM PS3.5 2024, annex G.

/// Header: number of segments and their beginnings.
const HEADER: usize = 64;

/// Bits of each of `n` samples of `width` bytes.
pub(super) fn decode(data: &[u8], n: usize, width: usize) -> Result<Vec<u32>, String> {
    let word = |k: usize| data.get(4 * k..4 * k + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    if data.len() < HEADER || word(0) != Some(width) {
        return Err(format!("{} run-length segments instead of {width}", word(0).unwrap_or(0)));
    }
    let mut out = vec![0u32; n];
    for k in 0..width {
        let begin = word(k + 1).filter(|&b| b >= HEADER);
        let end = if k + 1 < width { word(k + 2) } else { Some(data.len()) };
        let segment = begin.zip(end).and_then(|(b, e)| data.get(b..e)).ok_or("run-length segments out of order")?;
        unpack(segment, &mut out)?;
    }
    Ok(out)
}

/// Moves each sample up by a byte and adds the segment's.
fn unpack(mut segment: &[u8], out: &mut [u32]) -> Result<(), String> {
    let mut at = 0;
    let short = || "a run-length segment that ends early".to_string();
    while at < out.len() {
        let (&head, rest) = segment.split_first().ok_or_else(short)?;
        // -128 does nothing; other negative numbers repeat a byte, positive ones announce bytes as they are.
        let (count, repeated) = match head as i8 {
            -128 => (0, true),
            n if n < 0 => (1 + usize::from(n.unsigned_abs()), true),
            n => (1 + n as usize, false),
        };
        let used = if count == 0 {
            0
        } else if repeated {
            1
        } else {
            count
        };
        let bytes = rest.get(..used).ok_or_else(short)?;
        let end = (at + count).min(out.len());
        for (k, sample) in out[at..end].iter_mut().enumerate() {
            *sample = *sample << 8 | u32::from(bytes[if repeated { 0 } else { k }]);
        }
        at = end;
        segment = &rest[used..];
    }
    Ok(())
}
