//! Restarts of the search with another first effect.
//!
//! A greedy search fails where each of several effects reduces the loss little unless the others are present: friction that grows with the
//! square of the load, for example, without the dry friction next to it. A large remaining loss is the sign of it.

use super::{Attempted, Chosen, Explanation, Fitted, PROMISING, Round, Search, Tried, handicap};
use crate::diagnose::policy::{POLICY, Policy};
use crate::fit::solver::{COARSE_STEP, FINE_STEP};
use crate::outcome::Failure;

/// Maximum number of rivals of the first effect from which the search restarts.
const RIVALS: usize = 4;

/// Maximum number of candidates from which the search restarts if it found no effect.
const BEGINNINGS: usize = 3;

impl Search<'_> {
    /// Restarts the search from each of the best rivals of the first effect, keeps the best result that is better by at least what a name
    /// must achieve, and returns whether there was one. If no effect was found, it restarts from the best candidates of the first round.
    /// `nothing` is the fit without effects.
    ///
    /// It is for a remaining loss above [`Policy::much_left`] that no law reduces to [`Policy::noise_loss`].
    pub(super) fn begin_again(
        &self,
        nothing: &Fitted,
        now: &mut Explanation,
        rounds: &mut Vec<Round>,
    ) -> Result<bool, Failure> {
        let (mut rivals, most, own) = match now.chosen.first() {
            Some(first) => {
                let own = Tried { effect: first.effect, model: first.model.clone(), loss: first.loss_after };
                (first.others.clone(), RIVALS, Some(own))
            }
            None => (beginnings(nothing, rounds), BEGINNINGS, None),
        };
        // What one bench of several has leads the others nowhere.
        rivals.retain(|rival| rival.effect.bench.is_none());
        let mut best: Option<Explanation> = None;
        for (place, rival) in rivals.iter().take(most).enumerate() {
            if self.progress.interrupted() {
                return Ok(false);
            }
            let (layout, with) = nothing.layout.with(&nothing.solution.model, rival.effect);
            let fit = self.fit(layout, &with, &[COARSE_STEP, FINE_STEP])?;
            if !self.is_no_parameter(nothing, &fit, fit.newest_place())? {
                continue;
            }
            let rest = rivals.iter().enumerate().filter(|(other, _)| *other != place);
            let mut others: Vec<Tried> = rest.map(|(_, tried)| tried.clone()).collect();
            others.extend(own.clone());
            others.sort_by(|a, b| a.loss.total_cmp(&b.loss));
            let chosen = vec![Chosen::newest_of(&fit, nothing, others)];
            let mut other = Explanation { fit, chosen };
            self.choose_kind(&mut other)?;
            self.add_names(&mut other, rounds, Policy::worth_naming)?;
            if best.as_ref().is_none_or(|best| other.fit.loss < best.fit.loss) {
                best = Some(other);
            }
        }
        if let Some(other) = best
            && self.is_better(now, &other)?
        {
            *now = other;
            return Ok(true);
        }
        Ok(false)
    }

    /// Whether the effects of a restart replace the present ones. Each effect of either set is necessary within its set. With enough
    /// recordings for cross-validation the set that predicts better wins; otherwise, or if no effect was found before, the new set must
    /// reduce the loss by what a name must achieve.
    fn is_better(&self, now: &Explanation, other: &Explanation) -> Result<bool, Failure> {
        let [here, there] = [now, other].map(|one| handicap_of_all(&one.chosen));
        let (now, other, is_first) = (&now.fit, &other.fit, now.chosen.is_empty());
        if is_first || !self.recordings_judge_one_another() {
            let is_worth = |without, with| POLICY.worth_naming(without, with);
            return Ok(other.shows(now, &other.newest(), is_worth)
                && self.holds_across_recordings(now, other, is_worth)?);
        }
        let better = |loss: f64, others_loss: f64| there * others_loss < here * loss;
        Ok(better(now.loss, other.loss) && self.holds_across_recordings(now, other, better)?)
    }
}

/// Fitted candidates of the first round whose reduction of the loss reaches [`PROMISING`], best first.
fn beginnings(nothing: &Fitted, rounds: &[Round]) -> Vec<Tried> {
    let Some(first) = rounds.first() else { return Vec::new() };
    let fitted = |attempted: &Attempted| {
        let loss = attempted.loss.filter(|loss| *loss < (1.0 - PROMISING) * first.loss_before)?;
        let (layout, with) = nothing.layout.with(&nothing.solution.model, attempted.effect);
        Some(Tried { effect: attempted.effect, model: layout.without_ordinary(&with), loss })
    };
    let mut all: Vec<Tried> = first.candidates.iter().filter_map(fitted).collect();
    let handicapped = |tried: &Tried| tried.loss * handicap(&tried.effect);
    all.sort_by(|a, b| handicapped(a).total_cmp(&handicapped(b)));
    all
}

/// Factor on the loss of a set of effects in comparisons.
fn handicap_of_all(chosen: &[Chosen]) -> f64 {
    chosen.iter().map(|one| handicap(&one.effect)).product()
}
