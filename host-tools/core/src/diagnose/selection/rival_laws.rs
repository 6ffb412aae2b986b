//! Comparison of the named effects with the laws of their component, because a named effect may be only the nearest entry of the catalogue:
//! a gain and an offset imitate a curved sensor, viscous friction imitates drag.
//!
//! A law is fitted in place of one named effect, or of all that was found of one component, laws among it, together with all other effects:
//! a spring and a ripple imitate a torque that rises with the cube of the angle. The more likely of the two is kept, with the prior odds that
//! [`handicap`] gives to effects of the catalogue; the other one counts as its rival.

use bowden_model::effect::{ActiveEffect, Component};
use bowden_model::law;

use super::laws::rivalling;
use super::loudest::without_the_loudest;
use super::{
    Chosen, Explanation, Fitted, PROMISING, Round, Search, Tried, handicap, instances, is_further, remove,
};
use crate::diagnose::candidates::Candidate;
use crate::diagnose::law_candidates::law_candidates;
use crate::fit::solver::{COARSE_STEP, FINE_STEP};
use crate::outcome::Failure;

impl Search<'_> {
    /// Compares the named effects with the laws of their component, replaces those that a law predicts better than, and returns whether there
    /// were any. `nothing` is the fit without effects.
    pub(super) fn replace_by_laws(
        &self,
        nothing: &Fitted,
        now: &mut Explanation,
        rounds: &mut Vec<Round>,
    ) -> Result<bool, Failure> {
        let mut replaced = false;
        for group in imitators(&now.chosen) {
            if self.progress.interrupted() {
                return Ok(replaced);
            }
            let chosen = now.chosen.iter().enumerate();
            let places: Vec<usize> =
                chosen.filter(|(_, one)| group.contains(&one.effect)).map(|(place, _)| place).collect();
            // A law may have replaced one of them together with others.
            if places.len() == group.len() {
                replaced |= self.compare_one(&places, nothing, now, rounds)?;
            }
        }
        if replaced {
            self.prune(now)?;
        }
        Ok(replaced)
    }

    /// Compares the effects at `places` with the best law in place of all of them, and returns whether the law replaces them.
    fn compare_one(
        &self,
        places: &[usize],
        nothing: &Fitted,
        now: &mut Explanation,
        rounds: &mut Vec<Round>,
    ) -> Result<bool, Failure> {
        let Explanation { fit: present, chosen } = now;
        let rest = if places.len() == chosen.len() {
            nothing.clone()
        } else {
            let (layout, without) = present.without(places);
            self.fit(layout, &without, &[COARSE_STEP, FINE_STEP])?
        };
        let before = self.without_exhausted(&rest)?;
        let bench = chosen[places[0]].effect.bench;
        let with_laws = places.iter().any(|place| law::of(&chosen[*place].effect).is_some());
        let removed_share = 1.0 - present.loss_on(bench) / before.loss_on(bench);
        let predictions = self.objective.predict(&before.solution.model)?;
        let mut all = law_candidates(bench, &before.without_ordinary(), self.objective, &predictions);
        all.retain(|candidate| places.iter().all(|place| can_replace(candidate, &chosen[*place].effect)));
        // That a law had to be added tells that straight lines promised too little of what it would do by itself.
        let promising =
            if with_laws { PROMISING } else { rivalling(rounds, &chosen[places[0]].effect, removed_share) };
        let (record, fits) = self.best_of(&before, &predictions, &all, promising, Some(present.loss))?;
        rounds.push(Round { loss_before: before.loss, candidates: record });
        let Some(best) = fits.into_iter().find(|fitted| fitted.finished) else { return Ok(false) };
        let law = self.with_ordinary(best)?;
        let own: f64 = names_at(places, chosen).map(|one| handicap(&one.effect)).product();
        let others = handicap(&law.newest());
        let is_likelier = |named: f64, stated: f64| others * stated < own * named;
        let [named_loss, stated_loss] = [&*present, &law].map(|fitted| fitted.loss_on(bench));
        let is_likelier_overall = is_likelier(named_loss, stated_loss);
        let quieter = without_the_loudest(&present.stretch_losses_on(bench), &law.stretch_losses_on(bench));
        let does_better = |[named, stated]: &[f64; 2]| {
            if with_laws { is_likelier(*named, *stated) } else { stated < named }
        };
        if is_likelier_overall
            && quieter.iter().all(does_better)
            && self.is_no_parameter(&before, &law, law.newest_place())?
            && self.holds_across_recordings(present, &law, is_likelier)?
        {
            remove(chosen, places);
            chosen.push(Chosen::newest_of(&law, &before, Vec::new()));
            *present = law;
            return Ok(true);
        }
        // A law in place of several effects is no rival of any one of them, and one that a few moments support is none at all.
        if names_at(places, chosen).count() == 1 && !is_likelier_overall {
            let named = &mut chosen[places[0]];
            let loss = stated_loss * named.loss_after / named_loss;
            named.others.push(Tried { loss, ..law.tried(loss) });
        }
        Ok(false)
    }
}

