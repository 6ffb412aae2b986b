//! `bowden info`: what is in recordings.

use std::path::PathBuf;

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::recording::{ReadOptions, Recording};
use bowden_model::channel::Channel;

use super::{outcome_of, print, print_json};
use crate::chart::chart;
use crate::facts::{Facts, numbers};
use crate::progress::under_way;

/// Arguments of `bowden info`.
#[derive(Clone, Debug, clap::Args)]
pub struct InfoArguments {
    /// Recordings to look at (.csv, .csv.gz, .mcap, .parquet)
    #[arg(required = true)]
    recordings: Vec<PathBuf>,
    /// Column to draw [default: the angle of the joint, else the first role]
    #[arg(long, value_name = "COLUMN", conflicts_with = "json")]
    plot: Option<String>,
    /// Print JSON: one array, one object a recording
    #[arg(long)]
    json: bool,
}

impl InfoArguments {
    /// Reads the recordings and prints what is in them. What is wrong with them `bowden check` says.
    ///
    /// # Errors
    /// What makes a file unusable; a column that is not there or holds text.
    pub fn run(&self, quiet: bool) -> Result<Outcome, Failure> {
        let mut outcome = Outcome::done();
        let mut all = Vec::new();
        for path in &self.recordings {
            let read = || Recording::load(path, &ReadOptions::default());
            let recording = under_way(quiet, "reading", read)?;
            outcome.extend(outcome_of([&recording]).notes());
            let facts = Facts::of(&recording, path);
            if !self.json {
                print(&facts.text())?;
                print(&self.drawn(&recording)?)?;
            }
            all.push(facts);
        }
        if self.json {
            print_json(&all)?;
        }
        Ok(outcome)
    }

    fn drawn(&self, recording: &Recording) -> Result<String, Failure> {
        let roles = || recording.channels().map(Channel::role);
        let usual = roles().find(|role| *role == Channel::ThetaOut.role()).or_else(|| roles().next());
        let Some(name) = self.plot.as_deref().or(usual) else { return Ok(String::new()) };
        let column = recording.columns().iter().find(|column| column.name() == name);
        let unit = column
            .and_then(|column| recording.unit(column))
            .map_or(String::new(), |unit| format!(", {unit}"));
        match numbers(recording, name) {
            Some(values) => Ok(chart(&format!("{name}{unit}"), recording.t_s(), &values)),
            None => Err(Failure::bad_input(format!(
                "{}: --plot {name}: no column of numbers has this name; choose one of those listed",
                recording.source()
            ))),
        }
    }
}
