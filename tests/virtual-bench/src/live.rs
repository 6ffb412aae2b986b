//! A bench that is stepped from outside: for a driver board, real or emulated, instead of the lab's own controller.

use crate::config::BenchConfig;
use crate::draw::Draw;
use crate::effects::{ActiveEffects, Channel, ConcealedEffect};
use crate::error::BenchError;
use crate::plant::Plant;

/// What the bridge does with the motor during a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bridge {
    /// Mean motor voltage as a fraction of the supply, −1 to 1.
    Duty(f64),
    /// All switches are open: the current decays to zero through the diodes, the motor is not braked.
    Open,
}

/// The bench, its sensors and their noise, one integration step ([`BenchConfig::step_s`]) at a time.
///
/// Equal configurations, effects, seeds and steps give equal results, bit for bit; under [`Bridge::Duty`] they are those
/// of [`record_driven`](crate::record_driven).
#[derive(Debug, Clone)]
pub struct LiveBench {
    config: BenchConfig,
    effects: ActiveEffects,
    plant: Plant,
    noise: Draw,
    supply_v: f64,
    largest_wrap_angle_rad: f64,
    cell_load_n: [f64; 4],
    steps: u64,
}

impl LiveBench {
    /// A bench at rest at theta = 0; `seed` is the noise's.
    ///
    /// # Errors
    /// [`BenchError`] if a parameter is out of range, an effect is given twice, or an effect needs a sample rate
    /// (`sensor_lag`).
    pub fn new(config: &BenchConfig, effects: &[ConcealedEffect], seed: u64) -> Result<Self, BenchError> {
        config.validate()?;
        let effects = ActiveEffects::new(effects)?;
        if effects.sensor_lag.is_some() {
            return Err(BenchError::NotLive { id: "sensor_lag" });
        }
        Ok(Self {
            plant: Plant::new(config, effects.clone(), 0.0),
            effects,
            noise: Draw::new(seed, "live sensor noise"),
            supply_v: config.supply_v,
            largest_wrap_angle_rad: config.largest_wrap_angle_rad(),
            cell_load_n: [0.0; 4],
            steps: 0,
            config: config.clone(),
        })
    }

    /// One integration step.
    pub fn step(&mut self, bridge: Bridge) {
        match bridge {
            Bridge::Duty(duty) => self.plant.step(duty.clamp(-1.0, 1.0)),
            Bridge::Open => self.plant.step_open(),
        }
        self.steps += 1;
    }

    /// Configuration that the bench was made with.
    pub fn config(&self) -> &BenchConfig {
        &self.config
    }

    /// Time since the start \[s\].
    pub fn time_s(&self) -> f64 {
        self.steps as f64 * self.config.step_s
    }

    /// Angle of the input pulley \[rad\].
    pub fn theta_in_rad(&self) -> f64 {
        self.plant.input().angle_rad
    }

    /// Angle of the joint \[rad\].
    pub fn theta_out_rad(&self) -> f64 {
        self.plant.arm().angle_rad
    }

    /// Velocity of the joint \[rad/s\].
    pub fn omega_out_rad_per_s(&self) -> f64 {
        self.plant.arm().omega_rad_per_s
    }

    /// Tensions f1, f2, f3, f4 \[N\].
    pub fn tensions_n(&self) -> [f64; 4] {
        self.plant.tensions_n()
    }

    /// Motor current \[A\].
    pub fn current_a(&self) -> f64 {
        self.plant.current_a()
    }

    /// Supply of the bridge \[V\].
    pub fn supply_v(&self) -> f64 {
        self.supply_v
    }

    /// Changes the supply of the bridge \[V\].
    pub fn set_supply_v(&mut self, supply_v: f64) {
        self.supply_v = supply_v;
        self.plant.set_supply_v(supply_v);
    }

    /// Sets the pretension of cable a and b over that of the configuration \[1\]: 1 as built, 0 a cable without any.
    pub fn set_pretension_ratio(&mut self, ratio: [f64; 2]) {
        self.plant.set_pretension_ratio(ratio);
    }

    /// Pushes the joint from outside with this torque, towards +θ \[Nm\], until it is set anew.
    pub fn set_outer_torque_nm(&mut self, torque_nm: f64) {
        self.plant.set_outer_torque_nm(torque_nm);
    }

