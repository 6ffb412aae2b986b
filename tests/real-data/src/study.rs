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

    /// The same with the recording of this name held out and no other.
    ///
    /// # Errors
    /// When there is no such recording.
    pub fn judged_by(mut self, heldout: &str) -> Result<Self, Failure> {
        for listed in &mut self.loaded.study.recordings {
            let judges = name_of(&listed.recording) == heldout;
            listed.role = if judges { Role::HeldOut } else { Role::Training };
        }
        self.loaded.study.recordings.sort_by_key(|listed| listed.role);
        if self.heldout().next().is_none() {
            return Err(self.lacks("recording", heldout));
        }
        self.asked = format!("{}, held out {heldout}", self.asked);
        Ok(self)
    }

    /// The same with these benches alone.
    ///
    /// # Errors
    /// When there is no such bench.
    pub fn of_benches(mut self, names: &[&str]) -> Result<Self, Failure> {
        let place = |name: &&str| {
            let found = self.loaded.study.benches.iter().position(|bench| bench.name == *name);
            found.ok_or_else(|| self.lacks("bench", name))
        };
        let kept: Vec<usize> = names.iter().map(place).collect::<Result<_, _>>()?;
        let LoadedStudy { study, documents, .. } = &mut self.loaded;
        study.benches = kept.iter().map(|bench| study.benches[*bench].clone()).collect();
        *documents = kept.iter().map(|bench| documents[*bench].clone()).collect();
        study.recordings.retain(|listed| kept.contains(&listed.bench));
        for listed in &mut study.recordings {
            listed.bench = kept.iter().position(|bench| *bench == listed.bench).unwrap_or_default();
        }
        self.asked = format!("{}, bench {} alone", self.asked, names.join(" and "));
        Ok(self)
    }

    /// The recordings that are held out as a whole.
    fn heldout(&self) -> impl Iterator<Item = &StudyRecording> {
        self.loaded.study.recordings.iter().filter(|listed| listed.role == Role::HeldOut)
    }

    /// Numbers of benches and of recordings.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        [self.loaded.study.benches.len(), self.loaded.study.recordings.len()]
    }

    /// Index of the bench of a recording, and its rig with what is different in the recording.
    ///
    /// # Errors
    /// When there is no such recording.
    pub fn stated(&self, recording: &str) -> Result<(usize, Rig), Failure> {
        let study = &self.loaded.study;
        let listed = study.recordings.iter().find(|listed| name_of(&listed.recording) == recording);
        let listed = listed.ok_or_else(|| self.lacks("recording", recording))?;
        Ok((listed.bench, with_what_is_set(&study.benches[listed.bench].rig, listed)?))
    }

    fn lacks(&self, what: &str, name: &str) -> Failure {
        Failure::bad_input(format!("{}: no {what} {name}", self.asked))
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
        for listed in self.heldout() {
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

/// `rig` with what is different in a recording.
fn with_what_is_set(rig: &Rig, listed: &StudyRecording) -> Result<Rig, Failure> {
    let mut rig = rig.clone();
    listed.set.iter().try_for_each(|assignment| assignment.apply(&mut rig))?;
    Ok(rig)
}

/// Errors of every output of `rig` over a recording.
fn errors(rig: &Rig, listed: &StudyRecording) -> Result<Vec<(Channel, Error)>, Failure> {
    let rig = with_what_is_set(rig, listed)?;
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
            let [on, of] = [("on", &effect.channel), ("of", &effect.bench)]
                .map(|(word, what)| what.as_ref().map_or(String::new(), |what| format!(" {word} {what}")));
            let values: Vec<String> = effect
                .parameters
                .iter()
                .map(|(name, value)| format!("{name} {}", short(value.value)))
                .collect();
            lines.push(format!(
                "  named: {}{on}{of}, probability {:.2}, {}",
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The servo's study, whose recordings are beside it.
    fn servo() -> RealStudy {
        RealStudy::load("xl330-pendulum", &studies().join("xl330-pendulum")).unwrap()
    }

    /// The diagnosis leaves its first 0.3 s out, and says 0.1580 rad. Without what a recording sets, gains would be wrong by up to eight.
    #[test]
    fn a_held_out_recording_is_replayed_with_what_it_sets() {
        let study = servo();
        let rig = &study.loaded.study.benches[0].rig;
        let all: Vec<Error> = study.heldout().map(|listed| errors(rig, listed).unwrap()[0].1).collect();
        assert_eq!(all.len(), 4);
        let total = root_mean_square(all.iter().map(|error| error.root_mean_square));
        assert!((total / 0.1580 - 1.0).abs() < 0.04, "{total}");
        assert!(all.iter().all(|error| error.mean_absolute < error.root_mean_square), "{all:?}");
    }

    /// By hand: an angle that is 0.3 rad too large everywhere changes nothing where its zero is arbitrary.
    #[test]
    fn an_arbitrary_zero_is_no_error() {
        let study = servo();
        let listed = study.heldout().next().unwrap();
        let mut rig = study.loaded.study.benches[0].rig.clone();
        let mut shifted = listed.clone();
        let angle = listed.recording.channel(Channel::ThetaOut).unwrap();
        shifted.recording.set(Channel::ThetaOut, angle.iter().map(|theta| theta + 0.3).collect());
        let of = |rig: &Rig, listed: &StudyRecording| errors(rig, listed).unwrap()[0].1.root_mean_square;
        assert!(of(&rig, &shifted) > of(&rig, listed) + 0.1);
        rig.free_offsets = vec![Channel::ThetaOut];
        assert!((of(&rig, &shifted) - of(&rig, listed)).abs() < 1e-9);
    }

    #[test]
    fn a_study_is_judged_by_a_recording_and_has_a_bench_of_its_own() {
        let judged = servo().judged_by("xl330_kp400_sin_sin_10h29m14").unwrap();
        let names: Vec<String> = judged.heldout().map(|listed| name_of(&listed.recording)).collect();
        assert_eq!(
            (names.as_slice(), judged.size()),
            (&["xl330_kp400_sin_sin_10h29m14".to_owned()][..], [1, 11])
        );
        assert_eq!(servo().of_benches(&["xl330"]).unwrap().size(), [1, 11]);
        let refused = [servo().judged_by("ddp"), servo().of_benches(&["ddp"])];
        let reasons = refused.map(|refused| refused.unwrap_err().to_string());
        let asked = "bowden diagnose studies/xl330-pendulum/study.toml";
        assert_eq!(reasons, [format!("{asked}: no recording ddp"), format!("{asked}: no bench ddp")]);
    }
}
