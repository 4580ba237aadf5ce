//! Lossless JPEG, one component of 2 to 16 bits, Huffman-coded.
//!
//! Source: ITU-T T.81 (ISO/IEC 10918-1), 1992, annexes B (markers), C and F.2.2 (Huffman codes), H (lossless mode).

use super::markers::{Segment, Segments};

/// Bits of a Huffman code at most.
const LONGEST: usize = 16;
/// Category of a difference of 32768, which has no further bits.
const WHOLE: u8 = 16;

/// Codes of a table: for each length the first code, how many there are, and the place of the first value.
struct Huffman {
    first: [u32; LONGEST + 1],
    count: [u32; LONGEST + 1],
    place: [usize; LONGEST + 1],
    values: Vec<u8>,
}

impl Huffman {
    /// A table and the bytes behind it.
    fn parse(bytes: &[u8]) -> Option<(Self, &[u8])> {
        let (counts, rest) = bytes.split_at_checked(LONGEST)?;
        let mut table = Self { first: [0; 17], count: [0; 17], place: [0; 17], values: Vec::new() };
        let (mut code, mut place) = (0u32, 0usize);
        for length in 1..=LONGEST {
            code <<= 1;
            table.first[length] = code;
            table.count[length] = counts[length - 1].into();
            table.place[length] = place;
            code += table.count[length];
            place += table.count[length] as usize;
        }
        let (values, rest) = rest.split_at_checked(place)?;
        table.values = values.to_vec();
        Some((table, rest))
    }

    fn value(&self, bits: &mut Bits) -> Option<u8> {
        let mut code = 0;
        for length in 1..=LONGEST {
            code = code << 1 | bits.take(1)?;
            if let Some(k) = code.checked_sub(self.first[length]).filter(|&k| k < self.count[length]) {
                return self.values.get(self.place[length] + k as usize).copied();
            }
        }
        None
    }
}

/// Bits of an entropy-coded segment: a zero follows each byte of ones, anything else is a marker.
struct Bits<'a> {
    bytes: &'a [u8],
    buffer: u32,
    held: u32,
}

impl Bits<'_> {
    fn take(&mut self, n: u32) -> Option<u32> {
        while self.held < n {
            let (&byte, rest) = self.bytes.split_first()?;
            self.bytes = match (byte, rest) {
                (0xFF, [0, rest @ ..]) => rest,
                (0xFF, _) => return None,
                (_, rest) => rest,
            };
            self.buffer = self.buffer << 8 | u32::from(byte);
            self.held += 8;
        }
        self.held -= n;
        Some(self.buffer >> self.held & ((1 << n) - 1))
    }

    /// Goes on behind the next restart marker.
    fn restart(&mut self) -> Option<()> {
        (self.buffer, self.held) = (0, 0);
        match self.bytes {
            [0xFF, 0xD0..=0xD7, rest @ ..] => {
                self.bytes = rest;
                Some(())
            }
            _ => None,
        }
    }
}

/// Bits of each sample of a picture of `size` (columns, rows).
pub(super) fn decode(data: &[u8], size: [usize; 2]) -> Result<Vec<u32>, String> {
    let mut tables: [Option<Huffman>; 4] = [const { None }; 4];
    let mut precision = None;
    let mut restart = 0;
    for segment in Segments::new(data)? {
        let Segment { marker, content, behind } = segment?;
        match marker {
            0xC3 => precision = Some(frame(content, size)?),
            0xC4 => {
                let mut rest = content;
                while let Some((&kind, bytes)) = rest.split_first() {
                    let (table, after) = Huffman::parse(bytes).ok_or("a Huffman table that ends early")?;
                    if kind > 3 {
                        return Err(format!("Huffman table {kind:#04x}, where lossless JPEG has 0 to 3"));
                    }
                    tables[usize::from(kind)] = Some(table);
                    rest = after;
                }
            }
            0xDD => {
                restart = usize::from(u16::from_be_bytes(content.try_into().map_err(|_| "a damaged restart interval")?))
            }
            0xDA => {
                let precision = precision.ok_or("a scan before its frame")?;
                let &[1, _, table, predictor, _, shifts] = content else {
                    return Err("a scan of several components".into());
                };
                let table = tables
                    .get(usize::from(table >> 4))
                    .and_then(Option::as_ref)
                    .ok_or("a scan without its Huffman table")?;
                let scan = Scan { table, predictor, shift: u32::from(shifts & 15), precision, restart };
                return scan.decode(behind, size);
            }
            0xC0..=0xC2 | 0xC5..=0xC7 | 0xC9..=0xCB | 0xCD..=0xCF => {
                return Err(format!("a JPEG of process SOF{}, not the lossless one (SOF3)", marker & 15));
            }
            _ => {}
        }
    }
    Err("no scan in the JPEG stream".into())
}

