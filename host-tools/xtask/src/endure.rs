//! `cargo xtask endure`: a day of board time natively, ten minutes of the release image on the emulated board.

use std::ffi::OsString;

use clap::Args;

use crate::bench;
use crate::process::workspace;
use crate::prove::provenance;

/// What is handed on to the runs.
#[derive(Debug, Args)]
#[command(disable_help_flag = true)]
pub struct Options {
    /// Options of the runs; --help lists them
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "OPTIONS")]
    handed_on: Vec<OsString>,
}

/// Page that the runs write, below the workspace.
const PAGE: &str = "tests/docs/endurance.md";

/// Builds the image and what runs it, and runs the latter.
///
/// # Errors
/// When something cannot be built, or a check does not hold.
pub fn run(options: &Options) -> Result<(), String> {
    bench::on_board("on-board-endurance", &arguments(options))
}

/// The runs with the places of this workspace; what the user gives comes later and wins.
fn arguments(options: &Options) -> Vec<OsString> {
    let mut arguments = vec!["--page".into(), workspace().join(PAGE).into_os_string()];
    arguments.extend(["--provenance".into(), provenance().into()]);
    arguments.extend(options.handed_on.iter().cloned());
    arguments
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn what_the_user_gives_comes_after_the_page_of_the_workspace() {
        let handed_on = ["--native-hours", "2", "--page", "elsewhere.md"].map(OsString::from).to_vec();
        let arguments = arguments(&Options { handed_on: handed_on.clone() });
        assert!(Path::new(&arguments[1]).ends_with(PAGE), "{arguments:?}");
        assert_eq!(arguments[arguments.len() - 4..], handed_on);
    }
}
