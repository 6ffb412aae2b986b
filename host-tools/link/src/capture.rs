//! One run into one file: every tick of it, or every N-th, and what made it beside it.

use std::io::Write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use bowden_core::outcome::Failure;
use bowden_core::output;
use bowden_core::progress::{Progress, Quiet};
use bowden_core::recording::{DurableFile, END_GROUP, Format, Metadata};
use bowden_link::message::{Mode, TableReport};

use super::conversion::Conversion;
use super::course::Course;
use super::error::{CommsError, LinkError};
use super::evidence::{self, Origin};
use super::parameters::ParameterSet;
use super::raw::OrderBook;
use super::recorder::{Form, Recorder, Tally, tick_time_s};
use super::replug::Replug;
use super::rig_file::{self, Weight};
use super::ripple_table;
use super::session::{RunEnd, RunTick, Session, Stop};

/// Name under which an MCAP file keeps firmware version and parameters.
pub(super) const METADATA: &str = "bowden.parameters";

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
    /// What the recording says of itself, beside what the board says.
    pub origin: &'c Origin,
    /// Name and load of the joint, for the rig that the recording has of the board's parameters; none where its origin has one.
    pub rig: Option<(&'c str, Option<Weight>)>,
    /// How a board that was unplugged is found again; otherwise a broken link is the end.
    pub replug: Option<&'c Replug>,
}

/// Group of metadata that marks where the board was unplugged.
pub const UNPLUGGED: &str = "bowden.unplugged";

