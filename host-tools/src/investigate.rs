//! The whole round on one joint: excite, record, diagnose, correct the board, and check that the joint follows better.
//!
//! | module | what |
//! |---|---|
//! | [`plan`] | limits, and references within them |
//! | [`driver`] | one run: pretension check, homing, reference, recording |
//! | [`rounds`] | diagnosis, and the experiments that separate what is left |
//! | [`changes`] | what the diagnosis changes on the board |
//! | [`verification`] | tracking error with the old and the new parameters |
//! | [`report`] | `investigation.json` and `investigate.html` |

pub mod changes;
pub mod driver;
pub mod plan;
pub mod report;
pub mod rounds;
pub mod verification;
mod words;

use std::path::{Path, PathBuf};

use crate::commands::print;
use crate::link::capture::save_parameters;
use crate::link::course::Course;
use crate::link::from_rig::Transfer;
use crate::link::session::{Session, Stop};
use crate::link::{Client, ParameterSet};
use crate::outcome::{Failure, Outcome};
use crate::output;
use crate::progress::Progress;
use crate::recording::{ReadOptions, Recording};
use crate::rig::Rig;
use changes::{Changes, State, follows_diagnosis};
use driver::{Driver, Task};
use plan::{Plan, Purpose, Run, Wishes};
use report::Investigation;
use rounds::{Asked, Case, Diagnosed, track_within};
use verification::{Effect, Followed, JointEncoder, Motion, Verification};

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
    /// Stop after the plan.
    pub dry_run: bool,
}

/// Asks the user before something happens.
pub trait Ask {
    /// Whether it may happen.
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
    ask: &dyn Ask,
    stop: Stop,
    progress: &dyn Progress,
) -> Result<Outcome, Failure> {
    let rig = Rig::load(setup.rig)?;
    let session = Session::new(client)?;
    let plan = Plan::new(&session.parameters().control(), &setup.wishes)?;
    print(&format!(
        "board {}, rig {} ({})\n{}",
        session.parameters().board(),
        rig.name,
        setup.rig.display(),
        plan.table()
    ))?;
    if setup.dry_run {
        return print("dry run: nothing was moved and nothing was written\n").map(|()| Outcome::done());
    }
    if !ask.may("Move the joint along these references?")? {
        return Err(Failure::failed("not confirmed: nothing was moved and nothing was written"));
    }
    output::prepare_folder(setup.folder, &[], &[])?;
    let mut account = Investigation::new(&rig.name, session.parameters(), plan);
    let driver = Driver {
        session,
        folder: setup.folder,
        ending: setup.ending,
        every: setup.every,
        stop,
        progress,
        recorded: Vec::new(),
        notes: Vec::new(),
    };
    let mut work = Work { setup, given: rig, driver, ask };
    let result = work.all(&mut account);
    // Whatever went wrong: a bridge that is off stays off.
    let off = work.driver.session.off();
    account.recordings.clone_from(&work.driver.recorded);
    if let Err(failure) = result {
        account.stopped = Some(failure.message().to_owned());
        if account.recordings.is_empty() {
            return Err(failure);
        }
        let kept = match account.save(setup.folder) {
            Ok(_) => format!("what was recorded is kept in {}", setup.folder.display()),
            Err(other) => other.message().to_owned(),
        };
        return Err(failure.with_note(&kept));
    }
    let page = account.save(setup.folder)?;
    off?;
    print(&format!("{}\n{}\n", account.conclusion(), page.display()))?;
    let mut outcome = Outcome::done();
    outcome.extend(work.driver.notes);
    Ok(outcome)
}

/// An investigation under way.
struct Work<'w> {
    setup: &'w Setup<'w>,
    given: Rig,
    driver: Driver<'w>,
    ask: &'w dyn Ask,
}

