//! The commands with `--port sim`: the board's own control with a simulated joint, only the wire in between.

use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs;
use std::ops::ControlFlow;
use std::time::Duration;

use bowden_core::recording::{Column, ReadOptions, Recording};
use bowden_host_link::course::{Course, Track};
use bowden_host_link::sim::SimTransport;
use bowden_host_link::{Client, RunEnd, Session};
use bowden_link::State;
use bowden_link::message::{Goal, Mode};
use bowden_model::channel::Channel;

use crate::bowden;
use crate::wires::{Lossy, TIMEOUT};

fn raw(recording: &Recording, name: &str) -> Vec<f64> {
    let Some(Column::Unknown(text)) = recording.columns().iter().find(|column| column.name() == name) else {
        panic!("no column {name}");
    };
    (0..recording.len()).map(|row| text.cell(row).unwrap().parse().unwrap()).collect()
}

#[test]
fn a_recording_of_the_simulated_joint_follows_its_reference() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = [
        "record",
        "--port",
        "sim",
        "--out",
        "a.csv",
        "--seconds",
        "1.5",
        "--home",
        "--reference",
        "sine",
        "--amplitude",
        "0.3",
        "--frequency",
        "1",
        "--rig",
        "rig.toml",
        "--load",
        "2.5,0.03",
    ];
    let (status, stdout, stderr) = bowden(folder.path(), &arguments);
    assert_eq!((status, stderr.as_str()), (0, ""));
    assert_eq!(stdout, "a.csv: 15000 rows over 1.500 s, tick 100.0 us\n");
    let (status, stdout, stderr) = bowden(folder.path(), &["check", "a.csv", "--rig", "rig.toml"]);
    assert_eq!((status, stderr.as_str()), (0, ""), "{stdout}");

    let recording = Recording::load(&folder.path().join("a.csv"), &ReadOptions::default()).unwrap();
    let channel = |channel| recording.channel(channel).unwrap();
    let (reference, joint) = (channel(Channel::ThetaRef), channel(Channel::ThetaOut));
    // After the run-in the joint is where it should be, within a tenth of the amplitude.
    let late = 7500..15_000;
    let worst = late.clone().map(|row| (reference[row] - joint[row]).abs()).fold(0.0, f64::max);
    assert!(worst < 0.03, "{worst} rad from the reference");
    let reach = late.map(|row| joint[row].abs()).fold(0.0, f64::max);
    assert!(reach > 0.25, "the joint reaches {reach} rad");
    // By hand from the front end: zero 1000, 0.5 V and 23 mV/N behind 3.3 V in 4095 steps, 120 mV/A around 1.65 V.
    let (counts, codes, currents) =
        (raw(&recording, "encoder_in_count_raw"), raw(&recording, "f3_raw"), raw(&recording, "current_raw"));
    for row in 0..recording.len() {
        let angle = (counts[row] - 1000.0) * TAU / 4096.0;
        assert!((channel(Channel::ThetaIn)[row] - angle).abs() < 1e-8, "row {row}");
        let tension = (codes[row] * 3.3 / 4095.0 - 0.5) / 0.023;
        // The parameters have four digits of zero and five of gain: 0.0455 codes and 1.2e-5 of up to 60 N.
        assert!((channel(Channel::F3)[row] - tension).abs() < 2.4e-3, "row {row}: {tension} N");
        let current = (currents[row] * 3.3 / 4095.0 - 1.65) / 0.12;
        assert!((channel(Channel::MotorCurrent)[row] - current).abs() < 1e-3, "row {row}: {current} A");
    }
    // The tendons carry their pretension and the load, and none is slack.
    let mean = channel(Channel::F1).iter().sum::<f64>() / recording.len() as f64;
    assert!((25.0..40.0).contains(&mean), "{mean} N in the mean");
}

#[test]
fn equal_runs_are_equal_and_thinned_rows_are_the_same_rows() {
    let folder = tempfile::tempdir().unwrap();
    for (out, every) in [("a.csv", "1"), ("b.csv", "1"), ("c.csv", "7"), ("d.mcap", "7")] {
        let arguments = [
            "record",
            "--port",
            "sim",
            "--out",
            out,
            "--seconds",
            "0.2",
            "--every",
            every,
            "--offset",
            "0.1",
        ];
        let (status, _, stderr) = bowden(folder.path(), &arguments);
        assert_eq!((status, stderr.as_str()), (0, ""), "{out}");
    }
    let text = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    assert_eq!(text("a.csv"), text("b.csv"));
    let (whole, thinned) = (text("a.csv"), text("c.csv"));
    let expected: Vec<&str> = whole.lines().take(1).chain(whole.lines().skip(1).step_by(7)).collect();
    assert_eq!(thinned.lines().collect::<Vec<_>>(), expected);
    let load = |name: &str| Recording::load(&folder.path().join(name), &ReadOptions::default()).unwrap();
    assert_eq!(load("c.csv"), load("d.mcap"));
}

