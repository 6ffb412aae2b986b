//! Hypotheses of the user, each by itself beside the recalibrated rig, and what else does best in its place.

use bowden_model::effect::ActiveEffect;

use super::{Attempted, Fitted, Kind, PROMISING, Round, Search};
use crate::diagnose::hypotheses::candidate;
use crate::diagnose::layout::Layout;
use crate::diagnose::verdict::RivalLoss;
use crate::fit::free::Free;
use crate::hypothesis::{self, Hypothesis};
use crate::outcome::Failure;
use crate::simulation::Prediction;

/// A hypothesis, fitted to the end.
#[derive(Clone)]
pub struct Trial {
    /// Which.
    pub hypothesis: &'static Hypothesis,
    /// As it was fitted.
    pub effect: ActiveEffect,
    /// Standard deviations of its coefficients.
    pub stds: Vec<Option<f64>>,
    /// Held-out loss without it.
    pub loss_without: f64,
    /// Held-out loss with it.
    pub loss: f64,
    /// What else does best in its place.
    pub rivals: Rivals,
}

impl std::fmt::Debug for Trial {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Trial")
            .field("effect", &self.effect)
            .field("loss", &self.loss)
            .finish_non_exhaustive()
    }
}

/// The best of each kind in place of a hypothesis; `None` where none is worth a fit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rivals {
    /// Effect of the catalogue.
    pub catalogue: Option<RivalLoss>,
    /// Closed form at any port.
    pub closed_form: Option<RivalLoss>,
    /// Curve through six values at the same port; of two variables over the better one.
    pub free_curve: Option<RivalLoss>,
}

impl Search<'_> {
    /// Tries every hypothesis by itself. `rounds` are those of the search, of which the first tried the catalogue beside the same.
    pub(super) fn trials(&self, nothing: &Fitted, rounds: &[Round]) -> Result<Vec<Trial>, Failure> {
        if self.asked.hypotheses.is_empty() || self.progress.interrupted() {
            return Ok(Vec::new());
        }
        let before = self.without_exhausted(nothing)?;
        let predictions = self.objective.predict(&before.solution.model)?;
        let (_, laws) = self.one_more(&before, Kind::Law, PROMISING)?;
        let closed_form = laws.first().map(|law| rival(law.newest().descriptor().id, law.loss));
        let catalogue = rounds.first().and_then(|round| best_name(&round.candidates));
        let mut trials = Vec::new();
        for hypothesis in self.asked.hypotheses {
            let Some(fitted) = self.alone(&before, &predictions, hypothesis)? else { continue };
            let effect = fitted.newest();
            let mut rivals =
                Rivals { catalogue: catalogue.clone(), closed_form: closed_form.clone(), free_curve: None };
            for (variable, of) in hypothesis.variables().iter().enumerate() {
                let Some(curve) = hypothesis.free_curve(variable, &effect) else { continue };
                curve.settle()?;
                let Some(fitted) = self.alone(&before, &predictions, curve)? else { continue };
                if rivals.free_curve.as_ref().is_none_or(|best| fitted.loss < best.heldout_loss) {
                    rivals.free_curve = Some(rival(of.name(), fitted.loss));
                }
            }
            let model = &fitted.solution.model;
            let newest = model.effects.len() - 1;
            let all = &fitted.solution.stds;
            let first = all.len() - Layout::of_found(model, newest).len();
            let stds = all[first..][..Free::of_effect(model, newest).len()].to_vec();
            trials.push(Trial {
                hypothesis,
                effect,
                stds,
                loss_without: before.loss,
                loss: fitted.loss,
                rivals,
            });
        }
        Ok(trials)
    }

    /// One hypothesis beside `before`, fitted to the end; `None` when the work is to end.
    fn alone(
        &self,
        before: &Fitted,
        predictions: &[Prediction],
        hypothesis: &'static Hypothesis,
    ) -> Result<Option<Fitted>, Failure> {
        let (_, mut fits) = self.best_of(before, predictions, &[candidate(hypothesis)], f64::NEG_INFINITY)?;
        Ok(if self.progress.interrupted() || fits.is_empty() { None } else { Some(fits.remove(0)) })
    }
}

fn rival(id: &str, heldout_loss: f64) -> RivalLoss {
    RivalLoss { id: id.to_owned(), heldout_loss }
}

/// Of the effects of the catalogue that a round fitted, the one that held-out data prefer.
fn best_name(tried: &[Attempted]) -> Option<RivalLoss> {
    let names = tried.iter().filter(|attempt| hypothesis::of(&attempt.effect).is_none());
    let fitted =
        names.filter_map(|attempt| Some(rival(attempt.effect.descriptor().id, attempt.heldout_loss?)));
    fitted.min_by(|a, b| a.heldout_loss.total_cmp(&b.heldout_loss))
}
