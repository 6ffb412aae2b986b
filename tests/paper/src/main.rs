//! `cargo xtask paper`: runs the paper's experiments, prints their tables beside its claims, and writes the page.
#![forbid(unsafe_code)]

use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;

use bowden_paper::error::ExperimentError;
use bowden_paper::page::{self, Section};
use bowden_paper::{beyond, efficiency, lubrication_and_radius, torque_phases};
use clap::Parser;

/// Run the experiments of Wu et al., Sensors 2020, 20(5), 1301, on the virtual bench under the firmware's control
#[derive(Debug, Parser)]
#[command(name = "cargo xtask paper", args_override_self = true)]
#[command(after_help = "Exit status: 0 done, 1 failed, 2 bad usage.")]
struct Options {
    /// Page to write; its figures go to the folder beside it that has its name. Without it, tables are printed only
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
    /// Date and commit that the page names
    #[arg(long, value_name = "TEXT", default_value = "date and commit not given")]
    provenance: String,
    /// Instead, track with the controller that follows the friction of the sheaths, over this many of their motions, and in
    /// position mode; the page goes beside the other as tracking.md. `position`: the sections on position mode alone
    #[arg(long, value_name = "SEEDS|position", num_args = 0..=1, default_missing_value = "50")]
    beyond: Option<Beyond>,
}

/// Which part of the page is written.
#[derive(Clone, Copy, Debug)]
enum Beyond {
    /// All of it, torque with so many seeds.
    Seeds(u64),
    /// The sections on position mode.
    Position,
}

impl FromStr for Beyond {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        if text == "position" {
            return Ok(Self::Position);
        }
        text.parse().map(Self::Seeds).map_err(|_| "expected a number of seeds, or position".to_owned())
    }
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) => {
            eprintln!("paper: {reason}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<(), String> {
    let told = |error: ExperimentError| error.to_string();
    if let Some(part) = options.beyond {
        let path = options.page.as_ref().map(|page| page.with_file_name("tracking.md"));
        if let Beyond::Seeds(seeds) = part {
            let table = beyond::table(seeds).map_err(told)?;
            println!("{table}");
            if let Some(path) = &path {
                page::write_tracking(&table, &options.provenance, path)?;
            }
        }
        let sections = page::position::sections(&options.provenance).map_err(told)?;
        println!("{sections}");
        if let Some(path) = &path {
            page::position::replace(&sections, path)?;
            println!("{}", path.display());
        }
        return Ok(());
    }
    let mut sections = Vec::new();
    let mut add = |section: Section| {
        println!("{}\n\n{}", section.heading, section.table());
        sections.push(section);
    };
    add(page::segments::section(&torque_phases::torque_loop().map_err(told)?)?);
    add(page::gaps::section(&lubrication_and_radius::all().map_err(told)?)?);
    let panels: Result<Vec<_>, _> = efficiency::panels()
        .into_iter()
        .map(|panel| efficiency::run_panel(&panel).map(|runs| (panel, runs)))
        .collect();
    add(page::lift::section(&panels.map_err(told)?)?);
    add(page::tracking::section()?);
    if let Some(path) = &options.page {
        page::write(&sections, &options.provenance, path)?;
        println!("{}", path.display());
    }
    Ok(())
}
