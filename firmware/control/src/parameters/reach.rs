//! What the joint can be asked to do: from pretension, friction, load and motor.
//!
//! `a = mu K`, `s` the tension below which no tendon may get, `r1`, `r2` the pulleys. The tendons lose most while the motor
//! pulls: `F1 = e^a F2`, `F4 = e^a F3`. Both cables together are as long as at rest, so their mean tensions add up to
//! `2 F0`: `F2 (e^a − 1)/a + F4 (1 − e^(−a))/a = 2 F0`. From these:
//!
//! | quantity | equation |
//! |---|---|
//! | torque with the lowest tension at `s` | `T_s = r2 (2 F0 a/(e^a − 1) − s (e^a + 1))` |
//! | torque with the highest tension at `o` | `T_o = r2 (o e^(−a) (1 + e^a) − 2 F0 a/(1 − e^(−a)))` |
//! | torque at the input pulley | `T_in = r1 (T/r2 + 2 F0 a)` |
//! | output torque of a motion | `T = J α + m g l sin θ`, `J = m l² + I` |
//!
//! The joint dragging the motor is milder: there the lowest tension is reached at a torque larger by `e^a` or more.
//! The part [`DYNAMIC_SHARE`] of what gravity leaves is planned with; the rest is for what the loop and the tendons'
//! oscillation add.

use bowden_link::message::Mode;
use libm::{expf, expm1f, sinf, sqrtf};

use super::Parameters;

/// Gravity, m/s².
const GRAVITY_M_S2: f32 = 9.81;
/// Margin of the tensions to slack and over-tension, as a part of the pretension.
const TENSION_MARGIN: f32 = 0.1;
/// Part of the torque that is left beside gravity which a motion may take.
const DYNAMIC_SHARE: f32 = 0.2;
/// Part of the torque that the tendons bear which gravity may take at rest.
const STATIC_SHARE: f32 = 0.95;
/// Part of the motor's torque that is planned with.
const MOTOR_SHARE: f32 = 0.9;
/// Time in which the acceleration may rise, in units of the inverse of the natural frequency of load and tendons.
const RISE: f32 = 4.0;
/// Part of the stiffness of both tendons that the impedance mode may ask for.
const STIFFNESS_SHARE: f32 = 0.5;
/// Time in which the rate of a torque may rise, s.
const TORQUE_RISE_S: f32 = 0.02;

/// Limits of motion, SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// Angles at which the joint can stand, rad.
    pub angle: [f32; 2],
    /// Largest speed, rad/s.
    pub speed: f32,
    /// Largest acceleration at angle zero, rad/s².
    pub acceleration: f32,
    /// Part of it that gravity takes away from zero at a quarter turn, rad/s².
    pub gravity: f32,
    /// Largest jerk, rad/s³.
    pub jerk: f32,
    /// Largest output torque, N·m.
    pub torque: f32,
    /// Torque of gravity at a quarter turn, m g l, N·m.
    pub weight: f32,
    /// Largest rate of the torque, N·m/s.
    pub torque_rate: f32,
    /// Largest change of that rate, N·m/s².
    pub torque_acceleration: f32,
    /// Largest change of that, N·m/s³.
    pub torque_jerk: f32,
    /// Largest stiffness of the impedance mode, N·m/rad.
    pub stiffness: f32,
    /// Largest damping of the impedance mode, N·m·s/rad.
    pub damping: f32,
}

