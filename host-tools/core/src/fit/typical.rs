//! How large an effect usually is in a joint of a given size.
//!
//! The catalogue states sizes for a joint of the paper's size. In a finger that is a twentieth as strong the same fault is a
//! twentieth of the torque: starting points, steps of an optimiser and what is too weak for a name follow the joint.

use bowden_model::effect::{ActiveEffect, Component, Effect, ParameterSpec};
use bowden_model::load::GRAVITY_M_S2;

use crate::joint_model::JointModel;

/// Joint to which the catalogue's sizes belong: that of the paper with a 24 V motor of 2 Ω, 0.03 N·m/A and a gear of 30.
const STALL_NM: f64 = 10.8;
const POWER_W: f64 = 288.0;
const PRETENSION_N: f64 = 30.0;
const CABLE_TORQUE_NM: f64 = 0.45;
const WEIGHT_TORQUE_NM: f64 = 2.5 * GRAVITY_M_S2 * 0.03;
const MASS_KG: f64 = 2.5;

/// `effect` at its usual size in `model`.
#[must_use]
pub fn sized(model: &JointModel, effect: &'static dyn Effect) -> ActiveEffect {
    let mut sized = ActiveEffect::with_defaults(effect);
    let descriptor = effect.descriptor();
    for (value, spec) in sized.parameters.iter_mut().zip(descriptor.parameters) {
        *value = typical(model, descriptor.component, spec);
    }
    sized
}

/// Usual value of a parameter in `model`, within the range of the parameter.
#[must_use]
pub fn typical(model: &JointModel, component: Component, spec: &ParameterSpec) -> f64 {
    let size = match spec.unit {
        "N·m" | "N·m/rad" | "N·m·s/rad" => torque(model, component),
        "N/rad" | "N·s/m" => force(model),
        "kg" => model.parameters.load.map_or(0.0, |load| load.mass_kg / MASS_KG),
        "1/W" => model
            .parameters
            .motor
            .map_or(0.0, |motor| POWER_W / (motor.supply_v * motor.supply_v / motor.resistance_ohm)),
        _ => return spec.default,
    };
    // A part that the rig lacks, or states as nothing, tells no size.
    let size = if size.is_finite() && size > 0.0 { size } else { 1.0 };
    (size * spec.default).clamp(spec.lower, spec.upper)
}

/// Torques over those of the paper's joint: of a drive by what it can do, behind it by what cables and load bring; a torque of the joint that
/// the cables have to overcome, such as the slip of a drum, is a load.
fn torque(model: &JointModel, component: Component) -> f64 {
    let parameters = &model.parameters;
    let stall = model.strength_nm().map(|strength_nm| strength_nm / STALL_NM);
    if let (Component::Motor, Some(stall)) = (component, stall) {
        return stall;
    }
    let radius_m = |at_input: bool| {
        parameters.pulleys.map_or(0.0, |p| if at_input { p.input_radius_m } else { p.output_radius_m })
    };
    let cables = parameters.tendon.map_or(0.0, |tendon| {
        tendon.pretension_n * radius_m(component == Component::Motor) / CABLE_TORQUE_NM
    });
    let weight =
        parameters.load.map_or(0.0, |load| load.mass_kg * GRAVITY_M_S2 * load.arm_m / WEIGHT_TORQUE_NM);
    let overcome = |effect: &ActiveEffect| {
        let descriptor = effect.descriptor();
        let is_torque = descriptor.parameters.first().is_some_and(|spec| spec.unit == "N·m");
        let is_load = parameters.tendon.is_some() && descriptor.component == Component::Joint && is_torque;
        if is_load { effect.parameters[0].abs() / WEIGHT_TORQUE_NM } else { 0.0 }
    };
    let load = model.effects.iter().map(overcome).fold(weight, f64::max);
    let largest = cables.max(load);
    if largest > 0.0 { largest } else { stall.unwrap_or(0.0) }
}

/// Tensions over those of the paper's joint.
fn force(model: &JointModel) -> f64 {
    model.parameters.tendon.map_or(0.0, |tendon| tendon.pretension_n / PRETENSION_N)
}

#[cfg(test)]
mod tests {
    use bowden_model::effects::{CATALOGUE, find};

    use super::*;
    use crate::test_bench;

    fn bench() -> JointModel {
        let mut model = JointModel::from_rig(&test_bench::rig(), &test_bench::swung(2)).unwrap();
        model.parameters.pulleys.as_mut().unwrap().output_radius_m = 0.015;
        model
    }

    #[test]
    fn in_the_papers_joint_effects_have_the_catalogues_size() {
        for effect in CATALOGUE {
            let (sized, plain) = (sized(&bench(), effect), ActiveEffect::with_defaults(effect));
            for (a, b) in sized.parameters.iter().zip(plain.parameters) {
                assert!((a - b).abs() <= 1e-12 * b.abs(), "{sized:?} for {plain:?}");
            }
        }
    }

    /// Slack bands that turn a drum: 5 N·m of slip is nearly seven times the weight of the paper's joint; 0.05 N·m beside a weight is no load.
    #[test]
    fn a_torque_that_cables_overcome_is_a_load() {
        let friction = ActiveEffect::with_defaults(find("joint_coulomb_friction").unwrap());
        let spring_nm_per_rad = |pretension_n: f64, mass_kg: f64, torque_nm: f64| {
            let mut model = bench();
            model.parameters.tendon.as_mut().unwrap().pretension_n = pretension_n;
            model.parameters.load.as_mut().unwrap().mass_kg = mass_kg;
            model.effects = vec![friction.with("torque_nm", torque_nm)];
            sized(&model, find("joint_spring").unwrap()).parameters[0]
        };
        let usual = spring_nm_per_rad(30.0, 2.5, 0.05);
        assert!((usual / 0.3 - 1.0).abs() < 1e-9, "{usual}");
        let of_drum = spring_nm_per_rad(0.01, 0.0, 5.0);
        assert!((of_drum / (usual * 5.0 / 0.735_75) - 1.0).abs() < 1e-3, "{of_drum}");
    }

    /// A tenth of torque, force and power, at the same angles and speeds.
    #[test]
    fn effects_follow_the_size_of_the_joint() {
        let finger = test_bench::smaller(bench(), 0.1);
        for (id, want) in [
            ("motor_coulomb_friction", 0.008),
            ("motor_viscous_friction", 0.005),
            ("joint_spring", 0.03),
            ("joint_coulomb_friction", 0.005),
            ("bending_friction", 0.06),
            ("sheath_viscous_friction", 6.0),
            ("payload_change", 0.05),
            ("winding_heating", 0.5),
            ("joint_backlash", 0.02),
        ] {
            let effect = find(id).unwrap();
            let found = sized(&finger, effect).parameters[0];
            assert!((found / want - 1.0).abs() < 1e-9, "{id}: {found} for {want}");
        }
    }
}
