//! `cargo xtask prove --studies`: three benches in one study, of which some hide an effect.
#![forbid(unsafe_code)]

use std::process::ExitCode;

use bowden_tests::rounds::Rounds;
use bowden_tests::studies::{ROUND, drawn, examine, table};
use clap::Parser;

/// Hide effects on one, two or all of the three benches of a study and print what a diagnosis says
///
/// The benches are simulated by the virtual bench and are a few per cent off their one rig file, each in its own way; recalibrated and diagnosed
/// are losses over held-out seconds.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask prove --studies", after_help = "Exit status: 0 done, 1 failed, 2 bad usage.")]
struct Options {
    #[command(flatten)]
    rounds: Rounds,
}

fn main() -> ExitCode {
    let Options { rounds } = Options::parse();
    rounds.run(ROUND, |number, place| examine(&drawn(number, place)?).map(Some), table)
}
