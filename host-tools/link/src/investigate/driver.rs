//! The joint under an investigation: one call drives it along a reference and leaves a recording.

use std::path::{Path, PathBuf};

use bowden_core::outcome::Failure;
use bowden_core::progress::Progress;
use bowden_core::recording::Format;
use bowden_link::message::Mode;
use serde::Serialize;

use crate::capture::{Capture, PROGRESS_STEPS};
use crate::course::Course;
use crate::evidence::Origin;
use crate::session::{RunEnd, Session, Stop};

/// A recording that an investigation made.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Recorded {
    /// Name in the folder.
    pub file: String,
    /// What it is for.
    pub purpose: String,
    /// The reference in words.
    pub reference: String,
    /// Length, s; shorter than planned where the run was stopped.
    pub seconds: f64,
    /// Rows.
    pub rows: u64,
    /// Whether the run went to its end.
    pub complete: bool,
}

/// What is to be driven.
pub struct Task<'t> {
    /// Name of the recording without ending.
    pub name: &'t str,
    /// What it is for.
    pub purpose: &'t str,
    /// The reference in words.
    pub reference: &'t str,
    /// The reference.
    pub course: &'t Course,
    /// Length, s.
    pub seconds: f64,
}

/// Board and folder.
pub struct Driver<'d> {
    /// The board.
    pub session: Session,
    /// Where recordings go.
    pub folder: &'d Path,
    /// What recordings say of themselves.
    pub origin: Origin,
    /// Ending of recordings: `csv`, `csv.gz`, `mcap`.
    pub ending: &'d str,
    /// Every N-th tick is written.
    pub every: u64,
    /// Whether the user wants to stop.
    pub stop: Stop<'d>,
    /// Display.
    pub progress: &'d dyn Progress,
    /// What was recorded.
    pub recorded: Vec<Recorded>,
    /// Samples that were lost.
    pub notes: Vec<String>,
}

impl Driver<'_> {
    /// Checks the pretension, moves the joint to zero, drives it along a reference and records it. The bridge is off afterwards.
    ///
    /// # Errors
    /// Fault, Ctrl-C, refusal, broken link or medium; what was recorded of the run is kept.
    pub fn drive(&mut self, task: &Task) -> Result<PathBuf, Failure> {
        let Task { name, purpose, reference, course, seconds } = task;
        let out = self.folder.join(format!("{name}.{}", self.ending));
        self.progress.stage("pretension check and homing", 0);
        self.session.ready(self.stop)?;
        self.session.home(self.stop)?;
        self.progress.stage(name, PROGRESS_STEPS);
        let format = Format::for_rows(&out)?;
        let origin = Origin { reference: Some((*reference).to_owned()), ..self.origin.clone() };
        let capture = Capture {
            out: &out,
            format,
            mode: Mode::Position,
            every: self.every,
            seconds: Some(*seconds),
            origin: &origin,
            rig: None,
            replug: None,
        };
        let (tally, end) = capture.run(&mut self.session, course, self.stop, self.progress)?;
        self.recorded.push(Recorded {
            file: out.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            purpose: (*purpose).to_owned(),
            reference: (*reference).to_owned(),
            seconds: tally.duration_s(),
            rows: tally.rows,
            complete: matches!(end, Ok(RunEnd::Complete)),
        });
        let losses = *self.session.client().losses();
        self.notes.extend(tally.loss(&losses).map(|loss| format!("{}: {loss}", out.display())));
        let during = format!("during {name}, after {:.3} s", tally.duration_s());
        match end {
            Ok(RunEnd::Complete) => Ok(out),
            Ok(RunEnd::Interrupted) => Err(Failure::failed(format!("stopped by the user {during}"))),
            Ok(RunEnd::Fault(fault)) => Err(Failure::failed(format!("{fault} ({during})"))),
            Ok(RunEnd::Left(state)) => {
                Err(Failure::failed(format!("the board went to state {state} {during}; see `bowden faults`")))
            }
            Err(error) => Err(Failure::failed(format!("{error} ({during})"))),
        }
    }
}
