//! Which nominal parameters a recalibration moves, what is believed of them before any recording, and from which change on the
//! rig file is said to be wrong.
//!
//! Of each product that a replay cannot tell apart one factor is moved: `μ` stands for `μ K`, `EA` for `EA / L`, the output radius
//! for the ratio of both radii, the weight for `m l`. An arm of its own would let weight and inertia go different ways, and a spring
//! at the joint would be taken for weight. The gear ratio is counted when a bench is built.

use bowden_model::parameters::NominalParameter;

use super::free::Free;
use crate::joint_model::{Drive, JointModel};
use crate::rig::RigParameter;

/// A nominal parameter that a recalibration moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibrated {
    /// Section of the rig file.
    pub section: &'static str,
    /// Key in it.
    pub name: &'static str,
    /// Standard deviation of the logarithm of what a user believes, by where the value usually comes from. Data that say anything
    /// outweigh it; a parameter that they do not touch stays where it was.
    pub spread: f64,
    /// Relative change from which on the rig file is wrong about it, and not just by what benches usually are.
    pub wrong_from: f64,
    /// Whether it is moved only where a replay does not follow the recorded angle of the motor.
    pub free_running: bool,
}

impl Calibrated {
    const fn new(section: &'static str, name: &'static str, spread: f64, wrong_from: f64) -> Self {
        Self { section, name, spread, wrong_from, free_running: false }
    }
}

/// All of them.
pub const CALIBRATED: [Calibrated; 8] = [
    // From a table of materials; lubrication halves it.
    Calibrated::new("sheath", "friction_coefficient", 0.5, 0.15),
    // From a data sheet of the rope, without its terminations. Contact along the sheath gives way beside it: short recordings of a
    // bench that hides nothing came out 15 % below.
    Calibrated::new("tendon", "axial_stiffness_n", 0.4, 0.2),
    // Set with a gauge when the tendons are mounted.
    Calibrated::new("tendon", "pretension_n", 0.2, 0.15),
    // From the motor's data sheet; the resistance with leads and bridge.
    Calibrated::new("motor", "resistance_ohm", 0.2, 0.1),
    Calibrated::new("motor", "torque_constant_nm_per_a", 0.2, 0.1),
    // Without what the gear adds, which data sheets leave out. A motor that is guided along its recorded angle shows little of it,
    // and stick and slip imitate that little.
    Calibrated { free_running: true, ..Calibrated::new("motor", "rotor_inertia_kg_m2", 0.7, 0.3) },
    // From a drawing or a caliper, without half the rope's thickness.
    Calibrated::new("pulleys", "output_radius_m", 0.02, 0.02),
    // Weighed, but not the arm that carries it.
    Calibrated::new("load", "mass_kg", 0.3, 0.1),
];

/// Standard deviation of what is believed of a nominal parameter that [`CALIBRATED`] does not list, where a bench has it for itself.
const UNLISTED_SPREAD: f64 = 0.5;

/// Relative change from which on such a parameter is wrong.
const UNLISTED_WRONG_FROM: f64 = 0.15;

/// The entry of a parameter.
#[must_use]
pub fn calibrated(section: &str, name: &str) -> Option<&'static Calibrated> {
    CALIBRATED.iter().find(|listed| listed.section == section && listed.name == name)
}

/// Standard deviation of the logarithm of what is believed of a nominal parameter.
#[must_use]
pub fn spread(parameter: &NominalParameter) -> f64 {
    calibrated(parameter.section, parameter.spec.name).map_or(UNLISTED_SPREAD, |listed| listed.spread)
}

/// Relative change from which on the rig file is wrong about the parameter `section.name`.
#[must_use]
pub fn wrong_from(path: &str) -> f64 {
    let listed = path.split_once('.').and_then(|(section, name)| calibrated(section, name));
    listed.map_or(UNLISTED_WRONG_FROM, |listed| listed.wrong_from)
}

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
    let runs_freely = matches!(model.drive(), Ok(Drive::Duty | Drive::Servo));
    CALIBRATED
        .iter()
        .filter(move |listed| runs_freely || !listed.free_running)
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
