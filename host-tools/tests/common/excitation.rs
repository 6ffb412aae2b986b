//! What the motions of an excitation tell of a rig's parameters, beside plain motions of the same length.
//!
//! `bowden run` chooses and carries out both on the simulated board. The information of what it records is computed by a route of its own:
//! difference quotients of replays of the whole recording, one parameter changed at a time, and the singular values of all of them together.

use std::fs;
use std::path::Path;

use bowden_core::recording::{ReadOptions, Recording};
use bowden_core::replay::predict;
use bowden_core::rig::Rig;
use bowden_model::channel::Channel;
use bowden_model::parameters::{NOMINAL_PARAMETERS, NominalParameter};
use nalgebra::DMatrix;
use serde_json::Value;

use super::common::bowden;

/// Periods of a plain motion: as slow and as fast as motions of an excitation are, each of which lasts a third as long.
const PERIODS: [f64; 2] = [3.0, 12.0];

/// Smallest amplitude of a plain motion, in hundredths of a radian: twenty counts of an encoder.
const LEAST_HUNDREDTHS: u32 = 3;

/// Relative change of a parameter to each side.
const STEP: f64 = 0.05;

/// Rows that are taken together: 50 ms at 1 kHz, a period of the arm on its tendons. Within it residuals of one cause are alike.
const ROWS_TOGETHER: usize = 50;

/// Rows of a recording at 10 kHz of which one is taken.
const EVERY: usize = 10;

/// What is compared with a replay; the standard deviation that the nominal bench's sensor leaves, in the unit of the channel (12 bits a turn, 0.1 N,
/// 0.01 A); and the share of the channel's spread that no model of a bench undercuts.
const OUTPUTS: [(Channel, f64, f64); 6] = [
    (Channel::ThetaOut, 4.4e-4, 0.002),
    (Channel::F1, 0.1, 0.015),
    (Channel::F2, 0.1, 0.015),
    (Channel::F3, 0.1, 0.015),
    (Channel::F4, 0.1, 0.015),
    (Channel::MotorCurrent, 0.01, 0.015),
];

/// Motions and the logarithm of the determinant of their information, of the rig file `rig.toml` in `place`: first those of an excitation, then
/// plain motions of the same length, each of `forms` and each frequency with the largest amplitude that joint and plan allow.
pub fn compared(place: &Path, seconds: f64, angle_rad: f64, forms: &[&str]) -> Vec<(String, f64)> {
    let rig = Rig::load(&place.join("rig.toml")).unwrap();
    let excite = format!("kind = \"excite\"\nrig = \"rig.toml\"\nseconds = {seconds:?}\n");
    let (words, recordings) = carried_out(place, "excited", angle_rad, &excite);
    let mut all = vec![(words, log_determinant(&rig, &recordings))];
    for form in forms {
        for periods in PERIODS {
            let frequency_hz = periods / seconds;
            let follow = |hundredths: u32| {
                let amplitude = f64::from(hundredths) / 100.0;
                format!(
                    "kind = \"follow\"\nreference = \"{form}\"\namplitude = {amplitude:?}\nfrequency_hz = {frequency_hz:?}\nseconds = {seconds:?}\n"
                )
            };
            let name = format!("{form}-{periods}");
            let can = |hundredths: u32| listed(place, angle_rad, &follow(hundredths)).is_some();
            // The joint cannot do every form at every frequency.
            let (mut done, mut not) = (LEAST_HUNDREDTHS, (angle_rad * 100.0).round() as u32 + 1);
            if !can(done) {
                continue;
            }
            while not - done > 1 {
                let middle = done.midpoint(not);
                *(if can(middle) { &mut done } else { &mut not }) = middle;
            }
            let (words, recordings) = carried_out(place, &name, angle_rad, &follow(done));
            all.push((words, log_determinant(&rig, &recordings)));
        }
    }
    all
}

