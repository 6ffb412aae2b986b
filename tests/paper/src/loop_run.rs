//! A sine at the input pulley with a weight at the joint: the run behind Fig. 4 to 9.
//!
//! The firmware holds the input pulley on `theta_in = A sin(2 pi f t)` (position mode, `compensator.source` 0), as the
//! paper's motor does. Everything recorded is true, not measured.

use std::f64::consts::PI;

use bowden_control::parameters::Parameters;
use bowden_link::message::{Goal, Mode, Reference, Shape};
use bowden_model::paper::TendonPair;
use bowden_model::parameters::{PulleyParameters, SheathParameters, TendonParameters};
use virtual_bench::BenchConfig;

use crate::driven_joint::{DrivenJoint, parameters_of};
use crate::error::ExperimentError;

/// Samples a second of a recorded loop \[Hz\].
pub const SAMPLE_RATE_HZ: f64 = 1_000.0;

/// What differs between the runs of sections 3 and 4.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopSetup {
    /// Radius of both pulleys r1 = r2 \[m\].
    pub radius_m: f64,
    /// Pretension F0 \[N\].
    pub pretension_n: f64,
    /// Wrap angle K of both sheaths \[rad\].
    pub wrap_angle_rad: f64,
    /// Friction coefficient mu \[1\].
    pub friction_coefficient: f64,
    /// Weight at the end of the arm \[kg\].
    pub mass_kg: f64,
    /// Arm \[m\].
    pub arm_m: f64,
    /// Amplitude A of the input angle \[rad\].
    pub amplitude_rad: f64,
    /// Frequency f \[Hz\].
    pub frequency_hz: f64,
    /// Time that is recorded from the start \[s\].
    pub duration_s: f64,
}

impl Default for LoopSetup {
    /// Section 3.2: K = π, pulleys of 30 mm, 30 N; the frequency of section 4.1.
    fn default() -> Self {
        Self {
            radius_m: 0.015,
            pretension_n: 30.0,
            wrap_angle_rad: PI,
            friction_coefficient: crate::friction::DRY,
            mass_kg: 2.5,
            arm_m: 0.03,
            amplitude_rad: 0.5,
            frequency_hz: 0.1,
            duration_s: 25.0,
        }
    }
}

impl LoopSetup {
    /// The bench of this run, with the default tendons of 1 m.
    #[must_use]
    pub fn bench(&self) -> BenchConfig {
        BenchConfig {
            input_radius_m: self.radius_m,
            output_radius_m: self.radius_m,
            pretension_n: self.pretension_n,
            wrap_angle_rad: self.wrap_angle_rad,
            friction_coefficient: self.friction_coefficient,
            mass_kg: self.mass_kg,
            arm_m: self.arm_m,
            ..BenchConfig::default()
        }
    }

    /// Parameters of the firmware for this run.
    #[must_use]
    pub fn parameters(&self) -> Parameters {
        let mut parameters = parameters_of(&self.bench());
        parameters.compensator.source = 0.0;
        // Whether a tendon goes slack is a result here, read from the true tensions; the supervisor must not end the run.
        parameters.tension.slack = -100.0;
        parameters
    }

    /// The paper's equations for this run: evenly bent sheaths.
    ///
    /// # Errors
    /// [`ExperimentError::Equations`] if a parameter is out of range.
    pub fn pair(&self) -> Result<TendonPair, ExperimentError> {
        let bench = self.bench();
        let pulleys = PulleyParameters { input_radius_m: self.radius_m, output_radius_m: self.radius_m };
        let tendon = TendonParameters {
            length_m: bench.tendon_length_m,
            axial_stiffness_n: bench.axial_stiffness_n,
            pretension_n: self.pretension_n,
        };
        let sheath = SheathParameters {
            wrap_angle_rad: self.wrap_angle_rad,
            friction_coefficient: self.friction_coefficient,
        };
        Ok(TendonPair::uniform(&pulleys, &tendon, &sheath)?)
    }

    /// Torque of the weight at right angles to gravity, m g l \[Nm\].
    #[must_use]
    pub fn weight_nm(&self) -> f64 {
        self.mass_kg * BenchConfig::default().gravity_m_per_s2 * self.arm_m
    }
}

