//! `cargo xtask prove`: the concealed-effects benchmark of the diagnosis.

use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

use clap::Args;

use crate::process::{self, built, cargo, target_folder, workspace};

/// What is handed on to the benchmark.
#[derive(Debug, Args)]
#[command(disable_help_flag = true)]
pub struct Options {
    /// Options of the benchmark; --help lists them
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "OPTIONS")]
    options: Vec<OsString>,
}

/// Page that a complete run writes, below the workspace.
const PROOF: &str = "host-tools/docs/proof.md";

/// Builds the program and what proves it, and runs the latter.
///
/// # Errors
/// When something cannot be built, or the benchmark fails.
pub fn run(options: &Options) -> Result<(), String> {
    let programs = ["--package", "bowden", "--package", "bowden-tests", "--bin", "bowden", "--bin", "prove"];
    process::run(cargo(&["build", "--release"]).args(programs), &[0])?;
    let mut command = benchmark(&options.options, &built("release", "prove")?, &built("release", "bowden")?)?;
    let status = command.status().map_err(|error| process::unstarted(&command, &error))?;
    if status.success() {
        Ok(())
    } else {
        Err(format!("prove ended with {status}; what it says above tells why"))
    }
}

/// The benchmark with the places of this workspace; what the user gives comes later and wins.
fn benchmark(options: &[OsString], prove: &Path, bowden: &Path) -> Result<Command, String> {
    let mut command = Command::new(prove);
    command.arg("--bowden").arg(bowden);
    command.arg("--results").arg(target_folder()?.join("prove"));
    command.arg("--proof").arg(workspace().join(PROOF));
    command.args(options);
    Ok(command)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_user_gives_comes_after_the_places_of_the_workspace() {
        let given = ["--quick", "--proof", "elsewhere.md"].map(OsString::from);
        let command = benchmark(&given, Path::new("prove"), Path::new("the-binary")).unwrap();
        let arguments: Vec<_> = command.get_args().collect();
        assert_eq!(arguments[..2], ["--bowden", "the-binary"]);
        assert_eq!(arguments[arguments.len() - 3..], given.each_ref().map(OsString::as_os_str));
        assert!(arguments.iter().any(|argument| Path::new(argument).ends_with(PROOF)));
    }
}
