//! Effects that the board has a correction for, `correction.TERM.*`.
//!
//! The first effect of a term switches it on and takes back what the board had of it. Limits are the user's: they stay as they
//! are, and [`limited`] says which of them a strength exceeds. So does `sheath.adapts`: no rig states whether its sheaths move.

use bowden_model::channel::Channel;
use bowden_model::effect::{ActiveEffect, Target};

use super::Unused;
use super::draft::Draft;

/// A term of the board: its switch and the parameters that are zero without it.
struct Term {
    enable: &'static str,
    strengths: &'static [&'static str],
}

const MOTOR_FRICTION: Term = Term {
    enable: "correction.motor_friction.enable",
    strengths: &["correction.motor_friction.coulomb", "correction.motor_friction.excess"],
};
const GEAR_FRICTION: Term =
    Term { enable: "correction.gear_friction.enable", strengths: &["correction.gear_friction.coefficient"] };
const COGGING: Term = Term {
    enable: "correction.cogging.enable",
    strengths: &["correction.cogging.amplitude_1", "correction.cogging.amplitude_2"],
};
const DEAD_ZONE: Term =
    Term { enable: "correction.dead_zone.enable", strengths: &["correction.dead_zone.duty"] };
const JOINT_FRICTION: Term =
    Term { enable: "correction.joint_friction.enable", strengths: &["correction.joint_friction.coulomb"] };
const JOINT_SPRING: Term =
    Term { enable: "correction.joint_spring.enable", strengths: &["correction.joint_spring.stiffness"] };
const SHEATH: Term = Term {
    enable: "correction.sheath.enable",
    strengths: &[
        "correction.sheath.viscous",
        "correction.sheath.excess",
        "correction.sheath.bending",
        "correction.sheath.asymmetry",
        "correction.sheath.pose_slope",
    ],
};
const BACKLASH: Term = Term {
    enable: "correction.backlash.enable",
    strengths: &["correction.backlash.transmission_gap", "correction.backlash.joint_gap"],
};
const INPUT_ENCODER: Term =
    Term { enable: "correction.input_encoder.enable", strengths: &["correction.input_encoder.amplitude"] };
const JOINT_ENCODER: Term =
    Term { enable: "correction.joint_encoder.enable", strengths: &["correction.joint_encoder.amplitude"] };

/// Limits with the strengths that they bound, each as a part of what acts.
static LIMITS: [(&str, &[(&str, f64)]); 8] = [
    (
        "correction.motor_friction.limit",
        &[("correction.motor_friction.coulomb", 1.0), ("correction.motor_friction.excess", 0.75)],
    ),
    (
        "correction.cogging.limit",
        &[("correction.cogging.amplitude_1", 1.0), ("correction.cogging.amplitude_2", 1.0)],
    ),
    ("correction.dead_zone.limit", &[("correction.dead_zone.duty", 1.0)]),
    ("correction.joint_friction.limit", &[("correction.joint_friction.coulomb", 1.0)]),
    ("correction.backlash.limit", &[("correction.backlash.transmission_gap", 0.5)]),
    ("correction.backlash.limit", &[("correction.backlash.joint_gap", 0.5)]),
    ("correction.input_encoder.limit", &[("correction.input_encoder.amplitude", 1.0)]),
    ("correction.joint_encoder.limit", &[("correction.joint_encoder.amplitude", 1.0)]),
];

/// Drafted strengths that the limit of their term cuts.
pub(super) fn limited(draft: &Draft) -> Vec<Unused> {
    let cut = LIMITS.iter().filter_map(|(limit, parts)| {
        let allowed = draft.value(limit).ok()?;
        let drafted = parts.iter().filter(|(name, _)| draft.has(name));
        let strength: f64 = drafted.map(|(name, part)| part * draft.value(name).unwrap_or(0.0)).sum();
        (strength.abs() > allowed).then(|| Unused {
            source: (*limit).to_owned(),
            reason: format!("{allowed} of {:.4} act; raise it if the joint may have more", strength.abs()),
        })
    });
    cut.chain(followed(draft)).collect()
}

