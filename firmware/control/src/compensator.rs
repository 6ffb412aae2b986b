//! Position compensator, Eq. (20) and (24)-(26) of Wu et al., Sensors 2020, 20(5), 1301, in the form derived in
//! `model/docs/derivation.md`, section 6.
//!
//! `theta_c = (r2/r1) theta_d + theta_f` (25). `theta_f` is a slow, limited image of the lag angle at the input pulley:
//!
//! | step | equation |
//! |---|---|
//! | lag from the torque | `target = (r2/r1) phi`, `phi = (L tanh(a/2)/(EA r2)) (T_out/(a r2) ± F0)`, sign of the desired speed (20), (26) |
//! | lag from the encoders | `target += w (theta_in - (r2/r1) theta_out - target)`, (22), while the reference moves |
//! | standstill | target held while the desired speed is within the threshold (24), (26) |
//! | size | `target` within ± `compensator.size_limit`; flag [`bowden_link::Limit::Compensation`] |
//! | rate | `theta_f` moves to the target by `compensator.rate_limit` a second at most |
//!
//! Why not as printed. (26) jumps by the dead zone at every turn; a motor cannot, and a jump rings the load on its
//! tendons. In the paper's experiment the lag is the one measured a step ago, so that `theta_c` gathers the output error once
//! a step: an integrator with the step rate as its gain, 10 kHz here, unstable with any motor. The weight `w` makes its
//! time constant a parameter, and makes the loop leak: `theta_f` returns to what the encoders show now. The torque is
//! low-passed because stretch compensation is a positive feedback through the tendons whose gain is 1 at a blocked joint.

mod config;
pub mod float;

pub use config::{Compensator, LagAngles, Source};

use crate::scale::{Angle, Speed, Sum, Torque};

/// What the compensator needs to know in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CompensatorInput {
    /// Desired angle of the joint.
    pub theta_d: Angle,
    /// Desired speed of the joint.
    pub omega_d: Speed,
    /// Output torque `(F2 - F4) r2`, measured or estimated.
    pub torque_out: Torque,
    /// Half of the dead zone at the input pulley, `F0 L tanh(mu K/2)/(EA r1)`.
    pub friction: Angle,
    /// The cables slip in the direction of the present travel.
    pub slips: bool,
    /// Measured angle of the input pulley less that of the joint, `theta_in - (r2/r1) theta_out` of Eq. (22).
    pub lag: Angle,
}

/// Result of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CompensatorOutput {
    /// Angle that the input pulley is to take.
    pub theta_c: Angle,
    /// Its part for stretch and friction.
    pub theta_f: Angle,
    /// The lag is beyond the limit of its size.
    pub limited: bool,
}

/// State of the compensator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CompensatorState {
    target: Sum<Angle>,
    theta_f: Angle,
    torque: Sum<Torque>,
    /// The reference moved towards -theta when it moved last.
    backward: bool,
}

impl CompensatorState {
    /// Starts without a jump: the lag is the one that the encoders show, as far as its limit allows.
    #[must_use]
    pub fn starting_at(config: &Compensator, input: &CompensatorInput) -> Self {
        let lag = input.lag.limited(config.size_limit);
        Self { target: Sum::at(lag), theta_f: lag, torque: Sum::at(input.torque_out), backward: false }
    }
}

/// One tick: 82 instructions of a Cortex-M4 with the source off, 101 from the torque, 102 from the encoders; kept out of
/// line so that they can be counted. [`float::compensate_float`] takes 89, 95 and 133 with the FPU.
///
/// Error against `bowden-model` in f64, in slip and settled: at most 2.2 steps of 2⁻²⁰ rad, RMS 0.7, bias 0.25 (test
/// `errors_against_f64`; measured 1.4, 0.49, 0.01).
#[inline(never)]
pub fn compensate(
    config: &Compensator,
    state: &mut CompensatorState,
    input: &CompensatorInput,
) -> CompensatorOutput {
    let torque = state.torque.approach(config.torque_filter, input.torque_out);
    let forward = input.omega_d > config.threshold;
    let backward = input.omega_d < config.threshold.negated();
    match config.source {
        Source::Off => state.target = Sum::at(Angle::ZERO),
        Source::Torque if forward => {
            state.target = Sum::at(config.stretch.apply(torque).plus(input.friction));
        }
        Source::Torque if backward => {
            state.target = Sum::at(config.stretch.apply(torque).minus(input.friction));
        }
        Source::Encoders if forward || backward => {
            // Limited ahead of the sum, so that the sum never has to come back from afar.
            state.target.approach(config.follow, input.lag.limited(config.size_limit));
        }
        Source::Adaptive => {
            if forward || backward {
                state.backward = backward;
            }
            // What the lag has beyond friction, stretch under the load, changes with the load and not at a turn.
            if input.slips && (forward || backward) {
                let stretch = input.lag.limited(config.size_limit).minus(signed(input.friction, backward));
                state.target.approach(config.follow, stretch);
            }
        }
        Source::Torque | Source::Encoders => {}
    }
    let wanted = match config.source {
        Source::Adaptive => state.target.value().plus(signed(input.friction, state.backward)),
        Source::Off | Source::Torque | Source::Encoders => state.target.value(),
    };
    let target = wanted.limited(config.size_limit);
    let step = target.minus(state.theta_f).limited(config.step_limit);
    state.theta_f = state.theta_f.plus(step);
    let limited = wanted.magnitude() >= config.size_limit && config.source != Source::Off;
    CompensatorOutput {
        theta_c: config.at_input(input.theta_d).plus(state.theta_f),
        theta_f: state.theta_f,
        limited,
    }
}

#[inline]
fn signed(friction: Angle, backward: bool) -> Angle {
    if backward { friction.negated() } else { friction }
}
