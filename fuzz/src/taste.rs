//! Bytes as a row of decisions; when they are used up, every decision is the first choice.

/// What is left of the bytes.
pub struct Taste<'a>(pub &'a [u8]);

/// Numbers that break things.
const NUMBERS: [f64; 16] = [
    0.0,
    1e-3,
    0.01,
    -0.002,
    0.1,
    1.0,
    -1.0,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f64::MIN_POSITIVE,
    5e-324,
    1e9,
    -1e-9,
    std::f64::consts::PI,
];

impl Taste<'_> {
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn byte(&mut self) -> u8 {
        let Some((&first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        first
    }

    pub fn word(&mut self) -> u16 {
        u16::from_le_bytes([self.byte(), self.byte()])
    }

    /// Below `n`, which is not 0.
    pub fn below(&mut self, n: usize) -> usize {
        usize::from(self.byte()) % n
    }

    /// Small as a rule, sometimes one of those that break things.
    pub fn number(&mut self) -> f64 {
        let byte = self.byte();
        if byte < 16 { NUMBERS[usize::from(byte)] } else { f64::from(byte as i8) * 2e-5 }
    }
}

/// `valid` with as many changes as the bytes tell: a byte, a number, a length, a cut, a repetition.
pub fn edited(mut valid: Vec<u8>, taste: &mut Taste) -> Vec<u8> {
    while !taste.is_empty() && !valid.is_empty() {
        let kind = taste.byte();
        let at = usize::from(taste.word()) * (1 + usize::from(kind >> 6) * 7) % valid.len();
        let rest = valid.len() - at;
        match kind % 8 {
            0 | 1 => valid[at] = taste.byte(),
            2 => valid[at] ^= 1 << taste.below(8),
            3 if rest >= 8 => valid[at..at + 8].copy_from_slice(&taste.number().to_le_bytes()),
            4 if rest >= 8 => {
                let length = [0, 1, u64::MAX, 1 << 40, rest as u64, u64::from(taste.byte())][taste.below(6)];
                valid[at..at + 8].copy_from_slice(&length.to_le_bytes());
            }
            5 if rest >= 4 => {
                let length = [0, 1, u32::MAX, 1 << 31, rest as u32, u32::from(taste.byte())][taste.below(6)];
                valid[at..at + 4].copy_from_slice(&length.to_le_bytes());
            }
            6 => valid.truncate(at),
            _ => {
                let n = rest.min(1 + usize::from(taste.byte()));
                let piece = valid[at..at + n].to_vec();
                valid.splice(at..at, piece);
            }
        }
    }
    valid
}
