//! Which effects the data ask for: forward, the best candidate at a time, by what it takes off the loss of all that is fitted; then
//! backward, each effect must still be worth its place beside what every bench has a little of.
//!
//! A wrong sensor whose own channel changes as some parameter changes it must take off the share that a law must.
//!
//! What is held out takes no part. That a fit sees what it is chosen by costs little: an effect has two or three parameters, and of
//! hundreds of residuals that know nothing of each other they take off a hundredth, where a name must take off 15 % and a law 30 %
//! ([`POLICY`]), a law also without the tenth of the seconds that speak most for it, where a name must show.

mod across;
mod begin_again;
mod exchange;
mod hypotheses;
mod laws;
mod loudest;
mod own_channel;
mod repeating;
mod trying;

use std::cmp::Ordering;

use bowden_model::effect::{ActiveEffect, ParameterSpec};
use bowden_model::effects::find;
use bowden_model::law;
use rayon::prelude::*;

use super::hypotheses::Asked;
use super::layout::{Layout, largest_ordinary};
use super::locked::too_little_travel;
use super::policy::{POLICY, Policy};
use crate::fit::objective::{Objective, Part, StretchLosses};
use crate::fit::solver::{COARSE_STEP, FINE_STEP, Solution, solve_in_rounds};
use crate::fit::typical::{sized, typical};
use crate::joint_model::JointModel;
use crate::outcome::Failure;
use crate::progress::Progress;
pub use hypotheses::{BestRival, Trial};
use loudest::without_the_loudest;

/// Candidates whose fit is brought to an end, of those that fit best so far.
const FINALISTS: usize = 3;

/// Estimated gain below which a candidate is not fitted.
const PROMISING: f64 = 0.08;

/// Most effects that are named at once.
const MOST_EFFECTS: usize = 6;

/// Optimiser evaluations per parameter and round.
const PATIENCE: usize = 5;

/// A candidate that was fitted.
#[derive(Clone, Debug)]
pub struct Tried {
    /// The effect as it was fitted.
    pub effect: ActiveEffect,
    /// Model with it.
    pub model: JointModel,
    /// Loss with it.
    pub loss: f64,
}

/// One round of the search: what was tried beside what was there already.
#[derive(Clone, Debug)]
pub struct Round {
    /// Loss before it.
    pub loss_before: f64,
    /// Candidates, most promising first.
    pub candidates: Vec<Attempted>,
}

/// A candidate of a round.
#[derive(Clone, Copy, Debug)]
pub struct Attempted {
    /// The effect where it was left.
    pub effect: ActiveEffect,
    /// Share of the fitted loss that screening promised.
    pub promised: f64,
    /// Loss of one that was fitted.
    pub loss: Option<f64>,
}

/// One effect that was chosen.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// The effect, with its target, as it was first fitted.
    pub effect: ActiveEffect,
    /// Model with it, as it was first fitted.
    pub model: JointModel,
    /// Loss before it was added.
    pub loss_before: f64,
    /// Loss with it.
    pub loss_after: f64,
    /// The models of these losses, with what is ordinary.
    pub compared: [JointModel; 2],
    /// Other candidates of the same round, best first.
    pub others: Vec<Tried>,
}

impl Chosen {
    /// Another effect in its place, which is no rival of itself then.
    fn becomes(&mut self, other: ActiveEffect) {
        self.others.retain(|tried| !tried.effect.is_beside(&other));
        for model in [&mut self.model, &mut self.compared[1]] {
            model.effects.iter_mut().filter(|one| one.is_beside(&self.effect)).for_each(|one| *one = other);
        }
        self.effect = other;
    }

    /// Its worth beside all that was found; rivals keep their odds.
    fn stands(&mut self, before: &Fitted, after: &Fitted) {
        for tried in &mut self.others {
            tried.loss *= after.loss / self.loss_after;
        }
        (self.loss_before, self.loss_after) = (before.loss, after.loss);
        self.compared = [before, after].map(|fitted| fitted.solution.model.clone());
    }
}

