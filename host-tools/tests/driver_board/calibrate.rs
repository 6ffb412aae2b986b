//! `bowden calibrate` with `--port sim`: answers from standard input, one a line.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::Stdio;

use crate::{bowden, command, result_of};

/// Zeros, and the four cells pulled and let go.
const FIRST: &str = "\n\n\n\n\n\n\n\n\n";

/// 2 kg on f1 and f3, both shafts turned and let go, tendons on, parameters, supply, parameters, store, signature.
const REST: &str = "f1\n2\n\n\nf3\n2\n\n\ndone\n\n\n\n\n\nyes\n\nyes\nyes\nAda Lovelace\n";

fn calibrate(folder: &Path, port: &str, answers: &str) -> (i32, String, String) {
    let mut child = command(folder, &["calibrate", "--port", port, "--out", "c.toml"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // A command that ended needs no more answers.
    let _ = child.stdin.take().unwrap().write_all(answers.as_bytes());
    result_of(&child.wait_with_output().unwrap())
}

#[test]
fn a_calibration_that_was_stopped_goes_on_and_finds_the_reversed_motor() {
    let folder = tempfile::tempdir().unwrap();
    let port = "sim:reversed=motor,mounted=300-3500";
    let (status, stdout, stderr) = calibrate(folder.path(), port, &format!("{FIRST}f1\nstop\n"));
    assert_eq!(status, 1, "{stdout}{stderr}");
    assert_eq!(
        stderr,
        "bowden: stopped by the user during gains, with a weight; the same command goes on behind what stands in c.toml\n"
    );
    // The simulated board was switched off meanwhile, and its tendons are on again.
    let (status, stdout, stderr) = calibrate(folder.path(), port, &format!("\n{REST}"));
    assert_eq!((status, stderr.as_str()), (0, ""), "{stdout}");
    assert!(
        stdout.starts_with("1 of 6: zeros of the tension channels and of the current: done before\n"),
        "{stdout}"
    );
    assert!(stdout.contains("  the joint turned the wrong way: the motor is reversed\n"), "{stdout}");
    assert!(stdout.contains("  encoder.joint.zero               2000 -> 3500 count\n"), "{stdout}");
    assert!(stdout.ends_with("c.toml: signed off\n"), "{stdout}");
    let text = fs::read_to_string(folder.path().join("c.toml")).unwrap();
    for expected in
        ["by = \"Ada Lovelace\"\nstored = true\n", "\"bridge.direction\" = -1.0\n", "name = \"simulated\"\n"]
    {
        assert!(text.contains(expected), "{expected}: {text}");
    }
    let (status, stdout, stderr) = calibrate(folder.path(), port, "");
    assert_eq!((status, stdout.as_str()), (2, ""));
    assert!(stderr.starts_with("bowden: c.toml: signed off by Ada Lovelace at 20"), "{stderr}");
}

#[test]
fn exchanged_cells_and_missing_answers_end_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let (status, _, stderr) = calibrate(folder.path(), "sim:swap=f2-f3", &format!("{FIRST}stop\n"));
    assert_eq!(status, 1);
    assert_eq!(
        stderr,
        "bowden: order of the tension channels: load cell f2 is plugged into input f3, load cell f3 is plugged into input f2; \
         correct the wires at the board; the same command goes on behind what stands in c.toml\n"
    );
    let (status, stdout, stderr) = calibrate(folder.path(), "sim", "\n");
    assert_eq!(status, 2, "{stdout}{stderr}");
    assert!(
        stderr.starts_with("bowden: standard input: no answer to `Within 20 s after Enter: pull at"),
        "{stderr}"
    );
    assert_eq!((stderr.lines().count(), stdout.contains("done before")), (1, true));
}

#[test]
fn arguments_that_cannot_be_are_refused_before_anything_is_asked() {
    let folder = tempfile::tempdir().unwrap();
    let calibrate =
        |port: &str, out: &str| bowden(folder.path(), &["calibrate", "--port", port, "--out", out]);
    fs::write(folder.path().join("rig.toml"), "schema = \"bowden-rig/1\"\n").unwrap();
    for (port, out, expected) in [
        ("sim", "none/c.toml", "bowden: none/c.toml: folder none does not exist; create it first\n"),
        (
            "sim:swap=f1",
            "c.toml",
            "bowden: sim:swap=f1: swap: got `f1`, expected two cells such as f1-f3, or encoders; ",
        ),
        ("sim", "rig.toml", "bowden: rig.toml:1: no calibration: missing field `board`; name another file\n"),
    ] {
        let (status, stdout, stderr) = calibrate(port, out);
        assert_eq!((status, stdout.as_str()), (2, ""), "{stderr}");
        assert!(stderr.starts_with(expected), "{stderr}");
    }
    let (status, stdout, stderr) =
        bowden(folder.path(), &["calibrate", "--port", "sim", "--out", "c.toml", "--dry-run"]);
    assert_eq!((status, stdout.lines().count(), stderr.as_str()), (0, 6, ""), "{stdout}");
    assert!(!folder.path().join("c.toml").exists());
}
