//! JPEG-LS, one component of 2 to 16 bits, lossless or near-lossless. Names are the standard's.
//!
//! Source: ITU-T T.87 (ISO/IEC 14495-1), 1998, annexes A (coding procedures) and C (parameters).

#![allow(non_snake_case)]

use super::jpeg::frame;
use super::markers::{Segment, Segments};

/// Contexts of regular mode; behind them stand the two of run interruption.
const REGULAR: usize = 365;
/// Orders of the run lengths.
const J: [u32; 32] =
    [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 9, 10, 11, 12, 13, 14, 15];
/// Bias corrections stay within these.
const C: std::ops::RangeInclusive<i32> = -128..=127;
/// Bytes of an LSE segment with parameters.
const PRESET: usize = 11;

/// Bits of each sample of a picture of `size` (columns, rows).
pub(super) fn decode(data: &[u8], size: [usize; 2]) -> Result<Vec<u32>, String> {
    let (mut precision, mut preset) = (None, None);
    for segment in Segments::new(data)? {
        let Segment { marker, content, behind } = segment?;
        match marker {
            0xF7 => precision = Some(frame(content, size)?),
            0xF8 if content.first() == Some(&1) && content.len() == PRESET => {
                let word = |k: usize| i32::from(u16::from_be_bytes([content[1 + 2 * k], content[2 + 2 * k]]));
                preset = Some([word(0), word(1), word(2), word(3), word(4)]);
            }
            0xF8 => return Err(format!("JPEG-LS extension {:?} (mapping tables or large sizes)", content.first())),
            0xDD => return Err("JPEG-LS restart intervals".into()),
            0xDA => {
                let precision = precision.ok_or("a scan before its frame")?;
                let &[1, _, table, near, interleave, shift] = content else {
                    return Err("a scan of several components".into());
                };
                if (table, interleave, shift) != (0, 0, 0) {
                    return Err(format!("a scan with mapping table {table}, interleave {interleave}, shift {shift}"));
                }
                return Coder::new(precision, near.into(), preset)?.decode(behind, size);
            }
            0xC0..=0xCF => return Err(format!("a JPEG of process SOF{}, not JPEG-LS", marker & 15)),
            _ => {}
        }
    }
    Err("no scan in the JPEG-LS stream".into())
}

/// Bits of the scan: behind a byte of ones the next one carries seven.
struct Bits<'a> {
    bytes: &'a [u8],
    buffer: u64,
    held: u32,
    ones: bool,
}

impl Bits<'_> {
    fn take(&mut self, n: u32) -> Option<u32> {
        while self.held < n {
            let (&byte, rest) = self.bytes.split_first()?;
            if self.ones && byte >= 0x80 {
                return None;
            }
            let width = if self.ones { 7 } else { 8 };
            self.buffer = self.buffer << width | u64::from(byte);
            self.held += width;
            self.ones = byte == 0xFF;
            self.bytes = rest;
        }
        self.held -= n;
        Some((self.buffer >> self.held) as u32 & ((1u64 << n) - 1) as u32)
    }
}

/// What the coder has learnt of a context.
#[derive(Clone, Copy)]
struct Context {
    A: i32,
    B: i32,
    C: i32,
    N: i32,
    /// Negative errors of run interruption.
    Nn: i32,
}

struct Coder {
    MAXVAL: i32,
    NEAR: i32,
    T: [i32; 3],
    RESET: i32,
    RANGE: i32,
    qbpp: u32,
    LIMIT: u32,
    contexts: Vec<Context>,
    RUNindex: usize,
}

/// Bits that hold numbers below `n`.
fn ceil_log2(n: i32) -> u32 {
    32 - (n - 1).leading_zeros()
}

