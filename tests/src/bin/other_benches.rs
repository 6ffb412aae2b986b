//! `cargo xtask prove --benches`: benches of other sizes, of which most hide an effect.
#![forbid(unsafe_code)]

use std::path::PathBuf;
use std::process::ExitCode;

use bowden_tests::other_benches::{ROUND, drawn, examine, table, write};
use bowden_tests::rounds::Rounds;
use clap::Parser;

/// Hide effects in benches of other sizes and proportions, nothing in some, and print what a diagnosis says
///
/// Every bench has a rig file of its own, from which the virtual bench is a few per cent off; recalibrated and diagnosed are losses over a
/// recording of another motion.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask prove --benches", after_help = "Exit status: 0 done, 1 failed, 2 bad usage.")]
struct Options {
    #[command(flatten)]
    rounds: Rounds,
    /// Keep the files of every bench in this folder, and diagnose nothing
    #[arg(long, value_name = "DIR")]
    files: Option<PathBuf>,
}

fn main() -> ExitCode {
    let options = Options::parse();
    let mut examined = Vec::new();
    for (seed, place) in options.rounds.cases(ROUND) {
        let done = drawn(seed, place).and_then(|case| match &options.files {
            Some(folder) => write(&case, &folder.join(seed.to_string())).map(|()| None),
            None => examine(case).map(Some),
        });
        match done {
            Ok(one) => examined.extend(one.map(|one| (seed, one))),
            Err(failure) => {
                eprintln!("other_benches: seed {seed}: {failure}");
                return ExitCode::FAILURE;
            }
        }
    }
    if options.files.is_none() {
        print!("{}", table(&examined));
    }
    ExitCode::SUCCESS
}