/// The precision, if the frame is of one component and of this size.
pub(super) fn frame(content: &[u8], [columns, rows]: [usize; 2]) -> Result<u32, String> {
    let &[precision, y1, y0, x1, x0, components, ..] = content else { return Err("a damaged frame header".into()) };
    let (y, x) = (u16::from_be_bytes([y1, y0]), u16::from_be_bytes([x1, x0]));
    if (usize::from(x), usize::from(y), components) != (columns, rows, 1) {
        return Err(format!(
            "a picture of {x} x {y} samples in {components} component(s) instead of {columns} x {rows} in one"
        ));
    }
    if !(2..=16).contains(&precision) {
        return Err(format!("samples of {precision} bits"));
    }
    Ok(precision.into())
}

struct Scan<'a> {
    table: &'a Huffman,
    predictor: u8,
    /// Point transform: low bits that were left out.
    shift: u32,
    precision: u32,
    restart: usize,
}

impl Scan<'_> {
    fn decode(&self, data: &[u8], [columns, rows]: [usize; 2]) -> Result<Vec<u32>, String> {
        if !(1..=7).contains(&self.predictor) || self.shift >= self.precision {
            return Err(format!("predictor {} and point transform {}", self.predictor, self.shift));
        }
        if !self.restart.is_multiple_of(columns) {
            return Err(format!("a restart interval of {} within lines of {columns}", self.restart));
        }
        let lines = self.restart / columns;
        let mut bits = Bits { bytes: data, buffer: 0, held: 0 };
        let mut out: Vec<u32> = Vec::with_capacity(columns * rows);
        for y in 0..rows {
            let anew = y == 0 || lines > 0 && y % lines == 0;
            if anew && y > 0 {
                bits.restart().ok_or_else(|| format!("no restart marker before line {y}"))?;
            }
            for x in 0..columns {
                let at = out.len();
                let left = |out: &[u32]| out[at - 1] as i32;
                let above = |out: &[u32]| out[at - columns] as i32;
                let predicted = match (x, anew) {
                    (0, true) => 1 << (self.precision - self.shift - 1),
                    (_, true) => left(&out),
                    (0, false) => above(&out),
                    _ => self.predict(left(&out), above(&out), out[at - columns - 1] as i32),
                };
                let difference = self.difference(&mut bits).ok_or_else(|| format!("line {y} is damaged or cut off"))?;
                out.push((predicted + difference) as u32 & 0xFFFF);
            }
        }
        out.iter_mut().for_each(|v| *v <<= self.shift);
        Ok(out)
    }

    fn predict(&self, a: i32, b: i32, c: i32) -> i32 {
        match self.predictor {
            1 => a,
            2 => b,
            3 => c,
            4 => a + b - c,
            5 => a + ((b - c) >> 1),
            6 => b + ((a - c) >> 1),
            _ => (a + b) >> 1,
        }
    }

    fn difference(&self, bits: &mut Bits) -> Option<i32> {
        match self.table.value(bits)? {
            0 => Some(0),
            WHOLE => Some(32768),
            n if n < WHOLE => {
                let v = bits.take(n.into())? as i32;
                Some(if v < 1 << (n - 1) { v - (1 << n) + 1 } else { v })
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn put(out: &mut Vec<u8>, byte: u8) {
        out.push(byte);
        if byte == 0xFF {
            out.push(0);
        }
    }

    /// Ones up to a whole byte.
    fn pad(out: &mut Vec<u8>, bits: u64, held: u32) {
        if held > 0 {
            put(out, (bits << (8 - held)) as u8 | ((1u16 << (8 - held)) - 1) as u8);
        }
    }

    /// A picture of noise, encoded with codes of eight bits, one for each category.
    fn encoded(picture: &[u32], [columns, rows]: [usize; 2], scan: [u8; 3], restart: usize) -> Vec<u8> {
        let [precision, predictor, shift] = scan;
        let mut out = vec![0xFF, 0xD8, 0xFF, 0xC3, 0, 11, precision, 0, rows as u8, 0, columns as u8, 1, 1, 0x11, 0];
        out.extend([0xFF, 0xC4, 0, 36, 0, 0, 0, 0, 0, 0, 0, 0, 17, 0, 0, 0, 0, 0, 0, 0, 0]);
        out.extend(0..=16);
        out.extend([0xFF, 0xDD, 0, 4, 0, restart as u8, 0xFF, 0xDA, 0, 8, 1, 1, 0, predictor, 0, shift]);
        let (mut bits, mut held, mut marker) = (0u64, 0, 0);
        let low: Vec<i32> = picture.iter().map(|v| (v >> shift) as i32).collect();
        let lines = restart / columns;
        for y in 0..rows {
            let anew = y == 0 || lines > 0 && y % lines == 0;
            if anew && y > 0 {
                pad(&mut out, bits, held);
                (bits, held) = (0, 0);
                out.extend([0xFF, 0xD0 + marker]);
                marker = (marker + 1) % 8;
            }
            for x in 0..columns {
                let at = y * columns + x;
                let predicted = match (x, anew) {
                    (0, true) => 1 << (precision - shift - 1),
                    (_, true) => low[at - 1],
                    (0, false) => low[at - columns],
                    _ => {
                        let [a, b, c] = [low[at - 1], low[at - columns], low[at - columns - 1]];
                        [a, b, c, a + b - c, a + ((b - c) >> 1), b + ((a - c) >> 1), (a + b) >> 1]
                            [predictor as usize - 1]
                    }
                };
                // Differences are modulo 65536, from -32767 to 32768.
                let d = match (low[at] - predicted).rem_euclid(65536) {
                    d if d > 32768 => d - 65536,
                    d => d,
                };
                let category = 32 - d.unsigned_abs().leading_zeros();
                let extra = if category == 16 { 0 } else { category };
                let value = if d < 0 { d + (1 << category) - 1 } else { d } as u64;
                bits = (bits << 8 | u64::from(category)) << extra | value & ((1 << extra) - 1);
                held += 8 + extra;
                while held >= 8 {
                    held -= 8;
                    put(&mut out, (bits >> held) as u8);
                }
                bits &= (1 << held) - 1;
            }
        }
        pad(&mut out, bits, held);
        out.extend([0xFF, 0xD9]);
        out
    }

    #[test]
    fn every_predictor_shift_and_restart_comes_back() {
        let size = [9, 8];
        for precision in [8u8, 12, 16] {
            let noise = |k: u32| k.wrapping_mul(2_654_435_761) >> 7;
            let picture: Vec<u32> = (0..72).map(|k| noise(k) & ((1 << precision) - 1)).collect();
            for predictor in 1..=7 {
                for shift in [0u8, 2] {
                    for restart in [0, 9, 27] {
                        let wanted: Vec<u32> = picture.iter().map(|v| v >> shift << shift).collect();
                        let stream = encoded(&picture, size, [precision, predictor, shift], restart);
                        let found = decode(&stream, size);
                        assert_eq!(found, Ok(wanted), "{precision} bits, predictor {predictor}, {shift}, {restart}");
                    }
                }
            }
        }
    }
}
