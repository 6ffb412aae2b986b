//! `bowden simulate`: columns, determinism, rigs with and without parts, references from files.

use std::fs;
use std::path::Path;

use bowden_core::recording::{ReadOptions, Recording};
use bowden_model::channel::Channel;

use crate::common::bowden;

const MOTOR: &str = r"
[motor]
supply_v = 24.0
resistance_ohm = 2.0
inductance_h = 0.0008
torque_constant_nm_per_a = 0.03
gear_ratio = 30.0
rotor_inertia_kg_m2 = 5.0e-6
viscous_nm_s_per_rad = 0.02
";

const TENDON: &str = r"
[pulleys]
input_radius_m = 0.015
output_radius_m = 0.020
[tendon]
length_m = 1.0
axial_stiffness_n = 72900.0
pretension_n = 30.0
[sheath]
wrap_angle_rad = 3.14159265
friction_coefficient = 0.12
";

const LOAD: &str = r"
[load]
mass_kg = 2.5
arm_m = 0.03
inertia_kg_m2 = 0.0
viscous_nm_s_per_rad = 0.004
";

const SENSORS: &str = r"
[sensors]
encoder_bits = 12
tension_full_scale_n = 98.0665
adc_bits = 12
tension_noise_n = 0.1
current_noise_a = 0.01
";

/// Simulates a rig of these parts and reads what was written.
fn simulate(parts: &[&str], options: &[&str]) -> Result<Recording, (i32, String)> {
    let folder = tempfile::tempdir().unwrap();
    let rig = format!("schema = \"bowden-rig/1\"\nname = \"bench\"\n{}", parts.concat());
    fs::write(folder.path().join("rig.toml"), rig).unwrap();
    let reference = "t_s,theta_ref_rad\n5.0,0.2\n6.0,0.4\n6.5,0.4\n";
    fs::write(folder.path().join("reference.csv"), reference).unwrap();
    let out = folder.path().join("rec.csv");
    let arguments = [&["simulate", "--rig", "rig.toml", "--out", "rec.csv"], options].concat();
    match bowden(folder.path(), &arguments) {
        (0, ..) => Ok(load(&out)),
        (status, _, stderr) => {
            assert!(!out.exists(), "a refused run leaves no file");
            Err((status, stderr))
        }
    }
}

fn load(path: &Path) -> Recording {
    Recording::load(path, &ReadOptions::default()).unwrap()
}

