//! Beyond the paper: the same task, with a controller that follows the friction of the sheaths and is not retuned.
//!
//! Task, loads and motions of the sheaths are those of section 5.2 ([`crate::disturbed_tracking`]). A [`SensorSet`] says which
//! sensors the firmware is told of; what is not fitted, it does not read. Parameters are fixed once for both loads, on seeds
//! 101 to 110; the figures come from other seeds. The measure is the part of the uncompensated error that is removed, seed by
//! seed: `1 - error/error without compensation`.

use bowden_control::parameters::Parameters;
use bowden_link::message::Mode;
use rayon::prelude::*;

use crate::disturbed_tracking::{Method, SETUP, TrackingSetup, track};
use crate::error::ExperimentError;
use crate::tracking_methods::{LOADS, PaperLoad, Spread, uncompensated};

/// First of the seeds that figures come from.
pub const FIRST_SEED: u64 = 401;

/// `compensator.source`: friction as it is followed, stretch from both encoders.
const SOURCE_ADAPTIVE: f32 = 3.0;

/// Sensors that the firmware is told of, and what is wanted with them.
#[derive(Debug, Clone, Copy)]
pub struct SensorSet {
    /// Name in tables.
    pub name: &'static str,
    /// Part of the uncompensated error that is to be removed: median and worst seed \[%\].
    pub goal_percent: [f64; 2],
    /// `tension.fitted`.
    fitted: f32,
    mode: Mode,
    tune: fn(&mut Parameters),
}

/// The three sets of sensors, fewest first.
pub const SENSOR_SETS: [SensorSet; 3] = [
    SensorSet {
        name: "both encoders, motor current",
        goal_percent: [80.0, 70.0],
        fitted: 0.0,
        mode: Mode::Position,
        tune: |parameters| {
            slow_turns(parameters);
            parameters.controller.bandwidth = 4.0;
        },
    },
    SensorSet {
        name: "and motor-side tensions",
        goal_percent: [90.0, 80.0],
        fitted: 1.0,
        mode: Mode::Position,
        tune: damped_turns,
    },
    SensorSet {
        name: "all four tensions",
        goal_percent: [95.0, 90.0],
        fitted: 2.0,
        mode: Mode::Torque,
        tune: stiff_torque_loop,
    },
];

/// Position mode: the dead zone is crossed so slowly, and the input pulley held so softly, that the weight does not ring on its
/// tendons.
fn slow_turns(parameters: &mut Parameters) {
    parameters.compensator.source = SOURCE_ADAPTIVE;
    parameters.compensator.rate_limit = 0.07;
    parameters.compensator.encoder_time = 0.1;
}

/// Position mode with tensions at the motor: they damp the weight, so that the dead zone may be crossed twice as fast and the
/// stretch followed as fast again.
fn damped_turns(parameters: &mut Parameters) {
    parameters.compensator.source = SOURCE_ADAPTIVE;
    parameters.compensator.rate_limit = 0.15;
    parameters.compensator.encoder_time = 0.05;
    parameters.controller.bandwidth = 6.0;
}

/// Torque mode: three times the default gain, which tendons as long as these bear.
fn stiff_torque_loop(parameters: &mut Parameters) {
    parameters.controller.torque_gain = 12.0;
}

/// What the parameters are wrong by when a run starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Name in tables.
    pub name: &'static str,
    /// Friction coefficient of the parameters over the true one.
    pub friction: f32,
}

/// The starts that are tried: right, and `mu K` wrong by half.
pub const STARTS: [Start; 3] = [
    Start { name: "mu K right at the start", friction: 1.0 },
    Start { name: "mu K half of it at the start", friction: 0.5 },
    Start { name: "mu K half as much again", friction: 1.5 },
];

impl SensorSet {
    /// The firmware with these sensors.
    #[must_use]
    pub fn method(&self, setup: &TrackingSetup, load: &PaperLoad, start: &Start) -> Method {
        let mut parameters = setup.parameters(load.mass_kg);
        parameters.tension.fitted = self.fitted;
        (self.tune)(&mut parameters);
        parameters.sheath.friction_coefficient *= start.friction;
        Method { name: self.name, sensors: self.name, mode: self.mode, parameters, paper_percent: None }
    }
}

