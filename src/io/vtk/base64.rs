//! Base64 as VTK writes it: several padded pieces may follow each other.
//!
//! Source: RFC 4648, S. Josefsson, "The Base16, Base32, and Base64 Data Encodings", 2006, section 4.

/// Decodes the first `n` bytes, or as many as there are; blanks are skipped, padding ends a piece, not the text.
/// `None` at a character that is not base64.
pub(super) fn prefix(text: &[u8], n: usize) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(n.min(text.len() / 4 * 3 + 3));
    let mut quad = [0u8; 4];
    let mut filled = 0;
    let mut padding = 0;
    for &c in text.iter().filter(|c| !c.is_ascii_whitespace()) {
        if out.len() >= n {
            break;
        }
        quad[filled] = if c == b'=' { 0 } else { digit(c)? };
        padding += usize::from(c == b'=');
        filled += 1;
        if filled == 4 {
            let word = quad.iter().fold(0u32, |w, &d| w << 6 | u32::from(d));
            out.extend_from_slice(&word.to_be_bytes()[1..4 - padding.min(2)]);
            (filled, padding) = (0, 0);
        }
    }
    out.truncate(n);
    Some(out)
}

fn digit(c: u8) -> Option<u8> {
    match c {
        b'A'..=b'Z' => Some(c - b'A'),
        b'a'..=b'z' => Some(c - b'a' + 26),
        b'0'..=b'9' => Some(c - b'0' + 52),
        b'+' => Some(62),
        b'/' => Some(63),
        _ => None,
    }
}