/// Result of the selection.
#[derive(Clone, Debug)]
pub struct Selected {
    /// Model with nominal parameters recalibrated, without any new effect.
    pub baseline: Solution,
    /// The same with what is ordinary.
    pub plain: JointModel,
    /// Model that the search ended with: all chosen effects and what is ordinary.
    pub searched: JointModel,
    /// What is ordinary, as it was last fitted.
    pub ordinary: Vec<ActiveEffect>,
    /// Model with all chosen effects, as they were last fitted.
    pub model: JointModel,
    /// Chosen effects in the order of the model's new effects.
    pub chosen: Vec<Chosen>,
    /// What was tried.
    pub rounds: Vec<Round>,
    /// Every hypothesis of the user by itself.
    pub trials: Vec<Trial>,
    /// Whether the search came to its end.
    pub complete: bool,
}

impl Selected {
    /// The same search with nothing found.
    #[must_use]
    pub fn withdrawn(self) -> Self {
        let ordinary = self.plain.effects[self.baseline.model.effects.len()..].to_vec();
        Self {
            searched: self.plain.clone(),
            model: self.baseline.model.clone(),
            ordinary,
            chosen: Vec::new(),
            ..self
        }
    }

    /// The same search without the chosen effects of which hardly anything is left in `fitted`, the chosen ones fitted to
    /// `objective` at the rig's own resolution; `None` where all are there. What is left as another effect takes the place of the one.
    ///
    /// The search simulates coarsely, and an effect may make up for that alone: a spring of a few thousandths of a newton metre a
    /// radian had ten times that strength there.
    #[must_use]
    pub fn without_faded(&self, objective: &Objective, fitted: &JointModel) -> Option<Self> {
        let believed = &self.baseline.model;
        let own = believed.effects.len();
        let mut left = self.clone();
        for index in (0..self.chosen.len()).rev() {
            let effect = &fitted.effects[own + index];
            if !negligible(objective, believed, effect) {
                continue;
            }
            let remainder = remainder(believed, effect);
            if let Some(other) = remainder.filter(|other| !negligible(objective, believed, other)) {
                left.model.effects[own + index] = other;
                left.chosen[index].becomes(other);
            } else {
                left.chosen.remove(index);
                left.model.effects.remove(own + index);
            }
        }
        (left.model != self.model).then_some(left)
    }
}

/// Finds the effects that the recordings ask for.
///
/// # Errors
/// When the model cannot be driven.
pub fn select(
    objective: &Objective,
    model: &JointModel,
    asked: &Asked,
    progress: &dyn Progress,
) -> Result<Selected, Failure> {
    let search = Search { objective, believed: model, asked, progress };
    let (baseline, mut present) = search.baseline()?;
    let nothing = present.clone();
    let mut chosen: Vec<Chosen> = Vec::new();
    let mut rounds = Vec::new();
    search.add_names(&mut present, &mut chosen, &mut rounds)?;
    search.begin_again(&nothing, &mut present, &mut chosen, &mut rounds)?;
    if search.law_in_place_of_names(&nothing, &mut present, &mut chosen, &mut rounds)? {
        search.add_names(&mut present, &mut chosen, &mut rounds)?;
    }
    search.add_laws(&mut present, &mut chosen, &mut rounds)?;
    let trials = search.trials(&nothing)?;
    // What was found as well is nothing that it could be instead.
    let found: Vec<ActiveEffect> = chosen.iter().map(|one| one.effect).collect();
    for one in &mut chosen {
        one.others.retain(|tried| !found.iter().any(|found| found.is_beside(&tried.effect)));
    }
    let model = present.without_ordinary();
    let searched = present.solution.model;
    let ordinary = present.layout.ordinary(&searched).to_vec();
    Ok(Selected {
        baseline,
        plain: nothing.solution.model,
        searched,
        ordinary,
        model,
        chosen,
        rounds,
        trials,
        complete: !progress.interrupted(),
    })
}

/// Losses of a round in which an ordinary effect may have been left out, because it had grown as large as it may be.
#[derive(Clone, Copy)]
struct Losses {
    /// Without it, before the round.
    before: f64,
    /// Without it, with the candidate.
    with: f64,
    /// With it, before the round.
    ordinary: f64,
    /// With it and the candidate.
    with_both: f64,
}

/// Whether what brings the loss from one value to another is worth it.
type Worth = fn(&Policy, f64, f64) -> bool;

