//! Which effects the data ask for: forward, the best candidate at a time, judged on what the fit has not seen; then
//! backward, each effect must still be worth its place beside what every bench has a little of.

mod laws;

use std::cmp::Ordering;

use bowden_model::effect::ActiveEffect;
use bowden_model::law;
use rayon::prelude::*;

use super::candidates::candidates;
use super::law_candidates::law_candidates;
use super::layout::{Layout, largest_ordinary};
use super::locked::too_little_travel;
use super::onset::between_recordings;
use super::screening::{Present, Screened, screen};
use crate::fit::objective::{Objective, Part};
use crate::fit::solver::{COARSE_STEP, FINE_STEP, Known, Solution, solve_for_ranking, solve_in_rounds};
use crate::fit::typical::typical;
use crate::joint_model::JointModel;
use crate::outcome::Failure;
use crate::progress::Progress;

/// Share of the held-out loss that an effect must remove: what two realities differ by is not all ordinary contact and
/// friction, and effects that imitate the rest remove a part of it.
pub const WORTHWHILE_SHARE: f64 = 0.15;

/// Loss, in squared scales, from which on more is left than noise and an ordinary bench leave: every residual beyond the three
/// scales at which the loss bends.
const MUCH_LEFT: f64 = 10.0;

/// Loss, in squared scales, that an effect must remove whatever the share. On fifty virtual benches that hide nothing
/// (`prove`, groups `nothing` and `parameters`) candidates remove up to 0.04, as `search` in their `diagnosis.json` tells, but
/// for friction of the sheath that falls at a crawl ([`LEAST_FALL_M_S`]), up to 0.27, and for one bench, up to 0.20, where the
/// rig that would be written does not gain by it.
pub const WORTHWHILE_LOSS: f64 = 0.1;

/// Advantage in held-out loss that each further parameter must earn between two candidates.
const LOSS_PER_PARAMETER: f64 = 0.03;

/// Strength, as a part of the typical one, below which an effect is not worth a name.
const NAMED_STRENGTH: f64 = 0.1;

/// Excess of a sheath's friction at rest times the speed over which it falls, m/s, below which it is no more than how contacts
/// give way: over some ten micrometres, less than the count of an encoder. On virtual benches whose sheaths stick,
/// 0.8 to 3.5 mm/s came out; on the fifty that hide nothing, at most 0.09 mm/s, at speeds of 0.1 to 1.4 mm/s.
const LEAST_FALL_M_S: f64 = 2.5e-4;

/// Candidates that are fitted, of those that screening ranks first.
const FITTED: usize = 7;

/// Candidates whose fit is brought to an end, of those that fit best so far.
const FINALISTS: usize = 3;

/// Held-out loss, over that of the best, beyond which a candidate is no finalist.
const BEHIND: f64 = 2.5;

/// Part of its estimated gain that a candidate's fit with the slopes of the present model has to reach; one that does not is fitted
/// with slopes of its own.
const KEPT_PROMISE: f64 = 0.5;

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
    /// Held-out loss with it.
    pub heldout_loss: f64,
}

/// One round of the search: what was tried beside what was there already.
#[derive(Clone, Debug)]
pub struct Round {
    /// Held-out loss before it.
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
    /// Held-out loss of one that was fitted.
    pub heldout_loss: Option<f64>,
}

/// One effect that was chosen.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// The effect, with its target, as it was first fitted.
    pub effect: ActiveEffect,
    /// Model with it, as it was first fitted.
    pub model: JointModel,
    /// Held-out loss before it was added.
    pub loss_before: f64,
    /// Held-out loss with it.
    pub loss_after: f64,
    /// Other candidates of the same round, best first.
    pub others: Vec<Tried>,
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
}

