//! A torque of several harmonics, shown late: found together, from motions and a closed form that no simulator has made.

use std::f64::consts::TAU;

use bowden_core::diagnose::diagnose;
use bowden_core::diagnose::verdict::Diagnosis;
use bowden_core::progress::Quiet;
use bowden_core::recording::Recording;
use bowden_core::rig::{Rig, RigDocument};
use bowden_core::study::Study;
use bowden_model::channel::Channel;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64Mcg;

/// A spindle that is turned from outside; the thread behind it carries nothing.
const RIG: &str = r#"
schema = "bowden-rig/1"
name = "spindle"
[pulleys]
input_radius_m = 0.01
output_radius_m = 0.01
[tendon]
length_m = 1.0
axial_stiffness_n = 1000.0
pretension_n = 1.0
[sensors]
encoder_bits = 13
tension_full_scale_n = 1000.0
adc_bits = 16
tension_noise_n = 1.0
[simulation]
elements = 1
effects = []
[replay]
inputs = ["theta_in_rad"]
outputs = ["torque_in_nm"]
"#;

/// Periods a turn, amplitude \[N·m\], phase \[rad\].
const HARMONICS: [(f64, f64, f64); 3] = [(7.0, 0.5, 0.4), (12.0, 0.2, -1.1), (30.0, 0.3, 2.0)];
/// Time constant with which the torque is shown \[s\].
const LAG_S: f64 = 0.08;
const NOISE_NM: f64 = 0.01;
const STEP_S: f64 = 0.002;

/// To and fro over two turns and a half at changing speed. What the spindle asks for is the opposite of the ripple that helps it round.
fn recorded(seconds: f64, phase_rad: f64, late: bool, seed: u128) -> Recording {
    let mut random = Pcg64Mcg::new(seed);
    let noise = Normal::new(0.0, NOISE_NM).unwrap();
    let count = 8192.0 / TAU;
    let (mut angles, mut torques, mut times) = (Vec::new(), Vec::new(), Vec::new());
    let mut shown_nm = None;
    for tick in 0..(seconds / STEP_S) as usize {
        let t_s = tick as f64 * STEP_S;
        let angle_rad = 7.5 * (TAU * 0.05 * t_s + phase_rad).sin() + 0.3 * (TAU * 0.31 * t_s).sin();
        let ripple = |(cycles, amplitude_nm, phase): (f64, f64, f64)| {
            amplitude_nm * (cycles * angle_rad + phase).sin()
        };
        let torque_nm = -HARMONICS.into_iter().map(ripple).sum::<f64>();
        let before_nm = shown_nm.unwrap_or(torque_nm);
        let now_nm = if late {
            before_nm + (torque_nm - before_nm) * (-(-STEP_S / LAG_S).exp_m1())
        } else {
            torque_nm
        };
        shown_nm = Some(now_nm);
        times.push(t_s);
        angles.push((angle_rad * count).round() / count);
        torques.push(now_nm + noise.sample(&mut random));
    }
    Recording::new("spindle", times).with(Channel::ThetaIn, angles).with(Channel::TorqueIn, torques)
}

fn diagnosed(late: bool) -> (Diagnosis, String) {
    let rig = Rig::parse(RIG, "rig.toml").unwrap();
    let (training, heldout) = (recorded(30.0, 0.0, late, 1), recorded(15.0, 1.0, late, 2));
    let study = Study::of_bench(rig, vec![training], vec![heldout]);
    let found = diagnose(&study, &[], &Quiet).unwrap();
    let mut document = RigDocument::parse(RIG, "rig.toml").unwrap();
    found.write_into(0, &mut document).unwrap();
    (found.findings.diagnosis, document.to_string())
}

#[test]
fn every_harmonic_is_found_and_so_is_the_lag_behind_which_they_hide() {
    for late in [false, true] {
        let (diagnosis, written) = diagnosed(late);
        println!("{}\n{written}", diagnosis.summary);
        let mut names: Vec<&str> = diagnosis.effects.iter().map(|effect| effect.id.as_str()).collect();
        names.sort_unstable();
        let expected: &[&str] = if late { &["motor_cogging", "sensor_lag"] } else { &["motor_cogging"] };
        assert_eq!(names, expected, "{}", diagnosis.summary);
        let cogging = diagnosis.effects.iter().find(|effect| effect.id == "motor_cogging").unwrap();
        let found: Vec<_> = std::iter::once(&cogging.parameters).chain(&cogging.further).collect();
        for (cycles, amplitude_nm, phase_rad) in HARMONICS {
            let near = |one: &&&_| -> bool {
                let one: &std::collections::BTreeMap<String, bowden_core::diagnose::verdict::Estimate> = one;
                (one["cycles_per_turn"].value / cycles - 1.0).abs() < 0.01
            };
            let one = found.iter().find(near).unwrap_or_else(|| panic!("{cycles} in {found:?}"));
            assert!((one["amplitude_nm"].value / amplitude_nm - 1.0).abs() < 0.05, "{one:?}");
            let off = (one["phase_rad"].value - phase_rad + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU;
            assert!(off.abs() < 0.05, "{one:?}");
        }
        let strengths: Vec<f64> = found.iter().map(|one| one["amplitude_nm"].value).collect();
        assert!(strengths.is_sorted_by(|a, b| a >= b), "strongest first: {strengths:?}");
        assert_eq!(strengths.len(), HARMONICS.len(), "{strengths:?}");
        if late {
            let lag = diagnosis.effects.iter().find(|effect| effect.id == "sensor_lag").unwrap();
            assert!((lag.parameters["time_constant_s"].value / LAG_S - 1.0).abs() < 0.05, "{lag:?}");
        }
        let fit = &diagnosis.fit.channels["torque_in_nm"];
        assert!(fit.after_rmse < 1.1 * NOISE_NM, "{fit:?}");
        let read = Rig::parse(&written, "rig.diagnosed.toml").unwrap();
        assert_eq!(read.effects.len(), found.len() + usize::from(late), "{written}");
    }
}
