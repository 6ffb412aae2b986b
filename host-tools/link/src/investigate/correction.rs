//! The new parameters on the board: set, verified, and taken back where the joint does not follow better.

use bowden_core::outcome::Failure;
use bowden_core::recording::{ReadOptions, Recording};

use super::changes::{Changes, Correction, Origin, State};
use super::plan::{Purpose, Run};
use super::report::{Investigation, TakenBack};
use super::verification::{Followed, JointEncoder, Motion, Verification};
use super::{PARAMETERS_AFTER, PARAMETERS_BEFORE, Work, words};
use crate::ParameterSet;
use crate::capture::save_parameters;
use crate::from_rig::Transfer;

impl Work<'_> {
    /// Sets what a rig changes on the board, and checks that the joint follows its reference no worse; where it does, with the
    /// corrections of effects among them, the parameters are tried without those.
    pub(super) fn correct(
        &mut self,
        account: &mut Investigation,
        correction: &Correction,
    ) -> Result<(), Failure> {
        self.attempt(account, correction, "")?;
        let Some(parameters) = correction.without_effects(&self.given) else { return Ok(()) };
        if !account.followed_worse() || account.parameters.as_ref().is_none_or(|p| p.state != State::Restored)
        {
            return Ok(());
        }
        let old = self.driver.session.parameters().clone();
        let (_, transfer) = self.transfer(parameters.clone(), &old)?;
        if transfer.changes.is_empty() {
            return Ok(());
        }
        self.dialog
            .show("The joint followed worse; the same parameters without the corrections of effects:\n")?;
        let first = account.clone();
        let result = self.attempt(account, &parameters, "-without-effects");
        let Investigation { parameters: Some(parameters), verification: Some(verification), .. } = first
        else {
            return result;
        };
        if account.parameters.as_ref().is_some_and(|changes| changes.state == State::Set) {
            account.taken_back = Some(TakenBack { parameters, verification });
        } else {
            (account.parameters, account.verification) = (Some(parameters), Some(verification));
        }
        result
    }

    /// One attempt; `attempt` tells its recordings apart.
    fn attempt(
        &mut self,
        account: &mut Investigation,
        correction: &Correction,
        attempt: &str,
    ) -> Result<(), Failure> {
        let old = self.driver.session.parameters().clone();
        let (correction, transfer) = &self.transfer(correction.clone(), &old)?;
        self.dialog.show(&transfer.table())?;
        let changes = |state| Some(Changes::of(transfer, correction, state));
        save_parameters(&self.setup.folder.join(PARAMETERS_BEFORE), &old)?;
        let runs: Vec<Run> = account.plan.of(Purpose::Verification).cloned().collect();
        let old_encoder = JointEncoder::of(&old)?;
        if transfer.changes.is_empty() {
            account.parameters = changes(State::Unchanged);
            let before = self.follow(&runs, &format!("before{attempt}"), &old_encoder, &old_encoder)?;
            account.verification = Some(Verification::of(alone(runs, before)?));
            return Ok(());
        }
        account.parameters = changes(State::Declined);
        let question = format!("Set {} on the board?", words::parameters(transfer.changes.len()));
        if !self.dialog.may(&question)? {
            return Ok(());
        }
        // The joint's encoder may be read otherwise with the new parameters: both runs are read as with these.
        let new = old.with(&transfer.values());
        let encoder = JointEncoder::of(&new)?;
        let before = self.follow(&runs, &format!("before{attempt}"), &old_encoder, &encoder)?;
        self.driver.session.replace_parameters(&transfer.values())?;
        save_parameters(&self.setup.folder.join(PARAMETERS_AFTER), &new)?;
        account.parameters = changes(State::Set);
        let after = match self.follow(&runs, &format!("after{attempt}"), &encoder, &encoder) {
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
        let stays = correction.origin.stays(verification.effect);
        account.verification = Some(verification);
        if !stays {
            self.restore(&old, &new)?;
            account.parameters = changes(State::Restored);
        }
        Ok(())
    }

    /// What a correction changes on the board. Values that nobody stands behind and that the board does not take are left out.
    fn transfer(
        &self,
        correction: Correction,
        old: &ParameterSet,
    ) -> Result<(Correction, Transfer), Failure> {
        let file = self.setup.rig.display().to_string();
        match Transfer::new(&correction.rig, &file, old, &[]) {
            Err(refused) if correction.origin == Origin::Recalibrated => {
                self.dialog.show(&format!("recalibrated parameters are not used: {refused}\n"))?;
                let given = Correction { origin: Origin::Given, rig: self.given.clone(), ..correction };
                let transfer = Transfer::new(&given.rig, &file, old, &[])?;
                Ok((given, transfer))
            }
            transfer => Ok((correction, transfer?)),
        }
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
    use bowden_core::rig::Rig;

    use super::super::changes::Reason;
    use super::super::limits::Wishes;
    use super::super::test_joint::{rig, with_work};
    use super::super::verification::Effect;
    use super::*;

    /// Corrects the simulated joint, which conceals nothing, by a rig; returns the account, the result, and which parameters
    /// differ afterwards.
    fn correct(rig: &Rig, answer: bool) -> (Investigation, Result<(), Failure>, Vec<String>) {
        correct_by(Origin::Diagnosed, rig, answer)
    }

    fn correct_by(
        origin: Origin,
        rig: &Rig,
        answer: bool,
    ) -> (Investigation, Result<(), Failure>, Vec<String>) {
        correct_from(&[], origin, rig, answer)
    }

    /// The same where the board begins with some other parameters.
    fn correct_from(
        begin: &[(&str, f32)],
        origin: Origin,
        rig: &Rig,
        answer: bool,
    ) -> (Investigation, Result<(), Failure>, Vec<String>) {
        let unexplained = (origin == Origin::Recalibrated)
            .then(|| Reason { source: "f1_n".to_owned(), reason: "Something is left.".to_owned() });
        let correction = Correction { origin, rig: rig.clone(), unexplained };
        with_work(
            Wishes::shortest(),
            answer,
            &|_, _| unreachable!("nothing is diagnosed"),
            |work, account| {
                let index = |name| work.driver.session.parameters().find(name).unwrap().index;
                let values: Vec<(u16, f32)> =
                    begin.iter().map(|(name, value)| (index(name), *value)).collect();
                work.driver.session.replace_parameters(&values).unwrap();
                let old = work.driver.session.parameters().clone();
                let result = work.correct(account, &correction);
                account.recordings.clone_from(&work.driver.recorded);
                let now = ParameterSet::read(work.driver.session.client()).unwrap();
                let changed = old.all().iter().zip(now.all()).filter(|(old, now)| old.value != now.value);
                (account.clone(), result, changed.map(|(old, _)| old.name.as_str().to_owned()).collect())
            },
        )
    }

    fn state(account: &Investigation) -> State {
        account.parameters.as_ref().unwrap().state
    }

    #[test]
    fn parameters_with_which_the_joint_follows_worse_are_taken_back() {
        let (account, result, changed) = correct(&rig(30.0, COGGING), true);
        assert_eq!(result, Ok(()));
        let verification = account.verification.as_ref().unwrap();
        assert_eq!(verification.effect, Some(Effect::Worse), "{}", verification.in_words());
        assert_eq!((state(&account), changed), (State::Restored, Vec::new()));
        assert!(account.conclusion().starts_with("The joint followed worse"), "{}", account.conclusion());
    }

    const COGGING: &str = "effects = [\"motor_cogging\"]\n[effects.motor_cogging]\namplitude_nm = 0.25\n\
                           cycles_per_turn = 9.0\nphase_rad = 0.5\n";

    /// The board takes the tendons for softer than they are; the rig knows better, but believes in a cogging that the joint does
    /// not have.
    #[test]
    fn parameters_stay_without_the_corrections_with_which_the_joint_followed_worse() {
        let begin = [("tendon.axial_stiffness", 55_000.0)];
        let (account, result, changed) = correct_from(&begin, Origin::Diagnosed, &rig(30.0, COGGING), true);
        assert_eq!((result, state(&account)), (Ok(()), State::Set), "{}", account.conclusion());
        assert_eq!(changed, ["tendon.axial_stiffness"]);
        let verification = account.verification.as_ref().unwrap();
        assert_eq!(verification.effect, Some(Effect::Better), "{}", verification.in_words());
        let first = account.taken_back.as_ref().unwrap();
        assert_eq!(
            (first.parameters.state, first.verification.effect),
            (State::Restored, Some(Effect::Worse))
        );
        assert_eq!(account.parameters.as_ref().unwrap().rig, Origin::DiagnosedWithoutEffects);
        let conclusion = account.conclusion();
        assert!(conclusion.contains("With the corrections of the effects that were found"), "{conclusion}");
    }

    /// A quarter of a newton more pretension changes nothing of how the joint follows.
    #[test]
    fn parameters_that_do_not_help_alone_either_are_taken_back_too() {
        let (account, result, changed) = correct(&rig(30.25, COGGING), true);
        assert_eq!((result, changed), (Ok(()), Vec::new()));
        let driven = |ending: &str| account.recordings.iter().any(|recorded| recorded.file.ends_with(ending));
        assert!(driven("after.csv") && driven("after-without-effects.csv"), "{:?}", account.recordings);
        // What did not stay is told as it was first tried.
        assert_eq!((state(&account), account.taken_back.is_none()), (State::Restored, true));
        assert_eq!(account.parameters.unwrap().rig, Origin::Diagnosed);
    }

    #[test]
    fn what_the_board_cannot_correct_is_said_and_the_other_values_are_set() {
        let effects = "effects = [\"tendon_stiffening\"]\n";
        let (account, result, changed) = correct(&rig(30.25, effects), true);
        assert_eq!((result, state(&account)), (Ok(()), State::Set));
        assert_eq!(changed, ["tendon.pretension"]);
        let conclusion = account.conclusion();
        let left = "Left as it is: tendon_stiffening (the compensator takes the stiffness as constant).";
        assert!(conclusion.ends_with(left), "{conclusion}");
    }

    #[test]
    fn values_that_explain_nothing_are_taken_back_where_the_joint_follows_no_better() {
        let (account, result, changed) = correct_by(Origin::Recalibrated, &rig(30.25, "effects = []"), true);
        assert_eq!((result, state(&account), changed), (Ok(()), State::Restored, Vec::new()));
        let conclusion = account.conclusion();
        assert!(conclusion.starts_with("The joint did not follow better"), "{conclusion}");
        assert!(conclusion.ends_with("Left as it is: f1_n (Something is left.)."), "{conclusion}");
    }

    #[test]
    fn values_that_explain_nothing_and_are_out_of_range_are_left_out() {
        let (account, result, changed) = correct_by(Origin::Recalibrated, &rig(5000.0, "effects = []"), true);
        assert_eq!((result, state(&account), changed), (Ok(()), State::Unchanged, Vec::new()));
        assert_eq!(account.parameters.unwrap().rig, Origin::Given);
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
