//! Laws that the data ask for in place of the names, or beside them: tried once no further name is found, and held to more than a
//! name is.

use bowden_model::effect::{ActiveEffect, Component};

use super::{Chosen, Fitted, Kind, PROMISING, Round, Search, Worth};
use crate::diagnose::policy::{POLICY, Policy};
use crate::diagnose::unexplained::unexplained;
use crate::fit::solver::{COARSE_STEP, FINE_STEP};
use crate::outcome::Failure;

/// Most laws that are found.
const MOST_LAWS: usize = 2;

/// Part of what names take off the loss that a law must promise to take off in their place, to be fitted.
const RIVALLING: f64 = 0.5;

impl Search<'_> {
    /// Puts one law in the place of all names, or of all but the first, where it predicts clearly better than they do: by [`Policy::worth_stating`]
    /// what one name does, and by as much as a name must be worth what several do, or one that is of the same sensor. `nothing` is the fit
    /// without either. Says whether it did.
    pub(super) fn law_in_place_of_names(
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

    /// Adds the laws that are worth stating to what was found, and takes out names that one of them makes superfluous: a name
    /// may have been the nearest thing on the list.
    pub(super) fn add_laws(
        &self,
        present: &mut Fitted,
        chosen: &mut Vec<Chosen>,
        rounds: &mut Vec<Round>,
    ) -> Result<(), Failure> {
        for _ in 0..MOST_LAWS {
            if self.progress.interrupted() || !POLICY.worth_stating(present.loss, 0.0) {
                break;
            }
            // Where a free form has shown that something is left, and where, a law of that part need be worth no more than a name.
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
        }
        Ok(())
    }
}

/// Whether both change what one sensor reads: their losses differ by its channel alone, and not by all that a joint does.
fn are_of_one_sensor(one: &ActiveEffect, other: &ActiveEffect) -> bool {
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
