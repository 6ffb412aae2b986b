//! One recording of a survey.

use std::path::PathBuf;

/// Name of a rig file that holds for the recordings of its folder and of those below.
pub(super) const RIG_BESIDE: &str = "rig.toml";

/// One recording to be diagnosed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Task {
    /// Path below the surveyed folder, with `/` between folders.
    pub recording: String,
    /// Path of the file.
    pub path: PathBuf,
    /// Name of the bench: the folder of the recording below the surveyed one, or the name of the latter.
    pub bench: String,
    /// Rig file; `None` where none is named and none lies beside it or above.
    pub rig: Option<PathBuf>,
}
