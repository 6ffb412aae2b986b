//! `cargo xtask faults`: a campaign of faults against the release image on the emulated board.

use std::ffi::OsString;

use clap::Args;

use crate::bench;
use crate::process::workspace;
use crate::prove::provenance;

/// What is handed on to the campaign.
#[derive(Debug, Args)]
#[command(disable_help_flag = true)]
pub struct Options {
    /// Options of the campaign; --help lists them
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "OPTIONS")]
    handed_on: Vec<OsString>,
}

/// Page that a campaign writes, below the workspace.
const PAGE: &str = "tests/docs/faults.md";

/// Builds the image and what breaks it, and runs the latter.
///
/// # Errors
/// When something cannot be built, or a case cannot be run.
pub fn run(options: &Options) -> Result<(), String> {
    bench::on_board("on-board-faults", &arguments(options))
}

/// The campaign with the places of this workspace; what the user gives comes later and wins.
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
        let handed_on = ["--cases", "20", "--page", "elsewhere.md"].map(OsString::from).to_vec();
        let arguments = arguments(&Options { handed_on: handed_on.clone() });
        assert!(Path::new(&arguments[1]).ends_with(PAGE), "{arguments:?}");
        assert_eq!(arguments[arguments.len() - 4..], handed_on);
    }
}
