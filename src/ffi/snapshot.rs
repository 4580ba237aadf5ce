//! A saved FMU state: the simulation's [`State`] and where the instance stood.

use sha2::{Digest, Sha256};

use super::modes::Mode;
use crate::sim::{Model, State};

const MAGIC: &[u8; 8] = b"cutisfmu";
const FORMAT: u32 = 1;
const CHECKSUM: usize = 32;

/// What `GetFMUState` keeps.
#[derive(Clone)]
pub(super) struct Snapshot {
    pub(super) mode: Mode,
    pub(super) stale: bool,
    pub(super) start: Option<f64>,
    pub(super) stop: Option<f64>,
    pub(super) state: State,
}

impl Snapshot {
    /// Little-endian, without pointers, with a checksum: another process, another day, the same library and scene.
    ///
    /// ```text
    /// magic 8 | format u32 | mode u8 | stale u8 | start | stop | token | state | sha256 of all before, 32
    /// start, stop: u8 present, f64;  token, state: u64 length, bytes
    /// ```
    pub(super) fn to_bytes(&self, model: &Model) -> Vec<u8> {
        let state = self.state.to_bytes(model);
        let mut bytes = Vec::with_capacity(state.len() + 160);
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&FORMAT.to_le_bytes());
        bytes.extend_from_slice(&[self.mode, u8::from(self.stale)]);
        for time in [self.start, self.stop] {
            bytes.push(u8::from(time.is_some()));
            bytes.extend_from_slice(&time.unwrap_or(0.0).to_le_bytes());
        }
        for block in [model.token().as_bytes(), &state] {
            bytes.extend_from_slice(&(block.len() as u64).to_le_bytes());
            bytes.extend_from_slice(block);
        }
        let checksum = Sha256::digest(&bytes);
        bytes.extend_from_slice(&checksum);
        bytes
    }

    /// The snapshot that [`Snapshot::to_bytes`] wrote.
    ///
    /// # Errors
    /// What is wrong with the bytes, in words.
    pub(super) fn from_bytes(bytes: &[u8], model: &Model) -> Result<Self, String> {
        let body = bytes
            .len()
            .checked_sub(CHECKSUM)
            .ok_or_else(|| format!("{} bytes are too few for a saved state", bytes.len()))?;
        let (body, checksum) = bytes.split_at(body);
        let mut reader = Reader(body);
        if reader.take(MAGIC.len())? != MAGIC {
            return Err("these bytes are no saved state of this component".to_owned());
        }
        if Sha256::digest(body)[..] != *checksum {
            return Err("the saved state is damaged: its checksum does not match".to_owned());
        }
        let format = u32::from_le_bytes(reader.array()?);
        if format != FORMAT {
            return Err(format!("the saved state has format {format}, this library reads format {FORMAT}"));
        }
        let [mode, stale] = reader.array()?;
        let (start, stop) = (reader.time()?, reader.time()?);
        if reader.block()? != model.token().as_bytes() {
            return Err("the saved state belongs to another scene".to_owned());
        }
        let state = State::from_bytes(reader.block()?, model).map_err(|why| why.to_string())?;
        if !mode.is_power_of_two() || !reader.0.is_empty() {
            return Err("the saved state is damaged".to_owned());
        }
        Ok(Self { mode, stale: stale != 0, start, stop, state })
    }
}

struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u8], String> {
        let (head, tail) = self.0.split_at_checked(n).ok_or("the saved state ends too early")?;
        self.0 = tail;
        Ok(head)
    }
    fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        Ok(self.take(N)?.try_into().expect("take returns what was asked"))
    }
    fn time(&mut self) -> Result<Option<f64>, String> {
        let [present] = self.array()?;
        let time = f64::from_le_bytes(self.array()?);
        Ok((present != 0).then_some(time))
    }
    fn block(&mut self) -> Result<&'a [u8], String> {
        let n = u64::from_le_bytes(self.array()?);
        self.take(usize::try_from(n).map_err(|_| "the saved state ends too early")?)
    }
}
