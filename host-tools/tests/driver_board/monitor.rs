//! `bowden monitor` in a terminal, with the fake board and with the simulated one.

use std::fs;
use std::path::Path;

use bowden_core::recording::{Column, ReadOptions, Recording};
use bowden_link::message::{Goal, Mode};
use bowden_link::{Limit, Limits, Sample, State, ToBoard};
use vt100::Color;

use crate::fake::Fake;
use crate::mishaps::Mishaps;
use crate::pseudo_terminal::Terminal;
use crate::screen::Screen;
use crate::{bowden, command};

/// Starts the monitor of a fake board.
fn watch(terminal: &Terminal, folder: &Path, arguments: &[&str]) -> Screen {
    Screen::start(&terminal.command(folder, "monitor", arguments), 100, 30)
}

/// Ticks and states of a recording.
fn ticks_and_states(folder: &Path, name: &str) -> Vec<(u32, u32)> {
    let recording = Recording::load(&folder.join(name), &ReadOptions::default()).unwrap();
    let Some(Column::Unknown(states)) = recording.columns().iter().find(|column| column.name() == "state")
    else {
        panic!("no states");
    };
    let ticks = recording.t_s().iter().map(|t_s| (t_s * 1e4).round() as u32);
    ticks.zip((0..).map(|row| states.cell(row).unwrap().parse().unwrap())).collect()
}

fn assert_no_gap(recorded: &[(u32, u32)]) {
    for pair in recorded.windows(2) {
        assert_eq!(pair[1].0, pair[0].0 + 1);
    }
}

#[test]
fn a_joint_is_armed_homed_and_run_by_keys_while_every_tick_is_recorded() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--record", "a.mcap", "--reference", "sine", "--seconds", "0.3"];
    let mut screen = watch(&terminal, folder.path(), &arguments);
    screen.wait_for("fake 9.8.7 at");
    screen.wait_for("not armed");
    // By hand from codes and parameters of the fake: (1450 - 620.5) 0.035037 N and 2707 · 0.0088645 V.
    screen.wait_for("f4 29.06 N");
    screen.wait_for("bus 24.00 V");
    screen.press("r");
    screen.wait_for("not armed: arm the joint first");
    screen.press("h");
    screen.press("a");
    screen.wait_for("ready to move");
    screen.wait_for("ARMED");
    assert_eq!(terminal.fake().count(|message| *message == ToBoard::Enter(Goal::Home)), 0);
    screen.press("h");
    screen.wait_for("at zero");
    assert_eq!(terminal.fake().count(|message| matches!(message, ToBoard::Enter(Goal::Run(_)))), 0);
    screen.press("r");
    screen.wait_for("the run is complete");
    screen.wait_for("not armed");
    screen.press("q");
    assert_eq!(screen.end(), (0, String::new()));
    let text = screen.text();
    assert!(text.starts_with("a.mcap: ") && text.contains(" rows over "), "{text}");

    let recorded = ticks_and_states(folder.path(), "a.mcap");
    assert_no_gap(&recorded);
    let mut states: Vec<u32> = recorded.iter().map(|(_, state)| *state).collect();
    states.dedup();
    // Off, self test, pretension check, ready, homing, ready, run, off.
    assert_eq!(states, [0, 1, 2, 3, 4, 3, 5, 0]);
    let ran = recorded.iter().filter(|(_, state)| *state == 5).count();
    assert!(ran >= 3000, "{ran}");
    let fake = terminal.fake();
    assert_eq!((fake.state, fake.violations.as_slice()), (State::Off, [].as_slice()));
}

