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
mod instead;
mod kinds;
mod laws;
mod loudest;
mod moments;
mod names;
mod one_bench;
mod own_channel;
mod places;
mod remainder;
mod repeating;
mod rival_laws;
mod trying;

use std::borrow::Cow;
use std::cmp::Ordering;

use bowden_model::effect::{ActiveEffect, ParameterSpec};
use bowden_model::law::{self, Form};

use super::hypotheses::Asked;
use super::layout::{Layout, largest_ordinary};
use super::locked::too_little_travel;
use super::one_body;
use super::onset::moment_of;
use super::policy::{POLICY, Policy};
use crate::fit::objective::{Objective, Part, StretchLosses};
use crate::fit::solver::{COARSE_STEP, FINE_STEP, Solution, solve_in_rounds};
use crate::fit::typical::typical;
use crate::joint_model::JointModel;
use crate::outcome::Failure;
use crate::progress::Progress;
pub use hypotheses::{BestRival, Trial};
pub(super) use instead::Held;
use loudest::{without_the_loudest, without_the_loudest_moment};
use remainder::remainder;

/// Number of candidates that are fitted to convergence.
const FINALISTS: usize = 3;

/// Minimum estimated relative reduction of the loss for a candidate to be fitted.
const PROMISING: f64 = 0.08;

/// Optimiser evaluations per parameter and round.
pub(super) const PATIENCE: usize = 5;

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

/// One selected effect. Its losses and those of its rivals are those where it acts: on one bench, or on all.
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
        let bench = with.newest().bench;
        Self {
            effect: with.newest(),
            model: with.without_ordinary(),
            loss_before: without.loss_on(bench),
            loss_after: with.loss_on(bench),
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

    /// The same effect in another kind, as `with` has it at `place`; its rivals keep their losses.
    fn takes_kind(&mut self, with: &Fitted, place: usize) {
        self.effect = with.solution.model.effects[place];
        self.model = with.without_ordinary();
        self.loss_after = with.loss_on(self.effect.bench);
        self.compared[1] = with.solution.model.clone();
    }

    /// Odds of a rival against this effect. Effects of the catalogue have higher prior odds than laws ([`handicap`]).
    ///
    /// Without tendons rotor and joint are one body: an effect of the one is as likely as the same effect of the other, whatever the small
    /// effects that stand beside them take off.
    pub fn odds_of(&self, rival: &Tried) -> f64 {
        if one_body::are_one(&rival.model, &self.effect, &rival.effect) {
            return 1.0;
        }
        let is_law = law::of(&rival.effect).is_some();
        let prior = if is_law { handicap(&rival.effect) / handicap(&self.effect) } else { 1.0 };
        POLICY.odds(prior * rival.loss / self.loss_after)
    }

    /// Updates the losses to those with all other effects present; rivals keep their odds.
    fn stands(&mut self, before: &Fitted, after: &Fitted) {
        let [without, with] = [before, after].map(|fitted| fitted.loss_on(self.effect.bench));
        for tried in &mut self.others {
            tried.loss *= with / self.loss_after;
        }
        (self.loss_before, self.loss_after) = (without, with);
        self.compared = [before, after].map(|fitted| fitted.solution.model.clone());
    }
}

/// Result of the selection.
#[derive(Clone, Debug)]
pub struct Selected {
    /// Model with recalibrated nominal parameters and no new effect.
    pub baseline: Solution,
    /// The same with the bends of the sheaths fitted beside them, where the rig does not state these.
    pub recalibrated: JointModel,
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

    /// Model with all selected effects, and where the sheaths are bent in the last place.
    #[must_use]
    pub fn simulated(&self) -> JointModel {
        let bends = self.present.layout.bends(self.searched());
        let mut model = self.model.clone();
        model.effects.extend(bends);
        model
    }

