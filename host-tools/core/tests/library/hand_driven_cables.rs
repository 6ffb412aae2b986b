//! Cables turned at the input and loaded with a torque at a joint without inertia: balance, free play, dry friction at
//! both ends. Expected values are those of two springs, worked out by hand.

use bowden_model::drive::BridgeInput;
use bowden_model::effect::{ActiveEffect, Component, MAX_STATE, MotorPort};
use bowden_model::effect_set::EffectSet;
use bowden_model::effects::find;
use bowden_model::friction_law::FrictionLaw;
use bowden_model::parameters::{
    JointParameters, PulleyParameters, SensorParameters, SheathParameters, TendonParameters,
};
use bowden_model::plant::{InputBoundary, OutputBoundary, Plant, PlantConfig, StepInput};
use bowden_model::transmission::Outside;

const R1_M: f64 = 0.009;
const R2_M: f64 = 0.010;
/// Stiffness of one cable, EA / L, N/m.
const K_N_PER_M: f64 = 20_000.0;
/// The same as a torque at the joint, 2 N·m/rad.
const K_NM_PER_RAD: f64 = K_N_PER_M * R2_M * R2_M;

fn effect(id: &str, parameter: &str, value: f64) -> ActiveEffect {
    ActiveEffect::with_defaults(find(id).unwrap()).with(parameter, value)
}

fn cables(pretension_n: f64, friction_coefficient: f64, effects: &[ActiveEffect]) -> PlantConfig {
    let parameters = JointParameters {
        motor: None,
        pulleys: Some(PulleyParameters { input_radius_m: R1_M, output_radius_m: R2_M }),
        tendon: Some(TendonParameters { length_m: 1.0, axial_stiffness_n: K_N_PER_M, pretension_n }),
        sheath: Some(SheathParameters { wrap_angle_rad: 3.0, friction_coefficient }),
        load: None,
        sensors: SensorParameters::default(),
        friction: FrictionLaw::Distributed,
    };
    let effects = EffectSet::from_slice(effects).unwrap();
    PlantConfig::new(parameters, 8, effects, InputBoundary::Angle, OutputBoundary::Torque).unwrap()
}

/// Turns the input to each angle in turn at 1 rad/s with the load of its place; the joint's angle after each.
fn turn(config: &PlantConfig, plant: &mut Plant, stops: &[(f64, f64)], dt_s: f64) -> Vec<f64> {
    let mut angles = Vec::new();
    for (to_rad, load_nm) in stops {
        let from_rad = plant.theta_in_rad();
        let steps = ((to_rad - from_rad).abs() / dt_s).ceil().max(1.0) as usize;
        for step in 1..=steps {
            let input = StepInput {
                bridge: BridgeInput { duty: 0.0, bus_v: 0.0, enabled: true },
                theta_in_rad: from_rad + (to_rad - from_rad) * step as f64 / steps as f64,
                theta_out_rad: 0.0,
                input_torque_nm: 0.0,
                loose_pulley: Outside::NOTHING,
                external_torque_nm: *load_nm,
            };
            plant.step(config, &input, dt_s);
        }
        angles.push(plant.theta_out_rad());
    }
    angles
}

fn near(got: f64, expected: f64, tolerance: f64) {
    assert!((got - expected).abs() < tolerance, "got {got}, expected {expected}");
}

#[test]
fn a_joint_without_inertia_is_balanced_within_one_step() {
    let config = cables(50.0, 0.0, &[]);
    let mut plant = Plant::at_rest(&config, 0.0, 0.0);
    // One step of a whole radian's fifth, with a load: both springs share it.
    let angle = turn(&config, &mut plant, &[(0.2, 0.1)], 0.2)[0];
    near(angle, 0.2 * R1_M / R2_M + 0.1 / (2.0 * K_NM_PER_RAD), 1e-7);
}

#[test]
fn the_balance_hardly_depends_on_the_step() {
    let slack = effect("tendon_slack", "looseness_m", 1e-4);
    let rub = effect("joint_coulomb_friction", "torque_nm", 0.02);
    let config = cables(0.01, 0.15, &[slack, rub]);
    let stops = [(0.3, 0.05), (-0.3, 0.05), (0.1, 0.05), (-0.2, 0.05), (0.0, 0.05)];
    let coarse = turn(&config, &mut Plant::at_rest(&config, 0.0, 0.0), &stops, 4e-3);
    let fine = turn(&config, &mut Plant::at_rest(&config, 0.0, 0.0), &stops, 1e-4);
    for (coarse, fine) in coarse.into_iter().zip(fine) {
        near(coarse, fine, 3e-4);
    }
}

