//! From angle or torque to the duty of the bridge.
//!
//! Both loops end in a torque at the input pulley, `τ`; from there
//!
//! `i = τ / (k_t N)`, within the current limit (flag [`Limit::Current`]); `v = R i + k_e N ω` with the observer's speed, so
//! that the current is limited by the model of the winding, without a current loop; `duty = v / v_bus`, within
//! the duty limit (flag [`Limit::Duty`]).
//!
//! | loop | law |
//! |---|---|
//! | position | `τ = J (k_p e + k_i ∫e dt + k_d (ω_c − ω) + α_c) + b ω + τ_m + g (F1 − F3) r1`, `e = θ_c − θ`; `k_p = ω_n²`, `k_d = 2ζω_n`, `k_i = k_p/T_i` |
//! | torque | `τ = (r1/r2)(T_d + g M s) + b ω + τ_m + k (e + ∫e dt/T_i) − d ω − d_T dT_in/dt`, `e = (r1/r2)(T_d − T_out)`, s the sign of `dT_d/dt`, `M = 2 F0 r2 mu K` of Eq. (15)-(17) with the `mu K` of [`crate::sheath`]; `g M s` and `dT_in/dt` are low-passed |
//!
//! Where the input tensions are not measured, the observer's disturbance stands for `(F1 − F3) r1`, and it is late: at a turn the
//! friction of the sheaths changes by `2 M`, and the pulley gives way by up to `2 M/(J k_p)` meanwhile, 60 mrad of the default joint.
//! With `compensator.source` 3 the position loop therefore feeds `(r1/r2) g M s` forward as the torque loop does, low-passed by the time
//! in which the compensator crosses the dead zone (`compensator.rate_limit`). The observer is told of it, so that its disturbance holds the
//! rest. `M` wrong by half leaves half of the error. Where the crossing takes longer than the disturbance does to settle, as on a joint
//! whose turns are slowed down because its load rings, nothing is fed forward. The term depends on the reference and on the estimated `mu K`, not on the joint's state: it adds no feedback.
//!
//! In position mode with `compensator.source` 3 and measured input tensions, `θ_c` yields to a load that rings ([`ring`]).
//!
//! `τ_m` is what [`crate::correction`] adds for friction and ripple of the motor; the duty gets what the bridge leaves of it.
//! The measured input torque is fed forward, so the position loop sees the rotor alone, whatever weight and friction do.
//! The integral rests (flag [`Limit::Integrator`]) while current or duty are at their limit and the error would push
//! further, and while the count does not tell an error.

pub mod ring;
pub mod yielding;

use bowden_link::{Limit, Limits};

use crate::correction::MotorCorrection;
use crate::correction::dead_zone::DeadZone;
use crate::drive::ring::{Ring, RingConfig};
use crate::observer::Motion;
use crate::scale::{
    Acceleration, Angle, Current, Gain, Quantity, Share, Speed, Sum, Torque, Voltage, Weight,
};

/// Motor, gear and bridge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveConfig {
    /// `1 / (k_t N)`.
    pub current_per_torque: Gain<Torque, Current>,
    /// Viscous friction `b` at the input pulley.
    pub viscous: Gain<Speed, Torque>,
    /// Winding resistance R.
    pub resistance: Gain<Current, Voltage>,
    /// `k_e N`.
    pub back_emf: Gain<Speed, Voltage>,
    /// Current that is never asked for.
    pub current_limit: Current,
    /// Largest duty, 1/32767.
    pub duty_limit_raw: i16,
    /// Positive duty turns towards -θ.
    pub reversed: bool,
    /// Friction and ripple of the motor.
    pub correction: MotorCorrection,
    /// Dead zone of the bridge.
    pub dead_zone: DeadZone,
}

