//! `bowden recover`: takes everything whole out of a recording that was cut or damaged.

use std::path::PathBuf;

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_core::recording::{Format, recover};
use serde::Serialize;

use super::{print, print_json};
use crate::progress::under_way;

/// Arguments of `bowden recover`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "A damaged byte in an MCAP file costs the rows of its chunk, in a CSV its line, in a gzipped CSV all rows behind \
                  it. What is missing is said on stderr, and the exit status is 3; it is 0 for a file that is whole."
)]
pub struct RecoverArguments {
    /// Recording that was cut or damaged (.csv, .csv.gz, .mcap)
    input: PathBuf,
    /// File to write; its name's ending gives the format: .csv, .csv.gz or .mcap
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Print JSON: one object
    #[arg(long)]
    json: bool,
}

/// What was taken out of a recording.
#[derive(Serialize)]
struct Facts {
    out: String,
    rows: u64,
    /// Time of the first and the last row.
    span_s: Option<(f64, f64)>,
    missing: Vec<String>,
}

impl RecoverArguments {
    /// Reads what is whole and writes it.
    ///
    /// # Errors
    /// Exit status 2, if the input holds no whole row or the output is not usable; 1, if the medium refuses.
    pub fn run(&self, quiet: bool) -> Result<Outcome, Failure> {
        Format::for_rows(&self.out)?;
        output::check_file(&self.out, &[&self.input])?;
        let recovered = under_way(quiet, "recovering", || recover(&self.input, &self.out))?;
        let facts = Facts {
            out: self.out.display().to_string(),
            rows: recovered.rows,
            span_s: recovered.span_s,
            missing: recovered.missing,
        };
        if self.json {
            print_json(&facts)?;
        } else {
            let (first_s, last_s) = facts.span_s.unwrap_or_default();
            print(&format!("{}: {} rows, t_s = {first_s:?} to {last_s:?}\n", facts.out, facts.rows))?;
        }
        let mut outcome = Outcome::done();
        outcome.extend(facts.missing);
        Ok(outcome)
    }
}
