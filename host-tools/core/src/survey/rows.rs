//! Recordings of a survey with what became of them.

use std::collections::{BTreeMap, BTreeSet};

use super::plan::Plan;
use super::store::{Store, Surveyed};
use super::task::Task;

/// What became of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Status {
    /// It was diagnosed.
    Done,
    /// It could not be; why.
    Failed(String),
    /// The survey was ended before.
    Left,
}

impl Status {
    /// In one word.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Failed(_) => "failed",
            Self::Left => "left",
        }
    }
}

/// One recording of a survey.
#[derive(Clone, Debug)]
pub struct SurveyRow<'p> {
    /// The recording.
    pub task: &'p Task,
    /// What became of it.
    pub status: Status,
    /// Its result, if it was diagnosed.
    pub surveyed: Option<Surveyed>,
}

impl<'p> SurveyRow<'p> {
    /// All recordings of a plan, in its order; what neither failed nor is left has its result in the store.
    #[must_use]
    pub fn all(
        plan: &'p Plan,
        store: &Store,
        failed: &[(String, String)],
        left: &BTreeSet<String>,
    ) -> Vec<Self> {
        let failed: BTreeMap<&str, &str> =
            failed.iter().map(|(recording, message)| (recording.as_str(), message.as_str())).collect();
        let row = |task: &'p Task| {
            let failure = failed.get(task.recording.as_str());
            let surveyed = || if left.contains(&task.recording) { None } else { store.load(task) };
            let (status, surveyed) = match failure {
                Some(message) => (Status::Failed((*message).to_owned()), None),
                None => match surveyed() {
                    Some(surveyed) => (Status::Done, Some(surveyed)),
                    None => (Status::Left, None),
                },
            };
            Self { task, status, surveyed }
        };
        plan.tasks.iter().map(row).collect()
    }

    /// Benches in order, each with its rows.
    pub fn benches<'r>(rows: &'r [SurveyRow<'p>]) -> impl Iterator<Item = (&'p str, &'r [SurveyRow<'p>])> {
        rows.chunk_by(|a, b| a.task.bench == b.task.bench).map(|rows| (rows[0].task.bench.as_str(), rows))
    }
}
