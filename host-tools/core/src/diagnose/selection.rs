//! Selection of effects: forward, one effect at a time by its reduction of the training loss, then backward, where each effect must still
//! reduce the loss by its threshold with all others and the nuisance terms present.
//!
//! The error of a sensor that a change of parameters could cause as well must reach the threshold of a law.
//!
//! Held-out data take no part. Selecting on the training data biases the result little: an effect has two or three parameters, which by
//! chance reduce the loss of several hundred independent residuals by about 1 %, whereas an effect must reduce it by 15 % and a law by 30 %
//! ([`POLICY`]); a law must do so also without the tenth of the seconds that support it most.

mod across;
mod begin_again;
mod exchange;
mod hypotheses;
mod laws;
mod loudest;
mod own_channel;
mod repeating;
mod rival_laws;
mod trying;

use std::cmp::Ordering;

use bowden_model::effect::{ActiveEffect, ParameterSpec};
use bowden_model::effects::find;
use bowden_model::law;
use rayon::prelude::*;

use super::hypotheses::Asked;
use super::layout::{Layout, largest_ordinary};
use super::locked::too_little_travel;
use super::onset::moment_of;
use super::policy::{POLICY, Policy};
use crate::fit::objective::{Objective, Part, StretchLosses};
use crate::fit::solver::{COARSE_STEP, FINE_STEP, Solution, solve_in_rounds};
use crate::fit::typical::{sized, typical};
use crate::joint_model::JointModel;
use crate::outcome::Failure;
use crate::progress::Progress;
pub use hypotheses::{BestRival, Trial};
use loudest::without_the_loudest;

/// Number of candidates that are fitted to convergence.
const FINALISTS: usize = 3;

/// Minimum estimated relative reduction of the loss for a candidate to be fitted.
const PROMISING: f64 = 0.08;

/// Maximum number of named effects.
const MOST_EFFECTS: usize = 6;

/// Optimiser evaluations per parameter and round.
const PATIENCE: usize = 5;

/// A fitted candidate.
#[derive(Clone, Debug)]
pub struct Tried {
    /// The fitted effect.
    pub effect: ActiveEffect,
    /// Model with the effect.
    pub model: JointModel,
    /// Loss of that model.
    pub loss: f64,
}

/// One round of the search.
#[derive(Clone, Debug)]
pub struct Round {
    /// Loss before the round.
    pub loss_before: f64,
    /// Candidates in the order of screening.
    pub candidates: Vec<Attempted>,
}

/// A candidate of a round.
#[derive(Clone, Copy, Debug)]
pub struct Attempted {
    /// The effect with its last parameters.
    pub effect: ActiveEffect,
    /// Relative reduction of the loss estimated by screening.
    pub promised: f64,
    /// Loss after the fit; `None` if the candidate was not fitted.
    pub loss: Option<f64>,
}

/// One selected effect.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// The effect and its target, as fitted when it was selected.
    pub effect: ActiveEffect,
    /// Model with the effect, from the same fit.
    pub model: JointModel,
    /// Loss without the effect.
    pub loss_before: f64,
    /// Loss with the effect.
    pub loss_after: f64,
    /// The models of these two losses, with nuisance terms.
    pub compared: [JointModel; 2],
    /// Other candidates of the same round, best first.
    pub others: Vec<Tried>,
}

impl Chosen {
    /// The effect that was added last to `with`, compared with `without`.
    fn newest_of(with: &Fitted, without: &Fitted, others: Vec<Tried>) -> Self {
        Self {
            effect: with.newest(),
            model: with.without_ordinary(),
            loss_before: without.loss,
            loss_after: with.loss,
            compared: [without, with].map(|fitted| fitted.solution.model.clone()),
            others,
        }
    }

    /// Replaces the effect by `other` and removes that from its rivals.
    fn becomes(&mut self, other: ActiveEffect) {
        self.others.retain(|tried| !tried.effect.is_beside(&other));
        for model in [&mut self.model, &mut self.compared[1]] {
            model.effects.iter_mut().filter(|one| one.is_beside(&self.effect)).for_each(|one| *one = other);
        }
        self.effect = other;
    }

