//! The page about the first hour: every line of it that needs no hardware runs, in the order of the page.

mod common;
#[path = "common/first_hour.rs"]
mod page;

use std::path::Path;

use common::bowden;
use page::{PAGE, arguments, blocks, expected_status, losses, wrong};

/// Board in place of the one on USB.
const BOARD: &str = "sim:joint_spring:2,seed=3";

fn run(folder: &Path, line: &str) -> (i32, String, String) {
    let words = arguments(line, &[BOARD]);
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    bowden(folder, &words)
}

/// Tenths, as the page gives them.
fn rounded(loss: f64) -> i64 {
    (loss * 10.0).round() as i64
}

#[test]
fn every_line_of_the_first_hour_runs() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    let mut ran = 0;
    for line in blocks().concat() {
        let (status, stdout, stderr) = run(place, line);
        assert_eq!(status, expected_status(line, &stdout), "{line}\n{stdout}{stderr}");
        if line.starts_with("bowden doctor --port") {
            assert!(stdout.contains("ok     board: simulated, firmware "), "{stdout}");
        }
        if line.starts_with("bowden send") {
            assert_eq!(stdout, "state: ready\n");
        }
        if line.starts_with("bowden diagnose") {
            assert!(stdout.contains("lacks joint_spring: "), "{stdout}");
            assert_eq!(losses(&stdout).map(rounded), losses(PAGE).map(rounded), "{stdout}");
        }
        ran += 1;
    }
    assert_eq!(ran, 17);
    for file in ["bench.toml", "first.mcap", "rig.toml", "found/report.html", "whole.mcap", "first.parquet"] {
        assert!(place.join(file).exists(), "{file}");
    }
}

/// What [`expected_status`] lets pass is wrong with this machine, never with the board.
#[test]
fn a_board_that_is_wrong_is_told_from_a_machine_that_is() {
    let folder = tempfile::tempdir().unwrap();
    let (status, stdout, _) = bowden(folder.path(), &["doctor", "--port", "/no/such/port"]);
    let wrong = wrong(&stdout);
    assert!(status == 1 && wrong.contains(&"board"), "{stdout}");
    let line = "bowden doctor --port auto";
    assert!(std::panic::catch_unwind(|| expected_status(line, &stdout)).is_err());
    let probe = "ok     bowden: 0.1.0\nWRONG  probe: ST-LINK: this user may not open /dev/bus/usb/001/002\n";
    assert_eq!((expected_status(line, probe), expected_status("bowden info a.mcap", probe)), (1, 0));
}
