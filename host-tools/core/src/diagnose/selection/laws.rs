//! Selection of laws, in place of named effects or in addition to them. Laws are tried once no further effect is found, and must reduce the
//! loss by more than an effect must.

use bowden_model::effect::ActiveEffect;

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
const RIVALLING: f64 = 0.5;

/// Minimum estimated reduction of the loss for a law to be fitted in place of effects, `named` first among them, which remove `removed_share`.
///
/// Estimates follow straight lines, and fall short where an effect is strong and bends them: a spring that was promised 55 % removed 95 %. A law of
/// the same part is asked for no more than the effect itself was promised.
pub(super) fn rivalling(rounds: &[Round], named: &ActiveEffect, removed_share: f64) -> f64 {
    let reached = |round: &Round| {
        let attempted = round.candidates.iter().find(|attempted| attempted.effect.is_beside(named))?;
        Some(attempted.promised / (1.0 - attempted.loss? / round.loss_before))
    };
    let short = rounds.iter().find_map(reached).filter(|short| *short > 0.0).unwrap_or(1.0).min(1.0);
    (RIVALLING * short * removed_share).max(PROMISING)
}

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
            let promising = rivalling(rounds, &chosen[places[0]].effect, removed_share);
            let predictions = self.objective.predict(&before.solution.model)?;
            let (objective, seen) = seen_on(bench, self.objective, &predictions);
            let all = law_candidates(Some(bench), &before.without_ordinary(), &objective, &seen);
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
            let promising = rivalling(rounds, &replaced[0].effect, removed_share);
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
            // Beside the law an effect may show that is worth little without it; so may what its form misses, an eccentric encoder of 10 mrad for a
            // range that rubs with other edges, and it has to reach what a law must.
            self.add_names(now, rounds, Policy::worth_stating)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use bowden_model::effect::Target;
    use bowden_model::effects::find;

    use super::super::Attempted;
    use super::*;

    /// Half of the share that is removed where the effect kept its promise, and less by as much as it was promised too little.
    #[test]
    fn a_law_is_asked_for_no_more_than_the_effect_was_promised() {
        let spring = ActiveEffect::with_defaults(find("joint_spring").unwrap());
        let other = ActiveEffect { target: Target::Tensions, ..spring };
        let round = |promised: f64, loss: Option<f64>| {
            let candidates = vec![
                Attempted { effect: other, promised: 0.01, loss: Some(9.0) },
                Attempted { effect: spring, promised, loss },
            ];
            vec![Round { loss_before: 20.0, candidates }]
        };
        for (rounds, least) in [
            // 0.4 of 0.8 that was removed.
            (round(0.4, Some(4.0)), 0.25 * 0.8),
            (round(0.9, Some(4.0)), 0.5 * 0.8),
            // Tried first, and fitted, in the second round alone.
            ([round(0.1, None), round(0.4, Some(4.0))].concat(), 0.25 * 0.8),
            (Vec::new(), 0.5 * 0.8),
            (round(0.4, Some(25.0)), 0.5 * 0.8),
        ] {
            let found = rivalling(&rounds, &spring, 0.8);
            assert!((found - least).abs() < 1e-12, "{found}, expected {least}");
        }
        assert_eq!(rivalling(&[], &spring, 1e-3), PROMISING);
    }
}