impl Reach {
    /// The reach of a joint with these parameters.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Self {
        Self::in_mode(parameters, false)
    }

    /// The reach in a mode that keeps the output torque within `limits.contact_torque`.
    #[must_use]
    pub fn yielding(parameters: &Parameters) -> Self {
        Self::in_mode(parameters, true)
    }

    /// The reach in this mode.
    #[must_use]
    pub fn of(parameters: &Parameters, mode: Mode) -> Self {
        match mode {
            Mode::Position | Mode::Torque => Self::new(parameters),
            Mode::Hybrid | Mode::Impedance => Self::yielding(parameters),
        }
    }

    fn in_mode(parameters: &Parameters, yields: bool) -> Self {
        let limits = &parameters.limits;
        let ratio = parameters.pulley.output_radius / parameters.pulley.input_radius;
        let load = &parameters.load;
        let inertia = load.mass * load.arm * load.arm + load.inertia;
        let weight = load.mass * GRAVITY_M_S2 * load.arm;
        let motor = Motor::new(parameters, ratio);
        let bearable = tendon_torque(parameters).min(motor.output_torque).max(0.0);
        let torque = if yields { bearable.min(limits.contact_torque) } else { bearable };

        let speed = limits.speed.min(motor.speed).min(0.5 * parameters.encoder.speed_limit / ratio.max(1.0));
        let most = limits.acceleration.min(motor.acceleration(torque, speed));
        let per_inertia = |torque: f32| if inertia > 0.0 { torque / inertia } else { f32::MAX };
        let acceleration = most.min(per_inertia(DYNAMIC_SHARE * torque));
        let raised = per_inertia(DYNAMIC_SHARE * (torque - weight)).min(acceleration);
        let stiffness = 2.0 * parameters.tendon.axial_stiffness / parameters.tendon.length;
        let radius = parameters.pulley.output_radius;
        let stiffness = stiffness * radius * radius;
        let natural = sqrtf(per_inertia(stiffness));
        let held = STATIC_SHARE * torque;
        let end = if weight > held { libm::asinf(held / weight) } else { f32::MAX };
        let rate = limits.torque_rate;
        Self {
            angle: [limits.angle_minimum.max(-end), limits.angle_maximum.min(end)],
            speed,
            acceleration,
            gravity: acceleration - raised,
            jerk: limits.jerk.min(acceleration * natural / RISE),
            torque: if yields { torque } else { limits.torque.min(torque) },
            weight,
            torque_rate: rate,
            torque_acceleration: rate / TORQUE_RISE_S,
            torque_jerk: rate / (TORQUE_RISE_S * TORQUE_RISE_S),
            stiffness: STIFFNESS_SHARE * stiffness,
            damping: motor.damping(parameters, ratio),
        }
    }

    /// Largest acceleration away from zero at `angle_rad`, rad/s².
    #[must_use]
    pub fn outward(&self, angle_rad: f32) -> f32 {
        let angle = angle_rad.abs().min(core::f32::consts::FRAC_PI_2);
        self.acceleration - self.gravity * sinf(angle)
    }

    /// Torque outward that may be left at an end of the range, N·m: most of what gravity holds there. `outward_rad` is the
    /// angle of the end, negated for the lower one.
    #[must_use]
    pub fn left_torque(&self, outward_rad: f32) -> f32 {
        const SHARE: f32 = 0.8;
        SHARE * self.weight * sinf(outward_rad.clamp(0.0, core::f32::consts::FRAC_PI_2))
    }
}

/// Output torque at which no tension is below slack or above over-tension, with their margin, N·m.
fn tendon_torque(parameters: &Parameters) -> f32 {
    let (tension, tendon) = (&parameters.tension, &parameters.tendon);
    let margin = TENSION_MARGIN * tendon.pretension;
    let (least, most) = (tension.slack + margin, tension.over - margin);
    let radius = parameters.pulley.output_radius;
    let exponent = parameters.sheath.friction_coefficient * parameters.sheath.wrap_angle;
    let ratio = expf(exponent);
    // a/(e^a - 1), 1 without friction.
    let part = if exponent > 1e-6 { exponent / expm1f(exponent) } else { 1.0 };
    let slack = radius * (2.0 * tendon.pretension * part - least * (ratio + 1.0));
    let over = radius * (most * (1.0 + ratio) / ratio - 2.0 * tendon.pretension * part * ratio);
    slack.min(over)
}

/// What the motor can do, at the output.
struct Motor {
    /// Torque at the input pulley, N·m.
    torque: f32,
    /// Output torque at rest, N·m.
    output_torque: f32,
    /// Speed of the joint with that torque, rad/s.
    speed: f32,
    /// Part of the input torque that an output torque asks for.
    torque_ratio: f32,
    friction: f32,
    viscous: f32,
    inertia: f32,
}

impl Motor {
    /// Damping at the joint with which the rotor slows down as fast as the observer follows it, N·m·s/rad.
    fn damping(&self, parameters: &Parameters, ratio: f32) -> f32 {
        let controller = &parameters.controller;
        let observer = core::f32::consts::TAU * controller.observer_bandwidth;
        self.inertia * ratio * observer / (1.0 + controller.torque_gain)
    }

