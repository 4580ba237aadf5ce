//! The programme of a scene: inputs over time, linear between keyframes.

use super::SceneError;
use super::build::Builder;
use super::file::SceneFile;
use crate::port::{Causality, Port, Type};

/// Part of a programme that is no step of its own.
const ROUND_OFF: f64 = 1e-9;

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
    /// Number of steps to the end; the last one is shorter where `dt` does not divide it.
    pub fn steps(&self) -> usize {
        (self.end / self.dt * (1.0 - ROUND_OFF)).ceil().max(1.0) as usize
    }

    /// When step `k`, counted from 1, ends, s: k dt, not a sum of steps.
    pub fn time(&self, k: usize) -> f64 {
        if k < self.steps() { k as f64 * self.dt } else { self.end }
    }

    /// Length of step `k`, counted from 1, s: `dt` but for a last one that is shorter.
    pub fn step(&self, k: usize) -> f64 {
        let rest = self.end - (k - 1) as f64 * self.dt;
        if k == self.steps() && (rest - self.dt).abs() > ROUND_OFF * self.end { rest } else { self.dt }
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

impl Builder<'_> {
    pub(super) fn tracks(&self, file: &SceneFile, ports: &[Port]) -> Result<Vec<Track>, SceneError> {
        let mut tracks: Vec<Track> = Vec::new();
        let mut given: Vec<(usize, std::ops::Range<usize>, f64)> = Vec::new();
        for frame in &file.keyframe {
            let keyed = |p: &Port| {
                matches!(p.causality, Causality::Input | Causality::TunableParameter) && p.ty == Type::Float64
            };
            let inputs = || ports.iter().filter(|p| keyed(p));
            let wanted = frame.port.get_ref();
            let (port, p) = ports
                .iter()
                .enumerate()
                .find(|(_, p)| p.name == *wanted && keyed(p))
                .ok_or_else(|| self.text.unknown("input", &frame.port, inputs().map(|p| p.name.as_str())))?;
            let (offset, len) = match &frame.row {
                None => (0, p.len()),
                Some(row) => {
                    let k = p.rows.iter().position(|r| r == row.get_ref());
                    let k = k.ok_or_else(|| self.text.unknown("row", row, p.rows.iter().map(String::as_str)))?;
                    let width = p.len() / p.shape[0];
                    (k * width, width)
                }
            };
            let values = numbers(frame.value.get_ref()).filter(|v| v.len() == len && v.iter().all(|c| c.is_finite()));
            let values = values.ok_or_else(|| {
                self.text.at(frame.value.span().start, format!("`value` must be {len} finite number(s) for `{wanted}`"))
            })?;
            let (low, high) = (p.min.unwrap_or(f64::NEG_INFINITY), p.max.unwrap_or(f64::INFINITY));
            if let Some(bad) = values.iter().find(|v| !(low..=high).contains(*v)) {
                let message = format!("`value` of `{wanted}` is {bad} {}; it takes {low} to {high}", p.unit);
                return Err(self.text.at(frame.value.span().start, message));
            }
            let poses = ["bone.translation", "bone.rotation"].contains(&wanted.as_str());
            let forces = ["bone.force", "bone.torque"].contains(&wanted.as_str());
            if poses || forces {
                let drive = if poses { "pose" } else { "force" };
                let set = (offset / 3..(offset + len) / 3)
                    .filter(|b| values[3 * b - offset..][..3].iter().any(|v| *v != 0.0));
                let is_other = |b: &usize| file.bone[*b].drive.as_ref().map_or("pose", |d| d.get_ref()) != drive;
                if let Some(b) = set.into_iter().find(is_other) {
                    let name = file.bone[b].name.get_ref();
                    let message = format!("`{wanted}` of bone `{name}` cannot be set: its `drive` is not \"{drive}\"");
                    return Err(self.text.at(frame.value.span().start, message));
                }
            }
            let t = self.text.checked("keyframe", "t", &frame.t)?;
            let range = offset..offset + len;
            let meets = |(other, of, _): &&(usize, std::ops::Range<usize>, f64)| {
                *other == port && of.start < range.end && range.start < of.end
            };
            for (_, of, before) in given.iter().filter(meets) {
                if *of != range {
                    let message = format!("`{wanted}` has keyframes with and without `row`: which hold is not said");
                    return Err(self.text.at(frame.port.span().start, message));
                }
                if *before == t {
                    let message =
                        format!("two keyframes give `{wanted}` values at t = {t} s: for a jump set them a step apart");
                    return Err(self.text.at(frame.t.span().start, message));
                }
            }
            given.push((port, range, t));
            let same =
                |track: &&mut Track| track.port == port && track.offset == offset && track.frames[0].1.len() == len;
            match tracks.iter_mut().find(same) {
                Some(track) => track.insert(t, values),
                None => {
                    let mut track = Track::new(port, offset, len, p);
                    track.insert(t, values);
                    tracks.push(track);
                }
            }
        }
        Ok(tracks)
    }
}

pub(super) fn numbers(value: &toml::Value) -> Option<Vec<f64>> {
    match value {
        toml::Value::Float(v) => Some(vec![*v]),
        toml::Value::Integer(v) => Some(vec![*v as f64]),
        toml::Value::Array(items) => items.iter().map(numbers).collect::<Option<Vec<_>>>().map(|v| v.concat()),
        _ => None,
    }
}