#[test]
fn a_file_is_followed_to_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = "t_s,theta_ref_rad\n".to_owned();
    for sample in 0..=160 {
        let t_s = f64::from(sample) * 0.01;
        writeln!(text, "{t_s},{}", 0.1 * (1.0 - (TAU * t_s / 1.6).cos())).unwrap();
    }
    fs::write(folder.path().join("ref.csv"), text).unwrap();
    let arguments = ["record", "--port", "sim", "--out", "a.csv", "--reference", "ref.csv"];
    let (status, stdout, stderr) = bowden(folder.path(), &arguments);
    assert_eq!((status, stderr.as_str()), (0, ""));
    assert!(stdout.starts_with("a.csv: 16000 rows over 1.600 s"), "{stdout}");
    let recording = Recording::load(&folder.path().join("a.csv"), &ReadOptions::default()).unwrap();
    let reference = recording.channel(Channel::ThetaRef).unwrap();
    // The file's peak is 0.2 rad at half time, after the half second in which the board blends a reference in; the
    // stream runs 1000 points a second, begun some ticks into the run.
    let peak = reference.iter().copied().fold(0.0, f64::max);
    assert!((peak - 0.2).abs() < 2e-3, "{peak} rad");
    let at = reference.iter().position(|value| *value == peak).unwrap();
    assert!((7900..8300).contains(&at), "row {at}");
}

#[test]
fn a_torque_run_records_the_torque_that_was_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = [
        "record",
        "--port",
        "sim",
        "--out",
        "a.csv",
        "--seconds",
        "0.5",
        "--mode",
        "torque",
        "--offset",
        "0.1",
    ];
    let (status, _, stderr) = bowden(folder.path(), &arguments);
    assert_eq!((status, stderr.as_str()), (0, ""));
    let recording = Recording::load(&folder.path().join("a.csv"), &ReadOptions::default()).unwrap();
    let reference = raw(&recording, "torque_ref_nm");
    assert!((reference.last().unwrap() - 0.1).abs() < 1e-5, "{:?}", reference.last());
    assert_eq!(recording.channel(Channel::ThetaRef), None);
}

/// Columns and motion of position mode: 0.2 rad of the free joint, within what its spring of 2 N·m/rad leaves of 0.03 N·m.
#[test]
fn the_modes_that_yield_record_the_angle_that_was_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    for (mode, off_rad) in [("hybrid", 0.005), ("impedance", 0.015)] {
        let arguments = ["record", "--port", "sim", "--home", "--out", "a.csv", "--seconds", "1.5"];
        let arguments = [&arguments[..], &["--every", "10", "--mode", mode, "--offset", "0.2"]].concat();
        let (status, _, stderr) = bowden(folder.path(), &arguments);
        assert_eq!((status, stderr.as_str()), (0, ""));
        let recording = Recording::load(&folder.path().join("a.csv"), &ReadOptions::default()).unwrap();
        let last = |channel| *recording.channel(channel).unwrap().last().unwrap();
        assert!((last(Channel::ThetaRef) - 0.2).abs() < 1e-5, "{mode}: {}", last(Channel::ThetaRef));
        assert!((last(Channel::ThetaOut) - 0.2).abs() < off_rad, "{mode}: {}", last(Channel::ThetaOut));
        fs::remove_file(folder.path().join("a.csv")).unwrap();
    }
}

#[test]
fn the_boards_own_services_take_repeated_points_once() {
    let wire = Lossy::new(SimTransport::new(), 2);
    let mut client = Client::connect(Box::new(wire), "sim", TIMEOUT).unwrap();
    client.enter(Goal::Ready).unwrap();
    while client.status().unwrap().state != State::Ready {
        client.listen(Duration::from_millis(20)).unwrap();
    }
    // Points wait for a run that follows them; here it holds where it is.
    client.enter(Goal::Run(Mode::Position)).unwrap();
    let all = client.stream(&[]).unwrap();
    let mut free = all;
    for _ in 0..5 {
        free = client.stream(&[0.25; 20]).unwrap();
    }
    assert_eq!(free, all - 100);
    let losses = client.losses();
    assert!(losses.frames >= 5, "{losses:?}");
}

