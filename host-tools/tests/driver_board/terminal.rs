//! The commands as processes, over a pseudo terminal with the fake board behind it.

use std::f64::consts::TAU;
use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use bowden_core::recording::{Column, ReadOptions, Recording};
use bowden_host_link::client::DEFAULT_TIMEOUT;
use bowden_link::message::Goal;
use bowden_link::{Fault, FaultRecord, State, ToBoard};
use bowden_model::channel::Channel;

use crate::fake::{Fake, signals};
use crate::mishaps::Mishaps;
use crate::pseudo_terminal::Terminal;
use crate::{bowden, result_of};

fn load(folder: &Path, name: &str) -> Recording {
    Recording::load(&folder.join(name), &ReadOptions::default()).unwrap()
}

/// A column that is no role, as numbers.
fn raw(recording: &Recording, name: &str) -> Vec<f64> {
    let Some(Column::Unknown(text)) = recording.columns().iter().find(|column| column.name() == name) else {
        panic!("no column {name}");
    };
    (0..recording.len()).map(|row| text.cell(row).unwrap().parse().unwrap()).collect()
}

/// Ticks of the rows, from the time at 10 kHz.
fn ticks(recording: &Recording) -> Vec<u32> {
    recording.t_s().iter().map(|t_s| (t_s * 1e4).round() as u32).collect()
}

#[test]
fn a_recording_holds_every_tick_in_si_units_and_as_it_came() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        ["--out", "a.csv", "--seconds", "0.5", "--reference", "sine", "--home", "--rig", "rig.toml"];
    let (status, stdout, stderr) = terminal.bowden(folder.path(), "record", &arguments);
    assert_eq!((status, stderr.as_str()), (0, ""));
    assert_eq!(stdout, "a.csv: 5000 rows over 0.500 s, tick 100.0 us\n");

    let recording = load(folder.path(), "a.csv");
    let ticks = ticks(&recording);
    assert_eq!(ticks.len(), 5000);
    let inputs = recording.channel(Channel::ThetaIn).unwrap();
    let outputs = recording.channel(Channel::ThetaOut).unwrap();
    let channel = |channel, row: usize| recording.channel(channel).unwrap()[row];
    let (counts, codes) = (raw(&recording, "encoder_out_count_raw"), raw(&recording, "f2_raw"));
    for (row, tick) in ticks.iter().enumerate() {
        assert_eq!(*tick, ticks[0] + row as u32);
        // Shortest decimal numbers: the time is the exact multiple of the period.
        assert_eq!(recording.t_s()[row], f64::from(*tick) / 1e4);
        let sample = signals(*tick);
        // By hand from the parameters of the fake: zeros 1000 and 2000, the joint's encoder turned round.
        let input = f64::from(sample.encoder_count_raw[0] - 1000) * TAU / 4096.0;
        let output = f64::from(2000 - sample.encoder_count_raw[1]) * TAU / 4096.0;
        assert!((inputs[row] - input).abs() < 1e-9 && (outputs[row] - output).abs() < 1e-9, "row {row}");
        assert!(
            (channel(Channel::F1, row) - (f64::from(sample.tension_raw[0]) - 620.5) * 0.035_037).abs() < 1e-9
        );
        assert!((channel(Channel::F2, row) - (f64::from(sample.tension_raw[1]) - 600.0) * 0.03).abs() < 1e-9);
        let current_a = (f64::from(sample.current_raw) - 2047.5) * 0.006_715_5;
        assert!((channel(Channel::MotorCurrent, row) - current_a).abs() < 1e-9);
        assert!((channel(Channel::BusVoltage, row) - 2707.0 * 0.008_864_5).abs() < 1e-9);
        assert!((channel(Channel::Duty, row) - f64::from(sample.duty_raw) / 32_767.0).abs() < 1e-9);
        let reference_rad = f64::from(sample.reference_raw) / 1_048_576.0;
        assert!((channel(Channel::ThetaRef, row) - reference_rad).abs() < 1e-9);
        assert_eq!(channel(Channel::DriveEnable, row), 1.0);
        assert_eq!(counts[row], f64::from(sample.encoder_count_raw[1]));
        assert_eq!(codes[row], f64::from(sample.tension_raw[1]));
    }
    assert!(raw(&recording, "state").iter().all(|state| *state == 5.0));
    let parameters = fs::read_to_string(folder.path().join("a.parameters.toml")).unwrap();
    assert!(
        parameters.contains("firmware = \"9.8.7\"") && parameters.contains("tendon.pretension = 30.0  # N")
    );
    let (status, stdout, _) = bowden(folder.path(), &["check", "a.csv", "--rig", "rig.toml"]);
    assert_eq!(status, 0);
    assert!(stdout.contains("inputs: theta_in_rad, duty, bus_v, drive_enable"), "{stdout}");

    let fake = terminal.fake();
    assert_eq!((fake.state, fake.violations.as_slice()), (State::Off, [].as_slice()));
    assert_eq!(fake.count(|message| *message == ToBoard::Enter(Goal::Home)), 1);
}

