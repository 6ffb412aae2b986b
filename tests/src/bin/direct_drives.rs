//! `cargo xtask prove --direct`: joints without tendons, diagnosed from torque and angle.
#![forbid(unsafe_code)]

use std::process::ExitCode;

use bowden_tests::direct_drives::{cases, examine, table};
use clap::Parser;

/// Hide effects in joints without tendons and print what a diagnosis says of each
///
/// The joints are simulated by equations of their own; strength is what the diagnosis found over the truth, and the last three columns are the
/// error of the angle in a free run over another motion, rad.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask prove --direct", after_help = "Exit status: 0 done, 1 failed, 2 bad usage.")]
struct Options {
    /// Seed of the first round
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Rounds of twelve joints, one seed each
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=100))]
    rounds: u64,
}

fn main() -> ExitCode {
    let options = Options::parse();
    let mut examined = Vec::new();
    for round in options.seed..options.seed.saturating_add(options.rounds) {
        for (number, hidden) in cases().iter().enumerate() {
            let seed = 100 * round + number as u64;
            match examine(seed, hidden) {
                Ok(one) => examined.push((seed, one)),
                Err(failure) => {
                    eprintln!("direct_drives: seed {seed}: {failure}");
                    return ExitCode::FAILURE;
                }
            }
        }
    }
    print!("{}", table(&examined));
    ExitCode::SUCCESS
}
