//! `cargo xtask paper`: the experiments of the paper on the virtual bench, and their page.

use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

use clap::Args;

use crate::bench;
use crate::process::{self, built, cargo, workspace};
use crate::prove::provenance;

/// What is handed on to the experiments.
#[derive(Debug, Args)]
#[command(disable_help_flag = true)]
pub struct Options {
    /// Instead, run one experiment of each kind with the release image on the emulated board too, and print the figures of
    /// both sides; comes first
    #[arg(long)]
    board: bool,
    /// Options of the experiments; --help lists them
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "OPTIONS")]
    handed_on: Vec<OsString>,
}

/// Page that a run writes, below the workspace.
const PAGE: &str = "host-tools/docs/paper.md";

/// Builds what runs the experiments, and runs it.
///
/// # Errors
/// When it cannot be built, or an experiment fails.
pub fn run(options: &Options) -> Result<(), String> {
    if options.board {
        return bench::on_board("on-board-paper", &[]);
    }
    if options.handed_on.iter().any(|option| option == "--board") {
        return Err("--board comes first: `cargo xtask paper --board`".to_owned());
    }
    process::run(&mut cargo(&["build", "--release", "--package", "bowden-paper", "--bin", "paper"]), &[0])?;
    let mut command = experiments(&options.handed_on, &built("release", "paper")?);
    process::run(&mut command, &[0])
}

/// The experiments with the places of this workspace; what the user gives comes later and wins.
fn experiments(options: &[OsString], program: &Path) -> Command {
    let mut command = Command::new(program);
    command.arg("--page").arg(workspace().join(PAGE));
    command.arg("--provenance").arg(provenance());
    command.args(options);
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_board_is_refused_in_one_line() {
        let options = Options { board: false, handed_on: vec!["--beyond".into(), "--board".into()] };
        assert!(run(&options).unwrap_err().starts_with("--board comes first"));
    }

    #[test]
    fn what_the_user_gives_comes_after_the_page_of_the_workspace() {
        let command = experiments(&["--page", "elsewhere.md"].map(OsString::from), Path::new("the-binary"));
        let arguments: Vec<_> = command.get_args().collect();
        assert!(Path::new(arguments[1]).ends_with(PAGE), "{arguments:?}");
        assert_eq!(arguments[arguments.len() - 2..], ["--page", "elsewhere.md"]);
    }
}
