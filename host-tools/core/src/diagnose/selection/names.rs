//! Steps of the selection, forward and backward: named effects are added one by one, and removed where later ones make them superfluous. Laws
//! are judged by the same steps.

use rayon::prelude::*;

use super::{
    Attempted, Chosen, Explanation, FINALISTS, Fitted, Kind, PROMISING, Round, Search, Tried, Worth,
    instances, is_further, remove,
};
use crate::diagnose::policy::POLICY;
use crate::outcome::Failure;

/// Maximum number of named effects.
const MOST_EFFECTS: usize = 6;

/// Times that effects are added after moments of others have moved.
const MOST_MOVES: usize = 3;

/// Losses of a round in which a nuisance term at its upper bound was left out.
#[derive(Clone, Copy)]
struct Losses {
    /// Without the nuisance term, before the round.
    before: f64,
    /// Without the nuisance term, with the candidate.
    with: f64,
    /// With the nuisance term, before the round.
    ordinary: f64,
    /// With the nuisance term and the candidate.
    with_both: f64,
}

impl Losses {
    /// Whether the candidate is selected: it reaches the threshold, and either fits better than the nuisance term or reaches the threshold
    /// in addition to it.
    fn found(self, worth: Worth) -> bool {
        worth(&POLICY, self.before, self.with)
            && (self.replaces_ordinary() || worth(&POLICY, self.ordinary, self.with_both))
    }

    fn replaces_ordinary(self) -> bool {
        self.with < self.ordinary
    }
}

