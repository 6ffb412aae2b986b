//! Angle and speed of the input pulley between the counts of its encoder.
//!
//! A count of 12 bits is 1.5 mrad; differenced at 10 kHz it is a speed of 15 rad/s, more than the joint ever has. The
//! observer runs a model of the rotor with everything that is measured, motor current and tensions, and is corrected by
//! the encoder only where the count contradicts it:
//!
//! `dω/dt = (k_t N i − (F1 − F3) r1 − b ω)/J + d + 3 ω_o² e`, `dθ/dt = ω + 3 ω_o e`, `dd/dt = ω_o³ e`,
//! `e` = angle of the count − θ, and zero within half a count.
//!
//! `d` is what the model lacks, such as dry friction of the gear; without it the speed would be off by `2 d/ω_o`. At a
//! steady 0.3 rad/s the ripple of the speed is less than half of that of a difference behind a low-pass of 20 Hz, which
//! moreover lags by 8 ms when the speed changes (test `speed_is_smoother_than_a_filtered_difference`: 18 against 55 mrad/s).

use crate::scale::{Acceleration, Angle, Current, Gain, Speed, Sum, Torque, Weight};

/// Rotor, gear and gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObserverConfig {
    /// `k_t N / J`, J the rotor's inertia at the input pulley.
    pub drive: Gain<Current, Acceleration>,
    /// `1 / J`.
    pub load: Gain<Torque, Acceleration>,
    /// `b / J`.
    pub viscous: Gain<Speed, Acceleration>,
    /// `3 ω_o²`.
    pub pull: Gain<Angle, Acceleration>,
    /// `3 ω_o` a tick.
    pub follow: Weight<Angle, Angle>,
    /// `ω_o / 3` a tick: from the pull to what the model lacks.
    pub learn: Weight<Acceleration, Acceleration>,
    /// `J`: acceleration that the model lacks to the torque that takes it.
    pub inertia: Gain<Acceleration, Torque>,
    /// A tick's time: speed to angle.
    pub speed_step: Weight<Speed, Angle>,
    /// A tick's time: acceleration to speed.
    pub acceleration_step: Weight<Acceleration, Speed>,
    /// Half a count.
    pub half_count: Angle,
}

/// Present angle and speed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Motion {
    /// Angle of the input pulley.
    pub angle: Angle,
    /// Its speed.
    pub speed: Speed,
}

/// State of the observer.
#[derive(Clone, Copy, Debug, Default)]
pub struct Observer {
    angle: Option<Sum<Angle>>,
    speed: Sum<Speed>,
    lacking: Sum<Acceleration>,
}

impl Observer {
    /// Takes this tick's measurements. `torque_in` is what the tendons take from the pulley, `(F1 - F3) r1`; `measured` is
    /// the angle of the count, or none where the frame was bad.
    pub fn observe(
        &mut self,
        config: &ObserverConfig,
        measured: Angle,
        believed: bool,
        current: Current,
        torque_in: Torque,
    ) -> Motion {
        let angle_sum = self.angle.get_or_insert_with(|| Sum::at(measured));
        let (angle, speed) = (angle_sum.value(), self.speed.value());
        let difference = if believed { measured.minus(angle) } else { Angle::ZERO };
        let error = difference.minus(difference.limited(config.half_count));
        let pull = config.pull.apply(error);
        self.lacking.add(config.learn, pull);
        let acceleration = config
            .drive
            .apply(current)
            .minus(config.load.apply(torque_in))
            .minus(config.viscous.apply(speed))
            .plus(self.lacking.value())
            .plus(pull);
        self.speed.add(config.acceleration_step, acceleration);
        angle_sum.add(config.speed_step, speed);
        angle_sum.add(config.follow, error);
        Motion { angle: angle_sum.value(), speed: self.speed.value() }
    }
}

