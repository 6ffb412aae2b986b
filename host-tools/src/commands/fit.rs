//! `bowden fit`: recalibrates the nominal parameters of a rig.

use std::path::PathBuf;

use super::{all_paths, load_recordings};
use crate::outcome::Failure;
use crate::output;
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
