//! `bowden completions` and `bowden man`: what a shell and `man` want to know, from the command line's own definition.

use std::path::PathBuf;

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use clap_complete::Shell;

use super::print;

/// Arguments of `bowden completions`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "bash: bowden completions bash > ~/.local/share/bash-completion/completions/bowden\n\
                  zsh:  bowden completions zsh > a folder of $fpath, as _bowden\n\
                  fish: bowden completions fish > ~/.config/fish/completions/bowden.fish")]
pub struct CompletionsArguments {
    /// Shell to complete for
    shell: Shell,
}

impl CompletionsArguments {
    /// Prints the script.
    ///
    /// # Errors
    /// When standard output refuses.
    pub fn run(&self, mut command: clap::Command) -> Result<Outcome, Failure> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut command, "bowden", &mut script);
        print(&String::from_utf8_lossy(&script))?;
        Ok(Outcome::done())
    }
}

/// Arguments of `bowden man`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "bowden man | man -l -\nbowden man --out ~/.local/share/man/man1    # then: man bowden-record"
)]
pub struct ManArguments {
    /// Folder to write the pages of all commands to; without it the page of bowden itself is printed
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl ManArguments {
    /// Writes the pages.
    ///
    /// # Errors
    /// When the folder cannot be made, or the medium or standard output refuses.
    pub fn run(&self, command: clap::Command) -> Result<Outcome, Failure> {
        let Some(folder) = &self.out else {
            let mut page = Vec::new();
            let refuse =
                |error: std::io::Error| Failure::failed(format!("no page: {}", output::describe(&error)));
            clap_mangen::Man::new(command).render(&mut page).map_err(refuse)?;
            print(&String::from_utf8_lossy(&page))?;
            return Ok(Outcome::done());
        };
        output::prepare_folder(folder, &[], &[])?;
        clap_mangen::generate_to(command, folder).map_err(|error| {
            let (folder, reason) = (folder.display(), output::describe(&error));
            Failure::failed(format!("{folder}: cannot be written: {reason}; choose another folder"))
        })?;
        print(&format!("{}: pages written; read them with `man -l`\n", folder.display()))?;
        Ok(Outcome::done())
    }
}
