//! `cargo xtask prove --benches`: benches of other sizes, of which most hide something.
#![forbid(unsafe_code)]

use std::process::ExitCode;

use bowden_tests::other_benches::{Hides, ROUND, drawn, examine, table, write};
use bowden_tests::prove::recorded::Recorded;
use bowden_tests::rounds::{Kept, Rounds};
use clap::Parser;

/// Hide physics in benches of other sizes and proportions, nothing in some, and print what a diagnosis says
///
/// Every bench has a rig file of its own, from which the virtual bench is a few per cent off; recalibrated and diagnosed are losses over a
/// recording of another motion.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask prove --benches", after_help = "Exit status: 0 done, 1 failed, 2 bad usage.")]
struct Options {
    /// What nine of twelve benches hide
    #[arg(long, value_enum, default_value_t = Hides::Effect)]
    hide: Hides,
    /// What was recorded of the motion that is learned from
    #[arg(long, value_enum, default_value_t = Recorded::Everything)]
    recorded: Recorded,
    #[command(flatten)]
    rounds: Rounds,
    #[command(flatten)]
    kept: Kept,
}

fn main() -> ExitCode {
    let Options { hide, recorded, rounds, kept } = Options::parse();
    let one = |number, place| {
        let case = drawn(hide, number, place, recorded)?;
        match kept.folder(number) {
            Some(folder) => write(&case, recorded, &folder).map(|()| None),
            None => examine(case, recorded).map(Some),
        }
    };
    rounds.run(ROUND, one, table)
}
