//! `bowden import`: a recording of what another tool kept of a bench run.

use std::path::PathBuf;

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_core::recording::{
    Cell, DurableFile, END_GROUP, Format, METADATA_SCHEMA, Metadata, RECORDING_GROUP,
};
use bowden_host_link::firmware_log::LogDecoder;
use bowden_host_link::firmware_log::import::LoggedRun;

use serde::Serialize;

use super::log::{each_piece, load_image};
use super::{print, print_json};
use crate::progress::under_way;

/// Arguments of `bowden import`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "A row is one line of the log with numbers, each under the name that stands before it: `f1_n={=f32}` fills the column \
                  f1_n. The line with the most columns of a recording (t_s, f1_n, duty, ...) is taken, else the one with the most \
                  numbers. Every other line is an event: it stands in the column `event` of the next row, with its time and level."
)]
pub struct ImportArguments {
    /// ELF that the firmware was flashed from, whose defmt log LOG is
    #[arg(long, value_name = "ELF")]
    defmt: PathBuf,
    /// File of logged bytes; `-` for standard input
    log: PathBuf,
    /// Recording to write (.csv, .csv.gz, .mcap)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Make rows of the line with this text
    #[arg(long, value_name = "TEXT")]
    rows: Option<String>,
    /// Print JSON: one object
    #[arg(long)]
    json: bool,
}

/// What was made of a log.
#[derive(Serialize)]
struct Facts<'a> {
    out: String,
    rows: usize,
    columns: &'a [String],
    /// Rows before which something else was logged.
    rows_with_events: usize,
}

impl ImportArguments {
    /// Decodes the log and writes the recording.
    ///
    /// # Errors
    /// Exit status 2: unusable files, the ELF of another firmware, a log without time or numbers; 1, if the medium refuses.
    pub fn run(&self, quiet: bool) -> Result<Outcome, Failure> {
        let format = Format::for_rows(&self.out)?;
        output::check_file(&self.out, &[&self.log, &self.defmt])?;
        let image = load_image(&self.defmt)?;
        let mut decoder = LogDecoder::new(&image);
        let mut lines = Vec::new();
        under_way(quiet, "decoding", || {
            each_piece(&self.log, |bytes| {
                lines.append(&mut decoder.take(bytes)?);
                Ok(())
            })
        })?;
        let log = self.log.display().to_string();
        let mut outcome = Outcome::done();
        outcome.extend(decoder.finish()?.map(|note| format!("{log}: {note}")));
        let run = LoggedRun::of(&lines, self.rows.as_deref(), &log)?;
        self.write(format, &run).map_err(|error| {
            let (out, reason) = (self.out.display(), output::describe(&error));
            Failure::failed(format!("{out}: cannot be written: {reason}; choose another place"))
        })?;
        let facts = Facts {
            out: self.out.display().to_string(),
            rows: run.rows.len(),
            columns: &run.names,
            rows_with_events: run.events.iter().filter(|event| !event.is_empty()).count(),
        };
        if self.json {
            print_json(&facts)?;
        } else {
            let (columns, events) = (facts.columns.join(", "), facts.rows_with_events);
            print(&format!(
                "{}: {} rows of {columns}, events before {events} of them\n",
                facts.out, facts.rows
            ))?;
        }
        outcome.extend(run.notes.iter().map(|note| format!("{log}: {note}")));
        Ok(outcome)
    }

    fn write(&self, format: Format, run: &LoggedRun) -> std::io::Result<()> {
        let origin = super::origin();
        let mut metadata = Metadata::default();
        let entries = [
            ("schema", METADATA_SCHEMA.to_owned()),
            ("tool", origin.tool),
            ("tool_revision", origin.tool_revision),
            ("imported_from", self.log.display().to_string()),
            ("imported_with", self.defmt.display().to_string()),
        ];
        metadata.extend(RECORDING_GROUP, entries.map(|(name, value)| (name.to_owned(), value)));
        if let Some(path) = Metadata::file_beside(&self.out) {
            output::write_text(&path, &metadata.to_toml())?;
        }
        let mut rows = DurableFile::open(&self.out)?.begin(format, &run.columns(), &metadata)?;
        for ((time_s, values), event) in run.rows.iter().zip(&run.events) {
            rows.row(*time_s, values.iter().map(|value| Cell::Number(*value)).chain([Cell::Text(event)]))?;
        }
        let mut end = Metadata::default();
        end.extend(END_GROUP, [("rows".to_owned(), run.rows.len().to_string())]);
        rows.finish(&end)
    }
}
