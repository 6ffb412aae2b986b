//! The command line: exit status and one clear line.

mod common;

use std::process::Output;

use assert_cmd::Command;

fn run(args: &[&str]) -> Output {
    Command::cargo_bin("bowden-board").expect("built").args(args).output().expect("starts")
}

fn one_line(output: &Output, status: i32, part: &str) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "{text}");
    assert!(text.lines().count() == 1 && text.starts_with("error") && text.contains(part), "{text}");
}

#[test]
fn bad_usage_is_two() {
    one_line(&run(&[]), 2, "a command is missing");
    one_line(&run(&["run"]), 2, "error");
    one_line(&run(&["run", "absent.elf"]), 2, "absent.elf");
    one_line(&run(&["run", "Cargo.toml", "--seconds", "1"]), 2, "cannot use the image");
    one_line(&run(&["run", "Cargo.toml", "--seconds", "-1"]), 2, "--seconds");
    one_line(&run(&["run", "Cargo.toml", "--effect", "no_such_effect"]), 2, "no_such_effect");
}

#[test]
fn a_program_runs_and_its_failure_is_one() {
    let folder = std::env::temp_dir().join(format!("bowden-board-cli-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("temporary folder");
    let path = |name: &str| folder.join(name).display().to_string();
    // b .
    std::fs::write(path("idle.elf"), common::elf(&[0xe7fe], &[], &[])).expect("written");
    let link = path("port");
    let output = run(&["run", &path("idle.elf"), "--seconds", "0.01", "--speed", "max", "--pty", &link]);
    assert_eq!(output.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&output.stdout).starts_with("pty /dev/"), "names its terminal");
    assert!(std::fs::symlink_metadata(&link).is_err(), "the link is gone with the process");
    // udf #0
    std::fs::write(path("faulty.elf"), common::elf(&[0xde00], &[], &[])).expect("written");
    one_line(&run(&["run", &path("faulty.elf"), "--seconds", "1"]), 1, "undefined instruction");
    std::fs::remove_dir_all(&folder).expect("removed");
}
