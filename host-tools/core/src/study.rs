//! A study: recordings of one or several benches that are diagnosed, fitted or checked together.

mod assemble;
mod direct;
mod file;
mod joint;

use std::path::{Path, PathBuf};

use crate::outcome::Failure;
use crate::recording::Recording;
use crate::rig::{self, Assignment, Rig, RigDocument, RigParameter};
use file::StudyFile;

/// Value of `schema` in a study file.
pub const SCHEMA: &str = "bowden-study/1";

/// Recordings that are explained together.
#[derive(Clone, Debug)]
pub struct Study {
    /// Name in reports.
    pub name: String,
    /// At least one, each with a recording.
    pub benches: Vec<Bench>,
    /// Recordings to learn from, in the order of the file, followed by those that are held out.
    pub recordings: Vec<StudyRecording>,
}

/// A bench of a study.
#[derive(Clone, Debug)]
pub struct Bench {
    /// Unique in the study; part of a file's name.
    pub name: String,
    /// What its user believes about it.
    pub rig: Rig,
    /// Parameters with a value of their own on this bench.
    pub own: Vec<RigParameter>,
}

/// What a recording of a study is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// To learn from.
    Training,
    /// A motion on which hypotheses differ most: every third second judges, so that it decides between them, and the rest is learned
    /// from, because it may show what no other recording does.
    Experiment,
    /// It judges the result and takes no other part.
    HeldOut,
}

/// A recording of a study.
#[derive(Clone, Debug)]
pub struct StudyRecording {
    /// The samples.
    pub recording: Recording,
    /// Index into the benches.
    pub bench: usize,
    /// What it is used for.
    pub role: Role,
    /// What was different in this recording.
    pub set: Vec<Assignment>,
}

impl Study {
    /// The study of one bench, with nothing different between its recordings.
    #[must_use]
    pub fn of_bench(rig: Rig, training: Vec<Recording>, heldout: Vec<Recording>) -> Self {
        let name = rig.name.clone();
        let bench = Bench { name: name.clone(), rig, own: Vec::new() };
        Self { name, benches: vec![bench], recordings: Vec::new() }
            .with(training, Role::Training)
            .with(heldout, Role::HeldOut)
    }

    /// The study with more recordings of its first bench.
    #[must_use]
    pub fn with(mut self, recordings: Vec<Recording>, role: Role) -> Self {
        let listed = |recording| StudyRecording { recording, bench: 0, role, set: Vec::new() };
        self.recordings.extend(recordings.into_iter().map(listed));
        self.recordings.sort_by_key(|recording| recording.role);
        self
    }

    /// The recordings that are used so.
    pub fn recordings_as(&self, role: Role) -> impl Iterator<Item = &Recording> {
        self.recordings.iter().filter(move |listed| listed.role == role).map(|listed| &listed.recording)
    }
}

/// A study with the files that it was read from.
#[derive(Clone, Debug)]
pub struct LoadedStudy {
    /// Benches and recordings.
    pub study: Study,
    /// Rig file of each bench.
    pub documents: Vec<RigDocument>,
    /// Every file that was read.
    pub files: Vec<PathBuf>,
}

impl LoadedStudy {
    /// Whether a path names a study file and not a recording.
    #[must_use]
    pub fn is_named_by(path: &Path) -> bool {
        path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
    }

    /// Whether a file says that it is a rig. A rig is named by an option of its own; given as a recording it would be taken for a study.
    #[must_use]
    pub fn is_rig(path: &Path) -> bool {
        Self::is_named_by(path)
            && std::fs::read_to_string(path)
                .ok()
                .and_then(|text| text.parse::<toml::Table>().ok())
                .is_some_and(|table| table.get("schema").and_then(toml::Value::as_str) == Some(rig::SCHEMA))
    }

    /// Reads a study file, its rig files and its recordings. Paths in the file are relative to its folder.
    ///
    /// # Errors
    /// One line with file, line and column: no TOML, wrong schema, unknown key, bench or parameter (with the nearest name), a
    /// bench without a recording to learn from, a recording that is listed twice, a value outside its range; also what
    /// makes a rig file or a recording unusable.
    pub fn load(path: &Path) -> Result<Self, Failure> {
        let file = StudyFile::load(path)?;
        let mut files = vec![path.to_owned()];
        let mut benches = Vec::with_capacity(file.benches.len());
        let mut documents = Vec::with_capacity(file.benches.len());
        for bench in file.benches {
            let document = RigDocument::load(&bench.rig)?;
            let rig = document.rig()?;
            if let Some((parameter, place)) =
                bench.own.iter().find(|(p, _)| p.get(&rig).is_none() && !p.is_of_effect())
            {
                return Err(Failure::bad_input(format!(
                    "{place}: `{parameter}` is not in {}; state it there or leave it out of `own`",
                    bench.rig.display()
                )));
            }
            files.push(bench.rig);
            let own = bench.own.into_iter().map(|(parameter, _)| parameter).collect();
            benches.push(Bench { name: bench.name, rig, own });
            documents.push(document);
        }
        let mut recordings = Vec::with_capacity(file.recordings.len());
        for listed in file.recordings {
            let mut rig = benches[listed.bench].rig.clone();
            for assignment in &listed.set {
                let at_place = |reason| Failure::bad_input(format!("{}: {reason}", listed.set_at));
                assignment.parameter.set(&mut rig, assignment.value).map_err(at_place)?;
            }
            recordings.push(StudyRecording {
                recording: rig.load_recording(&listed.path)?,
                bench: listed.bench,
                role: if listed.heldout { Role::HeldOut } else { Role::Training },
                set: listed.set,
            });
            files.push(listed.path);
        }
        recordings.sort_by_key(|recording| recording.role);
        Ok(Self { study: Study { name: file.name, benches, recordings }, documents, files })
    }

    /// Reads the rig file and the recordings of one bench.
    ///
    /// # Errors
    /// What makes the rig file or a recording unusable; a recording that is given twice.
    pub fn of_one_bench(rig: &Path, training: &[PathBuf], heldout: &[PathBuf]) -> Result<Self, Failure> {
        if let Some(twice) = heldout.iter().find(|path| training.iter().any(|other| is_same(other, path))) {
            return Err(Failure::bad_input(format!(
                "{}: given as training and as held out; a judge must be another recording",
                twice.display()
            )));
        }
        let document = RigDocument::load(rig)?;
        let believed = document.rig()?;
        let load = |paths: &[PathBuf]| -> Result<Vec<Recording>, Failure> {
            paths.iter().map(|path| believed.load_recording(path)).collect()
        };
        let (learned, judging) = (load(training)?, load(heldout)?);
        let files = [rig.to_owned()].into_iter().chain(training.iter().chain(heldout).cloned()).collect();
        Ok(Self { study: Study::of_bench(believed, learned, judging), documents: vec![document], files })
    }
}

/// Whether two paths lead to one file.
fn is_same(one: &Path, other: &Path) -> bool {
    one == other || one.canonicalize().is_ok_and(|one| other.canonicalize().is_ok_and(|other| one == other))
}
