//! The subcommands, one file each: arguments, checks of what they name, a library call, and what is printed.

pub mod calibrate;
pub mod check;
pub mod convert;
mod course;
pub mod diagnose;
pub mod doctor;
pub mod effect;
pub mod faults;
pub mod fit;
pub mod flash;
pub mod import;
pub mod info;
pub mod investigate;
mod limits;
pub mod log;
pub mod monitor;
pub mod neighbours;
pub mod params;
mod port;
pub mod record;
pub mod recover;
pub mod replay;
pub mod replay_control;
pub mod run;
pub mod send;
pub mod shell;
pub mod simulate;
pub mod survey;

use std::io::Write;
use std::path::{Path, PathBuf};

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_core::recording::Recording;
use bowden_core::study::LoadedStudy;
use bowden_host_link::evidence::Origin;

/// This program, as recordings name it.
fn origin() -> Origin {
    Origin {
        tool: concat!("bowden ", env!("CARGO_PKG_VERSION")).to_owned(),
        tool_revision: env!("BOWDEN_REVISION").to_owned(),
        ..Origin::default()
    }
}

/// Writes a result to standard output. A reader that left early (`bowden check ... | head -1`) is no failure.
///
/// # Errors
/// Exit status 1, if standard output refuses for another reason.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            let reason = output::describe(&error);
            Err(Failure::failed(format!("standard output: cannot be written: {reason}")))
        }
        _ => Ok(()),
    }
}

/// Writes facts to standard output as JSON.
fn print_json(facts: &impl serde::Serialize) -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(facts)
        .map_err(|error| Failure::failed(format!("standard output: no JSON: {error}; please report this")))?;
    print(&(text + "\n"))
}

/// Writes facts to standard output as JSON in one line.
fn print_json_line(facts: &impl serde::Serialize) -> Result<(), Failure> {
    let text = serde_json::to_string(facts)
        .map_err(|error| Failure::failed(format!("standard output: no JSON: {error}; please report this")))?;
    print(&(text + "\n"))
}

/// The study that a command line names: a study file, or recordings with the rig of their bench.
fn load_study(
    recordings: &[PathBuf],
    rig: Option<&Path>,
    heldout: &[PathBuf],
) -> Result<LoadedStudy, Failure> {
    if let Some(path) = recordings.iter().find(|path| LoadedStudy::is_rig(path)) {
        return Err(Failure::bad_input(format!(
            "{}: a rig where a recording or a study is expected; name it with --rig, and recordings (.csv, .csv.gz, .mcap) beside it",
            path.display()
        )));
    }
    match (recordings.iter().find(|path| LoadedStudy::is_named_by(path)), rig) {
        (None, Some(rig)) => LoadedStudy::of_one_bench(rig, recordings, heldout),
        (None, None) => Err(Failure::bad_input(
            "no rig; name it with --rig RIG.toml, or give one study file (.toml) instead",
        )),
        (Some(study), None) if recordings.len() == 1 && heldout.is_empty() => LoadedStudy::load(study),
        (Some(study), _) => Err(Failure::bad_input(format!(
            "{}: a study names its rigs and recordings itself; leave out --rig, --heldout and other recordings, or give \
             recordings (.csv, .csv.gz, .mcap) in place of it",
            study.display()
        ))),
    }
}

/// Outcome of work on recordings: what was lost or repaired when they were read.
fn outcome_of<'r>(recordings: impl IntoIterator<Item = &'r Recording>) -> Outcome {
    let mut outcome = Outcome::done();
    for recording in recordings {
        outcome.extend(recording.notes());
    }
    outcome
}

/// Paths as the checks of outputs take them.
fn all_paths<'p>(groups: &[&'p [PathBuf]]) -> Vec<&'p Path> {
    groups.iter().flat_map(|group| group.iter().map(PathBuf::as_path)).collect()
}
