//! Comparison of each named effect with its rivals once all effects are known.
//!
//! An effect is selected while others are still missing and may stand for part of them. Its rivals of that round are therefore refitted in its
//! place together with the other effects; a rival that predicts better replaces it, and the reported odds follow from these fits.

use bowden_model::effect::{ActiveEffect, Component};

use super::{Chosen, Explanation, Fitted, Search, Tried, instances, is_further, remove};
use crate::diagnose::onset::moment_of;
use crate::diagnose::policy::POLICY;
use crate::fit::solver::{COARSE_STEP, FINE_STEP};
use crate::outcome::Failure;

/// Maximum number of rivals that are refitted in place of an effect.
const RIVALS: usize = 3;

impl Search<'_> {
    /// Refits the rivals of every effect but the last in its place, and keeps the best.
    pub(super) fn exchange(&self, now: &mut Explanation) -> Result<(), Failure> {
        let last = (0..now.chosen.len()).rfind(|index| !is_further(&now.chosen, *index)).unwrap_or(0);
        // A replacement is appended, so that the places of the effects before it do not change.
        for index in (0..last).rev() {
            if !is_further(&now.chosen, index) && !self.progress.interrupted() {
                self.exchange_one(index, now)?;
            }
        }
        Ok(())
    }

    fn exchange_one(&self, index: usize, now: &mut Explanation) -> Result<(), Failure> {
        let Explanation { fit: present, chosen } = now;
        let mut rivals = self.rivals_beside_the_rest(index, present, chosen)?;
        if rivals.is_empty() || self.progress.interrupted() {
            return Ok(());
        }
        let own = &mut chosen[index];
        let not_fitted = own.others.split_off(rivals.len());
        let bench = own.effect.bench;
        own.others = rivals.iter().map(|fitted| fitted.tried(fitted.loss_on(bench))).collect();
        // Candidates that are not refitted keep their odds.
        let now = present.loss_on(bench) / own.loss_after;
        own.others.extend(not_fitted.into_iter().map(|tried| Tried { loss: now * tried.loss, ..tried }));
        own.loss_after = present.loss_on(bench);
        own.model = present.without_ordinary();
        own.compared[1] = present.solution.model.clone();
        let own_handicapped = present.handicapped_by(&own.effect);
        rivals.retain(|rival| rival.handicapped() < own_handicapped);
        rivals.sort_by(Fitted::best_first);
        let instances = instances(chosen, index);
        let Some(best) = self.first_told(rivals, present, &instances)? else { return Ok(()) };
        let before = chosen[index].clone();
        remove(chosen, &instances);
        let tried = best.tried(best.loss_on(best.newest().bench));
        let is_other = |other: &Tried| !other.effect.is_beside(&tried.effect);
        let mut others: Vec<Tried> = before.others.into_iter().filter(is_other).collect();
        others.push(Tried { effect: before.effect, model: before.model, loss: before.loss_after });
        let Tried { effect, model, loss: loss_after } = tried;
        let [without, _] = before.compared;
        let compared = [without, best.solution.model.clone()];
        chosen.push(Chosen { effect, model, loss_before: before.loss_before, loss_after, compared, others });
        *present = best;
        Ok(())
    }

    /// The first of `rivals` that can be distinguished from a change of parameters, compared with `present` without the replaced effect.
    fn first_told(
        &self,
        rivals: Vec<Fitted>,
        present: &Fitted,
        instances: &[usize],
    ) -> Result<Option<Fitted>, Failure> {
        let mut without: Option<Fitted> = None;
        for rival in rivals {
            // Only errors of sensors need the comparison with a fit without them.
            if rival.newest().descriptor().component != Component::Sensors {
                return Ok(Some(rival));
            }
            let beside = if let Some(fitted) = without.take() {
                fitted
            } else {
                let (layout, model) = present.without(instances);
                self.fit(layout, &model, &[COARSE_STEP, FINE_STEP])?
            };
            if self.is_no_parameter(&beside, &rival, rival.newest_place())? {
                return Ok(Some(rival));
            }
            without = Some(beside);
        }
        Ok(None)
    }

    /// The listed rivals of an effect, first among its `others`, each refitted in its place together with all other effects.
    fn rivals_beside_the_rest(
        &self,
        index: usize,
        present: &Fitted,
        chosen: &mut [Chosen],
    ) -> Result<Vec<Fitted>, Failure> {
        let found: Vec<ActiveEffect> = chosen.iter().map(|one| one.effect).collect();
        let loss_then = chosen[index].loss_after;
        let is_rival = |tried: &Tried| {
            !found.iter().any(|found| found.is_beside(&tried.effect))
                && POLICY.is_listed(POLICY.odds(tried.loss / loss_then))
        };
        let (mut rivals, rest): (Vec<Tried>, Vec<Tried>) =
            std::mem::take(&mut chosen[index].others).into_iter().partition(is_rival);
        let most = rivals.len().min(RIVALS);
        let (layout, without) = present.without(&instances(chosen, index));
        self.progress.stage("fitting rivals in place of an effect", most as u64);
        let mut fits = Vec::new();
        for tried in &rivals[..most] {
            let (layout, with) = layout.with(&without, tried.effect);
            fits.push(if moment_of(&tried.effect).is_some() {
                self.fit(layout, &with, &[COARSE_STEP, FINE_STEP])?
            } else {
                self.fit_beside(layout, &with, present.loss)?
            });
            self.progress.advance(1);
        }
        rivals.extend(rest);
        chosen[index].others = rivals;
        Ok(fits)
    }
}