    /// Odds of a rival against this effect. Effects of the catalogue have higher prior odds than laws ([`handicap`]).
    pub fn odds_of(&self, rival: &Tried) -> f64 {
        let is_law = law::of(&rival.effect).is_some();
        let prior = if is_law { handicap(&rival.effect) / handicap(&self.effect) } else { 1.0 };
        POLICY.odds(prior * rival.loss / self.loss_after)
    }

    /// Updates the losses to those with all other effects present; rivals keep their odds.
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
    /// Model with recalibrated nominal parameters and no new effect.
    pub baseline: Solution,
    /// Model with all selected effects from the last fit, without nuisance terms.
    pub model: JointModel,
    /// Selected effects in the order of the model's new effects.
    pub chosen: Vec<Chosen>,
    /// Rounds of the search.
    pub rounds: Vec<Round>,
    /// Fits of the user's hypotheses.
    pub trials: Vec<Trial>,
    /// Whether the search was completed.
    pub complete: bool,
    /// Fit without new effects, with nuisance terms.
    nothing: Fitted,
    /// Last fit of the search: all effects that it had selected then, and nuisance terms.
    present: Fitted,
}

impl Selected {
    /// Final model of the search: all selected effects and the nuisance terms.
    #[must_use]
    pub fn searched(&self) -> &JointModel {
        &self.present.solution.model
    }

    /// Nuisance terms from the last fit.
    #[must_use]
    pub fn ordinary(&self) -> &[ActiveEffect] {
        self.present.layout.ordinary(self.searched())
    }

    /// The same search with all effects withdrawn.
    #[must_use]
    pub fn withdrawn(self) -> Self {
        Self { model: self.baseline.model.clone(), present: self.nothing.clone(), chosen: Vec::new(), ..self }
    }

    /// The same search without the effects that are negligible in `fitted`, the fit to `objective` at the rig's own resolution; `None` if
    /// none is. An effect whose remainder is another effect of the catalogue is replaced by that, also if the 90 % interval of its strength
    /// contains zero.
    ///
    /// The search simulates coarsely, and an effect may only compensate the discretisation error: a spring of a few mN·m/rad was ten times as
    /// strong there.
    #[must_use]
    pub fn without_faded(&self, objective: &Objective, fitted: &Solution) -> Option<Self> {
        let believed = &self.baseline.model;
        let layout = Layout::of(believed);
        let mut left = self.clone();
        for index in (0..self.chosen.len()).rev() {
            let place = layout.first_found() + index;
            let effect = &fitted.model.effects[place];
            let remainder = remainder(believed, effect);
            let std = fitted.stds.get(layout.values_of_found(&fitted.model, index).start).copied().flatten();
            let may_be_zero = std.is_some_and(|std| POLICY.may_be_zero(effect.parameters[0], std));
            let only_the_remainder = may_be_zero && remainder.is_some();
            if !negligible(objective, believed, effect) && !only_the_remainder {
                continue;
            }
            if let Some(other) = remainder.filter(|other| !negligible(objective, believed, other)) {
                left.model.effects[place] = other;
                left.chosen[index].becomes(other);
            } else {
                left.chosen.remove(index);
                left.model.effects.remove(place);
            }
        }
        (left.model != self.model).then_some(left)
    }
}

/// Selects the effects that explain the recordings.
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
    search.add_names(&mut present, &mut chosen, &mut rounds, Policy::worth_naming)?;
    let (mut again, mut chosen_again) = (present.clone(), chosen.clone());
    search.with_laws(&nothing, &mut present, &mut chosen, &mut rounds)?;
    if again.loss > POLICY.much_left
        && present.loss > POLICY.noise_loss
        && search.begin_again(&nothing, &mut again, &mut chosen_again, &mut rounds)?
    {
        search.with_laws(&nothing, &mut again, &mut chosen_again, &mut rounds)?;
        (present, chosen) = (again, chosen_again);
    }
    let trials = search.trials(&nothing)?;
    without_selected_rivals(&mut chosen);
    let (model, complete) = (present.without_ordinary(), !progress.interrupted());
    Ok(Selected { baseline, model, chosen, rounds, trials, complete, nothing, present })
}

