//! Position loop, torque loop and drive.

use bowden_link::message::Refusal;

use super::{RAD_PER_COUNT, conflict, fitted, gain, inertia, torque_constant};
use crate::compensator::{LagAngles, Source};
use crate::correction::MotorCorrection;
use crate::correction::dead_zone::DeadZone;
use crate::drive::ring::RingConfig;
use crate::drive::{DriveConfig, PositionConfig, TorqueConfig};
use crate::parameters::Parameters;
use crate::scale::{Angle, Current, Quantity, Weight};
use crate::sheath::Fitted;

/// Time in which the friction that is fed forward changes sign, s.
const FRICTION_FILTER_S: f32 = 0.02;

pub(super) fn position(parameters: &Parameters, period_s: f32) -> Result<PositionConfig, Refusal> {
    /// Low-pass of the reference's acceleration, s. Lag of a 1.5 Hz sine: 5°.
    const ACCELERATION_FILTER_S: f32 = 0.01;
    let ratio = parameters.pulley.output_radius / parameters.pulley.input_radius;
    let controller = &parameters.controller;
    let natural = core::f32::consts::TAU * controller.bandwidth;
    let proportional = natural * natural;
    Ok(PositionConfig {
        proportional: gain(proportional, "controller.bandwidth")?,
        derivative: gain(2.0 * controller.damping * natural, "controller.damping")?,
        integral: Weight::new(proportional / controller.integral_time * period_s),
        inertia: gain(inertia(parameters), "motor.rotor_inertia")?,
        acceleration_feedforward: gain(
            ratio * controller.acceleration_feedforward,
            "controller.acceleration_feedforward",
        )?,
        acceleration_filter: Weight::low_pass(ACCELERATION_FILTER_S, period_s),
        load_feedforward: gain(controller.load_feedforward, "controller.load_feedforward")?,
        half_count: Angle::from_f32(0.5 * RAD_PER_COUNT),
        expected_friction: expected_friction_s(parameters).map(|time_s| Weight::low_pass(time_s, period_s)),
        ring: if Source::of(parameters) == Source::Adaptive && fitted(parameters) != Fitted::Nothing {
            Some(RingConfig::new(parameters).ok_or_else(|| conflict("controller.tension_damping"))?)
        } else {
            None
        },
    })
}

/// Time in which the compensator crosses the dead zone of the nominal `mu K`, s; none where the input torque is measured, the
/// compensation is not adaptive, or the observer's disturbance settles sooner.
fn expected_friction_s(parameters: &Parameters) -> Option<f32> {
    /// Time in which the disturbance settles, over that of its slowest pole, `3/ω_o`.
    const SETTLED: f32 = 4.0;
    let needed = Source::of(parameters) == Source::Adaptive && fitted(parameters) == Fitted::Nothing;
    let crossing_s = 2.0 * LagAngles::new(parameters).friction_rad / parameters.compensator.rate_limit;
    let settling_s = SETTLED * 3.0 / (core::f32::consts::TAU * parameters.controller.observer_bandwidth);
    (needed && crossing_s < settling_s).then_some(crossing_s.max(FRICTION_FILTER_S))
}

/// Gain and damping of the torque loop with the tensions that are there.
pub(super) fn torque_gains(parameters: &Parameters) -> (f32, f32) {
    /// Part of the gain, and multiple of the damping, where the output torque is estimated: there the loop only helps the
    /// input torque on its way, and what it overshoots is mistaken for friction.
    const ESTIMATED_GAIN: f32 = 0.66;
    const ESTIMATED_DAMPING: f32 = 3.0;
    let controller = &parameters.controller;
    let (gain_part, damping_part) = match fitted(parameters) {
        Fitted::All => (1.0, 1.0),
        Fitted::Nothing | Fitted::Input => (ESTIMATED_GAIN, ESTIMATED_DAMPING),
    };
    (gain_part * controller.torque_gain, damping_part * controller.torque_damping)
}

pub(super) fn torque(parameters: &Parameters, period_s: f32) -> Result<TorqueConfig, Refusal> {
    /// Low-pass whose difference to the input torque is its rate, s.
    const LEAD_FILTER_S: f32 = 0.005;
    let controller = &parameters.controller;
    let (torque_gain, damping) = torque_gains(parameters);
    let at_input = parameters.pulley.input_radius / parameters.pulley.output_radius;
    Ok(TorqueConfig {
        at_input: gain(at_input, "pulley.input_radius")?,
        proportional: gain(torque_gain, "controller.torque_gain")?,
        integral: Weight::new(torque_gain / controller.torque_integral_time * period_s),
        damping: gain(damping, "controller.torque_damping")?,
        lead: gain(controller.tension_damping / LEAD_FILTER_S, "controller.tension_damping")?,
        lead_filter: Weight::low_pass(LEAD_FILTER_S, period_s),
        friction: gain(controller.friction_feedforward, "controller.friction_feedforward")?,
        friction_filter: Weight::low_pass(FRICTION_FILTER_S, period_s),
        direction_filter: Weight::low_pass(FRICTION_FILTER_S, period_s),
    })
}

pub(super) fn drive(parameters: &Parameters) -> Result<DriveConfig, Refusal> {
    let torque_constant = torque_constant(parameters);
    Ok(DriveConfig {
        current_per_torque: gain(1.0 / torque_constant, "motor.torque_constant")?,
        viscous: gain(parameters.motor.viscous, "motor.viscous")?,
        resistance: gain(parameters.motor.resistance, "motor.resistance")?,
        back_emf: gain(torque_constant, "motor.torque_constant")?,
        current_limit: Current::from_f32(parameters.limits.current),
        duty_limit_raw: libm::rintf(parameters.bridge.duty_limit * f32::from(i16::MAX)) as i16,
        reversed: parameters.bridge.direction < 0.0,
        correction: MotorCorrection::new(parameters)
            .ok_or_else(|| conflict("correction.motor_friction.speed"))?,
        dead_zone: DeadZone::new(parameters).ok_or_else(|| conflict("correction.dead_zone.width"))?,
    })
}