fn spread(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn a_whole_bench_has_the_columns_of_a_recording() {
    let recording =
        simulate(&[MOTOR, TENDON, LOAD, SENSORS], &["--seconds", "6", "--motion", "sine"]).unwrap();
    let names: Vec<&str> = recording.columns().iter().map(bowden_core::recording::Column::name).collect();
    let expected = "theta_ref_rad theta_in_rad theta_out_rad f1_n f2_n f3_n f4_n duty bus_v i_motor_a";
    assert_eq!(names.join(" "), expected);
    assert_eq!(recording.len(), 6000);
    assert_eq!(recording.t_s()[5999], 5.999);
    let channel = |channel| recording.channel(channel).unwrap();
    // The joint turns by the ratio of the radii, less the stretch of the tendons (below 40 mrad at 0.55 N·m).
    let worst = channel(Channel::ThetaIn)
        .iter()
        .zip(channel(Channel::ThetaOut))
        .map(|(input, output)| (0.75 * input - output).abs())
        .fold(0.0, f64::max);
    assert!((0.002..0.04).contains(&worst), "{worst}");
    // At rest the load of both cables is the pretension; a moving one of a pair loses what the other gains.
    assert!((channel(Channel::F1)[0] - 30.0).abs() < 0.6, "{}", channel(Channel::F1)[0]);
    assert!(spread(channel(Channel::F1)) > 3.0);
    let tracking: Vec<f64> = channel(Channel::ThetaRef)
        .iter()
        .zip(channel(Channel::ThetaIn))
        .map(|(reference, input)| reference - input)
        .collect();
    assert!(spread(&tracking) < 0.05 * spread(channel(Channel::ThetaRef)), "{}", spread(&tracking));
}

#[test]
fn a_seed_gives_the_same_recording_and_another_seed_other_noise() {
    let with = |seed| {
        let options = ["--seconds", "2", "--motion", "rest", "--seed", seed];
        simulate(&[MOTOR, TENDON, LOAD, SENSORS], &options).unwrap()
    };
    let (a, b, c) = (with("7"), with("7"), with("8"));
    assert_eq!(a, b);
    assert_ne!(a.channel(Channel::F2), c.channel(Channel::F2));
    assert_eq!(a.channel(Channel::ThetaOut), c.channel(Channel::ThetaOut));
}

#[test]
fn a_motor_with_a_load_has_no_tensions() {
    let recording = simulate(&[MOTOR, LOAD, SENSORS], &["--seconds", "4", "--rate-hz", "200"]).unwrap();
    assert_eq!(recording.len(), 800);
    assert!(recording.channel(Channel::F1).is_none());
    // Motor and load are one shaft.
    assert_eq!(recording.channel(Channel::ThetaIn), recording.channel(Channel::ThetaOut));
    assert!(spread(recording.channel(Channel::ThetaOut).unwrap()) > 0.1);
}

#[test]
fn tendons_without_a_load_carry_only_their_friction() {
    let recording = simulate(&[MOTOR, TENDON, SENSORS], &["--seconds", "6", "--motion", "sine"]).unwrap();
    let torque_n: Vec<f64> = recording
        .channel(Channel::F2)
        .unwrap()
        .iter()
        .zip(recording.channel(Channel::F4).unwrap())
        .map(|(f2, f4)| f2 - f4)
        .collect();
    // Two channels with 0.1 N of noise each.
    assert!(spread(&torque_n) < 0.2, "{}", spread(&torque_n));
    assert!(spread(recording.channel(Channel::F1).unwrap()) > 2.0);
}

#[test]
fn a_reference_file_is_followed_from_its_first_sample() {
    let options = ["--reference", "reference.csv", "--rate-hz", "100"];
    let recording = simulate(&[MOTOR, TENDON, LOAD, SENSORS], &options).unwrap();
    assert_eq!((recording.len(), recording.t_s()[0]), (150, 0.0));
    let reference = recording.channel(Channel::ThetaRef).unwrap();
    // 0.2 rad/s from 0.2 rad, then held.
    for (sample, expected) in [(0, 0.2), (50, 0.3), (100, 0.4), (149, 0.4)] {
        assert!((reference[sample] - expected).abs() < 1e-12, "{sample}: {}", reference[sample]);
    }
    // The start is settled: nothing jumps.
    let theta = recording.channel(Channel::ThetaIn).unwrap();
    assert!((theta[0] - 0.2).abs() < 1e-3 && (theta[1] - 0.2).abs() < 0.01, "{theta:?}");
}

#[test]
fn a_known_position_loop_is_used() {
    let law = "[controller]\nkind = \"proportional\"\ngain_duty_per_rad = 2.0\nduty_limit = 0.05\n";
    let options = ["--seconds", "3", "--motion", "staircase"];
    let recording = simulate(&[MOTOR, LOAD, SENSORS, law], &options).unwrap();
    let (reference, theta) =
        (recording.channel(Channel::ThetaRef).unwrap(), recording.channel(Channel::ThetaIn).unwrap());
    let duty = recording.channel(Channel::Duty).unwrap();
    assert!(duty.iter().any(|duty| duty.abs() == 0.05), "the limit is reached");
    for k in 0..recording.len() {
        let expected = (2.0 * (reference[k] - theta[k])).clamp(-0.05, 0.05);
        // The loop sees the angle itself, the recording its count: at most 2 · half a count of 1.53 mrad.
        assert!((duty[k] - expected).abs() < 1.6e-3, "{k}: {} for {expected}", duty[k]);
    }
}

#[test]
fn what_cannot_be_simulated_is_refused_in_one_line() {
    for (parts, options, expected) in [
        (
            vec![TENDON, LOAD, SENSORS],
            vec!["--seconds", "1"],
            "rig.toml:1:1: no [motor], which a forward run needs; add it or use replay",
        ),
        (
            vec![MOTOR, LOAD, SENSORS],
            vec!["--motion", "zigzag"],
            "invalid value 'zigzag' for '--motion <NAME>' [possible values: lab, sine, triangle, multisine, \
             staircase, rest]; see `bowden simulate --help`",
        ),
        (
            vec![MOTOR, LOAD, SENSORS],
            vec!["--motion", "sine", "--reference", "reference.csv"],
            "the argument '--motion <NAME>' cannot be used with '--reference <FILE.csv>'; see `bowden simulate --help`",
        ),
        (
            vec![MOTOR, LOAD, SENSORS],
            vec!["--reference", "rig.toml"],
            "rig.toml:1: no column `t_s`; the header has schema = \"bowden-rig/1\"; rename the time column, or map it \
             under [recording.columns] of the rig: t_s = { column = \"...\" }",
        ),
    ] {
        let refused = simulate(&parts, &options).map(|_| ());
        assert_eq!(refused, Err((2, format!("bowden: {expected}\n"))), "{options:?}");
    }
}
