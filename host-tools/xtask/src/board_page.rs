//! `cargo xtask faults` and `endure`: programs that run the release image on the emulated board and write a page of it.

use std::ffi::OsString;

use clap::Args;

use crate::bench;
use crate::process::workspace;
use crate::prove::provenance;

/// What is handed on to the program.
#[derive(Debug, Args)]
#[command(disable_help_flag = true)]
pub struct Options {
    /// Options of the program; --help lists them
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "OPTIONS")]
    handed_on: Vec<OsString>,
}

/// A program and its page, below the workspace.
#[derive(Debug, Clone, Copy)]
pub struct BoardPage {
    program: &'static str,
    page: &'static str,
}

/// A campaign of faults.
pub const FAULTS: BoardPage = BoardPage { program: "on-board-faults", page: "tests/docs/faults.md" };
/// A day of board time natively, ten minutes of the release image on the emulated board.
pub const ENDURE: BoardPage = BoardPage { program: "on-board-endurance", page: "tests/docs/endurance.md" };

impl BoardPage {
    /// Builds the image and the program, and runs the latter.
    ///
    /// # Errors
    /// When something cannot be built, or the program ends with an error.
    pub fn run(&self, options: &Options) -> Result<(), String> {
        bench::on_board(self.program, &self.arguments(options))
    }

    /// The program's, with the places of this workspace; what the user gives comes later and wins.
    fn arguments(&self, options: &Options) -> Vec<OsString> {
        let mut arguments = vec!["--page".into(), workspace().join(self.page).into_os_string()];
        arguments.extend(["--provenance".into(), provenance().into()]);
        arguments.extend(options.handed_on.iter().cloned());
        arguments
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn what_the_user_gives_comes_after_the_page_of_the_workspace() {
        for task in [FAULTS, ENDURE] {
            let handed_on = ["--cases", "20", "--page", "elsewhere.md"].map(OsString::from).to_vec();
            let arguments = task.arguments(&Options { handed_on: handed_on.clone() });
            assert!(Path::new(&arguments[1]).ends_with(task.page), "{arguments:?}");
            assert_eq!(arguments[arguments.len() - 4..], handed_on);
        }
    }
}