impl Search<'_> {
    /// Adds effects one by one while one reaches the threshold `worth`, and removes those that later ones make superfluous.
    pub(super) fn add_names(
        &self,
        now: &mut Explanation,
        rounds: &mut Vec<Round>,
        worth: Worth,
    ) -> Result<(), Failure> {
        for _ in 0..MOST_MOVES {
            self.add_while_worth(now, rounds, worth)?;
            if !self.find_moments_again(now)? {
                break;
            }
        }
        self.choose_kinds_again(now)?;
        self.exchange(now)?;
        if self.progress.interrupted() { Ok(()) } else { self.prune(now) }
    }

    /// Adds effects one by one while one reaches the threshold.
    fn add_while_worth(
        &self,
        now: &mut Explanation,
        rounds: &mut Vec<Round>,
        worth: Worth,
    ) -> Result<(), Failure> {
        while now.names() < MOST_EFFECTS && !self.progress.interrupted() {
            let before = self.without_exhausted(&now.fit)?;
            let tried = self.one_more(&before, Kind::Name, PROMISING, None)?;
            if !self.add_best(&before, tried, now, rounds, worth)? {
                break;
            }
            self.choose_kind(now)?;
            self.add_instances(now)?;
            self.add_on_other_benches(now, rounds, worth)?;
        }
        Ok(())
    }

    /// Adds the best of what was tried relative to `before`, if it is selected, and returns whether one was.
    pub(super) fn add_best(
        &self,
        before: &Fitted,
        (candidates, fits): (Vec<Attempted>, Vec<Fitted>),
        now: &mut Explanation,
        rounds: &mut Vec<Round>,
        worth: Worth,
    ) -> Result<bool, Failure> {
        rounds.push(Round { loss_before: before.loss, candidates });
        let Some((found, with)) = self.found(before, &now.fit, fits, worth)? else { return Ok(false) };
        now.chosen.push(found);
        now.fit = with;
        Ok(true)
    }

    /// The best of `fits`, sorted best first and relative to `before`, if it is selected, and its fit with nuisance terms.
    ///
    /// A nuisance term at its upper bound was left out of the round. It may stand for part of the missing physics, so that the best candidate
    /// without it need not be the best with it: all finalists are refitted with it.
    pub(super) fn found(
        &self,
        before: &Fitted,
        present: &Fitted,
        mut fits: Vec<Fitted>,
        worth: Worth,
    ) -> Result<Option<(Chosen, Fitted)>, Failure> {
        for _ in 0..FINALISTS {
            let Some((chosen, with, without)) = self.best_showing(before, present, &mut fits, worth)? else {
                return Ok(None);
            };
            if self.is_no_parameter(without, &with, with.newest_place())?
                && self.is_no_parameter_of_its_bench(without, &with, worth)?
                && self.holds_across_recordings(without, &with, |a, b| worth(&POLICY, a, b))?
            {
                return Ok(Some((chosen, with)));
            }
        }
        Ok(None)
    }

    /// The same without cross-validation; removes the candidate from `fits`, and returns the fit that it is compared with.
    fn best_showing<'f>(
        &self,
        before: &'f Fitted,
        present: &'f Fitted,
        fits: &mut Vec<Fitted>,
        worth: Worth,
    ) -> Result<Option<(Chosen, Fitted, &'f Fitted)>, Failure> {
        // Candidates that all data support rank before those that a single stretch supports.
        let worth_it = |without, with| worth(&POLICY, without, with);
        let shows = |fitted: &Fitted| fitted.shows(before, &fitted.newest(), worth_it);
        fits.sort_by_key(|fitted| !shows(fitted));
        let showing = fits.iter().take_while(|fitted| shows(fitted)).count();
        // Where the first were taken out, the next may be a coarse fit.
        let interrupted = self.progress.interrupted();
        if let Some(first) = fits[..showing].first_mut().filter(|first| !first.finished && !interrupted) {
            *first = self.finish(first)?;
        }
        let finalists = if before.layout == present.layout { 1 } else { FINALISTS };
        let count = |fitted: &&Fitted| fitted.finished || interrupted;
        let finalists = &fits[..fits[..finalists.min(showing)].iter().take_while(count).count()];
        let mut beside: Vec<Fitted> = finalists
            .par_iter()
            .map(|fitted| self.with_ordinary(fitted.clone()))
            .collect::<Result<_, Failure>>()?;
        let first = beside.iter().enumerate().min_by(|(_, a), (_, b)| a.best_first(b));
        let Some((place, _)) = first else { return Ok(None) };
        let with_ordinary = beside.remove(place);
        let best = fits.remove(place);
        let bench = best.newest().bench;
        let losses = Losses {
            before: before.loss_on(bench),
            with: best.loss_on(bench),
            ordinary: present.loss_on(bench),
            with_both: with_ordinary.loss_on(bench),
        };
        let shows_beside_it = || with_ordinary.shows(present, &with_ordinary.newest(), worth_it);
        if !losses.found(worth) || !(losses.replaces_ordinary() || shows_beside_it()) {
            return Ok(None);
        }
        // Candidates that were not refitted with the nuisance terms are assumed to improve by the same factor as the best.
        let gains = losses.with_both / losses.with;
        let mut others: Vec<Tried> = fits
            .iter()
            .enumerate()
            .map(|(other, fitted)| {
                let beside = beside.get(other).map(|beside| beside.loss_on(bench));
                fitted.tried(beside.unwrap_or_else(|| gains * fitted.loss_on(bench)))
            })
            .collect();
        others.sort_by(|a, b| a.loss.total_cmp(&b.loss));
        let Tried { effect, model, loss: loss_after } = best.tried(losses.with_both);
        let without = if losses.replaces_ordinary() { before } else { present };
        let compared = [without, &with_ordinary].map(|fitted| fitted.solution.model.clone());
        let loss_before = without.loss_on(bench);
        let chosen = Chosen { effect, model, loss_before, loss_after, compared, others };
        Ok(Some((chosen, with_ordinary, without)))
    }

    /// Removes effects that later ones make superfluous.
    pub(super) fn prune(&self, now: &mut Explanation) -> Result<(), Failure> {
        if now.names() < 2 {
            return Ok(());
        }
        self.progress.stage("testing each effect again", now.names() as u64);
        let mut index = 0;
        while index < now.chosen.len() && now.names() > 1 && !self.progress.interrupted() {
            let Explanation { fit: present, chosen } = now;
            if is_further(chosen, index) {
                index += 1;
                continue;
            }
            let instances = instances(chosen, index);
            let (layout, without) = present.without(&instances);
            let rest = self.fit_beside(layout, &without, present.loss)?;
            let bare = self.without_exhausted_beside(&rest, present.loss)?;
            self.progress.advance(1);
            let is_worth = |without, with| POLICY.worth_naming(without, with);
            let is_worth_its_place = present.shows(&bare, &chosen[index].effect, is_worth)
                && self.is_no_parameter(&bare, present, present.layout.first_found() + index)?;
            if is_worth_its_place {
                chosen[index].stands(&bare, present);
                index += 1;
            } else {
                remove(chosen, &instances);
                *present = if rest.finished { rest } else { self.finish(&rest)? };
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::policy::Policy;

    #[test]
    fn what_stands_beside_an_ordinary_effect_or_in_its_place_is_found() {
        for (losses, found) in [
            // Nothing was left out.
            ([1.0, 0.8, 1.0, 0.8], true),
            ([1.0, 0.9, 1.0, 0.9], false),
            // Dry friction beyond the ordinary: it takes the place of that.
            ([1.2, 0.6, 0.7, 0.6], true),
            // Viscous friction beside dry friction, neither of which does alone.
            ([1.03, 0.71, 0.67, 0.48], true),
            // What imitates the ordinary, does no better and adds nothing.
            ([1.03, 0.71, 0.67, 0.65], false),
            // What helps beside it and does nothing alone is taken for chance.
            ([1.03, 1.0, 0.67, 0.48], false),
        ] {
            let [before, with, ordinary, with_both] = losses;
            assert_eq!(
                Losses { before, with, ordinary, with_both }.found(Policy::worth_naming),
                found,
                "{losses:?}"
            );
        }
    }
}
