//! `bowden fit`: recalibrates the nominal parameters of a rig.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use bowden_core::fit::objective::Series;
use bowden_core::fit::recalibrate::{FittedParameter, Recalibration, recalibrate};
use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_core::progress::Progress;
use bowden_core::study::{LoadedStudy, Study};
use serde::Serialize;

use super::{all_paths, load_study, outcome_of, print, print_json};

/// Arguments of `bowden fit`.
#[derive(Clone, Debug, clap::Args)]
pub struct FitArguments {
    /// Recordings of the bench (.csv, .csv.gz, .mcap), or one study of several benches or recordings (.toml)
    #[arg(required = true)]
    recordings: Vec<PathBuf>,
    /// Rig file with the values to start from; a study names its own
    #[arg(long, value_name = "RIG.toml")]
    rig: Option<PathBuf>,
    /// Rig file to write: the same with the fitted values. Of a study the folder for rig.fitted.toml, or for
    /// rig.fitted.BENCH.toml of each bench
    #[arg(long, value_name = "FITTED.toml")]
    out: PathBuf,
    /// Print JSON: one object
    #[arg(long)]
    json: bool,
}

/// What a fit found.
#[derive(Serialize)]
struct Facts<'f> {
    parameters: Vec<ParameterFacts<'f>>,
    /// RMS differences between recording and replay.
    channels: Vec<ChannelFacts>,
    /// Parameters of which the recordings show the product only, `section.name` and exponent.
    indistinguishable: Vec<&'f [(String, f64)]>,
    /// Parameters on which the recordings say nothing.
    unseen: &'f [String],
}

#[derive(Serialize)]
struct ParameterFacts<'f> {
    parameter: String,
    /// Bench that has it for itself.
    bench: Option<&'f str>,
    nominal: f64,
    fitted: f64,
    std: Option<f64>,
    at_bound: bool,
    unit: &'static str,
}

#[derive(Serialize)]
struct ChannelFacts {
    channel: &'static str,
    nominal_rms: f64,
    fitted_rms: f64,
    unit: &'static str,
}

impl<'f> Facts<'f> {
    fn of(result: &'f Recalibration, study: &'f Study) -> Self {
        let parameters = result.parameters.iter().map(|fitted| ParameterFacts {
            parameter: fitted.parameter.to_string(),
            bench: fitted.bench.map(|bench| study.benches[bench].name.as_str()),
            nominal: fitted.nominal,
            fitted: fitted.fitted,
            std: fitted.std,
            at_bound: fitted.at_bound,
            unit: fitted.unit,
        });
        let channels = result.channels.iter().map(|error| {
            let (channel, unit) = named(error.series);
            ChannelFacts { channel, nominal_rms: error.before, fitted_rms: error.after, unit }
        });
        Self {
            parameters: parameters.collect(),
            channels: channels.collect(),
            indistinguishable: result.groups.iter().map(|group| group.members.as_slice()).collect(),
            unseen: &result.unseen,
        }
    }
}

/// What a fit works on, checked.
#[derive(Clone, Debug)]
pub struct FitTask {
    /// Benches and recordings, with their files.
    pub loaded: LoadedStudy,
    /// Where the fitted rigs go, one file a bench.
    pub out: Vec<PathBuf>,
}

impl FitArguments {
    /// Fits, writes the fitted rigs and prints what changed and what stays unknown.
    ///
    /// # Errors
    /// See [`FitArguments::prepare`] and [`recalibrate`].
    pub fn run(&self, progress: &dyn Progress) -> Result<Outcome, Failure> {
        let FitTask { loaded: LoadedStudy { study, mut documents, .. }, out } = self.prepare()?;
        let result = recalibrate(&study, progress)?;
        for (bench, (document, out)) in documents.iter_mut().zip(&out).enumerate() {
            result.write_to(bench, document)?;
            document.save(out)?;
        }
        if self.json {
            print_json(&Facts::of(&result, &study))?;
        } else {
            print(&table(&result, &study))?;
        }
        let mut outcome = outcome_of(study.recordings.iter().map(|listed| &listed.recording));
        outcome.extend(&result.notes);
        Ok(outcome)
    }

    /// Checks the output and reads the inputs.
    ///
    /// # Errors
    /// What makes an input unusable or the output impossible.
    pub fn prepare(&self) -> Result<FitTask, Failure> {
        let mut inputs = all_paths(&[&self.recordings]);
        inputs.extend(self.rig.as_deref());
        let of_a_study = self.rig.is_none();
        if !of_a_study {
            output::check_file(&self.out, &inputs)?;
        }
        let loaded = load_study(&self.recordings, self.rig.as_deref(), &[])?;
        let out = if of_a_study { into_folder(&loaded, &self.out)? } else { vec![self.out.clone()] };
        Ok(FitTask { loaded, out })
    }
}

/// Files in a folder for the fitted rigs of a study; the folder is made if it is not there.
fn into_folder(loaded: &LoadedStudy, folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let names: Vec<String> = match &loaded.study.benches[..] {
        [_] => vec!["rig.fitted.toml".to_owned()],
        benches => benches.iter().map(|bench| format!("rig.fitted.{}.toml", bench.name)).collect(),
    };
    let inputs: Vec<&Path> = loaded.files.iter().map(PathBuf::as_path).collect();
    output::prepare_folder(folder, &names.iter().map(String::as_str).collect::<Vec<_>>(), &inputs)?;
    Ok(names.iter().map(|name| folder.join(name)).collect())
}

/// The result as text: parameters, channels, and what the recordings leave open.
fn table(result: &Recalibration, study: &Study) -> String {
    let mut text =
        format!("{:<32}{:>12}  {:>12}   {:<14}{}\n", "parameter", "nominal", "fitted", "± std", "unit");
    for parameter in &result.parameters {
        let _ = writeln!(text, "{}", row(parameter, study));
    }
    let _ = writeln!(text, "\n{:<32}{:>12}  {:>12}   {:<14}unit", "RMS difference", "nominal", "fitted", "");
    for channel in &result.channels {
        let (name, unit) = named(channel.series);
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

/// Name and unit of a channel.
fn named(series: Series) -> (&'static str, &'static str) {
    match series {
        Series::Channel(channel) => (channel.role(), channel.unit()),
        Series::Guide => ("torque missing at the motor", "N m"),
    }
}

fn row(parameter: &FittedParameter, study: &Study) -> String {
    let path = match parameter.bench {
        Some(bench) => format!("{} ({})", parameter.parameter, study.benches[bench].name),
        None => parameter.parameter.to_string(),
    };
    let spread = match (parameter.at_bound, parameter.std) {
        (true, _) => "at bound".to_owned(),
        (false, Some(std)) => format!("± {std:.2e}"),
        (false, None) => "unknown".to_owned(),
    };
    format!("{path:<32}{:>12}  {:>12}   {spread:<14}{}", parameter.nominal, parameter.fitted, parameter.unit)
}
