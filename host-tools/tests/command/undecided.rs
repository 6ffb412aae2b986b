//! What recordings do not settle, from the first diagnosis to the recording that settles it.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::common::bowden;
use bowden_core::diagnose::verdict::Diagnosis;
use bowden_core::rig::Rig;

/// Cables without a motor: an input angle that is followed, an output that carries nothing.
const RIG: &str = r#"schema = "bowden-rig/1"
name = "cables"
[pulleys]
input_radius_m = 0.015
output_radius_m = 0.015
[tendon]
length_m = 0.5
axial_stiffness_n = 100000
pretension_n = 1
[sheath]
wrap_angle_rad = 1.0
friction_coefficient = 0.01
[sensors]
encoder_bits = 14
tension_full_scale_n = 100
adc_bits = 12
tension_noise_n = 0.1
[simulation]
elements = 1
[replay]
inputs = ["theta_in_rad", "torque_out_nm"]
outputs = ["theta_out_rad"]
"#;

/// A joint that turns 1 / 0.97 times as far as the rig has it: a pulley of the joint 3 % smaller, in closed form.
fn record(path: &Path, travel_rad: f64) {
    let count = std::f64::consts::TAU / 16384.0;
    let mut text = "t_s,theta_in_rad,theta_out_rad,torque_out_nm\n".to_owned();
    for sample in 0..12_000 {
        let t_s = f64::from(sample) * 2e-3;
        let theta_rad = travel_rad * (0.8 * (t_s * 1.3).sin() + 0.2 * (t_s * 4.1).sin());
        let [input, output] = [theta_rad, theta_rad / 0.97].map(|rad| (rad / count).round() * count);
        writeln!(text, "{t_s:.3},{input:.6},{output:.6},0").unwrap();
    }
    fs::write(path, text).unwrap();
}

/// Diagnoses a recording with a rig file; what was said, and the rig that was written.
fn diagnosed(folder: &Path, recording: &str, rig: &str, out: &str) -> (Diagnosis, Rig) {
    let arguments = ["diagnose", recording, "--rig", rig, "--out", out, "--quiet"];
    let (status, _, errors) = bowden(folder, &arguments);
    assert_eq!((status, errors.as_str()), (0, ""));
    let text = fs::read_to_string(folder.join(out).join("diagnosis.json")).unwrap();
    let rig = Rig::load(&folder.join(out).join("rig.diagnosed.toml")).unwrap();
    (serde_json::from_str(&text).unwrap(), rig)
}

#[test]
fn a_radius_is_undecided_until_a_longer_travel_settles_it() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("rig.toml"), RIG).unwrap();
    record(&folder.join("short.csv"), 0.5);
    record(&folder.join("again.csv"), 0.4);
    record(&folder.join("long.csv"), 2.5);
    let undecided = |rig: &Rig| {
        let all = rig.undecided.iter();
        all.map(|one| (one.parameter.clone(), one.before, one.rival())).collect::<Vec<_>>()
    };
    let parameter = "pulleys.output_radius_m";
    let rivals = ["theta_out_rad", "theta_in_rad"].map(|channel| format!("encoder_eccentricity ({channel})"));
    let expected = rivals.clone().map(|rival| (parameter.to_owned(), 0.015, rival));
    let radius_m = |rig: &Rig| rig.joint.pulleys.unwrap().output_radius_m;

    let (diagnosis, first) = diagnosed(folder, "short.csv", "rig.toml", "first");
    assert!((radius_m(&first) / 0.01455 - 1.0).abs() < 1e-3, "{}", diagnosis.summary);
    assert_eq!(undecided(&first), expected);
    for rival in rivals {
        let group = vec![parameter.to_owned(), format!("effects.{rival}")];
        assert!(diagnosis.indistinguishable.contains(&group), "{rival}");
    }

    // The rig file has the radius by now; that it is undecided is remembered.
    let (_, second) = diagnosed(folder, "again.csv", "first/rig.diagnosed.toml", "second");
    assert_eq!(undecided(&second), expected);

    let (_, third) = diagnosed(folder, "long.csv", "second/rig.diagnosed.toml", "third");
    assert_eq!(undecided(&third), []);
    assert!((radius_m(&third) / 0.01455 - 1.0).abs() < 1e-3);
}
