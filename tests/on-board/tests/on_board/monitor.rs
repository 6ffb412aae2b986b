//! `bowden monitor` of the emulated board, in a terminal.

use std::path::Path;

use bowden_board::Board;
use bowden_core::recording::{Column, ReadOptions, Recording};
use bowden_on_board_tests::tool::{Plugged, tool};
use bowden_on_board_tests::{Outcome, image};
use serde_json::Value;

use crate::foxglove_client::{Client, address};
use crate::screen::Screen;

/// Starts `bowden <line>`, which names the port itself, in a terminal.
pub fn in_terminal(folder: &Path, line: &[&str]) -> Outcome<Screen> {
    let mut command = std::process::Command::new(tool()?);
    command.args(line).current_dir(folder);
    Ok(Screen::start(&command, 100, 30))
}

/// Lets the board run until all of `wanted` stand on the screen: a picture comes in pieces, one look has to find everything.
pub fn await_all(board: &mut Plugged, screen: &mut Screen, wanted: &[&str]) {
    let mut text = String::new();
    let mut is_whole = false;
    let waited = board.attend(wanted[0], || {
        text = screen.text();
        is_whole = wanted.iter().all(|part| text.contains(part));
        is_whole || screen.has_ended()
    });
    assert!(is_whole, "{waited:?}: {wanted:?} are not all on the screen:\n{text}");
}

/// Times and states of a recording.
pub fn times_and_states(path: &Path) -> Vec<(f64, u32)> {
    let recording = Recording::load(path, &ReadOptions::default()).expect("a recording");
    let is_state = |column: &&Column| column.name() == "state";
    let Some(Column::Unknown(states)) = recording.columns().iter().find(is_state) else {
        panic!("no states");
    };
    let state = |row| states.cell(row).and_then(|cell| cell.parse().ok()).expect("a state");
    (0..).zip(recording.t_s()).map(|(row, t_s)| (*t_s, state(row))).collect()
}

#[test]
fn the_joint_is_watched_armed_run_and_stopped_by_keys() -> Outcome {
    let folder = tempfile::tempdir().expect("a folder");
    let mut board = Plugged::new(Board::builder(&image::firmware()?).build()?)?;
    let line = board.arguments("monitor");
    let mut line: Vec<&str> = line.iter().map(String::as_str).collect();
    line.extend(["--reference", "sine", "--amplitude", "0.2", "--record", "a.mcap"]);
    let mut screen = in_terminal(folder.path(), &line)?;
    let steps = [
        ("nucleo-g474re", "a"),
        ("ready to move", "h"),
        ("at zero", "r"),
        ("run  ARMED", " "),
        ("stopped", "q"),
    ];
    for (awaited, keys) in steps {
        let wanted = [awaited, "no fault", "  lost 0 (by the board 0)  damaged 0  late 0"];
        await_all(&mut board, &mut screen, &wanted);
        screen.press(keys);
    }
    board.attend("the end", || screen.has_ended())?;
    assert_eq!(screen.end(), (0, String::new()));
    assert_eq!(board.board.pwm().duty, None, "off at the end");
    // Every tick of all of it is recorded.
    let rows = times_and_states(&folder.path().join("a.mcap"));
    assert!(rows.windows(2).all(|pair| (pair[1].0 - pair[0].0 - 1e-4).abs() < 1e-8));
    let mut states: Vec<u32> = rows.iter().map(|(_, state)| *state).collect();
    states.dedup();
    // Off, self test, pretension check, ready, homing, ready, run, off.
    assert_eq!(states, [0, 1, 2, 3, 4, 3, 5, 0]);
    Ok(())
}

#[test]
fn a_client_of_foxglove_gets_what_the_joint_does() -> Outcome {
    /// Enough to see every signal change by its noise.
    const SAMPLES: usize = 200;
    let folder = tempfile::tempdir().expect("a folder");
    let mut board = Plugged::new(Board::builder(&image::firmware()?).build()?)?;
    let line = board.arguments("monitor");
    let mut line: Vec<&str> = line.iter().map(String::as_str).collect();
    line.push("--foxglove=0");
    let mut screen = in_terminal(folder.path(), &line)?;
    await_all(&mut board, &mut screen, &["ws://127.0.0.1:", "nucleo-g474re"]);
    let address = address(&screen.text()).expect("an address");
    let client = std::thread::spawn(move || -> Vec<Value> {
        let mut client = Client::connect(&address);
        client.subscribe();
        (0..SAMPLES).map(|_| client.sample()).collect()
    });
    board.attend("samples", || client.is_finished())?;
    let samples = client.join().expect("samples");
    screen.press("q");
    board.attend("the end", || screen.has_ended())?;
    assert_eq!(screen.end(), (0, String::new()));

    let of = |role: &str| -> Vec<f64> {
        samples.iter().map(|sample| sample[role].as_f64().unwrap_or(f64::NAN)).collect()
    };
    let times = of("t_s");
    assert!(times.windows(2).all(|pair| pair[1] > pair[0] + 0.9e-3), "{times:?}");
    // The joint rests: what the bench itself has, which no sensor and no message has touched.
    let bench = board.board.bench();
    let mean = |role: &str| of(role).iter().sum::<f64>() / SAMPLES as f64;
    let [f1, f2, f3, f4] = bench.tensions_n();
    for (role, expected, tolerance) in [
        ("f1_n", f1, 0.2),
        ("f2_n", f2, 0.2),
        ("f3_n", f3, 0.2),
        ("f4_n", f4, 0.2),
        ("theta_in_rad", bench.theta_in_rad(), 2e-3),
        ("theta_out_rad", bench.theta_out_rad(), 2e-3),
        ("bus_v", bench.supply_v(), 0.1),
    ] {
        let got = mean(role);
        assert!((got - expected).abs() < tolerance, "{role}: {got}, {expected} on the bench");
    }
    Ok(())
}
