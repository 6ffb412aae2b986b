//! One round of the search: the candidates that screening ranks first are fitted coarsely, and the best of these to convergence.

use bowden_model::effect::ActiveEffect;
use bowden_model::parameters::NOMINAL_PARAMETERS;
use rayon::prelude::*;

use super::{Attempted, FINALISTS, Fitted, Kind, PATIENCE, PROMISING, Search, negligible};
use crate::diagnose::candidates::{Candidate, candidates};
use crate::diagnose::law_candidates::law_candidates;
use crate::diagnose::layout::Layout;
use crate::diagnose::one_body::turns_as_one;
use crate::diagnose::onset::{between_recordings, moment_of};
use crate::diagnose::screening::{Present, Screened, screen};
use crate::fit::calibrated::spread;
use crate::fit::solver::{COARSE_STEP, FINE_STEP, Known, Slopes, solve_for_ranking};
use crate::joint_model::{Drive, JointModel};
use crate::outcome::Failure;
use crate::simulation::Prediction;

/// Number of candidates that are fitted, in the order of screening.
const FITTED: usize = 7;

/// Loss relative to the best above which a candidate is not fitted to convergence.
const BEHIND: f64 = 2.5;

/// The same where a motor drives tendons, but for an effect that begins at a moment, which convergence shifts. A rival that leaves 42 % more is
/// not listed ([`POLICY`](crate::diagnose::policy::POLICY)), and by convergence a candidate gains on another by up to a fifth there.
const BEHIND_OF_TENDONS: f64 = 1.7;

/// Loss relative to that of what a candidate would replace above which it is not fitted to convergence: it has to do better in the end.
const FAR_BEHIND: f64 = 2.5;

/// The same for an effect that begins at a moment, where a motor drives tendons; elsewhere there is no bound.
const FAR_BEHIND_AT_A_MOMENT: f64 = 10.0;

/// Loss relative to that of a model above which a coarse fit without one of its effects, or with another in its place, is not fitted to
/// convergence. Of a motor that drives tendons convergence takes a fifth off at most; harmonics of the torque that turns a prescribed angle are found by
/// it alone.
const DECIDED: f64 = 5.0;

/// Minimum reduction of the loss, relative to the estimate of screening, by a fit that reuses the sensitivities of the present model; a
/// candidate below it is refitted with its own sensitivities.
const KEPT_PROMISE: f64 = 0.5;

/// Distance of a nominal parameter from what the rig states, in standard deviations of what is believed of it, from which on it has run off.
const RUN_OFF: f64 = 3.0;

