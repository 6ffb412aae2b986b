//! `cargo xtask prove --studies`: three benches in one study, of which some hide an effect.
#![forbid(unsafe_code)]

use std::process::ExitCode;

use bowden_tests::studies::{ROUND, drawn, examine, table};
use clap::Parser;

/// Hide effects on one, two or all of the three benches of a study and print what a diagnosis says
///
/// The benches are simulated by the virtual bench and are a few per cent off their one rig file, each in its own way; recalibrated and diagnosed
/// are losses over held-out seconds.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask prove --studies", after_help = "Exit status: 0 done, 1 failed, 2 bad usage.")]
struct Options {
    /// Seed of the first round
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Rounds of twelve studies, one seed each
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=100))]
    rounds: u64,
    /// Only the study of this number, 100 times the seed and its place in the round
    #[arg(long, value_name = "NUMBER")]
    only: Option<u64>,
}

fn main() -> ExitCode {
    let options = Options::parse();
    let mut examined = Vec::new();
    for round in options.seed..options.seed.saturating_add(options.rounds) {
        for number in 0..ROUND {
            let seed = 100 * round + number as u64;
            if options.only.is_some_and(|only| only != seed) {
                continue;
            }
            let one = drawn(round, number).map_err(|error| error.to_string());
            match one.and_then(|one| examine(&one).map_err(|failure| failure.to_string())) {
                Ok(one) => examined.push((seed, one)),
                Err(failure) => {
                    eprintln!("studies: seed {seed}: {failure}");
                    return ExitCode::FAILURE;
                }
            }
        }
    }
    print!("{}", table(&examined));
    ExitCode::SUCCESS
}
