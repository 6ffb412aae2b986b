//! Results of a survey, one file a recording.

use std::fmt::Write as _;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::task::Task;
use crate::diagnose::verdict::{Diagnosis, ResidualMap};
use crate::outcome::Failure;
use crate::output;

/// Value of `schema`.
const SCHEMA: &str = "bowden-surveyed/1";

/// The program, for a digest: its version, and a digest of the sources that a diagnosis depends on and of the versions of their dependencies.
/// Command and Python package of the same sources have the same.
pub const PROGRAM: &str = concat!("bowden ", env!("CARGO_PKG_VERSION"), " ", env!("BOWDEN_SOURCES"));

/// Folder of the results, in that of the survey.
const RESULTS: &str = "diagnoses";

/// What is kept of the diagnosis of one recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Surveyed {
    /// [`SCHEMA`].
    pub schema: String,
    /// Digest of recording, rig and program.
    pub key: String,
    /// Path below the surveyed folder.
    pub recording: String,
    /// Bench.
    pub bench: String,
    /// Samples.
    pub samples: usize,
    /// Time from the first to the last sample, s.
    pub duration_s: f64,
    /// What was lost or repaired when the recording was read.
    pub notes: Vec<String>,
    /// The diagnosis, without the map and the search: a hundred thousand of them have to be kept.
    pub diagnosis: Diagnosis,
}

impl Surveyed {
    pub(super) fn new(
        task: &Task,
        key: String,
        (samples, duration_s): (usize, f64),
        notes: Vec<String>,
        mut diagnosis: Diagnosis,
    ) -> Self {
        diagnosis.residual_map = ResidualMap::default();
        diagnosis.search = Vec::new();
        Self {
            schema: SCHEMA.to_owned(),
            key,
            recording: task.recording.clone(),
            bench: task.bench.clone(),
            samples,
            duration_s,
            notes,
            diagnosis,
        }
    }

    /// The text of its file, one line.
    ///
    /// # Errors
    /// When it cannot be written as JSON.
    pub fn to_json(&self) -> Result<String, Failure> {
        serde_json::to_string(self).map_err(|error| Failure::failed(format!("{}: {error}", self.recording)))
    }

    /// Reads the text of its file.
    ///
    /// # Errors
    /// When it is none.
    pub fn from_json(text: &str) -> Result<Self, Failure> {
        serde_json::from_str(text).map_err(|error| Failure::failed(format!("no result of a survey: {error}")))
    }
}

/// Digest of what a result is made of: the bytes of recording and rig, and the program, usually [`PROGRAM`].
pub(super) fn key_of(recording: &Path, rig: &Path, program: &str) -> Result<String, Failure> {
    let mut digest = Sha256::new();
    digest.update(format!("{program}\0"));
    for path in [rig, recording] {
        let unreadable = |error: std::io::Error| {
            let reason = output::describe(&error);
            Failure::bad_input(format!("{}: cannot be read: {reason}; check the path", path.display()))
        };
        let mut file = fs::File::open(path).map_err(unreadable)?;
        let bytes = std::io::copy(&mut file, &mut digest).map_err(unreadable)?;
        // So that no byte can move from one file to the other unseen.
        digest.update(bytes.to_le_bytes());
    }
    Ok(digest.finalize().iter().fold(String::new(), |mut text, byte| {
        // Writing to a String cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    }))
}

/// The folder of a survey.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
}

impl Store {
    /// Makes the folder if it is not there.
    ///
    /// # Errors
    /// When it cannot be made.
    pub fn open(folder: &Path) -> Result<Self, Failure> {
        output::prepare_folder(folder, &[], &[])?;
        Ok(Self { folder: folder.to_owned() })
    }

    /// The folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Whether there is a result of this program for the recording and the rig as they are now.
    #[must_use]
    pub fn has(&self, task: &Task) -> bool {
        self.has_of(task, PROGRAM)
    }

    fn has_of(&self, task: &Task, program: &str) -> bool {
        let key = task.rig.as_ref().and_then(|rig| key_of(&task.path, rig, program).ok());
        let surveyed = self.load(task);
        surveyed.is_some_and(|surveyed| Some(surveyed.key) == key && surveyed.bench == task.bench)
    }

    /// The result of a recording, whatever it was made of.
    #[must_use]
    pub fn load(&self, task: &Task) -> Option<Surveyed> {
        let text = fs::read_to_string(self.file(&task.recording)).ok()?;
        Surveyed::from_json(&text).ok()
    }

    /// Keeps a result; it appears under its name only when it is complete.
    ///
    /// # Errors
    /// When the medium refuses.
    pub fn save(&self, surveyed: &Surveyed) -> Result<(), Failure> {
        let path = self.file(&surveyed.recording);
        make_folder_of(&path)?;
        let json = surveyed.to_json()?;
        output::write_file(&path, |file| writeln!(file, "{json}"))
    }

    fn file(&self, recording: &str) -> PathBuf {
        self.folder.join(RESULTS).join(format!("{recording}.json"))
    }
}

/// Makes the folder of a file.
fn make_folder_of(path: &Path) -> Result<(), Failure> {
    let Some(folder) = path.parent() else { return Ok(()) };
    fs::create_dir_all(folder).map_err(|error| {
        Failure::failed(format!("{}: cannot be made: {}", folder.display(), output::describe(&error)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example::findings;

    #[test]
    fn a_result_is_of_recording_rig_bench_and_program() {
        let folder = tempfile::tempdir().unwrap();
        let [path, rig] = ["a.csv", "rig.toml"].map(|name| folder.path().join(name));
        fs::write(&path, "recording").unwrap();
        fs::write(&rig, "rig").unwrap();
        let task = Task {
            recording: "a.csv".to_owned(),
            path: path.clone(),
            bench: "a".to_owned(),
            rig: Some(rig.clone()),
        };
        let store = Store::open(&folder.path().join("out")).unwrap();
        assert!(!store.has(&task));
        let key = key_of(&path, &rig, PROGRAM).unwrap();
        store.save(&Surveyed::new(&task, key, (3, 1.0), Vec::new(), findings(2).diagnosis)).unwrap();
        assert!(store.has(&task));

        // Version 0.1.0 stays for many changes of the sources, each of which may change a diagnosis.
        let older = PROGRAM.replace(env!("BOWDEN_SOURCES"), &"0".repeat(64));
        assert!(older.starts_with(concat!("bowden ", env!("CARGO_PKG_VERSION"))) && older != PROGRAM);
        assert!(!store.has_of(&task, &older));
        assert!(!store.has(&Task { bench: "b".to_owned(), ..task.clone() }));
        for changed in [&path, &rig] {
            let before = fs::read(changed).unwrap();
            fs::write(changed, "changed").unwrap();
            assert!(!store.has(&task), "{}", changed.display());
            fs::write(changed, before).unwrap();
            assert!(store.has(&task));
        }
    }
}
