//! `bowden replay-control`: recordings of the simulated board computed again, and what is said where they cannot be.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use crate::bowden;

/// A raw recording of the simulated board.
fn record(folder: &Path, out: &str, arguments: &[&str]) -> (i32, String) {
    let command = ["record", "--port", "sim:joint_coulomb_friction,seed=3", "--raw", "--out", out];
    let (status, _, stderr) = bowden(folder, &[&command[..], arguments].concat());
    (status, stderr)
}

const SINE: [&str; 7] = ["--home", "--reference", "sine", "--amplitude", "0.3", "--seconds", "0.4"];

/// Text of a file with one cell of a row changed. Rows count from 0 behind the header.
fn with_cell(text: &str, row: usize, column: &str, value: impl Fn(&str) -> String) -> String {
    let place = text.lines().next().unwrap().split(',').position(|name| name == column).unwrap();
    let mut changed = String::new();
    for (line, content) in text.lines().enumerate() {
        if line == row + 1 {
            let mut cells: Vec<String> = content.split(',').map(str::to_owned).collect();
            cells[place] = value(&cells[place]);
            writeln!(changed, "{}", cells.join(",")).unwrap();
        } else {
            writeln!(changed, "{content}").unwrap();
        }
    }
    changed
}

/// Cells of a column.
fn cells<'t>(text: &'t str, column: &str) -> Vec<&'t str> {
    let place = text.lines().next().unwrap().split(',').position(|name| name == column).unwrap();
    text.lines().skip(1).map(|line| line.split(',').nth(place).unwrap()).collect()
}

