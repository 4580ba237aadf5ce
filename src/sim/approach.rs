//! How shapes of contacts come at the tissue: never so far at once that they could pass through it.
//!
//! Where nothing can be touched yet is found by conservative advancement: a shape goes on by its distance from the tissue as
//! long as it has any. Where it touches it goes by no more than half of its reach at a time.
//!
//! Source: Mirtich & Canny, "Impulse-based simulation of rigid bodies", Symposium on Interactive 3D Graphics, 1995.

use std::f64::consts::FRAC_PI_2;

use super::model::Model;
use super::pace::even_part;
use super::step::{place_bones, target};
use crate::fem::{At, Configuration, Role, Touch};
use crate::math::Vec3;
use crate::solve::SolveError;

/// How far a shape may go at once, and how deep tissue may lie in it, in units of its reach.
const SAFE: f64 = 0.5;
/// Distance that counts as touching, in units of the reach.
const TOUCHING: f64 = 0.05;
/// Most looks along the way.
const LOOKS: usize = 64;

/// A step from the inputs `from` to `to`, whose part `done` has led to `config`.
pub(super) struct Approach<'a> {
    pub model: &'a Model,
    pub from: &'a [f64],
    pub to: &'a [f64],
    pub pivots: &'a [Vec3],
    pub config: &'a Configuration,
    pub done: f64,
    /// Smallest part that a step is cut into.
    pub smallest: f64,
}

impl Approach<'_> {
    /// The largest part of the step that may be taken next, and whether that is short enough. `inputs` and `there` are scratch.
    pub fn part(&self, inputs: &mut [f64], there: &mut Configuration) -> (f64, bool) {
        let Approach { model, config, done, smallest, .. } = *self;
        let (mut part, mut is_sure) = (1.0 - done, true);
        if model.parts().contacts.is_empty() {
            return (part, is_sure);
        }
        there.copy_from(config);
        for (k, reach) in each(model, &config.x).map(|(k, touch)| (k, touch.reach)).filter(|(_, r)| r.is_finite()) {
            self.place(self.to, k, there);
            // A turn by less than half of a circle is no longer than this many chords.
            let way = FRAC_PI_2 * chord(model, k, &config.x, &there.x) / (1.0 - done);
            let safe = SAFE * reach / way;
            if safe >= 1.0 - done {
                continue;
            }
            let touched = self.touched(k, reach, way, inputs, there);
            if touched - done > smallest {
                part = part.min(touched - done);
            } else {
                is_sure &= safe >= smallest;
                part = part.min(even_part(1.0 - done, safe.max(smallest)));
            }
        }
        (part, is_sure)
    }

    /// The part of the step at which contact `k`, that goes by `way` in all of it, may touch something; 1 if it does not.
    fn touched(&self, k: usize, reach: f64, way: f64, inputs: &mut [f64], there: &mut Configuration) -> f64 {
        let mut gap = |s: f64| {
            for (now, (from, to)) in inputs.iter_mut().zip(self.from.iter().zip(self.to)) {
                *now = from + s * (to - from);
            }
            self.place(inputs, k, there);
            each(self.model, &there.x).nth(k).map_or(f64::INFINITY, |(_, touch)| touch.gap)
        };
        let mut s = self.done;
        for _ in 0..LOOKS {
            let now = gap(s);
            let onward = if now > TOUCHING * reach { now } else { SAFE * reach };
            // What is touched by a shape that goes on stays inside it for that way: else it leaves.
            if now <= TOUCHING * reach && gap((s + onward / way).min(1.0)) <= TOUCHING * reach {
                return s;
            }
            s += onward / way;
            if s >= 1.0 {
                return 1.0;
            }
        }
        s
    }

    /// Puts the frame of contact `k` where its bone has it under these inputs.
    fn place(&self, inputs: &[f64], k: usize, there: &mut Configuration) {
        let parts = self.model.parts();
        place_bones(self.model, inputs, there);
        let frame = parts.contacts[k].frame;
        // Where a force-driven bone will go is not known.
        let Some(b) = parts.bones.iter().position(|b| b.nodes.binary_search(&frame[0]).is_ok()) else { return };
        for a in frame.into_iter().filter(|a| matches!(self.model.dofs().role[*a as usize], Role::Prescribed(_))) {
            let Ok(n) = parts.bones[b].nodes.binary_search(&a) else { continue };
            there.x[a as usize] = target(self.model, inputs, self.pivots, &there.poses, b, n);
        }
    }
}

fn chord(model: &Model, k: usize, from: &[Vec3], to: &[Vec3]) -> f64 {
    let frame = model.parts().contacts[k].frame.map(|a| a as usize);
    frame.into_iter().map(|a| (to[a] - from[a]).norm()).fold(0.0, f64::max)
}

/// Refuses tissue at `x` that lies deeper in a shape than it can tell its sides.
pub(super) fn check_depth(model: &Model, x: &[Vec3]) -> Result<(), SolveError> {
    match each(model, x).find(|(_, touch)| touch.depth() > SAFE * touch.reach) {
        Some((k, touch)) => Err(SolveError::TooDeep {
            contact: model.parts().contacts[k].name.clone(),
            depth: touch.depth(),
            most: SAFE * touch.reach,
        }),
        None => Ok(()),
    }
}

fn each<'a>(model: &'a Model, x: &'a [Vec3]) -> impl Iterator<Item = (usize, Touch)> + 'a {
    let terms = if model.parts().contacts.is_empty() { &[][..] } else { &model.parts().terms };
    terms.iter().filter_map(|term| term.touch(&At::NOWHERE, x)).enumerate()
}
