//! `bowden check`: reads recordings, and a rig, as the other commands would, and says what they hold.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::recording::{Column, ReadOptions, Recording};
use bowden_core::rig::Rig;
use bowden_core::study::{LoadedStudy, Role, Study};

use super::{load_study, outcome_of, print, print_json};
use crate::facts::Facts;
use crate::progress::under_way;

/// Arguments of `bowden check`.
#[derive(Clone, Debug, clap::Args)]
pub struct CheckArguments {
    /// Recordings to read (.csv, .csv.gz, .mcap), or one study (.toml)
    #[arg(required_unless_present = "rig")]
    recordings: Vec<PathBuf>,
    /// Rig file whose column names, units and parts the recordings are held against
    #[arg(long, value_name = "RIG.toml")]
    rig: Option<PathBuf>,
    /// Print JSON: one array, one object a recording, with what is wrong under `findings`
    #[arg(long)]
    json: bool,
}

impl CheckArguments {
    /// Reads everything and prints one line a file.
    ///
    /// # Errors
    /// What makes a file unusable.
    pub fn run(&self, quiet: bool) -> Result<Outcome, Failure> {
        if let [only] = &self.recordings[..]
            && LoadedStudy::is_named_by(only)
        {
            if self.json {
                return Err(Failure::bad_input(format!(
                    "{}: --json is for recordings; name those of the study",
                    only.display()
                )));
            }
            let read = || load_study(&self.recordings, self.rig.as_deref(), &[]);
            let LoadedStudy { study, .. } = under_way(quiet, "reading", read)?;
            print(&describe_study(only, &study)?)?;
            return Ok(outcome_of(study.recordings.iter().map(|listed| &listed.recording)));
        }
        let rig = self.rig.as_deref().map(Rig::load).transpose()?;
        let mut text = String::new();
        if let (Some(rig), Some(path)) = (&rig, &self.rig) {
            let effects: Vec<&str> = rig.effects.iter().map(|effect| effect.descriptor().id).collect();
            let effects = if effects.is_empty() { "no effects".to_owned() } else { effects.join(", ") };
            let _ = writeln!(text, "{}: rig `{}`, {effects}", path.display(), rig.name);
        }
        let mut outcome = Outcome::done();
        let mut all = Vec::new();
        for path in &self.recordings {
            let recording = under_way(quiet, "reading", || match &rig {
                Some(rig) => rig.load_recording(path),
                None => Recording::load(path, &ReadOptions::default()),
            })?;
            let _ = writeln!(text, "{}", describe(&recording));
            if let Some(rig) = &rig {
                let roles = rig.roles(&recording)?;
                let names = |channels: &[bowden_model::channel::Channel]| {
                    channels.iter().map(|channel| channel.role()).collect::<Vec<_>>().join(", ")
                };
                let _ = writeln!(
                    text,
                    "  inputs: {}\n  outputs: {}",
                    names(&roles.inputs),
                    names(&roles.outputs)
                );
            }
            outcome.extend(outcome_of([&recording]).notes());
            let facts = Facts::of(&recording, path);
            if !facts.still.is_empty() {
                let still = facts.still.join(", ");
                let _ = writeln!(text, "  the same value in every row: {still}; at rest, or a sensor hangs");
            }
            outcome.extend(facts.findings.iter().filter(|finding| !recording.notes().contains(finding)));
            all.push(facts);
        }
        if self.json {
            print_json(&all)?;
        } else {
            print(&text)?;
        }
        Ok(outcome)
    }
}

/// Benches and recordings of a study, one line each.
fn describe_study(path: &Path, study: &Study) -> Result<String, Failure> {
    let mut text = format!(
        "{}: study `{}`, benches: {}, recordings: {}\n",
        path.display(),
        study.name,
        study.benches.len(),
        study.recordings.len()
    );
    let joint = study.joint()?;
    for (index, bench) in study.benches.iter().enumerate() {
        let own: Vec<String> = joint
            .own
            .values
            .iter()
            .filter(|own| own.bench == index)
            .map(|own| own.parameter.to_string())
            .collect();
        let own =
            if own.is_empty() { "nothing of its own".to_owned() } else { format!("own: {}", own.join(", ")) };
        let _ = writeln!(text, "bench `{}`: rig `{}`, {own}", bench.name, bench.rig.name);
        for listed in study.recordings.iter().filter(|listed| listed.bench == index) {
            let _ = write!(text, "  {}", describe(&listed.recording));
            if listed.role == Role::HeldOut {
                text.push_str("; held out");
            }
            for assignment in &listed.set {
                let _ = write!(text, "; {} = {}", assignment.parameter, assignment.value);
            }
            text.push('\n');
        }
    }
    Ok(text)
}

fn describe(recording: &Recording) -> String {
    let names = |known: bool| -> Vec<&str> {
        let kind = |column: &&Column| matches!(column, Column::Known { .. }) == known;
        recording.columns().iter().filter(kind).map(Column::name).collect()
    };
    let mut text = format!(
        "{}: {} samples, {:.3} s, median step {:.6} s; roles: {}",
        recording.source(),
        recording.len(),
        recording.duration_s(),
        recording.median_step_s().unwrap_or(0.0),
        names(true).join(", ")
    );
    let unknown = names(false);
    if !unknown.is_empty() {
        let _ = write!(text, "; kept and not interpreted: {}", unknown.join(", "));
    }
    bowden_core::outcome::one_line(&text)
}