#[test]
fn every_output_of_a_run_is_computed_again() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("points.csv"), "t_s,theta_ref_rad\n0,0\n0.1,0.1\n0.2,0.05\n0.3,-0.1\n0.4,0\n")
        .unwrap();
    let cases: [(&str, &[&str]); 4] = [
        ("sine.csv", &SINE),
        (
            "torque.mcap",
            &[
                "--mode",
                "torque",
                "--reference",
                "triangle",
                "--amplitude",
                "0.2",
                "--frequency",
                "3",
                "--seconds",
                "0.4",
            ],
        ),
        ("stream.csv.gz", &["--reference", "points.csv"]),
        (
            "impedance.mcap",
            &["--mode", "impedance", "--reference", "sine", "--amplitude", "0.2", "--seconds", "0.3"],
        ),
    ];
    for (out, arguments) in cases {
        assert_eq!(record(folder, out, arguments), (0, String::new()), "{out}");
        let (status, stdout, stderr) = bowden(folder, &["replay-control", out]);
        assert_eq!((status, stderr.as_str()), (0, ""), "{out}");
        assert!(stdout.contains("every output is the board's, bit for bit"), "{stdout}");
        let ticks: u32 = stdout.split(' ').nth(1).unwrap().parse().unwrap();
        assert!(ticks > 3000, "{stdout}");
    }
    // The formats hold the same, and what is read is not only what this command wrote.
    let (status, _, stderr) = bowden(folder, &["convert", "torque.mcap", "torque.parquet"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    let (status, stdout, _) = bowden(folder, &["replay-control", "torque.parquet", "--json"]);
    assert_eq!(status, 0);
    assert!(stdout.contains(r#""difference": null"#), "{stdout}");
}

#[test]
fn a_changed_cell_is_located_to_tick_and_signal() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    assert_eq!(record(folder, "a.csv", &SINE), (0, String::new()));
    let text = fs::read_to_string(folder.join("a.csv")).unwrap();
    let states = cells(&text, "state");
    let run = states.iter().position(|state| *state == "5").unwrap() + 1000;
    let tick = (cells(&text, "t_s")[run].parse::<f64>().unwrap() * 1e4).round() as u64;
    let replay = |changed: &str| {
        fs::write(folder.join("a.csv"), changed).unwrap();
        let (status, stdout, stderr) = bowden(folder, &["replay-control", "a.csv"]);
        assert_eq!((status, stdout.as_str(), stderr.lines().count()), (1, "", 1), "{stderr}");
        stderr
    };
    // An output: there and nowhere else.
    let board: i32 = cells(&text, "duty_raw")[run].parse().unwrap();
    let said = replay(&with_cell(&text, run, "duty_raw", |_| (board + 1).to_string()));
    let expected = format!(
        "bowden: a.csv:{}: tick {tick}, t_s = {}: duty_raw is {} on the board and {board} computed again; the ",
        run + 2,
        cells(&text, "t_s")[run],
        board + 1
    );
    assert!(said.starts_with(&expected), "{said}\n{expected}");
    // One code of one input: what follows from it is found in that tick or soon after, never before.
    let said =
        replay(&with_cell(&text, run, "current_raw", |code| (code.parse::<i32>().unwrap() + 1).to_string()));
    let found: u64 = said.split("tick ").nth(1).unwrap().split(',').next().unwrap().parse().unwrap();
    assert!((tick..tick + 50).contains(&found), "{said}");
    // An order that is left out.
    let orders = cells(&text, "order");
    let home = (0..orders.len()).find(|row| orders[*row].contains("Home")).unwrap();
    let said = replay(&with_cell(&text, home, "order", |_| String::new()));
    assert!(said.contains("state is 4 on the board and 3 computed again"), "{said}");
}

#[test]
fn what_cannot_be_replayed_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    assert_eq!(record(folder, "a.csv", &["--reference", "hold", "--seconds", "0.05"]), (0, String::new()));
    let refused = |file: &str, expected: &str| {
        let (status, stdout, stderr) = bowden(folder, &["replay-control", file]);
        assert_eq!((status, stdout.as_str(), stderr.lines().count()), (2, "", 1), "{stderr}");
        assert!(stderr.starts_with(&format!("bowden: {expected}")), "{stderr}");
    };
    let metadata = fs::read_to_string(folder.join("a.recording.toml")).unwrap();
    let control = metadata.lines().find(|line| line.starts_with("control = ")).unwrap();
    // Another firmware.
    fs::write(folder.join("a.recording.toml"), metadata.replace(control, r#"control = "0123456789abcdef""#))
        .unwrap();
    refused(
        "a.csv",
        "a.csv: made by another firmware: its control law is 0123456789abcdef, that of this program ",
    );
    fs::write(folder.join("a.recording.toml"), metadata.replace(control, "")).unwrap();
    refused("a.csv", "a.csv: it does not say which control law made it; record with `bowden record --raw`");
    fs::write(folder.join("a.recording.toml"), &metadata).unwrap();
    // A row that is gone is a gap, and everything before it is checked all the same.
    let text = fs::read_to_string(folder.join("a.csv")).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let gap = lines.len() - 100;
    fs::write(folder.join("a.csv"), [&lines[..gap], &lines[gap + 1..]].concat().join("\n")).unwrap();
    let (status, stdout, stderr) = bowden(folder, &["replay-control", "a.csv"]);
    assert_eq!((status, stderr.lines().count()), (3, 1), "{stderr}");
    assert!(
        stderr.contains("ticks are missing behind tick ") && stdout.contains("every output is the board's"),
        "{stdout}{stderr}"
    );
    // A recording that is none of these.
    let plain = ["record", "--port", "sim", "--reference", "hold", "--seconds", "0.05", "--out", "b.csv"];
    assert_eq!(bowden(folder, &plain).0, 0);
    refused(
        "b.csv",
        "b.csv: no column `encoder_in_frame_raw`, without which nothing can be computed again; record with",
    );
    fs::write(folder.join("a.csv"), with_cell(&text, 30, "f1_raw", |_| "x".to_owned())).unwrap();
    let start = cells(&text, "order").iter().position(|order| order.contains("ResetControl")).unwrap();
    assert!(start > 0);
    fs::write(folder.join("a.csv"), with_cell(&text, start + 5, "f1_raw", |_| "x".to_owned())).unwrap();
    refused(
        "a.csv",
        &format!("a.csv:{}: column `f1_raw`: got `x`, expected a whole number; record again", start + 7),
    );
}
