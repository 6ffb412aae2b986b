//! `bowden record`: runs a joint on its board and records every control tick.

use std::path::{Path, PathBuf};

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_core::progress::Progress;
use bowden_core::recording::{Format, Metadata};
use bowden_host_link::capture::{Capture, PROGRESS_STEPS, sidecar};
use bowden_host_link::course::Course;
use bowden_host_link::evidence::Origin;
use bowden_host_link::raw_capture;
use bowden_host_link::recorder::Tally;
use bowden_host_link::rig_file::{self, Draft, Weight};
use bowden_host_link::session::{RunEnd, Session};
use bowden_host_link::{LinkError, ParameterSet};
use serde::Serialize;

use super::course::{CourseArguments, run_seconds};
use super::port::{PortArguments, ReplugArguments};
use super::{print, print_json};
use crate::interrupt;

/// Arguments of `bowden record`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "The board checks itself and the pretension first; the bridge is off again at the end, also after an \
                  error or Ctrl-C. t_s is the board's time since it was switched on; samples that were lost leave gaps \
                  in it, and the exit status is 3. Beside a CSV stand NAME.parameters.toml with firmware version and \
                  parameters, and NAME.recording.toml with both and time, tool, board and note; an MCAP file holds them itself."
)]
pub struct RecordArguments {
    #[command(flatten)]
    port: PortArguments,
    #[command(flatten)]
    replug: ReplugArguments,
    /// Recording to write (.csv, .csv.gz, .mcap)
    #[arg(long, value_name = "REC.csv")]
    out: PathBuf,
    /// Length of the run, s; otherwise as long as the reference file, or until Ctrl-C
    #[arg(long, value_parser = run_seconds)]
    seconds: Option<f64>,
    #[command(flatten)]
    course: CourseArguments,
    /// Move the joint to angle zero first
    #[arg(long)]
    home: bool,
    /// Set the parameters that a file names first, as `bowden params load` does
    #[arg(long, value_name = "FILE.toml")]
    parameters: Option<PathBuf>,
    /// Record all that goes into every tick as well, from a known start in off on, for `bowden replay-control`
    #[arg(long, conflicts_with_all = ["every", "replug"])]
    raw: bool,
    /// Record every N-th control tick
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    every: u64,
    /// What is to be remembered of this run; it stands in the recording
    #[arg(long, value_name = "TEXT")]
    note: Option<String>,
    /// Write a rig file from the board's parameters, for `bowden diagnose` and the like
    #[arg(long, value_name = "RIG.toml")]
    rig: Option<PathBuf>,
    /// Weight on the arm and its distance from the axis, for the rig file and the rig in the recording: the board does not know it
    #[arg(long, value_name = "KG,M")]
    load: Option<Weight>,
    /// Print JSON: one object
    #[arg(long)]
    json: bool,
}

/// What was recorded.
#[derive(Serialize)]
struct Facts {
    out: String,
    rows: u64,
    duration_s: f64,
    /// Time from one control tick to the next, us.
    tick_us: f64,
}

