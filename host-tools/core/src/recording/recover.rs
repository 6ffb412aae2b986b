//! What is whole in a file that was cut or damaged, written to another file.
//!
//! | file | what a damaged byte costs |
//! |---|---|
//! | MCAP | the rows of its chunk, a quarter of a second or a megabyte of text; CRCs say which |
//! | CSV | its line, if that is no row any more; a number that became another one is not noticed |
//! | gzipped CSV | the rows of its member, a quarter of a second; of a file in one piece all rows from there on |

mod lines;
mod members;
mod scan;
mod sink;

use std::fs::File;
use std::io::{BufRead, BufReader, Seek, Write};
use std::path::Path;

use self::sink::Sink;
use super::{Format, Metadata, READ_BUFFER};
use crate::outcome::{Failure, one_line};
use crate::output;

/// What was taken out of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recovered {
    /// Rows.
    pub rows: u64,
    /// Time of the first and the last one, s.
    pub span_s: Option<(f64, f64)>,
    /// What is missing, one line each.
    pub missing: Vec<String>,
    /// What the file says beside the rows.
    pub metadata: Metadata,
}

/// Lines about single places; those beyond are counted.
const PLACES_SHOWN: usize = 20;

/// Takes everything whole out of a file and writes it to another one, whose name asks for its format.
///
/// # Errors
/// Exit status 2, if the input cannot be read or holds no whole row; 1, if the medium of the output refuses.
pub fn recover(path: &Path, out: &Path) -> Result<Recovered, Failure> {
    let format = Format::for_rows(out)?;
    let source = path.display().to_string();
    let unreadable = |error: &std::io::Error| {
        Failure::bad_input(format!("{source}: cannot be read: {}; check the path", output::describe(error)))
    };
    let mut file =
        BufReader::with_capacity(READ_BUFFER, File::open(path).map_err(|error| unreadable(&error))?);
    let start = file.fill_buf().map_err(|error| unreadable(&error))?;
    let named = Format::of(path);
    let is_gzip = start.starts_with(&super::file::GZIP_MAGIC);
    let is_mcap = start.starts_with(mcap::MAGIC) || named == Some(Format::Mcap);
    if start.is_empty() {
        return Err(Failure::bad_input(format!(
            "{source}: the file is empty, nothing can be taken out of it"
        )));
    }
    let mut recovered = Err(Failure::failed(""));
    output::write_file(out, |file_out| {
        let mut sink = Sink::new(format, file_out);
        // A file that cannot be used is said to be missing by whoever reads it.
        sink.metadata = Metadata::beside(path).unwrap_or_default();
        let taken = if is_mcap {
            file.rewind()?;
            scan::take(&mut file, &source, &mut sink)
        } else if is_gzip {
            members::take(&mut file, &source, &mut sink)
        } else {
            lines::take(&mut file, &source, &mut sink)
        };
        match taken.and_then(|missing| sink.finish(missing)) {
            Ok(result) if result.rows > 0 => {
                recovered = Ok(result);
                Ok(())
            }
            Ok(result) => {
                let why = result.missing.first().map_or(String::new(), |line| format!(" ({line})"));
                recovered = Err(Failure::bad_input(format!(
                    "{source}: no whole row is in the file{why}; recover another copy of it"
                )));
                Err(std::io::Error::other("no row"))
            }
            Err(sink::Stopped::Input(reason)) => {
                recovered = Err(Failure::bad_input(format!("{source}: {reason}")));
                Err(std::io::Error::other("no row"))
            }
            Err(sink::Stopped::Output(error)) => Err(error),
        }
    })
    // What is wrong with the input counts before what became of the output.
    .map_err(|failure| match &recovered {
        Err(of_input) if !of_input.message().is_empty() => of_input.clone(),
        _ => failure,
    })?;
    let mut recovered = recovered?;
    // Names of topics come from the file.
    recovered.missing.iter_mut().for_each(|line| *line = one_line(line));
    if let Some(beside) = Metadata::file_beside(out).filter(|_| !recovered.metadata.is_empty()) {
        output::write_file(&beside, |file| file.write_all(recovered.metadata.to_toml().as_bytes()))?;
    }
    Ok(recovered)
}

/// At most [`PLACES_SHOWN`] of the lines, and how many more there are.
fn shorten(mut lines: Vec<String>, source: &str) -> Vec<String> {
    if lines.len() > PLACES_SHOWN {
        let more = lines.len() - PLACES_SHOWN;
        lines.truncate(PLACES_SHOWN);
        lines.push(format!("{source}: {more} more damaged places"));
    }
    lines
}
