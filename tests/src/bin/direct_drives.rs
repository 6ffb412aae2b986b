//! `cargo xtask prove --direct`: joints without tendons, diagnosed from torque and angle.
#![forbid(unsafe_code)]

use std::path::PathBuf;
use std::process::ExitCode;

use bowden_tests::direct_drives::{cases, examine, table, write};
use bowden_tests::rounds::Rounds;
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
    /// Keep the files of every joint in this folder, and diagnose nothing
    #[arg(long, value_name = "DIR")]
    files: Option<PathBuf>,
}

fn main() -> ExitCode {
    let options = Options::parse();
    let mut examined = Vec::new();
    let cases = cases();
    for (seed, place) in options.rounds.cases(cases.len()) {
        let hidden = &cases[place];
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
    if options.files.is_none() {
        print!("{}", table(&examined));
    }
    ExitCode::SUCCESS
}
