//! `bowden simulate`: a full forward run, reference to controller to motor to joint.

use std::path::PathBuf;

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_core::recording::{Format, ReadOptions, Recording};
use bowden_core::rig::Rig;
use bowden_core::simulate::{Motion, Reference, RunOptions, run};
use bowden_model::channel::Channel;

use super::outcome_of;

/// Arguments of `bowden simulate`.
#[derive(Clone, Debug, clap::Args)]
pub struct SimulateArguments {
    /// Rig file
    #[arg(long, value_name = "RIG.toml")]
    rig: PathBuf,
    /// Recording to write (.csv, .csv.gz, .mcap)
    #[arg(long, value_name = "REC.csv")]
    out: PathBuf,
    /// Built-in motion of the reference
    #[arg(long, value_name = "NAME", default_value = "lab", conflicts_with = "reference")]
    motion: MotionName,
    /// Recording whose `theta_ref_rad` is the reference
    #[arg(long, value_name = "FILE.csv")]
    reference: Option<PathBuf>,
    /// Length of the run, s; as long as the reference file if that is given
    #[arg(long, value_parser = seconds)]
    seconds: Option<f64>,
    /// Samples a second
    #[arg(long, default_value = "1000", value_parser = rate_hz)]
    rate_hz: f64,
    /// Seed of the built-in motion and of the sensors' noise
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// A built-in motion, as an argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum MotionName {
    /// Rest, slow sine, multisine, ramps and staircase, one after the other
    Lab,
    /// Slow sine
    Sine,
    /// Ramps of constant, random speed between random turning points
    Triangle,
    /// Tones between 0.15 and 1.3 Hz with random phases
    Multisine,
    /// Random levels, each reached smoothly and held
    Staircase,
    /// No motion
    Rest,
}

impl From<MotionName> for Motion {
    fn from(name: MotionName) -> Self {
        match name {
            MotionName::Lab => Self::Lab,
            MotionName::Sine => Self::Sine,
            MotionName::Triangle => Self::Triangle,
            MotionName::Multisine => Self::Multisine,
            MotionName::Staircase => Self::Staircase,
            MotionName::Rest => Self::Rest,
        }
    }
}

/// Length of a run when nothing says it, s.
const DEFAULT_SECONDS: f64 = 40.0;

/// What the position loop is to follow.
#[derive(Clone, Debug)]
pub enum Course {
    /// A built-in motion.
    Motion(Motion),
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
    /// Simulates and writes the recording.
    ///
    /// # Errors
    /// See [`SimulateArguments::prepare`] and [`run`].
    pub fn run(&self) -> Result<Outcome, Failure> {
        let task = self.prepare()?;
        let (reference, outcome) = match &task.course {
            Course::Motion(motion) => {
                (Reference::of_motion(*motion, task.seconds, task.seed), Outcome::done())
            }
            Course::Reference(recording) => (Reference::of_recording(recording)?, outcome_of([recording])),
        };
        let options = RunOptions { seconds: task.seconds, rate_hz: task.rate_hz, seed: task.seed };
        run(&task.rig, &reference, options)?.save(&task.out)?;
        Ok(outcome)
    }

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
        let course = match &self.reference {
            Some(path) => {
                let only = Some(vec![Channel::ThetaRef]);
                let recording = Recording::load(path, &ReadOptions { columns: rig.columns.clone(), only })?;
                Reference::of_recording(&recording)?;
                Course::Reference(recording)
            }
            None => Course::Motion(self.motion.into()),
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
