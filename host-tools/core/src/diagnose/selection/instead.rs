//! Effects in place of the change of a nominal parameter.
//!
//! A parameter that has moved to make up for an effect that is like it leaves little for that effect to improve, and what it would leave with the
//! parameter where it was cannot be foretold from slopes: the parameter is held there, and the effect fitted in its place.

use bowden_model::effect::ActiveEffect;

use super::{Chosen, Explanation, Fitted, Round, Search, Selected, Worth};
use crate::diagnose::hypotheses::Asked;
use crate::diagnose::policy::POLICY;
use crate::diagnose::taken_up::taken_up;
use crate::fit::objective::Objective;
use crate::fit::solver::{COARSE_STEP, FINE_STEP};
use crate::joint_model::JointModel;
use crate::outcome::Failure;
use crate::progress::Quiet;
use crate::rig::RigParameter;

/// A parameter that is held, and its value.
pub(in crate::diagnose) type Held = (RigParameter, f64);

impl Search<'_> {
    /// Adds effects that a larger parameter has taken up, where no tension shows which of the two it is, and those that are found beside them.
    pub(super) fn add_taken_up(
        &self,
        now: &mut Explanation,
        rounds: &mut Vec<Round>,
        worth: Worth,
    ) -> Result<(), Failure> {
        let named: Vec<ActiveEffect> = now.chosen.iter().map(|one| one.effect).collect();
        for (held, ids) in taken_up(self.believed, &now.fit.solution.model, &named) {
            let present = &now.fit;
            let mut fits = self.with_held(present, held, &ids)?;
            if fits.is_empty() || self.progress.interrupted() {
                continue;
            }
            let best = fits.remove(0);
            let mut freed = best.solution.model;
            freed.own.untold.clone_from(&self.believed.own.untold);
            let freed = self.with_ordinary(self.fit(best.layout, &freed, &[FINE_STEP])?)?;
            let worth_it = |without, with| worth(&POLICY, without, with);
            if freed.shows(present, &freed.newest(), worth_it)
                && self.holds_across_recordings(present, &freed, worth_it)?
            {
                let others = fits.iter().map(|fitted| fitted.tried(fitted.loss)).collect();
                now.chosen.push(Chosen::newest_of(&freed, present, others));
                now.fit = freed;
                self.add_names(now, rounds, worth)?;
            }
        }
        Ok(())
    }

    /// Fits of `present` with a parameter held at a value and each of the effects `ids`, best first.
    fn with_held(
        &self,
        present: &Fitted,
        (parameter, value): Held,
        ids: &[&str],
    ) -> Result<Vec<Fitted>, Failure> {
        let held = |model: &JointModel| {
            let mut held = model.clone();
            held.set_value(&parameter, value);
            // What is untold is not fitted.
            held.own.untold.push(parameter);
            held
        };
        let search = Search { believed: &held(self.believed), ..*self };
        let without =
            search.fit(present.layout.clone(), &held(&present.solution.model), &[COARSE_STEP, FINE_STEP])?;
        let is_it = |start: &ActiveEffect| ids.contains(&start.descriptor().id) && start.bench.is_none();
        let mut fits = search.one_of(&without, is_it, present.loss)?;
        // Stick and slip make coarse fits of dry friction differ by more than they tell.
        for coarse in fits.iter_mut().filter(|fitted| !fitted.finished) {
            *coarse = search.finish(coarse)?;
        }
        fits.sort_by(Fitted::best_first);
        Ok(fits)
    }
}

impl Selected {
    /// Those of the effects `ids` that explain the recordings as well as a parameter that has moved away from where it is held: the loss
    /// is not worse by what pays ([`POLICY`]). `believed` is the model of the rig file at the resolution of the search.
    ///
    /// # Errors
    /// When the model cannot be driven.
    pub fn instead_of(
        &self,
        held: Held,
        ids: &[&str],
        objective: &Objective,
        believed: &JointModel,
    ) -> Result<Vec<ActiveEffect>, Failure> {
        let search = Search { objective, believed, asked: &Asked::default(), progress: &Quiet };
        let fits = search.with_held(&self.present, held, ids)?;
        let as_well = fits.iter().filter(|fitted| !POLICY.pays(fitted.loss, self.present.loss));
        Ok(as_well.map(Fitted::newest).collect())
    }
}
