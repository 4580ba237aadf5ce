//! Gzip streams, one behind the other, and what stands behind the last.

use std::io::Read;
use std::path::Path;

use super::IoError;

/// Deflate's best ratio: what bounds an unpacked size from the packed one.
const MOST_INFLATION: u64 = 1032;
const MARK: [u8; 2] = [0x1f, 0x8b];

pub(super) fn is_gzip(bytes: &[u8]) -> bool {
    bytes.starts_with(&MARK)
}

/// Unpacks gzip, but never more than `limit` bytes nor more than the packed bytes can hold. Zeros behind the stream are
/// padding (tapes, block devices); other bytes are passed over and told.
pub(super) fn gunzip(path: &Path, packed: &[u8], limit: u64, told: &mut Vec<String>) -> Result<Vec<u8>, IoError> {
    let mut out = Vec::new();
    let mut rest = packed;
    loop {
        let left = limit.saturating_sub(out.len() as u64).min((rest.len() as u64).saturating_mul(MOST_INFLATION));
        let mut member = flate2::bufread::GzDecoder::new(rest).take(left);
        match member.read_to_end(&mut out) {
            Ok(_) => {}
            Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
                return Err(IoError::truncated(path, "the gzip stream", packed.len() as u64 + 1, packed.len() as u64));
            }
            Err(e) => return Err(IoError::format(path, "the gzip stream", e.to_string(), "gzip data")),
        }
        if out.len() as u64 >= limit {
            return Ok(out);
        }
        rest = member.into_inner().into_inner();
        if !is_gzip(rest) {
            break;
        }
    }
    if rest.iter().any(|&b| b != 0) {
        told.push(format!("{} bytes behind the gzip stream were passed over", rest.len()));
    }
    Ok(out)
}
