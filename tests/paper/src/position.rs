//! Position mode while the sheaths are moved, beyond the paper: frequencies, loads, pretensions, wrong parameters.
//!
//! Everything runs on the default bench with default parameters that describe it ([`crate::driven_joint::parameters_of`]): nothing
//! is tuned. K of both sheaths wanders as in section 5.2 ([`crate::sheath_motion`]) or goes by pi at once ([`crate::sheath_steps`]). The error is that of the true joint angle against
//! the board's reference in the same tick; *turns* are the eighth of a period after each turn, where the dead zone is crossed. A
//! slack event is a time in which a true tension is below `tension.slack`.

use bowden_control::parameters::{Parameters, Unreachable, check_reference};
use bowden_link::message::{Goal, Mode, Reference, Shape};
use rayon::prelude::*;
use virtual_bench::BenchConfig;

use crate::driven_joint::{DrivenJoint, parameters_of};
use crate::error::ExperimentError;
use crate::sheath_motion::{SheathMotion, SheathMotionConfig};
use crate::sheath_steps::SheathSteps;
use crate::tracking_methods::Spread;

/// Seeds that figures come from; they took part in no choice.
pub const SEEDS: [u64; 5] = [401, 402, 403, 404, 405];
/// Frequencies of the desired angle \[Hz\].
pub const FREQUENCIES_HZ: [f32; 5] = [0.1, 0.2, 0.5, 1.0, 2.0];
/// Largest amplitude that is tried \[rad\]; less where the board refuses it.
const AMPLITUDE_RAD: f32 = 0.5;
/// Amplitude where frequencies are not compared \[rad\].
const MIDDLE_AMPLITUDE_RAD: f32 = 0.3;
/// Time that counts, in whole periods of at least \[s\].
const MEASURED_S: f64 = 20.0;
/// Time that is left out at the start, in whole periods of at least \[s\]: the reference takes 0.5 s to grow.
const SETTLING_S: f64 = 2.0;
/// Part of a period after a turn that counts as the turn.
const TURN: f64 = 0.125;

/// How the sheaths are moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moved {
    /// At random, as in section 5.2.
    ByHand,
    /// To and fro by pi within a fifth of a second.
    BySteps,
}

/// A sine in position mode on a bench whose sheaths are moved.
#[derive(Debug, Clone)]
pub struct SineCase {
    /// The bench.
    pub bench: BenchConfig,
    /// Parameters of the firmware.
    pub parameters: Parameters,
    /// Amplitude \[rad\].
    pub amplitude_rad: f32,
    /// Frequency \[Hz\].
    pub frequency_hz: f32,
    /// Motion of the sheaths.
    pub moved: Moved,
}

/// What a sine shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SineFigures {
    /// Root mean square error of the joint \[rad\].
    pub rms_rad: f64,
    /// Largest error \[rad\].
    pub largest_rad: f64,
    /// Root mean square error at turns \[rad\].
    pub turn_rms_rad: f64,
    /// Largest error at turns \[rad\].
    pub turn_largest_rad: f64,
    /// Least true tension at any of the four ends \[N\].
    pub least_tension_n: f64,
    /// Times in which a tension was below `tension.slack`.
    pub slack_events: u32,
}

/// What a case shows over all seeds.
#[derive(Debug, Clone)]
pub struct SineRow {
    /// Figures of the runs that came to their end.
    pub figures: Vec<SineFigures>,
    /// Runs that the supervisor stopped, with what it said.
    pub stopped: Vec<(u64, String)>,
}

/// Largest amplitude up to `most_rad` that the board accepts, rounded down to 1 mrad \[rad\]; 0 if it accepts none.
#[must_use]
pub fn accepted_amplitude_rad(parameters: &Parameters, frequency_hz: f32, most_rad: f32) -> f32 {
    let sine = Reference::Generated { shape: Shape::Sine, amplitude: most_rad, offset: 0.0, frequency_hz };
    match check_reference(parameters, Mode::Position, sine) {
        Ok(()) => most_rad,
        Err(Unreachable { maximum, .. }) => (maximum * 1e3).floor() * 1e-3,
    }
}

impl SineCase {
    /// A case on this bench, with the parameters that describe it changed by `change` and at most this amplitude.
    pub fn new(
        bench: BenchConfig,
        frequency_hz: f32,
        most_rad: f32,
        change: impl FnOnce(&mut Parameters),
    ) -> Self {
        let mut parameters = parameters_of(&bench);
        change(&mut parameters);
        let amplitude_rad = accepted_amplitude_rad(&parameters, frequency_hz, most_rad);
        Self { bench, parameters, amplitude_rad, frequency_hz, moved: Moved::ByHand }
    }