/// Gains of the position loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionConfig {
    /// `k_p`.
    pub proportional: Gain<Angle, Acceleration>,
    /// `k_d`.
    pub derivative: Gain<Speed, Acceleration>,
    /// `k_i` a tick.
    pub integral: Weight<Angle, Acceleration>,
    /// Rotor inertia J at the input pulley.
    pub inertia: Gain<Acceleration, Torque>,
    /// Part of the reference's acceleration that is fed forward, at the input pulley.
    pub acceleration_feedforward: Gain<Acceleration, Acceleration>,
    /// Low-pass of it: corners of the reference would jerk the tendons.
    pub acceleration_filter: Weight<Acceleration, Acceleration>,
    /// Part of the input torque that is fed forward.
    pub load_feedforward: Gain<Torque, Torque>,
    /// Half a count.
    pub half_count: Angle,
    /// Damping of a load that rings; none where the input torque is not measured or the compensation is not adaptive.
    pub ring: Option<RingConfig>,
    /// Low-pass of the friction of the sheaths that is counted on; none where the input torque is measured or the compensation is
    /// not adaptive.
    pub expected_friction: Option<Weight<Torque, Torque>>,
}

/// Gains of the torque loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueConfig {
    /// `r1/r2`.
    pub at_input: Gain<Torque, Torque>,
    /// `k`.
    pub proportional: Gain<Torque, Torque>,
    /// `k/T_i` a tick.
    pub integral: Weight<Torque, Torque>,
    /// `d`.
    pub damping: Gain<Speed, Torque>,
    /// Damping by the rate of the input torque: `d_T/T_f`, `T_f` the time of the low-pass.
    pub lead: Gain<Torque, Torque>,
    /// Low-pass of the input torque, its difference to which is the rate.
    pub lead_filter: Weight<Torque, Torque>,
    /// `g`: part of the friction that is fed forward.
    pub friction: Gain<Torque, Torque>,
    /// Low-pass of what is fed forward.
    pub friction_filter: Weight<Torque, Torque>,
    /// The same for other friction.
    pub direction_filter: Weight<Share, Share>,
}

/// State of both loops.
#[derive(Clone, Copy, Debug, Default)]
pub struct Loops {
    acceleration: Sum<Acceleration>,
    feedforward: Sum<Acceleration>,
    ring: Ring,
    torque: Sum<Torque>,
    friction: Sum<Torque>,
    /// Friction of the sheaths that the position loop counts on, at the input pulley.
    expected: Torque,
    /// Low-passed input torque.
    slow: Sum<Torque>,
    /// The reference fell when it moved last.
    falls: bool,
    direction: Sum<Share>,
    direction_target: Share,
    /// Sign of the output that was at a limit in the last tick, 0 if none was.
    saturated: i8,
    /// Sign of what the limit of the output torque took off in this tick.
    yields: i8,
}

/// What the position loop follows and sees.
#[derive(Clone, Copy, Debug)]
pub struct PositionInput {
    /// Angle that the input pulley is to take.
    pub command: Angle,
    /// Speed that it is to take.
    pub command_speed: Speed,
    /// Acceleration of the joint's reference.
    pub acceleration: Acceleration,
    /// Angle of the encoder's count.
    pub measured: Angle,
    /// Observed angle and speed.
    pub motion: Motion,
    /// Measured input torque `(F1 - F3) r1`.
    pub torque_in: Torque,
    /// Torque that cancels the motor's ripple.
    pub ripple: Torque,
}

/// What the torque loop follows and sees.
#[derive(Clone, Copy, Debug)]
pub struct TorqueInput {
    /// Output torque that is asked for.
    pub wanted: Torque,
    /// Sign of its rate.
    pub rate_sign: i32,
    /// Output torque `(F2 - F4) r2`, measured or estimated.
    pub measured: Torque,
    /// Torque that the tendons take from the input pulley, measured or observed.
    pub load: Torque,
    /// The same where it is measured, else 0.
    pub measured_load: Torque,
    /// Friction torque of the sheaths at the joint, `M`.
    pub friction: Torque,
    /// Observed angle and speed of the input pulley.
    pub motion: Motion,
    /// Direction of motion, see [`Loops::direction`].
    pub direction: Share,
    /// Torque that cancels the motor's ripple.
    pub ripple: Torque,
}

impl Loops {
    /// Whether an integral may take an error of this sign; sets the flag if not.
    fn may_integrate(&self, error_bits: i32, limits: &mut Limits) -> bool {
        let pushes = (self.saturated > 0 && error_bits > 0) || (self.saturated < 0 && error_bits < 0);
        if pushes {
            limits.insert(Limit::Integrator);
        }
        !pushes
    }