#[test]
fn lost_samples_leave_gaps_and_are_reported() {
    for mishaps in [
        Mishaps { lose_batches: Some(50), lose_answers: Some(2), only_statuses: true, ..Mishaps::default() },
        Mishaps {
            damage_batches: Some(50),
            damage_answers: Some(2),
            only_statuses: true,
            ..Mishaps::default()
        },
    ] {
        let terminal = Terminal::new(Fake::new(mishaps));
        let folder = tempfile::tempdir().unwrap();
        let arguments = ["--out", "a.csv.gz", "--seconds", "0.4"];
        let (status, stdout, stderr) = terminal.bowden(folder.path(), "record", &arguments);
        assert_eq!(status, 3, "{stderr}");
        let recording = load(folder.path(), "a.csv.gz");
        let ticks = ticks(&recording);
        let gaps: Vec<(u32, u32)> = ticks
            .windows(2)
            .filter(|pair| pair[1] != pair[0] + 1)
            .map(|pair| (pair[0] + 1, pair[1] - pair[0] - 1))
            .collect();
        let missing: u32 = gaps.iter().map(|(_, length)| length).sum();
        // A run of 4000 samples begins in batch 1 and ends in batch 167 or 168; batches 50, 100 and 150 are missing.
        assert_eq!((gaps.len(), missing), (3, 3 * 24), "{gaps:?}");
        assert_eq!(recording.len() + missing as usize, 4000);
        let first_s = f64::from(gaps[0].0) / 1e4;
        let expected =
            format!("bowden: a.csv.gz: 72 samples lost in 3 gaps, the first at t_s = {first_s:?};");
        assert!(stderr.starts_with(&expected), "{stderr}");
        assert_eq!(stderr.lines().count(), 1);
        assert_eq!(stdout, format!("a.csv.gz: {} rows over 0.400 s, tick 100.0 us\n", recording.len()));
        let fake = terminal.fake();
        // Every second answer to them failed.
        assert!(fake.count(|message| *message == ToBoard::ReadStatus) >= 4);
        assert_eq!(fake.violations, [""; 0]);
    }
}

