//! `cargo xtask`: demonstration, images, lints, tests, benchmarks and the paper's experiments, one command each.
#![forbid(unsafe_code)]

mod bench;
mod board_page;
mod browser;
mod clippy;
mod core_from_source;
mod cross_target;
mod debian;
mod demo;
mod files;
mod firmware;
mod fuzz;
mod image_size;
mod linted;
mod memory_map;
mod paper;
mod parts;
mod peers;
mod process;
mod prove;
mod python;
mod selection;
mod system_packages;
mod tally;
mod test;
mod toolchain;

use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};

use parts::Parts;

/// What is done with this workspace
#[derive(Debug, Parser)]
#[command(name = "cargo xtask", subcommand_required = true, arg_required_else_help = false)]
struct Cli {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// Record a simulated bench that conceals a fault and let `bowden diagnose` find it
    Demo,
    /// Lint what is built for the host, and run all tests, those of the board's images on the emulated board among them
    Test(test::Options),
    /// Run all benchmarks: speed of model and bench, gain of the motion reconstruction, cost on the board
    Bench(bench::Options),
    /// Hide effects in simulated rigs and count how often `bowden diagnose` finds them; `prove --help` lists options
    Prove(prove::Options),
    /// Run the experiments of the paper on the virtual bench and write host-tools/docs/paper.md; `paper --help` lists options
    Paper(paper::Options),
    /// Run the fuzz targets under libFuzzer; `fuzz --help` lists options
    Fuzz(fuzz::Options),
    /// Break one or two things at a time on the emulated board, judge what the release image makes of it, and write
    /// tests/docs/faults.md; `faults --help` lists options
    Faults(board_page::Options),
    /// Drive the joint for a day natively and for ten minutes on the emulated board, check that nothing drifts, grows or gets lost, and
    /// write tests/docs/endurance.md; `endure --help` lists options
    Endure(board_page::Options),
    /// Build the release images for the driver board and print what they take of its memory
    Firmware,
    /// Run clippy on everything, the board's images among it; warnings are errors. What `test` compiles is linted there too
    Clippy(Parts),
}

fn main() -> ExitCode {
    let done = match Cli::try_parse() {
        Ok(Cli { task: Task::Demo }) => demo::run(),
        Ok(Cli { task: Task::Test(options) }) => test::run(options),
        Ok(Cli { task: Task::Bench(options) }) => bench::run(&options),
        Ok(Cli { task: Task::Prove(options) }) => prove::run(&options),
        Ok(Cli { task: Task::Paper(options) }) => paper::run(&options),
        Ok(Cli { task: Task::Fuzz(options) }) => fuzz::run(&options),
        Ok(Cli { task: Task::Faults(options) }) => board_page::FAULTS.run(&options),
        Ok(Cli { task: Task::Endure(options) }) => board_page::ENDURE.run(&options),
        Ok(Cli { task: Task::Firmware }) => firmware::run(),
        Ok(Cli { task: Task::Clippy(parts) }) => clippy::run(parts),
        Err(error) => return usage(&error),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) => {
            eprintln!("xtask: {reason}");
            ExitCode::FAILURE
        }
    }
}

/// Help is a result; anything else is bad usage, in one line.
fn usage(error: &clap::Error) -> ExitCode {
    if error.kind() == ErrorKind::DisplayHelp {
        // A reader that left early is no failure.
        let _ = error.print();
        return ExitCode::SUCCESS;
    }
    let text = error.render().to_string();
    let what: Vec<&str> = text
        .lines()
        .map(str::trim)
        .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"))
        .filter(|line| !line.is_empty() && !line.starts_with('['))
        .collect();
    let what = what.join(" ");
    eprintln!(
        "xtask: {}; the tasks are demo, test, bench, prove, paper, fuzz, faults, endure, firmware and clippy, see `cargo xtask --help`",
        what.strip_prefix("error: ").unwrap_or(&what)
    );
    ExitCode::from(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }
}
