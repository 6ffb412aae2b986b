//! `cargo xtask prove --direct`: joints without tendons, diagnosed from torque and angle.
#![forbid(unsafe_code)]

use std::process::ExitCode;

use bowden_core::outcome::Failure;
use bowden_tests::direct_drives::{cases, examine, table, write};
use bowden_tests::rounds::{Kept, Rounds};
use clap::Parser;

/// Hide effects in joints without tendons and print what a diagnosis says of each
///
/// The joints are simulated by equations of their own; strength is what the diagnosis found over the truth, and the last three columns are the
/// error of the angle in a free run over another motion, rad.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask prove --direct", after_help = "Exit status: 0 done, 1 failed, 2 bad usage.")]
struct Options {
    #[command(flatten)]
    rounds: Rounds,
    #[command(flatten)]
    kept: Kept,
}

fn main() -> ExitCode {
    let Options { rounds, kept } = Options::parse();
    let cases = cases();
    let one = |number, place: usize| match kept.folder(number) {
        Some(folder) => write(number, &cases[place], &folder)
            .map(|()| None)
            .map_err(|error| Failure::failed(format!("{}: {error}", folder.display()))),
        None => examine(number, &cases[place]).map(Some),
    };
    rounds.run(cases.len(), one, table)
}
