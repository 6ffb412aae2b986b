//! `bowden survey`: every recording of a folder, diagnosed by itself and put side by side.

use std::path::PathBuf;
use std::time::Instant;

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_core::progress::Progress;
use bowden_core::survey::{PAGE, Plan, RigRule, survey};
use serde::Serialize;

use super::{print, print_json};
use crate::interrupt;
use crate::progress::UntilInterrupted;

/// Arguments of `bowden survey`.
#[derive(Clone, Debug, clap::Args)]
pub struct SurveyArguments {
    /// Folder of recordings (.csv, .csv.gz, .mcap, .parquet); each folder below it is a bench of its own
    folder: PathBuf,
    /// Rig file for all recordings, or FOLDER=RIG.toml for those of a folder below. May be repeated; without it the nearest
    /// rig.toml beside or above a recording is taken
    #[arg(long, value_name = "RIG.toml")]
    rig: Vec<RigRule>,
    /// Folder for tables (Parquet), survey.html, and the results that a later run goes on from
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Print JSON: one object
    #[arg(long)]
    json: bool,
}

/// What became of the recordings.
#[derive(Serialize)]
struct Facts<'a> {
    recordings: usize,
    /// Diagnosed in this run.
    diagnosed: usize,
    /// Diagnosed in a run before.
    kept: usize,
    failed: Vec<FailedRecording<'a>>,
    /// Not reached, because the run was stopped.
    left: usize,
    took_s: f64,
    page: String,
}

/// A recording without a diagnosis.
#[derive(Serialize)]
struct FailedRecording<'a> {
    recording: &'a str,
    reason: &'a str,
}

impl SurveyArguments {
    /// Diagnoses what is not done yet, writes tables and page, and prints what became of the recordings.
    ///
    /// # Errors
    /// See [`Plan::new`] and [`survey`].
    pub fn run(&self, progress: &dyn Progress) -> Result<Outcome, Failure> {
        interrupt::catch()?;
        output::check_folder(&self.out)?;
        let plan = Plan::new(&self.folder, &self.rig, &self.out)?;
        let workers = rayon::current_num_threads();
        let started = Instant::now();
        let summary = survey(&plan, &self.out, workers, &UntilInterrupted(progress))?;
        let took_s = started.elapsed().as_secs_f64();
        let failed = |(recording, reason)| FailedRecording { recording, reason };
        let facts = Facts {
            recordings: plan.tasks.len(),
            diagnosed: summary.diagnosed,
            kept: summary.kept,
            failed: summary.failed.iter().map(|(name, why)| failed((name.as_str(), why.as_str()))).collect(),
            left: summary.left,
            took_s,
            page: self.out.join(PAGE).display().to_string(),
        };
        if self.json {
            print_json(&facts)?;
        } else {
            print(&format!(
                "{} recordings: {} diagnosed in {took_s:.0} s on {workers} threads, {} were done before, {} failed, {} left\n{}\n",
                facts.recordings,
                facts.diagnosed,
                facts.kept,
                facts.failed.len(),
                facts.left,
                facts.page
            ))?;
        }
        let mut outcome = Outcome::done();
        outcome.extend(
            summary.failed.iter().map(|(recording, message)| format!("{recording} failed: {message}")),
        );
        if summary.left > 0 {
            outcome.extend([format!(
                "stopped early: {} recordings are left; run it again to go on",
                summary.left
            )]);
        }
        Ok(outcome)
    }
}