impl RecordArguments {
    /// Runs and records.
    ///
    /// # Errors
    /// Exit status 2, if an output or the port is not usable or the joint cannot do the reference; 1, if the board refused, a fault stopped the joint, or the
    /// link broke. What was recorded until then is kept.
    pub fn run(&self, progress: &dyn Progress) -> Result<Outcome, Failure> {
        let format = Format::for_rows(&self.out)?;
        let inputs: Vec<&Path> = self.course.file().into_iter().chain(self.parameters.as_deref()).collect();
        output::check_file(&self.out, &inputs)?;
        let mut others = vec![self.out.clone()];
        others.extend((format != Format::Mcap).then(|| sidecar(&self.out)));
        others.extend(Metadata::file_beside(&self.out));
        for path in others.iter().skip(1).chain(&self.rig) {
            output::check_file(path, &inputs)?;
        }
        if let Some(rig) = self.rig.as_ref().filter(|rig| others.contains(rig)) {
            let rig = rig.display();
            return Err(Failure::bad_input(format!(
                "--rig {rig}: another output has this name; choose another"
            )));
        }
        let course = self.course.course()?;
        let seconds = match (&course, self.seconds) {
            (_, Some(seconds)) => Some(seconds),
            (Course::Streamed(track), None) => Some(track.duration_s()),
            (Course::OnBoard(_), None) => None,
        };
        interrupt::catch()?;
        let stop = &interrupt::requested;

        let mut client = self.port.connect()?;
        if let Some(path) = &self.parameters {
            let parameters = ParameterSet::read(&mut client)?;
            parameters.write(&mut client, &parameters.load(path)?)?;
        }
        let mut session = Session::new(client)?;
        let replug = self.port.replug(self.replug);
        self.course.check(&course, &session.parameters().control())?;
        if !self.raw {
            progress.stage("self test and pretension check", 0);
            session.ready(stop)?;
            if self.home {
                progress.stage("homing", 0);
                session.home(stop)?;
            }
            progress.stage("recording", if seconds.is_some() { PROGRESS_STEPS } else { 0 });
        }
        let name = self.out.file_stem().map_or("joint".into(), |name| name.to_string_lossy());
        let origin =
            Origin { note: self.note.clone(), reference: Some(self.course.words()), ..super::origin() };
        let capture = Capture {
            out: &self.out,
            format,
            mode: self.course.mode(),
            every: self.every,
            seconds,
            origin: &origin,
            rig: Some((&name, self.load)),
            replug: Some(&replug),
        };
        let (tally, end) = if self.raw {
            raw_capture::run(&capture, &mut session, &course, self.home, stop, progress)?
        } else {
            capture.run(&mut session, &course, stop, progress)?
        };

        let parameters = session.parameters();
        if let Some(path) = &self.rig {
            let rig = Draft::new(&name, parameters, self.load)?;
            rig_file::save(path, &rig.text(tally.bus_v.unwrap_or_default()))?;
        }
        let losses = *session.client().losses();
        self.conclude(&tally, end, seconds, tally.loss(&losses))
    }

    /// What the run amounts to.
    fn conclude(
        &self,
        tally: &Tally,
        end: Result<RunEnd, LinkError>,
        seconds: Option<f64>,
        loss: Option<String>,
    ) -> Result<Outcome, Failure> {
        let out = self.out.display();
        let kept = format!("{out}: {} rows over {:.3} s are kept", tally.rows, tally.duration_s());
        let mut outcome = Outcome::done();
        match end {
            Ok(RunEnd::Complete) => {}
            Ok(RunEnd::Interrupted) => {
                if let Some(seconds) = seconds {
                    outcome.extend([format!("{kept}; stopped by the user before {seconds} s were over")]);
                }
            }
            Ok(RunEnd::Fault(fault)) => return Err(Failure::failed(format!("{fault}; {kept}"))),
            Ok(RunEnd::Left(state)) => {
                return Err(Failure::failed(format!(
                    "the board went to state {state} during the run; {kept}; see `bowden faults`"
                )));
            }
            Err(error) => return Err(Failure::failed(format!("{error}; {kept}"))),
        }
        outcome.extend(tally.absences().map(|absences| format!("{out}: {absences}")));
        outcome.extend(loss.map(|loss| format!("{out}: {loss}")));
        let facts = Facts {
            out: out.to_string(),
            rows: tally.rows,
            duration_s: tally.duration_s(),
            tick_us: f64::from(tally.period_ns) * 1e-3,
        };
        if self.json {
            print_json(&facts)?;
        } else {
            let Facts { rows, duration_s, tick_us, .. } = facts;
            print(&format!("{out}: {rows} rows over {duration_s:.3} s, tick {tick_us:.1} us\n"))?;
        }
        Ok(outcome)
    }
}
