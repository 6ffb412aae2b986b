//! Selection of laws, in place of named effects or in addition to them. Laws are tried once no further effect is found, and must reduce the
//! loss by more than an effect must.

use bowden_model::effect::{ActiveEffect, Component};

use super::{Chosen, Fitted, Kind, PROMISING, Round, Search, Worth};
use crate::diagnose::policy::{POLICY, Policy};
use crate::diagnose::unexplained::unexplained;
use crate::fit::solver::{COARSE_STEP, FINE_STEP};
use crate::outcome::Failure;

/// Maximum number of laws.
const MOST_LAWS: usize = 2;

/// Minimum estimated reduction of the loss by a law, relative to that of the effects it would replace, for it to be fitted.
pub(super) const RIVALLING: f64 = 0.5;

impl Search<'_> {
    /// Searches laws, in place of the named effects and then in addition to them. `nothing` is the fit without effects.
    pub(super) fn with_laws(
        &self,
        nothing: &Fitted,
        present: &mut Fitted,
        chosen: &mut Vec<Chosen>,
        rounds: &mut Vec<Round>,
    ) -> Result<(), Failure> {
        if self.law_in_place_of_names(nothing, present, chosen, rounds)? {
            self.add_names(present, chosen, rounds, Policy::worth_naming)?;
        }
        self.add_laws(present, chosen, rounds)
    }

    /// Replaces all named effects, or all but the first, by one law that predicts clearly better, and returns whether it did. Against one
    /// effect the law must reach [`Policy::worth_stating`]; against several, or one of the same sensor, what a name must achieve.
    /// `nothing` is the fit without effects.
    fn law_in_place_of_names(
        &self,
        nothing: &Fitted,
        present: &mut Fitted,
        chosen: &mut Vec<Chosen>,
        rounds: &mut Vec<Round>,
    ) -> Result<bool, Failure> {
        for kept in 0..chosen.len().min(2) {
            let replaced = &chosen[kept..];
            let several = replaced.len() > 1;
            let worth_looking: Worth = if several { Policy::worth_naming } else { Policy::worth_stating };
            if self.progress.interrupted() || !worth_looking(&POLICY, present.loss, 0.0) {
                return Ok(false);
            }
            let better = |law: &ActiveEffect| -> Worth {
                let like_with_like = replaced.iter().all(|name| are_of_one_sensor(&name.effect, law));
                if several || like_with_like { Policy::worth_naming } else { Policy::worth_stating }
            };
            let beside = match chosen.first().filter(|_| kept == 1) {
                Some(first) => {
                    let (layout, with) = nothing.layout.with(&nothing.solution.model, first.effect);
                    self.fit(layout, &with, &[COARSE_STEP, FINE_STEP])?
                }
                None => nothing.clone(),
            };
            let before = self.without_exhausted(&beside)?;
            let removed_share = 1.0 - present.loss / before.loss;
            let (record, fits) =
                self.one_more(&before, Kind::Law, (RIVALLING * removed_share).max(PROMISING))?;
            rounds.push(Round { loss_before: before.loss, candidates: record });
            if let Some((found, with)) = self.found(&before, &beside, fits, Policy::worth_stating)?
                && with.shows(present, &with.newest(), |without, with| {
                    better(&found.effect)(&POLICY, without, with)
                })
            {
                chosen.truncate(kept);
                chosen.push(found);
                *present = with;
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Adds laws that reach their threshold, and removes effects that a law makes superfluous: such an effect was only the nearest
    /// entry of the catalogue.
    fn add_laws(
        &self,
        present: &mut Fitted,
        chosen: &mut Vec<Chosen>,
        rounds: &mut Vec<Round>,
    ) -> Result<(), Failure> {
        for _ in 0..MOST_LAWS {
            if self.progress.interrupted() || !POLICY.worth_stating(present.loss, 0.0) {
                break;
            }
            // If a free form has already located a remaining structure, a law of that component needs no more than an effect.
            let left = unexplained(self.objective, None, &present.solution.model)?;
            let before = self.without_exhausted(present)?;
            let (record, fits) = self.one_more(&before, Kind::Law, PROMISING)?;
            rounds.push(Round { loss_before: before.loss, candidates: record });
            let there = |fitted: &Fitted| {
                let component = fitted.newest().descriptor().component.name();
                left.as_ref().is_some_and(|left| left.component == component)
            };
            let worth: Worth =
                if fits.first().is_some_and(there) { Policy::worth_naming } else { Policy::worth_stating };
            let Some((found, with)) = self.found(&before, present, fits, worth)? else { break };
            chosen.push(found);
            *present = with;
            self.prune(present, chosen)?;
            // Beside the law an effect may show that is worth little without it.
            self.add_names(present, chosen, rounds, Policy::worth_naming_in_doubt)?;
        }
        Ok(())
    }
}

/// Whether both change the reading of the same sensor, so that their losses differ in its channel alone.
pub(super) fn are_of_one_sensor(one: &ActiveEffect, other: &ActiveEffect) -> bool {
    let of_sensor = |effect: &ActiveEffect| effect.descriptor().component == Component::Sensors;
    of_sensor(one) && of_sensor(other) && one.target.overlaps(other.target)
}

#[cfg(test)]
mod tests {
    use bowden_model::channel::Channel;
    use bowden_model::effect::{ActiveEffect, Effect, Target};
    use bowden_model::effects;
    use bowden_model::law;

    use super::are_of_one_sensor;

    fn of(id: &str, target: Target) -> ActiveEffect {
        let law = || law::find(id).map(|law| law as &'static dyn Effect);
        let effect = effects::find(id).or_else(law).expect("an effect of this name");
        ActiveEffect { target, ..ActiveEffect::with_defaults(effect) }
    }

    #[test]
    fn a_zero_is_compared_with_a_law_of_its_own_sensor_and_with_no_other() {
        let of_f3 = of("sensor_offset", Target::One(Channel::F3));
        for (id, target, compared) in [
            ("law_reading_sets_in", Target::One(Channel::F3), true),
            ("law_reading_sets_in", Target::Tensions, true),
            ("law_reading_sets_in", Target::One(Channel::F4), false),
            ("law_joint_torque_by_angle", Target::None, false),
        ] {
            assert_eq!(are_of_one_sensor(&of_f3, &of(id, target)), compared, "{id} of {target:?}");
        }
        // Two without a channel are of one target, and of no sensor.
        assert!(!are_of_one_sensor(
            &of("joint_spring", Target::None),
            &of("law_joint_torque_by_angle", Target::None)
        ));
    }
}