/// Why the term `sheath` does not act, if it was drafted and the board follows the friction of the sheaths by itself.
fn followed(draft: &Draft) -> Option<Unused> {
    const ADAPTS: &str = "sheath.adapts";
    let follows = draft.has(SHEATH.enable) && draft.value(ADAPTS).is_ok_and(|adapts| adapts == 1.0);
    follows.then(|| Unused {
        source: ADAPTS.to_owned(),
        reason: "while it is 1 the board follows all friction of the sheaths as mu K, and correction.sheath does not act; where \
                 the sheaths do not move, params set sheath.adapts=0.0 lets it act"
            .to_owned(),
    })
}

impl Term {
    /// Switches the term on, unless an effect before has done so.
    fn begin(&self, draft: &mut Draft, source: &str) -> Result<(), String> {
        if draft.has(self.enable) {
            return Ok(());
        }
        draft.set(self.enable, 1.0, &source)?;
        self.strengths.iter().try_for_each(|name| draft.set(name, 0.0, &source))
    }
}

/// Begins a term and sets parameters of it.
fn set(draft: &mut Draft, source: &str, term: &Term, values: &[(&str, f64)]) -> Result<(), String> {
    term.begin(draft, source)?;
    values.iter().try_for_each(|(name, value)| draft.set(name, *value, &source))
}

fn add_motor_coulomb(draft: &mut Draft, source: &str, torque_nm: f64) -> Result<(), String> {
    const COULOMB: &str = "correction.motor_friction.coulomb";
    MOTOR_FRICTION.begin(draft, source)?;
    draft.set(COULOMB, draft.value(COULOMB)? + torque_nm, &source)
}

pub(super) fn motor_coulomb(active: &ActiveEffect, draft: &mut Draft, source: &str) -> Result<(), String> {
    add_motor_coulomb(draft, source, active.parameters[0])
}

pub(super) fn motor_stribeck(active: &ActiveEffect, draft: &mut Draft, source: &str) -> Result<(), String> {
    let [excess_nm, speed_rad_s, coulomb_nm, ..] = active.parameters;
    add_motor_coulomb(draft, source, coulomb_nm)?;
    let values =
        [("correction.motor_friction.excess", excess_nm), ("correction.motor_friction.speed", speed_rad_s)];
    set(draft, source, &MOTOR_FRICTION, &values)
}

pub(super) fn gear_load(active: &ActiveEffect, draft: &mut Draft, source: &str) -> Result<(), String> {
    let [coefficient, exponent, ..] = active.parameters;
    if exponent != 1.0 {
        return Err(format!(
            "the board knows friction in proportion to the torque only, the exponent is {exponent}"
        ));
    }
    set(draft, source, &GEAR_FRICTION, &[("correction.gear_friction.coefficient", coefficient)])
}

pub(super) fn cogging(active: &ActiveEffect, draft: &mut Draft, source: &str) -> Result<(), String> {
    if draft.value("correction.ripple_table.enable").unwrap_or(0.0) == 1.0 {
        return Err("the ripple table acts in the place of harmonics; write a table that has this ripple in it, or set \
                    correction.ripple_table.enable=0.0 first"
            .to_owned());
    }
    let [amplitude_nm, cycles_per_turn, phase_rad, ..] = active.parameters;
    COGGING.begin(draft, source)?;
    for place in [1, 2] {
        let name = |what: &str| format!("correction.cogging.{what}_{place}");
        if draft.value(&name("amplitude"))? == 0.0 {
            draft.set(&name("amplitude"), amplitude_nm, &source)?;
            draft.set(&name("periods"), cycles_per_turn, &source)?;
            return draft.set(&name("phase"), phase_rad, &source);
        }
    }
    Err(format!(
        "the board takes the two strongest harmonics, {cycles_per_turn:.1} periods a turn are not among them; write a ripple table \
         that has them all"
    ))
}

pub(super) fn dead_zone(active: &ActiveEffect, draft: &mut Draft, source: &str) -> Result<(), String> {
    set(draft, source, &DEAD_ZONE, &[("correction.dead_zone.duty", active.parameters[0])])
}

pub(super) fn joint_coulomb(active: &ActiveEffect, draft: &mut Draft, source: &str) -> Result<(), String> {
    set(draft, source, &JOINT_FRICTION, &[("correction.joint_friction.coulomb", active.parameters[0])])
}

/// The board's spring is straight: of one that hardens it takes the stiffness at rest, which is never more than what acts.
pub(super) fn joint_spring(active: &ActiveEffect, draft: &mut Draft, source: &str) -> Result<(), String> {
    let [stiffness_nm_per_rad, rest_rad, ..] = active.parameters;
    let values = [
        ("correction.joint_spring.stiffness", stiffness_nm_per_rad),
        ("correction.joint_spring.rest", rest_rad),
    ];
    set(draft, source, &JOINT_SPRING, &values)
}

