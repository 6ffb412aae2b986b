//! Further instances of an effect that one component has several times, such as the harmonics of cogging.
//!
//! They are not further effects, and each alone may reduce the loss little: the lag of a torque sensor hides all but the strongest until it is
//! known. They are therefore added and judged together.

use bowden_model::effect::ActiveEffect;
use bowden_model::effect_set::MAX_ACTIVE;
use bowden_model::search::Starts;

use super::{Chosen, Explanation, Fitted, Search, is_further};
use crate::diagnose::layout::Layout;
use crate::diagnose::locked::{Pattern, further_pattern, too_little_travel};
use crate::diagnose::policy::POLICY;
use crate::fit::objective::Part;
use crate::fit::solver::{COARSE_STEP, FINE_STEP};
use crate::fit::typical::sized;
use crate::joint_model::JointModel;
use crate::outcome::Failure;
use crate::simulation::Prediction;

/// Maximum number of instances of one effect.
const MOST_INSTANCES: usize = 8;

/// Number of effects of a simulation that is reserved for other effects.
const LEFT_TO_NAMES: usize = 3;

/// Minimum relative reduction of the loss by an instance, before any refit, for it to be fitted with the others.
const PROMISING_INSTANCE: f64 = 0.01;

impl Search<'_> {
    /// Adds further instances of every effect that may have several, if they improve the fit.
    pub(super) fn add_instances(&self, now: &mut Explanation) -> Result<(), Failure> {
        let Explanation { fit: present, chosen } = now;
        for index in 0..chosen.len() {
            let effect = chosen[index].effect;
            // Patterns are read off all recordings.
            if is_further(chosen, index)
                || effect.bench.is_some()
                || effect.effect.instances_differ_in().is_none()
            {
                continue;
            }
            let Some((layout, model, added)) = self.further_instances(present, &effect)? else { continue };
            self.progress.stage("fitting further instances", 0);
            let with = self.fit(layout, &model, &[COARSE_STEP, FINE_STEP])?;
            let worth = |without: f64, with: f64| POLICY.worth_having(without, with, added);
            if self.progress.interrupted() || !with.shows(present, &effect, worth) {
                continue;
            }
            if !self.holds_across_recordings(present, &with, worth)? {
                continue;
            }
            let places = with.solution.model.effects.len() - added..;
            chosen.extend(with.solution.model.effects[places].iter().map(|effect| Chosen {
                effect: *effect,
                model: with.without_ordinary(),
                loss_before: present.loss,
                loss_after: with.loss,
                compared: [present, &with].map(|fitted| fitted.solution.model.clone()),
                others: Vec::new(),
            }));
            *present = with;
        }
        Ok(())
    }

    /// The model of `present` with the strongest remaining patterns, added one after the other while each reduces the loss, its layout, and
    /// their number; `None` if none does.
    fn further_instances(
        &self,
        present: &Fitted,
        effect: &ActiveEffect,
    ) -> Result<Option<(Layout, JointModel, usize)>, Failure> {
        let objective = self.objective;
        let Starts::LockedTo(angle) = effect.effect.starts() else { return Ok(None) };
        let loss =
            |predictions: &[Prediction]| objective.mean_loss(&objective.compare(predictions), Part::Training);
        let (mut layout, mut model) = (present.layout.clone(), present.solution.model.clone());
        let mut predictions = objective.predict(&model)?;
        let mut present_loss = loss(&predictions);
        let mut added = 0;
        loop {
            let found = layout.first_found()..;
            let there: Vec<ActiveEffect> = model.effects[found.clone()]
                .iter()
                .filter(|other| other.is_beside(effect))
                .copied()
                .collect();
            if there.len() >= MOST_INSTANCES
                || model.effects.len() + LEFT_TO_NAMES >= MAX_ACTIVE
                || self.progress.interrupted()
            {
                break;
            }
            let base =
                ActiveEffect { target: effect.target, bench: effect.bench, ..sized(&model, effect.effect) };
            let Some(Pattern { new, beside }) =
                further_pattern(base, &there, angle, &model, objective, &predictions)
            else {
                break;
            };
            let (next_layout, mut next) = layout.with(&model, new);
            // The new instance is appended behind the others of its effect.
            let others = next.effects[found].iter_mut().filter(|other| other.is_beside(effect));
            others.zip(beside).for_each(|(other, beside)| *other = beside);
            let next_predictions = objective.predict(&next)?;
            let next_loss = loss(&next_predictions);
            let gain = present_loss - next_loss;
            if too_little_travel(objective, &new)
                || gain < POLICY.name_loss
                || gain < PROMISING_INSTANCE * present_loss
            {
                break;
            }
            (layout, model) = (next_layout, next);
            (predictions, present_loss) = (next_predictions, next_loss);
            added += 1;
        }
        Ok((added > 0).then_some((layout, model, added)))
    }
}