    /// Friction of the sheaths in the direction of the reference, at the input pulley; 0 where it is measured. `friction` is that of the
    /// joint.
    #[inline]
    pub fn expect_friction(
        &mut self,
        config: &PositionConfig,
        torque: &TorqueConfig,
        rate_sign: i32,
        friction: Torque,
    ) -> Torque {
        let Some(filter) = config.expected_friction else { return Torque::ZERO };
        let friction = torque.at_input.apply(self.along(rate_sign, torque.friction.apply(friction)));
        self.expected = self.friction.approach(filter, friction);
        self.expected
    }

    /// Friction in the direction in which the reference moved last.
    #[inline]
    fn along(&mut self, rate_sign: i32, friction: Torque) -> Torque {
        match rate_sign {
            1.. => self.falls = false,
            0 => {}
            _ => self.falls = true,
        }
        if self.falls { friction.negated() } else { friction }
    }

    /// Friction that was counted on in the last tick.
    #[inline]
    #[must_use]
    pub const fn expected(&self) -> Torque {
        self.expected
    }

    /// Torque that accelerates the rotor as the reference wants it; 0 where friction is not expected.
    #[inline]
    #[must_use]
    pub fn accelerating(&self, config: &PositionConfig) -> Torque {
        match config.expected_friction {
            Some(_) => config.inertia.apply(self.feedforward.value()),
            None => Torque::ZERO,
        }
    }

    /// Torque for the input pulley that the position loop asks for.
    #[inline]
    pub fn position(
        &mut self,
        config: &PositionConfig,
        drive: &DriveConfig,
        input: &PositionInput,
        limits: &mut Limits,
    ) -> Torque {
        let command = match &config.ring {
            Some(ring) => input.command.minus(self.ring.yields(ring, input.torque_in)),
            None => input.command,
        };
        let error = command.minus(input.motion.angle);
        let told = !command.minus(input.measured).is_at_most(config.half_count);
        let yields = i32::from(self.yields) * error.to_bits().signum() > 0;
        if told && !yields && self.may_integrate(error.to_bits(), limits) {
            self.acceleration.add(config.integral, error);
        }
        let wanted = config.acceleration_feedforward.apply(input.acceleration);
        let wanted = self.feedforward.approach(config.acceleration_filter, wanted);
        let friction = drive.correction.torque_along(input.command_speed, input.torque_in);
        let speed_error = input.command_speed.minus(input.motion.speed);
        let acceleration = config
            .proportional
            .apply(error)
            .plus(config.derivative.apply(speed_error))
            .plus(self.acceleration.value())
            .plus(wanted);
        config
            .inertia
            .apply(acceleration)
            .plus(drive.viscous.apply(input.motion.speed))
            .plus(friction.plus(input.ripple))
            .plus(config.load_feedforward.apply(input.torque_in))
    }

    /// Direction of motion in the torque loop, -1 to 1: that of the observed speed, and while the input pulley stands, the
    /// low-passed sign of the reference's rate.
    pub fn direction(
        &mut self,
        config: &TorqueConfig,
        drive: &DriveConfig,
        rate_sign: i32,
        speed: Speed,
    ) -> Share {
        /// Bits by which the observed speed, which is restless within 0.03 rad/s, tells less than a desired one.
        const RESTLESS_BITS: u32 = 5;
        match rate_sign {
            1.. => self.direction_target = Share::ONE,
            0 => {}
            _ => self.direction_target = Share::ONE.negated(),
        }
        let expected = self.direction.approach(config.direction_filter, self.direction_target);
        let seen = drive.correction.direction.of(Speed::from_bits(speed.to_bits() >> RESTLESS_BITS));
        seen.plus(Share::ONE.minus(seen.magnitude()).of(expected))
    }

    /// Torque for the input pulley that the torque loop asks for.
    pub fn torque(
        &mut self,
        config: &TorqueConfig,
        drive: &DriveConfig,
        input: &TorqueInput,
        limits: &mut Limits,
    ) -> Torque {
        let TorqueInput {
            wanted,
            rate_sign,
            measured,
            load,
            measured_load,
            friction,
            motion,
            direction,
            ripple,
        } = *input;
        let speed = motion.speed;
        let slow = self.slow.approach(config.lead_filter, measured_load);
        let friction = self.along(rate_sign, config.friction.apply(friction));
        let friction = self.friction.approach(config.friction_filter, friction);
        let error = config.at_input.apply(wanted.minus(measured));
        if self.may_integrate(error.to_bits(), limits) {
            self.torque.add(config.integral, error);
        }
        config
            .at_input
            .apply(wanted.plus(friction))
            .plus(config.proportional.apply(error))
            .plus(self.torque.value())
            .plus(drive.viscous.apply(speed))
            .plus(drive.correction.torque(direction, speed, load).plus(ripple))
            .minus(config.damping.apply(speed))
            .minus(config.lead.apply(measured_load.minus(slow)))
    }