/// Names and words of the motions of a step; none if the joint cannot do it.
fn listed(place: &Path, angle_rad: f64, step: &str) -> Option<Vec<[String; 2]>> {
    let plan = format!("schema = \"bowden-plan/1\"\n[limits]\nangle_rad = {angle_rad:?}\n[[step]]\n{step}");
    fs::write(place.join("plan.toml"), plan).unwrap();
    let line = ["run", "plan.toml", "--port", "sim", "--out", "out", "--dry-run", "--json"];
    let (status, listed, stderr) = bowden(place, &line);
    if status == 2 {
        let refused = ["the joint cannot do it", "is above the plan's limit"];
        assert!(refused.iter().any(|why| stderr.contains(why)), "{stderr}");
        return None;
    }
    let listed: Value = serde_json::from_str(&listed).unwrap();
    let motion = |step: &Value| ["name", "what"].map(|key| step[key].as_str().unwrap().to_owned());
    Some(listed["steps"].as_array().unwrap().iter().map(motion).collect())
}

/// Words and recordings of the motions of a step, which the simulated board carries out.
fn carried_out(place: &Path, folder: &str, angle_rad: f64, step: &str) -> (String, Vec<Recording>) {
    let motions = listed(place, angle_rad, step).unwrap();
    let (status, _, stderr) = bowden(place, &["run", "plan.toml", "--port", "sim", "--out", folder]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    let words: Vec<&str> = motions.iter().map(|[_, what]| what.as_str()).collect();
    let load = |[name, _]: &[String; 2]| {
        let path = place.join(folder).join(format!("{name}.mcap"));
        thinned(&Recording::load(&path, &ReadOptions::default()).unwrap())
    };
    (words.join("; "), motions.iter().map(load).collect())
}

/// Every tenth row of what a replay needs and is compared with.
fn thinned(recording: &Recording) -> Recording {
    let thin = |values: &[f64]| values.iter().step_by(EVERY).copied().collect::<Vec<f64>>();
    let mut thinned = Recording::new(recording.source(), thin(recording.t_s()));
    for channel in recording.channels() {
        thinned.set(channel, thin(recording.channel(channel).unwrap()));
    }
    thinned
}

/// Logarithm of the determinant of the information of relative changes of the nominal parameters that `rig` has, where each is known to a
/// factor e before.
fn log_determinant(rig: &Rig, recordings: &[Recording]) -> f64 {
    let columns: Vec<Vec<f64>> = NOMINAL_PARAMETERS
        .iter()
        .filter_map(|parameter| {
            let value = parameter.get(&rig.joint).filter(|value| *value > 0.0)?;
            Some(sensitivity(rig, parameter, value, recordings))
        })
        .collect();
    let matrix = DMatrix::from_fn(columns[0].len(), columns.len(), |row, column| columns[column][row]);
    matrix.singular_values().iter().map(|value| (value * value + 1.0).ln()).sum()
}

/// Change of all predictions for a relative change of a parameter, in standard deviations.
fn sensitivity(rig: &Rig, parameter: &NominalParameter, value: f64, recordings: &[Recording]) -> Vec<f64> {
    let [low, high] = [-STEP, STEP].map(|step| {
        let mut rig = rig.clone();
        parameter.set(&mut rig.joint, value * step.exp());
        rig
    });
    let mut column = Vec::new();
    for recording in recordings {
        let [low, high] = [&low, &high].map(|rig| predict(rig, recording).unwrap());
        for (channel, noise, share) in OUTPUTS {
            let recorded = recording.channel(channel).unwrap();
            let mean = recorded.iter().sum::<f64>() / recorded.len() as f64;
            let variance = recorded.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
            let spread = (variance / recorded.len() as f64).sqrt();
            let scale = noise.hypot(share * spread);
            let [low, high] = [&low, &high].map(|predicted| predicted.channel(channel).unwrap());
            let changes: Vec<f64> = low.iter().zip(high).map(|(low, high)| high - low).collect();
            let together = changes.chunks_exact(ROWS_TOGETHER).map(|rows| rows.iter().sum::<f64>());
            column.extend(together.map(|sum| sum / (ROWS_TOGETHER as f64 * 2.0 * STEP * scale)));
        }
    }
    column
}
