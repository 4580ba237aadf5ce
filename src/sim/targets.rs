//! What inputs ask of bones: poses, prescribed displacements, forces and torques, and whether they may.

use super::SimError;
use super::model::{Drive, Model};
use super::state::State;
use crate::fem::Configuration;
use crate::math::{Pose, Vec3};
use crate::port::Slot;

pub(super) fn input3(inputs: &[f64], first: Option<usize>, row: usize) -> Vec3 {
    first.map_or(Vec3::zeros(), |f| Vec3::from_column_slice(&inputs[f + 3 * row..f + 3 * row + 3]))
}

pub(super) fn read_pivots(model: &Model, inputs: &[f64], pivots: &mut [Vec3]) {
    let first = model.parts().layout.first(Slot::BonePivot);
    for (b, pivot) in pivots.iter_mut().enumerate() {
        *pivot = input3(inputs, first, b);
    }
}

pub(super) fn read_wrenches(model: &Model, inputs: &[f64], wrenches: &mut [(Vec3, Vec3)]) {
    let layout = &model.parts().layout;
    let (force, torque) = (layout.first(Slot::BoneForce), layout.first(Slot::BoneTorque));
    for (body, wrench) in model.dofs().bodies.iter().zip(wrenches) {
        *wrench = (input3(inputs, force, body.bone), input3(inputs, torque, body.bone));
    }
}

/// Writes the poses that the inputs ask for; nodes stay where they are.
pub(super) fn place_bones(model: &Model, inputs: &[f64], config: &mut Configuration) {
    let layout = &model.parts().layout;
    let (translation, rotation) = (layout.first(Slot::BoneTranslation), layout.first(Slot::BoneRotation));
    for (b, bone) in model.parts().bones.iter().enumerate() {
        if bone.drive == Drive::Pose {
            config.poses[b] = Pose::new(input3(inputs, translation, b), &input3(inputs, rotation, b));
        }
    }
}

/// Where the inputs want the k-th node of a bone that has the given pose.
pub(super) fn target(model: &Model, inputs: &[f64], pivots: &[Vec3], poses: &[Pose], b: usize, k: usize) -> Vec3 {
    let parts = model.parts();
    let bone = &parts.bones[b];
    let X = &parts.mesh.nodes[bone.nodes[k] as usize];
    match bone.drive {
        Drive::Displacement => X + input3(inputs, parts.layout.first(Slot::BoneNodal(b as u32)), k),
        _ => poses[b].place(&pivots[b], X),
    }
}

/// `u`: how far each prescribed node has to go.
pub(super) fn target_increments(
    model: &Model,
    inputs: &[f64],
    pivots: &[Vec3],
    config: &Configuration,
    u: &mut [Vec3],
) {
    for (b, bone) in model.parts().bones.iter().enumerate() {
        for (k, &a) in bone.nodes.iter().enumerate() {
            let crate::fem::Role::Prescribed(p) = model.dofs().role[a as usize] else {
                continue;
            };
            u[p as usize] = target(model, inputs, pivots, &config.poses, b, k) - config.x[a as usize];
        }
    }
}

/// Every input must be finite, and none may ask a bone for what its drive does not do.
pub(super) fn check_inputs(model: &Model, inputs: &[f64]) -> Result<(), SimError> {
    if let Some((k, value)) = inputs.iter().enumerate().find(|(_, v)| !v.is_finite()) {
        return Err(SimError::NotFinite { name: model.input_name(k), value: *value });
    }
    let parts = model.parts();
    if let Some(k) = (0..parts.tunable.len()).find(|&k| inputs[k] <= 0.0) {
        return Err(SimError::NotPositive { name: model.input_name(k), value: inputs[k] });
    }
    let drives = [Slot::BoneTranslation, Slot::BoneRotation, Slot::BoneForce, Slot::BoneTorque];
    for first in drives.iter().filter_map(|slot| parts.layout.first(*slot)) {
        for k in (first..first + 3 * parts.bones.len()).filter(|&k| inputs[k] != 0.0) {
            bone_of_input(model, k, inputs[k])?;
        }
    }
    Ok(())
}

/// Whether the bone that input `k` belongs to, if to any, is driven by it.
///
/// # Errors
/// [`SimError::NotDriven`] if it is not.
pub(super) fn bone_of_input(model: &Model, k: usize, value: f64) -> Result<(), SimError> {
    let parts = model.parts();
    let drives = [
        (Slot::BoneTranslation, Drive::Pose),
        (Slot::BoneRotation, Drive::Pose),
        (Slot::BoneForce, Drive::Force),
        (Slot::BoneTorque, Drive::Force),
    ];
    for (slot, drive) in drives {
        let within = parts.layout.first(slot).and_then(|first| k.checked_sub(first));
        let Some(bone) = within.and_then(|within| parts.bones.get(within / 3)) else { continue };
        if bone.drive != drive {
            let (name, bone, drive) = (model.input_name(k), bone.name.clone(), bone.drive);
            return Err(SimError::NotDriven { name, value, bone, drive });
        }
        return Ok(());
    }
    Ok(())
}

/// The largest change of a bone's rotation vector in the step that `state` is about to make, rad.
pub(super) fn largest_turn(model: &Model, state: &State) -> f64 {
    let Some(first) = model.parts().layout.first(Slot::BoneRotation) else { return 0.0 };
    let of = |b: usize| input3(&state.inputs, Some(first), b) - input3(&state.applied, Some(first), b);
    (0..model.parts().bones.len()).map(|b| of(b).norm()).fold(0.0, f64::max)
}

/// Whether nothing but bones that are driven by pose or node by node moves in the step that `state` is about to make.
pub(super) fn moves_only_bones(model: &Model, state: &State) -> bool {
    let layout = &model.parts().layout;
    let bones = &model.parts().bones;
    let within = |slot: Slot, nodes: usize, k: usize| {
        layout.first(slot).is_some_and(|first| (first..first + 3 * nodes).contains(&k))
    };
    let moves_a_bone = |k: usize| {
        [Slot::BoneTranslation, Slot::BoneRotation].into_iter().any(|slot| within(slot, bones.len(), k))
            || bones.iter().enumerate().any(|(b, bone)| within(Slot::BoneNodal(b as u32), bone.nodes.len(), k))
    };
    (0..state.inputs.len()).filter(|&k| state.inputs[k] != state.applied[k]).all(moves_a_bone)
}