#[test]
fn dry_friction_of_the_joint_leaves_it_behind_by_the_stretch_that_overcomes_it() {
    let config = cables(50.0, 0.0, &[effect("joint_coulomb_friction", "torque_nm", 0.08)]);
    let angles = turn(&config, &mut Plant::at_rest(&config, 0.0, 0.0), &[(0.4, 0.0), (-0.4, 0.0)], 1e-3);
    let lag_rad = 0.08 / (2.0 * K_NM_PER_RAD);
    near(angles[0], 0.36 - lag_rad, 1e-6);
    near(angles[1], -0.36 + lag_rad, 1e-6);
}

#[test]
fn loose_cables_leave_free_play_of_twice_their_looseness() {
    let config = cables(0.01, 0.2, &[effect("tendon_slack", "looseness_m", 3e-4)]);
    let mut plant = Plant::at_rest(&config, 0.0, 0.0);
    // Whichever way the load pushes, one cable alone holds it, after the looseness and the stretch of 0.04 N m. The
    // friction of a cable that only yields holds back part of it, so the last move winds against the load.
    let angles = turn(&config, &mut plant, &[(0.2, 0.04), (0.0, 0.04), (-0.2, -0.04), (0.0, -0.04)], 1e-3);
    let gap_rad = angles[1] - angles[3];
    let wrap: f64 = 0.6;
    // Winding in, the input end is tighter by e^(mu K); mean over the cable (e^x - 1)/x of the load's tension, or its
    // inverse when the load is let out.
    let stretch = |x: f64| 0.04 / K_NM_PER_RAD * (x.exp() - 1.0) / x;
    let free_rad = 2.0 * (3e-4 - 0.01 / K_N_PER_M) / R2_M;
    let (least, most) = (free_rad + 2.0 * stretch(-wrap), free_rad + 2.0 * stretch(wrap));
    assert!(
        gap_rad > least - 1e-3 * free_rad && gap_rad < most + 1e-3 * free_rad,
        "{least} {gap_rad} {most}"
    );
}

#[test]
fn slack_at_the_far_end_is_taken_up_before_the_near_end_pulls() {
    let config = cables(0.01, 0.2, &[effect("tendon_slack", "looseness_m", 3e-4)]);
    let mut plant = Plant::at_rest(&config, 0.0, 0.0);
    // The load moves the joint until cable b holds it: the slack of cable a collects at the output.
    turn(&config, &mut plant, &[(0.0, 0.02)], 1e-3);
    // Cable a has its own and b's looseness to take up, (2 · 0.3 mm + stretch) / 9 mm; before, it carries nothing.
    let taken_rad = 6e-4 / R1_M;
    turn(&config, &mut plant, &[(0.9 * taken_rad, 0.02)], 1e-4);
    assert_eq!(plant.end_tensions_n(&config)[0], 0.0);
}

#[test]
fn friction_of_the_spindle_shows_in_the_driving_torque_alone() {
    let with = cables(50.0, 0.1, &[effect("motor_coulomb_friction", "torque_nm", 0.015)]);
    let without = cables(50.0, 0.1, &[]);
    let (mut rubbing, mut free) = (Plant::at_rest(&with, 0.0, 0.0), Plant::at_rest(&without, 0.0, 0.0));
    for (stop, sign) in [(0.2, 1.0), (-0.1, -1.0)] {
        turn(&with, &mut rubbing, &[(stop, 0.1)], 1e-3);
        turn(&without, &mut free, &[(stop, 0.1)], 1e-3);
        near(rubbing.torque_in_nm(&with), free.torque_in_nm(&without), 1e-12);
        near(rubbing.driving_torque_nm(&with) - free.driving_torque_nm(&without), sign * 0.015, 1e-12);
    }
}

#[test]
fn gear_friction_grows_with_the_given_power_of_the_torque_carried() {
    let level = |exponent: f64| {
        let active = effect("gear_load_friction", "coefficient", 0.6).with("exponent", exponent);
        assert_eq!(active.descriptor().component, Component::Motor);
        let mut port = MotorPort {
            t_s: 0.0,
            dt_s: 1e-3,
            theta_rad: 0.0,
            omega_rad_s: 0.0,
            motor_torque_nm: 0.5,
            load_torque_nm: -0.2,
            carried_torque_nm: 0.5,
            torque_nm: 0.0,
            coulomb_nm: 0.1,
            presliding_rad: bowden_model::effect::PRESLIDING_RAD,
            build_up: bowden_model::dry_friction::BuildUp::Linear,
            gear_play_rad: 0.0,
            drag_behind_play: 0.0,
            standstill_excess_nm: 0.0,
        };
        active.effect.motor(&active.parameters, &mut [0.0; MAX_STATE], &mut port);
        port.coulomb_nm
    };
    near(level(1.0), 0.1 + 0.3, 1e-15);
    near(level(2.0), 0.1 + 0.15, 1e-15);
}
