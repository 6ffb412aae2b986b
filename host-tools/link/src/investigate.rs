//! The whole round on one joint: excite, record, diagnose, correct the board, and check that the joint follows better.
//!
//! | module | what |
//! |---|---|
//! | [`limits`] | what the user asks for and the board allows |
//! | [`plan`] | references within the limits |
//! | [`demand`] | angle, speed and torque that a reference asks for |
//! | [`driver`] | one run: pretension check, homing, reference, recording |
//! | [`rounds`] | diagnosis, and the experiments that separate what is left |
//! | [`changes`] | what the diagnosis changes on the board |
//! | `correction` | sets it, and takes it back where the joint does not follow better |
//! | [`verification`] | tracking error with the old and the new parameters |
//! | [`report`] | `investigation.json` and `investigate.html` |

pub mod changes;
mod correction;
pub mod demand;
pub mod driver;
mod files;
pub mod limits;
mod page;
pub mod plan;
pub mod report;
pub mod rounds;
#[cfg(test)]
mod test_joint;
pub mod verification;
mod words;

use std::path::{Path, PathBuf};

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_core::progress::Progress;
use bowden_core::rig::Rig;
use changes::Correction;
use driver::{Driver, Task};
use limits::Wishes;
use plan::{Plan, Purpose, Run};
use report::Investigation;
use rounds::{Asked, Case, Diagnosed, track_within};

use crate::Client;
use crate::course::{Course, Track};
use crate::evidence::Origin;
use crate::session::{Session, Stop};

/// Parameters of the board before anything is set, in the folder of an investigation.
pub const PARAMETERS_BEFORE: &str = "parameters.before.toml";

/// The same with what the diagnosis changes.
pub const PARAMETERS_AFTER: &str = "parameters.after.toml";

/// What is to be investigated.
pub struct Setup<'s> {
    /// Rig file: what the bench is believed to be.
    pub rig: &'s Path,
    /// Folder for everything; made if it is not there.
    pub folder: &'s Path,
    /// Limits of the user.
    pub wishes: Wishes,
    /// Ending of recordings.
    pub ending: &'s str,
    /// Every N-th control tick is recorded.
    pub every: u64,
    /// What recordings say of themselves.
    pub origin: Origin,
    /// Stop after the plan.
    pub dry_run: bool,
}

/// Shows the user what happens, and asks before it does.
pub trait Dialog {
    /// Shows a text.
    ///
    /// # Errors
    /// When it cannot be shown.
    fn show(&self, text: &str) -> Result<(), Failure>;

    /// Shows how far an investigation came, at its end or behind its plan; `text` says the same in words.
    ///
    /// # Errors
    /// When it cannot be shown.
    fn conclude(&self, _investigation: &Investigation, text: &str) -> Result<(), Failure> {
        self.show(text)
    }

    /// Whether something may happen.
    ///
    /// # Errors
    /// When nobody can be asked.
    fn may(&self, question: &str) -> Result<bool, Failure>;
}

/// Investigates the joint of a board.
///
/// # Errors
/// Exit status 2: rig or limits that cannot be used, before anything moved. Exit status 1: the user declined or stopped it, a
/// fault, a broken link; the joint is off, and what was recorded is kept with a report of how far it came.
pub fn investigate(
    setup: &Setup,
    client: Client,
    dialog: &dyn Dialog,
    stop: Stop,
    progress: &dyn Progress,
) -> Result<Outcome, Failure> {
    let rig = Rig::load(setup.rig)?;
    let session = Session::new(client)?;
    let plan = Plan::new(&session.parameters().control(), &setup.wishes)?;
    dialog.show(&format!(
        "board {}, rig {} ({})\n{}",
        session.parameters().board(),
        rig.name,
        setup.rig.display(),
        plan.table()
    ))?;
    let mut account = Investigation::new(&rig.name, session.parameters(), plan);
    if setup.dry_run {
        dialog.conclude(&account, "dry run: nothing was moved and nothing was written\n")?;
        return Ok(Outcome::done());
    }
    if !dialog.may("Move the joint along these references?")? {
        return Err(Failure::failed("not confirmed: nothing was moved and nothing was written"));
    }
    output::prepare_folder(setup.folder, &[], &[])?;
    let rig_text = std::fs::read_to_string(setup.rig).unwrap_or_default();
    let driver = Driver {
        session,
        folder: setup.folder,
        origin: Origin { rig: Some(rig_text), ..setup.origin.clone() },
        ending: setup.ending,
        every: setup.every,
        stop,
        progress,
        recorded: Vec::new(),
        notes: Vec::new(),
    };
    let mut work =
        Work { setup, given: rig, driver, dialog, diagnose: &|case, progress| case.diagnose(progress) };
    let result = work.all(&mut account);
    // Whatever went wrong: a bridge that is off stays off.
    let off = work.driver.session.off();
    account.recordings.clone_from(&work.driver.recorded);
    if let Err(failure) = result {
        account.stopped = Some(failure.message().to_owned());
        if account.recordings.is_empty() {
            return Err(failure);
        }
        let kept = match files::save(&account, setup.folder) {
            Ok(_) => format!("what was recorded is kept in {}", setup.folder.display()),
            Err(other) => other.message().to_owned(),
        };
        return Err(failure.with_note(&kept));
    }
    let page = files::save(&account, setup.folder)?;
    off?;
    dialog.conclude(&account, &format!("{}\n{}\n", account.conclusion(), page.display()))?;
    let mut outcome = Outcome::done();
    outcome.extend(work.driver.notes);
    Ok(outcome)
}

