//! Forward run: reference, position loop, motor, joint, sensors; the result is a recording.

mod motion;
mod position_loop;
mod sensing;

use bowden_model::channel::Channel;
use bowden_model::drive::BridgeInput;
use bowden_model::effect_set::EffectSet;
use bowden_model::plant::{InputBoundary, OutputBoundary, Plant, PlantConfig, StepInput};
use bowden_model::transmission::Outside;

use crate::outcome::Failure;
use crate::progress::{Progress, Quiet, ended_early};
use crate::recording::Recording;
use crate::rig::Rig;

pub use motion::{AMPLITUDE_RAD, Motion};
pub use position_loop::{BANDWIDTH_HZ, PositionLoop};
use sensing::Sensors;

/// Slowest rate of the position loop, Hz; recordings with fewer samples a second see every n-th of its periods.
const LOOP_RATE_HZ: f64 = 1000.0;

/// Columns of a run in the order of the file; tensions only with tendons.
const COLUMNS: [Channel; 10] = [
    Channel::ThetaRef,
    Channel::ThetaIn,
    Channel::ThetaOut,
    Channel::F1,
    Channel::F2,
    Channel::F3,
    Channel::F4,
    Channel::Duty,
    Channel::BusVoltage,
    Channel::MotorCurrent,
];

/// Reference of the position loop over time, s and rad.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    t_s: Vec<f64>,
    theta_rad: Vec<f64>,
}

impl Reference {
    /// A built-in motion.
    #[must_use]
    pub fn of_motion(motion: Motion, seconds: f64, seed: u64) -> Self {
        let theta_rad = motion.reference_rad(seconds, LOOP_RATE_HZ, seed);
        let t_s = (0..theta_rad.len()).map(|k| k as f64 / LOOP_RATE_HZ).collect();
        Self { t_s, theta_rad }
    }

    /// The reference of a recording; its first sample is at 0 s.
    ///
    /// # Errors
    /// When the recording has no `theta_ref_rad`.
    pub fn of_recording(recording: &Recording) -> Result<Self, Failure> {
        let (Some(theta), Some(start_s)) = (recording.channel(Channel::ThetaRef), recording.t_s().first())
        else {
            return Err(Failure::bad_input(format!(
                "{}:1: no column `theta_ref_rad`; name the reference so",
                recording.source()
            )));
        };
        let t_s = recording.t_s().iter().map(|t_s| t_s - start_s).collect();
        Ok(Self { t_s, theta_rad: theta.to_vec() })
    }

    /// Value at a time, on a straight line between samples; the last one from there on.
    #[must_use]
    pub fn at(&self, t_s: f64) -> f64 {
        let after = self.t_s.partition_point(|sample_s| *sample_s <= t_s);
        let (Some(before), Some(&next_rad)) = (after.checked_sub(1), self.theta_rad.get(after)) else {
            let nearest = if after == 0 { self.theta_rad.first() } else { self.theta_rad.last() };
            return nearest.copied().unwrap_or(0.0);
        };
        let share = (t_s - self.t_s[before]) / (self.t_s[after] - self.t_s[before]);
        self.theta_rad[before] + share * (next_rad - self.theta_rad[before])
    }
}

/// Length, rate and seed of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunOptions {
    /// Length, s.
    pub seconds: f64,
    /// Samples a second.
    pub rate_hz: f64,
    /// Seed of the sensors' noise.
    pub seed: u64,
}

/// Records a run of `rig` along `reference`; equal arguments give equal recordings, bit for bit.
///
/// The joint starts at rest at the start of the reference. `duty` and `bus_v` hold from their sample to the next one
/// where the rate is 1 kHz or more; below, the loop changes the duty between samples too.
///
/// # Errors
/// When the rig lacks a part of a forward run; exit status 1, if the simulated joint runs away.
pub fn run(rig: &Rig, reference: &Reference, options: RunOptions) -> Result<Recording, Failure> {
    run_watched(rig, reference, options, &Quiet)
}

