//! Comparison of the named effects with the laws of their component, because a named effect may be only the nearest entry of the catalogue:
//! a gain and an offset imitate a curved sensor, viscous friction imitates drag.
//!
//! A law is fitted in place of one named effect, or of several of one component, together with all other effects. The more likely of the two
//! is kept, with the prior odds that [`handicap`] gives to effects of the catalogue; the other one counts as its rival.

use bowden_model::effect::{ActiveEffect, Component};
use bowden_model::law;

use super::laws::{RIVALLING, are_of_one_sensor};
use super::loudest::without_the_loudest;
use super::{Chosen, Fitted, PROMISING, Round, Search, Tried, handicap, instances, is_further, remove};
use crate::diagnose::candidates::Candidate;
use crate::diagnose::law_candidates::law_candidates;
use crate::fit::solver::{COARSE_STEP, FINE_STEP};
use crate::outcome::Failure;

impl Search<'_> {
    /// Compares the named effects with the laws of their component, and replaces those that a law predicts better than.
    pub(super) fn compare_with_laws(
        &self,
        present: &mut Fitted,
        chosen: &mut Vec<Chosen>,
        rounds: &mut Vec<Round>,
    ) -> Result<(), Failure> {
        let mut replaced = false;
        for group in imitators(chosen) {
            if self.progress.interrupted() {
                return Ok(());
            }
            let places: Vec<usize> =
                (0..chosen.len()).filter(|place| group.contains(&chosen[*place].effect)).collect();
            // A law may have replaced one of them together with others.
            if places.len() == group.len() {
                replaced |= self.compare_one(&places, present, chosen, rounds)?;
            }
        }
        if replaced { self.prune(present, chosen) } else { Ok(()) }
    }

    /// Compares the effects at `places` with the best law in place of all of them, and returns whether the law replaces them.
    fn compare_one(
        &self,
        places: &[usize],
        present: &mut Fitted,
        chosen: &mut Vec<Chosen>,
        rounds: &mut Vec<Round>,
    ) -> Result<bool, Failure> {
        let (layout, without) = present.without(places);
        let rest = self.fit(layout, &without, &[COARSE_STEP, FINE_STEP])?;
        let before = self.without_exhausted(&rest)?;
        let removed_share = 1.0 - present.loss / before.loss;
        let predictions = self.objective.predict(&before.solution.model)?;
        let mut all = law_candidates(&before.without_ordinary(), self.objective, &predictions);
        all.retain(|candidate| places.iter().all(|place| can_replace(candidate, &chosen[*place].effect)));
        let promising = (RIVALLING * removed_share).max(PROMISING);
        let (record, fits) = self.best_of(&before, &predictions, &all, promising)?;
        rounds.push(Round { loss_before: before.loss, candidates: record });
        let Some(best) = fits.into_iter().find(|fitted| fitted.finished) else { return Ok(false) };
        let law = self.with_ordinary(best)?;
        let own: f64 = names_at(places, chosen).map(|one| handicap(&one.effect)).product();
        let others = handicap(&law.newest());
        let is_likelier = |named: f64, stated: f64| others * stated < own * named;
        let is_likelier_overall = is_likelier(present.loss, law.loss);
        let quieter = without_the_loudest(&present.stretch_losses, &law.stretch_losses);
        if is_likelier_overall
            && quieter.iter().all(|[named, stated]| stated < named)
            && self.is_no_parameter(&before, &law, law.newest_place())?
            && self.holds_across_recordings(present, &law, is_likelier)?
        {
            let compared = [&before, &law].map(|fitted| fitted.solution.model.clone());
            let stated = Chosen {
                effect: law.newest(),
                model: law.without_ordinary(),
                loss_before: before.loss,
                loss_after: law.loss,
                compared,
                others: Vec::new(),
            };
            remove(chosen, places);
            chosen.push(stated);
            *present = law;
            return Ok(true);
        }
        // A law in place of several effects is no rival of any one of them, and one that a few moments support is none at all.
        if names_at(places, chosen).count() == 1 && !is_likelier_overall {
            let named = &mut chosen[places[0]];
            let loss = law.loss * named.loss_after / present.loss;
            named.others.push(Tried { loss, ..law.tried(loss) });
        }
        Ok(false)
    }
}

/// Groups of named effects, each with its instances, that one law may have been taken for: first all of a component, or of one sensor, then
/// each by itself.
fn imitators(chosen: &[Chosen]) -> Vec<Vec<ActiveEffect>> {
    let is_name = |place: &usize| law::of(&chosen[*place].effect).is_none();
    let named: Vec<usize> =
        (0..chosen.len()).filter(|place| is_name(place) && !is_further(chosen, *place)).collect();
    let with_instances = |group: &[usize]| -> Vec<ActiveEffect> {
        group.iter().flat_map(|place| instances(chosen, *place)).map(|place| chosen[place].effect).collect()
    };
    let are_of_one_part = |one: &ActiveEffect, other: &ActiveEffect| {
        let component = one.descriptor().component;
        component == other.descriptor().component
            && (component != Component::Sensors || are_of_one_sensor(one, other))
    };
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for place in &named {
        let effect = &chosen[*place].effect;
        match groups.iter_mut().find(|group| are_of_one_part(&chosen[group[0]].effect, effect)) {
            Some(group) => group.push(*place),
            None => groups.push(vec![*place]),
        }
    }
    groups.retain(|group| group.len() > 1);
    groups.extend(named.into_iter().map(|place| vec![place]));
    groups.iter().map(|group| with_instances(group)).collect()
}

/// Whether a law acts where `named` does.
fn can_replace(candidate: &Candidate, named: &ActiveEffect) -> bool {
    candidate.starts.iter().all(|law| {
        law.descriptor().component == named.descriptor().component
            && (named.descriptor().component != Component::Sensors || law.target.overlaps(named.target))
    })
}

/// The effects at `places`, without further instances.
fn names_at<'c>(places: &'c [usize], chosen: &'c [Chosen]) -> impl Iterator<Item = &'c Chosen> {
    places.iter().filter(|place| !is_further(chosen, **place)).map(|place| &chosen[*place])
}