impl Observer {
    /// Torque that something takes from the input pulley and that the model was not told of, `-J d`.
    #[inline]
    #[must_use]
    pub fn load(&self, config: &ObserverConfig) -> Torque {
        config.inertia.apply(self.lacking.value().negated())
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::f64::consts::TAU;
    use std::vec::Vec;

    use super::*;
    use crate::parameters::Parameters;
    use crate::scale::Quantity;
    use crate::tick_config;

    const PERIOD_S: f64 = 1e-4;
    const RAD_PER_COUNT: f64 = TAU / 4096.0;

    fn config() -> ObserverConfig {
        tick_config(&Parameters::default()).unwrap().observer
    }

    /// Angle of the count that an encoder shows at `angle_rad`.
    fn counted(angle_rad: f64) -> Angle {
        Angle::from_f32(((angle_rad / RAD_PER_COUNT).round() * RAD_PER_COUNT) as f32)
    }

    /// Standard deviation and mean over the last half.
    fn spread(values: &[f64]) -> (f64, f64) {
        let tail = &values[values.len() / 2..];
        let mean = tail.iter().sum::<f64>() / tail.len() as f64;
        let variance = tail.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / tail.len() as f64;
        (variance.sqrt(), mean)
    }

    #[test]
    fn speed_is_smoother_than_a_filtered_difference() {
        // Friction of 0.02 N·m·s/rad at 0.3 rad/s and 0.2 N·m of the tendons: 0.206 N·m, 0.229 A.
        let (config, mut observer) = (config(), Observer::default());
        let (current, torque) = (Current::from_f32(0.206 / 0.9), Torque::from_f32(0.2));
        let weight = PERIOD_S / (1.0 / (TAU * 20.0) + PERIOD_S);
        let (mut filtered, mut last) = (0.0, 0.0);
        let (mut observed, mut differences) = (Vec::new(), Vec::new());
        for n in 0..40_000 {
            let measured = counted(0.3 * PERIOD_S * f64::from(n));
            observed
                .push(f64::from(observer.observe(&config, measured, true, current, torque).speed.to_f32()));
            let value = f64::from(measured.to_f32());
            filtered += weight * ((value - last) / PERIOD_S - filtered);
            last = value;
            differences.push(filtered);
        }
        let ((ripple, mean), (coarse, _)) = (spread(&observed), spread(&differences));
        std::println!("observer {ripple} rad/s, filtered difference {coarse} rad/s");
        assert!((mean - 0.3).abs() < 3e-3, "{mean} rad/s");
        assert!(ripple * 2.0 < coarse && ripple < 0.025, "{ripple} rad/s, difference {coarse} rad/s");
    }

    #[test]
    fn a_wrong_model_costs_a_count_and_no_speed() {
        // The model lacks 0.1 N·m of dry friction in the gear: 22 rad/s², which would be 0.35 rad/s of speed.
        let (config, mut observer) = (config(), Observer::default());
        let (current, torque) = (Current::from_f32(0.306 / 0.9), Torque::from_f32(0.2));
        let (mut speeds, mut lag) = (Vec::new(), 0.0_f64);
        for n in 0..40_000 {
            let angle = 0.3 * PERIOD_S * f64::from(n);
            let motion = observer.observe(&config, counted(angle), true, current, torque);
            speeds.push(f64::from(motion.speed.to_f32()));
            lag = f64::from(motion.angle.to_f32()) - angle;
        }
        let (ripple, mean) = spread(&speeds);
        assert!((mean - 0.3).abs() < 0.02 && ripple < 0.2, "{mean} ± {ripple} rad/s");
        assert!(lag.abs() < 1.6e-3, "{lag} rad");
    }

    #[test]
    fn it_coasts_without_frames_and_comes_back() {
        let (config, mut observer) = (config(), Observer::default());
        let (current, torque) = (Current::from_f32(0.206 / 0.9), Torque::from_f32(0.2));
        let mut largest = 0.0_f64;
        for n in 1..20_000 {
            let angle = 0.3 * PERIOD_S * f64::from(n);
            // Without frames for 5 ms of every 100 ms.
            let believed = n % 1000 < 950;
            // What is not believed is far off.
            let measured = if believed { counted(angle) } else { Angle::from_f32(-3.0) };
            let motion = observer.observe(&config, measured, believed, current, torque);
            if n > 10_000 {
                largest = largest.max((f64::from(motion.angle.to_f32()) - angle).abs());
            }
        }
        assert!(largest < 1.2 * RAD_PER_COUNT, "{largest} rad");
    }
}
