//! `bowden diagnose`: which physics the rig's simulation lacks.

use std::io::Write;
use std::path::PathBuf;

use super::{all_paths, load_recordings, outcome_of, print};
use crate::diagnose::diagnose;
use crate::interrupt;
use crate::outcome::{Failure, Outcome};
use crate::output;
use crate::progress::{Progress, UntilInterrupted};
use crate::recording::Recording;
use crate::report;
use crate::rig::{Rig, RigDocument};

/// Files that a diagnosis writes into its folder: result, report, rig with the effects found.
pub const FILES: [&str; 3] = ["diagnosis.json", "report.html", "rig.diagnosed.toml"];

/// Arguments of `bowden diagnose`.
#[derive(Clone, Debug, clap::Args)]
pub struct DiagnoseArguments {
    /// Recordings of the bench (.csv, .csv.gz, .mcap)
    #[arg(required = true)]
    recordings: Vec<PathBuf>,
    /// Rig file: what the bench is believed to be
    #[arg(long, value_name = "RIG.toml")]
    rig: PathBuf,
    /// Folder for diagnosis.json, report.html, rig.diagnosed.toml and references of experiments worth
    /// doing; made if it is not there
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Recordings that judge the diagnosis and take no other part; without them a part of the others is held out
    #[arg(long, value_name = "RECORDING", num_args = 1..)]
    heldout: Vec<PathBuf>,
}

/// What a diagnosis works on, checked.
#[derive(Clone, Debug)]
pub struct DiagnoseTask {
    /// The bench.
    pub rig: Rig,
    /// Its file, to be changed and written.
    pub document: RigDocument,
    /// Recordings to learn from.
    pub training: Vec<Recording>,
    /// Recordings to judge by; empty if none were given.
    pub heldout: Vec<Recording>,
    /// Folder for the results.
    pub out: PathBuf,
}

impl DiagnoseArguments {
    /// Reads the inputs and makes the output folder.
    ///
    /// # Errors
    /// What makes an input unusable or the output impossible; a recording that is both training and held out.
    pub fn prepare(&self) -> Result<DiagnoseTask, Failure> {
        for heldout in &self.heldout {
            let same = |path: &&PathBuf| path.canonicalize().ok() == heldout.canonicalize().ok();
            if heldout.exists() && self.recordings.iter().any(|path| same(&path)) {
                return Err(Failure::bad_input(format!(
                    "{}: given as training and as held out; a judge must be another recording",
                    heldout.display()
                )));
            }
        }
        let document = RigDocument::load(&self.rig)?;
        let rig = document.rig()?;
        let mut inputs = all_paths(&[&self.recordings, &self.heldout]);
        inputs.push(&self.rig);
        output::check_folder(&self.out)?;
        let training = load_recordings(&rig, &self.recordings)?;
        let heldout = load_recordings(&rig, &self.heldout)?;
        output::prepare_folder(&self.out, &FILES, &inputs)?;
        Ok(DiagnoseTask { rig, document, training, heldout, out: self.out.clone() })
    }

    /// Diagnoses the recordings and writes result, report and rig.
    ///
    /// # Errors
    /// What makes an input unusable, or the reason why no result can be written.
    pub fn run(&self, progress: &dyn Progress) -> Result<Outcome, Failure> {
        interrupt::catch()?;
        let mut task = self.prepare()?;
        let progress = &UntilInterrupted(progress);
        let diagnosed = diagnose(&task.rig, &task.training, &task.heldout, progress)?;
        let [result, page, rig] = FILES.map(|name| task.out.join(name));
        let json = serde_json::to_string_pretty(&diagnosed.findings.diagnosis)
            .map_err(|error| Failure::failed(format!("{}: {error}", result.display())))?;
        output::write_file(&result, |file| writeln!(file, "{json}"))?;
        output::write_file(&page, |file| file.write_all(report::render(&diagnosed.findings).as_bytes()))?;
        diagnosed.write_into(&mut task.document)?;
        task.document.save(&rig)?;
        for experiment in &diagnosed.experiments {
            experiment.reference.save(&task.out.join(&experiment.file))?;
        }
        print(&format!("{}\n{}\n", diagnosed.findings.diagnosis.summary, page.display()))?;
        let mut outcome = outcome_of(task.training.iter().chain(&task.heldout));
        if !diagnosed.findings.diagnosis.complete {
            outcome.extend([
                "stopped early: not every effect was tried; run it again to the end before trusting it",
            ]);
        }
        Ok(outcome)
    }
}
