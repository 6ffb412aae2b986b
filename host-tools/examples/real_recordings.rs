//! Scores the simulation on recordings of real benches, held out by recording.
//!
//! `cargo run --release -p bowden --example real_recordings -- [DATA_DIR]`: `DATA_DIR` holds the folders
//! `davinci-cable-tool` and `bam-xl330-pendulum`; without it the variable `BOWDEN_DATA` names it, or it is
//! `shared/data` beside the workspace. Exit status: 0 all marks met, 1 a mark missed, 2 data missing or unusable.

use std::path::PathBuf;
use std::process::ExitCode;

use bowden::marks::{cable_tool, servo_pendulum};

fn main() -> ExitCode {
    let beside = || [env!("CARGO_MANIFEST_DIR"), "..", "..", "shared", "data"].iter().collect();
    let named = std::env::args_os().nth(1).or_else(|| std::env::var_os("BOWDEN_DATA"));
    let data = named.map_or_else(beside, PathBuf::from);
    let print = |text: String| println!("{text}");
    let mut marks = Vec::new();
    for report in [servo_pendulum::report(&data, print), cable_tool::report(&data, print)] {
        match report {
            Ok(found) => marks.extend(found),
            Err(failure) => {
                eprintln!("error: {failure}");
                return ExitCode::from(2);
            }
        }
    }
    for mark in &marks {
        println!("{mark}");
    }
    if marks.iter().all(bowden::marks::Mark::met) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