    fn new(parameters: &Parameters, ratio: f32) -> Self {
        /// Part of the least voltage that the winding's resistance may take.
        const RESISTIVE_SHARE: f32 = 0.8;
        let (motor, tendon) = (&parameters.motor, &parameters.tendon);
        let constant = motor.torque_constant * motor.gear_ratio;
        let voltage = parameters.bridge.duty_limit * parameters.supervisor.bus_minimum;
        let current = parameters.limits.current.min(RESISTIVE_SHARE * voltage / motor.resistance);
        let torque = MOTOR_SHARE * constant * current;
        let exponent = parameters.sheath.friction_coefficient * parameters.sheath.wrap_angle;
        let friction = 2.0 * tendon.pretension * exponent * parameters.pulley.input_radius;
        Self {
            torque,
            output_torque: (torque - friction) * ratio,
            speed: (voltage - motor.resistance * current) / (constant * ratio),
            torque_ratio: 1.0 / ratio,
            friction,
            viscous: motor.viscous * ratio,
            inertia: motor.rotor_inertia * motor.gear_ratio * motor.gear_ratio * ratio,
        }
    }

    /// Acceleration of the joint for which there is torque beside the output torque, friction and speed, rad/s²; a tenth of
    /// the motor's torque is always for it.
    fn acceleration(&self, output_torque: f32, speed: f32) -> f32 {
        let taken = output_torque * self.torque_ratio + self.friction + self.viscous * speed;
        (self.torque - taken).max(0.1 * self.torque) / self.inertia
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    /// Tensions f1 to f4 of cables in full slip that the motor pulls, by their mean along the sheath in 10 000 pieces.
    fn tensions_n(parameters: &Parameters, torque_nm: f64) -> [f64; 4] {
        let exponent =
            f64::from(parameters.sheath.friction_coefficient) * f64::from(parameters.sheath.wrap_angle);
        let pretension_n = f64::from(parameters.tendon.pretension);
        let difference_n = torque_nm / f64::from(parameters.pulley.output_radius);
        let mean = |output_n: f64, sign: f64| {
            let pieces = (0..10_000).map(|n| (f64::from(n) + 0.5) * 1e-4);
            pieces.map(|part| output_n * (sign * exponent * part).exp()).sum::<f64>() * 1e-4
        };
        // F4 for which both cables together are as long as at rest.
        let (mut low, mut high) = (-1000.0, 1000.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let sum = mean(middle + difference_n, 1.0) + mean(middle, -1.0);
            *(if sum < 2.0 * pretension_n { &mut low } else { &mut high }) = middle;
        }
        let f2 = low + difference_n;
        [f2 * exponent.exp(), f2, low * (-exponent).exp(), low]
    }

    #[test]
    fn the_torque_leaves_the_lowest_and_the_highest_tension_where_they_may_be() {
        let mut parameters = Parameters::default();
        parameters.limits.torque = 100.0;
        parameters.limits.current = 13.0;
        for (friction, pretension_n, over_n, end) in
            [(0.12, 30.0, 90.0, 2), (0.0, 30.0, 90.0, 2), (0.3, 60.0, 300.0, 2), (0.12, 50.0, 90.0, 0)]
        {
            parameters.sheath.friction_coefficient = friction;
            parameters.tendon.pretension = pretension_n;
            parameters.tension.over = over_n;
            let torque_nm = f64::from(Reach::new(&parameters).torque);
            let margin_n = f64::from(TENSION_MARGIN * pretension_n);
            let tensions = tensions_n(&parameters, torque_nm);
            let expected_n = if end == 0 { f64::from(over_n) - margin_n } else { 1.0 + margin_n };
            assert!(
                (tensions[end] - expected_n).abs() < 2e-3,
                "mu {friction}: {torque_nm} N·m, {tensions:?}"
            );
        }
    }

    #[test]
    fn a_weak_motor_limits_torque_and_acceleration() {
        let mut parameters = Parameters::default();
        let strong = Reach::new(&parameters);
        // 0.9 of 0.6 A at 0.9 N·m/A are 0.486 N·m, of which friction takes 2·30 N·0.377·0.015 m = 0.339 N·m.
        parameters.limits.current = 0.6;
        let weak = Reach::new(&parameters);
        assert!((weak.torque - 0.147).abs() < 1e-3, "{}", weak.torque);
        // A tenth of 0.486 N·m over 0.0045 kg·m².
        assert!((weak.acceleration - 10.8).abs() < 0.1, "{}", weak.acceleration);
        assert!(strong.acceleration > 4.0 * weak.acceleration && strong.angle[1] > weak.angle[1]);
    }

    #[test]
    fn without_a_load_the_bounds_of_the_user_count() {
        let mut parameters = Parameters::default();
        parameters.load.mass = 0.0;
        let reach = Reach::new(&parameters);
        assert_eq!(reach.angle, [-1.2, 1.2]);
        assert_eq!((reach.acceleration, reach.gravity, reach.jerk), (300.0, 0.0, 20_000.0));
    }
}