#[test]
fn a_fault_during_the_run_is_reported_and_keeps_the_recording() {
    let terminal = Terminal::new(Fake::new(Mishaps { slack_after: Some(1500), ..Mishaps::default() }));
    let folder = tempfile::tempdir().unwrap();
    let (status, stdout, stderr) =
        terminal.bowden(folder.path(), "record", &["--out", "a.csv", "--seconds", "1"]);
    let recording = load(folder.path(), "a.csv");
    let tick = *ticks(&recording).last().unwrap();
    let record = FaultRecord { fault: Fault::Slack, channel: 2, tick, got: 0.25, limit: 1.0 };
    assert_eq!(stderr, format!("bowden: {record}; a.csv: 1500 rows over 0.150 s are kept\n"));
    assert_eq!((status, stdout.as_str(), recording.len()), (1, "", 1500));
    assert_eq!(recording.channel(Channel::DriveEnable).unwrap()[1498..], [1.0, 0.0]);

    // Until somebody clears it, it stays.
    let (status, _, stderr) = terminal.bowden(folder.path(), "send", &["ready"]);
    assert_eq!((status, stderr), (1, format!("bowden: {record}\n")));
    let (status, stdout, _) = terminal.bowden(folder.path(), "faults", &["--clear", "--snapshot", "s.csv"]);
    assert_eq!(status, 0);
    for line in [
        "state: fault",
        &record.to_string(),
        "limits that act: reference stream empty, last one held",
        "firmware 9.8.7 on fake, started by: the watchdog",
        "clock: internal oscillator, for the crystal does not run: times are good to 1 % only",
        "panic before that: index out of bounds at tick.rs:7",
        "samples of the last ticks: 64",
        "fault cleared",
    ] {
        assert!(stdout.lines().any(|got| got == line), "{line} in {stdout}");
    }
    assert_eq!(terminal.fake().state, State::Off);
    let snapshot = load(folder.path(), "s.csv");
    let ticks = self::ticks(&snapshot);
    assert_eq!((ticks.len(), ticks[63]), (64, tick - 1));
    assert_eq!(raw(&snapshot, "f1_raw")[63], f64::from(signals(tick - 1).tension_raw[0]));
}

