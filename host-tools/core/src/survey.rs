//! A survey: every recording of a folder is diagnosed by itself, and the results are put side by side.
//!
//! Results are kept one file a recording in `DIR/diagnoses/`, with a digest of what they were made of, so that a survey that was ended goes
//! on where it stopped, and one that is run again does what has changed. From them come tables (Parquet) and one page:
//!
//! | file | one row |
//! |---|---|
//! | `recordings.parquet` | a recording: bench, status, verdict, held-out loss |
//! | `effects.parquet` | an effect or law that was named in a recording, and since which one the bench has it |
//! | `parameters.parquet` | a parameter of a recording: recalibrated, or of a named effect |
//! | `drifts.parquet` | a recalibrated parameter of a bench over its recordings |
//! | `survey.html` | the benches side by side |
//!
//! Tables and page are also written while the survey goes on, each time a tenth of what they hold is new ([`Interim`]).
//!
//! Equal recordings and rigs give equal files, bit for bit, whoever did the work and in which order. Each diagnosis runs on one thread and as
//! many run at once as there are workers: several threads would wait for each other within a diagnosis.

mod drift;
mod interim;
mod occurrences;
mod page;
mod parquet_file;
mod plan;
mod rows;
mod single;
mod store;
mod tables;
mod task;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::outcome::Failure;
use crate::output;
use crate::progress::Progress;

pub use drift::{Drift, drifts};
pub use interim::Interim;
pub use plan::{Plan, RigRule};
pub use rows::{Status, SurveyRow};
pub use store::{PROGRAM, Store, Surveyed};
pub use task::Task;

/// The page of a survey, in its folder.
pub const PAGE: &str = "survey.html";

/// What became of a survey.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Recordings that were diagnosed now.
    pub diagnosed: usize,
    /// Recordings whose result was there already.
    pub kept: usize,
    /// Recordings that could not be diagnosed, and why.
    pub failed: Vec<(String, String)>,
    /// Recordings that are still to be done: the survey was ended early.
    pub left: usize,
}

/// What became of the recordings that were to be diagnosed, so far.
#[derive(Default)]
struct Ended {
    diagnosed: BTreeSet<String>,
    failed: Vec<(String, String)>,
}

impl Ended {
    /// Recordings of which neither is known.
    fn left(&self, pending: &[&Task]) -> BTreeSet<String> {
        let failed: BTreeSet<&String> = self.failed.iter().map(|(recording, _)| recording).collect();
        let ended = |recording: &String| self.diagnosed.contains(recording) || failed.contains(recording);
        pending.iter().map(|task| &task.recording).filter(|recording| !ended(recording)).cloned().collect()
    }
}

/// Diagnoses what is not done yet, and writes tables and page: at the end, and in between whenever [`Interim`] says so. A recording that
/// cannot be diagnosed, or whose diagnosis panics, stops no other one.
///
/// # Errors
/// When no recording could be diagnosed, with the reason of the first; when the medium refuses.
pub fn survey(plan: &Plan, out: &Path, workers: usize, progress: &dyn Progress) -> Result<Summary, Failure> {
    let store = Store::open(out)?;
    let pending: Vec<&Task> = plan.tasks.iter().filter(|task| !store.has(task)).collect();
    let kept = plan.tasks.len() - pending.len();
    progress.stage("diagnosing recordings", pending.len() as u64);
    let next = AtomicUsize::new(0);
    let ended = Mutex::new(Ended::default());
    let interim = Mutex::new(Interim::default());
    // Tables and page for what there is. Only a worker that finds nobody writing writes, so none waits.
    let follow = || -> Result<(), Failure> {
        let Ok(mut interim) = interim.try_lock() else { return Ok(()) };
        let (mut failed, left) = {
            let ended = lock(&ended);
            let failed = ended.failed.len();
            if !interim.is_due(kept + ended.diagnosed.len() + failed, failed) {
                return Ok(());
            }
            (ended.failed.clone(), ended.left(&pending))
        };
        summarise(plan, &store, &mut failed, &left)?;
        interim.written(plan.tasks.len() - left.len());
        Ok(())
    };
    let work = || -> Result<(), Failure> {
        while let Some(task) = pending.get(next.fetch_add(1, Ordering::Relaxed))
            && !progress.interrupted()
        {
            match task.diagnose(&Silent(progress)) {
                Ok(surveyed) if surveyed.diagnosis.complete => {
                    store.save(&surveyed)?;
                    lock(&ended).diagnosed.insert(surveyed.recording);
                }
                // Ended early: nothing to keep.
                Ok(_) => break,
                Err(failure) => {
                    lock(&ended).failed.push((task.recording.clone(), failure.message().to_owned()));
                }
            }
            follow()?;
            progress.advance(1);
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        let working: Vec<_> =
            (0..workers.clamp(1, pending.len().max(1))).map(|_| scope.spawn(work)).collect();
        working.into_iter().try_for_each(|worker| {
            worker
                .join()
                .unwrap_or_else(|_| Err(Failure::failed("a worker ended by a defect of this program")))
        })
    })?;
    let mut ended = ended.into_inner().unwrap_or_else(PoisonError::into_inner);
    let left = ended.left(&pending);
    summarise(plan, &store, &mut ended.failed, &left)?;
    Ok(Summary { diagnosed: ended.diagnosed.len(), kept, failed: ended.failed, left: left.len() })
}

/// What a mutex holds, also after a panic: no holder leaves it half changed.
fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Writes tables and page from the results that are there, but for those that `left` names; `failed` is put in the order of the plan.
///
/// # Errors
/// When there is no result, with the reason of the first failure; when the medium refuses.
pub fn summarise(
    plan: &Plan,
    store: &Store,
    failed: &mut [(String, String)],
    left: &BTreeSet<String>,
) -> Result<PathBuf, Failure> {
    let places: BTreeMap<&str, usize> =
        plan.tasks.iter().enumerate().map(|(place, task)| (task.recording.as_str(), place)).collect();
    failed.sort_by_key(|(recording, _)| places.get(recording.as_str()));
    let rows = SurveyRow::all(plan, store, failed, left);
    if rows.iter().all(|row| row.surveyed.is_none()) {
        return Err(match failed.first() {
            Some((_, message)) => {
                Failure::bad_input(format!("no recording could be diagnosed; the first: {message}"))
            }
            None => Failure::failed("ended before the first recording was done; run it again to go on"),
        });
    }
    tables::write(&rows, store.folder())?;
    let page = store.folder().join(PAGE);
    let html = page::render(&plan.name, &rows);
    output::write_file(&page, |file| std::io::Write::write_all(file, html.as_bytes()))?;
    Ok(page)
}

/// Shows no stages of the single diagnoses, which run side by side.
struct Silent<'a>(&'a dyn Progress);

impl Progress for Silent<'_> {
    fn stage(&self, _name: &str, _steps: u64) {}

    fn advance(&self, _steps: u64) {}

    fn interrupted(&self) -> bool {
        self.0.interrupted()
    }
}