impl Search<'_> {
    /// Tries every further effect in addition to those of `present`: screens all, fits the first coarsely, and fits the best of these to
    /// convergence, provided that the estimated reduction reaches `promising`. Candidates whose coarse fit is far behind `other_loss`, the
    /// loss of what they would replace, are not among the fits. Returns all candidates for the record, and the fits, best first.
    pub(super) fn one_more(
        &self,
        present: &Fitted,
        kind: Kind,
        promising: f64,
        other_loss: Option<f64>,
    ) -> Result<(Vec<Attempted>, Vec<Fitted>), Failure> {
        let predictions = self.objective.predict(&present.solution.model)?;
        let model = present.without_ordinary();
        let all = match kind {
            Kind::Name => {
                let mut all = candidates(&model, self.objective, &predictions, self.asked.effects);
                all.extend(self.asked.candidates(&model));
                all
            }
            Kind::Law => law_candidates(None, &model, self.objective, &predictions),
        };
        self.best_of(present, &predictions, &all, promising, other_loss)
    }

    /// Fits of `present` with each effect of the catalogue that `is_it`, best first, as [`Self::one_more`] finds them.
    pub(super) fn one_of(
        &self,
        present: &Fitted,
        is_it: impl Fn(&ActiveEffect) -> bool,
        other_loss: f64,
    ) -> Result<Vec<Fitted>, Failure> {
        let predictions = self.objective.predict(&present.solution.model)?;
        let model = present.without_ordinary();
        let mut all = candidates(&model, self.objective, &predictions, self.asked.effects);
        all.retain(|candidate| candidate.starts.iter().all(&is_it));
        let (_, fits) = self.best_of(present, &predictions, &all, PROMISING, Some(other_loss))?;
        Ok(fits)
    }

    /// As [`Self::one_more`] for the given candidates; `predictions` are those of `present`.
    pub(super) fn best_of(
        &self,
        present: &Fitted,
        predictions: &[Prediction],
        all: &[Candidate],
        promising: f64,
        other_loss: Option<f64>,
    ) -> Result<(Vec<Attempted>, Vec<Fitted>), Failure> {
        let Self { objective, progress, .. } = *self;
        let ranked = {
            progress.stage("screening effects", all.iter().map(|c| c.starts.len() as u64).sum());
            let Fitted { layout, solution, .. } = present;
            let present = Present { believed: self.believed, solution, layout, predictions };
            screen(objective, &present, all, promising, progress)
        };
        let (mut ranked, others): (Vec<Screened>, Vec<Screened>) =
            ranked.into_iter().partition(|screened| screened.gain_there() > promising);
        let promising = ranked.len().min(FITTED);
        ranked.extend(others);
        let mut record: Vec<Attempted> =
            ranked.iter().map(|s| Attempted { effect: s.start, promised: s.gain, loss: None }).collect();
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
            record[place].loss = Some(fitted.loss);
        };
        for (place, fitted) in &fits {
            keep(*place, fitted);
        }
        // Convergence shifts a moment far, and little else.
        let is_within = |fitted: &Fitted, other_loss: f64, [of_others, at_a_moment]: [f64; 2]| {
            let begins = moment_of(&fitted.newest()).is_some();
            fitted.loss <= other_loss * if begins { at_a_moment } else { of_others }
        };
        let tendons = drives_tendons(&present.solution.model);
        let far_behind = [FAR_BEHIND, if tendons { FAR_BEHIND_AT_A_MOMENT } else { f64::INFINITY }];
        fits.retain(|(_, fitted)| other_loss.is_none_or(|other| is_within(fitted, other, far_behind)));
        best_first(&mut fits);
        let best_loss = fits.first().map_or(0.0, |(_, best)| best.loss);
        let behind = if tendons { BEHIND_OF_TENDONS } else { BEHIND };
        let is_ahead = |fitted: &Fitted| is_within(fitted, best_loss, [behind, BEHIND]);
        let ahead = fits.iter().take(FINALISTS).take_while(|(_, fitted)| is_ahead(fitted)).count();
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
        // A converged fit may rank behind a coarse one; the selected candidate must be converged.
        while let Some((place, first)) = fits.first_mut().filter(|(_, first)| !first.finished)
            && !progress.interrupted()
        {
            *first = self.finish(first)?;
            keep(*place, first);
            best_first(&mut fits);
        }
        Ok((record, fits.into_iter().map(|(_, fitted)| fitted).collect()))
    }

    /// Fits a coarsely fitted candidate to convergence, wherever that moves it.
    pub(super) fn finish(&self, fitted: &Fitted) -> Result<Fitted, Failure> {
        let finished = self.fit(fitted.layout.clone(), &fitted.solution.model, &[FINE_STEP, FINE_STEP])?;
        let finished = self.moved(finished)?;
        let model = &finished.solution.model;
        let unseen = between_recordings(self.objective, model, model.effects.len() - 1)?;
        Ok(Fitted { unseen, ..finished })
    }

    /// Fit of a model to compare with another of loss `other_loss`: to convergence, unless a motor drives tendons and the coarse fit is so
    /// far behind that convergence would decide nothing.
    pub(super) fn fit_beside(
        &self,
        layout: Layout,
        model: &JointModel,
        other_loss: f64,
    ) -> Result<Fitted, Failure> {
        let coarse = self.fit(layout, model, &[COARSE_STEP])?;
        if drives_tendons(model) && coarse.loss > DECIDED * other_loss {
            return Ok(Fitted { finished: false, ..coarse });
        }
        self.fit(coarse.layout, &coarse.solution.model, &[FINE_STEP])
    }

    /// Coarse fits, sufficient for ranking, of `present` with each of the candidates, and their indices.
    fn fit_promising(&self, present: &Fitted, ranked: &[Screened]) -> Result<Vec<(usize, Fitted)>, Failure> {
        let progress = self.progress;
        // Before the threads ask for them.
        let slopes = present.solution.slopes();
        // A single fit leaves threads idle between its sensitivity passes.
        let fits: Result<Vec<Option<(usize, Fitted)>>, Failure> = ranked
            .par_iter()
            .enumerate()
            .map(|(place, screened)| {
                let fitted = (!progress.interrupted())
                    .then(|| self.fit_new(present, slopes, screened, true))
                    .transpose();
                progress.advance(1);
                Ok(fitted?.map(|fitted| (place, fitted)))
            })
            .collect();
        let mut fits: Vec<(usize, Fitted)> = fits?.into_iter().flatten().collect();
        // Sensitivities of the present model mislead where stick-slip makes the loss nonlinear. A candidate whose estimate would still
        // rank first is refitted with its own.
        let before = present.loss;
        let first = fits.iter().min_by(|(_, a), (_, b)| a.loss.total_cmp(&b.loss));
        let (best, promise) =
            first.map_or((f64::INFINITY, 0.0), |(place, fitted)| (fitted.loss, ranked[*place].gain));
        // So is one far behind another of which less was promised, where a replay takes little: without tendons.
        let is_quick = turns_as_one(&present.solution.model);
        fits.par_iter_mut().try_for_each(|(place, fitted)| {
            let screened = &ranked[*place];
            let astray = fitted.loss > (1.0 - KEPT_PROMISE * screened.gain) * before;
            let may_be_first = astray && (1.0 - screened.gain) * before < best;
            let overtaken = is_quick && screened.gain > promise && fitted.loss > BEHIND * best;
            if (may_be_first || overtaken) && !progress.interrupted() {
                let own = self.fit_new(present, slopes, screened, false)?;
                if own.loss < fitted.loss {
                    *fitted = own;
                }
            }
            Ok::<(), Failure>(())
        })?;
        self.try_other_kinds(present, slopes, ranked, &mut fits)?;
        if let Some(anew) = self.anew(present) {
            fits.par_iter_mut().try_for_each(|(place, fitted)| {
                let screened = Screened { room: Some(anew.clone()), ..ranked[*place].clone() };
                if !progress.interrupted() {
                    let other = self.fit_new(present, slopes, &screened, false)?;
                    if other.loss < fitted.loss {
                        *fitted = other;
                    }
                }
                Ok::<(), Failure>(())
            })?;
        }
        Ok(fits)
    }

    /// Replaces coarse fits by those of the other kind of their effect where that leaves less: the wrong kind of friction that falls with speed
    /// leaves no less than friction that does not.
    fn try_other_kinds(
        &self,
        present: &Fitted,
        slopes: &Slopes,
        ranked: &[Screened],
        fits: &mut [(usize, Fitted)],
    ) -> Result<(), Failure> {
        let best = fits.iter().map(|(_, fitted)| fitted.loss).fold(f64::INFINITY, f64::min);
        fits.par_iter_mut().try_for_each(|(place, fitted)| {
            let other = fitted.newest().in_other_kind();
            if let Some(start) = other
                && fitted.loss <= BEHIND_OF_TENDONS * best
                && !self.progress.interrupted()
            {
                let parameters = fitted.solution.model.parameters;
                let room = Some(JointModel { parameters, ..present.solution.model.clone() });
                let other = self.fit_new(
                    present,
                    slopes,
                    &Screened { start, room, ..ranked[*place].clone() },
                    false,
                )?;
                if other.handicapped() < fitted.handicapped() {
                    *fitted = other;
                }
            }
            Ok(())
        })
    }

    /// `present` with the parameters that the rig states, where one of them has run off to make up for what is missing: the optimiser finds no
    /// way back from there in small steps.
    fn anew(&self, present: &Fitted) -> Option<JointModel> {
        let model = &present.solution.model;
        let has_run_off = NOMINAL_PARAMETERS.iter().any(|parameter| {
            let [before, now] =
                [&self.believed.parameters, &model.parameters].map(|joint| parameter.get(joint));
            before.zip(now).is_some_and(|(before, now)| {
                before > 0.0 && (now / before).ln().abs() > RUN_OFF * spread(parameter)
            })
        });
        has_run_off.then(|| JointModel { parameters: self.believed.parameters, ..model.clone() })
    }

    /// Coarse fit of `present` with one more effect, with the sensitivities of `present`, in `slopes`, or its own.
    fn fit_new(
        &self,
        present: &Fitted,
        slopes: &Slopes,
        screened: &Screened,
        known_slopes: bool,
    ) -> Result<Fitted, Failure> {
        let without = screened.room.as_ref().unwrap_or(&present.solution.model);
        let (layout, with) = present.layout.with(without, screened.start);
        let free = layout.free(self.believed, &with);
        let gone = present.layout.parameters_missing_in(&layout, self.believed);
        let jacobian = known_slopes.then(|| slopes.jacobian.clone().remove_columns_at(&gone));
        let known = Known { jacobian: jacobian.as_ref(), spread: slopes.spread };
        let solution = solve_for_ranking(self.objective, &with, &free, PATIENCE, &known)?;
        Ok(self.judged(layout, solution, false))
    }
}