/// Compares the effects that `selected` names with the laws of their component. Only effects that have not faded at the rig's own resolution
/// should be among them: a law in place of an effect that only compensates the discretisation error would do the same and not fade.
///
/// # Errors
/// When the model cannot be driven.
pub fn compare_with_laws(
    objective: &Objective,
    model: &JointModel,
    asked: &Asked,
    progress: &dyn Progress,
    mut selected: Selected,
) -> Result<Selected, Failure> {
    let are_laws = selected.chosen.iter().all(|one| law::of(&one.effect).is_some());
    if are_laws || progress.interrupted() {
        return Ok(selected);
    }
    let search = Search { objective, believed: model, asked, progress };
    if selected.model != selected.present.without_ordinary() {
        let (layout, with) = Layout::of(model).with_ordinary(&selected.model);
        selected.present = search.fit(layout, &with, &[COARSE_STEP, FINE_STEP])?;
    }
    let Selected { chosen, rounds, nothing, present, .. } = &mut selected;
    if search.replace_by_laws(nothing, present, chosen, rounds)? {
        without_selected_rivals(chosen);
        selected.model = present.without_ordinary();
    }
    selected.complete = !progress.interrupted();
    Ok(selected)
}

/// Removes rivals that were selected as well.
fn without_selected_rivals(chosen: &mut [Chosen]) {
    let found: Vec<ActiveEffect> = chosen.iter().map(|one| one.effect).collect();
    for one in chosen {
        one.others.retain(|tried| !found.iter().any(|found| found.is_beside(&tried.effect)));
    }
}

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

/// Threshold: whether a reduction of the loss from one value to another is sufficient.
type Worth = fn(&Policy, f64, f64) -> bool;

/// Kind of candidates of a round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Effects of the catalogue.
    Name,
    /// Closed forms at the ports of the joint.
    Law,
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

/// A fitted model, the origin of each of its effects, and its losses.
#[derive(Clone, Debug)]
struct Fitted {
    layout: Layout,
    solution: Solution,
    loss: f64,
    stretch_losses: StretchLosses,
    /// Whether the fit converged; otherwise it is sufficient for ranking only.
    finished: bool,
    /// Whether the newest effect begins at a moment that no recording covers.
    unseen: bool,
}

impl Fitted {
    /// Index of the effect that was added last.
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

    /// The model without the effects at these indices, in ascending order.
    fn without(&self, places: &[usize]) -> (Layout, JointModel) {
        let all = (self.layout.clone(), self.solution.model.clone());
        places.iter().rev().fold(all, |(layout, model), place| layout.without(&model, *place))
    }

    /// Whether `effect`, which `before` lacks, reaches the threshold `worth`, and is visible also without the data that support it most: an
    /// effect of the catalogue at all, a law by the same share, because one of its many forms can fit a few moments by chance.
    fn shows(&self, before: &Self, effect: &ActiveEffect, worth: impl Fn(f64, f64) -> bool) -> bool {
        let is_law = law::of(effect).is_some();
        let begins_at_a_moment = moment_of(effect).is_some();
        let elsewhere = |[without, with]: &[f64; 2]| {
            worth(*without, *with)
                || if is_law {
                    POLICY.law_shows_elsewhere(*without, *with)
                } else {
                    POLICY.shows_elsewhere(*without, *with, begins_at_a_moment)
                }
        };
        let quieter = without_the_loudest(&before.stretch_losses, &self.stretch_losses);
        worth(before.loss, self.loss) && quieter.iter().all(elsewhere)
    }

    /// Loss times the factor that favours simpler effects.
    fn handicapped(&self) -> f64 {
        self.loss * handicap(&self.newest())
    }

    fn best_first(&self, other: &Self) -> Ordering {
        self.handicapped().total_cmp(&other.handicapped())
    }

    /// Its record as a candidate.
    fn tried(&self, loss: f64) -> Tried {
        Tried { effect: self.newest(), model: self.without_ordinary(), loss }
    }
}

/// Inputs that all steps of a search share.
struct Search<'a> {
    objective: &'a Objective,
    /// Model of the rig file.
    believed: &'a JointModel,
    /// Effects and hypotheses that the user asked for.
    asked: &'a Asked<'a>,
    progress: &'a dyn Progress,
}

