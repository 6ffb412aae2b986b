//! `[replay]` of a rig: arbitrary zeros and smoothing of recorded channels.

use bowden_core::joint_model::JointModel;
use bowden_core::recording::Recording;
use bowden_core::rig::Rig;
use bowden_core::simulation::{Prediction, ReplayInput, replay};
use bowden_model::channel::Channel;

const RIG: &str = r#"schema = "bowden-rig/1"
[pulleys]
input_radius_m = 0.01
output_radius_m = 0.01
[tendon]
length_m = 1
axial_stiffness_n = 20000
pretension_n = 20
[replay]
inputs = ["theta_in_rad", "torque_out_nm"]
outputs = ["theta_out_rad", "torque_in_nm"]
"#;

fn rig(keys: &str) -> Result<Rig, String> {
    Rig::parse(&format!("{RIG}{keys}\n"), "rig.toml").map_err(|failure| failure.message().to_owned())
}

/// A slow turn of 0.3 rad about `zero_rad` and a load of `load_nm`, whose sensor jumps by ±`jump_nm` from sample to sample.
fn recording(zero_rad: f64, load_nm: f64, jump_nm: f64) -> Recording {
    let t_s: Vec<f64> = (0..2000).map(|k| f64::from(k) * 1e-3).collect();
    let theta = t_s.iter().map(|t| zero_rad + 0.3 * (2.0 * t).sin()).collect();
    let torque = (0..2000).map(|k| load_nm + if k % 2 == 0 { jump_nm } else { -jump_nm }).collect();
    Recording::new("made", t_s).with(Channel::ThetaIn, theta).with(Channel::TorqueOut, torque)
}

fn predict(keys: &str, recording: &Recording) -> Prediction {
    let model = JointModel::from_rig(&rig(keys).unwrap(), recording).unwrap();
    replay(&model, &ReplayInput::new(&model, recording).unwrap()).unwrap()
}

fn largest(prediction: &Prediction, other: &Prediction, channel: Channel) -> f64 {
    let (a, b) = (prediction.channel(channel).unwrap(), other.channel(channel).unwrap());
    // Away from both ends, where a window holds fewer samples and the joint still settles.
    a.iter().zip(b).skip(200).take(1600).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn the_keys_arrive_and_a_rig_without_them_has_none() {
    let plain = rig("").unwrap();
    assert!(
        plain.free_offsets.is_empty() && plain.relative_inputs.is_empty() && plain.smoothing_s.is_empty()
    );
    let full = rig("free_offsets = [\"torque_in_nm\"]\nrelative_inputs = [\"theta_in_rad\"]\n\
                    smoothing_s = { torque_out_nm = 0.031 }")
    .unwrap();
    assert_eq!(full.free_offsets, [Channel::TorqueIn]);
    assert_eq!(full.relative_inputs, [Channel::ThetaIn]);
    assert_eq!(full.smoothing_s, [(Channel::TorqueOut, 0.031)]);
    let model = JointModel::from_rig(&full, &recording(0.0, 0.0, 0.0)).unwrap();
    assert_eq!(model.free_offsets, [Channel::TorqueIn]);
}

#[test]
fn a_key_on_the_wrong_channel_is_refused_where_it_stands() {
    for (keys, expected) in [
        (
            "free_offsets = [\"theta_in_rad\"]",
            "rig.toml:12:17: `theta_in_rad` in replay.free_offsets is no output",
        ),
        ("relative_inputs = [\"f1_n\"]", "`f1_n` in replay.relative_inputs is no input of the replay"),
        ("smoothing_s = { duty = 0.1 }", "`duty` in replay.smoothing_s is no input of the replay"),
        (
            "smoothing_s = { torque_out_nm = 31 }",
            "replay.smoothing_s.torque_out_nm: got 31, allowed 0 to 1 s",
        ),
        ("smoothing_s = { torque = 0.1 }", "unknown role `torque`"),
        ("smoothing = 0.1", "unknown key `smoothing` in [replay]"),
    ] {
        let message = rig(keys).unwrap_err();
        assert!(message.contains(expected), "{keys}: {message}");
    }
}

#[test]
fn a_relative_input_forgets_its_zero_and_any_other_keeps_it() {
    let keys = "relative_inputs = [\"theta_in_rad\"]";
    let (here, there) = (recording(0.0, 0.05, 0.0), recording(1.25, 0.05, 0.0));
    assert!(largest(&predict(keys, &here), &predict(keys, &there), Channel::ThetaOut) < 1e-9);
    assert!((largest(&predict("", &here), &predict("", &there), Channel::ThetaOut) - 1.25).abs() < 1e-3);
}

#[test]
fn a_smoothed_input_loses_what_alternates_from_sample_to_sample() {
    let (still, noisy) = (recording(0.0, 0.05, 0.0), recording(0.0, 0.05, 0.2));
    // 31 samples of alternating sign leave 1/31 of the jump: 6.5 mN m over 2 EA/L r² = 4 N m/rad.
    let keys = "smoothing_s = { torque_out_nm = 0.031 }";
    let smoothed = largest(&predict(keys, &still), &predict(keys, &noisy), Channel::ThetaOut);
    let raw = largest(&predict("", &still), &predict("", &noisy), Channel::ThetaOut);
    assert!((smoothed - 0.2 / 31.0 / 4.0).abs() < 0.1 * smoothed, "{smoothed}");
    assert!((raw - 0.2 / 4.0).abs() < 0.1 * raw, "{raw}");
}
