//! Position with a limit of the output torque: the joint yields when somebody holds or pushes it.
//!
//! The torque `τ` that the position loop asks for is kept between two torque loops, one that would hold the output torque at
//! `+T` and one at `−T`: `(1 + k)(r1/r2)(±T) + c`, where both have in common
//!
//! `c = −k (r1/r2) T_out + I + (b − d) ω − d_T dT_in/dt`, the letters as in [`super`].
//!
//! | situation | what happens |
//! |---|---|
//! | free joint | `τ` is far from both bounds and passes unchanged |
//! | held joint | `τ` is at a bound (flag [`Limit::OutputTorque`]): the output torque is controlled, and the joint follows the hand |
//! | reference comes back, or the hand lets go | `τ` leaves the bound where both are equal, without a jump |
//!
//! Nothing winds up: the integral of the position loop rests while the bound acts and the error pushes further; `I`, which
//! makes up for friction while the bound acts, decays in `friction_filter` while it does not. The position error that the
//! loop sees is limited to what brings the joint back at its largest speed and acceleration ([`YieldConfig::command`]).

use bowden_link::{Limit, Limits};

use super::{Loops, TorqueConfig};
use crate::parameters::{Parameters, Reach};
use crate::scale::{Angle, Gain, Quantity, Speed, Sum, Torque};

/// Limits of the hybrid mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct YieldConfig {
    /// Largest output torque `T`.
    limit: Torque,
    /// `(1 + k)(r1/r2) T`.
    span: Torque,
    /// `k (r1/r2)`.
    present: Gain<Torque, Torque>,
    /// `b − d`.
    drag: Gain<Speed, Torque>,
    /// Largest position error that the loop sees, at the input pulley.
    error: Angle,
}

/// What the bounds are made from.
#[derive(Clone, Copy, Debug)]
pub struct YieldInput {
    /// Torque that the position loop asks for.
    pub wanted: Torque,
    /// Output torque `(F2 - F4) r2`, measured or estimated.
    pub measured: Torque,
    /// Torque that the tendons take from the input pulley where it is measured, else 0.
    pub measured_load: Torque,
    /// Observed speed of the input pulley.
    pub speed: Speed,
}

impl YieldConfig {
    /// Limits of a joint with these parameters, whose torque loop has this gain and this damping; `None` beyond fixed point.
    #[must_use]
    pub fn new(parameters: &Parameters, gain: f32, damping: f32) -> Option<Self> {
        let (reach, controller) = (Reach::yielding(parameters), &parameters.controller);
        let natural = core::f32::consts::TAU * controller.bandwidth;
        let ratio = parameters.pulley.output_radius / parameters.pulley.input_radius;
        // The loop comes back with constant speed while its error is limited: k_p e = k_d v. Then the error decays; with critical
        // damping the largest deceleration on the way is ω_n v/e.
        let speed = reach.speed.min(reach.acceleration * core::f32::consts::E / natural);
        let error = 2.0 * controller.damping / natural * speed * ratio;
        Some(Self {
            limit: Torque::from_f32(reach.torque),
            span: Torque::from_f32((1.0 + gain) / ratio * reach.torque),
            present: Gain::new(gain / ratio)?,
            drag: Gain::new(parameters.motor.viscous - damping)?,
            error: Angle::from_f32(error),
        })
    }

    /// The angle nearest to `command` that the position loop may be asked for at `angle`.
    #[must_use]
    #[inline]
    pub fn command(&self, command: Angle, angle: Angle) -> Angle {
        angle.plus(command.minus(angle).limited(self.error))
    }
}

