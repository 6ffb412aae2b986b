//! `bowden simulate`: a full forward run, reference to controller to motor to joint.

use std::path::PathBuf;

use bowden_model::channel::Channel;

use crate::outcome::Failure;
use crate::output;
use crate::recording::{Format, ReadOptions, Recording};
use crate::rig::Rig;

/// Arguments of `bowden simulate`.
#[derive(Clone, Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("course").required(true).args(["motion", "reference"]))]
pub struct SimulateArguments {
    /// Rig file
    #[arg(long, value_name = "RIG.toml")]
    rig: PathBuf,
    /// Recording to write (.csv, .csv.gz, .mcap)
    #[arg(long, value_name = "REC.csv")]
    out: PathBuf,
    /// Built-in motion of the reference
    #[arg(long, value_name = "NAME")]
    motion: Option<String>,
    /// Recording whose `theta_ref_rad` is the reference
    #[arg(long, value_name = "FILE.csv")]
    reference: Option<PathBuf>,
    /// Length of the run, s; as long as the reference file if that is given
    #[arg(long, value_parser = seconds)]
    seconds: Option<f64>,
    /// Samples a second
    #[arg(long, default_value = "1000", value_parser = rate_hz)]
    rate_hz: f64,
    /// Seed of the sensors' noise
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// Length of a run when nothing says it, s.
const DEFAULT_SECONDS: f64 = 40.0;

/// What the position loop is to follow.
#[derive(Clone, Debug)]
pub enum Course {
    /// A built-in motion by its name.
    Motion(String),
    /// A recorded `theta_ref_rad`.
    Reference(Recording),
}

/// What a forward run works on, checked.
#[derive(Clone, Debug)]
pub struct SimulateTask {
    /// The bench; it has a motor.
    pub rig: Rig,
    /// What the loop follows.
    pub course: Course,
    /// Length, s.
    pub seconds: f64,
    /// Samples a second.
    pub rate_hz: f64,
    /// Seed of the noise.
    pub seed: u64,
    /// Where the recording goes.
    pub out: PathBuf,
}

impl SimulateArguments {
    /// Checks the output and reads the inputs.
    ///
    /// # Errors
    /// What makes an input unusable or the output impossible.
    pub fn prepare(&self) -> Result<SimulateTask, Failure> {
        Format::for_output(&self.out)?;
        let mut inputs = vec![self.rig.as_path()];
        inputs.extend(self.reference.as_deref());
        output::check_file(&self.out, &inputs)?;
        let rig = Rig::load(&self.rig)?;
        if rig.joint.motor.is_none() {
            let rig = self.rig.display();
            return Err(Failure::bad_input(format!(
                "{rig}:1:1: no [motor], which a forward run needs; add it or use replay"
            )));
        }
        let course = match (&self.motion, &self.reference) {
            (_, Some(path)) => {
                let only = Some(vec![Channel::ThetaRef]);
                let reference = Recording::load(path, &ReadOptions { columns: rig.columns.clone(), only })?;
                if reference.channel(Channel::ThetaRef).is_none() {
                    return Err(Failure::bad_input(format!(
                        "{}:1: no column `theta_ref_rad`; name the reference so",
                        reference.source()
                    )));
                }
                Course::Reference(reference)
            }
            (motion, None) => Course::Motion(motion.clone().unwrap_or_default()),
        };
        let seconds = match (&course, self.seconds) {
            (_, Some(seconds)) => seconds,
            (Course::Reference(reference), None) => reference.duration_s(),
            (Course::Motion(_), None) => DEFAULT_SECONDS,
        };
        Ok(SimulateTask {
            rig,
            course,
            seconds,
            rate_hz: self.rate_hz,
            seed: self.seed,
            out: self.out.clone(),
        })
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    within(text, 0.01, 36_000.0, "s")
}

fn rate_hz(text: &str) -> Result<f64, String> {
    within(text, 1.0, 100_000.0, "Hz")
}

fn within(text: &str, lower: f64, upper: f64, unit: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value >= lower && value <= upper => Ok(value),
        _ => Err(format!("allowed {lower} to {upper} {unit}")),
    }
}