/// What a round tries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Effects of the catalogue.
    Name,
    /// Closed forms at the ports of the joint.
    Law,
}

impl Losses {
    /// Whether the candidate is found: it is worth it, and either does better than the ordinary in its place or is worth it
    /// beside that.
    fn found(self, worth: Worth) -> bool {
        worth(&POLICY, self.before, self.with)
            && (self.replaces_ordinary() || worth(&POLICY, self.ordinary, self.with_both))
    }

    fn replaces_ordinary(self) -> bool {
        self.with < self.ordinary
    }
}

/// A fitted model, whose effects are whose, and how well it fits.
#[derive(Clone)]
struct Fitted {
    layout: Layout,
    solution: Solution,
    loss: f64,
    stretch_losses: StretchLosses,
    /// Whether it was fitted to the end, and not just as far as a ranking needs.
    finished: bool,
    /// Whether the effect that was added last is a moment that no recording shows.
    unseen: bool,
}

impl Fitted {
    /// Place, among the model's effects, of the one that was added last.
    fn newest_place(&self) -> usize {
        self.solution.model.effects.len() - 1
    }

    /// The effect that was added last.
    fn newest(&self) -> ActiveEffect {
        self.solution.model.effects[self.newest_place()]
    }

    fn without_ordinary(&self) -> JointModel {
        self.layout.without_ordinary(&self.solution.model)
    }

    /// The model without the found effects in these places, which rise.
    fn without(&self, places: &[usize]) -> (Layout, JointModel) {
        let all = (self.layout.clone(), self.solution.model.clone());
        places.iter().rev().fold(all, |(layout, model), place| layout.without(&model, *place))
    }

    /// Whether `effect`, which `before` lacks, is worth its place, and shows also without what speaks most for it: an effect of the
    /// catalogue at all, a law by as much again, for one of many forms fits a few moments.
    fn shows(&self, before: &Self, effect: &ActiveEffect, worth: impl Fn(f64, f64) -> bool) -> bool {
        let is_law = law::of(effect).is_some();
        let elsewhere = |[without, with]: &[f64; 2]| {
            worth(*without, *with) || !is_law && POLICY.shows_elsewhere(*without, *with)
        };
        let quieter = without_the_loudest(&before.stretch_losses, &self.stretch_losses);
        worth(before.loss, self.loss) && quieter.iter().all(elsewhere)
    }

    /// Loss with the advantage that simpler effects get.
    fn handicapped(&self) -> f64 {
        self.loss * handicap(&self.newest())
    }

    fn best_first(&self, other: &Self) -> Ordering {
        self.handicapped().total_cmp(&other.handicapped())
    }

    /// What is told of it as a candidate.
    fn tried(&self, loss: f64) -> Tried {
        Tried { effect: self.newest(), model: self.without_ordinary(), loss }
    }
}

/// What all steps of a search share.
struct Search<'a> {
    objective: &'a Objective,
    /// What the rig states.
    believed: &'a JointModel,
    /// What is tried beside what always is.
    asked: &'a Asked<'a>,
    progress: &'a dyn Progress,
}

