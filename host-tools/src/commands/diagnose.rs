//! `bowden diagnose`: which physics the rig's simulation lacks.

use std::path::{Path, PathBuf};

use bowden_core::diagnose::diagnose;
use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_core::progress::Progress;
use bowden_core::report::files::{REPORT, RESULT, earlier_experiments, rig_files, save};
use bowden_core::rig::RigDocument;
use bowden_core::study::LoadedStudy;
use bowden_model::effects::CATALOGUE;

use super::{load_study, outcome_of, print, print_json};
use crate::interrupt;
use crate::progress::UntilInterrupted;

/// Arguments of `bowden diagnose`.
#[derive(Clone, Debug, clap::Args)]
pub struct DiagnoseArguments {
    /// Recordings of the bench (.csv, .csv.gz, .mcap), or one study of several benches or recordings (.toml)
    #[arg(required = true)]
    recordings: Vec<PathBuf>,
    /// Rig file: what the bench is believed to be; a study names its own
    #[arg(long, value_name = "RIG.toml")]
    rig: Option<PathBuf>,
    /// Folder for diagnosis.json, report.html, rig.diagnosed.toml and references of experiments worth
    /// doing; made if it is not there
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Recordings that judge the diagnosis and take no other part; without them a part of the others is held out
    #[arg(long, value_name = "RECORDING", num_args = 1..)]
    heldout: Vec<PathBuf>,
    /// Try this effect too; for those that are not tried unless asked for. May be repeated
    #[arg(long, value_name = "EFFECT", value_parser = clap::builder::PossibleValuesParser::new(on_request()))]
    also: Vec<String>,
    /// Print JSON: what stands in diagnosis.json
    #[arg(long)]
    json: bool,
}

/// Effects that are tried only where the user asks for them.
fn on_request() -> impl Iterator<Item = &'static str> {
    CATALOGUE.iter().filter(|effect| effect.on_request()).map(|effect| effect.descriptor().id)
}

/// What a diagnosis works on, checked.
#[derive(Clone, Debug)]
pub struct DiagnoseTask {
    /// Benches and recordings, with their files.
    pub loaded: LoadedStudy,
    /// Folder for the results.
    pub out: PathBuf,
}

impl DiagnoseArguments {
    /// Reads the inputs and makes the output folder.
    ///
    /// # Errors
    /// What makes an input unusable or the output impossible; a recording that is both training and held out.
    pub fn prepare(&self) -> Result<DiagnoseTask, Failure> {
        output::check_folder(&self.out)?;
        let loaded = load_study(&self.recordings, self.rig.as_deref(), &self.heldout)?;
        let earlier = earlier_experiments(&self.out);
        let rigs = rig_files(&loaded.study);
        let files: Vec<&str> =
            [RESULT, REPORT].into_iter().chain(rigs.iter().chain(&earlier).map(String::as_str)).collect();
        let inputs: Vec<&Path> = loaded.files.iter().map(PathBuf::as_path).collect();
        output::prepare_folder(&self.out, &files, &inputs)?;
        Ok(DiagnoseTask { loaded, out: self.out.clone() })
    }

    /// Diagnoses the recordings and writes result, report and rig.
    ///
    /// # Errors
    /// What makes an input unusable, or the reason why no result can be written.
    pub fn run(&self, progress: &dyn Progress) -> Result<Outcome, Failure> {
        interrupt::catch()?;
        let DiagnoseTask { loaded, out } = self.prepare()?;
        let LoadedStudy { study, mut documents, .. } = loaded;
        let progress = &UntilInterrupted(progress);
        let also: Vec<&str> = self.also.iter().map(String::as_str).collect();
        let diagnosed = diagnose(&study, &also, progress)?;
        let names = rig_files(&study);
        let mut rigs: Vec<(&str, &mut RigDocument)> =
            names.iter().map(String::as_str).zip(&mut documents).collect();
        let page = save(&diagnosed, &mut rigs, &out)?;
        let diagnosis = &diagnosed.findings.diagnosis;
        if self.json {
            print_json(diagnosis)?;
        } else {
            print(&format!("{}\n{}\n", diagnosis.summary, page.display()))?;
        }
        let mut outcome = outcome_of(study.recordings.iter().map(|listed| &listed.recording));
        outcome.extend(&diagnosed.notes);
        if !diagnosis.complete {
            outcome.extend([
                "stopped early: not every effect was tried; run it again to the end before trusting it",
            ]);
        }
        Ok(outcome)
    }
}
