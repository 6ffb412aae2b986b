//! Scores the simulation on recordings of real benches, held out by recording, and diagnoses them.
//!
//! `cargo run --release -p bowden-real-data -- [DATA_DIR] [--only FOLDER]... [--page FILE]`, or
//! `cargo xtask prove --real`: `DATA_DIR` holds one folder a data set; without it the variable `BOWDEN_DATA` names it, or
//! it is `shared/data` beside the workspace. `--page` puts what a complete run prints into a page, between its two
//! marker lines. Exit status: 0 all marks met, 1 a mark missed, 2 data missing or unusable.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use bowden_core::outcome::Failure;
use bowden_real_data::page::with_printed;
use bowden_real_data::{Mark, band_damper, cable_tool, cogging_motor, direct_drive, servo_pendulum};
use clap::Parser;

/// Score the simulation on recordings of real benches, held out by recording, and diagnose them
#[derive(Debug, Parser)]
struct Options {
    /// Folder of the data sets
    data: Option<PathBuf>,
    /// Only this data set; may be repeated, and the page stays as it is
    #[arg(long, value_name = "FOLDER")]
    only: Vec<String>,
    /// Page that a complete run updates
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
    /// Last words of the printed part: date, commit
    #[arg(long, value_name = "WORDS")]
    provenance: Option<String>,
}

/// Writes what is found on a data set and returns its marks.
type Report = fn(&Path, &mut dyn FnMut(String)) -> Result<Vec<Mark>, Failure>;

/// Folders of the data sets and what scores them.
const SETS: [(&str, Report); 5] = [
    (servo_pendulum::FOLDER, |data, print| servo_pendulum::report(data, print)),
    (cable_tool::FOLDER, |data, print| cable_tool::report(data, print)),
    (cogging_motor::FOLDER, |data, print| cogging_motor::report(data, print)),
    (direct_drive::FOLDER, |data, print| direct_drive::report(data, print)),
    (band_damper::FOLDER, |data, print| band_damper::report(data, print)),
];

fn main() -> ExitCode {
    let options = Options::parse();
    let beside = || [env!("CARGO_MANIFEST_DIR"), "..", "..", "..", "shared", "data"].iter().collect();
    let named = options.data.clone().or_else(|| std::env::var_os("BOWDEN_DATA").map(PathBuf::from));
    let data = named.unwrap_or_else(beside);
    if let Some(other) = options.only.iter().find(|only| SETS.iter().all(|(folder, _)| folder != only)) {
        let folders = SETS.map(|(folder, _)| folder).join(", ");
        eprintln!("error: --only {other}: no such data set, expected one of {folders}");
        return ExitCode::from(2);
    }
    let started = Instant::now();
    let mut printed = String::new();
    let mut print = |text: String| {
        println!("{text}");
        printed += &text;
        printed.push('\n');
    };
    let (mut marks, mut unusable) = (Vec::new(), false);
    for (folder, report) in SETS {
        if !options.only.is_empty() && options.only.iter().all(|only| only != folder) {
            continue;
        }
        match report(&data, &mut print) {
            Ok(found) => marks.extend(found),
            Err(failure) => {
                eprintln!("error: {failure}");
                unusable = true;
            }
        }
    }
    for mark in &marks {
        print(mark.to_string());
    }
    let seconds = format!("{:.0} s", started.elapsed().as_secs_f64());
    print(format!(
        "\n{}",
        options.provenance.iter().cloned().chain([seconds]).collect::<Vec<_>>().join(", ")
    ));
    if unusable {
        return ExitCode::from(2);
    }
    if let Some(page) = options.page.as_deref().filter(|_| options.only.is_empty())
        && let Err(reason) = put_into(page, &printed)
    {
        eprintln!("error: {}: {reason}", page.display());
        return ExitCode::from(2);
    }
    if marks.iter().all(Mark::met) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Replaces the printed part of a page.
fn put_into(page: &Path, printed: &str) -> Result<(), String> {
    let text = fs::read_to_string(page).map_err(|error| error.to_string())?;
    fs::write(page, with_printed(&text, printed)?).map_err(|error| error.to_string())
}
