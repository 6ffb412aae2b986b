//! A fit on recordings of the model itself, whose parameters are known: what comes back, and what cannot.

use std::fmt::Write;
use std::fs;

use crate::common::bowden;
use bowden_core::fit::identifiability::indistinguishable;
use bowden_core::fit::objective::Objective;
use bowden_core::fit::recalibrate::recalibrate;
use bowden_core::joint_model::JointModel;
use bowden_core::progress::Quiet;
use bowden_core::recording::Recording;
use bowden_core::rig::Rig;
use bowden_core::simulate::{Motion, Reference, RunOptions, run};
use bowden_core::study::Study;
use bowden_model::channel::Channel::{BusVoltage, Duty, ThetaIn};
use bowden_model::parameters::nominal;

const RIG: &str = r#"schema = "bowden-rig/1"
name = "bench"
[motor]
supply_v = 24.0
resistance_ohm = 2.0
inductance_h = 0.0008
torque_constant_nm_per_a = 0.03
gear_ratio = 30.0
rotor_inertia_kg_m2 = 5.0e-6
viscous_nm_s_per_rad = 0.02
[pulleys]
input_radius_m = 0.015
output_radius_m = 0.015
[tendon]
length_m = 1.0
axial_stiffness_n = 72900.0
pretension_n = 30.0
[sheath]
wrap_angle_rad = 3.14159265
friction_coefficient = 0.12
[load]
mass_kg = 2.5
arm_m = 0.03
inertia_kg_m2 = 0.0
viscous_nm_s_per_rad = 0.004
[sensors]
encoder_bits = 12
tension_full_scale_n = 98.0665
adc_bits = 12
tension_noise_n = 0.1
current_noise_a = 0.01
"#;

/// The bench with other parameters than its file says.
const OFF: [(&str, &str, f64); 5] = [
    ("sheath", "friction_coefficient", 0.15),
    ("tendon", "axial_stiffness_n", 60_000.0),
    ("tendon", "pretension_n", 27.0),
    ("motor", "torque_constant_nm_per_a", 0.028),
    ("load", "mass_kg", 2.3),
];

fn rig() -> Rig {
    Rig::parse(RIG, "rig.toml").unwrap()
}

fn recorded(rig: &Rig, motion: Motion, seconds: f64) -> Recording {
    let reference = Reference::of_motion(motion, seconds, 5);
    run(rig, &reference, RunOptions { seconds, rate_hz: 1000.0, seed: 5 }).unwrap()
}

#[test]
fn a_fit_recovers_what_was_simulated() {
    let mut truth = rig();
    for (section, name, value) in OFF {
        nominal(section, name).unwrap().set(&mut truth.joint, value);
    }
    let recording = recorded(&truth, Motion::Lab, 20.0);
    let result = recalibrate(&Study::of_bench(rig(), vec![recording], Vec::new()), &Quiet).unwrap();
    for (section, name, value) in OFF {
        let found = result
            .parameters
            .iter()
            .find(|p| p.parameter.to_string() == format!("{section}.{name}"))
            .unwrap();
        let error = found.fitted / value - 1.0;
        assert!(error.abs() < 0.03, "{section}.{name}: {} for {value}", found.fitted);
        assert!(!found.at_bound && found.std.is_some_and(|std| std > 0.0), "{found:?}");
    }
    // What was right stays right.
    let resistance =
        result.parameters.iter().find(|p| p.parameter.to_string() == "motor.resistance_ohm").unwrap();
    assert!((resistance.fitted / 2.0 - 1.0).abs() < 0.03, "{resistance:?}");
    for channel in &result.channels {
        assert!(channel.after <= channel.before * 1.01, "{channel:?} became worse");
    }
}

#[test]
fn products_are_known_and_their_factors_are_not() {
    let recording = recorded(&rig(), Motion::Lab, 10.0);
    let model = JointModel::from_rig(&rig(), &recording).unwrap();
    let objective = Objective::new(&model, &[recording], &[], false).unwrap();
    let groups = indistinguishable(&objective, &model).unwrap();
    // The capstan equation holds mu K only, a tendon EA / L only; weight and inertia tell mass and arm apart from these.
    for pair in [
        ["sheath.friction_coefficient", "sheath.wrap_angle_rad"],
        ["tendon.axial_stiffness_n", "tendon.length_m"],
    ] {
        assert!(groups.iter().any(|group| group == &pair), "{pair:?} not in {groups:?}");
    }
    let alone = ["tendon.pretension_n", "motor.resistance_ohm"];
    assert!(!groups.iter().flatten().any(|name| alone.contains(&name.as_str())), "{groups:?}");
}

#[test]
fn a_joint_that_does_not_move_tells_nothing_on_friction() {
    let recording = recorded(&rig(), Motion::Rest, 5.0);
    let result = recalibrate(&Study::of_bench(rig(), vec![recording], Vec::new()), &Quiet).unwrap();
    for name in ["sheath.friction_coefficient", "motor.resistance_ohm", "load.viscous_nm_s_per_rad"] {
        assert!(result.unseen.iter().any(|unseen| unseen == name), "{name} not in {:?}", result.unseen);
    }
    let friction =
        result.parameters.iter().find(|p| p.parameter.to_string() == "sheath.friction_coefficient").unwrap();
    assert!((friction.fitted - 0.12).abs() < 1e-3, "nothing to learn from, yet {friction:?}");
}

