//! How shapes of contacts come at the tissue: never so far at once that they could pass through it.

use super::model::Model;
use super::step::{place_bones, target_increments};
use crate::fem::{Configuration, Role, Touch};
use crate::math::Vec3;
use crate::solve::SolveError;

/// How far a shape may go at once, and how deep tissue may lie in it, in units of its reach.
const SAFE: f64 = 0.5;

/// The largest part of a step to `inputs` that takes no shape too far into the tissue. The poses of `config` become those of
/// the inputs, and `u` the way of the driven nodes, where there are contacts.
pub(super) fn safe_part(
    model: &Model,
    inputs: &[f64],
    pivots: &[Vec3],
    config: &mut Configuration,
    u: &mut [Vec3],
) -> f64 {
    if model.parts().contacts.is_empty() {
        return 1.0;
    }
    place_bones(model, inputs, config);
    target_increments(model, inputs, pivots, config, u);
    let role = &model.dofs().role;
    let moved = |a: &u32| match role[*a as usize] {
        Role::Prescribed(p) => u[p as usize].norm(),
        _ => 0.0,
    };
    let part = |(k, touch): (usize, Touch)| {
        let way = model.parts().contacts[k].frame.iter().map(moved).fold(0.0, f64::max);
        if touch.gap > way || way == 0.0 { 1.0 } else { SAFE * touch.reach / way }
    };
    each(model, &config.x).map(part).fold(1.0, f64::min)
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
    terms.iter().filter_map(|term| term.touch(x)).enumerate()
}
