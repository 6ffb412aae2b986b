//! `bowden diagnose`: which physics the rig's simulation lacks.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use bowden_model::effects::CATALOGUE;

use super::{all_paths, load_recordings, outcome_of, print};
use crate::diagnose::{Diagnosed, diagnose};
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
    /// Try this effect too; for those that are not tried unless asked for. May be repeated
    #[arg(long, value_name = "EFFECT", value_parser = clap::builder::PossibleValuesParser::new(on_request()))]
    also: Vec<String>,
}

/// Effects that are tried only where the user asks for them.
fn on_request() -> impl Iterator<Item = &'static str> {
    CATALOGUE.iter().filter(|effect| effect.on_request()).map(|effect| effect.descriptor().id)
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
        let earlier = earlier_experiments(&self.out);
        let files: Vec<&str> = FILES.into_iter().chain(earlier.iter().map(String::as_str)).collect();
        output::prepare_folder(&self.out, &files, &inputs)?;
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
        let also: Vec<&str> = self.also.iter().map(String::as_str).collect();
        let diagnosed = diagnose(&task.rig, &task.training, &task.heldout, &also, progress)?;
        let page = save(&diagnosed, &mut task.document, &task.out)?;
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

/// Writes result, report, rig and references of a diagnosis into its folder, in place of an earlier one's; returns where the
/// report is. `document` is the rig file that was diagnosed and gets the physics that was found.
///
/// # Errors
/// When the medium refuses, or the rig file cannot take a value.
pub fn save(diagnosed: &Diagnosed, document: &mut RigDocument, folder: &Path) -> Result<PathBuf, Failure> {
    let [result, page, rig] = FILES.map(|name| folder.join(name));
    let json = serde_json::to_string_pretty(&diagnosed.findings.diagnosis)
        .map_err(|error| Failure::failed(format!("{}: {error}", result.display())))?;
    output::write_file(&result, |file| writeln!(file, "{json}"))?;
    output::write_file(&page, |file| file.write_all(report::render(&diagnosed.findings).as_bytes()))?;
    diagnosed.write_into(document)?;
    document.save(&rig)?;
    for earlier in earlier_experiments(folder) {
        output::remove_file(&folder.join(earlier))?;
    }
    for experiment in &diagnosed.experiments {
        experiment.reference.save(&folder.join(&experiment.file))?;
    }
    Ok(page)
}

/// Names of the references that an earlier diagnosis left in `folder`: they ask for what may be settled by now.
fn earlier_experiments(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter(|name| {
            let reference = name.strip_suffix(".csv").and_then(|name| name.strip_prefix("separate-"));
            reference.is_some_and(|pair| pair.contains("-from-"))
        })
        .collect();
    names.sort_unstable();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn references_of_an_earlier_diagnosis_are_found_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let ours = ["separate-a-from-b.csv", "separate-joint_spring-from-payload_change.csv"];
        for name in
            ours.into_iter().chain(["separate.csv", "from-a.csv", "separate-a-from-b.mcap", "report.html"])
        {
            fs::write(folder.path().join(name), "").unwrap();
        }
        assert_eq!(earlier_experiments(folder.path()), ours);
        assert_eq!(earlier_experiments(&folder.path().join("not there")), [""; 0]);
    }
}