impl Search<'_> {
    /// The recalibrated model, and the same with what is ordinary, where there may be one.
    fn baseline(&self) -> Result<(Solution, Fitted), Failure> {
        self.progress.stage("recalibrating", 0);
        let plain = self.fit(Layout::of(self.believed), self.believed, &[COARSE_STEP, FINE_STEP])?;
        let baseline = plain.solution.clone();
        Ok((baseline, self.with_ordinary(plain)?))
    }

    /// Adds name after name while one is worth it, and takes out those that later ones have made superfluous.
    fn add_names(
        &self,
        present: &mut Fitted,
        chosen: &mut Vec<Chosen>,
        rounds: &mut Vec<Round>,
    ) -> Result<(), Failure> {
        while names(chosen) < MOST_EFFECTS && !self.progress.interrupted() {
            let before = self.without_exhausted(present)?;
            let (record, fits) = self.one_more(&before, Kind::Name, PROMISING)?;
            rounds.push(Round { loss_before: before.loss, candidates: record });
            let Some((found, with)) = self.found(&before, present, fits, Policy::worth_naming)? else {
                break;
            };
            chosen.push(found);
            *present = with;
            self.add_instances(present, chosen)?;
        }
        self.exchange(present, chosen)?;
        if self.progress.interrupted() { Ok(()) } else { self.prune(present, chosen) }
    }

    /// `present`, fitted without the ordinary effects that are as large as they may be.
    fn without_exhausted(&self, present: &Fitted) -> Result<Fitted, Failure> {
        match present.layout.without_exhausted(self.believed, &present.solution.model) {
            Some((layout, without)) => self.fit(layout, &without, &[COARSE_STEP, FINE_STEP]),
            None => Ok(present.clone()),
        }
    }

    /// `present` with what is ordinary beside what was found.
    fn with_ordinary(&self, present: Fitted) -> Result<Fitted, Failure> {
        let (layout, with) = present.layout.with_ordinary(&present.solution.model);
        if layout == present.layout || self.progress.interrupted() {
            return Ok(present);
        }
        self.fit(layout, &with, &[COARSE_STEP, FINE_STEP])
    }

    /// The best of `fits`, which stand best first and beside `before`, if it is found: how it was chosen, and its fit with
    /// what is ordinary beside it.
    ///
    /// Where the ordinary was left out of the round, because it had grown as large as it may be, it may stand for a part
    /// of what is missing, and the best without it need not be the best with it: all finalists are fitted with it.
    fn found(
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
                && self.holds_across_recordings(without, &with, |a, b| worth(&POLICY, a, b))?
            {
                return Ok(Some((chosen, with)));
            }
        }
        Ok(None)
    }

    /// The same without a look at whether recordings speak for one another; takes it out of `fits`, and says beside what it stands.
    fn best_showing<'f>(
        &self,
        before: &'f Fitted,
        present: &'f Fitted,
        fits: &mut Vec<Fitted>,
        worth: Worth,
    ) -> Result<Option<(Chosen, Fitted, &'f Fitted)>, Failure> {
        // Those that show everywhere before those that only one place asks for.
        let worth_it = |without, with| worth(&POLICY, without, with);
        let shows = |fitted: &Fitted| fitted.shows(before, &fitted.newest(), worth_it);
        fits.sort_by_key(|fitted| !shows(fitted));
        let showing = fits.iter().take_while(|fitted| shows(fitted)).count();
        let finalists = if before.layout == present.layout { 1 } else { FINALISTS };
        let finalists = &fits[..finalists.min(showing)];
        let mut beside: Vec<Fitted> = finalists
            .par_iter()
            .map(|fitted| self.with_ordinary(fitted.clone()))
            .collect::<Result<_, Failure>>()?;
        let first = beside.iter().enumerate().min_by(|(_, a), (_, b)| a.best_first(b));
        let Some((place, _)) = first else { return Ok(None) };
        let with_ordinary = beside.remove(place);
        let best = fits.remove(place);
        let losses = Losses {
            before: before.loss,
            with: best.loss,
            ordinary: present.loss,
            with_both: with_ordinary.loss,
        };
        let shows_beside_it = || with_ordinary.shows(present, &with_ordinary.newest(), worth_it);
        if !losses.found(worth) || !(losses.replaces_ordinary() || shows_beside_it()) {
            return Ok(None);
        }
        // Those that were not fitted beside the ordinary are taken to gain by it as the best did.
        let gains = with_ordinary.loss / best.loss;
        let mut others: Vec<Tried> = fits
            .iter()
            .enumerate()
            .map(|(other, fitted)| {
                fitted.tried(beside.get(other).map_or(gains * fitted.loss, |beside| beside.loss))
            })
            .collect();
        others.sort_by(|a, b| a.loss.total_cmp(&b.loss));
        let Tried { effect, model, loss: loss_after } = best.tried(with_ordinary.loss);
        let without = if losses.replaces_ordinary() { before } else { present };
        let compared = [without, &with_ordinary].map(|fitted| fitted.solution.model.clone());
        let chosen = Chosen { effect, model, loss_before: without.loss, loss_after, compared, others };
        Ok(Some((chosen, with_ordinary, without)))
    }

    /// Removes effects that the later ones have made superfluous.
    fn prune(&self, present: &mut Fitted, chosen: &mut Vec<Chosen>) -> Result<(), Failure> {
        if names(chosen) < 2 {
            return Ok(());
        }
        self.progress.stage("testing each effect again", names(chosen) as u64);
        let mut index = 0;
        while index < chosen.len() && names(chosen) > 1 && !self.progress.interrupted() {
            if is_further(chosen, index) {
                index += 1;
                continue;
            }
            let instances = instances(chosen, index);
            let (layout, without) = present.without(&instances);
            let rest = self.fit(layout, &without, &[COARSE_STEP, FINE_STEP])?;
            let bare = self.without_exhausted(&rest)?;
            self.progress.advance(1);
            let is_worth = |without, with| POLICY.worth_naming(without, with);
            let is_worth_its_place = present.shows(&bare, &chosen[index].effect, is_worth)
                && self.is_no_parameter(&bare, present, present.layout.first_found() + index)?;
            if is_worth_its_place {
                chosen[index].stands(&bare, present);
                index += 1;
            } else {
                remove(chosen, &instances);
                *present = rest;
            }
        }
        Ok(())
    }

    /// Fits the nominal parameters and those of all effects that the rig itself did not state.
    fn fit(&self, layout: Layout, model: &JointModel, rounds: &[f64]) -> Result<Fitted, Failure> {
        let free = layout.free(self.believed, model);
        let solution = solve_in_rounds(self.objective, model, &free, PATIENCE, rounds)?;
        Ok(self.judged(layout, solution, true))
    }

    fn judged(&self, layout: Layout, solution: Solution, finished: bool) -> Fitted {
        let loss = self.objective.mean_loss(&solution.residuals, Part::Training);
        let stretch_losses = self.objective.stretch_losses(&solution.residuals);
        Fitted { layout, solution, loss, stretch_losses, finished, unseen: false }
    }
}