pub(super) fn sheath_viscous(active: &ActiveEffect, draft: &mut Draft, source: &str) -> Result<(), String> {
    set(draft, source, &SHEATH, &[("correction.sheath.viscous", active.parameters[0])])
}

pub(super) fn sheath_stribeck(active: &ActiveEffect, draft: &mut Draft, source: &str) -> Result<(), String> {
    let [static_ratio, speed_m_s, exponent, ..] = active.parameters;
    let values = [
        ("correction.sheath.excess", static_ratio - 1.0),
        ("correction.sheath.speed", speed_m_s),
        ("correction.sheath.exponent", exponent),
    ];
    set(draft, source, &SHEATH, &values)
}

pub(super) fn bending(active: &ActiveEffect, draft: &mut Draft, source: &str) -> Result<(), String> {
    set(draft, source, &SHEATH, &[("correction.sheath.bending", active.parameters[0])])
}

pub(super) fn asymmetry(active: &ActiveEffect, draft: &mut Draft, source: &str) -> Result<(), String> {
    set(draft, source, &SHEATH, &[("correction.sheath.asymmetry", active.parameters[0])])
}

pub(super) fn pose(active: &ActiveEffect, draft: &mut Draft, source: &str) -> Result<(), String> {
    set(draft, source, &SHEATH, &[("correction.sheath.pose_slope", active.parameters[0])])
}

pub(super) fn transmission_backlash(
    active: &ActiveEffect,
    draft: &mut Draft,
    source: &str,
) -> Result<(), String> {
    set(draft, source, &BACKLASH, &[("correction.backlash.transmission_gap", active.parameters[0])])
}

pub(super) fn joint_backlash(active: &ActiveEffect, draft: &mut Draft, source: &str) -> Result<(), String> {
    set(draft, source, &BACKLASH, &[("correction.backlash.joint_gap", active.parameters[0])])
}

pub(super) fn eccentricity(active: &ActiveEffect, draft: &mut Draft, source: &str) -> Result<(), String> {
    let [amplitude_rad, phase_rad, ..] = active.parameters;
    let (term, amplitude, phase) = match active.target {
        Target::One(Channel::ThetaIn) => {
            (&INPUT_ENCODER, "correction.input_encoder.amplitude", "correction.input_encoder.phase")
        }
        Target::One(Channel::ThetaOut) => {
            (&JOINT_ENCODER, "correction.joint_encoder.amplitude", "correction.joint_encoder.phase")
        }
        _ => return Err("the board has no encoder on the rotor".to_owned()),
    };
    set(draft, source, term, &[(amplitude, amplitude_rad), (phase, phase_rad)])
}

#[cfg(test)]
mod tests {
    use bowden_model::effects::CATALOGUE;

    use super::super::effects::carry;
    use super::*;
    use crate::sim::SimTransport;
    use crate::{Client, ParameterSet};

    #[test]
    fn the_board_has_every_parameter_that_an_effect_becomes() {
        let mut client =
            Client::connect(Box::new(SimTransport::new()), "sim", std::time::Duration::from_secs(1)).unwrap();
        let parameters = ParameterSet::read(&mut client).unwrap();
        for effect in CATALOGUE {
            for channel in effect.descriptor().channels.iter().map(|channel| Target::One(*channel)) {
                let mut active = ActiveEffect::with_defaults(effect);
                active.target = channel;
                let unused = carry(&active, &mut Draft::new(&parameters, &[]));
                assert!(unused.is_none_or(|unused| !unused.reason.contains("no parameter")), "{active:?}");
            }
            let active = ActiveEffect::with_defaults(effect);
            let mut draft = Draft::new(&parameters, &[]);
            let unused = carry(&active, &mut draft);
            assert!(unused.is_none_or(|unused| !unused.reason.contains("no parameter")), "{active:?}");
            assert!(draft.changes("rig.toml").is_ok(), "{active:?}");
        }
        for (limit, parts) in &LIMITS {
            for name in parts.iter().map(|(name, _)| name).chain([limit]) {
                assert!(parameters.find(name).is_ok(), "{name}");
            }
        }
    }
}