/// Whether a motor drives tendons by the duty of its bridge: what a coarse fit leaves there tells what convergence will leave.
pub(super) fn drives_tendons(model: &JointModel) -> bool {
    model.parameters.tendon.is_some() && model.drive().is_ok_and(|drive| drive == Drive::GuidedMotor)
}

#[cfg(test)]
mod tests {
    use bowden_model::channel::Channel;
    use bowden_model::effects::find;

    use super::super::Asked;
    use super::*;
    use crate::fit::objective::Objective;
    use crate::progress::Quiet;
    use crate::test_bench;

    /// The bench has a spring. Beside the loss with it the fit without it is far behind and stays coarse; beside its own loss it is
    /// the one that all rounds find.
    #[test]
    fn a_fit_goes_on_to_convergence_unless_it_is_far_behind() {
        let mut recording = test_bench::swung(3000);
        recording.set(Channel::Duty, vec![0.0; 3000]);
        recording.set(Channel::BusVoltage, vec![24.0; 3000]);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        assert!(drives_tendons(&model));
        let spring =
            ActiveEffect::with_defaults(find("joint_spring").unwrap()).with("stiffness_nm_per_rad", 0.5);
        let recording = test_bench::measured(&model, recording, &[spring]);
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        let asked = Asked::default();
        let search = Search { objective: &objective, believed: &model, asked: &asked, progress: &Quiet };
        let layout = Layout::of(&model);
        let whole = search.fit(layout.clone(), &model, &[COARSE_STEP, FINE_STEP]).unwrap();
        let coarse = search.fit(layout.clone(), &model, &[COARSE_STEP]).unwrap();
        let beside = |other_loss| search.fit_beside(layout.clone(), &model, other_loss).unwrap();
        let far_behind = beside(0.9 * coarse.loss / DECIDED);
        assert_eq!((far_behind.finished, far_behind.loss), (false, coarse.loss));
        let near = beside(1.1 * coarse.loss / DECIDED);
        assert!(near.finished && near.loss < coarse.loss, "{}, coarse {}", near.loss, coarse.loss);
        assert!((near.loss / whole.loss - 1.0).abs() < 1e-3, "{}, in one {}", near.loss, whole.loss);
    }

    /// The friction coefficient is believed within a factor of e^0.5: 3.9 times of it is within three of these, 5 times is not.
    #[test]
    fn candidates_are_fitted_anew_where_a_parameter_has_run_off() {
        let recording = test_bench::swung(1000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        let asked = Asked::default();
        let search = Search { objective: &objective, believed: &model, asked: &asked, progress: &Quiet };
        let anew = |times: f64| {
            let mut fitted = model.clone();
            fitted.parameters.sheath.as_mut().unwrap().friction_coefficient *= times;
            fitted.effects.push(ActiveEffect::with_defaults(find("joint_spring").unwrap()));
            let present = search.fit(Layout::of(&model), &fitted, &[]).unwrap();
            search.anew(&present).map(|anew| (anew.parameters == model.parameters, anew.effects.len()))
        };
        assert_eq!([3.9, 5.0, 0.25, 0.2].map(anew), [None, Some((true, 1)), None, Some((true, 1))]);
    }
}