impl Work<'_> {
    fn all(&mut self, account: &mut Investigation) -> Result<(), Failure> {
        let training = self.excite(&account.plan, Purpose::Training)?;
        let validation = self.excite(&account.plan, Purpose::Validation)?;
        let found = self.rounds(account, training, &validation)?;
        let diagnosed = follows_diagnosis(found.round.diagnosis.verdict);
        let rig = if diagnosed { found.rig } else { self.given.clone() };
        self.correct(account, &rig, diagnosed)
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
        mut training: Vec<PathBuf>,
        validation: &[PathBuf],
    ) -> Result<Diagnosed, Failure> {
        let first = self.diagnose(account, "diagnosis", &training, validation)?;
        let mut spare_s = account.plan.spare_s();
        let mut asked = Vec::new();
        let mut done = 0;
        for experiment in &first.experiments {
            let parameters = self.driver.session.parameters().control();
            let track = track_within(experiment, &account.plan.limits, spare_s, &parameters);
            let not_done = match track {
                Err(reason) => Some(reason),
                Ok(track) => {
                    let seconds = track.duration_s();
                    spare_s -= seconds;
                    done += 1;
                    let task = Task {
                        name: &format!("experiment-{done}"),
                        purpose: "experiment",
                        reference: &experiment.words,
                        course: &Course::Streamed(track),
                        seconds,
                    };
                    training.push(self.driver.drive(&task)?);
                    None
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
        if done == 0 {
            return Ok(first);
        }
        self.diagnose(account, "diagnosis-2", &training, validation)
    }

    fn diagnose(
        &mut self,
        account: &mut Investigation,
        name: &str,
        training: &[PathBuf],
        heldout: &[PathBuf],
    ) -> Result<Diagnosed, Failure> {
        let case = Case { rig: self.setup.rig, training, heldout, folder: self.setup.folder, name };
        let found = case.diagnose(self.driver.progress)?;
        self.driver.notes.extend(found.notes.iter().cloned());
        print(&format!("{}\n", found.findings.diagnosis.summary))?;
        account.rounds.push(found.round.clone());
        Ok(found)
    }

    /// Sets what a rig changes on the board, and checks that the joint follows its reference no worse.
    fn correct(&mut self, account: &mut Investigation, rig: &Rig, diagnosed: bool) -> Result<(), Failure> {
        let old = self.driver.session.parameters().clone();
        let transfer = Transfer::new(rig, &self.setup.rig.display().to_string(), &old, &[])?;
        print(&transfer.table())?;
        let changes = |state| Some(Changes::of(&transfer, diagnosed, state));
        save_parameters(&self.setup.folder.join(PARAMETERS_BEFORE), &old)?;
        let runs: Vec<Run> = account.plan.of(Purpose::Verification).cloned().collect();
        let old_encoder = JointEncoder::of(&old)?;
        if transfer.changes.is_empty() {
            account.parameters = changes(State::Unchanged);
            let before = self.follow(&runs, "before", &old_encoder, &old_encoder)?;
            account.verification = Some(Verification::of(alone(runs, before)?));
            return Ok(());
        }
        account.parameters = changes(State::Declined);
        let question = format!("Set {} on the board?", words::parameters(transfer.changes.len()));
        if !self.ask.may(&question)? {
            return Ok(());
        }
        // The joint's encoder may be read otherwise with the new parameters: both runs are read as with these.
        let new = old.with(&transfer.values());
        let encoder = JointEncoder::of(&new)?;
        let before = self.follow(&runs, "before", &old_encoder, &encoder)?;
        self.driver.session.replace_parameters(&transfer.values())?;
        save_parameters(&self.setup.folder.join(PARAMETERS_AFTER), &new)?;
        account.parameters = changes(State::Set);
        let after = match self.follow(&runs, "after", &encoder, &encoder) {
            Ok(after) => after,
            Err(failure) => {
                // Off first: some parameters are refused while the joint moves.
                let restored = self.driver.session.off().map_err(Failure::from);
                return Err(match restored.and_then(|()| self.restore(&old, &new)) {
                    Ok(()) => {
                        account.parameters = changes(State::Restored);
                        failure.with_note(&"the board has its old parameters again")
                    }
                    Err(other) => failure.with_note(&format!(
                        "the old parameters could not be put back ({other}): load {PARAMETERS_BEFORE}"
                    )),
                });
            }
        };
        let verification = Verification::of(together(runs, before, after)?);
        let worse = verification.effect == Some(Effect::Worse);
        account.verification = Some(verification);
        if worse {
            self.restore(&old, &new)?;
            account.parameters = changes(State::Restored);
        }
        Ok(())
    }

    /// Sets every parameter that differs back to its old value.
    fn restore(&mut self, old: &ParameterSet, new: &ParameterSet) -> Result<(), Failure> {
        let values: Vec<(u16, f32)> = old
            .all()
            .iter()
            .zip(new.all())
            .filter(|(old, new)| old.value != new.value)
            .map(|(old, _)| (old.index, old.value))
            .collect();
        self.driver.session.replace_parameters(&values)
    }

    /// Drives along references; the angle of the joint is the one behind what its encoder shows.
    fn follow(
        &mut self,
        runs: &[Run],
        when: &str,
        recorded: &JointEncoder,
        encoder: &JointEncoder,
    ) -> Result<Vec<Motion>, Failure> {
        let mut motions = Vec::new();
        for (index, run) in runs.iter().enumerate() {
            let name = format!("verify-{}-{}-{when}", index + 1, run.form);
            let path = self.drive(&name, &format!("verify, {when}"), run)?;
            let recording = Recording::load(&path, &ReadOptions::default())?;
            motions.push(encoder.motion(recorded, &recording)?);
        }
        Ok(motions)
    }
}

fn alone(runs: Vec<Run>, before: Vec<Motion>) -> Result<Vec<Followed>, Failure> {
    let followed = runs.into_iter().zip(before).map(|(run, motion)| {
        Ok(Followed { run, before: motion.error()?, after: None, traces: vec![motion] })
    });
    followed.collect()
}

fn together(runs: Vec<Run>, before: Vec<Motion>, after: Vec<Motion>) -> Result<Vec<Followed>, Failure> {
    let followed = runs.into_iter().zip(before).zip(after).map(|((run, before), after)| {
        let errors = (before.error()?, after.error()?);
        Ok(Followed { run, before: errors.0, after: Some(errors.1), traces: vec![before, after] })
    });
    followed.collect()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::link::sim::SimTransport;
    use crate::progress::Quiet;

    struct Answers(bool);

    impl Ask for Answers {
        fn may(&self, _question: &str) -> Result<bool, Failure> {
            Ok(self.0)
        }
    }

    /// The bench of the data sheet with `effects`, text of the rig format, that it does not have.
    fn rig(pretension_n: f64, effects: &str) -> Rig {
        let nominal = virtual_bench::nominal_rig_toml("bench");
        let text = nominal
            .replace("pretension_n = 30", &format!("pretension_n = {pretension_n}"))
            .replace("effects = []", effects);
        Rig::parse(&text, "rig.toml").unwrap()
    }

    /// Corrects the simulated joint, which conceals nothing, by a rig; returns the account, the result, and which parameters
    /// differ afterwards.
    fn correct(rig: &Rig, answer: bool) -> (Investigation, Result<(), Failure>, Vec<String>) {
        let folder = tempfile::tempdir().unwrap();
        let client = Client::connect(Box::new(SimTransport::new()), "sim", Duration::from_secs(1)).unwrap();
        let session = Session::new(client).unwrap();
        let old = session.parameters().clone();
        let plan = Plan::new(&old.control(), &Wishes::shortest()).unwrap();
        let mut account = Investigation::new(&rig.name, &old, plan);
        let setup = Setup {
            rig: Path::new("rig.toml"),
            folder: folder.path(),
            wishes: Wishes::shortest(),
            ending: "csv",
            every: 10,
            dry_run: false,
        };
        let driver = Driver {
            session,
            folder: folder.path(),
            ending: "csv",
            every: 10,
            stop: &|| false,
            progress: &Quiet,
            recorded: Vec::new(),
            notes: Vec::new(),
        };
        let mut work = Work { setup: &setup, given: rig.clone(), driver, ask: &Answers(answer) };
        let result = work.correct(&mut account, rig, true);
        let now = ParameterSet::read(work.driver.session.client()).unwrap();
        let changed = old.all().iter().zip(now.all()).filter(|(old, now)| old.value != now.value);
        (account, result, changed.map(|(old, _)| old.name.as_str().to_owned()).collect())
    }

    fn state(account: &Investigation) -> State {
        account.parameters.as_ref().unwrap().state
    }

    #[test]
    fn parameters_with_which_the_joint_follows_worse_are_taken_back() {
        let cogging = "effects = [\"motor_cogging\"]\n[effects.motor_cogging]\namplitude_nm = 0.25\n\
                       cycles_per_turn = 9.0\nphase_rad = 0.5\n";
        let (account, result, changed) = correct(&rig(30.0, cogging), true);
        assert_eq!(result, Ok(()));
        let verification = account.verification.as_ref().unwrap();
        assert_eq!(verification.effect, Some(Effect::Worse), "{}", verification.in_words());
        assert_eq!((state(&account), changed), (State::Restored, Vec::new()));
        assert!(account.conclusion().starts_with("The joint followed worse"), "{}", account.conclusion());
    }

    #[test]
    fn parameters_with_which_the_joint_cannot_run_are_taken_back() {
        // The pretension check finds 30 N where the new parameters say 50 N.
        let (account, result, changed) = correct(&rig(50.0, "effects = []"), true);
        let failure = result.unwrap_err();
        assert!(
            failure.message().contains("fault ") && failure.message().ends_with("its old parameters again"),
            "{failure}"
        );
        assert_eq!((state(&account), changed), (State::Restored, Vec::new()));
        assert_eq!(account.verification, None);
    }

    #[test]
    fn declined_parameters_are_not_set() {
        let (account, result, changed) = correct(&rig(33.0, "effects = []"), false);
        assert_eq!((result, state(&account), changed), (Ok(()), State::Declined, Vec::new()));
        let parameters = account.parameters.unwrap();
        assert_eq!(
            (parameters.changes[0].parameter.as_str(), parameters.changes[0].new),
            ("tendon.pretension", 33.0)
        );
    }

    #[test]
    fn a_rig_that_agrees_with_the_board_leaves_it_as_it_is() {
        let (account, result, changed) = correct(&rig(30.0, "effects = []"), true);
        assert_eq!((result, state(&account), changed), (Ok(()), State::Unchanged, Vec::new()));
        let verification = account.verification.unwrap();
        assert!(verification.effect.is_none() && verification.before_rms_rad > 0.0);
    }
}
