//! The host side of the driver board: client and session against a strict fake board, the commands over a pseudo
//! terminal, and the commands with the simulated board.
//!
//! No result depends on wall-clock time: see [`wires`] and [`pseudo_terminal`].

mod client;
mod fake;
mod from_rig;
mod mishaps;
mod ports;
mod pseudo_terminal;
mod ripple_table;
mod session;
mod simulated;
mod terminal;
mod wires;

use std::path::Path;
use std::process::{Command, Output};

/// Runs `bowden` in a folder: exit status, standard output, standard error.
fn bowden(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    result_of(&command(folder, arguments).output().unwrap())
}

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bowden"));
    // Progress is printed every ten seconds of real time, and only to a slow run.
    command.current_dir(folder).arg("--quiet").args(arguments);
    command
}

fn result_of(output: &Output) -> (i32, String, String) {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (output.status.code().expect("no signal"), text(&output.stdout), text(&output.stderr))
}