impl Search<'_> {
    /// The recalibrated model, and the same with nuisance terms if the rig allows any.
    fn baseline(&self) -> Result<(Solution, Fitted), Failure> {
        self.progress.stage("recalibrating", 0);
        let plain = self.fit(Layout::of(self.believed), self.believed, &[COARSE_STEP, FINE_STEP])?;
        let baseline = plain.solution.clone();
        Ok((baseline, self.with_ordinary(plain)?))
    }

    /// Adds effects one by one while one reaches the threshold `worth`, and removes those that later ones make superfluous.
    fn add_names(
        &self,
        present: &mut Fitted,
        chosen: &mut Vec<Chosen>,
        rounds: &mut Vec<Round>,
        worth: Worth,
    ) -> Result<(), Failure> {
        while names(chosen) < MOST_EFFECTS && !self.progress.interrupted() {
            let before = self.without_exhausted(present)?;
            let (record, fits) = self.one_more(&before, Kind::Name, PROMISING)?;
            rounds.push(Round { loss_before: before.loss, candidates: record });
            let Some((found, with)) = self.found(&before, present, fits, worth)? else {
                break;
            };
            chosen.push(found);
            *present = with;
            self.add_instances(present, chosen)?;
        }
        self.exchange(present, chosen)?;
        if self.progress.interrupted() { Ok(()) } else { self.prune(present, chosen) }
    }

    /// `present`, refitted without the nuisance terms that are at their upper bound.
    fn without_exhausted(&self, present: &Fitted) -> Result<Fitted, Failure> {
        match present.layout.without_exhausted(self.believed, &present.solution.model) {
            Some((layout, without)) => self.fit(layout, &without, &[COARSE_STEP, FINE_STEP]),
            None => Ok(present.clone()),
        }
    }

    /// `present` with the nuisance terms in addition to the selected effects.
    fn with_ordinary(&self, present: Fitted) -> Result<Fitted, Failure> {
        let (layout, with) = present.layout.with_ordinary(&present.solution.model);
        if layout == present.layout || self.progress.interrupted() {
            return Ok(present);
        }
        self.fit(layout, &with, &[COARSE_STEP, FINE_STEP])
    }

    /// The best of `fits`, sorted best first and relative to `before`, if it is selected, and its fit with nuisance terms.
    ///
    /// A nuisance term at its upper bound was left out of the round. It may stand for part of the missing physics, so that the best candidate
    /// without it need not be the best with it: all finalists are refitted with it.
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
        // Candidates that were not refitted with the nuisance terms are assumed to improve by the same factor as the best.
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

    /// Removes effects that later ones make superfluous.
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

    /// Fits the nominal parameters and the parameters of all effects that are not in the rig file.
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

/// Number of named effects; instances of one effect on one component count once.
fn names(chosen: &[Chosen]) -> usize {
    (0..chosen.len()).filter(|index| !is_further(chosen, *index)).count()
}

/// Whether the effect at `index` is a further instance of one before it.
fn is_further(chosen: &[Chosen], index: usize) -> bool {
    chosen[..index].iter().any(|before| before.effect.is_beside(&chosen[index].effect))
}

/// Indices of all instances of the effect at `index`.
fn instances(chosen: &[Chosen], index: usize) -> Vec<usize> {
    (0..chosen.len()).filter(|other| chosen[*other].effect.is_beside(&chosen[index].effect)).collect()
}

/// Removes the effects at these indices, in ascending order.
fn remove(chosen: &mut Vec<Chosen>, places: &[usize]) {
    for place in places.iter().rev() {
        chosen.remove(*place);
    }
}

/// The effect of the catalogue that remains of a negligible one, if any.
fn remainder(believed: &JointModel, effect: &ActiveEffect) -> Option<ActiveEffect> {
    let (id, strength) = effect.effect.remainder(&effect.parameters)?;
    let mut other = ActiveEffect { target: effect.target, ..sized(believed, find(id)?) };
    other.parameters[0] = strength;
    Some(other)
}

/// Factor on the loss of a candidate in comparisons: effects of the catalogue in their usual form are more likely than others.
fn handicap(effect: &ActiveEffect) -> f64 {
    let parameters = effect.descriptor().parameters;
    let unusual = |(spec, value): (&ParameterSpec, f64)| !spec.forms.is_empty() && value != spec.default;
    let is_unusual = law::of(effect).is_some() || parameters.iter().zip(effect.parameters).any(unusual);
    POLICY.handicap(parameters.len(), !is_unusual)
}

/// Whether a fitted effect is negligible: too weak, within the tolerances of an ordinary bench, or active over too little travel.
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
