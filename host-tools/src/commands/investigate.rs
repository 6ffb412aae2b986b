//! `bowden investigate`: the whole round on a joint by itself: excite, diagnose, correct, verify.

use std::fs;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_core::progress::Progress;
use bowden_core::rig::Rig;
use bowden_host_link::investigate::report::Investigation;
use bowden_host_link::investigate::{Dialog, Setup, investigate};

use super::limits::LimitArguments;
use super::port::PortArguments;
use super::{print, print_json};
use crate::interrupt;
use crate::progress::UntilInterrupted;

/// Arguments of `bowden investigate`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Shows the references and their limits and asks before the joint moves, shows old and new parameters and \
                  asks before they are set. They last until the board is switched off. If the joint then follows worse, or a \
                  fault stops it, the old ones are put back. Ctrl-C at any moment: the joint is off, what was recorded is \
                  kept."
)]
pub struct InvestigateArguments {
    #[command(flatten)]
    port: PortArguments,
    /// Rig file: what the bench is believed to be
    #[arg(long, value_name = "RIG.toml")]
    rig: PathBuf,
    /// Folder for recordings, diagnoses, investigation.json and investigate.html; new or empty
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    limits: LimitArguments,
    /// Format of the recordings
    #[arg(long, value_name = "FORMAT", default_value = "csv", value_parser = ["csv", "csv.gz", "mcap"])]
    format: String,
    /// Record every N-th control tick
    #[arg(long, value_name = "N", default_value = "10", value_parser = clap::value_parser!(u64).range(1..=1000))]
    every: u64,
    /// Do not ask
    #[arg(long)]
    yes: bool,
    /// Show references and limits; move nothing, write nothing
    #[arg(long)]
    dry_run: bool,
    /// Print JSON: the object of investigation.json. Nobody is asked: with --yes or --dry-run only
    #[arg(long)]
    json: bool,
}

/// Says yes to everything.
struct Yes;

impl Dialog for Yes {
    fn show(&self, text: &str) -> Result<(), Failure> {
        print(text)
    }

    fn may(&self, _question: &str) -> Result<bool, Failure> {
        Ok(true)
    }
}

/// Says yes to everything, and shows nothing but the result.
struct Json;

impl Dialog for Json {
    fn show(&self, _text: &str) -> Result<(), Failure> {
        Ok(())
    }

    fn conclude(&self, investigation: &Investigation, _text: &str) -> Result<(), Failure> {
        print_json(investigation)
    }

    fn may(&self, _question: &str) -> Result<bool, Failure> {
        Ok(true)
    }
}

/// Asks the person at the terminal.
struct AtTerminal;

impl Dialog for AtTerminal {
    fn show(&self, text: &str) -> Result<(), Failure> {
        print(text)
    }

    fn may(&self, question: &str) -> Result<bool, Failure> {
        self.show(&format!("{question} [y/N] "))?;
        let line = interrupt::read_line()?;
        Ok(line.is_some_and(|line| matches!(line.trim().to_lowercase().as_str(), "y" | "yes")))
    }
}

impl InvestigateArguments {
    /// Investigates the joint.
    ///
    /// # Errors
    /// As [`investigate`]; also exit status 2 if nobody can be asked, or the folder holds something.
    pub fn run(&self, progress: &dyn Progress) -> Result<Outcome, Failure> {
        let asks = !self.yes && !self.dry_run;
        if self.json && asks {
            return Err(Failure::bad_input(
                "--json: nobody can be asked before the joint moves; add --yes, or --dry-run to see what it would do",
            ));
        }
        let dialog: &dyn Dialog = match (self.json, asks) {
            (true, _) => &Json,
            (false, true) => &AtTerminal,
            (false, false) => &Yes,
        };
        if asks && !io::stdin().is_terminal() {
            return Err(Failure::bad_input(
                "investigate moves the joint, and there is no terminal to ask at; nothing was moved; say --yes, or --dry-run to \
                 see what it would do",
            ));
        }
        Rig::load(&self.rig)?;
        output::check_folder(&self.out)?;
        refuse_content(&self.out)?;
        interrupt::catch()?;
        let client = self.port.connect()?;
        let setup = Setup {
            rig: &self.rig,
            folder: &self.out,
            wishes: self.limits.into(),
            ending: &self.format,
            every: self.every,
            origin: super::origin(),
            dry_run: self.dry_run,
        };
        investigate(&setup, client, dialog, &interrupt::requested, &UntilInterrupted(progress))
    }
}

/// Refuses a folder with anything in it: an earlier investigation must not be mixed with this one.
fn refuse_content(folder: &Path) -> Result<(), Failure> {
    let first = fs::read_dir(folder).ok().and_then(|mut entries| entries.next()).and_then(Result::ok);
    match first {
        None => Ok(()),
        Some(entry) => Err(Failure::bad_input(format!(
            "{}: holds {} already; name a new folder, or remove what is in it",
            folder.display(),
            entry.file_name().to_string_lossy()
        ))),
    }
}