#[test]
fn a_simulated_board_has_parameters_and_states_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let (status, stdout, _) =
        bowden(folder.path(), &["params", "--port", "sim", "get", "supervisor.host_timeout"]);
    assert_eq!(status, 0);
    assert!(stdout.starts_with("supervisor.host_timeout  0.5 s "), "{stdout}");
    let (status, stdout, _) = bowden(folder.path(), &["send", "--port", "sim", "ready"]);
    assert_eq!((status, stdout.as_str()), (0, "state: ready\n"));
    let (status, stdout, _) = bowden(folder.path(), &["faults", "--port", "sim"]);
    assert_eq!(status, 0);
    assert!(stdout.starts_with("state: off\nno fault\n"), "{stdout}");
}

#[test]
fn a_fault_of_the_control_itself_ends_the_recording_in_its_tick() {
    let folder = tempfile::tempdir().unwrap();
    // At rest the ends carry 30 N, in motion one of them soon less than 20 N; a board that knows of no friction and of a
    // higher pretension does not expect that.
    let parameters = "schema = \"bowden-parameters/1\"\n[tension]\nslack = 20.0\nexponent_margin = 0.6\n\
                      [tendon]\npretension = 35.0\n[sheath]\nfriction_coefficient = 0.0\n";
    fs::write(folder.path().join("p.toml"), parameters).unwrap();
    let arguments = ["--out", "a.csv", "--seconds", "2", "--reference", "sine", "--parameters", "p.toml"];
    let (status, stdout, stderr) =
        bowden(folder.path(), &[&["record", "--port", "sim"], arguments.as_slice()].concat());
    assert_eq!((status, stdout.as_str()), (1, ""), "{stderr}");
    let recording = Recording::load(&folder.path().join("a.csv"), &ReadOptions::default()).unwrap();
    let tick = (recording.t_s().last().unwrap() * 1e4).round();
    assert!(stderr.starts_with("bowden: fault 11, f"), "{stderr}");
    assert!(
        stderr.contains(&format!("limit 20.0000 N) at tick {tick}; restore the pretension; a.csv: ")),
        "{stderr}"
    );
    let enabled = recording.channel(Channel::DriveEnable).unwrap();
    assert_eq!(enabled[enabled.len() - 2..], [1.0, 0.0]);
    // Where the tension was below the limit, it had been for the debounce of 1 ms.
    let slack = [Channel::F1, Channel::F2, Channel::F3, Channel::F4].into_iter().any(|channel| {
        let tension = recording.channel(channel).unwrap();
        tension[tension.len() - 5..].iter().all(|tension| *tension < 20.0)
    });
    assert!(slack);
    let saved = fs::read_to_string(folder.path().join("a.parameters.toml")).unwrap();
    assert!(saved.contains("\ntension.slack = 20.0  # N"), "{saved}");
}

#[test]
fn every_form_runs_at_the_default_amplitude() {
    let folder = tempfile::tempdir().unwrap();
    for reference in ["sine", "triangle", "multisine", "staircase"] {
        let out = format!("{reference}.csv");
        let arguments =
            ["--home", "--amplitude", "0.3", "--frequency", "0.5", "--seconds", "2.5", "--every", "10"];
        let command = ["record", "--port", "sim", "--out", &out, "--reference", reference];
        let (status, _, stderr) = bowden(folder.path(), &[command.as_slice(), arguments.as_slice()].concat());
        assert_eq!((status, stderr.as_str()), (0, ""), "{reference}");
        let recording = Recording::load(&folder.path().join(&out), &ReadOptions::default()).unwrap();
        let largest = |channel| {
            recording
                .channel(channel)
                .unwrap()
                .iter()
                .fold(0.0_f64, |largest, value| largest.max(value.abs()))
        };
        // Shaped, but not much smaller.
        let (asked, reached) = (largest(Channel::ThetaRef), largest(Channel::ThetaOut));
        assert!(
            (0.28..0.301).contains(&asked) && (0.28..0.32).contains(&reached),
            "{reference}: {asked}, {reached}"
        );
        let slack = [Channel::F1, Channel::F2, Channel::F3, Channel::F4]
            .into_iter()
            .any(|channel| recording.channel(channel).unwrap().iter().any(|tension| *tension < 2.0));
        assert!(!slack, "{reference}");
    }
}

