//! What is observed: speed of the input pulley, friction of the sheaths.

use bowden_link::message::Refusal;

use super::{RAD_PER_COUNT, fitted, friction_exponent, gain, inertia, torque_constant};
use crate::observer::ObserverConfig;
use crate::parameters::Parameters;
use crate::scale::{Angle, Quantity, Ratio, Speed, Weight};
use crate::sheath::{Fitted, SheathConfig};

pub(super) fn observer(parameters: &Parameters, period_s: f32) -> Result<ObserverConfig, Refusal> {
    let inertia = inertia(parameters);
    let bandwidth = core::f32::consts::TAU * parameters.controller.observer_bandwidth;
    Ok(ObserverConfig {
        drive: gain(torque_constant(parameters) / inertia, "motor.rotor_inertia")?,
        load: gain(1.0 / inertia, "motor.rotor_inertia")?,
        viscous: gain(parameters.motor.viscous / inertia, "motor.rotor_inertia")?,
        pull: gain(3.0 * bandwidth * bandwidth, "controller.observer_bandwidth")?,
        follow: Weight::new((3.0 * bandwidth * period_s).min(1.0)),
        learn: Weight::new(bandwidth / 3.0 * period_s),
        inertia: gain(inertia, "motor.rotor_inertia")?,
        speed_step: Weight::new(period_s),
        acceleration_step: Weight::new(period_s),
        half_count: Angle::from_f32(0.5 * RAD_PER_COUNT),
    })
}

pub(super) fn sheath(parameters: &Parameters, period_s: f32) -> Result<SheathConfig, Refusal> {
    /// Travel for which a cable is sure to slip, over the dead zone.
    const ZONE_MARGIN: f32 = 1.2;
    /// Part of half a count of the joint's encoder within which an innovation says nothing. At 1 the estimate hangs at the
    /// edge of what the count allows while friction changes, at 0 it follows each count.
    const SILENT_PART: f32 = 0.6;
    /// Time constant of the input torque, s: from tensions, whose noise is white, and from the current, which misses what
    /// the rotor's inertia takes.
    const TENSION_FILTER_S: f32 = 0.002;
    const CURRENT_FILTER_S: f32 = 0.01;
    /// Time for which a tick's error stays the same, s: one count of a joint that moves at 0.1 rad/s.
    const COUNT_TIME_S: f32 = 0.015;
    /// Variance of a tick's measurement where all tensions are measured: bristles and bends leave 2 %.
    const TENSION_VARIANCE: f32 = 5e-4;
    /// Time constant of the mean innovation, s.
    const INNOVATION_TIME_S: f32 = 0.02;
    /// Growth of the variance a second, per square of the mean innovation, where all tensions are measured: 0.02 doubles
    /// the weight at the default rate. Where a count makes the innovations coarser it is less, as their square is more.
    const MOVED_PER_S: f32 = 45.0;
    /// Speed within which the observed speed of a pulley at rest is restless, rad/s.
    const TURNING_RAD_S: f32 = 0.03;
    /// Standard deviation of `mu K/2` from which on nothing is known.
    const KNOWN: f32 = 0.08;
    let (tendon, pulley) = (&parameters.tendon, &parameters.pulley);
    let fitted = fitted(parameters);
    let ratio = pulley.output_radius / pulley.input_radius;
    let friction_nm = 4.0 * tendon.pretension * pulley.input_radius;
    let stretch_nm = 4.0 * tendon.axial_stiffness * pulley.input_radius * pulley.input_radius / tendon.length;
    let half_zone_rad = tendon.pretension * tendon.length / (tendon.axial_stiffness * pulley.input_radius);
    let count_part = stretch_nm * RAD_PER_COUNT * ratio / friction_nm;
    let variance = match fitted {
        Fitted::All => TENSION_VARIANCE,
        Fitted::Nothing | Fitted::Input => {
            (count_part * count_part / 12.0 * COUNT_TIME_S / period_s).max(TENSION_VARIANCE)
        }
    };
    let backlash = &parameters.correction.backlash;
    let play_rad = backlash.enable * (backlash.transmission_gap + ratio * backlash.joint_gap);
    let filter_s = if fitted == Fitted::Nothing { CURRENT_FILTER_S } else { TENSION_FILTER_S };
    let rate = 0.5 * parameters.sheath.exponent_rate;
    // Each cable has every second tick.
    let turn_s = 2.0 * period_s;
    Ok(SheathConfig {
        fitted,
        adapts: parameters.sheath.adapts == 1.0,
        nominal: Ratio::from_f32(libm::tanhf(0.5 * friction_exponent(parameters))),
        friction: gain(friction_nm, "tendon.pretension")?,
        per_friction: gain(1.0 / friction_nm, "tendon.pretension")?,
        per_tension: gain(0.5 / tendon.pretension, "tendon.pretension")?,
        stretch: gain(stretch_nm, "tendon.axial_stiffness")?,
        zone: gain(ZONE_MARGIN * half_zone_rad, "tendon.axial_stiffness")?,
        play: Angle::from_f32(0.5 * ZONE_MARGIN * play_rad),
        turning: Speed::from_f32(TURNING_RAD_S),
        joint_play: Angle::from_f32(RAD_PER_COUNT + 0.5 * backlash.enable * backlash.joint_gap),
        half_zone: gain(half_zone_rad, "tendon.axial_stiffness")?,
        torque_ratio: gain(ratio, "pulley.output_radius")?,
        drive: gain(torque_constant(parameters), "motor.torque_constant")?,
        viscous: gain(parameters.motor.viscous, "motor.viscous")?,
        torque_filter: Weight::low_pass(filter_s, period_s),
        silent: Angle::from_f32(0.5 * SILENT_PART * RAD_PER_COUNT * ratio),
        process: Weight::new(rate * rate * turn_s),
        moved: Weight::new(MOVED_PER_S * TENSION_VARIANCE / variance * turn_s),
        innovation_filter: Weight::low_pass(INNOVATION_TIME_S, turn_s),
        per_noise: gain(2.0 / variance, "tendon.axial_stiffness")?,
        known_below: Ratio::from_f32(KNOWN * KNOWN),
    })
}
