//! Hypotheses of the user: each is fitted alone on top of the recalibrated rig and compared with the best alternatives.

use bowden_model::effect::ActiveEffect;

use super::{Fitted, Kind, PROMISING, Search};
use crate::diagnose::hypotheses::candidate;
use crate::diagnose::layout::Layout;
use crate::fit::free::Free;
use crate::hypothesis::{self, Hypothesis};
use crate::joint_model::JointModel;
use crate::outcome::Failure;
use crate::simulation::Prediction;

/// A hypothesis after a converged fit.
#[derive(Clone)]
pub struct Trial {
    /// Index of the hypothesis.
    pub hypothesis: &'static Hypothesis,
    /// Fitted effect.
    pub effect: ActiveEffect,
    /// Standard deviations of its coefficients.
    pub stds: Vec<Option<f64>>,
    /// The model without it.
    pub without: JointModel,
    /// The model with it.
    pub with: JointModel,
    /// Loss with it.
    pub loss: f64,
    /// Best alternatives.
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

/// Best alternative of each kind to a hypothesis; `None` if none was fitted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rivals {
    /// Effect of the catalogue.
    pub catalogue: Option<BestRival>,
    /// Closed form at any port.
    pub closed_form: Option<BestRival>,
    /// Curve through six values at the same port; of two variables over the better one.
    pub free_curve: Option<BestRival>,
}

/// Alternative of its kind with the lowest loss.
#[derive(Clone, Debug, PartialEq)]
pub struct BestRival {
    /// Effect, law, or variable of a curve.
    pub id: String,
    /// The model with it.
    pub model: JointModel,
    /// Loss with it.
    loss: f64,
}

impl Search<'_> {
    /// Fits every hypothesis alone.
    pub(super) fn trials(&self, nothing: &Fitted) -> Result<Vec<Trial>, Failure> {
        if self.asked.hypotheses.is_empty() || self.progress.interrupted() {
            return Ok(Vec::new());
        }
        let before = self.without_exhausted(nothing)?;
        let predictions = self.objective.predict(&before.solution.model)?;
        let (_, laws) = self.one_more(&before, Kind::Law, PROMISING, None)?;
        let closed_form = laws.first().map(|law| rival(law.newest().descriptor().id, law));
        let (_, names) = self.one_more(&before, Kind::Name, PROMISING, None)?;
        let mut names = names.iter().filter(|name| hypothesis::of(&name.newest()).is_none());
        let catalogue = names.next().map(|name| rival(name.newest().descriptor().id, name));
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
                if rivals.free_curve.as_ref().is_none_or(|best| fitted.loss < best.loss) {
                    rivals.free_curve = Some(rival(of.name(), &fitted));
                }
            }
            let model = &fitted.solution.model;
            let newest = model.effects.len() - 1;
            let all = &fitted.solution.slopes().stds;
            let first = all.len() - Layout::of_found(model, newest).len();
            let stds = all[first..][..Free::of_effect(model, newest).len()].to_vec();
            trials.push(Trial {
                hypothesis,
                effect,
                stds,
                without: before.solution.model.clone(),
                with: model.clone(),
                loss: fitted.loss,
                rivals,
            });
        }
        Ok(trials)
    }

    /// Converged fit of one hypothesis on top of `before`; `None` if the work was interrupted.
    fn alone(
        &self,
        before: &Fitted,
        predictions: &[Prediction],
        hypothesis: &'static Hypothesis,
    ) -> Result<Option<Fitted>, Failure> {
        let candidates = [candidate(hypothesis)];
        let (_, mut fits) = self.best_of(before, predictions, &candidates, f64::NEG_INFINITY, None)?;
        Ok(if self.progress.interrupted() || fits.is_empty() { None } else { Some(fits.remove(0)) })
    }
}

fn rival(id: &str, fitted: &Fitted) -> BestRival {
    BestRival { id: id.to_owned(), model: fitted.solution.model.clone(), loss: fitted.loss }
}
