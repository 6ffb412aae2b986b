//! Errors of sensors as gains and zeros of the board's channels.
//!
//! A channel shows `x = k (c - z)` for a code `c`. If it shows `g x` of a true `x`, its gain becomes `k/g`; if it shows
//! `x + o`, its zero becomes `z + o/k`. A count of an encoder is `2π/4096` rad.

use std::f64::consts::TAU;

use bowden_model::channel::Channel;
use bowden_model::effect::ActiveEffect;

use super::draft::Draft;

/// Counts a turn of both encoder parts.
const COUNTS_PER_TURN: f64 = 4096.0;

const TORQUE_IS_COMPUTED: &str = "the board computes this torque from the tensions";
const NO_ENCODER: &str = "the board has no encoder on the rotor";
const NO_SENSOR: &str = "the board has no sensor for it";

/// Parameters of the converter channels: zero, gain and direction.
struct Converter {
    zero: &'static str,
    gain: &'static str,
    direction: Option<&'static str>,
}

const fn tension(zero: &'static str, gain: &'static str) -> Converter {
    Converter { zero, gain, direction: None }
}

/// The converter behind a channel.
fn converter(channel: Channel) -> Result<Converter, &'static str> {
    match channel {
        Channel::F1 => Ok(tension("tension.f1.zero", "tension.f1.gain")),
        Channel::F2 => Ok(tension("tension.f2.zero", "tension.f2.gain")),
        Channel::F3 => Ok(tension("tension.f3.zero", "tension.f3.gain")),
        Channel::F4 => Ok(tension("tension.f4.zero", "tension.f4.gain")),
        Channel::MotorCurrent => Ok(Converter {
            zero: "bridge.current_zero",
            gain: "bridge.current_gain",
            direction: Some("bridge.direction"),
        }),
        Channel::ThetaIn | Channel::ThetaOut => Err("the gain of an encoder is fixed"),
        Channel::ThetaMotor => Err(NO_ENCODER),
        Channel::TorqueIn | Channel::TorqueOut => Err(TORQUE_IS_COMPUTED),
        Channel::ThetaRef | Channel::Duty | Channel::BusVoltage | Channel::DriveEnable => Err(NO_SENSOR),
    }
}

/// Channels of the board that an effect distorts.
fn channels(active: &ActiveEffect) -> impl Iterator<Item = Channel> {
    Channel::ALL.into_iter().filter(|channel| active.target.includes(*channel))
}

/// Shown over true: the gain of the channel falls.
pub(super) fn gain(active: &ActiveEffect, draft: &mut Draft, source: &str) -> Result<(), String> {
    for channel in channels(active) {
        let Converter { gain, .. } = converter(channel)?;
        draft.set(gain, draft.value(gain)? / active.parameters[0], &source)?;
    }
    Ok(())
}

/// Shown minus true: the zero of the channel moves.
pub(super) fn offset(active: &ActiveEffect, draft: &mut Draft, source: &str) -> Result<(), String> {
    let offset = active.parameters[0];
    for channel in channels(active) {
        match channel {
            Channel::ThetaIn => {
                turn_zero(["encoder.input.zero", "encoder.input.direction"], offset, draft, source)?;
            }
            Channel::ThetaOut => {
                turn_zero(["encoder.joint.zero", "encoder.joint.direction"], offset, draft, source)?;
            }
            _ => {
                let Converter { zero, gain, direction } = converter(channel)?;
                let sign = direction.map_or(Ok(1.0), |name| draft.value(name))?;
                let codes = offset / (draft.value(gain)? * sign);
                draft.set(zero, draft.value(zero)? + codes, &source)?;
            }
        }
    }
    Ok(())
}

/// Moves the zero of an encoder, a whole count within one turn, by an angle.
fn turn_zero(
    [zero, direction]: [&str; 2],
    offset_rad: f64,
    draft: &mut Draft,
    source: &str,
) -> Result<(), String> {
    let counts = draft.value(direction)? * offset_rad / TAU * COUNTS_PER_TURN;
    let turned = (draft.value(zero)? + counts).round().rem_euclid(COUNTS_PER_TURN);
    draft.set(zero, turned, &source)
}
