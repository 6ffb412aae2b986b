//! Which channels drive a replay and which it predicts, and the checks that each command makes before its work.

use std::fs;
use std::path::Path;

use bowden::commands::{
    diagnose::DiagnoseArguments, fit::FitArguments, replay::ReplayArguments, simulate::SimulateArguments,
};
use bowden_core::outcome::FailureClass;
use bowden_core::recording::Recording;
use bowden_core::rig::Rig;
use bowden_model::channel::Channel;
use clap::Parser;

const MOTOR: &str = "[motor]\nsupply_v = 24\nresistance_ohm = 2\ninductance_h = 8e-4\ntorque_constant_nm_per_a = 0.03\n\
                     gear_ratio = 30\nrotor_inertia_kg_m2 = 5e-6\nviscous_nm_s_per_rad = 0.02\n";
const TENDON: &str = "[pulleys]\ninput_radius_m = 0.015\noutput_radius_m = 0.015\n[tendon]\nlength_m = 1\n\
                      axial_stiffness_n = 72900\npretension_n = 30\n";

fn rig_text(parts: &[&str]) -> String {
    format!("schema = \"bowden-rig/1\"\n{}", parts.concat())
}

fn recording(channels: &[Channel]) -> Recording {
    let t_s: Vec<f64> = (0..60).map(|sample| f64::from(sample) * 1e-3).collect();
    let values = vec![0.5; t_s.len()];
    channels
        .iter()
        .fold(Recording::new("rec.csv", t_s), |recording, channel| recording.with(*channel, values.clone()))
}

/// Rig, recorded channels, inputs, outputs.
type RolesCase<'c> = (&'c str, &'c [Channel], &'c [Channel], &'c [Channel]);

#[test]
fn what_is_recorded_decides_what_drives_and_the_rest_is_predicted() {
    use Channel::{
        BusVoltage, DriveEnable, Duty, F1, F2, F3, F4, MotorCurrent, ThetaIn, ThetaMotor, ThetaOut, ThetaRef,
        TorqueIn, TorqueOut,
    };
    let both = rig_text(&[MOTOR, TENDON]);
    let motor = rig_text(&[MOTOR]);
    let tendon = rig_text(&[TENDON]);
    let named = rig_text(&[
        TENDON,
        "[replay]\ninputs = [\"theta_in_rad\", \"theta_out_rad\"]\noutputs = [\"f1_n\"]\n",
    ]);
    let cases: &[RolesCase] = &[
        (
            &both,
            &[ThetaRef, ThetaIn, ThetaOut, F1, Duty, BusVoltage],
            &[ThetaIn, Duty, BusVoltage],
            &[ThetaMotor, ThetaOut, F1, F2, F3, F4, TorqueIn, TorqueOut, MotorCurrent],
        ),
        (
            &both,
            &[Duty, DriveEnable],
            &[Duty, DriveEnable],
            &[ThetaMotor, ThetaIn, ThetaOut, F1, F2, F3, F4, TorqueIn, TorqueOut, MotorCurrent],
        ),
        // Without the duty nothing tells the current.
        (&both, &[ThetaIn], &[ThetaIn], &[ThetaMotor, ThetaOut, F1, F2, F3, F4, TorqueIn, TorqueOut]),
        (&motor, &[Duty, ThetaOut], &[Duty], &[ThetaMotor, ThetaIn, ThetaOut, MotorCurrent]),
        (&tendon, &[ThetaIn, Duty], &[ThetaIn], &[ThetaOut, F1, F2, F3, F4, TorqueIn, TorqueOut]),
        (&named, &[ThetaIn, ThetaOut, F1, F2], &[ThetaIn, ThetaOut], &[F1]),
    ];
    for (text, recorded, inputs, outputs) in cases {
        let rig = Rig::parse(text, "rig.toml").unwrap();
        let roles = rig.roles(&recording(recorded)).unwrap();
        assert_eq!((roles.inputs.as_slice(), roles.outputs.as_slice()), (*inputs, *outputs), "{recorded:?}");
    }
    let refused: &[(&str, &[Channel], &str)] = &[
        (
            &both,
            &[BusVoltage, F1],
            "rec.csv: no column that could drive a replay, expected theta_in_rad or duty; ",
        ),
        (&tendon, &[Duty], "rec.csv: no column that could drive a replay, expected theta_in_rad; "),
        (&named, &[ThetaIn], "rec.csv: no column `theta_out_rad`, which the rig's replay.inputs names; "),
    ];
    for (text, recorded, expected) in refused {
        let failure = Rig::parse(text, "rig.toml").unwrap().roles(&recording(recorded)).unwrap_err();
        assert!(failure.message().starts_with(expected), "{failure}");
    }
}

#[derive(Parser)]
enum Line {
    Diagnose(DiagnoseArguments),
    Fit(FitArguments),
    Replay(ReplayArguments),
    Simulate(SimulateArguments),
}

/// Prepares a command line whose `@` stands for the folder; the message if it is refused as bad input.
fn prepare(folder: &Path, line: &str) -> Result<(), String> {
    let folder = folder.to_str().unwrap();
    let words =
        std::iter::once("bowden".to_owned()).chain(line.split(' ').map(|word| word.replace('@', folder)));
    let result = match Line::try_parse_from(words).unwrap() {
        Line::Diagnose(arguments) => arguments.prepare().map(|_| ()),
        Line::Fit(arguments) => arguments.prepare().map(|_| ()),
        Line::Replay(arguments) => arguments.prepare().map(|_| ()),
        Line::Simulate(arguments) => arguments.prepare().map(|_| ()),
    };
    result.map_err(|failure| {
        assert_eq!(failure.class(), FailureClass::BadInput);
        failure.message().replace(folder, "@")
    })
}