    /// Takes both tendons off their pulleys (`false`), or fits them as on a bench that was just built: at pretension, at rest, all
    /// angles zero. Hands let go of everything.
    pub fn set_tendons_fitted(&mut self, fitted: bool) {
        self.cell_load_n = [0.0; 4];
        self.plant.set_tendons_fitted(fitted);
    }

    /// Loads cells f1 to f4 by hand or with a weight \[N\], beside what their tendons do, until it is set anew.
    pub fn set_cell_load_n(&mut self, load_n: [f64; 4]) {
        self.cell_load_n = load_n;
    }

    /// Turns the shaft of the input pulley by hand to this angle \[rad\] and holds it; none lets go.
    pub fn hold_input(&mut self, angle_rad: Option<f64>) {
        self.plant.hands().input_rad = angle_rad;
    }

    /// Turns the arm by hand to this angle \[rad\] and holds it, as far as its weight lets a hand; none lets go.
    pub fn hold_arm(&mut self, angle_rad: Option<f64>) {
        self.plant.hands().arm_rad = angle_rad;
    }

    /// Moves the sheaths: sets the wrap angle K of cable a and b \[rad\], each bend keeping its share.
    ///
    /// Only the bend angles change: neither the length of a sheath nor what `bending_friction` preloads.
    ///
    /// # Errors
    /// [`BenchError::Parameter`] if an angle is negative, not finite, or too large for the integration step; the sheaths
    /// stay where they were.
    pub fn set_wrap_angle_rad(&mut self, wrap_angle_rad: [f64; 2]) -> Result<(), BenchError> {
        for wrap in wrap_angle_rad {
            if !(wrap.is_finite() && wrap >= 0.0) {
                return Err(BenchError::parameter("wrap_angle_rad", wrap, "an angle of 0 or more"));
            }
            if wrap > self.largest_wrap_angle_rad {
                return Err(BenchError::parameter(
                    "wrap_angle_rad",
                    wrap,
                    "an angle for which step_s is short enough",
                ));
            }
        }
        self.plant.set_wrap_angle_rad(wrap_angle_rad);
        Ok(())
    }

    /// Whether the state is finite.
    pub fn is_finite(&self) -> bool {
        self.tensions_n()
            .iter()
            .chain(&[self.theta_in_rad(), self.theta_out_rad(), self.current_a()])
            .all(|x| x.is_finite())
    }

    /// Angle that the encoder of `channel` is at \[rad\], with its eccentricity, not quantised.
    ///
    /// Channels other than the two encoders read 0.
    pub fn sensed_angle_rad(&self, channel: Channel) -> f64 {
        let angle = match channel {
            Channel::ThetaIn => self.theta_in_rad(),
            Channel::ThetaOut => self.theta_out_rad(),
            _ => return 0.0,
        };
        let law = self.effects.encoder_eccentricity.as_ref().filter(|law| law.channel == channel);
        self.offset(channel, law.map_or(angle, |law| law.reading_rad(angle)))
    }

    /// Tension \[N\] or current \[A\] that the amplifier of `channel` gives out, with noise and sensor effects, neither
    /// limited nor quantised. Each call draws new noise. Encoder channels read 0.
    pub fn sensed(&mut self, channel: Channel) -> f64 {
        let tensions_n = self.tensions_n();
        let [f1, f2, f3, f4] = std::array::from_fn(|cell| tensions_n[cell] + self.cell_load_n[cell]);
        let (mut value, noise) = match channel {
            Channel::F1 => (f1, self.config.tension_noise_n),
            Channel::F2 => (f2, self.config.tension_noise_n),
            Channel::F3 => (f3, self.config.tension_noise_n),
            Channel::F4 => (f4, self.config.tension_noise_n),
            Channel::Current => (self.current_a(), self.config.current_noise_a),
            Channel::ThetaIn | Channel::ThetaOut => return 0.0,
        };
        if let Some(law) = self.effects.sensor_saturation.as_ref().filter(|law| law.channel == channel) {
            value = law.reading_n(value);
        }
        if let Some(law) = self.effects.sensor_gain_error.as_ref().filter(|law| law.channel == channel) {
            value *= 1.0 + law.error;
        }
        self.offset(channel, value) + noise * self.noise.normal()
    }

