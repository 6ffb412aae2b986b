//! A recording of all that is watched, in every state of the board.

use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use bowden_core::outcome::Failure;
use bowden_core::output;
use bowden_core::recording::Format;
use bowden_host_link::capture::sidecar;
use bowden_host_link::evidence;
use bowden_host_link::hub::{Next, Reader};
use bowden_host_link::recorder::{Recorder, Tally};

/// Longest wait for a batch.
const WAKE: Duration = Duration::from_millis(100);

/// How far a recording has come, for those who look on.
#[derive(Debug, Default)]
pub struct Progress(Mutex<String>);

impl Progress {
    /// In words.
    pub fn words(&self) -> String {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn say(&self, words: String) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = words;
    }
}

/// Checks where the recording goes, before the port is opened.
///
/// # Errors
/// Exit status 2, if nothing can be written there.
pub fn check(out: &Path, inputs: &[&Path]) -> Result<Format, Failure> {
    let format = Format::for_rows(out)?;
    output::check_file(out, inputs)?;
    if format != Format::Mcap {
        output::check_file(&sidecar(out), inputs)?;
    }
    Ok(format)
}

/// Writes what the reader gets until there is no more, or the medium refuses. `shown` is the name of the file in words.
///
/// # Errors
/// Exit status 1, when the medium refuses; what it took is kept.
pub fn write(
    mut recorder: Recorder,
    shown: &str,
    reader: &Reader,
    progress: &Progress,
) -> Result<Tally, Failure> {
    let mut goes_on = true;
    while goes_on {
        match reader.next(WAKE) {
            Next::Batch(live) => {
                for tick in live.telemetry.ticks() {
                    goes_on &= recorder.tick(&tick);
                }
                progress.say(format!("{shown}: {} rows", recorder.tally().rows));
            }
            Next::Nothing => {}
            Next::Ended => break,
        }
    }
    let known = evidence::end(recorder.tally(), "the monitor was closed");
    let tally = recorder.finish(&known);
    if tally.is_err() {
        progress.say(format!("{shown}: NOT RECORDED ANY MORE"));
    }
    tally
}