/// Finds the effects that improve the held-out data.
///
/// # Errors
/// When the model cannot be driven.
pub fn select(
    objective: &Objective,
    model: &JointModel,
    asked: &[&str],
    progress: &dyn Progress,
) -> Result<Selected, Failure> {
    let search = Search { objective, believed: model, asked, progress };
    let (baseline, mut present) = search.baseline()?;
    let plain = present.solution.model.clone();
    let mut chosen: Vec<Chosen> = Vec::new();
    let mut rounds = Vec::new();
    while chosen.len() < MOST_EFFECTS && !progress.interrupted() {
        let before = search.without_exhausted(&present)?;
        let (record, fits) = search.one_more(&before, Kind::Name)?;
        rounds.push(Round { loss_before: before.loss, candidates: record });
        let Some((found, with)) = search.found(&before, &present, fits, worthwhile)? else { break };
        chosen.push(found);
        present = with;
    }
    if !progress.interrupted() {
        search.prune(&mut present, &mut chosen)?;
    }
    search.add_laws(&mut present, &mut chosen, &mut rounds)?;
    let model = present.without_ordinary();
    let searched = present.solution.model;
    let ordinary = present.layout.ordinary(&searched).to_vec();
    Ok(Selected {
        baseline,
        plain,
        searched,
        ordinary,
        model,
        chosen,
        rounds,
        complete: !progress.interrupted(),
    })
}

/// Held-out losses of a round in which an ordinary effect may have been left out, because it had grown as large as it may be.
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

/// Whether what brings the held-out loss from one value to another is worth it.
type Worth = fn(f64, f64) -> bool;

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
        worth(self.before, self.with) && (self.replaces_ordinary() || worth(self.ordinary, self.with_both))
    }

    fn replaces_ordinary(self) -> bool {
        self.with < self.ordinary
    }
}

/// A fitted model, whose effects are whose, and how well it does on held-out data.
#[derive(Clone)]
struct Fitted {
    layout: Layout,
    solution: Solution,
    loss: f64,
    /// Whether it was fitted to the end, and not just as far as a ranking needs.
    finished: bool,
    /// Whether the effect that was added last is a moment that no recording shows.
    unseen: bool,
}

impl Fitted {
    /// The effect that was added last.
    fn newest(&self) -> ActiveEffect {
        self.solution.model.effects[self.solution.model.effects.len() - 1]
    }

    fn without_ordinary(&self) -> JointModel {
        self.layout.without_ordinary(&self.solution.model)
    }

    /// Held-out loss with the advantage that simpler effects get.
    fn handicapped(&self) -> f64 {
        self.loss * (1.0 + LOSS_PER_PARAMETER * self.newest().descriptor().parameters.len() as f64)
    }

    fn best_first(&self, other: &Self) -> Ordering {
        self.handicapped().total_cmp(&other.handicapped())
    }

    /// What is told of it as a candidate.
    fn tried(&self, heldout_loss: f64) -> Tried {
        Tried { effect: self.newest(), model: self.without_ordinary(), heldout_loss }
    }
}