    fn offset(&self, channel: Channel, value: f64) -> f64 {
        let law = self.effects.sensor_offset.as_ref().filter(|law| law.channel == channel);
        value + law.map_or(0.0, |law| law.offset)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::{Drive, record_driven};

    #[test]
    fn it_moves_as_a_recording_under_the_same_duty() {
        let config = BenchConfig { tension_noise_n: 0.0, current_noise_a: 0.0, ..BenchConfig::default() };
        let duty: Vec<f64> = (0..300).map(|k| 0.1 * (f64::from(k) * 0.02).sin()).collect();
        let recording = record_driven(&config, &[], Drive::Duty(&duty), 1).expect("default bench");
        let mut bench = LiveBench::new(&config, &[], 1).expect("default bench");
        for (k, duty) in duty.iter().enumerate() {
            // The recording rounds the current to 4 mA and the angle to 2 pi/4096: half of each at most.
            assert!((bench.current_a() - recording.i_motor_a[k]).abs() <= 2.0e-3 + 1e-12, "sample {k}");
            assert!((bench.theta_in_rad() - recording.theta_in_rad[k]).abs() <= 7.7e-4, "sample {k}");
            for _ in 0..100 {
                bench.step(Bridge::Duty(*duty));
            }
        }
    }

    #[test]
    fn an_open_bridge_ends_the_current_and_does_not_brake() {
        let mut bench = LiveBench::new(&BenchConfig::default(), &[], 1).expect("default bench");
        for _ in 0..2000 {
            bench.step(Bridge::Duty(0.2));
        }
        let (current, speed) = (bench.current_a(), bench.omega_out_rad_per_s());
        assert!(current > 0.1 && speed > 0.1, "{current} A, {speed} rad/s");
        // At most i·L/V = 1 A·0.8 mH/24 V = 33 us for each ampere.
        let steps = (current * 0.8e-3 / 24.0 / 1e-5).ceil() as usize;
        for _ in 0..steps {
            bench.step(Bridge::Open);
        }
        assert_eq!(bench.current_a(), 0.0);
        for _ in 0..10 {
            bench.step(Bridge::Open);
        }
        assert_eq!(bench.current_a(), 0.0, "no braking current");
    }

    #[test]
    fn an_outer_torque_turns_the_joint_by_the_tendons_compliance_and_the_weight() {
        // Without friction: 2 EA r²/L of the tendons and m g l of the weight, the input pulley held by the short-circuited
        // motor, which 2 s at 0.4 N·m s/rad let slip by less than 0.1 rad: only the difference of both angles counts.
        let config = BenchConfig { friction_coefficient: 0.0, ..BenchConfig::default() };
        let mut bench = LiveBench::new(&config, &[], 1).expect("default bench");
        bench.set_outer_torque_nm(0.2);
        for _ in 0..200_000 {
            bench.step(Bridge::Duty(0.0));
        }
        let lag_rad = bench.theta_out_rad() - bench.theta_in_rad();
        let [_, f2, _, f4] = bench.tensions_n();
        let stiffness = 2.0 * 72_900.0 * 0.015 * 0.015;
        let expected_rad = (f4 - f2) * 0.015 / stiffness;
        assert!(lag_rad > 1e-4 && (lag_rad / expected_rad - 1.0).abs() < 0.02, "{lag_rad} {expected_rad}");
        let weight_nm = 2.5 * 9.81 * 0.03 * bench.theta_out_rad().sin();
        let balance_nm = 0.2 - weight_nm - (f4 - f2) * 0.015;
        assert!(balance_nm.abs() < 2e-3, "{balance_nm} Nm");
    }

    #[test]
    fn lost_pretension_lowers_both_ends_of_that_cable_only() {
        let mut bench = LiveBench::new(&BenchConfig::default(), &[], 1).expect("default bench");
        bench.set_pretension_ratio([0.5, 1.0]);
        for _ in 0..20_000 {
            bench.step(Bridge::Duty(0.0));
        }
        let [f1, f2, f3, f4] = bench.tensions_n();
        // The pulleys share the imbalance of 15 N: both cables end near its middle, a below 30 N, none above.
        assert!(f1 < 29.0 && f2 < 29.0 && f3 < 30.0 && f4 < 30.0, "{f1} {f2} {f3} {f4}");
    }

    #[test]
    fn moved_sheaths_have_the_end_tension_ratio_of_their_new_wrap_angle() {
        let mut bench = LiveBench::new(&BenchConfig::default(), &[], 1).expect("default bench");
        let wrap = [0.5 * PI, 1.5 * PI];
        bench.set_wrap_angle_rad(wrap).expect("angles in range");
        // The motor can carry 0.65 N·m less 0.34 N·m of friction: 0.43 rad, which it nears with 0.6 s; 0.37 rad are 5.5 mm, where
        // 0.5 mm make either tendon slip.
        for _ in 0..120_000 {
            bench.step(Bridge::Duty(0.06));
        }
        assert!(bench.omega_out_rad_per_s() > 0.05 && bench.theta_out_rad() > 0.2, "still moving");
        let [f1, f2, f3, f4] = bench.tensions_n();
        // Mesh and viscous term as in `full_slip_ratio_is_the_capstan_ratio`, inertia of the tendon below 1e-3.
        for (ratio, wrap) in [(f1 / f2, wrap[0]), (f4 / f3, wrap[1])] {
            let capstan = (0.12 * wrap).exp();
            assert!((ratio / capstan - 1.0).abs() < 2e-3, "K {wrap}: {ratio} against {capstan}");
        }
    }

    #[test]
    fn a_wrap_angle_that_the_step_cannot_follow_is_refused() {
        let config = BenchConfig::default();
        let mut bench = LiveBench::new(&config, &[], 1).expect("default bench");
        let limit_rad = config.largest_wrap_angle_rad();
        let at = |wrap_angle_rad: f64| BenchConfig { wrap_angle_rad, ..config.clone() }.validate();
        assert!(at(0.999 * limit_rad).is_ok() && at(1.001 * limit_rad).is_err(), "{limit_rad}");
        assert!(bench.set_wrap_angle_rad([0.999 * limit_rad, 0.0]).is_ok());
        for wrong in [-0.1, f64::NAN, 1.001 * limit_rad] {
            assert!(bench.set_wrap_angle_rad([1.0, wrong]).is_err(), "{wrong}");
        }
    }

    #[test]
    fn supply_scales_the_motor_voltage() {
        let settle = |supply_v: f64| {
            let mut bench = LiveBench::new(&BenchConfig::default(), &[], 1).expect("default bench");
            bench.set_supply_v(supply_v);
            for _ in 0..50 {
                bench.step(Bridge::Duty(0.1));
            }
            bench.current_a()
        };
        // Before anything moves, the current is V/R·(1 − e^(−t R/L)): proportional to the supply.
        let ratio = settle(12.0) / settle(24.0);
        assert!((ratio - 0.5).abs() < 0.02, "{ratio}");
    }

    #[test]
    fn without_tendons_each_shaft_turns_alone_and_cells_feel_what_hangs_on_them() {
        let config = BenchConfig { tension_noise_n: 0.0, ..BenchConfig::default() };
        let mut bench = LiveBench::new(&config, &[], 1).expect("default bench");
        bench.set_tendons_fitted(false);
        bench.hold_input(Some(0.5));
        bench.set_cell_load_n([0.0, 19.62, 0.0, 0.0]);
        let run = |bench: &mut LiveBench| (0..100_000).for_each(|_| bench.step(Bridge::Open));
        run(&mut bench);
        assert!((bench.theta_in_rad() - 0.5).abs() < 1e-3 && bench.theta_out_rad() == 0.0);
        let sensed = [Channel::F1, Channel::F2, Channel::F3, Channel::F4].map(|cell| bench.sensed(cell));
        assert_eq!(sensed, [0.0, 19.62, 0.0, 0.0]);
        bench.hold_input(None);
        bench.hold_arm(Some(0.5));
        run(&mut bench);
        // A hand of 2 N·m/rad against m g l sin: 2·(0.5 − x) = 0.73575·sin x.
        assert!((2.0 * (0.5 - bench.theta_out_rad()) - 0.735_75 * bench.theta_out_rad().sin()).abs() < 1e-3);
        bench.set_tendons_fitted(true);
        run(&mut bench);
        let new = LiveBench::new(&config, &[], 1).expect("default bench").tensions_n();
        let fitted = bench.tensions_n();
        assert!((0..4).all(|cell| (fitted[cell] - new[cell]).abs() < 1e-9), "{fitted:?}");
    }

    #[test]
    fn a_lag_is_refused() {
        let effect = ConcealedEffect::drawn("sensor_lag", 1.0, 1).expect("known effect");
        assert!(LiveBench::new(&BenchConfig::default(), &[effect], 1).is_err());
    }
}
