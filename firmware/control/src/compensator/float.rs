//! The compensator in `f32`, operation by operation as in fixed point: what the FPU would need, for comparison only.

use super::{LagAngles, Source};
use crate::parameters::Parameters;

/// The compensator: configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FloatCompensator {
    source: Source,
    angles: LagAngles,
    threshold_rad_s: f32,
    step_limit_rad: f32,
    size_limit_rad: f32,
    torque_weight: f32,
    follow_weight: f32,
}

/// What it needs to know in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FloatInput {
    /// Desired angle of the joint, rad.
    pub theta_d_rad: f32,
    /// Desired speed of the joint, rad/s.
    pub omega_d_rad_s: f32,
    /// Measured output torque, N·m.
    pub torque_out_nm: f32,
    /// Half of the dead zone at the input pulley, rad.
    pub friction_rad: f32,
    /// The cables slip in the direction of the present travel.
    pub slips: bool,
    /// Measured angle of the input pulley less that of the joint, `theta_in - (r2/r1) theta_out`, rad.
    pub lag_rad: f32,
}

/// State of the compensator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FloatState {
    target_rad: f32,
    theta_f_rad: f32,
    torque_nm: f32,
    backward: bool,
}

impl FloatCompensator {
    /// The compensator of these parameters.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Self {
        let compensation = &parameters.compensator;
        let period_s = 1.0 / parameters.tick_rate_hz();
        Self {
            source: Source::of(parameters),
            angles: LagAngles::new(parameters),
            threshold_rad_s: compensation.speed_threshold,
            step_limit_rad: compensation.rate_limit * period_s,
            size_limit_rad: compensation.size_limit,
            torque_weight: period_s / (compensation.torque_filter + period_s),
            follow_weight: period_s / (compensation.encoder_time + period_s),
        }
    }
}

/// One tick; returns `theta_c`, rad.
#[inline(never)]
pub fn compensate_float(config: &FloatCompensator, state: &mut FloatState, input: &FloatInput) -> f32 {
    let within = |value: f32, limit: f32| value.max(-limit).min(limit);
    state.torque_nm += config.torque_weight * (input.torque_out_nm - state.torque_nm);
    let forward = input.omega_d_rad_s > config.threshold_rad_s;
    let backward = input.omega_d_rad_s < -config.threshold_rad_s;
    let stretch_rad = config.angles.stretch_rad_per_nm * state.torque_nm;
    match config.source {
        Source::Off => state.target_rad = 0.0,
        Source::Torque if forward => state.target_rad = stretch_rad + input.friction_rad,
        Source::Torque if backward => state.target_rad = stretch_rad - input.friction_rad,
        Source::Encoders if forward || backward => {
            let lag_rad = within(input.lag_rad, config.size_limit_rad);
            state.target_rad += config.follow_weight * (lag_rad - state.target_rad);
        }
        Source::Adaptive => {
            if forward || backward {
                state.backward = backward;
            }
            if input.slips && (forward || backward) {
                let friction_rad = if backward { -input.friction_rad } else { input.friction_rad };
                let stretch_rad = within(input.lag_rad, config.size_limit_rad) - friction_rad;
                state.target_rad += config.follow_weight * (stretch_rad - state.target_rad);
            }
        }
        Source::Torque | Source::Encoders => {}
    }
    let wanted_rad = match config.source {
        Source::Adaptive if state.backward => state.target_rad - input.friction_rad,
        Source::Adaptive => state.target_rad + input.friction_rad,
        Source::Off | Source::Torque | Source::Encoders => state.target_rad,
    };
    let target_rad = within(wanted_rad, config.size_limit_rad);
    state.theta_f_rad += within(target_rad - state.theta_f_rad, config.step_limit_rad);
    config.angles.ratio * input.theta_d_rad + state.theta_f_rad
}
