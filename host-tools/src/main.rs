//! The `bowden` command.
#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    bowden::cli::exit_on_panic();
    bowden::cli::run(std::env::args_os()).into()
}