#[test]
fn what_the_joint_cannot_do_is_refused_in_one_line_before_anything_moves() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("ref.csv"), "t_s,theta_ref_rad\n0,0\n0.5,0.4\n1,1.5\n").unwrap();
    let soft = "schema = \"bowden-parameters/1\"\nlimits.contact_torque = 0.2\nimpedance.stiffness = 20.0\n";
    fs::write(folder.path().join("soft.toml"), soft).unwrap();
    for (arguments, expected) in [
        (
            vec!["sine", "--amplitude", "99"],
            "--amplitude 99: the joint can do 0.8731 rad at most at 0.5 Hz around 0 rad; lower it or the frequency",
        ),
        (vec!["multisine", "--frequency", "6"], "--amplitude 0.3: the joint can do 0.0004"),
        (
            vec!["sine", "--frequency", "200"],
            "--frequency 200: the board can do 0.001 to 100 Hz; choose one within it",
        ),
        (
            vec!["sine", "--offset", "1"],
            "--offset 1: the joint can do -0.8731 to 0.8731 rad; choose a value within it",
        ),
        (
            vec!["hold", "--offset", "-1.1"],
            "--offset -1.1: the joint can do -0.8731 to 0.8731 rad; choose a value within it",
        ),
        (
            vec!["hold", "--mode", "torque", "--offset", "0.9"],
            "--offset 0.9: the joint can do -0.5935 to 0.5935 N·m; choose",
        ),
        (
            vec!["hold", "--mode", "hybrid", "--offset", "0.5", "--parameters", "soft.toml"],
            "--offset 0.5: the joint can do -0.2611 to 0.2611 rad; choose a value within it",
        ),
        (
            vec!["hold", "--mode", "impedance", "--parameters", "soft.toml"],
            "impedance.stiffness 20: the tendons can do 16.4 N·m/rad at most; lower it with `bowden params set`",
        ),
        (
            vec!["ref.csv", "--mode", "impedance", "--parameters", "soft.toml"],
            "impedance.stiffness 20: the tendons can do 16.4 N·m/rad at most; lower it with `bowden params set`",
        ),
        (
            vec!["ref.csv"],
            "--reference ref.csv: 1.5 rad at 1 s, the joint can do -0.8731 to 0.8731 rad; scale the reference",
        ),
    ] {
        let command = [
            &["record", "--port", "sim", "--out", "a.csv", "--seconds", "1", "--reference"],
            arguments.as_slice(),
        ]
        .concat();
        let (status, stdout, stderr) = bowden(folder.path(), &command);
        assert_eq!((status, stdout.as_str()), (2, ""), "{arguments:?}");
        assert!(stderr.starts_with(&format!("bowden: {expected}")), "{arguments:?}: {stderr}");
        assert_eq!(stderr.lines().count(), 1);
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn points_that_an_interrupted_run_left_are_not_followed_by_the_next() {
    let folder = tempfile::tempdir().unwrap();
    let track = |name: &str, value: f64| {
        let path = folder.path().join(name);
        fs::write(&path, format!("t_s,theta_ref_rad\n0,{value}\n1,{value}\n")).unwrap();
        Course::Streamed(Track::load(&path, Mode::Position).unwrap())
    };
    let (high, low) = (track("high.csv", 0.2), track("low.csv", 0.0));
    let client = Client::connect(Box::new(SimTransport::new()), "sim", TIMEOUT).unwrap();
    let mut session = Session::new(client).unwrap();
    let mut highest = [0.0_f64; 2];
    for (course, highest) in [high, low].iter().zip(&mut highest) {
        session.ready(&|| false).unwrap();
        session.home(&|| false).unwrap();
        let mut count = 0;
        let end = session.run(Mode::Position, course, &|| false, &mut |tick| {
            *highest = highest.max(f64::from(tick.sample.reference_raw) / 1_048_576.0);
            count += 1;
            if count == 6000 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        assert_eq!(end, Ok(RunEnd::Complete));
    }
    assert!(highest[0] > 0.19, "{highest:?}");
    // Homing ends within 0.02 rad of zero.
    assert!(highest[1] < 0.05, "{highest:?}");
}
