//! Whether a recording can be one of this rig: enough samples, time in seconds, magnitudes in SI units.

use bowden_model::channel::Channel;

use super::Rig;
use crate::outcome::Failure;
use crate::recording::Recording;

/// Fewest samples from which anything can be concluded.
pub const MINIMUM_SAMPLES: usize = 50;

/// Longest median step that can resolve the motion of a joint, s.
const LONGEST_STEP_S: f64 = 0.5;

/// Largest angle of a joint with tendons, rad: two turns.
const LARGEST_TENDON_ANGLE_RAD: f64 = 4.0 * std::f64::consts::PI;

/// Largest angle of a motor that may turn on, rad.
const LARGEST_ANGLE_RAD: f64 = 1000.0;

/// Factor beyond what the rig can produce from which on a magnitude tells of another unit.
const MARGIN: f64 = 10.0;

/// Duty beyond which it is no fraction; a hair above 1 comes from rounding in drives.
const LARGEST_DUTY: f64 = 1.05;

/// Largest magnitude of a channel and what a larger one most likely means.
struct Limit {
    magnitude: f64,
    likely: &'static str,
}

/// Accepts the recording, with its spikes set aside and notes on them and on gaps, or says why it cannot be used.
pub(super) fn accept(rig: &Rig, mut recording: Recording, samples: usize) -> Result<Recording, Failure> {
    if recording.len() < samples {
        let got = recording.len();
        return Err(Failure::bad_input(format!(
            "{}: got {got} samples, expected at least {samples}; record longer",
            recording.place(got.saturating_sub(1))
        )));
    }
    if let Some(step_s) = recording.median_step_s() {
        if step_s > LONGEST_STEP_S {
            return Err(Failure::bad_input(format!(
                "{}: t_s: the median step is {step_s} s, expected at most {LONGEST_STEP_S} s; if the time is in ms, \
                 map it under [recording.columns] with scale = 0.001",
                recording.place(0)
            )));
        }
        let gaps = find_gaps(&recording, step_s);
        recording.add_notes(gaps);
    }
    recording.set_spikes_aside(|channel| limit(rig, channel).map(|limit| limit.magnitude));
    for channel in recording.channels() {
        let Some(limit) = limit(rig, channel) else { continue };
        let values = recording.channel(channel).unwrap_or_default();
        if let Some(sample) = values.iter().position(|value| value.abs() > limit.magnitude) {
            return Err(Failure::bad_input(format!(
                "{}: {}: got {}, expected within ±{:.4} {}; {}, map the column under [recording.columns] with its \
                 scale",
                recording.place(sample),
                channel.role(),
                values[sample],
                limit.magnitude,
                channel.unit(),
                limit.likely
            )));
        }
    }
    Ok(recording)
}

/// A note on steps in time that are far longer than the others.
fn find_gaps(recording: &Recording, step_s: f64) -> Option<String> {
    let t_s = recording.t_s();
    let gap_s = recording.gap_s()?;
    let long = |pair: &[f64]| pair[1] - pair[0] > gap_s;
    let first = t_s.windows(2).position(long)?;
    let gaps = t_s.windows(2).filter(|pair| long(pair)).count();
    let length_s = t_s[first + 1] - t_s[first];
    let what = if gaps == 1 { "a gap".to_owned() } else { format!("the first of {gaps} gaps") };
    Some(format!(
        "{}: {what} in t_s: {length_s:.6} s without a sample where the median step is {step_s:.6} s; samples were lost",
        recording.place(first + 1)
    ))
}

fn limit(rig: &Rig, channel: Channel) -> Option<Limit> {
    let joint = &rig.joint;
    let full_scale_n = joint.sensors.tension_full_scale_n;
    let motor = joint.motor;
    let limit = |magnitude, likely| Some(Limit { magnitude, likely });
    match channel {
        Channel::ThetaRef | Channel::ThetaMotor | Channel::ThetaIn | Channel::ThetaOut => {
            let largest = if joint.tendon.is_some() { LARGEST_TENDON_ANGLE_RAD } else { LARGEST_ANGLE_RAD };
            limit(largest, "if it is in degrees")
        }
        Channel::F1 | Channel::F2 | Channel::F3 | Channel::F4 => {
            limit(MARGIN * full_scale_n, "if it is in another unit than N")
        }
        Channel::TorqueIn | Channel::TorqueOut => {
            let pulleys = joint.pulleys.filter(|_| joint.tendon.is_some())?;
            let radius_m = pulleys.input_radius_m.max(pulleys.output_radius_m);
            limit(MARGIN * full_scale_n * radius_m, "if it is in another unit than N m")
        }
        Channel::Duty => limit(LARGEST_DUTY, "if it is in percent or counts"),
        Channel::BusVoltage => limit(MARGIN * motor?.supply_v, "if it is in another unit than V"),
        Channel::MotorCurrent => {
            let motor = motor?;
            limit(MARGIN * motor.supply_v / motor.resistance_ohm, "if it is in another unit than A")
        }
        Channel::DriveEnable => limit(1.0, "if it is no 0 or 1"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bench;

    /// The duty changes by a third from sample to sample.
    fn chattering(duty_of_one: f64, factor: f64) -> Recording {
        let chatter = |k: usize| factor * if k.is_multiple_of(2) { 0.17 } else { -0.17 };
        let mut duty: Vec<f64> = (0..1000).map(chatter).collect();
        duty[700] = duty_of_one;
        let mut recording = test_bench::swung(1000);
        recording.set(Channel::Duty, duty);
        recording.set(Channel::BusVoltage, vec![24.0; 1000]);
        recording
    }

    #[test]
    fn one_value_that_a_channel_cannot_have_is_set_aside_and_many_are_refused() {
        let rig = test_bench::rig();
        let accepted = accept(&rig, chattering(-1.4, 1.0), MINIMUM_SAMPLES).unwrap();
        assert!((accepted.channel(Channel::Duty).unwrap()[700] + 0.17).abs() < 1e-12);
        assert!(
            accepted.notes()[0].contains("duty is -1.4 between -0.17 and -0.17; one value of 1000 samples")
        );
        let percent = accept(&rig, chattering(-1.4, 100.0), MINIMUM_SAMPLES).unwrap_err();
        assert!(percent.to_string().contains("duty: got 17, expected within ±1.0500 1; if it is in percent"));
    }
}