/// Diagnoses recordings: [`Case::diagnose`].
type Diagnose<'d> = &'d dyn Fn(&Case, &dyn Progress) -> Result<Diagnosed, Failure>;

/// An investigation under way.
struct Work<'w> {
    setup: &'w Setup<'w>,
    given: Rig,
    driver: Driver<'w>,
    dialog: &'w dyn Dialog,
    diagnose: Diagnose<'w>,
}

impl Work<'_> {
    fn all(&mut self, account: &mut Investigation) -> Result<(), Failure> {
        let training = self.excite(&account.plan, Purpose::Training)?;
        let validation = self.excite(&account.plan, Purpose::Validation)?;
        let found = self.rounds(account, &training, &validation)?;
        self.correct(account, &Correction::of(found, &self.given))
    }

    /// Drives along all references for a purpose.
    fn excite(&mut self, plan: &Plan, purpose: Purpose) -> Result<Vec<PathBuf>, Failure> {
        let runs = plan.of(purpose).enumerate();
        runs.map(|(index, run)| {
            let name = format!("{}-{}-{}", purpose.prefix(), index + 1, run.form);
            self.drive(&name, purpose.prefix(), run)
        })
        .collect()
    }

    fn drive(&mut self, name: &str, purpose: &str, run: &Run) -> Result<PathBuf, Failure> {
        let course = Course::OnBoard(run.reference());
        let task = Task { name, purpose, reference: &run.in_words(), course: &course, seconds: run.seconds };
        self.driver.drive(&task)
    }

    /// Diagnoses; where hypotheses are left that a motion separates, drives along it and diagnoses again.
    fn rounds(
        &mut self,
        account: &mut Investigation,
        training: &[PathBuf],
        validation: &[PathBuf],
    ) -> Result<Diagnosed, Failure> {
        let first = self.diagnose(account, "diagnosis", training, &[], validation)?;
        let mut spare_s = account.plan.spare_s();
        let mut asked = Vec::new();
        let mut driven: Vec<(&str, PathBuf)> = Vec::new();
        for experiment in &first.experiments {
            let parameters = self.driver.session.parameters().control();
            let limits = &account.plan.limits;
            let not_done = if driven.iter().any(|(words, _)| *words == experiment.words.as_str()) {
                // One motion may separate several pairs.
                None
            } else {
                match track_within(&experiment.reference, limits, spare_s, &parameters) {
                    Err(reason) => Some(reason),
                    Ok(track) => {
                        spare_s -= track.duration_s();
                        let name = format!("experiment-{}", driven.len() + 1);
                        driven.push((&experiment.words, self.experiment(&name, &experiment.words, track)?));
                        None
                    }
                }
            };
            asked.push(Asked {
                file: experiment.file.clone(),
                motion: experiment.words.clone(),
                separation: experiment.separation,
                not_done,
            });
        }
        if let Some(round) = account.rounds.last_mut() {
            round.experiments = asked;
        }
        if driven.is_empty() {
            return Ok(first);
        }
        let recordings: Vec<PathBuf> = driven.into_iter().map(|(_, recording)| recording).collect();
        self.diagnose(account, "diagnosis-2", training, &recordings, validation)
    }

    fn experiment(&mut self, name: &str, words: &str, track: Track) -> Result<PathBuf, Failure> {
        let seconds = track.duration_s();
        let course = &Course::Streamed(track);
        self.driver.drive(&Task { name, purpose: "experiment", reference: words, course, seconds })
    }

    fn diagnose(
        &mut self,
        account: &mut Investigation,
        name: &str,
        training: &[PathBuf],
        experiments: &[PathBuf],
        heldout: &[PathBuf],
    ) -> Result<Diagnosed, Failure> {
        let (limits, spare_s) = (account.plan.limits, account.plan.spare_s());
        let parameters = self.driver.session.parameters().control();
        let case = Case {
            rig: self.setup.rig,
            training,
            experiments,
            heldout,
            folder: self.setup.folder,
            name,
            allowed: &|reference| track_within(reference, &limits, spare_s, &parameters).is_ok(),
        };
        let found = (self.diagnose)(&case, self.driver.progress)?;
        self.driver.notes.extend(found.notes.iter().cloned());
        self.dialog.show(&format!("{}\n", found.findings.diagnosis.summary))?;
        account.rounds.push(found.round.clone());
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::f64::consts::TAU;

    use bowden_core::diagnose::Experiment;
    use bowden_core::diagnose::verdict::Rival;
    use bowden_core::recording::{ReadOptions, Recording};
    use bowden_model::channel::Channel;

    use super::limits::Wishes;
    use super::rounds::{Round, Summary};
    use super::test_joint::{rig, with_work};
    use super::*;
    use crate::example;

    /// A diagnosis that names `id`, and rivals which a motion of this amplitude separates from it.
    fn found(id: &str, rivals: &[&str], amplitude_rad: f64) -> Diagnosed {
        let mut findings = example::findings(100);
        let diagnosis = &mut findings.diagnosis;
        diagnosis.unexplained = None;
        diagnosis.effects.truncate(1);
        diagnosis.effects[0].id = id.to_owned();
        diagnosis.effects[0].rivals.clear();
        let mut experiments = Vec::new();
        for rival in rivals {
            let words = "a slow sine".to_owned();
            diagnosis.effects[0].rivals.push(Rival {
                id: (*rival).to_owned(),
                formula: None,
                probability: 0.4,
                separating_experiment: words.clone(),
            });
            let t_s: Vec<f64> = (0..4000).map(|k| f64::from(k) * 1e-3).collect();
            let angles = t_s.iter().map(|t_s| amplitude_rad * (TAU * 0.25 * t_s).sin()).collect();
            let reference = Recording::new("experiment", t_s).with(Channel::ThetaRef, angles);
            let file = format!("separate-{id}-from-{rival}.csv");
            experiments.push(Experiment { file, words, reference, separation: 0.7 });
        }
        let round = Round {
            folder: String::new(),
            recordings: Vec::new(),
            partly_heldout: Vec::new(),
            heldout: Vec::new(),
            diagnosis: Summary::from(&findings.diagnosis),
            experiments: Vec::new(),
        };
        Diagnosed { round, rig: rig(30.0, "effects = []"), experiments, findings, notes: Vec::new() }
    }

    /// Rounds whose first diagnosis leaves two rivals, and whose second one decides for the first of them. Returns the account, the effect that
    /// was found last, and the recordings of experiments that each diagnosis was given.
    fn rounds(amplitude_rad: f64) -> (Investigation, String, Vec<Vec<Recording>>) {
        let given = RefCell::new(Vec::new());
        let diagnose = |case: &Case, _: &dyn Progress| {
            let load = |path: &PathBuf| Recording::load(path, &ReadOptions::default()).unwrap();
            assert_eq!((case.training, case.heldout), (&["train".into()][..], &["validate".into()][..]));
            given.borrow_mut().push(case.experiments.iter().map(load).collect());
            Ok(if case.experiments.is_empty() {
                found("payload_change", &["joint_spring", "sensor_offset"], amplitude_rad)
            } else {
                found("joint_spring", &[], amplitude_rad)
            })
        };
        let (account, id) = with_work(Wishes::default(), true, &diagnose, |work, account| {
            let last = work.rounds(account, &["train".into()], &["validate".into()]).unwrap();
            account.recordings.clone_from(&work.driver.recorded);
            (account.clone(), last.findings.diagnosis.effects[0].id.clone())
        });
        (account, id, given.into_inner())
    }

    #[test]
    fn an_experiment_that_separates_two_hypotheses_is_driven_and_decides() {
        let (account, id, given) = rounds(0.2);
        assert_eq!(id, "joint_spring");
        let asked: Vec<_> = account.rounds.iter().flat_map(|round| &round.experiments).collect();
        assert_eq!((account.rounds.len(), asked.len()), (2, 2));
        assert!(asked.iter().all(|asked| asked.not_done.is_none()), "{asked:?}");
        assert_eq!(asked[0].file, "separate-payload_change-from-joint_spring.csv");
        // The motion that separates both is driven once.
        let [recorded] = &account.recordings[..] else { panic!("{:?}", account.recordings) };
        assert_eq!((recorded.file.as_str(), recorded.complete), ("experiment-1.csv", true));
        // The second diagnosis is given what the joint did along the reference.
        let [before, after] = &given[..] else { panic!("{} diagnoses", given.len()) };
        assert_eq!((before.len(), after.len()), (0, 1));
        let recording = &after[0];
        let start_s = recording.t_s()[0];
        let [reference, joint] =
            [Channel::ThetaRef, Channel::ThetaOut].map(|channel| recording.channel(channel).unwrap());
        let seen = recording.t_s().iter().zip(joint).filter(|(t_s, _)| **t_s - start_s > 1.0);
        let (low, high) = seen.fold((0.0_f64, 0.0_f64), |(l, h), (_, v)| (l.min(*v), h.max(*v)));
        assert!((-0.22..-0.18).contains(&low) && (0.18..0.22).contains(&high), "{low} to {high} rad");
        let largest = reference.iter().fold(0.0_f64, |largest, angle| largest.max(angle.abs()));
        assert!((largest - 0.2).abs() < 0.01, "{largest} rad");
    }

    #[test]
    fn an_experiment_beyond_the_limits_is_not_driven_and_the_first_diagnosis_counts() {
        let (account, id, given) = rounds(1.5);
        assert_eq!((id.as_str(), account.rounds.len(), given.len()), ("payload_change", 1, 1));
        let reason = account.rounds[0].experiments[0].not_done.as_ref().unwrap();
        assert!(reason.starts_with("it goes to "), "{reason}");
        assert_eq!(account.recordings, []);
    }
}
