//! Further instances of an effect that a part has several times: the harmonics of cogging beside the strongest.
//!
//! They are no further names, and each by itself may be worth little: a torque whose reading comes late hides all but the strongest
//! until the lag is known. They are therefore added together and held to what they do together.

use bowden_model::effect::ActiveEffect;
use bowden_model::effect_set::MAX_ACTIVE;
use bowden_model::search::Starts;

use super::{Chosen, Fitted, LOSS_PER_PARAMETER, Search, WORTHWHILE_LOSS, is_further};
use crate::diagnose::locked::{Pattern, further_pattern, too_little_travel};
use crate::fit::objective::{Part, Residuals};
use crate::fit::solver::{COARSE_STEP, FINE_STEP};
use crate::fit::typical::sized;
use crate::outcome::Failure;

/// Most instances of one effect.
const MOST_INSTANCES: usize = 8;

/// Effects of a simulation that are left to other names.
const LEFT_TO_NAMES: usize = 3;

/// Share of the fitted loss that an instance takes off before anything is fitted anew, to be fitted with the others.
const PROMISING_INSTANCE: f64 = 0.01;

/// Whether instances that bring the held-out loss from `before` to `after` are worth having.
fn worth_having(before: f64, after: f64) -> bool {
    before - after > WORTHWHILE_LOSS && before - after > LOSS_PER_PARAMETER * before
}

impl Search<'_> {
    /// Adds further instances of every chosen effect that has several, where held-out data gain by them.
    pub(super) fn add_instances(
        &self,
        present: &mut Fitted,
        chosen: &mut Vec<Chosen>,
    ) -> Result<(), Failure> {
        for index in 0..chosen.len() {
            let effect = chosen[index].effect;
            if is_further(chosen, index) || effect.effect.instances_differ_in().is_none() {
                continue;
            }
            let Some((started, added)) = self.further_instances(present, &effect)? else { continue };
            self.progress.stage("fitting further instances", 0);
            let with = self.fit(started.layout, &started.solution.model, &[COARSE_STEP, FINE_STEP])?;
            let (with, added) = self.without_idle(with, added)?;
            if added == 0 || self.progress.interrupted() || !worth_having(present.loss, with.loss) {
                continue;
            }
            let places = with.solution.model.effects.len() - added..;
            chosen.extend(with.solution.model.effects[places].iter().map(|effect| Chosen {
                effect: *effect,
                model: with.without_ordinary(),
                loss_before: present.loss,
                loss_after: with.loss,
                others: Vec::new(),
            }));
            *present = with;
        }
        Ok(())
    }

    /// `with` without those of its last `added` effects that the fitted data do not miss, and how many of them are left: what an instance
    /// stood for may have gone into the periods of others once all were fitted.
    fn without_idle(&self, with: Fitted, added: usize) -> Result<(Fitted, usize), Failure> {
        let objective = self.objective;
        let loss = |residuals: &Residuals| objective.mean_loss(residuals, Part::Training);
        let mut model = with.solution.model.clone();
        let mut present = loss(&with.solution.residuals);
        let mut left = added;
        let mut by_strength: Vec<usize> = (model.effects.len() - added..model.effects.len()).collect();
        by_strength.sort_by(|a, b| {
            let strength = |index: &usize| with.solution.model.effects[*index].parameters[0].abs();
            strength(a).total_cmp(&strength(b))
        });
        let mut idle = Vec::new();
        for index in by_strength {
            let mut without = model.clone();
            without.effects[index].parameters[0] = 0.0;
            let bare = loss(&objective.residuals(&without)?);
            if bare - present < WORTHWHILE_LOSS {
                idle.push(index);
                left -= 1;
                (model, present) = (without, bare);
            }
        }
        if idle.is_empty() {
            return Ok((with, added));
        }
        idle.sort_unstable();
        for index in idle.into_iter().rev() {
            model.effects.remove(index);
        }
        Ok((self.fit(with.layout, &model, &[FINE_STEP])?, left))
    }

    /// `present` with the strongest patterns that are left, one after the other, where each takes something off the fitted loss, and
    /// how many they are; `None` where none does.
    fn further_instances(
        &self,
        present: &Fitted,
        effect: &ActiveEffect,
    ) -> Result<Option<(Fitted, usize)>, Failure> {
        let objective = self.objective;
        let Starts::LockedTo(angle) = effect.effect.starts() else { return Ok(None) };
        let instances = |fitted: &Fitted| {
            fitted.solution.model.effects.iter().filter(|other| other.is_beside(effect)).count()
        };
        let training = |fitted: &Fitted| objective.mean_loss(&fitted.solution.residuals, Part::Training);
        let mut with = present.clone();
        while instances(&with) < MOST_INSTANCES
            && with.solution.model.effects.len() + LEFT_TO_NAMES < MAX_ACTIVE
            && !self.progress.interrupted()
        {
            let model = &with.solution.model;
            let base = ActiveEffect { target: effect.target, ..sized(model, effect.effect) };
            let predictions = objective.predict(model)?;
            let found = with.layout.first_found()..;
            let there: Vec<ActiveEffect> = model.effects[found.clone()]
                .iter()
                .filter(|other| other.is_beside(effect))
                .copied()
                .collect();
            let Some(Pattern { new: start, beside }) =
                further_pattern(base, &there, angle, model, objective, &predictions)
            else {
                break;
            };
            let (layout, mut next) = with.layout.with(model, start);
            // The new one stands last, behind those beside it.
            let others = next.effects[found].iter_mut().filter(|other| other.is_beside(effect));
            others.zip(beside).for_each(|(other, beside)| *other = beside);
            let mut solution = with.solution.clone();
            solution.residuals = objective.residuals(&next)?;
            solution.model = next;
            let next = self.judged(layout, solution, false);
            let gain = training(&with) - training(&next);
            if too_little_travel(objective, &start)
                || gain < WORTHWHILE_LOSS
                || gain < PROMISING_INSTANCE * training(&with)
            {
                break;
            }
            with = next;
        }
        let added = instances(&with) - instances(present);
        Ok((added > 0).then_some((with, added)))
    }
}
