//! How shapes of contacts come at the tissue: never so far at once that they could pass through it.
//!
//! Where nothing can be touched yet is found by conservative advancement: a shape goes on by its distance from the tissue as
//! long as it has any. Where it touches it goes by no more than half of its reach at a time.
//!
//! Source: Mirtich & Canny, "Impulse-based simulation of rigid bodies", Symposium on Interactive 3D Graphics, 1995.

use std::f64::consts::FRAC_PI_2;

use super::model::{Contact, Drive, Model};
use super::pace::even_part;
use super::targets::place_bones;
use crate::fem::{At, Configuration};
use crate::math::Vec3;
use crate::mesh::signed_volume;
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
        if !model.parts().contacts.is_empty() {
            there.copy_from(config);
        }
        for (k, Contact { frame, reach, .. }) in
            model.parts().contacts.iter().enumerate().filter(|(_, c)| c.reach.is_finite())
        {
            self.place(self.to, k, there);
            // A turn by less than half of a circle is no longer than this many chords.
            let chord = frame.iter().map(|&a| (there.x[a as usize] - config.x[a as usize]).norm()).fold(0.0, f64::max);
            let way = FRAC_PI_2 * chord / (1.0 - done);
            let safe = SAFE * reach / way;
            if safe >= 1.0 - done {
                continue;
            }
            let touched = self.touched(k, *reach, way, inputs, there);
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
            self.model.touch(k, &At::NOWHERE, &there.x).gap
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
        let &Contact { bone, frame, .. } = &parts.contacts[k];
        // Where a force-driven bone will go is not known.
        if parts.bones[bone].drive != Drive::Force {
            for a in frame.map(|a| a as usize) {
                there.x[a] = there.poses[bone].place(&self.pivots[bone], &parts.mesh.nodes[a]);
            }
        }
    }
}

/// Refuses tissue at `x` that lies deeper in a shape than it can tell its sides, and shapes whose middle lies in tissue that it
/// did not lie in `before`: the surface that it should have pushed away is behind it then.
pub(super) fn check_depth(model: &Model, before: &[Vec3], x: &[Vec3]) -> Result<(), SolveError> {
    for (k, Contact { name, reach, .. }) in model.parts().contacts.iter().enumerate() {
        let (depth, most) = (model.touch(k, &At::NOWHERE, x).depth(), SAFE * reach);
        if depth > most {
            return Err(SolveError::TooDeep { contact: name.clone(), depth, most });
        }
        if is_swallowed(model, k, x) && !is_swallowed(model, k, before) {
            return Err(SolveError::Swallowed { contact: name.clone() });
        }
    }
    Ok(())
}

/// Whether a point of the line of contact `k` lies in a tetrahedron.
pub(super) fn is_swallowed(model: &Model, k: usize, x: &[Vec3]) -> bool {
    let mesh = model.mesh();
    let contact = &model.parts().contacts[k];
    let place = contact.motion(&mesh.nodes, x);
    let points = || contact.axis.iter().map(&place);
    let Some((low, high)) = points().map(|p| (p, p)).reduce(|(l, h), (p, _)| (l.inf(&p), h.sup(&p))) else {
        return false;
    };
    mesh.tets.iter().any(|tet| {
        let corners = tet.map(|a| x[a as usize]);
        let from = corners[0].inf(&corners[1]).inf(&corners[2].inf(&corners[3]));
        let to = corners[0].sup(&corners[1]).sup(&corners[2].sup(&corners[3]));
        let near = (0..3).all(|c| from[c] <= high[c] && low[c] <= to[c]);
        near && points().any(|p| holds(&corners, &p))
    })
}

/// Whether a tetrahedron of positive volume holds a point.
fn holds(corners: &[Vec3; 4], p: &Vec3) -> bool {
    (0..4).all(|k| {
        let mut sub = *corners;
        sub[k] = *p;
        signed_volume(sub) > 0.0
    })
}