impl Capture<'_> {
    /// Opens the file, for ticks of this board.
    ///
    /// # Errors
    /// When the medium refuses, or the board lacks a parameter that samples are converted with.
    pub fn recorder(&self, session: &Session) -> Result<Recorder, Failure> {
        self.recorder_with(session, None, self.metadata(session))
    }

    /// The same, with all that goes into the ticks.
    ///
    /// # Errors
    /// As [`Capture::recorder`], or no answer.
    pub(super) fn raw_recorder(
        &self,
        session: &mut Session,
        orders: &OrderBook,
    ) -> Result<Recorder, Failure> {
        let mut metadata = self.metadata(session);
        if let TableReport::Whole(head) = session.client().ripple_table()? {
            let table = ripple_table::download(session.client(), head)?;
            let record = evidence::hexadecimal(&table.to_record());
            metadata.extend(evidence::TABLE_GROUP, [("record".to_owned(), record)]);
        }
        self.recorder_with(session, Some(orders.clone()), metadata)
    }

    fn recorder_with(
        &self,
        session: &Session,
        orders: Option<OrderBook>,
        metadata: Metadata,
    ) -> Result<Recorder, Failure> {
        let parameters = session.parameters();
        let beside = match self.format {
            Format::Mcap | Format::Parquet => Vec::new(),
            Format::Csv | Format::GzippedCsv => vec![(sidecar(self.out), parameters.to_toml())],
        };
        let conversion = Conversion::new(parameters)?;
        let rig = self.rig_draft(session)?;
        let form = Form {
            format: self.format,
            conversion,
            mode: self.mode,
            every: self.every,
            orders,
            metadata,
            rig,
            beside,
            metadata_file: Metadata::file_beside(self.out),
        };
        // Before anything moves, so that a file that cannot be written stops nothing half way.
        let file = DurableFile::open(self.out).map_err(|error| {
            let (out, reason) = (self.out.display(), output::describe(&error));
            Failure::failed(format!("{out}: cannot be written: {reason}; choose another place"))
        })?;
        Ok(Recorder::new(file, form, self.out))
    }

    fn rig_draft(&self, session: &Session) -> Result<Option<rig_file::Draft>, LinkError> {
        self.rig.map(|(name, load)| rig_file::Draft::new(name, session.parameters(), load)).transpose()
    }

    /// Takes ticks until the recording is long enough or the medium refuses.
    fn sink<'s>(
        &self,
        recorder: &'s mut Recorder,
        shown: &'s mut u64,
        progress: &'s dyn Progress,
    ) -> impl FnMut(&RunTick) -> ControlFlow<()> + 's {
        let seconds = self.seconds;
        move |tick| {
            if !recorder.tick(tick) {
                return ControlFlow::Break(());
            }
            let Some(seconds) = seconds else { return ControlFlow::Continue(()) };
            let share = recorder.tally().duration_s() / seconds;
            let step = ((share * PROGRESS_STEPS as f64) as u64).min(PROGRESS_STEPS);
            progress.advance(step - *shown);
            *shown = step;
            // Half a nanosecond is below every control period.
            if recorder.tally().duration_s() >= seconds - 5e-10 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        }
    }

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
        let mut recorder = self.recorder(session)?;
        let mut shown = 0;
        let mut end = {
            let mut sink = self.sink(&mut recorder, &mut shown, progress);
            session.run(self.mode, course, stop, &mut sink)
        };
        let mut gaps = Vec::new();
        while let (Some(replug), Err(LinkError::Comms(CommsError::Broken { .. })), Some((_, last))) =
            (self.replug.filter(|replug| replug.is_on()), &end, recorder.tally().ticks)
        {
            progress.stage("unplugged; waiting for the board", 0);
            match replug.bring_back(session, stop) {
                Ok(_) => {}
                // The broken link is what there is to say.
                Err(LinkError::Interrupted | LinkError::Comms(_)) => break,
                Err(other) => {
                    end = Err(other);
                    break;
                }
            }
            progress.stage("recording the stopped joint", 0);
            end = session.observe(stop, &mut self.sink(&mut recorder, &mut shown, &Quiet));
            gaps.push(last);
        }
        let mut known = evidence::end(recorder.tally(), &words(&end));
        if let Some(rig) = self.rig_draft(session)? {
            let bus_v = recorder.tally().bus_v.unwrap_or_default();
            known.extend(END_GROUP, [("rig".to_owned(), rig.text(bus_v))]);
        }
        if !gaps.is_empty() {
            let period_ns = recorder.tally().period_ns;
            let mark = |(number, last): (usize, &u64)| {
                (format!("after_t_s.{number}"), format!("{:?}", tick_time_s(*last, period_ns)))
            };
            known.extend(UNPLUGGED, (1..).zip(&gaps).map(mark));
        }
        let mut tally = recorder.finish(&known)?;
        tally.unplugged = gaps.len();
        tally.first_unplugged = gaps.first().copied();
        // Without a row there is nothing to keep, and what ended the run counts.
        match end {
            end if tally.rows > 0 => Ok((tally, end)),
            Err(error) => Err(error.into()),
            Ok(RunEnd::Fault(fault)) => Err(LinkError::Fault(fault).into()),
            Ok(RunEnd::Interrupted) => Err(LinkError::Interrupted.into()),
            Ok(RunEnd::Complete | RunEnd::Left(_)) => {
                let out = self.out.display();
                Err(Failure::failed(format!("{out}: cannot be written: the run gave no sample")))
            }
        }
    }

    fn metadata(&self, session: &Session) -> Metadata {
        let (greeting, port) = session.board();
        let mut metadata = evidence::of_board(greeting, port, self.origin, self.mode, self.every);
        metadata.extend(METADATA, session.parameters().metadata());
        metadata
    }
}

/// How a run ended, in words.
pub(super) fn words(end: &Result<RunEnd, LinkError>) -> String {
    match end {
        Ok(RunEnd::Complete) => "complete".to_owned(),
        Ok(RunEnd::Interrupted) => "stopped by the user".to_owned(),
        Ok(RunEnd::Fault(fault)) => fault.to_string(),
        Ok(RunEnd::Left(state)) => format!("the board went to state {state}"),
        Err(error) => error.to_string(),
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
