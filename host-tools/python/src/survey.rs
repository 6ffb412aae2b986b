//! Surveys: the same plan, results and tables whoever does the work, this process or a cluster.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use bowden_core::outcome::Failure;
use bowden_core::progress::{Progress, Quiet};
use bowden_core::survey::{self, Interim, Plan, RigRule, Store, Surveyed, Task};
use pyo3::prelude::*;

use crate::errors::Raise;
use crate::work::run;

/// Which recordings a folder holds, and which rig each is of.
#[pyclass(frozen, name = "NativePlan", module = "bowden._bowden")]
pub struct NativePlan {
    plan: Plan,
    out: PathBuf,
    interim: Mutex<Interim>,
}

/// Recording, its file, bench, rig file.
type TaskParts = (String, PathBuf, String, Option<PathBuf>);

/// Recordings that could not be diagnosed, and why.
type Failures = Vec<(String, String)>;

#[pymethods]
impl NativePlan {
    #[new]
    fn new(py: Python<'_>, folder: PathBuf, rules: Vec<(String, PathBuf)>, out: PathBuf) -> PyResult<Self> {
        let rule =
            |(below, rig): (String, PathBuf)| RigRule { below: below.trim_matches('/').to_owned(), rig };
        let rules: Vec<RigRule> = rules.into_iter().map(rule).collect();
        let plan = Plan::new(&folder, &rules, &out).or_raise(py)?;
        Ok(Self { plan, out, interim: Mutex::default() })
    }

    fn __len__(&self) -> usize {
        self.plan.tasks.len()
    }

    /// Diagnoses here what is not done; numbers of diagnosed, kept and left recordings, the failures, and what asked to end early.
    fn survey(
        &self,
        py: Python<'_>,
        watcher: Option<&Bound<'_, PyAny>>,
        jobs: Option<usize>,
    ) -> PyResult<(usize, usize, usize, Failures)> {
        // As many as the command works with: the processors that this process may use.
        let workers = jobs.unwrap_or_else(rayon::current_num_threads);
        let work = |progress: &dyn Progress| survey::survey(&self.plan, &self.out, workers, progress);
        let (result, early) = run(py, watcher, None, work)?;
        if let Some(early) = early
            && !early.is_instance_of::<pyo3::exceptions::PyKeyboardInterrupt>(py)
        {
            return Err(early);
        }
        let summary = result.or_raise(py)?;
        Ok((summary.diagnosed, summary.kept, summary.left, summary.failed))
    }

    /// Recordings that are not done.
    fn pending(&self, py: Python<'_>) -> PyResult<Vec<TaskParts>> {
        let store = Store::open(&self.out).or_raise(py)?;
        let pending = || -> Vec<TaskParts> {
            let tasks = self.plan.tasks.iter().filter(|task| !store.has(task));
            let parts = |task: &Task| {
                (task.recording.clone(), task.path.clone(), task.bench.clone(), task.rig.clone())
            };
            tasks.map(parts).collect()
        };
        Ok(py.detach(pending))
    }

    /// Keeps a result that [`survey_one`] returned.
    fn keep(&self, py: Python<'_>, json: &str) -> PyResult<()> {
        let keep = || Store::open(&self.out)?.save(&Surveyed::from_json(json)?);
        py.detach(keep).or_raise(py)
    }

    /// Whether tables and page are due while the survey goes on: of `ended` recordings, kept ones among them, `failed` have no result.
    fn is_due(&self, ended: usize, failed: usize) -> bool {
        self.interim.lock().unwrap_or_else(PoisonError::into_inner).is_due(ended, failed)
    }

    /// Writes tables and page.
    fn summarise(&self, py: Python<'_>, failed: Failures, left: BTreeSet<String>) -> PyResult<PathBuf> {
        let mut failed = failed;
        let work = || -> Result<PathBuf, Failure> {
            let page = survey::summarise(&self.plan, &Store::open(&self.out)?, &mut failed, &left)?;
            let mut interim = self.interim.lock().unwrap_or_else(PoisonError::into_inner);
            interim.written(self.plan.tasks.len() - left.len());
            Ok(page)
        };
        py.detach(work).or_raise(py)
    }
}

/// Diagnoses one recording on one thread; the result is a line of JSON.
#[pyfunction]
#[pyo3(signature = (recording, path, bench, rig))]
pub fn survey_one(
    py: Python<'_>,
    recording: String,
    path: PathBuf,
    bench: String,
    rig: Option<PathBuf>,
) -> PyResult<String> {
    let task = Task { recording, path, bench, rig };
    py.detach(|| diagnosed(&task)).or_raise(py)
}

fn diagnosed(task: &Task) -> Result<String, Failure> {
    task.diagnose(&Quiet)?.to_json()
}

/// The program that results are kept under: equal for packages and commands of the same sources.
#[pyfunction]
pub fn survey_program() -> &'static str {
    survey::PROGRAM
}

/// The page of a survey in its folder.
#[pyfunction]
pub fn survey_page(folder: PathBuf) -> PathBuf {
    Path::new(&folder).join(survey::PAGE)
}