    /// One run; `seed` is that of the sheaths' motion and of the sensor noise.
    ///
    /// # Errors
    /// [`ExperimentError`] if the supervisor stops the joint or a parameter is out of range.
    pub fn run(&self, seed: u64) -> Result<SineFigures, ExperimentError> {
        let mut joint = DrivenJoint::ready(&self.bench, self.parameters.clone(), seed)?;
        let frequency_hz = f64::from(self.frequency_hz);
        joint.refer(Reference::Generated {
            shape: Shape::Sine,
            amplitude: self.amplitude_rad,
            offset: 0.0,
            frequency_hz: self.frequency_hz,
        })?;
        joint.order(Goal::Run(Mode::Position));
        let rate_hz = joint.tick_rate_hz();
        let periods = |seconds: f64| (seconds * frequency_hz).ceil() / frequency_hz;
        let start = (periods(SETTLING_S) * rate_hz).round() as u64;
        let end = start + (periods(MEASURED_S) * rate_hz).round() as u64;
        let motion = SheathMotion::new(SheathMotionConfig::BY_HAND, seed);
        let steps = SheathSteps::new(SheathMotionConfig::BY_HAND, end as f64 / rate_hz, seed);
        let mut all = Errors::default();
        let mut turns = Errors::default();
        let mut slack = SlackCount::new(self.parameters.tension.slack);
        for tick in 0..end {
            let time_s = tick as f64 / rate_hz;
            joint.set_wrap_angle_rad(match self.moved {
                Moved::ByHand => motion.wrap_angle_rad(time_s),
                Moved::BySteps => [steps.wrap_angle_rad(time_s); 2],
            })?;
            let output = joint.tick()?;
            slack.look(&joint);
            if tick < start {
                continue;
            }
            let error_rad = joint.bench().theta_out_rad() - DrivenJoint::reference(&output);
            all.add(error_rad);
            // Turns are a quarter and three quarters of a period after the start.
            if (time_s * frequency_hz + 0.25).rem_euclid(0.5) < TURN {
                turns.add(error_rad);
            }
        }
        Ok(SineFigures {
            rms_rad: all.rms(),
            largest_rad: all.largest,
            turn_rms_rad: turns.rms(),
            turn_largest_rad: turns.largest,
            least_tension_n: slack.least_n,
            slack_events: slack.events,
        })
    }
}

/// Runs all cases with all seeds.
///
/// # Errors
/// Of the first run that fails otherwise than by a stop of the supervisor.
pub fn run_all(cases: &[SineCase], seeds: &[u64]) -> Result<Vec<SineRow>, ExperimentError> {
    let pairs: Vec<_> = cases.iter().flat_map(|case| seeds.iter().map(move |seed| (case, *seed))).collect();
    let runs: Vec<_> = pairs.par_iter().map(|(case, seed)| (*seed, case.run(*seed))).collect();
    runs.chunks(seeds.len())
        .map(|runs| {
            let mut row = SineRow { figures: Vec::new(), stopped: Vec::new() };
            for (seed, run) in runs {
                match run {
                    Ok(figures) => row.figures.push(*figures),
                    Err(error @ ExperimentError::Stopped { .. }) => {
                        row.stopped.push((*seed, error.to_string()));
                    }
                    Err(error) => return Err(error.clone()),
                }
            }
            Ok(row)
        })
        .collect()
}

#[derive(Debug, Default)]
struct Errors {
    squares: f64,
    count: f64,
    largest: f64,
}

impl Errors {
    fn add(&mut self, error: f64) {
        self.squares += error * error;
        self.count += 1.0;
        self.largest = self.largest.max(error.abs());
    }

    fn rms(&self) -> f64 {
        (self.squares / self.count).sqrt()
    }
}

#[derive(Debug)]
struct SlackCount {
    limit_n: f64,
    least_n: f64,
    events: u32,
    is_slack: bool,
}

impl SlackCount {
    fn new(limit_n: f32) -> Self {
        Self { limit_n: f64::from(limit_n), least_n: f64::INFINITY, events: 0, is_slack: false }
    }

    fn look(&mut self, joint: &DrivenJoint) {
        let least_n = joint.bench().tensions_n().into_iter().fold(f64::INFINITY, f64::min);
        self.least_n = self.least_n.min(least_n);
        let was_slack = std::mem::replace(&mut self.is_slack, least_n < self.limit_n);
        self.events += u32::from(self.is_slack && !was_slack);
    }
}

impl SineRow {
    /// Median of a figure over the seeds; no number if every run was stopped.
    #[must_use]
    pub fn median(&self, figure: fn(&SineFigures) -> f64) -> f64 {
        Spread::of(self.figures.iter().map(figure)).map_or(f64::NAN, |spread| spread.median)
    }

    /// Largest of a figure over the seeds.
    #[must_use]
    pub fn largest(&self, figure: fn(&SineFigures) -> f64) -> f64 {
        self.figures.iter().map(figure).fold(f64::NAN, f64::max)
    }