    /// The same search with all effects withdrawn.
    #[must_use]
    pub fn withdrawn(self) -> Self {
        let mut model = self.recalibrated.clone();
        model.effects.truncate(self.baseline.model.effects.len());
        Self { model, present: self.nothing.clone(), chosen: Vec::new(), ..self }
    }

    /// The same search without the effects that are negligible in `fitted`, the fit to `objective` at the rig's own resolution; `None` if
    /// none is. An effect whose remainder is another effect of the catalogue is replaced by that; where `intervals_count`, also if the 90 %
    /// interval of its strength contains zero.
    ///
    /// The search simulates coarsely, and an effect may only compensate the discretisation error: a spring of a few mN·m/rad was ten times as
    /// strong there.
    #[must_use]
    pub fn without_faded(
        &self,
        objective: &Objective,
        fitted: &Solution,
        intervals_count: bool,
    ) -> Option<Self> {
        let believed = &self.baseline.model;
        let layout = Layout::of(believed);
        let mut left = self.clone();
        for index in (0..self.chosen.len()).rev() {
            let place = layout.first_found() + index;
            let effect = &fitted.model.effects[place];
            let remainder = remainder(believed, effect);
            let first = layout.values_of_found(&fitted.model, index).start;
            let std = fitted.slopes().stds.get(first).copied().flatten();
            let may_be_zero = std.is_some_and(|std| POLICY.may_be_zero(effect.parameters[0], std));
            let only_the_remainder = intervals_count && may_be_zero && remainder.is_some();
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
    let (baseline, nothing) = search.baseline()?;
    let recalibrated = search.recalibrated(&baseline, &nothing)?;
    let mut now = Explanation { fit: nothing.clone(), chosen: Vec::new() };
    let mut rounds = Vec::new();
    search.add_names(&mut now, &mut rounds, Policy::worth_naming)?;
    search.add_taken_up(&mut now, &mut rounds, Policy::worth_naming)?;
    let mut again = now.clone();
    search.with_laws(&nothing, &mut now, &mut rounds)?;
    if again.fit.loss > POLICY.much_left
        && now.fit.loss > POLICY.noise_loss
        && search.begin_again(&nothing, &mut again, &mut rounds)?
    {
        search.with_laws(&nothing, &mut again, &mut rounds)?;
        now = again;
    }
    let trials = search.trials(&nothing)?;
    let Explanation { fit: present, mut chosen } = now;
    without_selected_rivals(&mut chosen);
    let (model, complete) = (present.without_ordinary(), !progress.interrupted());
    Ok(Selected { baseline, recalibrated, model, chosen, rounds, trials, complete, nothing, present })
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
    let Selected { chosen, present, nothing, mut rounds, mut model, .. } = selected;
    let mut now = Explanation { fit: present, chosen };
    if search.replace_by_laws(&nothing, &mut now, &mut rounds)? {
        without_selected_rivals(&mut now.chosen);
        model = now.fit.without_ordinary();
    }
    let (Explanation { fit: present, chosen }, complete) = (now, !progress.interrupted());
    Ok(Selected { model, chosen, rounds, complete, nothing, present, ..selected })
}

/// Removes rivals that were selected as well.
fn without_selected_rivals(chosen: &mut [Chosen]) {
    let found: Vec<ActiveEffect> = chosen.iter().map(|one| one.effect).collect();
    for one in chosen {
        one.others.retain(|tried| !found.iter().any(|found| found.is_beside(&tried.effect)));
    }
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

/// A fitted model, the origin of each of its effects, and its losses.
#[derive(Clone, Debug)]
struct Fitted {
    layout: Layout,
    solution: Solution,
    loss: f64,
    stretch_losses: StretchLosses,
    /// Bench of every recording.
    benches: Vec<u16>,
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

    /// Stretch losses of the recordings of one bench, or of all.
    fn stretch_losses_on(&self, bench: Option<u16>) -> Cow<'_, StretchLosses> {
        let Some(bench) = bench else { return Cow::Borrowed(&self.stretch_losses) };
        let there =
            self.stretch_losses.iter().filter(|((recording, _), _)| self.benches[*recording] == bench);
        Cow::Owned(there.map(|(place, loss)| (*place, *loss)).collect())
    }

    /// Loss over the recordings of one bench, or over all.
    fn loss_on(&self, bench: Option<u16>) -> f64 {
        if bench.is_none() {
            return self.loss;
        }
        let losses = self.stretch_losses_on(bench);
        let [sum, count] = losses.values().fold([0.0; 2], |[sum, count], [s, c]| [sum + s, count + c]);
        sum / f64::max(count, 1.0)
    }

    /// Whether `effect`, which `before` lacks, reaches the threshold `worth`, and is visible also without the data that support it most: an
    /// effect of the catalogue at all, without one moment or, if it begins at a moment, without the most favourable ones; a law without these
    /// by the same share, because one of its many forms can fit a few moments by chance. An effect of one bench of several has to show there,
    /// by the share that a law has to take off: what is special about a bench has more causes than effects.
    fn shows(&self, before: &Self, effect: &ActiveEffect, worth: impl Fn(f64, f64) -> bool) -> bool {
        let [without, with] = [before, self].map(|fitted| fitted.loss_on(effect.bench));
        let is_clear = effect.bench.is_none() || POLICY.shows_on_one_bench(without, with);
        is_clear && self.shows_anywhere(before, effect, worth)
    }

    /// The same, wherever the effect acts.
    fn shows_anywhere(&self, before: &Self, effect: &ActiveEffect, worth: impl Fn(f64, f64) -> bool) -> bool {
        let bench = effect.bench;
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
        let quieter_without =
            if is_law || begins_at_a_moment { without_the_loudest } else { without_the_loudest_moment };
        let quieter = quieter_without(&before.stretch_losses_on(bench), &self.stretch_losses_on(bench));
        let [without, with] = [before, self].map(|fitted| fitted.loss_on(bench));
        worth(without, with) && quieter.iter().all(elsewhere)
    }

    /// Loss times the factor that favours simpler effects.
    fn handicapped(&self) -> f64 {
        self.handicapped_by(&self.newest())
    }

    /// Loss times the factor of `effect`, where that acts, and what its form must take off a simpler one.
    fn handicapped_by(&self, effect: &ActiveEffect) -> f64 {
        let factor = handicap(effect);
        if effect.bench.is_none() {
            return factor * self.loss + price_of_form(effect);
        }
        let count = |losses: &StretchLosses| losses.values().map(|[_, count]| count).sum::<f64>();
        let weight = count(&self.stretch_losses_on(effect.bench)) / count(&self.stretch_losses).max(1.0);
        self.loss + weight * ((factor - 1.0) * self.loss_on(effect.bench) + price_of_form(effect))
    }

    fn best_first(&self, other: &Self) -> Ordering {
        self.handicapped().total_cmp(&other.handicapped())
    }

    /// Its record as a candidate.
    fn tried(&self, loss: f64) -> Tried {
        Tried { effect: self.newest(), model: self.without_ordinary(), loss }
    }
}

/// Effects that explain the recordings together, as far as the search has come.
#[derive(Clone)]
struct Explanation {
    /// Fit of all of them, with nuisance terms.
    fit: Fitted,
    /// The effects, in the order in which the model of the fit has them.
    chosen: Vec<Chosen>,
}

impl Explanation {
    /// Number of named effects; instances of one effect on one component, of any bench, count once.
    fn names(&self) -> usize {
        let is_new = |index: &usize| {
            self.chosen[..*index].iter().all(|before| !before.effect.is_alike(&self.chosen[*index].effect))
        };
        (0..self.chosen.len()).filter(is_new).count()
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

    /// The recalibrated model with the bends of its sheaths, and without the other nuisance terms.
    fn recalibrated(&self, baseline: &Solution, nothing: &Fitted) -> Result<JointModel, Failure> {
        let (layout, with) = nothing.layout.with_bends_alone(&nothing.solution.model);
        if layout == Layout::of(self.believed) {
            return Ok(baseline.model.clone());
        }
        let fitted = self.fit(layout, &with, &[FINE_STEP])?;
        Ok(fitted.solution.model)
    }

    /// `present`, refitted without the nuisance terms that are at their upper bound.
    fn without_exhausted(&self, present: &Fitted) -> Result<Fitted, Failure> {
        match present.layout.without_exhausted(self.believed, &present.solution.model) {
            Some((layout, without)) => self.fit(layout, &without, &[COARSE_STEP, FINE_STEP]),
            None => Ok(present.clone()),
        }
    }

    /// The same to compare with another model of loss `other_loss`, as far as that takes.
    fn without_exhausted_beside(&self, present: &Fitted, other_loss: f64) -> Result<Fitted, Failure> {
        match present.layout.without_exhausted(self.believed, &present.solution.model) {
            Some((layout, without)) => self.fit_beside(layout, &without, other_loss),
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

    /// Fits the nominal parameters and the parameters of all effects that are not in the rig file.
    fn fit(&self, layout: Layout, model: &JointModel, rounds: &[f64]) -> Result<Fitted, Failure> {
        let free = layout.free(self.believed, model);
        let solution = solve_in_rounds(self.objective, model, &free, PATIENCE, rounds)?;
        Ok(self.judged(layout, solution, true))
    }

    fn judged(&self, layout: Layout, solution: Solution, finished: bool) -> Fitted {
        let loss = self.objective.mean_loss(&solution.residuals, Part::Training);
        let stretch_losses = self.objective.stretch_losses(&solution.residuals);
        let benches =
            (0..self.objective.recordings()).map(|recording| self.objective.bench(recording)).collect();
        Fitted { layout, solution, loss, stretch_losses, benches, finished, unseen: false }
    }
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

/// Factor on the loss of a candidate in comparisons: effects of the catalogue in their usual form are more likely than others. Of two kinds
/// neither is the usual one; the one that is not tried first counts as a parameter, so that a recording that does not tell them apart changes none.
fn handicap(effect: &ActiveEffect) -> f64 {
    let parameters = effect.descriptor().parameters;
    let unusual = |(spec, value): (&ParameterSpec, f64)| {
        !spec.is_choice && !spec.forms.is_empty() && value != spec.default
    };
    let is_unusual = law::of(effect).is_some() || parameters.iter().zip(effect.parameters).any(unusual);
    let counts = |(spec, value): &(&ParameterSpec, f64)| !spec.is_choice || *value != spec.default;
    let fitted = parameters.iter().zip(effect.parameters).filter(counts).count();
    POLICY.handicap(fitted, !is_unusual)
}

/// What the loss must fall by for the form of an effect to be preferred to the simpler form that it contains: below the noise a share of the loss
/// is nothing. A power of the speed that differs with the direction contains the same power without that.
fn price_of_form(effect: &ActiveEffect) -> f64 {
    let contains_another = law::of(effect).is_some_and(|law| law.form() == Form::DirectedPower);
    if contains_another { POLICY.name_loss } else { 0.0 }
}

/// Whether a fitted effect is negligible: too weak, within the tolerances of an ordinary bench, or active over too little travel.
fn negligible(objective: &Objective, believed: &JointModel, effect: &ActiveEffect) -> bool {
    let descriptor = effect.descriptor();
    let Some(strength) = descriptor.parameters.first() else { return false };
    let usual = typical(believed, descriptor.component, strength);
    largest_ordinary(believed, effect.effect).is_some_and(|largest| effect.parameters[0] <= largest)
        || too_little_travel(&objective.on(effect.bench), effect)
        || effect.effect.is_hardly_there(&effect.parameters, usual)
}

#[cfg(test)]
mod tests;
