//! Torque mode with a step of the wrap angle K of both sheaths: how far the torque is off, and how soon it is back.
//!
//! Default bench, default parameters that describe it, all four tensions.

use std::f64::consts::PI;

use bowden_link::message::{Goal, Mode, Reference, Shape};
use rayon::prelude::*;
use virtual_bench::BenchConfig;

use crate::driven_joint::{DrivenJoint, parameters_of};
use crate::error::ExperimentError;

/// Torque mode with a step of K of both sheaths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepCase {
    /// K before and after \[rad\].
    pub wrap_angle_rad: [f64; 2],
    /// Part of the reference's period at which the step comes \[1\].
    pub phase: f64,
}

/// Amplitude of the torque \[Nm\].
pub const STEP_TORQUE_NM: f64 = 0.3;
/// Frequency of the torque \[Hz\].
pub const STEP_FREQUENCY_HZ: f64 = 0.2;
/// Band that the torque error has to be back in \[Nm\]: 5 % of the amplitude.
pub const STEP_BAND_NM: f64 = 0.05 * STEP_TORQUE_NM;
/// Time in which it is to be back \[s\].
pub const STEP_LIMIT_S: f64 = 0.2;

/// Steps by π up and down, at eight phases of the reference.
#[must_use]
pub fn step_cases() -> Vec<StepCase> {
    let directions = [[0.5 * PI, 1.5 * PI], [1.5 * PI, 0.5 * PI]];
    let phases = [0.0625, 0.1875, 0.3125, 0.4375, 0.5625, 0.6875, 0.8125, 0.9375];
    directions
        .into_iter()
        .flat_map(|wrap_angle_rad| phases.map(|phase| StepCase { wrap_angle_rad, phase }))
        .collect()
}

/// How the firmware knows K.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Knowledge {
    /// By its own observer.
    Observed,
    /// K is set right, without error, in the tick of the step: no observer knows it sooner, so what is left is the control's.
    AtOnce,
}

/// What a step of K does to the torque.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepFigures {
    /// Largest torque error in the second after the step \[Nm\].
    pub largest_nm: f64,
    /// Time from the step to the end of the last 5 ms in which the mean error was outside the band, within a second \[s\].
    pub back_s: f64,
    /// The same for the second before the step, in which nothing happened: what the band costs without a step \[s\].
    pub before_s: f64,
}

impl StepCase {
    /// Whether K becomes larger.
    #[must_use]
    pub fn rises(&self) -> bool {
        self.wrap_angle_rad[1] > self.wrap_angle_rad[0]
    }

    /// Whether the reference turns within 0.4 s before or after the step.
    #[must_use]
    pub fn is_near_turn(&self) -> bool {
        (self.phase.rem_euclid(0.5) - 0.25).abs() < 0.4 * STEP_FREQUENCY_HZ
    }

    /// Runs the step with the firmware's observer; `seed` is that of the sensor noise.
    ///
    /// # Errors
    /// [`ExperimentError`] if the supervisor stops the joint.
    pub fn run(&self, seed: u64) -> Result<StepFigures, ExperimentError> {
        self.run_knowing(Knowledge::Observed, seed)
    }

    /// The same with another knowledge of K.
    ///
    /// # Errors
    /// [`ExperimentError`] if the supervisor stops the joint.
    pub fn run_knowing(&self, knowledge: Knowledge, seed: u64) -> Result<StepFigures, ExperimentError> {
        const WINDOW: usize = 50;
        let bench = BenchConfig { wrap_angle_rad: PI, ..BenchConfig::default() };
        let mut parameters = parameters_of(&bench);
        if knowledge != Knowledge::Observed {
            parameters.sheath.adapts = 0.0;
            parameters.sheath.wrap_angle = self.wrap_angle_rad[0] as f32;
        }
        let mut joint = DrivenJoint::ready(&bench, parameters, seed)?;
        joint.refer(Reference::Generated {
            shape: Shape::Sine,
            amplitude: STEP_TORQUE_NM as f32,
            offset: 0.0,
            frequency_hz: STEP_FREQUENCY_HZ as f32,
        })?;
        joint.order(Goal::Run(Mode::Torque));
        let rate_hz = joint.tick_rate_hz();
        let second = rate_hz.round() as usize;
        // A whole period ahead, so that the observer knows the friction before the step.
        let step = ((1.0 + self.phase) / STEP_FREQUENCY_HZ * rate_hz).round() as usize;
        let mut errors_nm = Vec::with_capacity(2 * second);
        for tick in 0..step + second {
            joint.set_wrap_angle_rad([self.wrap_angle_rad[usize::from(tick >= step)]; 2])?;
            if tick == step && knowledge == Knowledge::AtOnce {
                let mut parameters = joint.parameters().clone();
                parameters.sheath.wrap_angle = self.wrap_angle_rad[1] as f32;
                joint.configure(parameters)?;
            }
            let output = joint.tick()?;
            if tick + second >= step {
                errors_nm.push(DrivenJoint::reference(&output) - joint.torque_out_nm());
            }
        }
        let last_outside_s = |errors: &[f64]| {
            let outside = |window: &[f64]| (window.iter().sum::<f64>() / WINDOW as f64).abs() > STEP_BAND_NM;
            let last = errors.chunks_exact(WINDOW).rposition(outside);
            last.map_or(0.0, |at| ((at + 1) * WINDOW) as f64 / rate_hz)
        };
        let (before, after) = errors_nm.split_at(second);
        Ok(StepFigures {
            largest_nm: after.iter().fold(0.0, |most, error| most.max(error.abs())),
            back_s: last_outside_s(after),
            before_s: last_outside_s(before),
        })
    }
}

/// Runs every step with every seed, case by case.
///
/// # Errors
/// That of the first run that fails.
pub fn run_steps(
    cases: &[StepCase],
    knowledge: Knowledge,
    seeds: &[u64],
) -> Result<Vec<Vec<StepFigures>>, ExperimentError> {
    let pairs: Vec<_> = cases.iter().flat_map(|case| seeds.iter().map(move |seed| (*case, *seed))).collect();
    let runs: Result<Vec<_>, _> =
        pairs.par_iter().map(|(case, seed)| case.run_knowing(knowledge, *seed)).collect();
    Ok(runs?.chunks(seeds.len()).map(<[StepFigures]>::to_vec).collect())
}
