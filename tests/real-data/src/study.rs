//! Studies of the data sets in `host-tools/studies`: what `bowden diagnose` is given, and how well its answer predicts recordings that took
//! no part in it.
//!
//! Their rig files state what can be read off a bench or its data sheet. People who knew the recordings chose the parts of each bench, which of
//! its parameters are its own, and the recordings that are held out; the diagnosis chooses the physics.

use std::fs;
use std::path::{Path, PathBuf};

use bowden_core::diagnose::diagnose;
use bowden_core::diagnose::verdict::Diagnosis;
use bowden_core::joint_model::JointModel;
use bowden_core::outcome::Failure;
use bowden_core::progress::Quiet;
use bowden_core::recording::Recording;
use bowden_core::replay::predict;
use bowden_core::rig::{Rig, RigDocument};
use bowden_core::study::{LoadedStudy, Role, StudyRecording};
use bowden_model::channel::Channel;

use super::{Table, mean, root_mean_square, unusable};

/// Folder of the studies.
fn studies() -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "..", "..", "host-tools", "studies"].iter().collect()
}

/// A study of a data set, ready to be diagnosed.
#[derive(Clone, Debug)]
pub struct RealStudy {
    loaded: LoadedStudy,
    /// What `bowden` is asked, in a line.
    asked: String,
}

impl RealStudy {
    /// The study in `folder` of `host-tools/studies`, with the recordings of a data set.
    ///
    /// # Errors
    /// When a file is missing or cannot be used with its rig.
    pub fn load(folder: &str, recordings: &Path) -> Result<Self, Failure> {
        // A study's paths are relative to its own folder.
        let failed = |error: std::io::Error| Failure::failed(format!("{folder}: {error}"));
        let together = tempfile::tempdir().map_err(failed)?;
        for source in [studies().join(folder), recordings.to_owned()] {
            for entry in fs::read_dir(&source).map_err(|error| unusable(&source, error))? {
                let entry = entry.map_err(failed)?;
                let name = entry.file_name();
                if Path::new(&name).extension().is_some_and(|end| end == "csv" || end == "toml") {
                    let text = fs::read(entry.path()).map_err(failed)?;
                    fs::write(together.path().join(name), text).map_err(failed)?;
                }
            }
        }
        let loaded = LoadedStudy::load(&together.path().join("study.toml"))?;
        Ok(Self { loaded, asked: format!("bowden diagnose studies/{folder}/study.toml") })
    }

    /// The same with the recordings of these names held out and no others.
    #[must_use]
    pub fn judged_by(mut self, heldout: &[&str]) -> Self {
        for listed in &mut self.loaded.study.recordings {
            let judges = heldout.contains(&name_of(&listed.recording).as_str());
            listed.role = if judges { Role::HeldOut } else { Role::Training };
        }
        self.loaded.study.recordings.sort_by_key(|listed| listed.role);
        self.asked = format!("{}, held out {}", self.asked, heldout.join(", "));
        self
    }

    /// The same with one bench alone.
    #[must_use]
    pub fn of_bench(mut self, name: &str) -> Self {
        let LoadedStudy { study, documents, .. } = &mut self.loaded;
        let index = study.benches.iter().position(|bench| bench.name == name);
        let kept = |other: usize| Some(other) == index;
        study.recordings.retain(|listed| kept(listed.bench));
        study.recordings.iter_mut().for_each(|listed| listed.bench = 0);
        let mut place = 0..;
        study.benches.retain(|_| place.next().is_some_and(kept));
        let mut place = 0..;
        documents.retain(|_| place.next().is_some_and(kept));
        self.asked = format!("{}, bench {name} alone", self.asked);
        self
    }

    /// Numbers of benches and of recordings.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        [self.loaded.study.benches.len(), self.loaded.study.recordings.len()]
    }

    /// Makes the diagnosis and replays what was held out.
    ///
    /// # Errors
    /// When a rig cannot be driven.
    pub fn diagnose(&self) -> Result<Answer, Failure> {
        let LoadedStudy { study, documents, .. } = &self.loaded;
        let diagnosed = diagnose(study, &[], &Quiet)?;
        let mut documents = documents.clone();
        for (bench, document) in documents.iter_mut().enumerate() {
            diagnosed.write_into(bench, document)?;
        }
        let rigs: Vec<Rig> = documents.iter().map(RigDocument::rig).collect::<Result<_, _>>()?;
        let mut heldout = Vec::new();
        for listed in study.recordings.iter().filter(|listed| listed.role == Role::HeldOut) {
            let rig = &study.benches[listed.bench].rig;
            let [stated, found] = [rig, &rigs[listed.bench]].map(|rig| errors(rig, listed));
            for ((channel, stated), (_, found)) in stated?.into_iter().zip(found?) {
                heldout.push(Score { recording: name_of(&listed.recording), channel, stated, found });
            }
        }
        Ok(Answer { asked: self.asked.clone(), diagnosis: diagnosed.findings.diagnosis, heldout })
    }
}

