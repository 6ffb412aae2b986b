//! What a fit of a model moves: the nominal parameters that a recalibration moves, as far as the model has them and its recordings tell
//! of them, and those that single benches have for themselves.

use super::calibrated::{CALIBRATED, Of};
use super::free::Free;
use crate::joint_model::{Drive, JointModel};
use crate::rig::RigParameter;

/// The parameters of [`CALIBRATED`] that `model` has and shares, and the nominal parameters that single benches have for
/// themselves.
#[must_use]
pub fn recalibrated(model: &JointModel) -> Vec<Free> {
    let of_benches = (0..model.own.values.len())
        .filter(|index| !model.own.values[*index].parameter.is_of_effect())
        .filter_map(|index| Free::own(model, index));
    shared(model).chain(of_benches).collect()
}

/// The listed parameters that `model` has, that the recordings tell of, and that not every bench has for itself.
fn shared(model: &JointModel) -> impl Iterator<Item = Free> + '_ {
    let runs_freely = matches!(model.drive(), Ok(Drive::Duty | Drive::Servo)) || model.guided_by.is_some();
    let is_moved = move |of: Of| match of {
        Of::Every => true,
        Of::FreeRunning => runs_freely,
        Of::Direct => model.guided_by.is_some(),
    };
    CALIBRATED
        .iter()
        .filter(move |listed| is_moved(listed.of))
        .filter_map(|listed| Free::nominal(model, listed.section, listed.name))
        .filter(|free| {
            let place = free.place();
            !place.is_any_of(&model.own.everywhere) && !place.is_any_of(&model.own.untold)
        })
}

/// The same as [`recalibrated`], with what `believed` states as the prior, wherever `model` has got to.
#[must_use]
pub fn recalibrated_from(believed: &JointModel, model: &JointModel) -> Vec<Free> {
    recalibrated(model)
        .into_iter()
        .zip(recalibrated(believed))
        .map(|(free, before)| free.believed_to_be(before.start()))
        .collect()
}

/// Parameters of effect `effect` of `model` that single benches have for themselves.
#[must_use]
pub fn own_of_effect(model: &JointModel, effect: usize) -> Vec<Free> {
    let Some(id) = model.effects.get(effect).map(|active| active.descriptor().id) else { return Vec::new() };
    let belongs = |index: &usize| match model.own.values[*index].parameter {
        RigParameter::Effect { descriptor, .. } => descriptor.id == id,
        _ => false,
    };
    (0..model.own.values.len()).filter(belongs).filter_map(|index| Free::own(model, index)).collect()
}

#[cfg(test)]
mod tests {
    use bowden_model::channel::Channel;

    use super::*;
    use crate::test_bench;

    fn moved(model: &JointModel) -> Vec<String> {
        recalibrated(model).iter().map(|free| free.path(model)).collect()
    }

    #[test]
    fn the_rotors_inertia_is_moved_where_nothing_guides_the_motor() {
        let mut recording = test_bench::swung(10);
        recording.set(Channel::Duty, vec![0.1; 10]);
        let mut model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let rotor = "motor.rotor_inertia_kg_m2".to_owned();
        assert_eq!(model.drive().unwrap(), Drive::GuidedMotor);
        assert!(!moved(&model).contains(&rotor));
        model.inputs.retain(|channel| *channel != Channel::ThetaIn);
        assert_eq!(model.drive().unwrap(), Drive::Duty);
        assert!(moved(&model).contains(&rotor));
    }

    #[test]
    fn of_the_pulleys_the_ratio_is_moved_and_of_the_load_the_weight() {
        let model = JointModel::from_rig(&test_bench::rig(), &test_bench::swung(10)).unwrap();
        let moved = moved(&model);
        for (section, name) in [("pulleys", "output_radius_m"), ("load", "mass_kg")] {
            let of_section = moved.iter().filter(|path| path.starts_with(section));
            assert_eq!(of_section.collect::<Vec<_>>(), [&format!("{section}.{name}")]);
        }
    }

    #[test]
    fn what_is_believed_is_a_factor_by_where_it_comes_from() {
        let model = JointModel::from_rig(&test_bench::rig(), &test_bench::swung(10)).unwrap();
        for (path, spread) in [("pulleys.output_radius_m", 0.02), ("sheath.friction_coefficient", 0.5)] {
            let free = *recalibrated(&model).iter().find(|free| free.path(&model) == path).unwrap();
            // Where the value is a tenth more, ln 1.1 of the logarithm.
            let ln = |x: f64| (free.value_at(x) / free.start()).ln();
            let tenth_more = 1.1_f64.ln() / ln(1.0);
            assert!((ln(tenth_more) - 1.1_f64.ln()).abs() < 1e-12, "{path}");
            assert!((free.prior_residual(tenth_more) - 1.1_f64.ln() / spread).abs() < 1e-12, "{path}");
        }
    }
}