/// Groups of what was found, each with its instances, that one law may have been taken for: all of a component, or of one sensor, that has a
/// name and a law; the names of each; and each name by itself.
fn imitators(chosen: &[Chosen]) -> Vec<Vec<ActiveEffect>> {
    let is_name = |place: &usize| law::of(&chosen[*place].effect).is_none();
    let found: Vec<usize> = (0..chosen.len()).filter(|place| !is_further(chosen, *place)).collect();
    let names: Vec<usize> = found.iter().copied().filter(is_name).collect();
    let are_of_one_part = |one: &ActiveEffect, other: &ActiveEffect| {
        let component = one.descriptor().component;
        component == other.descriptor().component
            && one.bench == other.bench
            && (component != Component::Sensors || are_of_one_sensor(one, other))
    };
    let by_part = |places: &[usize]| {
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for place in places {
            let effect = &chosen[*place].effect;
            match groups.iter_mut().find(|group| are_of_one_part(&chosen[group[0]].effect, effect)) {
                Some(group) => group.push(*place),
                None => groups.push(vec![*place]),
            }
        }
        groups.retain(|group| group.len() > 1);
        groups
    };
    let mut groups = by_part(&found);
    groups.retain(|group| group.iter().any(is_name) && !group.iter().all(is_name));
    groups.extend(by_part(&names));
    groups.extend(names.into_iter().map(|place| vec![place]));
    let with_instances = |group: &Vec<usize>| {
        group.iter().flat_map(|place| instances(chosen, *place)).map(|place| chosen[place].effect).collect()
    };
    groups.iter().map(with_instances).collect()
}

/// Whether a law acts where `named` does.
fn can_replace(candidate: &Candidate, named: &ActiveEffect) -> bool {
    candidate.starts.iter().all(|law| {
        law.descriptor().component == named.descriptor().component
            && (named.descriptor().component != Component::Sensors || law.target.overlaps(named.target))
    })
}

/// Whether both change the reading of the same sensor, so that their losses differ in its channel alone.
fn are_of_one_sensor(one: &ActiveEffect, other: &ActiveEffect) -> bool {
    let of_sensor = |effect: &ActiveEffect| effect.descriptor().component == Component::Sensors;
    of_sensor(one) && of_sensor(other) && one.target.overlaps(other.target)
}

/// The effects at `places`, without further instances.
fn names_at<'c>(places: &'c [usize], chosen: &'c [Chosen]) -> impl Iterator<Item = &'c Chosen> {
    places.iter().filter(|place| !is_further(chosen, **place)).map(|place| &chosen[*place])
}

#[cfg(test)]
mod tests {
    use bowden_model::channel::Channel;
    use bowden_model::effect::Target;
    use bowden_model::effects;

    use super::*;
    use crate::diagnose::hypotheses::Asked;
    use crate::diagnose::layout::Layout;
    use crate::diagnose::words;
    use crate::fit::objective::Objective;
    use crate::joint_model::JointModel;
    use crate::progress::Quiet;
    use crate::test_bench;

    fn named(id: &str) -> ActiveEffect {
        ActiveEffect::with_defaults(effects::find(id).expect("an effect of this name"))
    }

    fn stated(id: &str) -> ActiveEffect {
        ActiveEffect::with_defaults(law::find(id).expect("a law of this name"))
    }

    fn at(effect: ActiveEffect, target: Target) -> ActiveEffect {
        ActiveEffect { target, ..effect }
    }

    fn of_f2(effect: ActiveEffect) -> ActiveEffect {
        at(effect, Target::One(Channel::F2))
    }

    /// Of a bench, with the loss halved to 1.
    fn chosen(effect: ActiveEffect, bench: &JointModel) -> Chosen {
        let compared = [bench.clone(), bench.clone()];
        Chosen {
            effect,
            model: bench.clone(),
            loss_before: 2.0,
            loss_after: 1.0,
            compared,
            others: Vec::new(),
        }
    }