/// What a set of sensors removes of the uncompensated error over many seeds.
#[derive(Debug, Clone)]
pub struct Removal {
    /// The sensors.
    pub sensors: SensorSet,
    /// Weight at the end of the arm \[kg\].
    pub mass_kg: f64,
    /// Average torque tracking error of the runs that came to their end \[%\].
    pub torque_percent: Option<Spread>,
    /// Part of the uncompensated error that is removed \[%\]; 0 for a run that the supervisor stopped.
    pub removed_percent: Spread,
    /// Root mean square position error \[rad\].
    pub angle_rms_rad: Option<Spread>,
    /// Runs that the supervisor stopped, with what it said of the first.
    pub stopped: Vec<(u64, String)>,
    /// Runs.
    pub runs: usize,
}

/// Error without compensation for each seed \[%\].
///
/// # Errors
/// That of the first run that fails.
pub fn uncompensated_percent(load: &PaperLoad, seeds: &[u64]) -> Result<Vec<f64>, ExperimentError> {
    let method = uncompensated(&SETUP, load);
    seeds
        .par_iter()
        .map(|seed| track(&SETUP, load.mass_kg, &method, *seed).map(|run| run.errors.torque_percent))
        .collect()
}

/// Runs a set of sensors over `seeds`; `uncompensated_percent` has the error without compensation for each of them.
///
/// # Errors
/// [`ExperimentError`] for parameters out of range; a joint that is stopped counts as nothing removed.
pub fn removal(
    sensors: &SensorSet,
    load: &PaperLoad,
    start: &Start,
    seeds: &[u64],
    uncompensated_percent: &[f64],
) -> Result<Removal, ExperimentError> {
    let method = sensors.method(&SETUP, load, start);
    let runs: Vec<_> = seeds.par_iter().map(|seed| track(&SETUP, load.mass_kg, &method, *seed)).collect();
    let mut stopped = Vec::new();
    let (mut removed, mut errors, mut angles) = (Vec::new(), Vec::new(), Vec::new());
    for ((run, seed), before) in runs.into_iter().zip(seeds).zip(uncompensated_percent) {
        match run {
            Ok(run) => {
                removed.push(100.0 * (1.0 - run.errors.torque_percent / before));
                errors.push(run.errors.torque_percent);
                angles.push(run.errors.angle_rms_rad);
            }
            Err(error @ ExperimentError::Stopped { .. }) => {
                removed.push(0.0);
                stopped.push((*seed, error.to_string()));
            }
            Err(error) => return Err(error),
        }
    }
    Ok(Removal {
        sensors: *sensors,
        mass_kg: load.mass_kg,
        torque_percent: Spread::of(errors).ok(),
        removed_percent: Spread::of(removed)?,
        angle_rms_rad: Spread::of(angles).ok(),
        stopped,
        runs: seeds.len(),
    })
}

/// All sets of sensors at both loads and from every start, as the rows of a Markdown table; `count` seeds for the first
/// start, a fifth of them for the others.
///
/// # Errors
/// That of the first run that fails.
pub fn table(count: u64) -> Result<String, ExperimentError> {
    use std::fmt::Write as _;
    let mut text = String::from(
        "| sensors | load | start | seeds | error, median (range) | removed, median | worst seed | wanted | stopped |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for load in &LOADS {
        let seeds: Vec<u64> = (FIRST_SEED..FIRST_SEED + count.max(1)).collect();
        let before = uncompensated_percent(load, &seeds)?;
        for start in &STARTS {
            let count = if start.friction == 1.0 { seeds.len() } else { seeds.len().div_ceil(5) };
            for sensors in &SENSOR_SETS {
                let row = removal(sensors, load, start, &seeds[..count], &before[..count])?;
                let error = row.torque_percent.map_or(String::from("-"), |spread| {
                    format!("{:.2} % ({:.2} to {:.2})", spread.median, spread.least, spread.largest)
                });
                let [median, worst] = sensors.goal_percent;
                let stopped = row.stopped.first().map_or(String::from("0"), |(seed, reason)| {
                    format!("{} (seed {seed}: {reason})", row.stopped.len())
                });
                // Writing to a string does not fail.
                let _ = writeln!(
                    text,
                    "| {} | {} kg | {} | {} | {error} | {:.1} % | {:.1} % | {median} %, {worst} % | {stopped} |",
                    sensors.name,
                    load.mass_kg,
                    start.name,
                    row.runs,
                    row.removed_percent.median,
                    row.removed_percent.least,
                );
            }
        }
    }
    Ok(text)
}
