//! Which kind of a named effect the recordings show: dry friction that builds up in proportion to the turn after a reversal, for example, or
//! ever more slowly.
//!
//! The other kind is tried as soon as the effect is found, because what the wrong one leaves has the form of yet another effect: at the rests
//! of a staircase that of a weight that was changed. While much else is missing the recordings may not tell the kinds apart: once all effects
//! are known the other kinds are tried again.

use super::{Explanation, PATIENCE, Search, handicap};
use crate::fit::solver::{FINE_STEP, Known, solve_for_ranking};
use crate::outcome::Failure;

impl Search<'_> {
    /// Replaces the kind of the effect that was found last by the likeliest one.
    pub(super) fn choose_kind(&self, now: &mut Explanation) -> Result<(), Failure> {
        now.chosen.len().checked_sub(1).map_or(Ok(()), |last| self.choose_kind_of(last, now))
    }

    /// The same for all effects but the last, with all of them known.
    pub(super) fn choose_kinds_again(&self, now: &mut Explanation) -> Result<(), Failure> {
        (0..now.chosen.len().saturating_sub(1)).try_for_each(|index| self.choose_kind_of(index, now))
    }

    fn choose_kind_of(&self, index: usize, now: &mut Explanation) -> Result<(), Failure> {
        let Explanation { fit: present, chosen } = now;
        let place = present.layout.first_found() + index;
        let found = present.solution.model.effects[place];
        if let Some(other) = found.in_other_kind()
            && !self.progress.interrupted()
        {
            let mut model = present.solution.model.clone();
            model.effects[place] = other;
            let likelier = |loss: f64, others_loss: f64| {
                handicap(&other) * others_loss < handicap(&present.solution.model.effects[place]) * loss
            };
            // With the slopes of the other kind, in a third of the simulations.
            let slopes = present.solution.slopes();
            let known = Known { jacobian: Some(&slopes.jacobian), spread: slopes.spread };
            let free = present.layout.free(self.believed, &model);
            let ranked = solve_for_ranking(self.objective, &model, &free, PATIENCE, &known)?;
            let ranked = self.judged(present.layout.clone(), ranked, false);
            if !likelier(present.loss_on(found.bench), ranked.loss_on(found.bench)) {
                return Ok(());
            }
            let with = self.fit(present.layout.clone(), &ranked.solution.model, &[FINE_STEP, FINE_STEP])?;
            if likelier(present.loss_on(found.bench), with.loss_on(found.bench))
                && self.holds_across_recordings(present, &with, likelier)?
            {
                chosen[index].takes_kind(&with, place);
                *present = with;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use bowden_model::effect::ActiveEffect;
    use bowden_model::effects::find;

    use super::super::{Asked, Chosen, Explanation, Policy, Search};
    use crate::diagnose::layout::Layout;
    use crate::fit::objective::Objective;
    use crate::fit::solver::{COARSE_STEP, FINE_STEP};
    use crate::joint_model::JointModel;
    use crate::progress::Quiet;
    use crate::test_bench;

    /// Friction of the joint that builds up over 4 mrad with this exponent.
    fn friction(exponent: f64) -> ActiveEffect {
        let effect = ActiveEffect::with_defaults(find("joint_coulomb_friction").unwrap());
        effect.with("torque_nm", 0.3).with("presliding_rad", 4e-3).with("presliding_exponent", exponent)
    }

    /// Found as a spring up to its level while a spring was missing, friction becomes what it is once that is known.
    #[test]
    fn kinds_are_chosen_again_once_all_effects_are_known() {
        let recording = test_bench::swung(6000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let spring =
            ActiveEffect::with_defaults(find("joint_spring").unwrap()).with("stiffness_nm_per_rad", 0.5);
        let recording = test_bench::measured(&model, recording, &[friction(1.0), spring]);
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        let asked = Asked::default();
        let search = Search { objective: &objective, believed: &model, asked: &asked, progress: &Quiet };
        let nothing = search.fit(Layout::of(&model), &model, &[COARSE_STEP]).unwrap();
        let (layout, with) = nothing.layout.with(&model, friction(0.0));
        let first = search.fit(layout, &with, &[COARSE_STEP, FINE_STEP]).unwrap();
        let (layout, with) = first.layout.with(&first.solution.model, spring);
        let both = search.fit(layout, &with, &[COARSE_STEP, FINE_STEP]).unwrap();
        let loss_before = both.loss;
        let chosen = vec![
            Chosen::newest_of(&first, &nothing, Vec::new()),
            Chosen::newest_of(&both, &first, Vec::new()),
        ];
        let mut now = Explanation { fit: both, chosen };
        search.choose_kinds_again(&mut now).unwrap();
        let [rubbing, springy] = &now.chosen[..] else { panic!("{}", now.chosen.len()) };
        assert_eq!((rubbing.effect.parameters[2], springy.effect.descriptor().id), (1.0, "joint_spring"));
        assert_eq!(now.fit.solution.model.effects[now.fit.layout.first_found()], rubbing.effect);
        assert!(now.fit.loss < 0.5 * loss_before, "{loss_before} to {}", now.fit.loss);
    }

    /// Friction that falls with speed, found as a spring up to its level, becomes what it is: the excess and the turn double.
    #[test]
    fn friction_that_falls_with_speed_becomes_the_other_kind() {
        let kind = |exponent: f64, [excess_nm, speed_rad_s, presliding_rad]: [f64; 3]| {
            ActiveEffect::with_defaults(find("motor_stribeck_friction").unwrap())
                .with("excess_nm", excess_nm)
                .with("speed_rad_s", speed_rad_s)
                .with("coulomb_nm", 0.2)
                .with("presliding_rad", presliding_rad)
                .with("presliding_exponent", exponent)
        };
        let there = [0.2, 0.1, 4e-3];
        let other = kind(0.0, [0.1, 0.15, 2e-3]).in_other_kind().unwrap();
        for (value, expected) in other.parameters.iter().zip(kind(1.0, there).parameters) {
            assert!((value - expected).abs() < 1e-12, "{:?}", other.parameters);
        }
        let back = kind(1.0, there).in_other_kind().unwrap();
        assert_eq!(back.parameters, kind(0.0, [0.1, 0.1 * 1.5, 2e-3]).parameters);
    }

    /// A candidate is tried in both kinds before it is ranked.
    #[test]
    fn candidates_are_fitted_in_both_kinds() {
        let recording = test_bench::swung(3000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let recording = test_bench::measured(&model, recording, &[friction(1.0)]);
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        let asked = Asked::default();
        let search = Search { objective: &objective, believed: &model, asked: &asked, progress: &Quiet };
        let nothing = search.fit(Layout::of(&model), &model, &[COARSE_STEP]).unwrap();
        let fits = search.one_of(&nothing, |effect| effect.is_alike(&friction(0.0)), f64::INFINITY).unwrap();
        assert_eq!(fits[0].newest().parameters[2], 1.0);
    }

    /// Found as a spring up to its level, it becomes what it is, with the turn over which it builds up; and a spring stays one.
    #[test]
    fn dry_friction_becomes_the_kind_that_the_recording_shows() {
        for exponent in [0.0, 1.0] {
            let recording = test_bench::swung(6000);
            let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
            let recording = test_bench::measured(&model, recording, &[friction(exponent)]);
            let objective = Objective::new(&model, &[recording], &[], true).unwrap();
            let asked = Asked::default();
            let search = Search { objective: &objective, believed: &model, asked: &asked, progress: &Quiet };
            let nothing = search.fit(Layout::of(&model), &model, &[COARSE_STEP]).unwrap();
            let (layout, with) = nothing.layout.with(&model, friction(0.0));
            let fit = search.fit(layout, &with, &[COARSE_STEP, FINE_STEP]).unwrap();
            let found_loss = fit.loss;
            let chosen = vec![Chosen::newest_of(&fit, &nothing, Vec::new())];
            let mut now = Explanation { fit, chosen };
            search.choose_kind(&mut now).unwrap();

            let named = {
                let mut named = Explanation { fit: nothing.clone(), chosen: Vec::new() };
                search.add_names(&mut named, &mut Vec::new(), Policy::worth_naming).unwrap();
                named.chosen
            };
            let friction = named.iter().find(|one| one.effect.is_beside(&friction(0.0))).expect("friction");
            assert_eq!(friction.effect.parameters[2], exponent, "as the search names it");

            let [one] = &now.chosen[..] else { panic!("{}", now.chosen.len()) };
            let [torque_nm, presliding_rad, kind, ..] = one.effect.parameters;
            assert_eq!((kind, now.fit.newest(), one.loss_after), (exponent, one.effect, now.fit.loss));
            assert!((torque_nm / 0.3 - 1.0).abs() < 0.05, "exponent {exponent}: {torque_nm} N·m");
            assert!((presliding_rad / 4e-3 - 1.0).abs() < 0.2, "exponent {exponent}: {presliding_rad} rad");
            if exponent == 0.0 {
                assert_eq!(now.fit.loss, found_loss);
            } else {
                assert!(now.fit.loss < 0.5 * found_loss, "{found_loss} to {}", now.fit.loss);
            }
        }
    }
}