impl Coder {
    fn new(precision: u32, NEAR: i32, preset: Option<[i32; 5]>) -> Result<Self, String> {
        let [given, t1, t2, t3, reset] = preset.unwrap_or_default();
        let MAXVAL = if given > 0 { given } else { (1 << precision) - 1 };
        if MAXVAL >= 1 << precision || NEAR > (MAXVAL / 2).min(255) {
            return Err(format!("largest value {MAXVAL} and error {NEAR} for samples of {precision} bits"));
        }
        let clamp = |v: i32, low: i32| if v > MAXVAL || v < low { low } else { v };
        let [b1, b2, b3] = if MAXVAL >= 128 {
            let factor = (MAXVAL.min(4095) + 128) / 256;
            [factor + 2 + 3 * NEAR, factor * 4 + 3 + 5 * NEAR, factor * 17 + 4 + 7 * NEAR]
        } else {
            let factor = 256 / (MAXVAL + 1);
            [(3 / factor + 3 * NEAR).max(2), (7 / factor + 5 * NEAR).max(3), (21 / factor + 7 * NEAR).max(4)]
        };
        let or = |given: i32, usual: i32| if given > 0 { given } else { usual };
        let T1 = or(t1, clamp(b1, NEAR + 1));
        let T2 = or(t2, clamp(b2, T1));
        let T3 = or(t3, clamp(b3, T2));
        let RANGE = (MAXVAL + 2 * NEAR) / (2 * NEAR + 1) + 1;
        let bpp = ceil_log2(MAXVAL + 1).max(2);
        let fresh = Context { A: ((RANGE + 32) / 64).max(2), B: 0, C: 0, N: 1, Nn: 0 };
        Ok(Self {
            MAXVAL,
            NEAR,
            T: [T1, T2, T3],
            RESET: or(reset, 64),
            RANGE,
            qbpp: ceil_log2(RANGE),
            LIMIT: 2 * (bpp + bpp.max(8)),
            contexts: vec![fresh; REGULAR + 2],
            RUNindex: 0,
        })
    }

    fn decode(mut self, data: &[u8], [columns, rows]: [usize; 2]) -> Result<Vec<u32>, String> {
        let mut bits = Bits { bytes: data, buffer: 0, held: 0, ones: false };
        // Lines with a sample more on both sides: what stands there is the standard's (A.2.1).
        let (mut above, mut line) = (vec![0i32; columns + 2], vec![0i32; columns + 2]);
        let mut out = Vec::with_capacity(columns * rows);
        for y in 0..rows {
            above[columns + 1] = above[columns];
            line[0] = above[1];
            self.line(&mut bits, &above, &mut line).ok_or_else(|| format!("line {y} is damaged or cut off"))?;
            out.extend(line[1..=columns].iter().map(|&v| v as u32));
            std::mem::swap(&mut above, &mut line);
        }
        Ok(out)
    }

    fn line(&mut self, bits: &mut Bits, above: &[i32], line: &mut [i32]) -> Option<()> {
        let columns = line.len() - 2;
        let mut x = 1;
        while x <= columns {
            let [Ra, Rb, Rc, Rd] = [line[x - 1], above[x], above[x - 1], above[x + 1]];
            let D = [Rd - Rb, Rb - Rc, Rc - Ra];
            if D.iter().all(|d| d.abs() <= self.NEAR) {
                x += self.run(bits, &mut line[x..=columns], Ra)?;
                if x <= columns {
                    line[x] = self.interruption(bits, line[x - 1], above[x])?;
                    x += 1;
                }
            } else {
                line[x] = self.regular(bits, D, [Ra, Rb, Rc])?;
                x += 1;
            }
        }
        Some(())
    }

    /// A.3 to A.6.
    fn regular(&mut self, bits: &mut Bits, D: [i32; 3], [Ra, Rb, Rc]: [i32; 3]) -> Option<i32> {
        let [Q1, Q2, Q3] = D.map(|d| self.quantised(d));
        let Q = 81 * Q1 + 9 * Q2 + Q3;
        let sign = if Q < 0 { -1 } else { 1 };
        let Q = Q.unsigned_abs() as usize;
        let c = self.contexts[Q];
        let median = if Rc >= Ra.max(Rb) {
            Ra.min(Rb)
        } else if Rc <= Ra.min(Rb) {
            Ra.max(Rb)
        } else {
            Ra + Rb - Rc
        };
        let Px = (median + sign * c.C).clamp(0, self.MAXVAL);
        let k = order(c.N, c.A)?;
        let M = self.golomb(bits, k, self.LIMIT)?;
        let error = if self.NEAR == 0 && k == 0 && 2 * c.B <= -c.N {
            if M & 1 == 1 { M >> 1 } else { -(M >> 1) - 1 }
        } else if M & 1 == 1 {
            -(M >> 1) - 1
        } else {
            M >> 1
        };
        let c = &mut self.contexts[Q];
        c.B = c.B.saturating_add(error.saturating_mul(2 * self.NEAR + 1));
        c.A = c.A.saturating_add(error.saturating_abs());
        if c.N == self.RESET {
            (c.A, c.B, c.N) = (c.A >> 1, c.B >> 1, c.N >> 1);
        }
        c.N += 1;
        if c.B <= -c.N {
            c.B = (c.B + c.N).max(1 - c.N);
            c.C = (c.C - 1).max(*C.start());
        } else if c.B > 0 {
            c.B = (c.B - c.N).min(0);
            c.C = (c.C + 1).min(*C.end());
        }
        Some(self.reconstructed(Px, sign, error))
    }

