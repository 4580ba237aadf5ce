//! The programme of a scene: inputs over time, linear between keyframes.

use crate::port::Port;

/// Values over time for one row (or all) of one input port.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Index of the port in the model.
    pub port: usize,
    /// First element.
    pub offset: usize,
    /// Times (s, ascending) with the values then.
    pub frames: Vec<(f64, Vec<f64>)>,
}

/// What to set at a time.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Index of the port in the model.
    pub port: usize,
    /// First element.
    pub offset: usize,
    /// Values.
    pub values: Vec<f64>,
}

/// Steps and inputs of `cutis run`.
#[derive(Debug, Clone, PartialEq)]
pub struct Programme {
    /// Length of a step, s.
    pub dt: f64,
    /// End time, s.
    pub end: f64,
    pub(super) tracks: Vec<Track>,
}

impl Programme {
    /// Number of steps: `end / dt`, rounded.
    pub fn steps(&self) -> usize {
        (self.end / self.dt).round().max(1.0) as usize
    }

    /// What to set before the step that ends at time `t`.
    pub fn settings(&self, t: f64) -> Vec<Setting> {
        let at = |track: &Track| Setting { port: track.port, offset: track.offset, values: sample(&track.frames, t) };
        self.tracks.iter().map(at).collect()
    }
}

impl Track {
    /// A track that begins with the start values of its port.
    pub(super) fn new(port: usize, offset: usize, len: usize, p: &Port) -> Track {
        let start = p.start[offset..offset + len].to_vec();
        Track { port, offset, frames: vec![(0.0, start)] }
    }

    /// Adds or replaces the frame at time `t`.
    pub(super) fn insert(&mut self, t: f64, values: Vec<f64>) {
        match self.frames.binary_search_by(|(s, _)| s.total_cmp(&t)) {
            Ok(k) => self.frames[k].1 = values,
            Err(k) => self.frames.insert(k, (t, values)),
        }
    }
}

fn sample(frames: &[(f64, Vec<f64>)], t: f64) -> Vec<f64> {
    let after = frames.partition_point(|(s, _)| *s <= t);
    match (after.checked_sub(1).map(|k| &frames[k]), frames.get(after)) {
        (Some((t0, a)), Some((t1, b))) => {
            let s = (t - t0) / (t1 - t0);
            a.iter().zip(b).map(|(a, b)| a + s * (b - a)).collect()
        }
        (Some((_, values)), None) | (None, Some((_, values))) => values.clone(),
        (None, None) => Vec::new(),
    }
}
