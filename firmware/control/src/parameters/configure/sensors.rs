//! Encoders, tensions, current and bus voltage.

use bowden_link::message::Refusal;
use micromath::F32Ext;

use super::{RAD_PER_COUNT, conflict, fitted, friction_exponent, gain, ticks, torque_constant};
use crate::encoder::EncoderConfig;
use crate::encoder::multi_turn::StepLimit;
use crate::motion_watch::{LOOK_S, samples};
use crate::motor_circuit::{CircuitConfig, RESISTANCE_FACTOR};
use crate::parameters::Parameters;
use crate::scale::{Code, Current, Quantity, Share, Tension, Voltage, Weight};
use crate::supply::SupplyConfig;
use crate::surplus_current::CURRENT_FACTOR;
use crate::tension::{TensionConfig, V_PER_CODE};
use crate::winding::WindingConfig;

pub(super) fn encoder(parameters: &Parameters, joint: bool) -> Result<EncoderConfig, Refusal> {
    let encoders = &parameters.encoder;
    let own = if joint { &encoders.joint } else { &encoders.input };
    // A count more for the grid and one for the encoder's noise.
    let step = encoders.speed_limit / (RAD_PER_COUNT * parameters.tick_rate_hz());
    let step_limit =
        StepLimit::new(libm::ceilf(step) as u16 + 2).ok_or_else(|| conflict("encoder.speed_limit"))?;
    Ok(EncoderConfig {
        part: parameters.encoder_parts()[usize::from(joint)],
        reversed: own.direction < 0.0,
        zero_counts: own.zero as u16,
        step_limit,
        bad_frames: encoders.bad_frames as u8,
        count_rad_s: RAD_PER_COUNT * parameters.tick_rate_hz(),
    })
}

/// Ratio of the tensions at the two ends of a sheath that friction can hold, e^(mu K), Eq. (2) and (3). Within 7.6e-4, relative
/// (test `the_capstan_ratio_is_near_enough`), which is enough beside a margin of 16 % by default.
fn capstan_ratio(exponent: f32) -> f32 {
    F32Ext::exp(exponent)
}

pub(super) fn tension(parameters: &Parameters, period_s: f32) -> Result<TensionConfig, Refusal> {
    /// Time for which tensions may contradict the stretch, over the one for which they may contradict each other: an
    /// encoder that stands is found first and named.
    const STRETCH_TIMES: f32 = 6.0;
    let tension = &parameters.tension;
    let [f1, f2, f3, f4] = [&tension.f1, &tension.f2, &tension.f3, &tension.f4];
    let allowed = capstan_ratio(
        friction_exponent(parameters).max(parameters.sheath.exponent_maximum) + tension.exponent_margin,
    );
    let tendon = &parameters.tendon;
    let tension_per_lag = 2.0 * tendon.axial_stiffness * parameters.pulley.input_radius / tendon.length;
    Ok(TensionConfig {
        zero: [f1, f2, f3, f4].map(|channel| Code::from_f32(channel.zero)),
        gain: [
            gain(f1.gain, "tension.f1.gain")?,
            gain(f2.gain, "tension.f2.gain")?,
            gain(f3.gain, "tension.f3.gain")?,
            gain(f4.gain, "tension.f4.gain")?,
        ],
        rail_raw: [tension.rail_low, tension.rail_high].map(|volts| libm::rintf(volts / V_PER_CODE) as u16),
        slack: Tension::from_f32(tension.slack),
        over: Tension::from_f32(tension.over),
        debounce_ticks: ticks(tension.debounce, period_s),
        filter: Weight::low_pass(tension.filter, period_s),
        ratio: gain(allowed, "sheath.wrap_angle")?,
        margin: Tension::from_f32(tension.margin),
        consistency_ticks: ticks(tension.consistency_time, period_s),
        fitted: fitted(parameters),
        pretension: Tension::from_f32(tendon.pretension),
        stretch: gain(tension_per_lag, "tendon.axial_stiffness")?,
        stretch_margin: Tension::from_f32(2.0 * tension.stretch_margin),
        stretch_ticks: ticks(STRETCH_TIMES * tension.consistency_time, period_s),
    })
}

pub(super) fn supply(parameters: &Parameters, period_s: f32) -> Result<SupplyConfig, Refusal> {
    /// Time constant of the bus voltage that the drive divides by, s: slower than its noise, faster than a supply.
    const BUS_FILTER_S: f32 = 2e-3;
    let (bridge, motor, supervisor) = (&parameters.bridge, &parameters.motor, &parameters.supervisor);
    Ok(SupplyConfig {
        current_zero: Code::from_f32(bridge.current_zero),
        current_gain: gain(bridge.current_gain * bridge.direction, "bridge.current_gain")?,
        bus_gain: gain(bridge.bus_gain, "bridge.bus_gain")?,
        bus_filter: Weight::low_pass(BUS_FILTER_S, period_s),
        over_current: Current::from_f32(supervisor.over_current),
        over_current_ticks: ticks(supervisor.over_current_time, period_s),
        bus_range: [supervisor.bus_minimum, supervisor.bus_maximum].map(Voltage::from_f32),
        bus_ticks: ticks(supervisor.bus_debounce, period_s),
        winding: WindingConfig {
            continuous: Current::from_f32(motor.continuous_current),
            of_continuous: gain(1.0 / motor.continuous_current, "motor.continuous_current")?,
            warming: Weight::low_pass(motor.winding_time, period_s),
        },
    })
}

/// What is expected of the motor's circuit: [`crate::motor_circuit`].
pub(super) fn circuit(parameters: &Parameters, period_s: f32) -> Result<CircuitConfig, Refusal> {
    let (bridge, motor) = (&parameters.bridge, &parameters.motor);
    let look_ticks = ticks(LOOK_S, period_s);
    let back_emf = torque_constant(parameters) / (f32::from(look_ticks) * period_s);
    let rest_a = parameters.supervisor.rest_current;
    let none_a = rest_a + bridge.current_gain;
    Ok(CircuitConfig {
        per_sample: ((1_u64 << 32) / u64::from(samples(look_ticks))) as i32,
        reversed: bridge.direction < 0.0,
        back_emf: gain(back_emf, "motor.torque_constant")?,
        back_emf_of_speed: gain(torque_constant(parameters), "motor.torque_constant")?,
        greatest: gain(CURRENT_FACTOR / motor.resistance, "motor.resistance")?,
        count: Voltage::from_f32(back_emf * RAD_PER_COUNT),
        dead_zone: Share::from_f32(parameters.correction.dead_zone.limit),
        least: gain(1.0 / (RESISTANCE_FACTOR * motor.resistance), "motor.resistance")?,
        none: Current::from_f32(none_a),
        most: Current::from_f32(none_a + rest_a),
    })
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    #[test]
    fn the_capstan_ratio_is_near_enough() {
        for step in 0..=40_000 {
            let exponent = step as f32 * 1e-4;
            let exact = f64::from(exponent).exp();
            let off = (f64::from(capstan_ratio(exponent)) / exact - 1.0).abs();
            assert!(off < 7.6e-4, "{exponent}: {off}");
        }
    }
}