/// What all steps of a search share.
struct Search<'a> {
    objective: &'a Objective,
    /// What the rig states.
    believed: &'a JointModel,
    /// Effects that are tried beside those that always are.
    asked: &'a [&'a str],
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
        let finalists = if before.layout == present.layout { 1 } else { FINALISTS };
        let finalists = &fits[..finalists.min(fits.len())];
        if !finalists.iter().any(|fitted| worth(before.loss, fitted.loss)) {
            return Ok(None);
        }
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
        if !losses.found(worth) {
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
        others.sort_by(|a, b| a.heldout_loss.total_cmp(&b.heldout_loss));
        let Tried { effect, model, heldout_loss: loss_after } = best.tried(with_ordinary.loss);
        let loss_before = if losses.replaces_ordinary() { before.loss } else { present.loss };
        Ok(Some((Chosen { effect, model, loss_before, loss_after, others }, with_ordinary)))
    }

    /// Tries every effect beside those of `present`: what screening ranks first is fitted, and what then fits best is
    /// fitted to the end. Returns all candidates for the record, and the fits, best first.
    fn one_more(&self, present: &Fitted, kind: Kind) -> Result<(Vec<Attempted>, Vec<Fitted>), Failure> {
        let Self { objective, progress, .. } = *self;
        let ranked = {
            let predictions = objective.predict(&present.solution.model)?;
            let model = present.without_ordinary();
            let all = match kind {
                Kind::Name => candidates(&model, objective, &predictions, self.asked),
                Kind::Law => law_candidates(&model, objective, &predictions),
            };
            progress.stage("screening effects", all.iter().map(|c| c.starts.len() as u64).sum());
            let Fitted { layout, solution, .. } = present;
            let present = Present { believed: self.believed, solution, layout, predictions: &predictions };
            screen(objective, &present, &all, progress)
        };
        let promising = ranked.iter().filter(|s| s.gain > PROMISING).take(FITTED).count();
        let mut record: Vec<Attempted> = ranked
            .iter()
            .map(|s| Attempted { effect: s.start, promised: s.gain, heldout_loss: None })
            .collect();
        progress.stage("fitting effects", promising as u64);
        let mut fits = self.fit_promising(present, &ranked[..promising])?;
        let best_first = |fits: &mut Vec<(usize, Fitted)>| {
            fits.retain(|(_, fitted)| {
                !fitted.unseen && !negligible(objective, self.believed, &fitted.newest())
            });
            fits.sort_by(|(_, a), (_, b)| a.best_first(b));
        };
        let mut keep = |place: usize, fitted: &Fitted| {
            record[place].effect = fitted.newest();
            record[place].heldout_loss = Some(fitted.loss);
        };
        for (place, fitted) in &fits {
            keep(*place, fitted);
        }
        best_first(&mut fits);
        let farthest = fits.first().map_or(0.0, |(_, best)| BEHIND * best.loss);
        let ahead = fits.iter().take(FINALISTS).take_while(|(_, fitted)| fitted.loss <= farthest).count();
        fits[..ahead].par_iter_mut().try_for_each(|(_, fitted)| {
            if !progress.interrupted() {
                *fitted = self.finish(fitted)?;
            }
            Ok::<(), Failure>(())
        })?;
        for (place, fitted) in &fits[..ahead] {
            keep(*place, fitted);
        }
        best_first(&mut fits);
        // Finished fits may have fallen behind one that only ranks; what is chosen is fitted to the end.
        while let Some((place, first)) = fits.first_mut().filter(|(_, first)| !first.finished)
            && !progress.interrupted()
        {
            *first = self.finish(first)?;
            keep(*place, first);
            best_first(&mut fits);
        }
        Ok((record, fits.into_iter().map(|(_, fitted)| fitted).collect()))
    }

    fn finish(&self, fitted: &Fitted) -> Result<Fitted, Failure> {
        let finished = self.fit(fitted.layout.clone(), &fitted.solution.model, &[FINE_STEP, FINE_STEP])?;
        let model = &finished.solution.model;
        let unseen = between_recordings(self.objective, model, model.effects.len() - 1)?;
        Ok(Fitted { unseen, ..finished })
    }

    /// Removes effects that the later ones have made superfluous.
    fn prune(&self, present: &mut Fitted, chosen: &mut Vec<Chosen>) -> Result<(), Failure> {
        if chosen.len() < 2 {
            return Ok(());
        }
        self.progress.stage("testing each effect again", chosen.len() as u64);
        let mut index = 0;
        while index < chosen.len() && chosen.len() > 1 && !self.progress.interrupted() {
            let (layout, without) = present.layout.without(&present.solution.model, index);
            let rest = self.fit(layout, &without, &[COARSE_STEP, FINE_STEP])?;
            let bare_loss = self.without_exhausted(&rest)?.loss;
            self.progress.advance(1);
            if worthwhile(bare_loss, present.loss) {
                chosen[index].loss_before = bare_loss;
                chosen[index].loss_after = present.loss;
                index += 1;
            } else {
                chosen.remove(index);
                *present = rest;
            }
        }
        Ok(())
    }

    /// `present` with each of the candidates, by their places, fitted only as far as a ranking needs.
    fn fit_promising(&self, present: &Fitted, ranked: &[Screened]) -> Result<Vec<(usize, Fitted)>, Failure> {
        let Self { objective, progress, .. } = *self;
        // One fit by itself leaves threads idle between its rounds of slopes.
        let fits: Result<Vec<Option<(usize, Fitted)>>, Failure> = ranked
            .par_iter()
            .enumerate()
            .map(|(place, screened)| {
                let fitted =
                    (!progress.interrupted()).then(|| self.fit_new(present, screened, true)).transpose();
                progress.advance(1);
                Ok(fitted?.map(|fitted| (place, fitted)))
            })
            .collect();
        let mut fits: Vec<(usize, Fitted)> = fits?.into_iter().flatten().collect();
        // The slopes of the present model may have led astray: stick and slip bend the way. Where what was promised would still
        // be the best, slopes of its own show the way.
        let training = |fitted: &Fitted| objective.mean_loss(&fitted.solution.residuals, Part::Training);
        let before = training(present);
        let best = fits.iter().map(|(_, fitted)| training(fitted)).fold(f64::INFINITY, f64::min);
        fits.par_iter_mut().try_for_each(|(place, fitted)| {
            let screened = &ranked[*place];
            let astray = training(fitted) > (1.0 - KEPT_PROMISE * screened.gain) * before;
            if astray && (1.0 - screened.gain) * before < best && !progress.interrupted() {
                let own = self.fit_new(present, screened, false)?;
                if training(&own) < training(fitted) {
                    *fitted = own;
                }
            }
            Ok::<(), Failure>(())
        })?;
        Ok(fits)
    }

    /// `present` with one more effect, fitted only as far as a ranking needs, with the slopes of `present` or slopes of its own.
    fn fit_new(&self, present: &Fitted, screened: &Screened, known_slopes: bool) -> Result<Fitted, Failure> {
        let without = screened.room.as_ref().unwrap_or(&present.solution.model);
        let (layout, with) = present.layout.with(without, screened.start);
        let free = layout.free(self.believed, &with);
        let gone = present.layout.parameters_missing_in(&layout, self.believed);
        let slopes = present.solution.jacobian.clone().remove_columns_at(&gone);
        let known = Known { jacobian: known_slopes.then_some(&slopes), spread: present.solution.spread };
        let solution = solve_for_ranking(self.objective, &with, &free, PATIENCE, &known)?;
        Ok(self.judged(layout, solution, false))
    }

    /// Fits the nominal parameters and those of all effects that the rig itself did not state.
    fn fit(&self, layout: Layout, model: &JointModel, rounds: &[f64]) -> Result<Fitted, Failure> {
        let free = layout.free(self.believed, model);
        let solution = solve_in_rounds(self.objective, model, &free, PATIENCE, rounds)?;
        Ok(self.judged(layout, solution, true))
    }

    fn judged(&self, layout: Layout, solution: Solution, finished: bool) -> Fitted {
        let loss = self.objective.mean_loss(&solution.residuals, Part::HeldOut);
        Fitted { layout, solution, loss, finished, unseen: false }
    }
}

