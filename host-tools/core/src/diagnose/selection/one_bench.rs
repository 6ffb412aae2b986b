//! Effects of one bench of a study: what other benches lack is fitted to its recordings alone, and has to show there.
//!
//! What a study shares may differ from bench to bench all the same. An effect of one bench is therefore compared with values of its own for
//! every parameter that a recalibration moves, and has to do what these cannot.

use bowden_model::effect::ActiveEffect;

use super::{Explanation, Fitted, PROMISING, Round, Search, Worth};
use crate::diagnose::candidates::candidates;
use crate::diagnose::own_parameters::with_own_parameters;
use crate::diagnose::policy::POLICY;
use crate::fit::solver::{COARSE_STEP, FINE_STEP};
use crate::outcome::Failure;

impl Search<'_> {
    /// Whether the newest effect of `with`, which `without` lacks, does what no values of its bench alone do for the parameters that
    /// all share. True for an effect that all benches have.
    pub(super) fn is_no_parameter_of_its_bench(
        &self,
        without: &Fitted,
        with: &Fitted,
        worth: Worth,
    ) -> Result<bool, Failure> {
        let effect = with.newest();
        let Some(bench) = effect.bench else { return Ok(true) };
        let fitted = |fitted: &Fitted| {
            let believed = with_own_parameters(self.believed, self.believed, bench);
            let model = with_own_parameters(&fitted.solution.model, self.believed, bench);
            let search = Search { believed: &believed, ..*self };
            search.fit(fitted.layout.clone(), &model, &[COARSE_STEP, FINE_STEP])
        };
        let [without, with] = [fitted(without)?, fitted(with)?];
        Ok(with.shows(&without, &effect, |before, after| worth(&POLICY, before, after)))
    }

    /// Adds the effect that was found last on further benches, where it is one of a single bench and shows on others too.
    pub(super) fn add_on_other_benches(
        &self,
        now: &mut Explanation,
        rounds: &mut Vec<Round>,
        worth: Worth,
    ) -> Result<(), Failure> {
        let Some(effect) = now.chosen.last().map(|newest| newest.effect) else { return Ok(()) };
        while effect.bench.is_some() && !self.progress.interrupted() {
            let before = self.without_exhausted(&now.fit)?;
            let predictions = self.objective.predict(&before.solution.model)?;
            let mut all =
                candidates(&before.without_ordinary(), self.objective, &predictions, self.asked.effects);
            all.retain(|candidate| {
                candidate.starts.iter().all(|start| start.is_alike(&effect) && start.target == effect.target)
            });
            for candidate in &mut all {
                let bench = candidate.starts.first().and_then(|start| start.bench);
                candidate.starts.push(ActiveEffect { bench, ..effect });
            }
            let tried = self.best_of(&before, &predictions, &all, PROMISING, None)?;
            if !self.add_best(&before, tried, now, rounds, worth)? {
                break;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use bowden_model::channel::Channel;
    use bowden_model::effect::Target;
    use bowden_model::effects::find;
    use bowden_model::law;

    use super::super::{Asked, Chosen, Policy};
    use super::*;
    use crate::diagnose::layout::Layout;
    use crate::fit::objective::{Objective, Series};
    use crate::joint_model::JointModel;
    use crate::progress::Quiet;
    use crate::recording::Recording;
    use crate::study::{Bench, Study, StudyRecording};
    use crate::test_bench;

    fn play() -> ActiveEffect {
        ActiveEffect::with_defaults(find("transmission_backlash").unwrap()).with("gap_rad", 0.02)
    }

    /// A joint and three benches of it with the same recording.
    fn swung_on_three(recording: Recording) -> (JointModel, Objective) {
        let study = three_benches(recording);
        let model = study.joint().unwrap();
        let objective = Objective::of(&model, study.observed(&model).unwrap()).unwrap();
        (model, objective)
    }

    fn three_benches(recording: Recording) -> Study {
        let mut study = Study::of_bench(test_bench::rig(), vec![recording], Vec::new());
        for bench in [1, 2] {
            let name = format!("bench {bench}");
            study.benches.push(Bench { name, rig: test_bench::rig(), own: Vec::new() });
            study.recordings.push(StudyRecording { bench, ..study.recordings[0].clone() });
        }
        study
    }

    /// What is found on three benches of one design, each changed before it is recorded.
    fn found(changes: [fn(&mut JointModel); 3]) -> Explanation {
        found_by(changes, |search| {
            let fit =
                search.fit(Layout::of(search.believed), search.believed, &[COARSE_STEP, FINE_STEP]).unwrap();
            let mut now = Explanation { fit, chosen: Vec::new() };
            search.add_names(&mut now, &mut Vec::new(), Policy::worth_naming).unwrap();
            now
        })
    }

    fn found_by(changes: [fn(&mut JointModel); 3], find: impl Fn(&Search) -> Explanation) -> Explanation {
        let mut study = three_benches(test_bench::swung(6000));
        let model = study.joint().unwrap();
        let joints = changes.map(|change| {
            let mut joint = model.clone();
            change(&mut joint);
            joint
        });
        for (listed, joint) in study.recordings.iter_mut().zip(joints) {
            let objective =
                Objective::new(&joint, std::slice::from_ref(&listed.recording), &[], true).unwrap();
            let measured = objective.predict_first(&joint).unwrap();
            for channel in &model.outputs {
                if let Some(values) = measured.channel(*channel) {
                    listed.recording.set(*channel, values.to_vec());
                }
            }
        }
        let objective = Objective::of(&model, study.observed(&model).unwrap()).unwrap();
        let asked = Asked::default();
        let search = Search { objective: &objective, believed: &model, asked: &asked, progress: &Quiet };
        find(&search)
    }

    const AS_STATED: fn(&mut JointModel) = |_| {};
    const PLAY: fn(&mut JointModel) = |joint| joint.effects.push(play());

    fn effects(found: &Explanation) -> &[ActiveEffect] {
        let effects = &found.fit.solution.model.effects[found.fit.layout.first_found()..];
        assert_eq!(effects.len(), found.chosen.len());
        effects
    }

    /// Its losses are those of its own recording.
    #[test]
    fn what_one_bench_has_is_found_there_with_its_strength() {
        let found = found([AS_STATED, AS_STATED, PLAY]);
        let [one] = effects(&found) else { panic!("{:?}", effects(&found)) };
        assert_eq!((one.descriptor().id, one.bench), ("transmission_backlash", Some(2)));
        assert!((one.parameters[0] / 0.02 - 1.0).abs() < 0.03, "{one:?}");
        assert!(found.chosen[0].loss_after < 0.1 * found.chosen[0].loss_before);
        assert!(found.fit.loss > 0.5 * found.chosen[0].loss_after);
    }

    #[test]
    fn what_two_of_three_benches_have_is_found_on_each_with_its_own_strength() {
        let found = found([AS_STATED, PLAY, |joint| joint.effects.push(play().with("gap_rad", 0.04))]);
        let mut all = effects(&found).to_vec();
        all.sort_by_key(|effect| effect.bench);
        let [smaller, larger] = &all[..] else { panic!("{all:?}") };
        assert_eq!([smaller, larger].map(|effect| effect.bench), [Some(1), Some(2)]);
        assert!((smaller.parameters[0] / 0.02 - 1.0).abs() < 0.03, "{smaller:?}");
        assert!((larger.parameters[0] / 0.04 - 1.0).abs() < 0.03, "{larger:?}");
    }

    /// The short way of a sensor that drives nothing, and the long one.
    #[test]
    fn a_sensor_of_one_bench_is_seen_through_there_alone() {
        let (model, objective) = swung_on_three(test_bench::swung(1000));
        let offset = ActiveEffect {
            target: Target::One(Channel::F2),
            bench: Some(1),
            ..ActiveEffect::with_defaults(find("sensor_offset").unwrap())
        };
        let predictions = objective.predict(&model).unwrap();
        let seen = objective.residuals_seen_through(&predictions, offset).unwrap();
        let simulated = objective.residuals(&JointModel { effects: vec![offset], ..model.clone() }).unwrap();
        let right = objective.residuals(&model).unwrap();
        for (k, entry) in objective.entries().enumerate() {
            assert!((seen.values[k] - simulated.values[k]).abs() < 1e-6, "{entry:?}");
            let is_changed = (seen.values[k] - right.values[k]).abs() > 1e-3;
            let is_there = entry.recording == 1 && entry.series == Series::Channel(Channel::F2);
            assert!(!is_changed || is_there, "{entry:?}");
        }
        assert_ne!(seen, right);
    }

    /// Drag with the square of speed on one bench, for which viscous friction was taken there.
    #[test]
    fn a_law_takes_the_place_of_what_one_bench_has() {
        let drag = |joint: &mut JointModel| {
            let law = ActiveEffect::with_defaults(law::find("law_joint_friction_by_speed").unwrap());
            joint.effects.push(law.with("amplitude_nm", 0.15).with("exponent", 2.0));
        };
        let found = found_by([AS_STATED, AS_STATED, drag], |search| {
            let start = (Layout::of(search.believed), search.believed);
            let nothing = search.fit(start.0, start.1, &[COARSE_STEP, FINE_STEP]).unwrap();
            let viscous = ActiveEffect::with_defaults(find("joint_viscous_friction").unwrap());
            let viscous = ActiveEffect { bench: Some(2), ..viscous };
            let (layout, with) = nothing.layout.with(&nothing.solution.model, viscous);
            let fit = search.fit(layout, &with, &[COARSE_STEP, FINE_STEP]).unwrap();
            let chosen = vec![Chosen::newest_of(&fit, &nothing, Vec::new())];
            let mut now = Explanation { fit, chosen };
            search.laws_in_place_on_benches(&mut now, &mut Vec::new()).unwrap();
            now
        });
        let [one] = effects(&found) else { panic!("{:?}", effects(&found)) };
        assert_eq!((one.descriptor().id, one.bench), ("law_joint_friction_by_speed", Some(2)));
        assert!((one.parameters[1] / 2.0 - 1.0).abs() < 0.1, "{one:?}");
    }

    #[test]
    fn what_all_benches_have_is_one_effect() {
        let found = found([PLAY; 3]);
        let [one] = effects(&found) else { panic!("{:?}", effects(&found)) };
        assert_eq!((one.descriptor().id, one.bench), ("transmission_backlash", None));
    }

    /// Its tendons are softer and its friction is higher by a quarter, which nothing says: no effect, though one would take much off.
    #[test]
    fn other_values_of_parameters_on_one_bench_are_no_effect() {
        let found = found([AS_STATED, AS_STATED, |joint| {
            joint.parameters.tendon.as_mut().unwrap().axial_stiffness_n *= 0.75;
            joint.parameters.sheath.as_mut().unwrap().friction_coefficient *= 1.25;
        }]);
        assert_eq!(effects(&found), []);
    }
}
