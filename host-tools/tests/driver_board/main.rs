//! The host side of the driver board: client and session against a strict fake board, the commands over a pseudo
//! terminal, and the commands with the simulated board.

mod client;
mod fake;
mod ports;
mod session;
mod simulated;
mod terminal;
mod wires;

use std::path::Path;
use std::process::{Command, Output};

/// Runs `bowden` in a folder: exit status, standard output, standard error.
fn bowden(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    told(&command(folder, arguments).output().unwrap())
}

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bowden"));
    command.current_dir(folder).args(arguments);
    command
}

fn told(output: &Output) -> (i32, String, String) {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (output.status.code().expect("no signal"), text(&output.stdout), text(&output.stderr))
}