/// Diagnoses studies and writes what comes out.
///
/// # Errors
/// See [`RealStudy::diagnose`].
pub fn answers<const N: usize>(
    studies: &[RealStudy; N],
    print: &mut impl FnMut(String),
) -> Result<[Answer; N], Failure> {
    let answers: Result<Vec<Answer>, Failure> = studies.iter().map(RealStudy::diagnose).collect();
    let answers = answers?;
    for answer in &answers {
        print(answer.said());
    }
    <[Answer; N]>::try_from(answers).map_err(|_| Failure::failed("a study was lost"))
}

/// Name of the file of a recording, without `.csv`.
fn name_of(recording: &Recording) -> String {
    let stem = Path::new(recording.source()).file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

/// Error of a channel over one recording, in its unit; an arbitrary zero is taken off as the mean difference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Error {
    /// Root mean square.
    pub root_mean_square: f64,
    /// Mean of the absolute value.
    pub mean_absolute: f64,
}

/// Errors of every output of `rig` over a recording.
fn errors(rig: &Rig, listed: &StudyRecording) -> Result<Vec<(Channel, Error)>, Failure> {
    let mut rig = rig.clone();
    for assignment in &listed.set {
        assignment.apply(&mut rig)?;
    }
    let recording = &listed.recording;
    let model = JointModel::from_rig(&rig, recording)?;
    let predicted = predict(&rig, recording)?;
    let of = |channel: &Channel| -> Option<(Channel, Error)> {
        let pairs = recording.channel(*channel)?.iter().zip(predicted.channel(*channel)?);
        let differences: Vec<f64> = pairs.map(|(measured, predicted)| measured - predicted).collect();
        let zero = if model.free_offsets.contains(channel) { mean(differences.iter().copied()) } else { 0.0 };
        let errors = || differences.iter().map(|difference| difference - zero);
        let error = Error {
            root_mean_square: root_mean_square(errors()),
            mean_absolute: mean(errors().map(f64::abs)),
        };
        Some((*channel, error))
    };
    Ok(model.outputs.iter().filter_map(of).collect())
}

/// How far a channel of a held-out recording is from its simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// Name of the recording.
    pub recording: String,
    /// What is compared.
    pub channel: Channel,
    /// By the rig file of the study.
    pub stated: Error,
    /// By the rig file that the diagnosis wrote.
    pub found: Error,
}

/// Four digits behind the point, or of its own order where these would not show it.
fn short(value: f64) -> String {
    if value == 0.0 || value.abs() >= 0.01 { format!("{value:.4}") } else { format!("{value:.3e}") }
}

/// What a diagnosis came to.
#[derive(Clone, Debug)]
pub struct Answer {
    asked: String,
    /// The diagnosis.
    pub diagnosis: Diagnosis,
    /// Every output of every recording that was held out as a whole.
    pub heldout: Vec<Score>,
}

impl Answer {
    /// Root mean square error that the diagnosis says it leaves on `channel` where it is held out, the first 0.3 s of a recording apart; not a
    /// number if the channel is not compared.
    #[must_use]
    pub fn left(&self, channel: Channel) -> f64 {
        self.diagnosis.fit.channels.get(channel.role()).map_or(f64::NAN, |fit| fit.after_rmse)
    }

    /// Mean over held-out recordings, each from its first sample, of the mean absolute error that is left on `channel`.
    #[must_use]
    pub fn mean_absolute_left(&self, channel: Channel) -> f64 {
        let of = self.heldout.iter().filter(|score| score.channel == channel);
        mean(of.map(|score| score.found.mean_absolute))
    }

    /// Question, verdict, named physics and held-out errors.
    #[must_use]
    pub fn said(&self) -> String {
        let Self { asked, diagnosis, heldout } = self;
        let mut lines = vec![asked.clone(), format!("  {}", diagnosis.summary)];
        for effect in &diagnosis.effects {
            let on = effect.channel.as_ref().map_or(String::new(), |channel| format!(" on {channel}"));
            let values: Vec<String> = effect
                .parameters
                .iter()
                .map(|(name, value)| format!("{name} {}", short(value.value)))
                .collect();
            lines.push(format!(
                "  named: {}{on}, probability {:.2}, {}",
                effect.id,
                effect.probability,
                values.join(", ")
            ));
            for instance in &effect.further {
                let values: Vec<String> =
                    instance.iter().map(|(name, value)| format!("{name} {}", short(value.value))).collect();
                lines.push(format!("    and {}", values.join(", ")));
            }
        }
        if let Some(unexplained) = &diagnosis.unexplained {
            lines.push(format!("  unexplained: {}", unexplained.sentence));
        }
        let mut table =
            Table::new(&["held out, root mean square", "rig as given", "recalibrated", "diagnosed"]);
        for (channel, fit) in &diagnosis.fit.channels {
            let values = [fit.before_rmse, fit.recalibrated_rmse, fit.after_rmse];
            table.row([channel.clone()].into_iter().chain(values.map(|value| format!("{value:.4}"))));
        }
        for score in heldout {
            let values =
                [Some(score.stated), None, Some(score.found)].map(|error| error.map(|e| e.root_mean_square));
            let name = format!("{} of {}, whole", score.channel.role(), score.recording);
            let values = values.map(|value| value.map_or(String::new(), |value| format!("{value:.4}")));
            table.row([name].into_iter().chain(values));
        }
        format!("{}\n{table}", lines.join("\n"))
    }
}
