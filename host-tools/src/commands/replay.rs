//! `bowden replay`: what the rig's simulation answers to a recording's inputs.

use std::path::PathBuf;

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_core::recording::{Format, Recording};
use bowden_core::rig::{Assignment, Rig};

use super::outcome_of;

/// Arguments of `bowden replay`.
#[derive(Clone, Debug, clap::Args)]
pub struct ReplayArguments {
    /// Recording whose inputs drive the simulation; its other columns are not read
    recording: PathBuf,
    /// Rig file
    #[arg(long, value_name = "RIG.toml")]
    rig: PathBuf,
    /// Prediction to write: `t_s` and every output, one row a recorded sample (.csv, .csv.gz, .mcap)
    #[arg(long, value_name = "PRED.csv")]
    out: PathBuf,
    /// What is different in this recording. May be repeated
    #[arg(long, value_name = "PARAMETER=VALUE")]
    set: Vec<Assignment>,
}

/// What a replay works on, checked.
#[derive(Clone, Debug)]
pub struct ReplayTask {
    /// The bench.
    pub rig: Rig,
    /// Time and inputs.
    pub recording: Recording,
    /// Where the prediction goes.
    pub out: PathBuf,
}

impl ReplayArguments {
    /// Replays the recording and writes the prediction.
    ///
    /// # Errors
    /// See [`ReplayArguments::prepare`] and [`bowden_core::replay::predict`].
    pub fn run(&self) -> Result<Outcome, Failure> {
        let task = self.prepare()?;
        bowden_core::replay::predict(&task.rig, &task.recording)?.save(&task.out)?;
        Ok(outcome_of([&task.recording]))
    }

    /// Checks the output and reads the inputs.
    ///
    /// # Errors
    /// What makes an input unusable or the output impossible.
    pub fn prepare(&self) -> Result<ReplayTask, Failure> {
        Format::for_output(&self.out)?;
        output::check_file(&self.out, &[&self.recording, &self.rig])?;
        let mut rig = Rig::load(&self.rig)?;
        for assignment in &self.set {
            assignment.apply(&mut rig)?;
        }
        let recording = rig.load_inputs(&self.recording)?;
        Ok(ReplayTask { rig, recording, out: self.out.clone() })
    }
}