/// Like [`run`]; fails at the next sample when `progress` asks for an early end.
///
/// # Errors
/// As [`run`]; exit status 1 after an early end.
pub fn run_watched(
    rig: &Rig,
    reference: &Reference,
    options: RunOptions,
    progress: &dyn Progress,
) -> Result<Recording, Failure> {
    let Some(motor) = rig.joint.motor else {
        return Err(Failure::bad_input(format!(
            "rig `{}`: no [motor], which a forward run needs; add it or use replay",
            rig.name
        )));
    };
    let config = plant_config(rig)?;
    let has_tendon = config.transmission().is_some();
    let channels: Vec<Channel> =
        COLUMNS.into_iter().filter(|channel| has_tendon || !Channel::TENSIONS.contains(channel)).collect();
    let mut sensors = Sensors::new(rig, &channels, options.seed);

    let samples = ((options.seconds * options.rate_hz).round() as usize).max(1);
    let ticks = (LOOP_RATE_HZ / options.rate_hz).ceil().max(1.0) as usize;
    let tick_s = 1.0 / (options.rate_hz * ticks as f64);
    let steps = (tick_s / rig.step_s.min(config.stable_step_s()) - 1e-9).ceil().max(1.0);
    let start_rad = reference.at(0.0);
    let mut position_loop = PositionLoop::new(rig, &config, start_rad)?;
    let mut plant = Plant::at_rest(&config, start_rad, start_rad * pulley_ratio(&config));
    let mut input = StepInput {
        bridge: BridgeInput { duty: 0.0, bus_v: motor.supply_v, enabled: true },
        theta_in_rad: start_rad,
        theta_out_rad: 0.0,
        input_torque_nm: 0.0,
        loose_pulley: Outside::NOTHING,
        external_torque_nm: 0.0,
    };
    plant.settle(&config, &input);
    let mut t_s = Vec::with_capacity(samples);
    let mut columns = vec![Vec::with_capacity(samples); channels.len()];
    for sample in 0..samples {
        if progress.interrupted() {
            return Err(ended_early(&format!("simulation of `{}`", rig.name)));
        }
        let now_s = sample as f64 / options.rate_hz;
        for tick in 0..ticks {
            let tick_at_s = now_s + tick as f64 * tick_s;
            let reference_rad = reference.at(tick_at_s);
            input.bridge.duty = position_loop.duty(reference_rad, &plant, tick_at_s, tick_s);
            if tick == 0 {
                let readings = sensors.read(&config, &plant, now_s, reference_rad, input.bridge);
                if !readings.iter().all(|value| value.is_finite()) {
                    return Err(Failure::failed(format!(
                        "rig `{}`: the simulated joint runs away at t = {now_s} s; check stiffness, inertia and radii, \
                         or lower simulation.step_s",
                        rig.name
                    )));
                }
                t_s.push(now_s);
                columns.iter_mut().zip(readings).for_each(|(column, reading)| column.push(reading));
            }
            for _ in 0..steps as usize {
                plant.step(&config, &input, tick_s / steps);
            }
        }
    }
    let mut recording = Recording::new(format!("simulation of {}", rig.name), t_s);
    for (channel, values) in channels.into_iter().zip(columns) {
        recording.set(channel, values);
    }
    Ok(recording)
}

/// Joint from motor to arm; without inertia at the joint, to cables that carry no torque.
fn plant_config(rig: &Rig) -> Result<PlantConfig, Failure> {
    let refuse = |reason: String| Failure::bad_input(format!("rig `{}`: {reason}", rig.name));
    let effects = EffectSet::from_slice(&rig.effects).map_err(|error| refuse(error.to_string()))?;
    let moves = rig.joint.load.is_some_and(|load| load.mass_kg * load.arm_m + load.inertia_kg_m2 > 0.0);
    let output = if moves { OutputBoundary::Arm } else { OutputBoundary::Torque };
    PlantConfig::new(rig.joint, rig.elements, effects, InputBoundary::Motor, output)
        .map_err(|error| refuse(error.to_string()))
}

/// Turns of the joint a turn of the input pulley.
fn pulley_ratio(config: &PlantConfig) -> f64 {
    config.transmission().map_or(1.0, |parts| {
        let pulleys = parts.pulleys();
        pulleys.input_radius_m / pulleys.output_radius_m
    })
}
