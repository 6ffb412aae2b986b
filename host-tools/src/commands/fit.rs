//! `bowden fit`: recalibrates the nominal parameters of a rig.

use std::fmt::Write;
use std::path::PathBuf;

use super::{all_paths, load_recordings, outcome_of, print};
use crate::fit::objective::Series;
use crate::fit::recalibrate::{FittedParameter, Recalibration, recalibrate};
use crate::outcome::{Failure, Outcome};
use crate::output;
use crate::progress::Progress;
use crate::recording::Recording;
use crate::rig::{Rig, RigDocument};

/// Arguments of `bowden fit`.
#[derive(Clone, Debug, clap::Args)]
pub struct FitArguments {
    /// Recordings of the bench (.csv, .csv.gz, .mcap)
    #[arg(required = true)]
    recordings: Vec<PathBuf>,
    /// Rig file with the values to start from
    #[arg(long, value_name = "RIG.toml")]
    rig: PathBuf,
    /// Rig file to write: the same with the fitted values
    #[arg(long, value_name = "FITTED.toml")]
    out: PathBuf,
}

/// What a fit works on, checked.
#[derive(Clone, Debug)]
pub struct FitTask {
    /// The bench.
    pub rig: Rig,
    /// Its file, to be changed and written.
    pub document: RigDocument,
    /// What was recorded.
    pub recordings: Vec<Recording>,
    /// Where the fitted rig goes.
    pub out: PathBuf,
}

impl FitArguments {
    /// Fits, writes the fitted rig and prints what changed and what stays unknown.
    ///
    /// # Errors
    /// See [`FitArguments::prepare`] and [`recalibrate`].
    pub fn run(&self, progress: &dyn Progress) -> Result<Outcome, Failure> {
        let mut task = self.prepare()?;
        let result = recalibrate(&task.rig, &task.recordings, progress)?;
        result.write_to(&mut task.document)?;
        task.document.save(&task.out)?;
        print(&table(&result))?;
        Ok(outcome_of(&task.recordings))
    }

    /// Checks the output and reads the inputs.
    ///
    /// # Errors
    /// What makes an input unusable or the output impossible.
    pub fn prepare(&self) -> Result<FitTask, Failure> {
        let mut inputs = all_paths(&[&self.recordings]);
        inputs.push(&self.rig);
        output::check_file(&self.out, &inputs)?;
        let document = RigDocument::load(&self.rig)?;
        let rig = document.rig()?;
        let recordings = load_recordings(&rig, &self.recordings)?;
        Ok(FitTask { rig, document, recordings, out: self.out.clone() })
    }
}

/// The result as text: parameters, channels, and what the recordings leave open.
fn table(result: &Recalibration) -> String {
    let mut text =
        format!("{:<32}{:>12}  {:>12}   {:<14}{}\n", "parameter", "nominal", "fitted", "± std", "unit");
    for parameter in &result.parameters {
        let _ = writeln!(text, "{}", row(parameter));
    }
    let _ = writeln!(text, "\n{:<32}{:>12}  {:>12}   {:<14}unit", "RMS difference", "nominal", "fitted", "");
    for channel in &result.channels {
        let (name, unit) = match channel.series {
            Series::Channel(channel) => (channel.role(), channel.unit()),
            Series::Guide => ("torque missing at the motor", "N m"),
        };
        let _ =
            writeln!(text, "{name:<32}{:>12.4}  {:>12.4}   {:<14}{unit}", channel.before, channel.after, "");
    }
    if !result.groups.is_empty() {
        let _ = writeln!(text, "\nThe recordings cannot tell these apart; only the product is known:");
        for group in &result.groups {
            let _ = writeln!(text, "  {group}");
        }
    }
    if !result.unseen.is_empty() {
        let _ = writeln!(text, "\nThe recordings say nothing on {}.", result.unseen.join(", "));
    }
    text
}

fn row(parameter: &FittedParameter) -> String {
    let path = format!("{}.{}", parameter.section, parameter.name);
    let spread = match (parameter.at_bound, parameter.std) {
        (true, _) => "at bound".to_owned(),
        (false, Some(std)) => format!("± {std:.2e}"),
        (false, None) => "unknown".to_owned(),
    };
    format!("{path:<32}{:>12}  {:>12}   {spread:<14}{}", parameter.nominal, parameter.fitted, parameter.unit)
}
