//! `cargo xtask prove --direct`: joints without tendons, diagnosed from torque and angle.
#![forbid(unsafe_code)]

use std::path::PathBuf;
use std::process::ExitCode;

use bowden_tests::direct_drives::{cases, examine, table, write};
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
    /// Only the joint of this number, 100 times the seed and its place in the round
    #[arg(long, value_name = "NUMBER")]
    only: Option<u64>,
    /// Keep the files of every joint in this folder, and diagnose nothing
    #[arg(long, value_name = "DIR")]
    files: Option<PathBuf>,
}

fn main() -> ExitCode {
    let options = Options::parse();
    let mut examined = Vec::new();
    for round in options.seed..options.seed.saturating_add(options.rounds) {
        for (number, hidden) in cases().iter().enumerate() {
            let seed = 100 * round + number as u64;
            if options.only.is_some_and(|only| only != seed) {
                continue;
            }
            if let Some(folder) = &options.files {
                let folder = folder.join(seed.to_string());
                if let Err(error) = write(seed, hidden, &folder) {
                    eprintln!("direct_drives: {}: {error}", folder.display());
                    return ExitCode::FAILURE;
                }
                println!("{}", folder.display());
                continue;
            }
            match examine(seed, hidden) {
                Ok(one) => examined.push((seed, one)),
                Err(failure) => {
                    eprintln!("direct_drives: seed {seed}: {failure}");
                    return ExitCode::FAILURE;
                }
            }
        }
    }
    if options.files.is_none() {
        print!("{}", table(&examined));
    }
    ExitCode::SUCCESS
}
