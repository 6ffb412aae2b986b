//! Ports that are no board: one line says what is wrong and what to do, exit status 2.

use std::time::Duration;

use bowden_link::ToBoard;

use crate::bowden;
use crate::fake::Fake;
use crate::mishaps::Mishaps;
use crate::pseudo_terminal::Terminal;

fn assert_refused(arguments: &[&str], expected: &str) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("notes.txt"), "no port").unwrap();
    let (status, stdout, stderr) = bowden(folder.path(), arguments);
    assert_eq!(stderr, format!("bowden: {expected}\n"), "{arguments:?}");
    assert_eq!((status, stdout.as_str()), (2, ""), "{arguments:?}");
}

#[test]
fn what_is_no_port_is_named() {
    assert_refused(
        &["send", "--port", "/dev/ttyACM99", "status"],
        "/dev/ttyACM99: there is no such port; check the cable, or use --port auto",
    );
    assert_refused(
        &["faults", "--port", "notes.txt"],
        "notes.txt: this is no serial port; name one such as /dev/ttyACM0, or auto, or sim",
    );
}

#[test]
fn no_board_on_usb_is_told_with_what_was_sought() {
    let folder = tempfile::tempdir().unwrap();
    let (status, _, stderr) = bowden(folder.path(), &["params", "--port", "auto"]);
    assert_eq!(status, 2);
    assert!(stderr.starts_with("bowden: auto: no USB device 1209:b0d7 found ("), "{stderr}");
    assert!(stderr.ends_with("); check the cable, or name the port\n"), "{stderr}");
}

#[test]
fn a_port_that_another_program_has_open_is_told() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let port = terminal.port();
    let _other = serialport::new(port, 115_200).timeout(Duration::from_secs(1)).open().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let (status, _, stderr) = bowden(folder.path(), &["send", "--port", port, "status"]);
    assert_eq!(status, 2);
    // This test is the other program.
    let holder = format!("(process {}) has the port open; close that one first\n", std::process::id());
    assert!(
        stderr.starts_with(&format!("bowden: {port}: `driver_board")) && stderr.ends_with(&holder),
        "{stderr}"
    );
}

#[test]
fn a_port_without_a_board_behind_it_is_given_up() {
    let terminal = Terminal::new(Fake::new(Mishaps { silent: true, ..Mishaps::default() }));
    let port = terminal.port();
    let expected = format!(
        "{port}: no greeting within 0.3 s, expected a bowden driver board; check the port and the board's supply, or reset \
         the board"
    );
    assert_refused(&["send", "--port", port, "--timeout", "0.3", "ready"], &expected);
}

#[test]
fn a_board_of_another_version_is_not_talked_to() {
    let terminal = Terminal::new(Fake::new(Mishaps { protocol_version: Some(7), ..Mishaps::default() }));
    let port = terminal.port();
    let expected = format!(
        "bowden: {port}: firmware 9.8.7 speaks protocol version 7, expected 2; use the bowden that belongs to this firmware\n"
    );
    let folder = tempfile::tempdir().unwrap();
    let refused = terminal.bowden(folder.path(), "record", &["--out", "a.csv", "--seconds", "1"]);
    assert_eq!(refused, (2, String::new(), expected));
    assert!(terminal.fake().carried_out.iter().all(|message| *message == ToBoard::Hello));
}

/// Grade, finding and advice of `bowden doctor` about a board, and whether the board is why the exit status is 1.
fn doctor(mishaps: Mishaps) -> [String; 3] {
    let terminal = Terminal::new(Fake::new(mishaps));
    let folder = tempfile::tempdir().unwrap();
    let (status, stdout, stderr) = terminal.bowden(folder.path(), "doctor", &["--json"]);
    let checks: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    let checks = checks.as_array().unwrap();
    let wrong = |check: &&serde_json::Value| check["grade"] == "wrong";
    assert_eq!(status, i32::from(checks.iter().any(|check| wrong(&check))), "{stderr}");
    let board = checks.iter().find(|check| check["subject"] == "board").unwrap();
    if wrong(&board) {
        assert!(stderr.contains("board"), "{stderr}");
    }
    ["grade", "found", "next"].map(|key| board[key].as_str().unwrap().replace(terminal.port(), "PORT"))
}

