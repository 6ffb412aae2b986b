//! The `bowden` command.
#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    bowden::cli::run(std::env::args_os()).into()
}