    /// Slack events of all seeds.
    #[must_use]
    pub fn slack_events(&self) -> u32 {
        self.figures.iter().map(|figures| figures.slack_events).sum()
    }
}

/// A way to compensate.
#[derive(Debug, Clone, Copy)]
pub struct Way {
    /// Name in tables, with `compensator.source`.
    pub name: &'static str,
    change: fn(&mut Parameters),
}

/// Ways that are compared.
pub const WAYS: [Way; 4] = [
    Way {
        name: "none (`compensator.source` 0), four tensions",
        change: |parameters| parameters.compensator.source = 0.0,
    },
    Way {
        name: "none, encoders and current only",
        change: |parameters| {
            parameters.compensator.source = 0.0;
            parameters.tension.fitted = 0.0;
        },
    },
    Way { name: "default: four tensions (1)", change: |_| () },
    Way {
        name: "encoders and current only (3)",
        change: |parameters| {
            parameters.compensator.source = 3.0;
            parameters.tension.fitted = 0.0;
        },
    },
];

/// All frequencies with all ways to compensate, way by way.
#[must_use]
pub fn frequency_cases() -> Vec<SineCase> {
    let case =
        |change: fn(&mut Parameters), hz| SineCase::new(BenchConfig::default(), hz, AMPLITUDE_RAD, change);
    WAYS.iter().flat_map(|way| FREQUENCIES_HZ.map(|hz| case(way.change, hz))).collect()
}

/// All frequencies and ways on a bench whose sheaths go to and fro by pi, way by way.
#[must_use]
pub fn step_cases() -> Vec<SineCase> {
    frequency_cases().into_iter().map(|case| SineCase { moved: Moved::BySteps, ..case }).collect()
}

/// Factors of `mu K` at the start, each at 0.1 and 0.5 Hz.
pub const START_FACTORS: [f32; 3] = [0.5, 1.0, 1.5];

/// `mu K` of the parameters wrong at the start.
#[must_use]
pub fn start_cases() -> Vec<SineCase> {
    let case = |factor: f32, hz| {
        SineCase::new(BenchConfig::default(), hz, MIDDLE_AMPLITUDE_RAD, |parameters| {
            parameters.sheath.friction_coefficient *= factor;
        })
    };
    START_FACTORS.iter().flat_map(|factor| [0.1, 0.5].map(|hz| case(*factor, hz))).collect()
}

/// Weights at the end of the arm \[kg\]; the arm itself has [`ARM_INERTIA_KG_M2`].
pub const MASSES_KG: [f64; 7] = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0];
/// Inertia of the arm without a weight \[kg m²\].
pub const ARM_INERTIA_KG_M2: f64 = 2e-4;

/// Loads from none to the largest.
#[must_use]
pub fn load_cases() -> Vec<SineCase> {
    let bench =
        |mass_kg| BenchConfig { mass_kg, load_inertia_kg_m2: ARM_INERTIA_KG_M2, ..BenchConfig::default() };
    MASSES_KG.map(|mass_kg| SineCase::new(bench(mass_kg), 0.5, MIDDLE_AMPLITUDE_RAD, |_| ())).to_vec()
}

/// Amplitude that the least pretension is that of \[rad\].
pub const PRETENSION_AMPLITUDE_RAD: f32 = 0.2;
/// Pretensions over the least one.
pub const PRETENSION_FACTORS: [f64; 5] = [1.0, 1.25, 1.5, 2.0, 4.0];

/// Least pretension for the torque of the default weight at [`PRETENSION_AMPLITUDE_RAD`] while K is at its largest, both tendons just
/// taut \[N\]: `(T_out/r2)(e^a - 1)/(2 a)`.
#[must_use]
pub fn least_pretension_n() -> f64 {
    let bench = BenchConfig::default();
    let SheathMotionConfig { middle_rad, span_rad, .. } = SheathMotionConfig::BY_HAND;
    let exponent = bench.friction_coefficient * (middle_rad + span_rad);
    let weight_nm = bench.mass_kg * bench.gravity_m_per_s2 * bench.arm_m;
    let torque_nm = weight_nm * f64::from(PRETENSION_AMPLITUDE_RAD).sin();
    torque_nm / bench.output_radius_m * exponent.exp_m1() / (2.0 * exponent)
}

/// Pretensions down to the least one, at 0.2 Hz; the amplitude is what the board accepts of that of the least pretension.
#[must_use]
pub fn pretension_cases() -> Vec<SineCase> {
    let bench =
        |factor| BenchConfig { pretension_n: factor * least_pretension_n(), ..BenchConfig::default() };
    PRETENSION_FACTORS
        .map(|factor| SineCase::new(bench(factor), 0.2, PRETENSION_AMPLITUDE_RAD, |_| ()))
        .to_vec()
}