#[test]
fn doctor_says_whether_firmware_and_program_fit() {
    let [grade, found, next] = doctor(Mishaps::default());
    let expected = format!(
        "fake, firmware 9.8.7 0123456789ab, this program {}: they speak the same protocol",
        env!("CARGO_PKG_VERSION")
    );
    assert_eq!((grade.as_str(), found), ("hint", expected));
    assert_eq!(next, "flash the firmware of this version to have what its change log says");
    // Another protocol, and another layout of its messages under the same number.
    let [grade, found, _] = doctor(Mishaps { protocol_version: Some(7), ..Mishaps::default() });
    let expected = "PORT: firmware 9.8.7 speaks protocol version 7, expected 2; use the bowden that belongs to this firmware";
    assert_eq!((grade.as_str(), found.as_str()), ("wrong", expected));
    let [grade, found, _] = doctor(Mishaps { schema: Some([7; 8]), ..Mishaps::default() });
    assert!(grade == "wrong" && found.starts_with("PORT: firmware 9.8.7 "), "{grade} {found}");
}

#[test]
fn doctor_and_store_warn_of_parameters_that_hide_an_open_lead() {
    let terminal = Terminal::new(Fake::new(Mishaps::default()));
    let folder = tempfile::tempdir().unwrap();
    let hints = || {
        let (status, stdout, _) = terminal.bowden(folder.path(), "doctor", &["--json"]);
        let checks: Vec<serde_json::Value> = serde_json::from_str(&stdout).unwrap();
        let hints = checks.into_iter().filter(|check| check["subject"] == "parameters");
        (status, hints.collect::<Vec<_>>())
    };
    let (before, none) = hints();
    assert_eq!(none, [serde_json::Value::Null; 0]);
    let (status, _, stderr) = terminal.bowden(folder.path(), "params", &["set", "motor.resistance=1"]);
    assert!(status == 0 && stderr.starts_with("bowden: warning: an open motor lead"), "{stderr}");
    let (status, _, stored) = terminal.bowden(folder.path(), "params", &["store"]);
    assert_eq!((status, stored), (0, stderr));
    let (status, hints) = hints();
    let [hint] = hints.as_slice() else { panic!("{hints:?}") };
    assert_eq!((status, hint["grade"].as_str()), (before, Some("hint")));
    assert!(hint["found"].as_str().unwrap().starts_with("an open motor lead can go unnoticed"), "{hint}");
    assert!(hint["next"].as_str().unwrap().starts_with("raise limits.current"), "{hint}");
}

#[test]
fn what_cannot_be_done_is_told_before_the_port_is_opened() {
    let record = |arguments: &[&'static str]| -> Vec<&'static str> {
        [&["record", "--port", "/dev/ttyACM99"], arguments].concat()
    };
    assert_refused(
        &record(&["--out", "a.txt"]),
        "a.txt: unknown format; end the name in .csv, .csv.gz, .mcap or .parquet",
    );
    assert_refused(
        &record(&["--out", "a.csv", "--reference", "sinus"]),
        "--reference sinus: neither a file nor one of hold, sine, triangle, multisine, staircase; correct it",
    );
    assert_refused(
        &record(&["--out", "a.csv", "--rig", "a.parameters.toml"]),
        "--rig a.parameters.toml: another output has this name; choose another",
    );
    assert_refused(
        &record(&["--out", "a.csv", "--amplitude", "inf"]),
        "--amplitude inf: expected a finite number; give one",
    );
    assert_refused(
        &record(&["--out", "a.csv", "--rig", "r.toml", "--load", "2.5"]),
        "invalid value '2.5' for '--load <KG,M>': expected KG,M such as 2.5,0.03; see `bowden record --help`",
    );
    assert_refused(
        &["faults", "--port", "/dev/ttyACM99", "--snapshot", "nowhere/s.csv"],
        "nowhere/s.csv: folder nowhere does not exist; create it first",
    );
}

#[test]
fn a_reference_file_without_its_column_is_told_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("r.csv"), "t_s,theta_ref_rad,torque_ref_nm\n0,0,0\n1,0,much\n")
        .unwrap();
    std::fs::write(folder.path().join("q.csv"), "t_s,f1_n\n0,0\n1,0\n").unwrap();
    for (file, mode, expected) in [
        (
            "r.csv",
            "torque",
            "r.csv:3: column `torque_ref_nm`: got `much`, expected a finite number; correct it",
        ),
        (
            "q.csv",
            "torque",
            "q.csv: no column `torque_ref_nm`, which this mode follows; name the reference so",
        ),
        (
            "q.csv",
            "position",
            "q.csv: no column `theta_ref_rad`, which this mode follows; name the reference so",
        ),
    ] {
        let arguments = ["--out", "a.csv", "--mode", mode, "--reference", file];
        let (status, _, stderr) =
            bowden(folder.path(), &[&["record", "--port", "sim"], arguments.as_slice()].concat());
        assert_eq!((status, stderr), (2, format!("bowden: {expected}\n")));
    }
}