/// Values of one sample, whose SI values and axes are computed by hand from the codes and the parameters of the fake.
///
/// | signal | codes | value |
/// |---|---|---|
/// | pulley | 512 counts of 4096 from its zero | pi/4 = 0.7854 rad |
/// | joint | -256 counts from its zero, turning the other way | pi/8 = 0.3927 rad |
/// | reference, error | 2^19 steps of 2^-20 rad | 0.5 rad, 0.5 - 0.3927 = 0.1073 rad |
/// | f1 | (2048 - 620.5) 0.035037 N | 50.0153 N |
/// | f2 | (1600 - 600) 0.03 N | 30.0000 N |
/// | f3 | (1191 - 620.5) 0.035037 N | 19.9886 N |
/// | f4 | (1000 - 620.5) 0.035037 N | 13.2965 N |
/// | torque in, out | (f1 - f3) 0.015 m, (f2 - f4) 0.015 m | 0.4504 N·m, 0.2506 N·m |
/// | duty | -8192 of 32767 | -0.250 |
/// | current | (2200 - 2047.5) 0.0067155 A | 1.024 A |
#[test]
fn angles_torques_duty_current_error_and_limits_stand_on_the_screen() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    terminal.fake().shown = Some(Sample {
        encoder_count_raw: [1512, 1744],
        tension_raw: [2048, 1600, 1191, 1000],
        current_raw: 2200,
        bus_raw: 2707,
        duty_raw: -8192,
        reference_raw: 1 << 19,
        command_raw: 0,
        state: State::Off,
        limits: Limits(Limit::Current as u16 | Limit::OutputTorque as u16),
    });
    let folder = tempfile::tempdir().unwrap();
    let show = |mode: &str, expected: &[&str]| {
        let command = terminal.command(folder.path(), "monitor", &["--no-color", "--mode", mode]);
        // Wide enough for all panels.
        let mut screen = Screen::start(&command, 160, 40);
        screen.wait_for("limits: current limited, output torque at its limit");
        screen.wait_until("all values", |text| expected.iter().all(|part| text.contains(part)));
        screen.press("q");
        assert_eq!(screen.end(), (0, String::new()));
    };
    let common = [
        "f1 50.02  f2 30.00  f3 19.99  f4 13.30 N  torque in +0.4504 out +0.2506 N·m",
        "duty -0.250  current +1.024 A  bus 24.00 V",
        // Middle of the curves and 1.05 of half of their range, or of the smallest range: tensions, duty, current.
        "+50.9",
        "+12.4",
        "-0.198",
        "-0.303",
        "+1.129",
        "+0.919",
    ];
    // Angles 0.3927 to 0.7854, torques 0.2506 to 0.4504, error 0.1073.
    let position = [
        "joint +0.3927 rad  pulley +0.7854 rad  reference +0.5000 rad  error +0.1073 rad",
        "angles [rad] r=reference p=pulley j=joint",
        "+0.795",
        "+0.383",
        "torque [N·m] i=in o=out",
        "+0.455",
        "+0.246",
        "error [rad]",
        "+0.118",
        "+0.097",
    ];
    show("position", &[&common[..], &position].concat());
    // The same sample: 0.5 N·m are wanted, torques 0.2506 to 0.5, error 0.5 - 0.2506.
    let torque = [
        "joint +0.3927 rad  pulley +0.7854 rad  reference +0.5000 N·m  error +0.2494 N·m",
        "angles [rad] p=pulley j=joint",
        "torque [N·m] r=reference i=in o=out",
        "+0.506",
        "+0.244",
        "error [N·m]",
        "+0.260",
        "+0.239",
    ];
    show("torque", &[&common[..], &torque].concat());
}

#[test]
fn the_space_bar_stops_the_joint_even_when_the_screen_is_stuck() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--record", "a.csv", "--mode", "torque", "--amplitude", "0.2", "--reference", "sine"];
    let mut screen = watch(&terminal, folder.path(), &arguments);
    screen.press("a");
    screen.wait_for("ARMED");
    screen.press("r");
    screen.wait_for("run  ARMED");
    assert_eq!(terminal.fake().count(|message| *message == ToBoard::Enter(Goal::Run(Mode::Torque))), 1);
    // The error is one of the torque then.
    assert!(screen.text().contains("N·m  error "), "{}", screen.text());
    screen.hold(true);
    // A whole picture of this size is more than the line between program and terminal holds.
    screen.resize(300, 120);
    let begun = terminal.fake().tick;
    // More than the screen has room for, on the board's clock.
    while terminal.fake().tick - begun < 40_000 {
        assert!(!screen.has_ended());
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    assert_eq!(terminal.fake().state, State::Run);
    screen.press(" ");
    while terminal.fake().state != State::Off {
        assert!(!screen.has_ended());
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    screen.hold(false);
    screen.wait_for("stopped");
    screen.wait_until("samples that were not shown", |text| {
        text.contains("not shown ") && !text.contains("not shown 0")
    });
    screen.press("q");
    assert_eq!(screen.end(), (0, String::new()));
    // The screen has lost samples, the recording has not.
    assert_no_gap(&ticks_and_states(folder.path(), "a.csv"));
    assert!(folder.path().join("a.parameters.toml").exists());
    assert_eq!(terminal.fake().violations, [""; 0]);
}

#[test]
fn a_fault_is_shown_in_words_and_cleared_by_a_key() {
    let terminal = Terminal::new(Fake::new(Mishaps { slack_after: Some(500), ..Mishaps::default() }));
    let folder = tempfile::tempdir().unwrap();
    let mut screen = watch(&terminal, folder.path(), &["--reference", "sine"]);
    screen.wait_for("no fault");
    screen.press("a");
    screen.wait_for("ARMED");
    screen.press("r");
    screen.wait_for("fault 11, f3: a tendon is slack (0.2500 N, limit 1.0000 N)");
    screen.wait_for("not armed");
    screen.press("a");
    screen.wait_for("not armed");
    screen.press("c");
    screen.wait_for("cleared");
    screen.wait_for("no fault");
    screen.press("\u{3}");
    assert_eq!(screen.end(), (0, String::new()));
}

#[test]
fn lost_samples_are_counted_on_the_screen_and_in_the_end() {
    let terminal = Terminal::new(Fake::new(Mishaps { lose_batches: Some(50), ..Mishaps::default() }));
    let folder = tempfile::tempdir().unwrap();
    let mut screen = watch(&terminal, folder.path(), &["--record", "a.csv"]);
    screen.wait_until("a loss", |text| text.contains("  lost ") && !text.contains("  lost 0 "));
    screen.press("q");
    let (status, stderr) = screen.end();
    assert_eq!(status, 3);
    let recorded = ticks_and_states(folder.path(), "a.csv");
    let missing: u32 = recorded.windows(2).map(|pair| pair[1].0 - pair[0].0 - 1).sum();
    assert!(stderr.starts_with(&format!("bowden: a.csv: {missing} samples lost in ")), "{stderr}");
    assert!(missing > 0 && missing.is_multiple_of(24), "{missing}");
}

#[test]
fn a_terminal_that_is_too_small_is_told_and_costs_nothing() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    let command = terminal.command(folder.path(), "monitor", &["--record", "a.csv"]);
    let mut screen = Screen::start(&command, 79, 24);
    screen.wait_for("The terminal has 79x24 characters, bowden monitor needs 80x24: enlarge it.");
    screen.resize(120, 40);
    screen.wait_for("current [A]");
    screen.resize(30, 5);
    screen.wait_for("30x5");
    screen.press("q");
    assert_eq!(screen.end(), (0, String::new()));
    let recorded = ticks_and_states(folder.path(), "a.csv");
    assert!(recorded.len() > 100);
    assert_no_gap(&recorded);
}

