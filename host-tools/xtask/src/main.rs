//! `cargo xtask`: demonstration, tests and benchmarks of the workspace, one command each.
#![forbid(unsafe_code)]

mod bench;
mod demo;
mod process;
mod test;

use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};

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
    /// Run all tests
    Test,
    /// Run all benchmarks: speed of model and bench, and what the motion reconstruction gains
    Bench,
}

fn main() -> ExitCode {
    let done = match Cli::try_parse() {
        Ok(Cli { task: Task::Demo }) => demo::run(),
        Ok(Cli { task: Task::Test }) => test::run(),
        Ok(Cli { task: Task::Bench }) => bench::run(),
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
        "xtask: {}; the tasks are demo, test and bench, see `cargo xtask --help`",
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
