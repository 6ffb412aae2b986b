//! Runs the program as its users do.

use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Runs `bowden` in a folder, without a terminal: exit status, standard output, standard error.
pub fn bowden(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    result_of(&command(folder, arguments).output().unwrap())
}

/// `bowden` in a folder, to be started; standard input is empty.
pub fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bowden"));
    // Progress is printed every ten seconds of real time, and only to a slow run.
    command.current_dir(folder).arg("--quiet").args(arguments).stdin(Stdio::null());
    command
}

/// Exit status, standard output, standard error.
pub fn result_of(output: &Output) -> (i32, String, String) {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (output.status.code().expect("no signal"), text(&output.stdout), text(&output.stderr))
}