/// One moment of a recorded loop; everything is true.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopSample {
    /// Time since the reference began \[s\].
    pub t_s: f64,
    /// Angle of the input pulley \[rad\].
    pub theta_in_rad: f64,
    /// Angle of the joint \[rad\].
    pub theta_out_rad: f64,
    /// Speed of the joint \[rad/s\].
    pub omega_out_rad_per_s: f64,
    /// (F1 - F3) r1 \[Nm\].
    pub torque_in_nm: f64,
    /// (F2 - F4) r2 \[Nm\].
    pub torque_out_nm: f64,
    /// Least of the four end tensions \[N\].
    pub least_tension_n: f64,
}

/// Runs a sine at the input pulley and records it; `seed` is the sensor noise's.
///
/// # Errors
/// [`ExperimentError`] if the supervisor stops the joint or a parameter is out of range.
pub fn run(setup: &LoopSetup, seed: u64) -> Result<Vec<LoopSample>, ExperimentError> {
    let mut joint = DrivenJoint::ready(&setup.bench(), setup.parameters(), seed)?;
    joint.refer(Reference::Generated {
        shape: Shape::Sine,
        amplitude: setup.amplitude_rad as f32,
        offset: 0.0,
        frequency_hz: setup.frequency_hz as f32,
    })?;
    joint.order(Goal::Run(Mode::Position));
    let rate_hz = joint.tick_rate_hz();
    let per_sample = (rate_hz / SAMPLE_RATE_HZ).round() as u64;
    let ticks = (setup.duration_s * rate_hz).round() as u64;
    let mut samples = Vec::with_capacity((ticks / per_sample) as usize);
    for tick in 0..ticks {
        joint.tick()?;
        if tick.is_multiple_of(per_sample) {
            let bench = joint.bench();
            samples.push(LoopSample {
                t_s: tick as f64 / rate_hz,
                theta_in_rad: bench.theta_in_rad(),
                theta_out_rad: bench.theta_out_rad(),
                omega_out_rad_per_s: bench.omega_out_rad_per_s(),
                torque_in_nm: joint.torque_in_nm(),
                torque_out_nm: joint.torque_out_nm(),
                least_tension_n: bench.tensions_n().into_iter().fold(f64::INFINITY, f64::min),
            });
        }
    }
    Ok(samples)
}

/// Width of a loop where `across` passes 0: mean of `along` on rising passes less that on falling ones.
///
/// Straight lines between samples. `from_s` leaves out the start.
///
/// # Errors
/// [`ExperimentError::Evaluation`] if 0 is not passed both ways.
pub fn width_at_zero(
    samples: &[LoopSample],
    from_s: f64,
    across: fn(&LoopSample) -> f64,
    along: fn(&LoopSample) -> f64,
) -> Result<f64, ExperimentError> {
    let (mut rising, mut falling) = (Vec::new(), Vec::new());
    for pair in samples.windows(2).filter(|pair| pair[0].t_s >= from_s) {
        let (before, after) = (across(&pair[0]), across(&pair[1]));
        if (before < 0.0) == (after < 0.0) {
            continue;
        }
        let share = before / (before - after);
        let value = along(&pair[0]) + share * (along(&pair[1]) - along(&pair[0]));
        if after > before { rising.push(value) } else { falling.push(value) }
    }
    if rising.is_empty() || falling.is_empty() {
        return Err(ExperimentError::Evaluation(
            "the loop does not pass 0 both ways: its width is not known",
        ));
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    Ok(mean(&rising) - mean(&falling))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_width_of_a_play_is_its_play() {
        // Input a triangle of 1, output the input less or plus 0.25: at output 0 the input is +0.25 and -0.25.
        let at = |torque_in_nm: f64, torque_out_nm: f64| LoopSample {
            t_s: 0.0,
            theta_in_rad: 0.0,
            theta_out_rad: 0.0,
            omega_out_rad_per_s: 0.0,
            torque_in_nm,
            torque_out_nm,
            least_tension_n: 0.0,
        };
        let samples = [at(-0.5, -0.75), at(1.0, 0.75), at(0.5, 0.75), at(-1.0, -0.75)];
        let width = |samples: &[LoopSample]| {
            width_at_zero(samples, 0.0, |sample| sample.torque_out_nm, |sample| sample.torque_in_nm)
        };
        assert!((width(&samples).expect("both ways") - 0.5).abs() < 1e-12);
        assert!(width(&samples[..2]).is_err(), "rising only");
    }
}