    /// Samples of a run (A.7.1), how many.
    fn run(&mut self, bits: &mut Bits, rest: &mut [i32], Ra: i32) -> Option<usize> {
        let mut n = 0;
        while n < rest.len() {
            let whole = 1usize << J[self.RUNindex];
            if bits.take(1)? == 0 {
                n += bits.take(J[self.RUNindex])? as usize;
                if n >= rest.len() {
                    return None;
                }
                break;
            }
            if n + whole <= rest.len() {
                self.RUNindex = (self.RUNindex + 1).min(J.len() - 1);
            }
            n = (n + whole).min(rest.len());
        }
        rest[..n].fill(Ra);
        Some(n)
    }

    /// The sample that ends a run (A.7.2).
    fn interruption(&mut self, bits: &mut Bits, Ra: i32, Rb: i32) -> Option<i32> {
        let alike = (Ra - Rb).abs() <= self.NEAR;
        let at = REGULAR + usize::from(alike);
        let (Px, sign) = if alike { (Ra, 1) } else { (Rb, if Ra > Rb { -1 } else { 1 }) };
        let c = self.contexts[at];
        let k = order(c.N, if alike { c.A + (c.N >> 1) } else { c.A })?;
        let EM = self.golomb(bits, k, self.LIMIT - J[self.RUNindex] - 1)?;
        let T = EM.checked_add(i32::from(alike))?;
        let odd = T & 1 == 1;
        let size = (T + (T & 1)) / 2;
        let error = if (k != 0 || 2 * c.Nn >= c.N) == odd { -size } else { size };
        let c = &mut self.contexts[at];
        c.Nn += i32::from(error < 0);
        c.A = c.A.saturating_add((EM + 1 - i32::from(alike)) >> 1);
        if c.N == self.RESET {
            (c.A, c.N, c.Nn) = (c.A >> 1, c.N >> 1, c.Nn >> 1);
        }
        c.N += 1;
        self.RUNindex = self.RUNindex.saturating_sub(1);
        Some(self.reconstructed(Px, sign, error))
    }

    fn quantised(&self, d: i32) -> i32 {
        let [T1, T2, T3] = self.T;
        let size = d.abs();
        let step = if size >= T3 {
            4
        } else if size >= T2 {
            3
        } else if size >= T1 {
            2
        } else {
            i32::from(size > self.NEAR)
        };
        step * d.signum()
    }

    /// A.5.3: a length-limited Golomb code.
    fn golomb(&self, bits: &mut Bits, k: u32, limit: u32) -> Option<i32> {
        let longest = limit.checked_sub(self.qbpp + 1)?;
        let mut zeros = 0;
        while bits.take(1)? == 0 {
            zeros += 1;
            if zeros > longest {
                return None;
            }
        }
        let value = if zeros < longest { zeros << k | bits.take(k)? } else { bits.take(self.qbpp)? + 1 };
        i32::try_from(value).ok()
    }

    fn reconstructed(&self, Px: i32, sign: i32, error: i32) -> i32 {
        let step = 2 * self.NEAR + 1;
        let mut Rx = i64::from(Px) + i64::from(sign) * i64::from(error) * i64::from(step);
        let turn = i64::from(self.RANGE) * i64::from(step);
        if Rx < -i64::from(self.NEAR) {
            Rx += turn;
        } else if Rx > i64::from(self.MAXVAL + self.NEAR) {
            Rx -= turn;
        }
        Rx.clamp(0, self.MAXVAL.into()) as i32
    }
}

/// The Golomb order: the least k with N 2^k >= A.
fn order(N: i32, A: i32) -> Option<u32> {
    (0..24).find(|k| i64::from(N) << k >= i64::from(A))
}
