//! Long work in a thread of its own, without the interpreter's lock: progress and Ctrl-C are looked for meanwhile.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Duration;

use bowden_core::outcome::Failure;
use bowden_core::progress::Progress;
use bowden_core::recording::{ReadOptions, Recording};
use bowden_core::simulate::{Motion, Reference, RunOptions};
use bowden_model::channel::Channel;
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;

use crate::errors::{Raise, raised};
use crate::recording::NativeRecording;
use crate::rig::NativeRig;

/// Time between two looks at progress and signals: short for a hand on Ctrl-C, long beside what a look costs (microseconds).
const LOOK: Duration = Duration::from_millis(50);

/// What the working thread reports of itself.
#[derive(Default)]
struct Watched {
    status: Mutex<Status>,
    ended: Condvar,
    stop: AtomicBool,
}

#[derive(Clone, Default, PartialEq)]
struct Status {
    stage: String,
    steps: u64,
    done: u64,
    over: bool,
}

impl Watched {
    fn update(&self, change: impl FnOnce(&mut Status)) {
        change(&mut self.status.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// What there is after [`LOOK`], or at once when the work ends.
    fn look(&self) -> Status {
        let status = self.status.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.ended.wait_timeout_while(status, LOOK, |status| !status.over);
        waited.unwrap_or_else(PoisonError::into_inner).0.clone()
    }
}

impl Progress for Watched {
    fn stage(&self, name: &str, steps: u64) {
        self.update(|status| *status = Status { stage: name.to_owned(), steps, done: 0, over: false });
    }

    fn advance(&self, steps: u64) {
        self.update(|status| status.done += steps);
    }

    fn interrupted(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// Ends the waiting, however the work ends.
struct AtEnd<'a>(&'a Watched);

impl Drop for AtEnd<'_> {
    fn drop(&mut self) {
        self.0.update(|status| status.over = true);
        self.0.ended.notify_all();
    }
}

/// Runs `work` to its end and calls `watcher(stage, done, steps)` meanwhile, where something changed. The second value is the exception
/// that asked the work to end early: Ctrl-C, or what `watcher` raised.
///
/// # Errors
/// No threads; a panic in the work, which is a defect of it.
pub fn run<T: Send>(
    py: Python<'_>,
    watcher: Option<&Bound<'_, PyAny>>,
    jobs: Option<usize>,
    work: impl FnOnce(&dyn Progress) -> Result<T, Failure> + Send,
) -> PyResult<(Result<T, Failure>, Option<PyErr>)> {
    let pool = match jobs {
        Some(jobs) => {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build();
            Some(pool.map_err(|error| format!("jobs={jobs}: {error}")).or_raise(py)?)
        }
        None => None,
    };
    let watched = Watched::default();
    let mut early = None;
    let result = std::thread::scope(|scope| {
        let working = scope.spawn(|| {
            let _end = AtEnd(&watched);
            match &pool {
                Some(pool) => pool.install(|| work(&watched)),
                None => work(&watched),
            }
        });
        let mut shown = Status::default();
        loop {
            let status = py.detach(|| watched.look());
            let mut looked = py.check_signals();
            if let Some(watcher) = watcher
                && status != shown
            {
                let called = watcher.call1((&status.stage, status.done, status.steps));
                looked = looked.and(called.map(|_| ()));
            }
            if let Err(error) = looked {
                watched.stop.store(true, Ordering::Relaxed);
                early.get_or_insert(error);
            }
            if status.over {
                break;
            }
            shown = status;
        }
        working.join()
    });
    match result {
        Ok(result) => Ok((result, early)),
        Err(panic) => {
            let what = panic.downcast_ref::<String>().map(String::as_str);
            let what = what.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
            let line = format!("internal error: {what}; please report this with the call that led to it");
            Err(raised(py, &Failure::failed(line)))
        }
    }
}

/// Work of which no part can be handed back when it is ended early.
fn whole<T>(py: Python<'_>, (result, early): (Result<T, Failure>, Option<PyErr>)) -> PyResult<T> {
    match early {
        Some(early) => Err(early),
        None => result.or_raise(py),
    }
}

/// What the rig's simulation answers to a recording's inputs.
#[pyfunction]
pub fn replay(
    py: Python<'_>,
    rig: &Bound<'_, NativeRig>,
    recording: &Bound<'_, NativeRecording>,
) -> PyResult<NativeRecording> {
    let (rig, recording) = (rig.get().rig(), recording.get().recording());
    let work = |progress: &dyn Progress| {
        let inputs = rig.accept_inputs(recording.clone())?;
        let mut predicted = bowden_core::replay::predict_watched(rig, &inputs, progress)?;
        predicted.add_notes(inputs.notes().to_vec());
        Ok(predicted)
    };
    whole(py, run(py, None, None, work)?).map(NativeRecording::new)
}

/// A forward run along a built-in motion, or along a reference: times, s, and angles, rad.
#[pyfunction]
#[pyo3(signature = (rig, motion, reference, seconds, rate_hz, seed))]
pub fn simulate(
    py: Python<'_>,
    rig: &Bound<'_, NativeRig>,
    motion: &str,
    reference: Option<(PyReadonlyArray1<'_, f64>, PyReadonlyArray1<'_, f64>)>,
    seconds: f64,
    rate_hz: f64,
    seed: u64,
) -> PyResult<NativeRecording> {
    let rig = rig.get().rig();
    let reference = match reference {
        Some((t_s, theta_rad)) => {
            let columns =
                [("t_s", Some(t_s.as_slice()?)), (Channel::ThetaRef.role(), Some(theta_rad.as_slice()?))];
            let recorded =
                Recording::from_columns("reference", &columns, &ReadOptions::default()).or_raise(py)?;
            Reference::of_recording(&recorded).or_raise(py)?
        }
        None => Reference::of_motion(motion_named(motion).or_raise(py)?, seconds, seed),
    };
    let options = RunOptions { seconds, rate_hz, seed };
    let work =
        |progress: &dyn Progress| bowden_core::simulate::run_watched(rig, &reference, options, progress);
    whole(py, run(py, None, None, work)?).map(NativeRecording::new)
}

fn motion_named(name: &str) -> Result<Motion, String> {
    let motions = [
        ("lab", Motion::Lab),
        ("sine", Motion::Sine),
        ("triangle", Motion::Triangle),
        ("multisine", Motion::Multisine),
        ("staircase", Motion::Staircase),
        ("rest", Motion::Rest),
    ];
    let found = motions.iter().find(|(known, _)| *known == name);
    found.map(|(_, motion)| *motion).ok_or_else(|| {
        let known: Vec<&str> = motions.iter().map(|(known, _)| *known).collect();
        format!("unknown motion `{name}`; take one of {}", known.join(", "))
    })
}
