//! What becomes of each effect of the catalogue on a board.

use bowden_model::effect::ActiveEffect;
use bowden_model::effects::CATALOGUE;

use super::draft::Draft;
use super::{Unused, corrections, sensors};

/// Drafts what an effect changes on the board; `source` is the effect's key in the rig. Returns a reason if it cannot.
type Carry = fn(active: &ActiveEffect, draft: &mut Draft, source: &str) -> Result<(), String>;

/// What becomes of an effect.
enum OnBoard {
    /// Parameters of the board, computed by this function.
    Carried(Carry),
    /// Nothing, for this reason.
    Unused(&'static str),
}
use OnBoard::{Carried, Unused as NotUsed};

const CHANGES_WITH_TIME: &str = "it changes with time, the board's parameters do not";

/// One entry for each effect, in the order of [`CATALOGUE`].
static EFFECTS_ON_BOARD: [(&str, OnBoard); CATALOGUE.len()] = [
    ("motor_coulomb_friction", Carried(corrections::motor_coulomb)),
    ("motor_viscous_friction", Carried(motor_viscous)),
    ("motor_stribeck_friction", Carried(corrections::motor_stribeck)),
    ("gear_load_friction", Carried(corrections::gear_load)),
    ("gear_backlash", NotUsed("both encoders are behind the gear: the position loop sees the play itself")),
    ("motor_cogging", Carried(corrections::cogging)),
    ("drive_dead_zone", Carried(corrections::dead_zone)),
    ("winding_heating", NotUsed("the board has no model of the winding's temperature")),
    ("distributed_friction", NotUsed("the compensator takes friction as distributed anyway")),
    ("sheath_viscous_friction", Carried(corrections::sheath_viscous)),
    ("sheath_stribeck_friction", Carried(corrections::sheath_stribeck)),
    ("presliding_compliance", NotUsed("the compensator takes contacts as rigid until they slip")),
    ("bending_friction", Carried(corrections::bending)),
    ("asymmetric_friction", Carried(corrections::asymmetry)),
    ("friction_drift", NotUsed(CHANGES_WITH_TIME)),
    ("wrap_angle_varies_with_pose", Carried(corrections::pose)),
    ("wrap_angle_disturbed", NotUsed(CHANGES_WITH_TIME)),
    ("tendon_slack", NotUsed("the board stops at a slack tendon; raise the pretension")),
    ("tendon_stiffening", NotUsed("the compensator takes the stiffness as constant")),
    ("tendon_creep", NotUsed(CHANGES_WITH_TIME)),
    ("pretension_loss", NotUsed("a loss is for the bench: restore the pretension")),
    ("transmission_backlash", Carried(corrections::transmission_backlash)),
    ("straight_ends", NotUsed("the compensator knows the wrap angle of a sheath and not where it bends")),
    ("joint_coulomb_friction", Carried(corrections::joint_coulomb)),
    ("joint_viscous_friction", NotUsed("the board does not feed viscous friction of the joint forward")),
    ("joint_backlash", Carried(corrections::joint_backlash)),
    ("joint_spring", Carried(corrections::joint_spring)),
    ("joint_torque_ripple", NotUsed("the board does not feed torque ripple of the joint forward")),
    (
        "end_stop_contact",
        NotUsed("keep the joint off the stop with limits.angle_minimum and limits.angle_maximum"),
    ),
    ("payload_change", NotUsed(CHANGES_WITH_TIME)),
    ("encoder_eccentricity", Carried(corrections::eccentricity)),
    ("sensor_gain_error", Carried(sensors::gain)),
    ("sensor_offset", Carried(sensors::offset)),
    ("sensor_lag", NotUsed("the board does not undo the lag of a sensor")),
    ("sensor_saturation", NotUsed("what a sensor does not show cannot be restored; replace it")),
];

/// Drafts an effect; what the board cannot use is returned with its reason.
pub(super) fn carry(active: &ActiveEffect, draft: &mut Draft) -> Option<Unused> {
    let id = active.descriptor().id;
    let source = match active.target.name() {
        Some(channel) => format!("effects.{id} of {channel}"),
        None => format!("effects.{id}"),
    };
    let on_board = EFFECTS_ON_BOARD.iter().find(|(other, _)| *other == id).map(|(_, on_board)| on_board);
    let reason = match on_board {
        Some(Carried(carry)) => carry(active, draft, &source).err()?,
        Some(NotUsed(reason)) => (*reason).to_owned(),
        None => "this program does not know it".to_owned(),
    };
    Some(Unused { source, reason })
}

/// Adds to the viscous friction that the rig states.
fn motor_viscous(active: &ActiveEffect, draft: &mut Draft, source: &str) -> Result<(), String> {
    const VISCOUS: &str = "motor.viscous";
    if !draft.has(VISCOUS) {
        return Err("the rig has no [motor] whose viscous friction it adds to".to_owned());
    }
    draft.set(VISCOUS, draft.value(VISCOUS)? + active.parameters[0], &source)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_has_its_own_entry() {
        for (effect, (id, on_board)) in CATALOGUE.into_iter().zip(&EFFECTS_ON_BOARD) {
            assert_eq!(effect.descriptor().id, *id);
            if let NotUsed(reason) = on_board {
                assert!(!reason.is_empty(), "{id}");
            }
        }
    }
}
