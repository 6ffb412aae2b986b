//! Words for identifiers: effects, channels, parts of the joint.

use bowden_model::channel::Channel;

use crate::diagnose::verdict::{Findings, NamedEffect, Verdict};

/// Identifier as words: `gear_load_friction` becomes `gear load friction`.
pub fn phrase(id: &str) -> String {
    id.replace('_', " ").replace("coulomb", "Coulomb").replace("stribeck", "Stribeck")
}

/// Identifier as words that begin a line: `gear_load_friction` becomes `Gear load friction`.
pub(super) fn words(id: &str) -> String {
    let spaced = phrase(id);
    let mut characters = spaced.chars();
    characters.next().map_or_else(String::new, |first| first.to_uppercase().chain(characters).collect())
}

/// What a channel measures.
pub(super) fn channel(role: &str) -> String {
    let known = match role {
        "theta_ref_rad" => "Reference angle",
        "theta_motor_rad" => "Motor angle",
        "theta_in_rad" => "Input pulley angle",
        "theta_out_rad" => "Joint angle",
        "f1_n" => "Tension of cable a, motor end",
        "f2_n" => "Tension of cable a, joint end",
        "f3_n" => "Tension of cable b, motor end",
        "f4_n" => "Tension of cable b, joint end",
        "torque_in_nm" => "Torque at the input pulley",
        "torque_out_nm" => "Torque at the joint",
        "duty" => "Duty of the drive",
        "bus_v" => "Supply voltage",
        "i_motor_a" => "Motor current",
        "motor_torque_nm" => "Torque that the motor's model lacks",
        other => return words(other),
    };
    known.into()
}

/// Variable along which differences are drawn.
pub(super) fn variable(name: &str) -> String {
    let known = match name {
        "theta_rad" => "Position",
        "omega_rad_s" | "omega_in_rad_s" => "Speed",
        "tension_n" => "Largest tension",
        "t_s" => "Time",
        other => return channel(other),
    };
    known.into()
}

/// Part of the joint.
pub(super) fn component(name: &str) -> String {
    let known = match name {
        "motor" => "Motor and gear",
        "transmission" => "Tendons and sheaths",
        "joint" => "Joint and load",
        "sensors" => "Sensors",
        other => return words(other),
    };
    known.into()
}

/// Identifiers of effects in their order, each once: several benches or sensors may have the same.
pub(super) fn once_each<'e>(effects: impl IntoIterator<Item = &'e NamedEffect>) -> Vec<&'e str> {
    let mut ids: Vec<&str> = Vec::new();
    for effect in effects {
        if !ids.contains(&effect.id.as_str()) {
            ids.push(&effect.id);
        }
    }
    ids
}

/// Verdict as a heading.
pub(super) fn verdict(findings: &Findings) -> String {
    let diagnosis = &findings.diagnosis;
    match diagnosis.verdict {
        Verdict::Consistent => "Consistent: nothing needs to be added or changed".into(),
        Verdict::Recalibrate => "Recalibrate: parameters were wrong, no physics is missing".into(),
        Verdict::Unexplained => {
            "Unexplained: structure is left that no effect of the catalogue explains".into()
        }
        Verdict::MissingPhysics => {
            let named: Vec<String> = once_each(&diagnosis.effects).into_iter().map(phrase).collect();
            if named.is_empty() {
                "Missing physics".into()
            } else {
                format!("Missing physics: {}", named.join(", "))
            }
        }
    }
}

/// Unit of a channel: as its trace or residual says, else that of the role.
pub(super) fn unit_of<'f>(findings: &'f Findings, role: &str) -> &'f str {
    let traces = findings.traces.iter().map(|trace| (&trace.channel, &trace.unit));
    let regimes = findings.regimes.iter().map(|regime| (&regime.channel, &regime.unit));
    if let Some((_, unit)) = traces.chain(regimes).find(|(channel, _)| *channel == role) {
        return unit;
    }
    match Channel::ALL.iter().find(|channel| channel.role() == role) {
        Some(channel) => channel.unit(),
        None if role == "motor_torque_nm" => "N m",
        None => "1",
    }
}
