//! Without tendons rotor and joint turn as one body: what acts on the one acts on the other, unless the angle is prescribed, which no torque
//! changes.

use bowden_model::effect::{ActiveEffect, Component, Descriptor, Effect};
use bowden_model::effects::find;

use crate::joint_model::{Drive, JointModel};

/// What a report says where it would name the motion that separates two effects.
pub(super) const INSEPARABLE: &str =
    "no motion does, rotor and joint turn as one body; say which one it is by construction";

/// End of the joint on which an effect acts, and what it is there.
fn at_end(descriptor: &Descriptor) -> Option<(Component, &'static str)> {
    let ends = [Component::Motor, Component::Joint];
    let name = ends.contains(&descriptor.component).then(|| descriptor.component.name())?;
    Some((descriptor.component, descriptor.id.strip_prefix(name)?))
}

/// Whether the one is of the motor what the other is of the joint.
fn is_of_the_other_end(one: &Descriptor, other: &Descriptor) -> bool {
    matches!((at_end(one), at_end(other)), (Some((at_one, of_one)), Some((at_other, of_other)))
        if at_one != at_other && of_one == of_other)
}

/// Whether rotor and joint of `model` answer to the same torques.
pub(super) fn turns_as_one(model: &JointModel) -> bool {
    model.parameters.tendon.is_none() && model.drive().is_ok_and(|drive| drive != Drive::Angle)
}

/// Whether, in `model`, the two effects are the same one.
pub(super) fn are_one(model: &JointModel, one: &ActiveEffect, other: &ActiveEffect) -> bool {
    turns_as_one(model) && is_of_the_other_end(one.descriptor(), other.descriptor())
}

/// Whether `model` has `effect` already at its other end, or as a part of an effect that it has: dry friction that grows at low speed is dry
/// friction at high speed.
pub(super) fn has(model: &JointModel, effect: &dyn Effect) -> bool {
    let wanted = effect.descriptor();
    let is_part = |part: &Descriptor| part.id == wanted.id || is_of_the_other_end(part, wanted);
    turns_as_one(model)
        && model.effects.iter().any(|active| {
            let part = active.effect.remainder(&active.parameters).and_then(|(id, _)| find(id));
            is_of_the_other_end(active.descriptor(), wanted)
                || part.is_some_and(|part| is_part(part.descriptor()))
        })
}

#[cfg(test)]
mod tests {
    use bowden_model::channel::Channel;

    use super::*;
    use crate::test_bench;

    #[test]
    fn dry_friction_of_one_body_is_not_looked_for_twice() {
        let turned = test_bench::turned(2, &[]);
        let effect = |id: &str| ActiveEffect::with_defaults(find(id).unwrap());
        let direct = JointModel::from_rig(&test_bench::direct_rig(), &turned).unwrap();
        let tendons = JointModel::from_rig(&test_bench::rig(), &test_bench::swung(2)).unwrap();
        let prescribed = JointModel { inputs: vec![Channel::ThetaIn], ..direct.clone() };
        let has = |model: &JointModel, had: &str, wanted: &str| {
            let with = JointModel { effects: vec![effect(had)], ..model.clone() };
            super::has(&with, find(wanted).unwrap())
        };
        for (had, wanted, is_there) in [
            ("motor_coulomb_friction", "joint_coulomb_friction", true),
            ("motor_stribeck_friction", "motor_coulomb_friction", true),
            ("motor_stribeck_friction", "joint_coulomb_friction", true),
            ("motor_coulomb_friction", "motor_stribeck_friction", false),
            ("joint_viscous_friction", "joint_coulomb_friction", false),
            ("joint_spring", "motor_cogging", false),
            // Another sensor may have the same error.
            ("sensor_offset", "sensor_offset", false),
        ] {
            assert_eq!(has(&direct, had, wanted), is_there, "{had}, {wanted}");
            assert!(!has(&tendons, had, wanted), "{had}, {wanted} with tendons");
            assert!(!has(&prescribed, had, wanted), "{had}, {wanted} under a prescribed angle");
        }
    }
}