/// Names among what was chosen: instances of one effect on one part have one name.
fn names(chosen: &[Chosen]) -> usize {
    (0..chosen.len()).filter(|index| !is_further(chosen, *index)).count()
}

/// Whether what was chosen in a place is an instance of what was chosen before it.
fn is_further(chosen: &[Chosen], index: usize) -> bool {
    chosen[..index].iter().any(|before| before.effect.is_beside(&chosen[index].effect))
}

/// Places of all instances of what was chosen in a place.
fn instances(chosen: &[Chosen], index: usize) -> Vec<usize> {
    (0..chosen.len()).filter(|other| chosen[*other].effect.is_beside(&chosen[index].effect)).collect()
}

/// Takes out what was chosen in these places, which rise.
fn remove(chosen: &mut Vec<Chosen>, places: &[usize]) {
    for place in places.iter().rev() {
        chosen.remove(*place);
    }
}

/// What is left of an effect that is hardly there as itself.
fn remainder(believed: &JointModel, effect: &ActiveEffect) -> Option<ActiveEffect> {
    let (id, strength) = effect.effect.remainder(&effect.parameters)?;
    let mut other = ActiveEffect { target: effect.target, ..sized(believed, find(id)?) };
    other.parameters[0] = strength;
    Some(other)
}

/// Factor of the loss with an effect, where candidates are compared.
fn handicap(effect: &ActiveEffect) -> f64 {
    let parameters = effect.descriptor().parameters;
    let unusual = |(spec, value): (&ParameterSpec, f64)| !spec.forms.is_empty() && value != spec.default;
    POLICY.handicap(parameters.len(), !parameters.iter().zip(effect.parameters).any(unusual))
}

/// Whether an effect was fitted so weak that it is hardly there, or no more than every bench has, or shows too little of itself
/// to be told.
fn negligible(objective: &Objective, believed: &JointModel, effect: &ActiveEffect) -> bool {
    let descriptor = effect.descriptor();
    let Some(strength) = descriptor.parameters.first() else { return false };
    let usual = typical(believed, descriptor.component, strength);
    largest_ordinary(believed, effect.effect).is_some_and(|largest| effect.parameters[0] <= largest)
        || too_little_travel(objective, effect)
        || effect.effect.is_hardly_there(&effect.parameters, usual)
}

#[cfg(test)]
mod tests;