/// Runs `bowden` in a folder: exit status, standard output, standard error.
#[test]
fn the_command_writes_a_rig_that_loads_and_says_what_is_unknown() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("rig.toml"), format!("# of the lab\n{RIG}")).unwrap();
    let simulate = ["simulate", "--rig", "rig.toml", "--out", "rec.csv", "--seconds", "5"];
    assert_eq!(bowden(at, &simulate), (0, String::new(), String::new()));
    let (status, stdout, stderr) =
        bowden(at, &["fit", "rec.csv", "--rig", "rig.toml", "--out", "fitted.toml"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    assert!(stdout.contains("  sheath.friction_coefficient * sheath.wrap_angle_rad\n"), "{stdout}");
    let fitted = fs::read_to_string(at.join("fitted.toml")).unwrap();
    let (_, json, _) = bowden(at, &["fit", "rec.csv", "--rig", "rig.toml", "--out", "again.toml", "--json"]);
    assert_eq!(fs::read_to_string(at.join("again.toml")).unwrap(), fitted);
    let facts: serde_json::Value = serde_json::from_str(&json).unwrap();
    let of_group: Vec<&str> = facts["indistinguishable"]
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|group| group.as_array().unwrap())
        .map(|member| member[0].as_str().unwrap())
        .collect();
    assert!(of_group.contains(&"sheath.wrap_angle_rad"), "{json}");
    // What is printed as a table is what stands in the object.
    let rows = stdout.lines().skip(1).take_while(|line| !line.is_empty()).count();
    assert_eq!(facts["parameters"].as_array().unwrap().len(), rows, "{json}");
    for (fact, row) in facts["parameters"].as_array().unwrap().iter().zip(stdout.lines().skip(1)) {
        let words: Vec<&str> = row.split_whitespace().collect();
        let number = |name: &str| fact[name].as_f64().unwrap();
        let in_row = |word: &str| word.parse::<f64>().unwrap();
        assert_eq!(fact["parameter"].as_str(), Some(words[0]));
        assert_eq!([number("nominal"), number("fitted")], [in_row(words[1]), in_row(words[2])], "{row}");
    }
    assert!(fitted.starts_with("# of the lab\n"), "{fitted}");
    let fitted = Rig::load(&at.join("fitted.toml")).unwrap();
    assert_ne!(fitted.joint.sheath, rig().joint.sheath);
    let [found, stated] = [fitted.joint, rig().joint].map(|joint| joint.pulleys.unwrap());
    // Of the ratio one radius is moved, and this bench has the stated one.
    assert_eq!(found.input_radius_m, stated.input_radius_m);
    assert!((found.output_radius_m / stated.output_radius_m - 1.0).abs() < 0.005, "{found:?}");
}

#[test]
fn a_replay_reads_nothing_but_time_and_inputs() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("rig.toml"), RIG).unwrap();
    let recording = recorded(&rig(), Motion::Sine, 2.0);
    recording.save(&at.join("rec.csv")).unwrap();
    // The same inputs beside tensions that cannot be read at all.
    let mut inputs = String::from("f1_n,t_s,theta_in_rad,duty,bus_v\n");
    let column = |channel| recording.channel(channel).unwrap();
    for k in 0..recording.len() {
        let (t, theta, duty, bus) =
            (recording.t_s()[k], column(ThetaIn)[k], column(Duty)[k], column(BusVoltage)[k]);
        writeln!(inputs, "broken,{t:?},{theta:?},{duty:?},{bus:?}").unwrap();
    }
    fs::write(at.join("inputs.csv"), inputs).unwrap();
    for (file, out) in [("rec.csv", "a.csv"), ("inputs.csv", "b.csv")] {
        let run = bowden(at, &["replay", file, "--rig", "rig.toml", "--out", out]);
        assert_eq!(run, (0, String::new(), String::new()));
    }
    let (a, b) =
        (fs::read_to_string(at.join("a.csv")).unwrap(), fs::read_to_string(at.join("b.csv")).unwrap());
    assert_eq!(a, b);
    let header = "t_s,theta_motor_rad,theta_out_rad,f1_n,f2_n,f3_n,f4_n,torque_in_nm,torque_out_nm,i_motor_a";
    assert_eq!(a.lines().next(), Some(header));
    assert_eq!(a.lines().count(), 1 + recording.len());
}

/// A tenth of a second is lost at 1 s. Behind it 0.3 s have to pass, and the joint has to move.
#[test]
fn what_follows_a_gap_is_told_by_those_that_do_not_compare_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("rig.toml"), RIG).unwrap();
    let simulate = ["simulate", "--rig", "rig.toml", "--out", "whole.csv", "--seconds", "4"];
    assert_eq!(bowden(at, &simulate), (0, String::new(), String::new()));
    let whole = fs::read_to_string(at.join("whole.csv")).unwrap();
    let header = whole.lines().position(|line| line.starts_with("t_s")).unwrap();
    let kept = whole.lines().enumerate().filter(|(line, _)| !(header + 1000..header + 1100).contains(line));
    let lost: String = kept.flat_map(|(_, line)| [line, "\n"]).collect();
    fs::write(at.join("lost.csv"), lost).unwrap();
    let of_fit = ["fit", "lost.csv", "--rig", "rig.toml", "--out", "fitted.toml"];
    let of_diagnosis = ["diagnose", "lost.csv", "--rig", "rig.toml", "--out", "found"];
    for command in [of_fit, of_diagnosis] {
        let (status, _, stderr) = bowden(at, &command);
        let lines: Vec<&str> = stderr.lines().collect();
        assert_eq!((status, lines.len()), (3, 2), "{stderr}");
        assert!(lines[0].contains("a gap in t_s"), "{stderr}");
        assert!(
            lines[1].starts_with("bowden: lost.csv: ") && lines[1].contains(" follow gaps and are not"),
            "{stderr}"
        );
    }
}
