//! `bowden diagnose`: which physics the rig's simulation lacks.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use bowden_model::effects::CATALOGUE;

use super::{load_study, outcome_of, print};
use crate::diagnose::{Diagnosed, diagnose};
use crate::interrupt;
use crate::outcome::{Failure, Outcome};
use crate::output;
use crate::progress::{Progress, UntilInterrupted};
use crate::report;
use crate::rig::RigDocument;
use crate::study::{LoadedStudy, Study};

/// The result of a diagnosis, in its folder.
pub const RESULT: &str = "diagnosis.json";

/// Its report.
pub const REPORT: &str = "report.html";

/// The rig file with what was found, where there is one bench.
pub const RIG: &str = "rig.diagnosed.toml";

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
        print(&format!("{}\n{}\n", diagnosed.findings.diagnosis.summary, page.display()))?;
        let mut outcome = outcome_of(study.recordings.iter().map(|listed| &listed.recording));
        if !diagnosed.findings.diagnosis.complete {
            outcome.extend([
                "stopped early: not every effect was tried; run it again to the end before trusting it",
            ]);
        }
        Ok(outcome)
    }
}

/// Writes result, report, rigs and references of a diagnosis into its folder, in place of an earlier one's; returns where the
/// report is. `rigs` are the rig files that were diagnosed, one a bench, under the names to write; they get the physics
/// that was found.
///
/// # Errors
/// When the medium refuses, or a rig file cannot take a value.
pub fn save(
    diagnosed: &Diagnosed,
    rigs: &mut [(&str, &mut RigDocument)],
    folder: &Path,
) -> Result<PathBuf, Failure> {
    let [result, page] = [RESULT, REPORT].map(|name| folder.join(name));
    let json = serde_json::to_string_pretty(&diagnosed.findings.diagnosis)
        .map_err(|error| Failure::failed(format!("{}: {error}", result.display())))?;
    output::write_file(&result, |file| writeln!(file, "{json}"))?;
    output::write_file(&page, |file| file.write_all(report::render(&diagnosed.findings).as_bytes()))?;
    for (bench, (name, document)) in rigs.iter_mut().enumerate() {
        diagnosed.write_into(bench, document)?;
        document.save(&folder.join(name))?;
    }
    for earlier in earlier_experiments(folder) {
        output::remove_file(&folder.join(earlier))?;
    }
    for experiment in &diagnosed.experiments {
        experiment.reference.save(&folder.join(&experiment.file))?;
    }
    Ok(page)
}

/// Names of the rig files that a diagnosis writes, one a bench.
fn rig_files(study: &Study) -> Vec<String> {
    match &study.benches[..] {
        [_] => vec![RIG.to_owned()],
        benches => benches.iter().map(|bench| format!("rig.diagnosed.{}.toml", bench.name)).collect(),
    }
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