    /// Duty that makes this torque, 1/32767, within all limits.
    #[inline]
    pub fn duty(
        &mut self,
        config: &DriveConfig,
        torque: Torque,
        speed: Speed,
        bus: Voltage,
        limits: &mut Limits,
    ) -> i16 {
        /// Bits of a voltage that are dropped ahead of the division: 1 mV is left.
        const DROPPED: u32 = 10;
        /// 1 V to 63 V in what is left, so that the product with 32767 fits 32 bits.
        const BUS_RANGE: (i32, i32) = (1 << 10, 63 << 10);
        let wanted = config.current_per_torque.apply(torque);
        let current = wanted.limited(config.current_limit);
        let mut saturated = wanted != current;
        if saturated {
            limits.insert(Limit::Current);
        }
        let voltage = config.resistance.apply(current).plus(config.back_emf.apply(speed));
        let bus_mv = (bus.to_bits() >> DROPPED).max(BUS_RANGE.0).min(BUS_RANGE.1);
        let voltage_mv = (voltage.to_bits() >> DROPPED).max(-bus_mv).min(bus_mv);
        let full = config.dead_zone.duty_raw(voltage_mv * i32::from(i16::MAX) / bus_mv);
        let limit = i32::from(config.duty_limit_raw);
        let duty = full.max(-limit).min(limit);
        if duty != full {
            saturated = true;
            limits.insert(Limit::Duty);
        }
        self.saturated = if saturated { torque.to_bits().signum() as i8 } else { 0 };
        let duty = duty as i16;
        if config.reversed { -duty } else { duty }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::Parameters;
    use crate::tick::TickConfig;
    use crate::tick_config;

    fn config() -> TickConfig {
        tick_config(&Parameters::default()).unwrap()
    }

    fn duty(config: &DriveConfig, torque_nm: f32, speed_rad_s: f32, bus_v: f32) -> (i16, Limits) {
        let mut limits = Limits::default();
        let (torque, speed) = (Torque::from_f32(torque_nm), Speed::from_f32(speed_rad_s));
        let duty = Loops::default().duty(config, torque, speed, Voltage::from_f32(bus_v), &mut limits);
        (duty, limits)
    }

    #[test]
    fn duty_by_hand() {
        // k_t N = 0.9 N·m/A, R = 2 Ω: 0.9 N·m are 1 A are 2 V; 10 rad/s are 9 V more. Of 24 V that is 11/24.
        let mut config = config().drive;
        for (torque, speed, bus, expected) in
            [(0.9, 0.0, 24.0, 2.0 / 24.0), (0.9, 10.0, 24.0, 11.0 / 24.0), (-0.9, 10.0, 20.0, 7.0 / 20.0)]
        {
            let (duty, limits) = duty(&config, torque, speed, bus);
            // 1 mV of both voltages.
            assert!((f32::from(duty) - expected * 32767.0).abs() < 3.0, "{duty} for {expected}");
            assert_eq!(limits, Limits::default());
        }
        let (forward, _) = duty(&config, 0.9, 1.0, 24.0);
        config.reversed = true;
        assert_eq!(duty(&config, 0.9, 1.0, 24.0).0, -forward);
    }

    #[test]
    fn current_and_duty_are_limited_and_told() {
        let config = config().drive;
        // 9 N·m would be 10 A; 3 A are 6 V, whatever the speed adds.
        let (value, limits) = duty(&config, -9.0, 0.0, 24.0);
        assert!((f32::from(value) + 6.0 / 24.0 * 32767.0).abs() < 3.0, "{value}");
        assert!(limits.contains(Limit::Current) && !limits.contains(Limit::Duty));
        // 26 rad/s are 23.4 V; 0.95 of 24 V are left.
        let (value, limits) = duty(&config, 0.9, 26.0, 24.0);
        assert_eq!(value, 31_129);
        assert!(limits.contains(Limit::Duty) && !limits.contains(Limit::Current));
        // A bus that is not there divides by no zero.
        for bus_v in [0.0, -5.0, 2000.0] {
            let (value, _) = duty(&config, 2000.0, 2000.0, bus_v);
            assert!((0..=31_129).contains(&value), "{value} at {bus_v} V");
        }
    }

    #[test]
    fn friction_that_is_not_measured_is_expected_in_the_direction_of_the_reference() {
        let expected_nm = |source: f32, fitted: f32, rate_limit: f32, signs: &[i32]| {
            let mut parameters = Parameters::default();
            parameters.compensator.source = source;
            parameters.compensator.rate_limit = rate_limit;
            parameters.tension.fitted = fitted;
            parameters.pulley.output_radius = 0.03;
            let config = tick_config(&parameters).unwrap();
            let mut loops = Loops::default();
            for sign in signs {
                // A fifth of a second: ten times the low-pass of a crossing at 1 rad/s.
                for _ in 0..2000 {
                    loops.expect_friction(&config.position, &config.torque, *sign, Torque::from_f32(0.4));
                }
            }
            loops.expected().to_f32()
        };
        // The input pulley is half as large: 0.2 N·m there. A reference that stands leaves the direction.
        for (signs, expected) in [(&[1][..], 0.2), (&[1, 0], 0.2), (&[1, -1], -0.2), (&[1, -1, 0], -0.2)] {
            assert!((expected_nm(3.0, 0.0, 1.0, signs) - expected).abs() < 1e-4, "{signs:?}");
        }
        // F0 L tanh(mu K/2)/(EA r1) is 5.11 mrad to either side: at 0.2 rad/s 51.1 ms, so 0.2 (1 - e^-3.914) after 0.2 s.
        let slow_nm = expected_nm(3.0, 0.0, 0.2, &[1]);
        assert!((slow_nm - 0.196_01).abs() < 1e-3, "{slow_nm}");
        // The disturbance of the observer with 20 Hz settles within 95 ms: 0.107 rad/s.
        assert!(expected_nm(3.0, 0.0, 0.11, &[1]) > 0.1);
        assert_eq!(expected_nm(3.0, 0.0, 0.10, &[1]), 0.0);
        // Tensions at the motor are measured; and what is not followed is not expected.
        for (source, fitted) in [(3.0, 1.0), (3.0, 2.0), (0.0, 0.0), (1.0, 0.0)] {
            assert_eq!(expected_nm(source, fitted, 1.0, &[1]), 0.0, "source {source}, fitted {fitted}");
        }
    }

    #[test]
    fn the_integral_rests_at_a_limit_and_within_a_count() {
        let config = config();
        let run = |command_rad: f32, measured_rad: f32| {
            let mut loops = Loops::default();
            let mut limits = Limits::default();
            let motion = Motion { angle: Angle::from_f32(measured_rad), speed: Speed::ZERO };
            let input = PositionInput {
                command: Angle::from_f32(command_rad),
                command_speed: Speed::ZERO,
                acceleration: Acceleration::ZERO,
                measured: motion.angle,
                motion,
                torque_in: Torque::ZERO,
                ripple: Torque::ZERO,
            };
            for _ in 0..1000 {
                limits = Limits::default();
                let torque = loops.position(&config.position, &config.drive, &input, &mut limits);
                loops.duty(&config.drive, torque, Speed::ZERO, Voltage::from_f32(24.0), &mut limits);
            }
            (loops.acceleration.value().to_f32(), limits.contains(Limit::Integrator))
        };
        // 0.05 rad: 2527·0.05 = 126 rad/s², and after 0.1 s, the reset time, as much again.
        let (integral, rests) = run(0.05, 0.0);
        assert!((integral - 126.3).abs() < 1.0 && !rests, "{integral}");
        // 1 rad asks for 12.6 A of the 3 A that there are: not a tick more than the first.
        let (integral, rests) = run(-1.0, 0.0);
        assert!(integral.abs() < 3.0 && rests, "{integral}");
        // 0.7 mrad is within half a count.
        assert_eq!(run(0.000_7, 0.0), (0.0, false));
    }
}
