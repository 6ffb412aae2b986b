//! Moments at which something happens to a bench: whether the recordings run through one, or differ from each other anyway.

use bowden_model::effect::ActiveEffect;

use super::policy::POLICY;
use crate::fit::free::is_moment;
use crate::fit::objective::{Objective, Part};
use crate::joint_model::JointModel;
use crate::outcome::Failure;

/// Whether the moment of effect `index` of `model` may as well lie between two recordings in which something was set differently:
/// what was set may be what tells them apart, and nothing shows it happen.
///
/// Moved to where the recording begins or ends that runs through it, the moment has to predict that recording worse by a
/// worthwhile amount. Where nothing was set differently nothing else tells recordings apart, and a moment between two counts.
///
/// # Errors
/// When the model cannot be driven.
pub(super) fn between_recordings(
    objective: &Objective,
    model: &JointModel,
    index: usize,
) -> Result<bool, Failure> {
    let effect = &model.effects[index];
    let Some(moment) = moment_of(effect) else { return Ok(false) };
    if !objective.states_conditions() {
        return Ok(false);
    }
    let running = objective.on(effect.bench).running_at(effect.parameters[moment]);
    let loss = |model: &JointModel| {
        Ok::<f64, Failure>(running.mean_loss(&running.residuals(model)?, Part::Training))
    };
    let fitted = loss(model)?;
    for recording in 0..running.recordings() {
        let mut worse = true;
        for border_s in running.input(recording).clock_s() {
            let mut moved = model.clone();
            moved.effects[index].parameters[moment] = border_s;
            worse &= POLICY.worth_naming(loss(&moved)?, fitted);
        }
        if worse {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Place, among the parameters, of the moment at which `effect` sets in.
pub(super) fn moment_of(effect: &ActiveEffect) -> Option<usize> {
    effect.descriptor().parameters.iter().position(is_moment)
}

#[cfg(test)]
mod tests {
    use bowden_model::effects::find;

    use super::*;
    use crate::recording::Recording;
    use crate::rig::{Assignment, RigParameter};
    use crate::study::Study;
    use crate::test_bench;

    /// A tendon's terminal that slips at `slips_s`.
    fn slipping(model: &JointModel, slips_s: f64) -> JointModel {
        let loss = ActiveEffect::with_defaults(find("pretension_loss").unwrap());
        JointModel { effects: vec![loss.with("share", 0.3).with("time_s", slips_s)], ..model.clone() }
    }

    /// Two recordings of 2 s each of a bench that slips at `slips_s`, the second one with `set`.
    fn recorded(slips_s: f64, set: &[Assignment]) -> (Objective, JointModel) {
        let swung = test_bench::swung(2000);
        let mut study = Study::of_bench(test_bench::rig(), vec![swung.clone(), swung], Vec::new());
        study.recordings[1].set = set.to_vec();
        let stated = study.joint().unwrap();
        let model = slipping(&stated, slips_s);
        let seen = Objective::of(&stated, study.observed(&stated).unwrap()).unwrap().predict(&model).unwrap();
        for (listed, seen) in study.recordings.iter_mut().zip(seen) {
            let recording: &mut Recording = &mut listed.recording;
            for channel in &model.outputs {
                if let Some(values) = seen.channel(*channel) {
                    recording.set(*channel, values.to_vec());
                }
            }
        }
        (Objective::of(&stated, study.observed(&stated).unwrap()).unwrap(), model)
    }

    #[test]
    fn a_moment_between_recordings_counts_where_nothing_was_set_differently() {
        let heavier = [Assignment { parameter: RigParameter::parse("load.mass_kg").unwrap(), value: 2.0 }];
        for (slips_s, set, between) in [
            (1.0, &heavier[..], false),
            (3.0, &heavier, false),
            // At the border of both, within a sample.
            (2.0, &heavier, true),
            (2.0, &[], false),
        ] {
            let (objective, model) = recorded(slips_s, set);
            assert_eq!(between_recordings(&objective, &model, 0).unwrap(), between, "{slips_s} s {set:?}");
        }
    }

    /// How long tendons had hung before is no moment that is looked for.
    #[test]
    fn what_has_no_moment_lies_between_no_recordings() {
        let heavier = [Assignment { parameter: RigParameter::parse("load.mass_kg").unwrap(), value: 2.0 }];
        let (objective, mut model) = recorded(2.0, &heavier);
        for id in ["joint_spring", "tendon_creep"] {
            model.effects = vec![ActiveEffect::with_defaults(find(id).unwrap())];
            assert!(!between_recordings(&objective, &model, 0).unwrap(), "{id}");
        }
    }
}