#[test]
fn commands_check_their_files_before_their_work() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("rig.toml"), rig_text(&[MOTOR, TENDON])).unwrap();
    fs::write(at.join("hand.toml"), rig_text(&[TENDON])).unwrap();
    recording(&[Channel::ThetaRef, Channel::ThetaIn, Channel::Duty, Channel::F1])
        .save(&at.join("rec.csv"))
        .unwrap();
    recording(&[Channel::ThetaIn, Channel::F1]).save(&at.join("other.csv")).unwrap();
    // On a joint that turns with its motor this compares an angle with itself; beside a current or through tendons it does not.
    let same_angle = "[recording.columns]\ntheta_out_rad = { column = \"theta_in_rad\" }\n";
    fs::write(at.join("direct.toml"), rig_text(&[MOTOR, same_angle])).unwrap();
    fs::write(at.join("driven.toml"), rig_text(&[MOTOR, same_angle, "[replay]\ninputs = [\"duty\"]\n"]))
        .unwrap();
    fs::write(at.join("both.toml"), rig_text(&[MOTOR, TENDON, same_angle])).unwrap();
    recording(&[Channel::ThetaIn, Channel::Duty, Channel::MotorCurrent])
        .save(&at.join("current.csv"))
        .unwrap();
    // Only the inputs of this one can be read.
    fs::write(at.join("inputs.csv"), "t_s,theta_in_rad,f1_n\n0,0,NaN\n0.001,0,\n").unwrap();

    for line in [
        "replay @/rec.csv --rig @/rig.toml --out @/p.csv",
        "replay @/inputs.csv --rig @/rig.toml --out @/p.csv.gz",
        "fit @/rec.csv @/other.csv --rig @/rig.toml --out @/fitted.toml",
        "diagnose @/rec.csv --rig @/rig.toml --out @/new/folder --heldout @/other.csv",
        "fit @/current.csv --rig @/direct.toml --out @/fitted.toml",
        "fit @/rec.csv --rig @/driven.toml --out @/fitted.toml",
        "fit @/rec.csv --rig @/both.toml --out @/fitted.toml",
        "simulate --rig @/rig.toml --out @/sim.csv --motion sine --seconds 1 --rate-hz 500 --seed 7",
        "simulate --rig @/rig.toml --out @/sim.mcap --reference @/rec.csv",
    ] {
        prepare(at, line).unwrap_or_else(|message| panic!("{line}: {message}"));
    }
    assert!(at.join("new/folder").is_dir());

    for (line, expected) in [
        (
            "replay @/rec.csv --rig @/rig.toml --out @/rec.csv",
            "@/rec.csv: would overwrite the input @/rec.csv; name another output",
        ),
        (
            "replay @/rec.csv --rig @/rig.toml --out @/no/p.csv",
            "@/no/p.csv: folder @/no does not exist; create it first",
        ),
        (
            "replay @/rec.csv --rig @/rig.toml --out @/p.txt",
            "@/p.txt: unknown format; end the name in .csv, .csv.gz, .mcap or .parquet",
        ),
        (
            "fit @/rec.csv --rig @/rig.toml --out @/rig.toml",
            "@/rig.toml: would overwrite the input @/rig.toml; name another output",
        ),
        (
            "fit @/rec.csv --rig @/direct.toml --out @/f.toml",
            "@/rec.csv: column `theta_in_rad` drives the replay as theta_in_rad and is all that it is compared with, as theta_out_rad: \
             without [tendon] that is the column itself; take theta_in_rad out of replay.inputs, or record i_motor_a as well",
        ),
        (
            "fit @/inputs.csv --rig @/rig.toml --out @/f.toml",
            "@/inputs.csv:2: column `f1_n`: got `NaN`, expected a finite number; correct the cell or drop the row",
        ),
        (
            "diagnose @/rec.csv --rig @/rig.toml --out @/rec.csv",
            "@/rec.csv: @/rec.csv is a file, expected a folder; name another folder",
        ),
        (
            "diagnose @/rec.csv --rig @/rig.toml --out @/rec.csv/sub",
            "@/rec.csv/sub: @/rec.csv is a file, expected a folder; name another folder",
        ),
        (
            "diagnose @/rec.csv --rig @/rig.toml --out @/d --heldout @/rec.csv",
            "@/rec.csv: given as training and as held out; a judge must be another recording",
        ),
        (
            "simulate --rig @/hand.toml --out @/s.csv --motion sine",
            "@/hand.toml:1:1: no [motor], which a forward run needs; add it or use replay",
        ),
        (
            "simulate --rig @/rig.toml --out @/s.csv --reference @/other.csv",
            "@/other.csv:1: no column `theta_ref_rad`; name the reference so",
        ),
    ] {
        assert_eq!(prepare(at, line), Err(expected.to_owned()), "{line}");
    }
    assert!(!at.join("d").exists(), "a refused diagnosis leaves no folder behind");
}

#[test]
fn a_diagnosis_does_not_overwrite_the_rig_it_was_given() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let name = "rig.diagnosed.toml";
    fs::write(at.join(name), rig_text(&[MOTOR, TENDON])).unwrap();
    recording(&[Channel::ThetaIn, Channel::F1]).save(&at.join("rec.csv")).unwrap();
    let line = format!("diagnose @/rec.csv --rig @/{name} --out @");
    let expected = format!("@/{name}: would overwrite the input @/{name}; name another output");
    assert_eq!(prepare(at, &line), Err(expected));
}