impl Loops {
    /// The torque nearest to the wanted one that keeps the output torque within its limit.
    pub fn yielding(
        &mut self,
        config: &YieldConfig,
        torque: &TorqueConfig,
        input: &YieldInput,
        limits: &mut Limits,
    ) -> Torque {
        let YieldInput { wanted, measured, measured_load, speed } = *input;
        let slow = self.slow.approach(torque.lead_filter, measured_load);
        let middle = self
            .torque
            .value()
            .minus(config.present.apply(measured))
            .plus(config.drag.apply(speed))
            .minus(torque.lead.apply(measured_load.minus(slow)));
        let bounded = middle.plus(wanted.minus(middle).limited(config.span));
        let over = wanted.minus(bounded).to_bits().signum();
        self.yields = over as i8;
        if over == 0 {
            if self.torque != Sum::default() {
                self.torque.approach(torque.friction_filter, Torque::ZERO);
            }
        } else {
            limits.insert(Limit::OutputTorque);
            let bound = if over > 0 { config.limit } else { config.limit.negated() };
            let error = torque.at_input.apply(bound.minus(measured));
            if self.may_integrate(error.to_bits(), limits) {
                self.torque.add(torque.integral, error);
            }
        }
        bounded
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::Motion;
    use crate::tick_config;

    fn parameters(limit: f32) -> Parameters {
        let mut parameters = Parameters::default();
        parameters.limits.contact_torque = limit;
        parameters
    }

    #[test]
    fn the_bounds_by_hand() {
        // r1 = r2, k = 4, b = 0.02, d = 0.2: with 0.1 N·m at the joint and 1 rad/s, 5·(±0.3) - 0.4 + 0.02 - 0.2 N·m.
        let config = tick_config(&parameters(0.3)).unwrap();
        for (wanted, expected, acts) in
            [(2.0, 0.92, true), (0.9, 0.9, false), (-2.0, -2.0, false), (-3.0, -2.08, true)]
        {
            let (mut loops, mut limits) = (Loops::default(), Limits::default());
            let input = YieldInput {
                wanted: Torque::from_f32(wanted),
                measured: Torque::from_f32(0.1),
                measured_load: Torque::ZERO,
                speed: Speed::from_f32(1.0),
            };
            let mut bounded = || loops.yielding(&config.yielding, &config.torque, &input, &mut limits);
            let got = bounded().to_f32();
            assert!((got - expected).abs() < 1e-5, "{wanted}: {got}");
            // k/T_i of the error a tick: 4/0.1·0.1 ms·(±0.3 - 0.1) N·m.
            let step = bounded().to_f32() - got;
            let due = if acts { 4e-3 * (0.3_f32.copysign(wanted) - 0.1) } else { 0.0 };
            assert!((step - due).abs() < 1e-5, "{wanted}: {step}");
            assert_eq!(limits.contains(Limit::OutputTorque), acts);
        }
    }

    #[test]
    fn the_position_integral_rests_while_the_limit_takes_away_what_it_would_add() {
        let config = tick_config(&Parameters::default()).unwrap();
        for (yields, error_rad, rests) in
            [(1, 0.05, true), (1, -0.05, false), (-1, -0.05, true), (0, 0.05, false)]
        {
            let mut loops = Loops { yields, ..Loops::default() };
            let input = super::super::PositionInput {
                command: Angle::from_f32(error_rad),
                command_speed: Speed::ZERO,
                acceleration: crate::scale::Acceleration::ZERO,
                measured: Angle::ZERO,
                motion: Motion::default(),
                torque_in: Torque::ZERO,
                ripple: Torque::ZERO,
            };
            let _ = loops.position(&config.position, &config.drive, &input, &mut Limits::default());
            assert_eq!(loops.acceleration.value().to_bits() == 0, rests, "{yields} {error_rad}");
        }
    }

    #[test]
    fn the_error_that_is_seen_brings_the_joint_back_at_its_largest_speed_and_acceleration() {
        // Default joint: 3 rad/s, and ω_n v/e = 50.3·3/2.718 = 55.5 rad/s² where 52.8 are allowed: 2.85 rad/s·2/50.3.
        let config = tick_config(&parameters(100.0)).unwrap().yielding;
        let far = config.command(Angle::from_f32(-1.0), Angle::from_f32(0.2)).to_f32();
        assert!((far - (0.2 - 0.1135)).abs() < 1e-3, "{far}");
        let near = Angle::from_f32(0.25);
        assert_eq!(config.command(near, Angle::from_f32(0.2)), near);
    }
}
