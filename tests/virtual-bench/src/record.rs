//! A run of the bench: reference, controller, plant and sensors at their own rates.

use crate::config::BenchConfig;
use crate::controller::Controller;
use crate::effects::{ActiveEffects, ConcealedEffect};
use crate::error::BenchError;
use crate::motion::Motion;
use crate::plant::Plant;
use crate::recording::Recording;
use crate::sensors::Sensors;

/// What moves the motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive<'a> {
    /// Reference of the input pulley \[rad\], one value a sample, followed by the lab's controller.
    Reference(&'a [f64]),
    /// PWM duty, one value a sample, straight to the bridge.
    Duty(&'a [f64]),
}

/// Records `motion` on the bench `config` with `effects` concealed in it.
///
/// `seed` is the noise's; the motion has its own. Equal arguments give equal recordings, bit for bit.
///
/// # Errors
/// [`BenchError`] if a parameter is out of range, an effect is given twice, or the state diverges.
pub fn record(
    config: &BenchConfig,
    effects: &[ConcealedEffect],
    motion: &Motion,
    seed: u64,
) -> Result<Recording, BenchError> {
    motion.validate()?;
    config.validate()?;
    let reference_rad = motion.reference_rad(config.sample_rate_hz);
    run(config, effects, Drive::Reference(&reference_rad), motion.clock_start_s, seed)
}

/// As [`record`] for a reference or duty from elsewhere; it lasts as long as the values given.
///
/// # Errors
/// As [`record`].
pub fn record_driven(
    config: &BenchConfig,
    effects: &[ConcealedEffect],
    drive: Drive,
    seed: u64,
) -> Result<Recording, BenchError> {
    config.validate()?;
    run(config, effects, drive, 0.0, seed)
}

fn run(
    config: &BenchConfig,
    effects: &[ConcealedEffect],
    drive: Drive,
    clock_start_s: f64,
    seed: u64,
) -> Result<Recording, BenchError> {
    let effects = ActiveEffects::new(effects)?;
    let steps = config.steps_per_sample();
    let mut plant = Plant::new(config, effects.clone(), clock_start_s);
    let mut sensors = Sensors::new(config, effects, clock_start_s, seed);
    let mut controller = Controller::new(config);
    let (Drive::Reference(values) | Drive::Duty(values)) = drive;
    let mut recording = Recording::with_capacity(values.len());
    for (k, value) in values.iter().enumerate() {
        let t_s = k as f64 / config.sample_rate_hz;
        let [f1, f2, f3, f4] = plant.tensions_n();
        let truth = [plant.input().angle_rad, plant.arm().angle_rad, f1, f2, f3, f4, plant.current_a()];
        if !truth.iter().all(|signal| signal.is_finite()) {
            return Err(BenchError::Diverged { at_s: t_s });
        }
        let [theta_in, theta_out, f1, f2, f3, f4, current] = sensors.read(&truth);
        let (reference, duty) = match drive {
            Drive::Reference(_) => (*value, controller.duty(*value, plant.rotor().angle_rad)),
            Drive::Duty(_) => (0.0, value.clamp(-1.0, 1.0)),
        };
        recording.t_s.push(t_s);
        recording.theta_ref_rad.push(reference);
        recording.theta_in_rad.push(theta_in);
        recording.theta_out_rad.push(theta_out);
        recording.f1_n.push(f1);
        recording.f2_n.push(f2);
        recording.f3_n.push(f3);
        recording.f4_n.push(f4);
        recording.duty.push(duty);
        recording.bus_v.push(config.supply_v);
        recording.i_motor_a.push(current);
        for _ in 0..steps {
            plant.step(duty);
        }
    }
    Ok(recording)
}