#[test]
fn the_ticks_before_a_fault_are_kept_where_their_count_wraps() {
    let mut fake = Fake::new(Mishaps::default());
    fake.tick = u32::MAX - 40;
    fake.advance_to(Duration::from_micros(6400));
    fake.state = State::Fault;
    let terminal = Terminal::new(fake);
    let folder = tempfile::tempdir().unwrap();
    let (status, _, stderr) = terminal.bowden(folder.path(), "faults", &["--snapshot", "s.csv"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    let snapshot = load(folder.path(), "s.csv");
    let ticks: Vec<u64> = snapshot.t_s().iter().map(|t_s| (t_s * 1e4).round() as u64).collect();
    let first = u64::from(u32::MAX) - 39;
    assert_eq!(ticks, (first..first + 64).collect::<Vec<_>>());
}

#[test]
fn a_reference_that_the_joint_cannot_do_is_not_even_sent() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        ["--out", "a.csv", "--seconds", "1", "--reference", "sine", "--amplitude", "40", "--home"];
    let (status, stdout, stderr) = terminal.bowden(folder.path(), "record", &arguments);
    assert_eq!((status, stdout.as_str()), (2, ""));
    assert!(stderr.starts_with("bowden: --amplitude 40: the joint can do 0."), "{stderr}");
    let fake = terminal.fake();
    let moves = |message: &ToBoard| matches!(message, ToBoard::Enter(_) | ToBoard::SetReference(_));
    assert_eq!((fake.state, fake.count(moves)), (State::Off, 0));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn what_the_board_refuses_is_told_and_nothing_is_left() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--out", "a.csv", "--seconds", "1", "--reference", "sine", "--amplitude", "0.85"];
    let (status, stdout, stderr) = terminal.bowden(folder.path(), "record", &arguments);
    assert_eq!(
        (status, stdout.as_str(), stderr.as_str()),
        (
            2,
            "",
            "bowden: the board refused the reference: 0.85 is out of range, expected -0.8 to 0.8; choose a value within it\n"
        )
    );
    assert_eq!(terminal.fake().state, State::Off);
    let (status, _, stderr) = terminal.bowden(folder.path(), "send", &["home"]);
    let expected =
        "bowden: the board refused to home: not possible in state off; `bowden send ready` comes first\n";
    assert_eq!((status, stderr.as_str()), (1, expected));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn parameters_are_listed_set_and_kept_in_files() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    let params = |arguments: &[&str]| terminal.bowden(folder.path(), "params", arguments);
    let (status, listed, _) = params(&[]);
    assert_eq!((status, listed.lines().count()), (0, 38));
    let (_, stdout, _) = params(&["get", "tendon.pretension"]);
    let words: Vec<&str> = stdout.split_whitespace().collect();
    assert_eq!(words, ["tendon.pretension", "30.0", "N", "0.1", "to", "1000.0,", "default", "30.0"]);

    // Options may stand behind the values.
    let (status, stdout, stderr) =
        params(&["set", "tendon.pretension=25.5", "encoder.input.direction=-1", "--quiet"]);
    assert_eq!((status, stdout.as_str(), stderr.as_str()), (0, "", ""));
    assert_eq!(terminal.fake().value("tendon.pretension"), 25.5);
    assert_eq!(terminal.fake().value("encoder.input.direction"), -1.0);

    for (assignment, expected) in [
        ("tendon.pretention=3", "no parameter `tendon.pretention`; did you mean `tendon.pretension`?"),
        ("zzz=3", "no parameter `zzz`; see `bowden params --port PORT list`"),
        ("tendon.pretension=much", "got `much`, expected a number with a decimal point"),
        ("tendon.pretension", "expected NAME=VALUE"),
        ("tendon.pretension=2000", "got 2000.0, allowed 0.1 to 1000.0 N; check value and unit"),
        ("tendon.pretension=nan", "got NaN, allowed 0.1 to 1000.0 N; check value and unit"),
    ] {
        let (status, _, stderr) = params(&["set", "motor.resistance=3", assignment]);
        assert_eq!((status, stderr), (2, format!("bowden: `{assignment}`: {expected}\n")));
    }
    // A mistake in one of them changes none.
    assert_eq!(terminal.fake().value("motor.resistance"), 2.0);

    let (status, _, _) = params(&["save", "p.toml"]);
    assert_eq!(status, 0);
    let saved = fs::read_to_string(folder.path().join("p.toml")).unwrap();
    assert!(saved.contains("\ntendon.pretension = 25.5  # N, 0.1 to 1000.0, default 30.0\n"), "{saved}");
    assert_eq!(params(&["default"]).0, 0);
    assert_eq!(terminal.fake().value("tendon.pretension"), 30.0);
    // The new lower limit is above the old upper one, which comes later in the file.
    let file =
        saved.replace("tension.slack = 1.0", "tension.slack = 95.0").replace("over = 90.0", "over = 120.0");
    fs::write(folder.path().join("p.toml"), &file).unwrap();
    let (status, _, stderr) = params(&["load", "p.toml"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    let value = |name| terminal.fake().value(name);
    assert_eq!(
        [value("tension.slack"), value("tension.over"), value("tendon.pretension")],
        [95.0, 120.0, 25.5]
    );
    let (_, _, stderr) = params(&["set", "tension.slack=130"]);
    assert_eq!(
        stderr,
        "bowden: tension.slack: 130.0 does not go with the value of tension.over; change tension.over as well\n"
    );
    // All 38 values survive the way through the file.
    assert_eq!(params(&["save", "q.toml"]).0, 0);
    let again = fs::read_to_string(folder.path().join("q.toml")).unwrap();
    let values = |text: &str| -> Vec<String> {
        text.lines().filter_map(|line| line.split("  #").next()).map(str::to_owned).collect()
    };
    assert_eq!(values(&again), values(&file));

    for (text, expected) in [
        (
            "tendon.pretension = 3",
            "bad.toml:1:1: no schema, expected schema = \"bowden-parameters/1\"; add it",
        ),
        (
            "schema = \"bowden-rig/1\"",
            "bad.toml:1:10: schema: got \"bowden-rig/1\", expected \"bowden-parameters/1\"; name another file",
        ),
        (
            "schema = \"bowden-parameters/1\"\ntendon.pretension = 3\ntendon.lenght = 1",
            "bad.toml:3:8: unknown parameter `tendon.lenght`; did you mean `tendon.length`?",
        ),
        (
            "schema = \"bowden-parameters/1\"\n[tendon]\npretension = -3",
            "bad.toml:3:14: tendon.pretension: got -3, allowed 0.1 to 1000 N; check value and unit",
        ),
    ] {
        fs::write(folder.path().join("bad.toml"), text).unwrap();
        let (status, _, stderr) = params(&["load", "bad.toml"]);
        assert_eq!((status, stderr), (2, format!("bowden: {expected}\n")));
    }
    assert_eq!(params(&["store"]).0, 0);
    assert_eq!(terminal.fake().stored, 1);
    assert_eq!(terminal.fake().violations, [""; 0]);
}

#[test]
fn single_steps_lead_from_state_to_state() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    let send = |arguments: &[&str]| terminal.bowden(folder.path(), "send", arguments);
    assert_eq!(send(&["ready"]), (0, "state: ready\n".to_owned(), String::new()));
    assert_eq!(send(&["home"]), (0, "state: ready\n".to_owned(), String::new()));
    // Longer than the board lets its host be silent.
    let (status, stdout, stderr) = send(&[
        "run",
        "--seconds",
        "0.8",
        "--mode",
        "torque",
        "--reference",
        "triangle",
        "--amplitude",
        "0.2",
    ]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    assert_eq!(stdout.lines().count(), 2, "{stdout}");
    assert!(stdout.contains("0.500 s  run  joint +"), "{stdout}");
    assert_eq!(terminal.fake().state, State::Off);
    let (status, stdout, _) = send(&["status"]);
    assert_eq!(status, 0);
    assert!(stdout.starts_with("state: off\nno fault\nlimits that act: reference stream empty"), "{stdout}");
    assert_eq!(send(&["stop"]), (0, "state: off\n".to_owned(), String::new()));
    assert_eq!(terminal.fake().violations, [""; 0]);
}

#[test]
fn single_steps_come_as_json() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    let send = |arguments: &[&str]| {
        let (status, stdout, stderr) =
            terminal.bowden(folder.path(), "send", &[arguments, &["--json"]].concat());
        assert_eq!((status, stderr.as_str()), (0, ""), "{arguments:?}");
        stdout
    };
    let whole = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
    for (step, state) in [("ready", "ready"), ("home", "ready"), ("off", "off")] {
        assert_eq!(whole(&send(&[step])), serde_json::json!({ "state": state }));
    }
    send(&["ready"]);
    let lines = send(&["run", "--seconds", "0.8", "--reference", "sine", "--amplitude", "0.2"]);
    let lines: Vec<serde_json::Value> = lines.lines().map(whole).collect();
    assert_eq!(
        (lines.len(), lines[0]["run_s"].as_f64(), lines[1]["run_s"].as_f64()),
        (2, Some(0.0), Some(0.5))
    );
    for line in &lines {
        // f4 of the fake is 829.5 codes of 0.035037 N; its joint is up to 300 counts of 4096 from its zero.
        let f4_n = line["tensions_n"][3].as_f64().unwrap();
        let joint_rad = line["theta_out_rad"].as_f64().unwrap();
        assert!(line["state"] == "run" && (f4_n - 29.0632).abs() < 1e-3, "{line}");
        assert!((0.0..0.4602).contains(&joint_rad) && line["limits"].is_array(), "{line}");
    }
}

/// Bytes of a recording that holds more than 1000 rows in either format: a row of CSV takes less than 250, one of MCAP less.
pub const THOUSAND_ROWS: u64 = 250_000;

/// Bytes on the disk of the recording that is being written in `folder`.
pub fn recorded_bytes(folder: &Path) -> u64 {
    // A file that gets its final name meanwhile counts as empty.
    fs::read_dir(folder).unwrap().map(|file| file.unwrap().metadata().map_or(0, |file| file.len())).sum()
}

/// Waits until `bowden record` has written so many bytes to its file in `folder`.
pub fn wait_for_bytes(bytes: u64, folder: &Path, child: &mut Child) {
    while recorded_bytes(folder) < bytes {
        if let Some(status) = child.try_wait().unwrap() {
            let mut stderr = String::new();
            child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
            panic!("the run ended by itself, {status}: {stderr}");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

pub fn signal(child: &Child, name: &str) {
    assert!(Command::new("kill").args([name, &child.id().to_string()]).status().unwrap().success());
}

#[test]
fn ctrl_c_ends_a_recording_whole() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    let mut child = terminal.start_recording(folder.path(), "a.mcap");
    wait_for_bytes(THOUSAND_ROWS, folder.path(), &mut child);
    signal(&child, "-INT");
    let (status, stdout, stderr) = result_of(&child.wait_with_output().unwrap());
    assert_eq!((status, stderr.as_str()), (0, ""));
    let recording = load(folder.path(), "a.mcap");
    assert!(stdout.starts_with(&format!("a.mcap: {} rows over ", recording.len())), "{stdout}");
    assert!(recording.len() > 1000, "{stdout}");
    assert_eq!(terminal.fake().state, State::Off);
    // An MCAP file holds the parameters itself.
    assert!(!folder.path().join("a.parameters.toml").exists());
    let file = fs::read(folder.path().join("a.mcap")).unwrap();
    let holds = |text: &str| file.windows(text.len()).any(|bytes| bytes == text.as_bytes());
    assert!(holds("bowden.parameters") && holds("tendon.pretension") && holds("9.8.7"));
}

/// Between two frames, and within one, of which nothing is kept and nothing is said.
#[test]
fn a_pulled_plug_keeps_the_rows_before_it() {
    for pull in [Terminal::unplug, Terminal::unplug_within_a_frame] {
        let mut terminal = Terminal::new(Fake::new(Mishaps::default()));
        let folder = tempfile::tempdir().unwrap();
        let port = terminal.port().to_owned();
        let mut command = terminal.command(folder.path(), "record", &["--out", "a.csv", "--replug", "0"]);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        wait_for_bytes(THOUSAND_ROWS, folder.path(), &mut child);
        pull(&mut terminal);
        let (status, _, stderr) = result_of(&child.wait_with_output().unwrap());
        let recording = load(folder.path(), "a.csv");
        let rows = recording.len();
        assert_eq!(status, 1);
        assert!(rows > 1000, "{rows} rows");
        assert!(ticks(&recording).windows(2).all(|pair| pair[1] == pair[0] + 1));
        assert!(stderr.starts_with(&format!("bowden: {port}: ")), "{stderr}");
        assert!(
            stderr.contains(&format!("check cable and supply, then connect again; a.csv: {rows} rows over ")),
            "{stderr}"
        );
        assert_eq!(stderr.lines().count(), 1);
    }
}

#[test]
fn a_slow_board_and_a_slow_host_cost_no_sample() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    // The board answers nothing for longer than `bowden` waits by default.
    let fake = terminal.fake();
    let mut child = terminal.start_recording(folder.path(), "a.csv");
    std::thread::sleep(DEFAULT_TIMEOUT * 6 / 5);
    drop(fake);
    wait_for_bytes(THOUSAND_ROWS, folder.path(), &mut child);
    // The host stands still for longer than the board lets it be silent.
    signal(&child, "-STOP");
    let silence_s = terminal.fake().value("supervisor.host_timeout");
    std::thread::sleep(Duration::from_secs_f32(1.5 * silence_s));
    signal(&child, "-CONT");
    wait_for_bytes(recorded_bytes(folder.path()) + THOUSAND_ROWS, folder.path(), &mut child);
    signal(&child, "-INT");
    let (status, _, stderr) = result_of(&child.wait_with_output().unwrap());
    assert_eq!((status, stderr.as_str()), (0, ""));
    let ticks = ticks(&load(folder.path(), "a.csv"));
    assert!(ticks.windows(2).all(|pair| pair[1] == pair[0] + 1));
    assert_eq!(terminal.fake().violations, [""; 0]);
}
