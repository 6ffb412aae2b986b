//! What is left of an effect that has faded: another effect of the catalogue, such as dry friction of friction that no longer falls with speed.

use bowden_model::effect::ActiveEffect;
use bowden_model::effects::find;

use super::{PATIENCE, Selected, handicap};
use crate::diagnose::at_full_resolution;
use crate::diagnose::layout::Layout;
use crate::fit::objective::{Objective, Part};
use crate::fit::solver::{FINE_STEP, solve_in_rounds};
use crate::fit::typical::sized;
use crate::joint_model::JointModel;
use crate::outcome::Failure;

/// The effect of the catalogue that remains of a negligible one, if any, with what was fitted to parameters of the same name.
pub(super) fn remainder(believed: &JointModel, effect: &ActiveEffect) -> Option<ActiveEffect> {
    let (id, strength) = effect.effect.remainder(&effect.parameters)?;
    let mut other = ActiveEffect { target: effect.target, bench: effect.bench, ..sized(believed, find(id)?) };
    for (parameter, value) in effect.descriptor().parameters.iter().zip(effect.parameters) {
        let named = other.descriptor().parameters.iter().position(|one| one.name == parameter.name);
        if let Some(place) = named {
            other.parameters[place] = value;
        }
    }
    other.parameters[0] = strength;
    Some(other)
}

impl Selected {
    /// Whether an effect that `fewer` replaces by its remainder is likelier than that remainder ([`handicap`]) with the nuisance terms beside
    /// both, fitted to `objective` at the resolution of `model`. Without these what they stand for hides how friction builds up after a
    /// reversal, and with that whether it falls with speed.
    ///
    /// # Errors
    /// When the model cannot be driven.
    pub fn has_more_than_remainders(
        &self,
        fewer: &Self,
        objective: &Objective,
        model: &JointModel,
    ) -> Result<bool, Failure> {
        let believed = &self.baseline.model;
        let layout = &self.present.layout;
        let searched = at_full_resolution(self.searched(), model);
        for chosen in &self.chosen {
            let mut found = searched.effects.iter().enumerate().skip(layout.first_found());
            let place = found.find(|(_, one)| one.is_beside(&chosen.effect)).map(|(place, _)| place);
            let Some((place, other)) = place.zip(remainder(believed, &chosen.effect)) else { continue };
            if self.chosen.iter().any(|one| one.effect.is_beside(&other))
                || !fewer.chosen.iter().any(|one| one.effect.is_beside(&other))
            {
                continue;
            }
            let (bare, without) = layout.without(&searched, place - layout.first_found());
            let (other_layout, with_other) = bare.with(&without, other);
            let handicapped = |layout: &Layout, start: &JointModel, effect: &ActiveEffect| {
                let free = layout.free(believed, start);
                let fitted = solve_in_rounds(objective, start, &free, PATIENCE, &[FINE_STEP])?;
                let loss = objective.mean_loss_on(effect.bench, &fitted.residuals, Part::Training);
                Ok::<_, Failure>(handicap(effect) * loss)
            };
            let of_itself = handicapped(layout, &searched, &chosen.effect)?;
            if of_itself < handicapped(&other_layout, &with_other, &other)? {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Asked, select};
    use super::*;
    use crate::progress::Quiet;
    use crate::test_bench;

    /// Friction that falls with speed is likelier than dry friction where it is there, and not where it is not; an effect that both name is
    /// not compared.
    #[test]
    fn friction_that_falls_with_speed_is_compared_with_dry_friction() {
        let falling = |excess_nm: f64| {
            ActiveEffect::with_defaults(find("motor_stribeck_friction").unwrap())
                .with("excess_nm", excess_nm)
                .with("speed_rad_s", 0.3)
                .with("coulomb_nm", 0.08)
        };
        let dry =
            ActiveEffect::with_defaults(find("motor_coulomb_friction").unwrap()).with("torque_nm", 0.08);
        for (hidden, is_more) in [(falling(0.03), true), (dry, false)] {
            let recording = test_bench::turned(3000, &[hidden]);
            let model = JointModel::from_rig(&test_bench::direct_rig(), &recording).unwrap();
            let objective = Objective::new(&model, &[recording], &[], true).unwrap();
            let mut found = select(&objective, &model, &Asked::default(), &Quiet).unwrap();
            assert_eq!(found.chosen.len(), 1, "{hidden:?}");
            let named = found.chosen[0].effect;
            found.chosen[0].becomes(falling(0.03));
            let place = found.present.layout.first_found();
            found.present.solution.model.effects[place] = falling(0.03);
            let mut fewer = found.clone();
            fewer.chosen[0].becomes(dry);
            let has_more =
                |fewer: &Selected| found.has_more_than_remainders(fewer, &objective, &model).unwrap();
            assert_eq!((has_more(&fewer), has_more(&found)), (is_more, false), "{named:?}");
        }
    }
}
