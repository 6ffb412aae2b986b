//! Sheath friction of the correction against that of `bowden-model`: both pulleys turn at the same speed, so that the tendons
//! run through their sheaths, and the friction is the difference of the torques at both ends.

use bowden_control::correction::sheath::SheathCorrection;
use bowden_control::parameters::{Parameters, SheathFrictionParameters};
use bowden_control::scale::{Angle, Quantity, Speed, Torque};
use bowden_model::drive::BridgeInput;
use bowden_model::effect::ActiveEffect;
use bowden_model::effect_set::EffectSet;
use bowden_model::effects::find;
use bowden_model::friction_law::FrictionLaw;
use bowden_model::parameters::{
    JointParameters, PulleyParameters, SensorParameters, SheathParameters, TendonParameters,
};
use bowden_model::plant::{InputBoundary, OutputBoundary, Plant, PlantConfig, StepInput};
use bowden_model::transmission::Outside;

/// Speed, angle of the joint and angle by which the input pulley leads.
#[derive(Clone, Copy, Debug)]
struct Motion {
    speed_rad_s: f64,
    theta_out_rad: f64,
    lead_rad: f64,
}

/// Pulleys, tendons and sheaths of the bench as the parameters have it by default.
fn joint() -> JointParameters {
    JointParameters {
        motor: None,
        pulleys: Some(PulleyParameters { input_radius_m: 0.015, output_radius_m: 0.015 }),
        tendon: Some(TendonParameters { length_m: 1.0, axial_stiffness_n: 72_900.0, pretension_n: 30.0 }),
        sheath: Some(SheathParameters { wrap_angle_rad: std::f64::consts::PI, friction_coefficient: 0.12 }),
        load: None,
        sensors: SensorParameters::default(),
        friction: FrictionLaw::Distributed,
    }
}

/// Friction of both tendons and mean torque of both ends, N·m at the joint, after 0.2 rad of motion.
fn friction_nm(effects: &[ActiveEffect], motion: Motion) -> [f64; 2] {
    const STEPS: u32 = 2000;
    const TRAVEL_RAD: f64 = 0.2;
    let effects = EffectSet::from_slice(effects).unwrap();
    let config = PlantConfig::new(joint(), 32, effects, InputBoundary::Angle, OutputBoundary::Angle).unwrap();
    let Motion { speed_rad_s, theta_out_rad, lead_rad } = motion;
    let start_rad = theta_out_rad - TRAVEL_RAD * speed_rad_s.signum();
    let mut plant = Plant::at_rest(&config, start_rad, start_rad);
    let dt_s = TRAVEL_RAD / speed_rad_s.abs() / f64::from(STEPS);
    for step in 1..=STEPS {
        let share = f64::from(step) / f64::from(STEPS);
        let theta_out_rad = start_rad + share * TRAVEL_RAD * speed_rad_s.signum();
        let input = StepInput {
            bridge: BridgeInput { duty: 0.0, bus_v: 24.0, enabled: false },
            // The lead is there after a quarter of the way.
            theta_in_rad: theta_out_rad + lead_rad * (4.0 * share).min(1.0),
            theta_out_rad,
            input_torque_nm: 0.0,
            loose_pulley: Outside::NOTHING,
            external_torque_nm: 0.0,
        };
        plant.step(&config, &input, dt_s);
    }
    let [f1, f2, f3, f4] = plant.end_tensions_n(&config);
    let (torque_in, torque_out) = ((f1 - f3) * 0.015, (f2 - f4) * 0.015);
    [torque_in - torque_out, 0.5 * (torque_in + torque_out)]
}

/// The friction beyond the nominal one: of the model, and of the correction for the same motion.
fn both_nm(effect: ActiveEffect, set: impl Fn(&mut SheathFrictionParameters), motion: Motion) -> [f64; 2] {
    let [nominal, _] = friction_nm(&[], motion);
    let [friction, mean_torque] = friction_nm(&[effect], motion);
    let mut parameters = Parameters::default();
    (parameters.correction.sheath.enable, parameters.correction.sheath.limit) = (1.0, 10.0);
    set(&mut parameters.correction.sheath);
    let sheath = SheathCorrection::new(&parameters).unwrap();
    let corrected = sheath.friction_torque(
        Speed::from_f32(motion.speed_rad_s as f32),
        Angle::from_f32(motion.theta_out_rad as f32),
        Torque::from_f32(mean_torque as f32),
    );
    println!("{effect:?} {motion:?}: model {:.5}, correction {:.5}", friction - nominal, corrected.to_f32());
    [friction - nominal, f64::from(corrected.to_f32())]
}

fn effect(id: &str, parameters: &[(&str, f64)]) -> ActiveEffect {
    parameters.iter().fold(ActiveEffect::with_defaults(find(id).unwrap()), |effect, (name, value)| {
        effect.with(name, *value)
    })
}

/// Within 2 % of the effect, and 1 mN·m where the nominal friction is 339; `mu K` is 0.377.
fn check(effect: ActiveEffect, set: impl Fn(&mut SheathFrictionParameters)) {
    for speed_rad_s in [0.02, -0.1, 0.5] {
        for (theta_out_rad, lead_rad) in [(0.0, 0.0), (0.5, 0.0), (-0.5, 0.005), (0.2, -0.005)] {
            let motion = Motion { speed_rad_s, theta_out_rad, lead_rad };
            let [model, correction] = both_nm(effect, &set, motion);
            let allowed = 0.02 * model.abs() + 1e-3;
            assert!((model - correction).abs() < allowed, "{effect:?} {motion:?}: {correction} for {model}");
        }
    }
}

#[test]
fn friction_that_grows_with_speed() {
    check(effect("sheath_viscous_friction", &[]), |sheath| sheath.viscous = 60.0);
}

#[test]
fn friction_that_is_higher_at_low_speed() {
    let falling = effect("sheath_stribeck_friction", &[("static_ratio", 1.3)]);
    check(falling, |sheath| (sheath.excess, sheath.speed, sheath.exponent) = (0.3, 0.003, 1.5));
}

#[test]
fn friction_that_does_not_scale_with_tension() {
    check(effect("bending_friction", &[]), |sheath| sheath.bending = 0.6);
}

#[test]
fn sheaths_that_differ() {
    check(effect("asymmetric_friction", &[]), |sheath| sheath.asymmetry = 0.2);
}

#[test]
fn wrap_that_varies_with_the_pose() {
    check(effect("wrap_angle_varies_with_pose", &[]), |sheath| sheath.pose_slope = 1.0);
}
