//! Values of their own on single benches for what a study says that its benches share.

use std::collections::BTreeMap;

use super::layout::Layout;
use super::policy::POLICY;
use super::selection::PATIENCE;
use crate::fit::objective::{Objective, Part};
use crate::fit::solver::{COARSE_STEP, FINE_STEP, solve_in_rounds};
use crate::joint_model::{JointModel, OwnParameter};
use crate::outcome::Failure;
use crate::rig::RigParameter;

/// Parameters that a recalibration of `believed` moves on all benches together.
fn shared(believed: &JointModel) -> Vec<RigParameter> {
    let calibrated = Layout::of(believed).calibrated(believed);
    let shared = calibrated.iter().filter(|free| free.bench(believed).is_none());
    shared.filter_map(|free| free.parameter(believed)).filter(|parameter| !parameter.is_of_effect()).collect()
}

/// `model` with values of their own on `bench` for all parameters that a recalibration of `believed` moves.
pub(super) fn with_own_parameters(model: &JointModel, believed: &JointModel, bench: u16) -> JointModel {
    let mut with = model.clone();
    let bench = usize::from(bench);
    for parameter in shared(believed) {
        let has_it = with.own.values.iter().any(|own| own.bench == bench && own.parameter == parameter);
        if !has_it {
            let value = model.value(&parameter);
            with.own.values.push(OwnParameter { bench, parameter, value });
        }
    }
    with
}

/// Shared parameters in which the benches differ: fitted on each bench by itself, all of them together take so much off the loss of `model`
/// as an effect of one bench has to, and the values of these lie farther apart than the recordings leave open.
///
/// # Errors
/// When the model cannot be driven.
pub(super) fn differing(
    objective: &Objective,
    believed: &JointModel,
    model: &JointModel,
) -> Result<Vec<String>, Failure> {
    let benches = objective.benches();
    if benches.len() < 2 {
        return Ok(Vec::new());
    }
    let own = |model: &JointModel| {
        let each =
            benches.iter().fold(model.clone(), |with, bench| with_own_parameters(&with, believed, *bench));
        let mut own = each.own;
        own.everywhere.extend(shared(believed));
        JointModel { own, ..each }
    };
    let (believed_own, start) = (own(believed), own(model));
    let free = Layout::of(believed).free(&believed_own, &start);
    let solution = solve_in_rounds(objective, &start, &free, PATIENCE, &[COARSE_STEP, FINE_STEP])?;
    let before = objective.mean_loss(&objective.residuals(model)?, Part::Training);
    let after = objective.mean_loss(&solution.residuals, Part::Training);
    if before - after < POLICY.name_loss || !POLICY.shows_on_one_bench(before, after) {
        return Ok(Vec::new());
    }
    let mut values: BTreeMap<String, Vec<(f64, f64)>> = BTreeMap::new();
    let shared = shared(believed);
    let fitted = free.iter().zip(&solution.values).zip(&solution.slopes().stds);
    for ((free, value), std) in fitted.filter(|((free, _), _)| free.bench(&start).is_some()) {
        if let (Some(std), Some(parameter)) = (std, free.parameter(&start))
            && shared.contains(&parameter)
        {
            values.entry(free.path(&start)).or_default().push((*value, *std));
        }
    }
    let are_apart = |values: &[(f64, f64)]| {
        values.iter().any(|(one, std)| {
            values.iter().any(|(other, others_std)| POLICY.is_sure(one - other, Some(std.hypot(*others_std))))
        })
    };
    Ok(values.into_iter().filter(|(_, values)| are_apart(values)).map(|(path, _)| path).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Recording;
    use crate::simulation::{ReplayInput, replay};
    use crate::study::{Bench, Study, StudyRecording};
    use crate::test_bench;

    fn recorded(joint: &JointModel, stated: &JointModel) -> Recording {
        let mut recording = test_bench::swung(4000);
        let measured = replay(joint, &ReplayInput::new(stated, &recording).unwrap()).unwrap();
        for (channel, values) in measured.channels() {
            recording.set(channel, values.to_vec());
        }
        recording
    }

    /// Two benches, of which the second has another pretension, and the first or both a softer tendon than the rig file says.
    #[test]
    fn benches_differ_in_what_has_other_values_on_each() {
        let found = |pretension: f64, own: &[&str]| {
            let stated = JointModel::from_rig(&test_bench::rig(), &test_bench::swung(10)).unwrap();
            let mut joint = stated.clone();
            joint.parameters.tendon.as_mut().unwrap().axial_stiffness_n *= 0.9;
            let first = recorded(&joint, &stated);
            joint.parameters.tendon.as_mut().unwrap().pretension_n *= pretension;
            let second = recorded(&joint, &stated);
            let mut study = Study::of_bench(test_bench::rig(), vec![first], Vec::new());
            let own = own.iter().map(|name| RigParameter::parse(name).unwrap()).collect();
            study.benches.push(Bench { name: "second".to_owned(), rig: test_bench::rig(), own });
            let listed = StudyRecording { recording: second, bench: 1, ..study.recordings[0].clone() };
            study.recordings.push(listed);
            let model = study.joint().unwrap();
            let objective = Objective::of(&model, study.observed(&model).unwrap()).unwrap();
            let free = Layout::of(&model).calibrated(&model);
            let fitted =
                solve_in_rounds(&objective, &model, &free, PATIENCE, &[COARSE_STEP, FINE_STEP]).unwrap();
            differing(&objective, &model, &fitted.model).unwrap()
        };
        assert_eq!(found(1.2, &[]), ["tendon.pretension_n"]);
        assert_eq!(found(1.0, &[]), Vec::<String>::new(), "both are off the rig file alike");
        assert_eq!(found(1.2, &["tendon.pretension_n"]), Vec::<String>::new(), "the study says so");
    }
}
