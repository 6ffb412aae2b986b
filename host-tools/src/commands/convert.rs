//! `bowden convert`: the same recording in another format.

use std::path::PathBuf;

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_core::recording::{Format, ReadOptions, Recording};

use super::outcome_of;

/// Arguments of `bowden convert`.
#[derive(Clone, Debug, clap::Args)]
pub struct ConvertArguments {
    /// Recording to read (.csv, .csv.gz, .mcap, .parquet)
    input: PathBuf,
    /// File to write; its name's ending gives the format: .csv, .csv.gz, .mcap or .parquet
    output: PathBuf,
}

impl ConvertArguments {
    /// Reads and writes the recording.
    ///
    /// # Errors
    /// What makes the input unusable or the output impossible.
    pub fn run(&self) -> Result<Outcome, Failure> {
        Format::for_output(&self.output)?;
        output::check_file(&self.output, &[&self.input])?;
        let recording = Recording::load(&self.input, &ReadOptions::default())?;
        recording.save(&self.output)?;
        let mut outcome = outcome_of([&recording]);
        if let topics @ [_, ..] = recording.topics_passed_over() {
            let topics = topics.join(", ");
            outcome.extend([format!("{}: other topics were not copied: {topics}", recording.source())]);
        }
        Ok(outcome)
    }
}
