//! Selection of laws, in place of named effects or in addition to them. Laws are tried once no further effect is found, and must reduce the
//! loss by more than an effect must.

use super::trying::drives_tendons;
use super::{Explanation, Fitted, Kind, PROMISING, Round, Search, Worth, remove};
use crate::diagnose::candidates::seen_on;
use crate::diagnose::law_candidates::law_candidates;
use crate::diagnose::policy::{POLICY, Policy};
use crate::diagnose::unexplained::unexplained;
use crate::fit::solver::{COARSE_STEP, FINE_STEP};
use crate::outcome::Failure;

/// Maximum number of laws.
const MOST_LAWS: usize = 2;

/// Minimum estimated reduction of the loss by a law, relative to that of the effects it would replace, for it to be fitted.
pub(super) const RIVALLING: f64 = 0.5;

impl Search<'_> {
    /// Searches laws, in place of the named effects and then in addition to them. `nothing` is the fit without effects.
    pub(super) fn with_laws(
        &self,
        nothing: &Fitted,
        now: &mut Explanation,
        rounds: &mut Vec<Round>,
    ) -> Result<(), Failure> {
        self.laws_in_place_on_benches(now, rounds)?;
        if self.law_in_place_of_names(nothing, now, rounds)? {
            self.add_names(now, rounds, Policy::worth_naming)?;
        }
        self.add_laws(now, rounds)
    }

    /// Replaces the effects that one bench of several has by one law that predicts its recordings clearly better, for each such bench: errors
    /// of several of its sensors may stand for one thing that acts on all.
    pub(super) fn laws_in_place_on_benches(
        &self,
        now: &mut Explanation,
        rounds: &mut Vec<Round>,
    ) -> Result<(), Failure> {
        for bench in self.objective.benches() {
            let Explanation { fit: present, chosen } = &mut *now;
            let of_bench = |place: &usize| chosen[*place].effect.bench == Some(bench);
            let places: Vec<usize> = (0..chosen.len()).filter(of_bench).collect();
            let better: Worth = if places.len() > 1 { Policy::worth_naming } else { Policy::worth_stating };
            if places.is_empty() || self.progress.interrupted() {
                continue;
            }
            let (layout, without) = present.without(&places);
            let rest = self.fit(layout, &without, &[COARSE_STEP, FINE_STEP])?;
            let before = self.without_exhausted(&rest)?;
            let removed_share = 1.0 - present.loss_on(Some(bench)) / before.loss_on(Some(bench));
            let predictions = self.objective.predict(&before.solution.model)?;
            let (objective, seen) = seen_on(bench, self.objective, &predictions);
            let all = law_candidates(Some(bench), &before.without_ordinary(), &objective, &seen);
            let promising = (RIVALLING * removed_share).max(PROMISING);
            let (record, fits) = self.best_of(&before, &predictions, &all, promising, None)?;
            rounds.push(Round { loss_before: before.loss, candidates: record });
            if let Some((found, with)) = self.found(&before, &rest, fits, Policy::worth_stating)?
                && with
                    .shows_anywhere(present, &with.newest(), |without, with| better(&POLICY, without, with))
            {
                remove(chosen, &places);
                chosen.push(found);
                *present = with;
            }
        }
        Ok(())
    }

    /// Replaces all named effects, or all but the first, by one law that predicts clearly better, and returns whether it did. Against one
    /// effect the law must reach [`Policy::worth_stating`]; against several, what a name must achieve.
    /// `nothing` is the fit without effects.
    fn law_in_place_of_names(
        &self,
        nothing: &Fitted,
        now: &mut Explanation,
        rounds: &mut Vec<Round>,
    ) -> Result<bool, Failure> {
        let Explanation { fit: present, chosen } = now;
        for kept in 0..chosen.len().min(2) {
            let replaced = &chosen[kept..];
            let several = replaced.len() > 1;
            let better: Worth = if several { Policy::worth_naming } else { Policy::worth_stating };
            if self.progress.interrupted() || !better(&POLICY, present.loss, 0.0) {
                return Ok(false);
            }
            let beside = match chosen.first().filter(|_| kept == 1) {
                Some(first) => {
                    let (layout, with) = nothing.layout.with(&nothing.solution.model, first.effect);
                    self.fit(layout, &with, &[COARSE_STEP, FINE_STEP])?
                }
                None => nothing.clone(),
            };
            let before = self.without_exhausted(&beside)?;
            let removed_share = 1.0 - present.loss / before.loss;
            let promising = (RIVALLING * removed_share).max(PROMISING);
            let names_loss = drives_tendons(&present.solution.model).then_some(present.loss);
            let (record, fits) = self.one_more(&before, Kind::Law, promising, names_loss)?;
            rounds.push(Round { loss_before: before.loss, candidates: record });
            if let Some((found, with)) = self.found(&before, &beside, fits, Policy::worth_stating)?
                && with.shows(present, &with.newest(), |without, with| better(&POLICY, without, with))
            {
                chosen.truncate(kept);
                chosen.push(found);
                *present = with;
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Adds laws that reach their threshold, and removes effects that a law makes superfluous: such an effect was only the nearest
    /// entry of the catalogue.
    fn add_laws(&self, now: &mut Explanation, rounds: &mut Vec<Round>) -> Result<(), Failure> {
        for _ in 0..MOST_LAWS {
            if self.progress.interrupted() || !POLICY.worth_stating(now.fit.loss, 0.0) {
                break;
            }
            // If a free form has already located a remaining structure, a law of that component needs no more than an effect.
            let left = unexplained(self.objective, None, &now.fit.solution.model)?;
            let before = self.without_exhausted(&now.fit)?;
            let tried = self.one_more(&before, Kind::Law, PROMISING, None)?;
            let there = |fitted: &Fitted| {
                let component = fitted.newest().descriptor().component.name();
                left.as_ref().is_some_and(|left| left.component == component)
            };
            let is_there = tried.1.first().is_some_and(there);
            let worth: Worth = if is_there { Policy::worth_naming } else { Policy::worth_stating };
            if !self.add_best(&before, tried, now, rounds, worth)? {
                break;
            }
            self.prune(now)?;
            // Beside the law an effect may show that is worth little without it.
            self.add_names(now, rounds, Policy::worth_naming_in_doubt)?;
        }
        Ok(())
    }
}
