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
/// Friction of the spindle \[N·m\].
const FRICTION_NM: f64 = 1.0;
const NOISE_NM: f64 = 0.01;
const STEP_S: f64 = 0.002;

/// Torque that the spindle asks for at an angle: the opposite of the ripple that helps it round.
fn asked_nm(angle_rad: f64) -> f64 {
    let ripple =
        |(cycles, amplitude_nm, phase): (f64, f64, f64)| amplitude_nm * (cycles * angle_rad + phase).sin();
    -HARMONICS.into_iter().map(ripple).sum::<f64>()
}

/// What encoder and torque sensor show of angles and torques, [`STEP_S`] apart.
fn shown(motion: impl Iterator<Item = (f64, f64)>, seed: u128) -> Recording {
    let mut random = Pcg64Mcg::new(seed);
    let noise = Normal::new(0.0, NOISE_NM).unwrap();
    let count = 8192.0 / TAU;
    let (angles, torques): (Vec<f64>, Vec<f64>) = motion
        .map(|(angle_rad, torque_nm)| {
            ((angle_rad * count).round() / count, torque_nm + noise.sample(&mut random))
        })
        .unzip();
    let times = (0..angles.len()).map(|tick| tick as f64 * STEP_S).collect();
    Recording::new("spindle", times).with(Channel::ThetaIn, angles).with(Channel::TorqueIn, torques)
}

fn times_s(seconds: f64) -> impl Iterator<Item = f64> {
    (0..(seconds / STEP_S) as usize).map(|tick| tick as f64 * STEP_S)
}

/// To and fro over two turns and a half at changing speed.
fn recorded(seconds: f64, phase_rad: f64, late: bool, seed: u128) -> Recording {
    let mut before_nm = None;
    let motion = times_s(seconds).map(|t_s| {
        let angle_rad = 7.5 * (TAU * 0.05 * t_s + phase_rad).sin() + 0.3 * (TAU * 0.31 * t_s).sin();
        let torque_nm = asked_nm(angle_rad);
        let last_nm = before_nm.unwrap_or(torque_nm);
        let now_nm =
            if late { last_nm - (torque_nm - last_nm) * (-STEP_S / LAG_S).exp_m1() } else { torque_nm };
        before_nm = Some(now_nm);
        (angle_rad, now_nm)
    });
    shown(motion, seed)
}

/// Round and round one way at a speed that changes by this part, against a friction of one newton metre in the mean that goes with
/// this power of the speed.
fn recorded_one_way(changing: f64, power: i32, [seconds, phase_rad]: [f64; 2], seed: u128) -> Recording {
    let motion = times_s(seconds).map(|t_s| {
        let (swing, rate) = (0.7 * t_s + phase_rad, 1.5);
        let angle_rad = rate * (t_s + changing / 0.7 * swing.sin());
        let friction_nm = FRICTION_NM * (1.0 + changing * swing.cos()).powi(power);
        (angle_rad, friction_nm + asked_nm(angle_rad))
    });
    shown(motion, seed)
}

fn diagnosed(training: Recording, heldout: Recording) -> (Diagnosis, String) {
    let rig = Rig::parse(RIG, "rig.toml").unwrap();
    let study = Study::of_bench(rig, vec![training], vec![heldout]);
    let found = diagnose(&study, &[], &Quiet).unwrap();
    let mut document = RigDocument::parse(RIG, "rig.toml").unwrap();
    found.write_into(0, &mut document).unwrap();
    (found.findings.diagnosis, document.to_string())
}

#[test]
fn every_harmonic_is_found_and_so_is_the_lag_behind_which_they_hide() {
    for late in [false, true] {
        let (diagnosis, written) = diagnosed(recorded(30.0, 0.0, late, 1), recorded(15.0, 1.0, late, 2));
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

/// A spindle that turns one way shows dry friction as a wrong zero would show. The larger friction is named first, and what cannot part
/// the two is no surer once the harmonics are known.
#[test]
fn what_one_direction_cannot_part_stays_a_rival_beside_the_harmonics() {
    let recorded = |long, seed| recorded_one_way(0.4, 0, long, seed);
    let (diagnosis, written) = diagnosed(recorded([30.0, 0.0], 3), recorded([15.0, 1.0], 4));
    println!("{}\n{written}", diagnosis.summary);
    let alike = ["sensor_offset", "motor_coulomb_friction", "joint_coulomb_friction"];
    let mut of_friction = diagnosis.effects.iter().filter(|effect| alike.contains(&effect.id.as_str()));
    let named = of_friction.next().unwrap();
    assert!(of_friction.next().is_none() && diagnosis.effects.len() == 2, "{}", diagnosis.summary);
    println!("{} {:?} {:?}", named.id, named.probability, named.rivals);
    let friction = &diagnosis.search[0].tried[0].id;
    assert!(alike.contains(&friction.as_str()), "first {friction}");
    let others = named.rivals.iter().filter(|rival| alike.contains(&rival.id.as_str()));
    assert!(named.probability < 0.8 && others.count() >= 1, "{named:?}");
    let level_nm = match named.parameters.get("offset") {
        Some(offset) => offset.value,
        None => named.parameters["torque_nm"].value,
    };
    assert!((level_nm / FRICTION_NM - 1.0).abs() < 0.02, "{named:?}");
}

/// At a speed that changes by a quarter of a per cent a friction by speed and a wrong zero look alike until the harmonics are known.
/// Beside them the zero predicts better, and takes the place of what the first round named.
#[test]
fn a_name_gives_way_to_a_rival_that_predicts_better_beside_the_harmonics() {
    let recorded = |long, seed| recorded_one_way(0.0025, 0, long, seed);
    let (diagnosis, _) = diagnosed(recorded([30.0, 0.0], 5), recorded([15.0, 1.0], 6));
    println!("{}", diagnosis.summary);
    let first = &diagnosis.search[0].tried[0].id;
    assert_eq!(first, "motor_viscous_friction", "nothing to give way");
    let mut named: Vec<&str> = diagnosis.effects.iter().map(|effect| effect.id.as_str()).collect();
    named.sort_unstable();
    assert_eq!(named, ["motor_cogging", "sensor_offset"]);
}