/// Whether an effect that brings the held-out loss from `before` to `after` is worth naming.
///
/// Where what is left stands far above what an ordinary bench leaves, other physics is missing too, and what takes a little off
/// may only imitate it: every factor of a hundred beyond [`MUCH_LEFT`] asks for [`WORTHWHILE_SHARE`] more.
#[must_use]
pub fn worthwhile(before: f64, after: f64) -> bool {
    let share = WORTHWHILE_SHARE * (1.0 + 0.5 * (after / MUCH_LEFT).log10().max(0.0));
    before - after > WORTHWHILE_LOSS && before - after > share * before
}

/// Whether an effect was fitted so weak that it is hardly there, or no more than every bench has, or shows too little of itself
/// to be told.
fn negligible(objective: &Objective, believed: &JointModel, effect: &ActiveEffect) -> bool {
    let descriptor = effect.descriptor();
    // How large a law usually is nobody knows; the loss alone decides.
    if law::of(effect).is_some() {
        return false;
    }
    let Some(strength) = descriptor.parameters.first() else { return false };
    let usual = typical(believed, descriptor.component, strength);
    let value = effect.parameters[0];
    if largest_ordinary(believed, descriptor.id).is_some_and(|largest| value <= largest)
        || too_little_travel(objective, effect)
    {
        return true;
    }
    let hardly_there = || {
        let least = |neutral: f64| NAMED_STRENGTH * (usual - neutral).abs();
        descriptor.neutral.is_some_and(|neutral| (value - neutral).abs() < least(neutral))
    };
    match descriptor.id {
        // Friction that hardly falls with speed is dry friction, which has a name of its own.
        "motor_stribeck_friction" => value < (0.3 * effect.parameters[2]).max(NAMED_STRENGTH * usual),
        "sheath_stribeck_friction" => (value - 1.0) * effect.parameters[1] < LEAST_FALL_M_S || hardly_there(),
        // The typical offset depends on the channel; the loss alone decides.
        "sensor_offset" => false,
        _ => hardly_there(),
    }
}

