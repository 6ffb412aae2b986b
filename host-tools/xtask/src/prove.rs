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
    process::run(
        &mut benchmark(&options.options, &built("release", "prove")?, &built("release", "bowden")?)?,
        &[0],
    )
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