#[test]
fn colours_are_there_and_off_when_asked() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    for (arguments, variable, coloured) in
        [(&[][..], None, true), (&["--no-color"][..], None, false), (&[][..], Some("1"), false)]
    {
        let mut command = terminal.command(folder.path(), "monitor", arguments);
        command.envs(variable.map(|value| ("NO_COLOR", value)));
        let mut screen = Screen::start(&command, 100, 30);
        screen.wait_for("f4 29.06 N");
        // Curves have letters of their own where they have no colours.
        screen.wait_for(if coloured { " f3 " } else { " 3=f3 " });
        let colours = screen.colours();
        assert_eq!(colours != [Color::Default], coloured, "{arguments:?} {variable:?}: {colours:?}");
        screen.press("q");
        assert_eq!(screen.end(), (0, String::new()));
    }
}

#[test]
fn without_a_terminal_or_an_output_it_does_not_begin() {
    let folder = tempfile::tempdir().unwrap();
    let (status, stdout, stderr) = bowden(folder.path(), &["monitor", "--port", "sim"]);
    assert_eq!((status, stdout.as_str()), (2, ""));
    assert_eq!(
        stderr,
        "bowden: monitor: standard input and output are no terminal, which it reads keys from and draws on; run it in one, \
         or use `bowden record`\n"
    );
    let (status, _, stderr) = bowden(folder.path(), &["monitor", "--port", "sim", "--record", "a.txt"]);
    assert_eq!(
        (status, stderr.as_str()),
        (2, "bowden: a.txt: unknown format; end the name in .csv, .csv.gz, .mcap or .parquet\n")
    );
}

#[test]
fn a_pulled_plug_ends_it_with_the_recording_kept() {
    let mut terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    let mut screen = watch(&terminal, folder.path(), &["--record", "a.csv", "--replug", "0"]);
    screen.wait_for("a.csv: ");
    terminal.unplug();
    let (status, stderr) = screen.end();
    assert_eq!(status, 1);
    let rows = ticks_and_states(folder.path(), "a.csv").len();
    assert!(stderr.starts_with(&format!("bowden: {}: ", terminal.port())), "{stderr}");
    assert!(stderr.contains(&format!("; a.csv: {rows} rows over ")), "{stderr}");
    assert_eq!(stderr.lines().count(), 1);
}

#[test]
fn the_simulated_joint_is_driven_by_keys() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        ["monitor", "--port", "sim", "--reference", "sine", "--seconds", "0.4", "--record", "s.csv"];
    let mut screen = Screen::start(&command(folder.path(), &arguments), 80, 24);
    screen.wait_for("simulated");
    screen.press("a");
    screen.wait_for("ARMED");
    screen.press("h");
    screen.wait_for("at zero");
    screen.press("r");
    screen.wait_for("the run is complete");
    assert!(screen.text().contains("no fault"), "{}", screen.text());
    screen.press("q");
    assert_eq!(screen.end(), (0, String::new()));
    let recorded = ticks_and_states(folder.path(), "s.csv");
    assert_no_gap(&recorded);
    assert_eq!(recorded.iter().filter(|(_, state)| *state == 5).count().div_ceil(10), 401);
    assert!(fs::read_to_string(folder.path().join("s.parameters.toml")).unwrap().contains("simulated"));
}