#[cfg(test)]
mod tests {
    use bowden_model::effect::ActiveEffect;
    use bowden_model::effects::find;
    use nalgebra::DMatrix;

    use super::{Losses, Selected, largest_ordinary, negligible, worthwhile};
    use crate::fit::objective::{Objective, Residuals};
    use crate::fit::solver::Solution;
    use crate::joint_model::JointModel;
    use crate::test_bench;

    #[test]
    fn where_nothing_is_found_after_all_the_ordinary_is_that_of_the_recalibrated_rig() {
        let bench = JointModel::from_rig(&test_bench::rig(), &test_bench::swung(2)).unwrap();
        let effect = |id| ActiveEffect::with_defaults(find(id).unwrap());
        let with = |effects: &[ActiveEffect]| JointModel { effects: effects.to_vec(), ..bench.clone() };
        let (before, after) = (effect("motor_coulomb_friction"), effect("presliding_compliance"));
        let found = effect("joint_spring");
        let selected = Selected {
            baseline: Solution {
                model: bench.clone(),
                values: Vec::new(),
                stds: Vec::new(),
                residuals: Residuals { values: Vec::new() },
                spread: 1.0,
                jacobian: DMatrix::zeros(0, 0),
            },
            plain: with(&[before]),
            searched: with(&[after, found]),
            ordinary: vec![after],
            model: with(&[found]),
            chosen: Vec::new(),
            rounds: Vec::new(),
            complete: true,
        };
        let withdrawn = selected.withdrawn();
        assert_eq!(withdrawn.ordinary, [before]);
        assert_eq!((withdrawn.model, withdrawn.searched), (bench.clone(), with(&[before])));
    }

    /// The largest of the benches that hide nothing, the smallest of those whose sheaths stick; much friction that falls at
    /// a crawl and a trace of it that falls late are neither.
    #[test]
    fn friction_that_falls_at_a_crawl_is_how_contacts_give_way() {
        let recording = test_bench::swung(2000);
        let bench = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let objective = Objective::new(&bench, &[recording], &[], true).unwrap();
        for (static_ratio, speed_m_s, left_out) in [
            (1.563, 0.000_16, true),
            (1.053, 0.001_42, true),
            (1.656, 0.001_18, false),
            (1.543, 0.005_15, false),
            (1.05, 0.02, true),
        ] {
            let effect = ActiveEffect::with_defaults(find("sheath_stribeck_friction").unwrap())
                .with("static_ratio", static_ratio)
                .with("speed_m_s", speed_m_s);
            assert_eq!(
                negligible(&objective, &bench, &effect),
                left_out,
                "{static_ratio} at {speed_m_s} m/s"
            );
        }
    }

    #[test]
    fn what_every_bench_has_and_what_the_travel_does_not_show_has_no_name() {
        let recording = test_bench::swung(2000);
        let bench = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let objective = Objective::new(&bench, &[recording], &[], true).unwrap();
        let friction = |share: f64| {
            let largest_nm = largest_ordinary(&bench, "motor_coulomb_friction").unwrap();
            ActiveEffect::with_defaults(find("motor_coulomb_friction").unwrap())
                .with("torque_nm", share * largest_nm)
        };
        let cogging = |cycles_per_turn| {
            ActiveEffect::with_defaults(find("motor_cogging").unwrap())
                .with("cycles_per_turn", cycles_per_turn)
        };
        for (effect, left_out) in
            [(friction(0.99), true), (friction(1.5), false), (cogging(11.0), true), (cogging(13.0), false)]
        {
            assert_eq!(negligible(&objective, &bench, &effect), left_out, "{:?}", effect.parameters);
        }
    }

    /// A fifth of what is left is worth a name up to ten squared scales; of a hundred it takes more than 22 %.
    #[test]
    fn where_much_is_left_an_effect_has_to_take_more_off() {
        for (before, after, named) in
            [(10.0, 8.0, true), (12.5, 10.0, true), (125.0, 100.0, false), (145.0, 100.0, true)]
        {
            assert_eq!(worthwhile(before, after), named, "{before} to {after}");
        }
    }

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
            assert_eq!(Losses { before, with, ordinary, with_both }.found(worthwhile), found, "{losses:?}");
        }
    }
}
