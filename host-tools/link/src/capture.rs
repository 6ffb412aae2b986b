//! One run into one file: every tick of it, or every N-th, and what made it beside it.

use std::io::{self, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use bowden_core::outcome::Failure;
use bowden_core::output;
use bowden_core::progress::Progress;
use bowden_core::recording::{Format, RowWriter};
use bowden_link::message::Mode;

use super::conversion::{Conversion, columns};
use super::course::Course;
use super::error::LinkError;
use super::parameters::ParameterSet;
use super::recorder::{Recorder, Tally};
use super::session::{RunEnd, Session, Stop};

/// Name under which an MCAP file keeps firmware version and parameters.
const METADATA: &str = "bowden.parameters";

/// Steps of the progress of a run of known length.
pub const PROGRESS_STEPS: u64 = 100;

/// Where a run is recorded, and how much of it.
#[derive(Clone, Debug)]
pub struct Capture<'c> {
    /// Recording to write.
    pub out: &'c Path,
    /// Its format.
    pub format: Format,
    /// What is controlled.
    pub mode: Mode,
    /// Only every N-th tick is written.
    pub every: u64,
    /// Length of the run, s; `None`: until it ends by itself or by the user.
    pub seconds: Option<f64>,
}

impl Capture<'_> {
    /// From ready: runs along the course and writes the recording. It is kept whatever ended the run, unless it is empty.
    ///
    /// # Errors
    /// When the medium refuses, or the run ended before its first sample.
    pub fn run(
        &self,
        session: &mut Session,
        course: &Course,
        stop: Stop,
        progress: &dyn Progress,
    ) -> Result<(Tally, Result<RunEnd, LinkError>), Failure> {
        let conversion = Conversion::new(session.parameters())?;
        let metadata = session.parameters().metadata();
        let mut end = None;
        let mut tally = Tally::default();
        let written = output::write_file(self.out, |file| {
            let writer =
                RowWriter::new(self.format, &columns(Some(self.mode)), Some((METADATA, metadata)), file)?;
            let mut recorder = Recorder::new(writer, conversion, self.mode, self.every);
            let mut refusal = None;
            let mut shown = 0;
            end = Some(session.run(self.mode, course, stop, &mut |tick| {
                if let Err(error) = recorder.tick(tick) {
                    refusal = Some(error);
                    return ControlFlow::Break(());
                }
                let Some(seconds) = self.seconds else { return ControlFlow::Continue(()) };
                let share = recorder.tally().duration_s() / seconds;
                let step = ((share * PROGRESS_STEPS as f64) as u64).min(PROGRESS_STEPS);
                progress.advance(step - shown);
                shown = step;
                // Half a nanosecond is below every control period.
                if recorder.tally().duration_s() >= seconds - 5e-10 {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            }));
            if let Some(error) = refusal {
                return Err(error);
            }
            tally = recorder.finish()?;
            if tally.rows == 0 { Err(io::Error::other("the run gave no sample")) } else { Ok(()) }
        });
        match (written, end) {
            (Ok(()), Some(end)) => Ok((tally, end)),
            // Without a row there is nothing to keep, and what ended the run counts.
            (Err(_), Some(Err(error))) => Err(error.into()),
            (Err(_), Some(Ok(RunEnd::Fault(fault)))) => Err(LinkError::Fault(fault).into()),
            (Err(_), Some(Ok(RunEnd::Interrupted))) if tally.rows == 0 => Err(LinkError::Interrupted.into()),
            (Err(failure), _) => Err(failure),
            (Ok(()), None) => Err(Failure::failed("the run did not begin; run it again")),
        }
    }
}

/// Writes firmware version and parameters to a file.
///
/// # Errors
/// When the medium refuses.
pub fn save_parameters(path: &Path, parameters: &ParameterSet) -> Result<(), Failure> {
    let text = parameters.to_toml();
    output::write_file(path, |file| file.write_all(text.as_bytes()))
}

/// File beside a recording that says which firmware and parameters made it; an MCAP file holds them itself.
#[must_use]
pub fn sidecar(out: &Path) -> PathBuf {
    let name = out.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let stem = [".csv.gz", ".csv"]
        .iter()
        .find(|ending| name.to_ascii_lowercase().ends_with(*ending))
        .map_or(name.as_str(), |ending| &name[..name.len() - ending.len()]);
    out.with_file_name(format!("{stem}.parameters.toml"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sidecar_stands_beside_the_recording() {
        for (out, expected) in [
            ("a/run.csv", "a/run.parameters.toml"),
            ("run.2.CSV.GZ", "run.2.parameters.toml"),
            ("b/x.csv.gz", "b/x.parameters.toml"),
        ] {
            assert_eq!(sidecar(Path::new(out)), Path::new(expected));
        }
    }
}
