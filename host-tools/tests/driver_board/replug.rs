//! A board that is unplugged while it is recorded, and comes back.

use std::fs;
use std::path::Path;

use bowden_core::recording::{Column, ReadOptions, Recording};
use bowden_link::State;

use crate::fake::Fake;
use crate::mishaps::Mishaps;
use crate::pseudo_terminal::Terminal;
use crate::result_of;
use crate::screen::Screen;
use crate::terminal::{THOUSAND_ROWS, recorded_bytes, signal, wait_for_bytes};

/// A board that has been on for an hour: longer than any absence of a test.
fn long_on() -> Fake {
    let mut fake = Fake::new(Mishaps::default());
    fake.tick = 36_000_000;
    fake
}

/// Times and states of a recording, and where its only gap is: the number of the row before it.
fn with_one_gap(folder: &Path, name: &str) -> (Vec<(f64, u32)>, usize) {
    let recording = Recording::load(&folder.join(name), &ReadOptions::default()).unwrap();
    let Some(Column::Unknown(states)) = recording.columns().iter().find(|column| column.name() == "state")
    else {
        panic!("no states");
    };
    let state = |row: usize| states.cell(row).unwrap().parse().unwrap();
    let rows: Vec<(f64, u32)> = (0..).zip(recording.t_s()).map(|(row, t_s)| (*t_s, state(row))).collect();
    let is_gap = |pair: &[(f64, u32)]| (pair[1].0 - pair[0].0 - 1e-4).abs() > 1e-7;
    let gaps: Vec<usize> =
        (0..).zip(rows.windows(2)).filter(|(_, pair)| is_gap(pair)).map(|(row, _)| row).collect();
    assert_eq!(gaps.len(), 1, "{gaps:?}");
    (rows, gaps[0])
}

#[test]
fn a_recording_goes_on_with_the_joint_stopped_and_the_gap_marked() {
    for (name, restarts) in [("a.csv", false), ("a.mcap", true)] {
        let folder = tempfile::tempdir().unwrap();
        let mut terminal = Terminal::linked(long_on(), folder.path().join("board"));
        let records = tempfile::tempdir().unwrap();
        let mut child = terminal.start_recording(records.path(), name);
        wait_for_bytes(THOUSAND_ROWS, records.path(), &mut child);
        if restarts {
            terminal.unplug();
        } else {
            // The rest of the frame never comes, and the next one is no part of it.
            terminal.unplug_within_a_frame();
        }
        assert_eq!(terminal.fake().state, State::Run);
        if restarts {
            terminal.fake().switch_off_and_on();
        }
        assert!(child.try_wait().unwrap().is_none());
        terminal.replug();
        wait_for_bytes(recorded_bytes(records.path()) + 3 * THOUSAND_ROWS, records.path(), &mut child);
        assert_eq!(terminal.fake().state, State::Off);
        signal(&child, "-INT");
        let (status, _, stderr) = result_of(&child.wait_with_output().unwrap());
        assert_eq!(status, 3, "{stderr}");
        let (rows, gap) = with_one_gap(records.path(), name);
        assert!(rows[..=gap].iter().all(|(_, state)| *state == 5) && gap > 1000);
        assert!(rows[gap + 1..].iter().all(|(_, state)| *state == 0) && rows.len() > gap + 1000);
        let mark = format!("{:?}", rows[gap].0);
        let expected = format!(
            "bowden: {name}: the board was unplugged once, first after t_s = {mark}; the joint was stopped and is at rest \
             behind the gap\nbowden: {name}: "
        );
        assert!(stderr.starts_with(&expected) && stderr.contains("samples lost in 1 gap"), "{stderr}");
        // The mark stands in the file, or beside it.
        let marked = fs::read(records.path().join(if restarts { name } else { "a.recording.toml" })).unwrap();
        let holds = |text: &str| marked.windows(text.len()).any(|bytes| bytes == text.as_bytes());
        assert!(holds("bowden.unplugged") && holds("after_t_s.1") && holds(&mark));
        assert_eq!(terminal.fake().violations, [""; 0]);
    }
}

#[test]
fn a_board_that_comes_back_with_other_parameters_ends_the_recording() {
    let folder = tempfile::tempdir().unwrap();
    let mut terminal = Terminal::linked(long_on(), folder.path().join("board"));
    let records = tempfile::tempdir().unwrap();
    let mut child = terminal.start_recording(records.path(), "a.csv");
    wait_for_bytes(THOUSAND_ROWS, records.path(), &mut child);
    terminal.unplug();
    terminal.fake().set("tendon.pretension", 31.0);
    terminal.replug();
    let (status, _, stderr) = result_of(&child.wait_with_output().unwrap());
    assert_eq!(status, 1);
    let expected = "bowden: the board came back changed: tendon.pretension is 31.0, was 30.0; keep parameters with \
                    `bowden params store` before a run, and record again; a.csv: ";
    assert!(stderr.starts_with(expected) && stderr.trim_end().ends_with(" s are kept"), "{stderr}");
}

#[test]
fn the_monitor_shows_an_absence_and_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let mut terminal = Terminal::linked(long_on(), folder.path().join("board"));
    let arguments = ["--record", "a.csv", "--reference", "sine"];
    let mut screen = Screen::start(&terminal.command(folder.path(), "monitor", &arguments), 100, 30);
    screen.press("a");
    screen.wait_for("ARMED");
    screen.press("r");
    screen.wait_for("run  ARMED");
    terminal.unplug();
    screen.wait_for("waiting for the board; q quits");
    screen.wait_for("not armed");
    terminal.replug();
    screen.wait_for("the board is back after ");
    screen.wait_for("off  not armed");
    screen.press("a");
    screen.wait_for("ARMED");
    screen.press("q");
    let (status, stderr) = screen.end();
    assert_eq!(status, 3);
    assert!(stderr.contains("samples lost in 1 gap"), "{stderr}");
    let (rows, gap) = with_one_gap(folder.path(), "a.csv");
    assert_eq!((rows[gap].1, rows[gap + 1].1), (5, 0));
}