    /// What is left of these named effects on a bench whose physics is `real`.
    fn compared(real: &[ActiveEffect], names: &[ActiveEffect]) -> Vec<Chosen> {
        let recording = test_bench::swung(6000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let recording = test_bench::measured(&model, recording, real);
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        let asked = Asked::default();
        let search = Search { objective: &objective, believed: &model, asked: &asked, progress: &Quiet };
        let fitted = |layout, model: &JointModel| {
            search.with_ordinary(search.fit(layout, model, &[COARSE_STEP, FINE_STEP]).unwrap()).unwrap()
        };
        let nothing = fitted(Layout::of(&model), &model);
        let start = (nothing.layout.clone(), nothing.solution.model.clone());
        let (layout, with) = names.iter().fold(start, |(layout, model), name| layout.with(&model, *name));
        let fit = fitted(layout, &with);
        let chosen = fit.solution.model.effects[fit.layout.first_found()..]
            .iter()
            .map(|effect| Chosen { effect: *effect, ..Chosen::newest_of(&fit, &nothing, Vec::new()) })
            .collect();
        let mut now = Explanation { fit, chosen };
        search.replace_by_laws(&nothing, &mut now, &mut Vec::new()).unwrap();
        assert_eq!(now.chosen.len(), now.fit.solution.model.effects.len() - now.fit.layout.first_found());
        now.chosen
    }

    /// 0.01 of the square of a tension between 20 and 40 N, of which a straight line leaves up to 0.5 N.
    #[test]
    fn a_gain_and_an_offset_that_imitate_a_curved_sensor_give_way_to_it() {
        let curved = of_f2(stated("law_reading_is_curved").with("curvature", 0.01));
        let left = compared(&[curved], &[of_f2(named("sensor_gain_error")), of_f2(named("sensor_offset"))]);
        let [law] = &left[..] else { panic!("{:?}", left.iter().map(|one| one.effect).collect::<Vec<_>>()) };
        assert_eq!(law.effect.descriptor().id, "law_reading_is_curved");
        let curvature = law.effect.parameters[0];
        assert!((curvature / 0.01 - 1.0).abs() < 0.05, "{curvature}");
    }

    /// A spring and a ripple along the angle, which imitate what grows with its cube.
    #[test]
    fn a_name_and_the_law_beside_it_give_way_to_the_law_that_they_imitate() {
        let cube = stated("law_joint_torque_by_angle").with("amplitude_nm", -3.0).with("exponent", 3.0);
        let ripple = stated("law_joint_torque_along_the_angle").with("amplitude_nm", 0.1);
        let left = compared(&[cube], &[named("joint_spring"), ripple]);
        let [law] = &left[..] else { panic!("{:?}", left.iter().map(|one| one.effect).collect::<Vec<_>>()) };
        assert_eq!(law.effect.descriptor().id, "law_joint_torque_by_angle");
        let [amplitude_nm, exponent, ..] = law.effect.parameters;
        assert!((amplitude_nm / -3.0 - 1.0).abs() < 0.05 && (exponent - 3.0).abs() < 0.1, "{:?}", law.effect);
    }

    /// A fit without any effect, in place of one without the replaced effects, would leave the spring to the law.
    #[test]
    fn a_spring_beside_a_curved_sensor_stays() {
        let curved = of_f2(stated("law_reading_is_curved").with("curvature", 0.01));
        let spring = named("joint_spring").with("stiffness_nm_per_rad", 0.5);
        let names = [of_f2(named("sensor_gain_error")), of_f2(named("sensor_offset")), spring];
        let left = compared(&[curved, spring], &names);
        let [spring, law] = &left[..] else {
            panic!("{:?}", left.iter().map(|one| one.effect).collect::<Vec<_>>())
        };
        assert_eq!(law.effect.descriptor().id, "law_reading_is_curved");
        assert_eq!(spring.effect.descriptor().id, "joint_spring");
        assert!(law.loss_before > law.loss_after);
    }

    #[test]
    fn an_offset_stays_one() {
        let offset = of_f2(named("sensor_offset").with("offset", 2.0));
        let left = compared(&[offset], &[of_f2(named("sensor_offset"))]);
        let [name] = &left[..] else { panic!("{:?}", left.iter().map(|one| one.effect).collect::<Vec<_>>()) };
        assert_eq!(name.effect.descriptor().id, "sensor_offset");
        assert!((name.effect.parameters[0] - 2.0).abs() < 0.02, "{:?}", name.effect);
    }

    /// Rotor and joint of a joint without tendons are one body: whatever beside them takes off, friction is as likely of the one as of the other.
    #[test]
    fn without_tendons_friction_of_the_motor_is_as_likely_as_of_the_joint() {
        let recording = test_bench::turned(2, &[]);
        let direct = JointModel::from_rig(&test_bench::direct_rig(), &recording).unwrap();
        let odds = |model: &JointModel, rival: &str| {
            let rival = Tried { effect: named(rival), model: model.clone(), loss: 1.4 };
            chosen(named("joint_coulomb_friction"), model).odds_of(&rival)
        };
        assert_eq!(odds(&direct, "motor_coulomb_friction"), 1.0);
        assert!(odds(&direct, "motor_viscous_friction") < 0.05);
        let tendons = JointModel::from_rig(&test_bench::rig(), &test_bench::swung(2)).unwrap();
        assert!(odds(&tendons, "motor_coulomb_friction") < 0.05);
    }

    /// By hand, for one parameter against two at equal losses: (1.06 / 0.85 / 1.03)^-10 = 0.148; against a further effect 1.
    #[test]
    fn a_law_has_lower_prior_odds_than_a_name() {
        let recording = test_bench::swung(2);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let chosen = chosen(named("joint_viscous_friction"), &model);
        let rival = |effect, loss| Tried { effect, model: model.clone(), loss };
        let law = chosen.odds_of(&rival(stated("law_joint_friction_by_speed"), 1.0));
        assert!((law - 0.1477).abs() < 1e-3, "{law}");
        assert_eq!(chosen.odds_of(&rival(named("joint_coulomb_friction"), 1.0)), 1.0);
        // 0.8 of the loss: 0.8^-10 = 9.3 times the odds.
        let better = chosen.odds_of(&rival(stated("law_joint_friction_by_speed"), 0.8));
        assert!((better / law - 9.313).abs() < 1e-2, "{better}");
    }

    /// Two rivals at the loss of the effect, of which the law has odds of 0.148: 1 / 2.148 of the probability are left for the effect.
    #[test]
    fn a_rival_that_is_a_law_is_listed_with_its_formula() {
        let recording = test_bench::swung(2);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let mut chosen = chosen(named("joint_viscous_friction"), &model);
        for effect in [stated("law_joint_friction_by_speed"), named("joint_coulomb_friction")] {
            chosen.others.push(Tried { effect, model: model.clone(), loss: chosen.loss_after });
        }
        let (probability, rivals) = words::rivals(&chosen, 0.9, |_| None);
        let listed: Vec<(&str, Option<&str>)> =
            rivals.iter().map(|rival| (rival.id.as_str(), rival.formula.as_deref())).collect();
        let formula = "amplitude_nm * abs(omega_out_rad_s)^exponent";
        assert_eq!(
            listed,
            [("law_joint_friction_by_speed", Some(formula)), ("joint_coulomb_friction", None)]
        );
        assert!((probability - 1.0 / 2.148).abs() < 1e-3, "{probability}");
    }

    #[test]
    fn effects_of_one_sensor_and_of_one_part_are_compared_together_and_alone() {
        let recording = test_bench::swung(2);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let of_f4 = |effect| at(effect, Target::One(Channel::F4));
        let [gain, offset] = ["sensor_gain_error", "sensor_offset"].map(|id| of_f2(named(id)));
        let other = of_f4(named("sensor_offset"));
        let [dry, spring] = ["joint_coulomb_friction", "joint_spring"].map(named);
        let [cogging, harmonic] = [8.0, 16.0].map(|n| named("motor_cogging").with("cycles_per_turn", n));
        let law = stated("law_joint_friction_at_a_place");
        let all: Vec<Chosen> = [gain, dry, other, cogging, law, offset, harmonic, spring]
            .map(|effect| chosen(effect, &model))
            .to_vec();
        let expected = [
            // One law may have been taken for these and the law beside them.
            vec![dry, law, spring],
            vec![gain, offset],
            vec![dry, spring],
            vec![gain],
            vec![dry],
            vec![other],
            vec![cogging, harmonic],
            vec![offset],
            vec![spring],
        ];
        assert_eq!(imitators(&all), expected);
    }

    #[test]
    fn a_zero_is_compared_with_a_law_of_its_own_sensor_and_with_no_other() {
        let of_f3 = at(named("sensor_offset"), Target::One(Channel::F3));
        for (id, target, compared) in [
            ("law_reading_sets_in", Target::One(Channel::F3), true),
            ("law_reading_sets_in", Target::Tensions, true),
            ("law_reading_sets_in", Target::One(Channel::F4), false),
            ("law_joint_torque_by_angle", Target::None, false),
        ] {
            assert_eq!(are_of_one_sensor(&of_f3, &at(stated(id), target)), compared, "{id} of {target:?}");
        }
        // Two without a channel are of one target, and of no sensor.
        assert!(!are_of_one_sensor(&named("joint_spring"), &stated("law_joint_torque_by_angle")));
    }
}
